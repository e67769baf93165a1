"""Figures of computing time: growth with size, and time of an evaluation by stage.

Data are the tables of :mod:`study.cost`. Units, colours and style are those of :mod:`wrcore.analysis.pictures.style`.
"""

from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from wrcore.analysis.pictures.style import styled

SERIES = (
    {"color": "#0072B2", "marker": "o", "linestyle": "-"},
    {"color": "#E69F00", "marker": "s", "linestyle": (0, (4, 2))},
    {"color": "#000000", "marker": "^", "linestyle": "-."},
)
"""Okabe-Ito colours; marker and line style distinguish series in greyscale."""


@styled
def fig_growth(wheelsets, runs, scenes):
    """Plot time over number of wheelsets, duration, tolerance and number of scenes (`study.cost.growth`)."""
    figure = Figure(figsize=(7.2, 6.0), layout="constrained")
    (a, b), (c, d) = figure.subplots(2, 2)
    for (scene, part), style in zip(wheelsets.groupby("scene", sort=False), SERIES, strict=False):
        a.plot(
            part["wheelsets"], part["evaluation_us_per_wheelset"], markersize=4, label=f"{scene}: evaluation", **style
        )
        a.plot(
            part["wheelsets"], part["run_us_per_wheelset"], markersize=4, mfc="w", label=f"{scene}: in a run", **style
        )
    a.set_xscale("log", base=2)
    a.set(xlabel="wheelsets / 1", ylabel="time per wheelset / µs", title="(a) train")
    a.set_ylim(bottom=0.0)
    figure.legend(*a.get_legend_handles_labels(), loc="outside upper left", ncols=2, fontsize=8, title="(a)")
    durations, tolerances = (runs[runs["varied"] == name] for name in ("duration_s", "rtol"))
    b.errorbar(durations["value"], durations["run_ms"], _spread(durations, "run_ms"), markersize=4, **SERIES[0])
    b.set(xscale="log", yscale="log", xlabel="simulated time / s", ylabel="run / ms", title="(b) duration")
    c.errorbar(tolerances["value"], tolerances["run_ms"], _spread(tolerances, "run_ms"), markersize=4, **SERIES[0])
    c.set(xscale="log", yscale="log", xlabel="relative tolerance / 1", ylabel="run / ms", title="(c) tolerance")
    c.invert_xaxis()
    for (threads, part), style in zip(scenes.groupby("threads"), SERIES, strict=False):
        label = f"{threads} at a time"
        d.errorbar(part["scenes"], part["scene_ms"], _spread(part, "scene_ms"), markersize=4, label=label, **style)
    d.set_xscale("log", base=2)
    d.set(xlabel="scenes in one process / 1", ylabel="wall time per scene / ms", title="(d) scenes")
    d.set_ylim(bottom=0.0)
    d.legend(fontsize=7)
    for axis in (b.yaxis, c.yaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    for axis in (a.xaxis, b.xaxis, b.yaxis, c.yaxis, d.xaxis):
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_formatter(NullFormatter())
    return figure


def _spread(table, column):
    """Return distances (2, n) of the quartiles from the median, for error bars."""
    return [table[column] - table[f"{column}_low"], table[f"{column}_high"] - table[column]]


STAGE_COLOURS = {
    "bodies": "#000000", "suspension": "#0072B2", "joints": "#56B4E9", "search": "#D55E00", "patch": "#E69F00",
    "Hertz": "#F0E442", "creep": "#009E73", "rest": "0.8",
}  # fmt: skip
"""Okabe-Ito colours; numbers on the bars distinguish stages in greyscale."""


@styled
def fig_breakdown(table):
    """Plot the time of one evaluation by stage with the minimum time on this machine (`with_limits`)."""
    scenes = list(dict.fromkeys(table["scene"]))
    figure = Figure(figsize=(7.2, 0.7 + 2.1 * len(scenes)), layout="constrained")
    for axes, scene in zip(figure.subplots(len(scenes), 1, squeeze=False)[:, 0], scenes, strict=True):
        part = table[table["scene"] == scene].set_index("stage")
        whole, stages = part.loc["whole"], part.drop("whole")
        stages = stages[stages["ns"].abs() > 0.005 * whole["ns"]]
        colours = [STAGE_COLOURS[name] for name in stages.index]
        bars = axes.bar(stages.index, stages["ns"], color=colours, width=0.7)
        labels = [f"{ns:.0f} ns\n{100 * share:.0f} %" for ns, share in zip(stages["ns"], stages["share"], strict=True)]
        axes.bar_label(bars, labels, fontsize=7, padding=1)
        axes.hlines(stages["least_ns"], *_sides(bars), colors="w", lw=2.4)
        axes.hlines(stages["least_ns"], *_sides(bars), colors="k", lw=1.0, label="least by the machine")
        axes.set(ylabel="time / ns", ylim=(0.0, 1.3 * stages["ns"].max()))
        axes.set_title(f"{scene}: {whole['ns']:.0f} ns in all, {whole['times_least']:.1f} times the least", loc="left")
    axes.legend(fontsize=7)
    return figure


def _sides(bars):
    """Return left and right ends of bars."""
    return [bar.get_x() for bar in bars], [bar.get_x() + bar.get_width() for bar in bars]
