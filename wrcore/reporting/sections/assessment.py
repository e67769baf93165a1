"""Section of a report: running safety by EN 14363 and ride comfort."""

from __future__ import annotations

import math
from typing import Any

import pandas as pd

from wrcore.analysis.assessment.assess import Assessment, assess
from wrcore.analysis.pictures.plot_assessment import CHANNELS
from wrcore.analysis.pictures.plot_run import printed
from wrcore.analysis.pictures.style import ACCENT
from wrcore.errors import InputError
from wrcore.reporting.page import Markup, Row, element, figure, grid, join, number, paragraph, quantities, table
from wrcore.reporting.panels import legend, line, panel
from wrcore.reporting.subject import Report, Subject

TITLE = "Assessment"

QUANTITIES = {
    "sum_Y": ("ΣY", "sum of guiding forces of a wheelset: 20 Hz low-pass, mean over 2 m", "kN", 1e-3),
    "Y_over_Q": ("Y/Q", "20 Hz low-pass, mean over 2 m", "", 1.0),
    "Q": ("Q", "vertical wheel force: 20 Hz low-pass", "kN", 1e-3),
    "Y_qst": ("Y quasi-static", "median in full curves", "kN", 1e-3),
    "Q_qst": ("Q quasi-static", "median in full curves", "kN", 1e-3),
}  # fmt: skip
"""Name, definition, printed unit and factor of each quantity of EN 14363."""

COMFORT = {
    "N_MV": ("N_MV", "mean comfort of EN 12299: 6 times the root of the sum of squares of the 95th percentiles of "
             "weighted accelerations"),
    "Wz_lateral": ("Wz lateral", "Sperling's ride index, lateral"),
    "Wz_vertical": ("Wz vertical", "Sperling's ride index, vertical"),
}  # fmt: skip


def section(report: Report) -> Markup:
    """Return the tables of EN 14363, EN 12299 and ISO 2631 for the runs that have the channels."""
    parts = [_safety(report), _comfort(report), _vibration(report)]
    return join(part for part in parts if part)


def _safety(report: Report) -> Markup:
    found = list(
        report.each("EN 14363", lambda s: _with_wheels(s, assess(s.run, "EN 14363", report.begin, report.freight)))
    )
    if not found:
        return Markup("")
    tables = [_limits(report, subject, assessment) for subject, assessment in found]
    panels = [
        _series(report, found, quantity) for quantity in QUANTITIES if quantity != "Q_qst"
    ]  # its series is that of Q
    text = "Values are the largest percentiles (0.15 % or 99.85 %; quasi-static: 50 %) of all sections and wheels. "
    text += "Share: value over limit. Limits are recalled from the standard, not read in it; filters are from "
    text += "secondary text. "
    text += "One run is no acceptance: the standard evaluates many sections of many runs."
    shared = legend([(s.label, s.color, False) for s, _ in found] if report.several else [])
    head = element("h3", "Running safety and track loading by EN 14363")
    return join([head, paragraph(text), grid(tables, "two"), shared, grid(panels)])


def _with_wheels(subject: Subject, assessment: Assessment) -> Assessment:
    if assessment.summary.empty:
        raise InputError("report", "EN 14363", "expected a section with values")
    return assessment


def _limits(report: Report, subject: Subject, assessment: Assessment) -> Markup:
    rows = []
    for row in assessment.summary.to_dict("records"):
        name, definition, unit, factor = QUANTITIES[row["quantity"]]
        where = f"{row['wheelset']} {row['side']}".replace("_", " ").strip()
        place = f"{where}, {row['begin_m']:.0f} to {row['end_m']:.0f} m"
        share = number(row["share"], 100.0)
        share = element("strong", share, class_="over") if row["share"] > 1.0 else share
        title = join([name, f" / {unit}" if unit else "", element("small", f"{definition}; {place}")])
        rows.append([title, number(row["value"], factor), number(row["limit"], factor), share])
    caption = f"EN 14363{', ' + subject.label if report.several else ''}"
    return table(["quantity", "value", "limit", "share / %"], rows, caption)


def _series(report: Report, found: list[tuple[Subject, Assessment]], quantity: str) -> Markup:
    having = [(subject, assessment) for subject, assessment in found
              if quantity in set(assessment.summary["quantity"])]  # fmt: skip
    if not having:
        return Markup("")
    factor, label = printed(CHANNELS.get(quantity, quantity))

    def draw(axes: Any) -> None:
        for subject, assessment in having:
            series = assessment.series[quantity]
            for column in series:
                look = {"color": subject.color, "alpha": 0.7, "linewidth": 0.8}
                line(axes, series.index.to_numpy(), factor * series[column].to_numpy(), report.bins, **look)
            for limits in assessment.limits.values():
                limit = factor * limits[quantity]
                if math.isfinite(limit):
                    for sign in (1.0,) if quantity.startswith("Q") else (-1.0, 1.0):
                        axes.axhline(sign * limit, color=ACCENT, linestyle="--", linewidth=0.8)
        axes.set(xlabel="time / s", ylabel=label, xmargin=0)

    name = QUANTITIES[quantity][0]
    return figure(panel(draw, f"EN 14363, {quantity}"), f"{name} after the filters, all wheels; dashed: limits.")


def _comfort(report: Report) -> Markup:
    found = list(report.each("EN 12299", lambda s: assess(s.run, "EN 12299", report.begin).summary))
    if not found:
        return Markup("")
    tables: dict[str, pd.DataFrame] = {s.label: summary.set_index("body") for s, summary in found}
    bodies = list(dict.fromkeys(body for summary in tables.values() for body in summary.index))
    rows = []
    for body in bodies:
        for key, (name, definition) in COMFORT.items():
            values = [
                float(tables[label].loc[body, key]) if label in tables and body in tables[label].index else math.nan
                for label in report.labels
            ]
            rows.append(Row(f"{body}.{key}", f"{body.replace('_', ' ')}: {name}", definition, "", 1.0, values))
    note = "At the centre of mass of each body. Weightings and N_MV follow public codes, Wz is recalled; none was read "
    note += "in a standard."
    head = element("h3", "Ride comfort by EN 12299 and Sperling")
    return join([head, quantities(rows, report.labels, "index and definition"), paragraph(note, class_="note")])


def _vibration(report: Report) -> Markup:
    found = list(report.each("ISO 2631", lambda s: assess(s.run, "ISO 2631", report.begin).summary))
    tables = []
    for subject, summary in found:
        rows = [
            [f"{row['body'].replace('_', ' ')}, {row['direction']} ({row['weighting']})",
             *(number(row[name]) for name in ("rms_m_per_s2", "MTVV_m_per_s2", "VDV_m_per_s1_75", "crest_factor"))]
            for row in summary.to_dict("records")
        ]  # fmt: skip
        title = f"Weighted accelerations, m/s² (VDV: m/s^1.75){', ' + subject.label if report.several else ''}"
        heads = ["body, direction (weighting)", "rms", "MTVV", "VDV", "crest factor"]
        tables.append(table(heads, rows, title))
    return join([element("h3", "Whole-body vibration by ISO 2631-1"), grid(tables, "two")]) if tables else Markup("")
