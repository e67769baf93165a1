"""Plots of the motion of wheelsets and of the forces on their wheels.

Planar and spatial detection have the styles of :mod:`wrcore.analysis.pictures.style`.
"""

import numpy as np
from matplotlib.figure import Figure

from wrcore.analysis.assessment.wheels import wheel_forces, wheelsets_of
from wrcore.analysis.motion import hunting
from wrcore.analysis.pictures.style import LINES, MM, shared_legend, styled
from wrcore.geometry.track import SIDES
from wrcore.run.output.derived import quotient


@styled
def lateral_position(cases, horizons=None):
    """Draw the lateral position of a wheelset over time with planar and with spatial detection.

    ``cases`` contain runs by title of the panel and by detection. Prediction ``horizons`` (s, by title) are marked.
    """
    figure = Figure(figsize=(6.6, 0.9 + 1.6 * len(cases)), layout="constrained")
    panels = figure.subplots(len(cases), 1, squeeze=False)[:, 0]
    for axes, (title, runs) in zip(panels, cases.items(), strict=True):
        for detection, line in LINES.items():
            axes.plot(runs[detection].t, MM * runs[detection]["wheelset"].y_m, label=detection, **line)
        mark_horizon(axes, (horizons or {}).get(title), max(run.t[-1] for run in runs.values()))
        axes.set_title(title, loc="left")
        axes.set(ylabel="y / mm", xmargin=0)
    panels[-1].set_xlabel("time / s")
    shared_legend(figure, panels)
    return figure


def mark_horizon(axes, horizon, end):
    """Mark the prediction horizon and shade the time after it, when neighbouring trajectories have separated."""
    if horizon is not None and horizon < end:
        axes.axvline(horizon, color="0.3", linewidth=0.9, linestyle="-.", label="prediction horizon")
        axes.axvspan(horizon, end, color="0.93", linewidth=0, zorder=0)


KN = 1e-3


SWINGS = 10
"""Number of oscillations of the leading wheelset in a figure of motion. With more, the lines would merge."""


LAST = 4.0
"""Duration at the end of a run for which forces are drawn, s."""


@styled
def lateral_motion(runs):
    """Draw the lateral position of every wheelset over the first `SWINGS` oscillations of the leading wheelset.

    ``runs`` are by title of the column, one per speed, and by detection. The title contains the drawn time if the run
    is longer.
    """
    names = wheelsets_of(next(iter(next(iter(runs.values())).values())))
    figure = Figure(figsize=(0.6 + 3.1 * len(runs), 1.1 + 1.15 * len(names)), layout="constrained")
    panels = figure.subplots(len(names), len(runs), squeeze=False, sharex="col", sharey="col")
    for column, (title, pair) in enumerate(runs.items()):
        shown, whole = _swings(pair["spatial"], names[0])
        part = f"first {shown:.2g} of {whole:g} s" if shown < whole else f"{whole:g} s"
        for row, name in enumerate(names):
            axes = panels[row, column]
            for detection, line in LINES.items():
                seen = pair[detection].t <= shown
                axes.plot(pair[detection].t[seen], MM * pair[detection][name].y_m[seen], label=detection, **line)
            axes.set(xmargin=0)
            axes.set_title(name.replace("_", " ") if row else f"{title}, {part}\n{name.replace('_', ' ')}", loc="left")
            axes.set_ylabel("y / mm")
        panels[-1, column].set_xlabel("time / s")
    shared_legend(figure, panels.ravel())
    return figure


def _swings(run, wheelset):
    """Return the time of `SWINGS` oscillations of a wheelset and the time of the whole run, s."""
    frequency, _, _ = hunting(run.t, run[wheelset].y_m)
    whole = float(run.t[-1])
    return (min(SWINGS / frequency, whole) if frequency > 0.0 else whole), whole


@styled
def guiding_forces(run, title, critical=None):
    """Draw vertical force Q, lateral force Y and Y/Q of every wheel over the last `LAST` seconds of a run.

    The title states whether the speed is below or above the vehicle's linear ``critical`` speed (m/s).
    """
    names = wheelsets_of(run)
    figure = Figure(figsize=(7.2, 0.9 + 1.35 * len(names)), layout="constrained")
    panels = figure.subplots(len(names), 3, squeeze=False, sharex=True, sharey="col")
    shown = run.t >= run.t[-1] - LAST
    lines = {"left": {"color": "0.1"}, "right": {"color": "0.55", "linestyle": (0, (4, 2))}}
    for row, name in enumerate(names):
        for side in SIDES:
            vertical, lateral = wheel_forces(run, name, side)
            series = (KN * vertical, KN * lateral, quotient(vertical, lateral))
            for axes, values, label in zip(panels[row], series, ("Q / kN", "Y / kN", "Y/Q"), strict=True):
                axes.plot(run.t[shown], values[shown], label=f"{side} wheel", **lines[side])
                axes.set(ylabel=label, xmargin=0)
        panels[row, 0].set_title(name.replace("_", " "), loc="left")
    for axes in panels[-1]:
        axes.set_xlabel("time / s")
    if critical is not None:
        side = "above" if run.scene["speed"] > critical else "below"
        title += f", {side} the linear critical speed" + (f" of {critical:.1f} m/s" if np.isfinite(critical) else "")
    figure.suptitle(title, fontsize=10, x=0.01, ha="left")
    shared_legend(figure, panels.ravel(), loc="outside lower right")
    return figure
