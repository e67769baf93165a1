"""Section of a report: forces between wheels and rails."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd

from wrcore.analysis.assessment.wheels import wheel_forces, wheel_table
from wrcore.geometry.track import SIDES
from wrcore.reporting.page import Markup, figure, grid, join, number, paragraph, table
from wrcore.reporting.panels import legend, line, panel
from wrcore.reporting.subject import SIDE_COLORS, Report, Subject
from wrcore.run.output.derived import quotient

TITLE = "Wheel forces"

QUANTITIES = {"Q": (1e-3, "Q / kN"), "Y": (1e-3, "Y / kN"), "Y/Q": (1.0, "Y/Q")}

COLUMNS = {
    "Q_mean_N": ("Q mean", 1e-3), "Q_min_N": ("Q min", 1e-3), "Q_max_N": ("Q max", 1e-3), "Y_mean_N": ("Y mean", 1e-3),
    "Y_max_N": ("|Y| max", 1e-3), "Y_over_Q_max": ("|Y/Q| max", 1.0),
}  # fmt: skip


def section(report: Report) -> Markup:
    """Return Q, Y and Y/Q of wheels over time or distance, and a table of all wheels for each run."""
    parts = [panel_of_sides(report, name, quantity, *QUANTITIES[quantity], _forces(quantity))
             for name in report.wheelsets for quantity in QUANTITIES]  # fmt: skip
    tables = [_table(report, subject, found) for subject, found in
              report.each("Table of wheel forces", lambda subject: wheel_table(subject.run, report.begin))]  # fmt: skip
    if not any(parts) and not tables:
        return Markup("")
    text = "Q: vertical force of a wheel on its rail, downwards positive. Y: lateral force in the plane of the track, "
    text += "positive to the field side: a flange pushes with positive Y. Forces are not filtered."
    return join([paragraph(text), legend_of_sides(report), grid(parts), _shown(report), grid(tables, "two")])


def _forces(quantity: str) -> Callable[[Subject, str, str], np.ndarray]:
    def values(subject: Subject, wheelset: str, side: str) -> np.ndarray:
        vertical, lateral = wheel_forces(subject.run, wheelset, side)
        return {"Q": vertical, "Y": lateral, "Y/Q": quotient(vertical, lateral)}[quantity]

    return values


def legend_of_sides(report: Report) -> Markup:
    """Return the legend of panels with lines for left and right wheels."""
    if not report.several:
        return legend([(f"{side} wheel", color, side == "right") for side, color in SIDE_COLORS.items()])
    entries = [
        (f"{subject.label}, {side}", subject.color, side == "right") for subject in report.subjects for side in SIDES
    ]
    return legend(entries)


def _shown(report: Report) -> Markup:
    total = len({name for subject in report.subjects for name in subject.wheelsets})
    if total == len(report.wheelsets):
        return Markup("")
    return paragraph(f"Drawn are {len(report.wheelsets)} of {total} wheelsets.", class_="note")


def panel_of_sides(
    report: Report, wheelset: str, quantity: str, factor: float, label: str,
    values: Callable[[Subject, str, str], np.ndarray],
) -> Markup:  # fmt: skip
    """Return a panel with a line for the left and the right wheel of a wheelset in each run; empty without values."""
    having = [subject for subject in report.subjects if wheelset in subject.wheelsets]
    curves = [
        (subject, *found) for subject, found in report.each(f"{quantity} of {wheelset}", lambda subject: (
            report.abscissa(subject, f"{wheelset}/left"), {side: values(subject, wheelset, side) for side in SIDES}
        ) if subject in having else None) if found is not None
    ]  # fmt: skip
    if not curves:
        return Markup("")

    def draw(axes: Any) -> None:
        for subject, x, sides in curves:
            for side, found in sides.items():
                look = {"color": subject.color if report.several else SIDE_COLORS[side]}
                line(axes, x, factor * found, report.bins, linestyle=(0, (5, 2)) if side == "right" else "-", **look)
        axes.set(xlabel=report.abscissa_label, ylabel=label, xmargin=0)

    return figure(
        panel(draw, f"{quantity} of {wheelset} over {report.over}"), f"{wheelset.replace('_', ' ')}: {quantity}"
    )


def _table(report: Report, subject: Subject, found: pd.DataFrame) -> Markup:
    rows = [
        [f"{row['wheelset'].replace('_', ' ')} {row['side']}",
         *(number(row[name], factor) for name, (_, factor) in COLUMNS.items())]
        for row in found.to_dict("records")
    ]  # fmt: skip
    title = f"Forces, kN{', ' + subject.label if report.several else ''}"
    return table(["wheel", *(name for name, _ in COLUMNS.values())], rows, title)
