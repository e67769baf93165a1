"""Figures of a run and a measured signal: overlay and difference, spectra, and fitted runs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from wrcore.analysis.pictures.plot_run import COLORS, HEIGHT, WIDTH, printed
from wrcore.analysis.pictures.style import plain, styled
from wrcore.signals.signal import AXIS_UNITS

if TYPE_CHECKING:
    from wrcore.analysis.measured.compare_signal import SignalComparison

AXIS_LABELS = {"t_s": "time / s", "s_m": "distance / m"}
TRANSFER_SHOWN = (0.1, 10.0)
"""Quotients of run and measurement that are drawn; beyond them a channel is noise."""

MEASURED, SIMULATED, DIFFERENCE = COLORS[0], COLORS[1], COLORS[2]


@styled
def plot_comparison(comparison: SignalComparison, channels: Sequence[str]) -> Figure:
    """Draw run and signal over time or distance, and run minus signal, a row per channel."""
    run, signal = comparison.run, comparison.signal
    figure = Figure(figsize=(1.4 * WIDTH, 0.9 + HEIGHT * len(channels)), layout="constrained")
    rows = figure.subplots(len(channels), 2, sharex=True, squeeze=False)
    for (left, right), channel in zip(rows, channels, strict=True):
        factor, label = printed(channel.rpartition(".")[2])
        left.plot(signal.x, factor * signal[channel], color=MEASURED, label="measured")
        left.plot(run.x, factor * run[channel], color=SIMULATED, linestyle="--", label="run")
        right.plot(run.x, factor * (run[channel] - signal[channel]), color=DIFFERENCE)
        left.set_title(_title(channel), loc="left")
        left.set(ylabel=label, xmargin=0)
        right.set(ylabel="difference" + "".join(label.partition(" / ")[1:]), xmargin=0)
    for axes in rows[-1]:
        axes.set_xlabel(AXIS_LABELS[run.axis])
    figure.suptitle(plain(f"full: measured, dashed: {run.source}; right: run minus measured"), x=0.01, ha="left")
    return figure


@styled
def plot_spectra(comparison: SignalComparison, channels: Sequence[str]) -> Figure:
    """Draw densities of run and signal, transfer function and coherence over frequency, a row per channel."""
    unit = AXIS_UNITS[comparison.run.axis][1]
    figure = Figure(figsize=(1.9 * WIDTH, 0.9 + 1.2 * HEIGHT * len(channels)), layout="constrained")
    rows = figure.subplots(len(channels), 3, sharex=True, squeeze=False)
    for (density, transfer, coherence), channel in zip(rows, channels, strict=True):
        table = comparison.spectra(channel).iloc[1:]
        factor, label = printed(channel.rpartition(".")[2])
        quantity = label.partition(" / ")[2]
        per_unit = "m" if unit == "1/m" else "/Hz"
        square = f"({quantity.replace('^2', '²')})² {per_unit}" if quantity else f"1 {per_unit}"
        density.loglog(table["frequency"], factor**2 * table["signal"], color=MEASURED)
        density.loglog(table["frequency"], factor**2 * table["run"], color=SIMULATED, linestyle="--")
        density.set(ylabel=f"density / {square}")
        density.set_title(_title(channel), loc="left")
        transfer.loglog(table["frequency"], table["transfer"], color=SIMULATED)
        transfer.axhline(1.0, color="0.6", linewidth=0.8)
        transfer.set(ylabel="run over measured", ylim=TRANSFER_SHOWN)
        coherence.semilogx(table["frequency"], table["coherence"], color=SIMULATED)
        coherence.set(ylabel="coherence", ylim=(0.0, 1.05), xmargin=0)
        for axis in (density.xaxis, transfer.xaxis, transfer.yaxis, coherence.xaxis):
            axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axis.set_major_formatter(StrMethodFormatter("{x:g}"))
            axis.set_minor_formatter(NullFormatter())
    for axes in rows[-1]:
        axes.set_xlabel(f"frequency / {unit}")
    figure.suptitle(plain(f"full: measured, dashed: {comparison.run.source}"), x=0.01, ha="left")
    return figure


def _title(channel):
    return plain(channel.rpartition(".")[0]).replace("_", " ")
