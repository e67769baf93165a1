"""Section of a report: chosen channels over time or distance."""

from __future__ import annotations

from typing import Any

import numpy as np

from wrcore.analysis.pictures.plot_run import printed, values_of
from wrcore.reporting.page import Markup, figure, grid, join
from wrcore.reporting.panels import legend, line, panel
from wrcore.reporting.subject import Report
from wrcore.run.output.channels import DESCRIPTIONS
from wrcore.run.output.run import Run

TITLE = "Motion"

MOST = 6
"""Largest number of channels that are drawn of a run without the default ones."""

VARIES = 0.01
"""Relative variation of a speed from which on it is drawn."""


def section(report: Report) -> Markup:
    """Return a panel for each channel, with a line for each run."""
    names = list(report.channels) or chosen(report)
    panels = [_panel(report, name) for name in names]
    shared = legend([(s.label, s.color, False) for s in report.subjects]) if report.several else Markup("")
    return join([shared, grid(panels)]) if any(panels) else Markup("")


def chosen(report: Report) -> list[str]:
    """Return the channels that are drawn by default: y and yaw of wheelsets, y, z and roll of the highest other
    body, and its speed if the speed varies."""
    run = report.subjects[0].run
    bodies = [name for name in run.groups if "/" not in name and name not in report.subjects[0].wheelsets]
    heights = {name: float(np.mean(run.groups[name].get("z_m", 0.0))) for name in bodies}
    bodies.sort(key=lambda name: -heights[name])
    wanted = [f"{name}.y_m" for name in report.wheelsets]
    wanted += [f"{name}.yaw_rad" for name in report.wheelsets[:1]]
    wanted += [f"{name}.{channel}" for name in bodies[:1] for channel in ("y_m", "z_m", "roll_rad")]
    first = next(iter([*bodies, *report.subjects[0].wheelsets]), "")
    speed = run.groups.get(first, {}).get("vx_m_per_s")
    if speed is not None and np.ptp(speed) > VARIES * np.abs(speed).max():
        wanted.append(f"{first}.vx_m_per_s")
    return [name for name in wanted if any(_has(subject.run, name) for subject in report.subjects)] or _any(run)


def _any(run: Run) -> list[str]:
    """Return the first channels of a run that has none of those that are drawn by default."""
    names = [f"{group}.{channel}" for group, channels in run.groups.items() for channel in channels if group]
    return names[:MOST]


def _has(run: Run, name: str) -> bool:
    group, _, channel = name.rpartition(".")
    return group in run.groups and run[group].follows(channel)


def _panel(report: Report, name: str) -> Markup:
    group, _, channel = name.rpartition(".")
    curves = [
        (subject, *found)
        for subject, found in report.each(
            f"Channel {name}",
            lambda subject: (
                (report.abscissa(subject, group), values_of(subject.run, name)) if _has(subject.run, name) else None
            ),
        )
        if found is not None
    ]
    if not curves:
        return Markup("")
    factor, label = printed(channel)

    def draw(axes: Any) -> None:
        for subject, x, values in curves:
            line(axes, x, factor * values, report.bins, color=subject.color)
        axes.set(xlabel=report.abscissa_label, ylabel=label, xmargin=0)

    about = DESCRIPTIONS.get(channel, channel.replace("_", " "))
    return figure(panel(draw, f"{name} over {report.over}"), f"{group.replace('_', ' ')}: {about}.")
