"""Section of a report: spectra of accelerations."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from wrcore.analysis.assessment.ride import rate_of
from wrcore.reporting.page import Markup, Row, figure, grid, join, paragraph, quantities, raised
from wrcore.reporting.panels import legend, line, panel
from wrcore.reporting.subject import Report, Subject

TITLE = "Spectra of accelerations"

DIRECTIONS = {"ay_m_per_s2": "lateral", "az_m_per_s2": "vertical"}

SEGMENT = 2.0
"""Length of a segment of Welch's method, s: the spacing of frequencies is its inverse."""

MOST_BODIES = 4

LOWEST = 0.5
"""Lowest frequency that is drawn, Hz."""


def section(report: Report) -> Markup:
    """Return the power spectral density of the accelerations of bodies, and their root mean squares."""
    bodies = chosen(report)
    if not bodies:
        return Markup("")
    panels, rows = [], []
    for body in bodies:
        for channel, direction in DIRECTIONS.items():
            function = partial(spectrum, report, body, channel)
            found = list(report.each(f"Spectrum of {body}.{channel}", function))
            name = f"{body.replace('_', ' ')}, {direction}"
            panels.append(_panel(report, found, name))
            rms = {s.label: power for s, (_, _, power) in found}
            values = [rms.get(label, np.nan) for label in report.labels]
            rows.append(Row(f"{body}.{channel}", name, "", "m/s²", 1.0, values))
    text = (
        f"Power spectral density by Welch's method: Hann windows of {SEGMENT:g} s, or of a run that is shorter, which "
    )
    text += (
        "overlap by half; the mean is subtracted. Accelerations are those of the centre of mass, in the track's axes."
    )
    shared = legend([(s.label, s.color, False) for s in report.subjects]) if report.several else Markup("")
    return join([paragraph(text), shared, grid(panels), quantities(rows, report.labels, "root mean square")])


def chosen(report: Report) -> list[str]:
    """Return the bodies with accelerations that are drawn: bodies without wheels first, the
    highest first."""
    groups = list(dict.fromkeys(
        name for s in report.subjects for name, channels in s.run.groups.items() if set(DIRECTIONS) <= channels.keys()
    ))  # fmt: skip
    wheelsets = {name for s in report.subjects for name in s.wheelsets}
    heights: dict[str, float] = {}
    for subject in report.subjects:
        for name in groups:
            if "z_m" in (channels := subject.run.groups.get(name, {})):
                heights[name] = float(np.mean(channels["z_m"]))
    return sorted(groups, key=lambda name: (name in wheelsets, -heights.get(name, 0.0)))[:MOST_BODIES]


def spectrum(report: Report, body: str, channel: str, subject: Subject) -> tuple[np.ndarray, np.ndarray, float]:
    """Return frequencies (Hz), power spectral density ((m/s²)²/Hz) and root mean square (m/s²) of an acceleration."""
    from scipy import signal

    rate = rate_of(subject.run, 0.0, "spectra")
    values = subject.run.groups[body][channel][report.late(subject)]
    length = min(len(values), round(SEGMENT * rate))
    frequency, density = signal.welch(values, rate, nperseg=length)
    return frequency, density, float(np.sqrt(np.mean((values - values.mean()) ** 2)))


def _power(value: float, _: object) -> str:
    """Return a power of 10 as text: 1, 10, 100, or with an exponent."""
    return f"{value:g}" if 0.05 < value < 5e3 else f"10{raised(round(np.log10(value)))}"


def _panel(report: Report, found: list[Any], name: str) -> Markup:
    if not found:
        return Markup("")

    def draw(axes: Any) -> None:
        top = 0.0
        for subject, (frequency, density, _) in found:
            seen = (frequency >= LOWEST) & (density > 0.0)
            line(axes, frequency[seen], density[seen], color=subject.color)
            top = max(top, density[seen].max(initial=0.0))
        axes.set(xscale="log", yscale="log", xlabel="frequency / Hz", ylabel="(m/s²)² / Hz", xmargin=0)
        if top > 0.0:
            axes.set_ylim(bottom=max(1e-6 * top, axes.get_ylim()[0]))
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_locator(LogLocator(numticks=5))
            axis.set_major_formatter(FuncFormatter(_power))
            axis.set_minor_formatter(NullFormatter())

    return figure(panel(draw, f"Spectrum, {name}"), f"{name}.")
