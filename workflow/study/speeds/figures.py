"""Figures of vehicles: motion of all wheelsets, guiding forces, and results over speed.

Units, colours and the difference between planar and spatial are those of :mod:`wrcore.analysis.pictures.style`.
"""

import numpy as np
from matplotlib.figure import Figure

from study.speeds.tables import hunting
from study.style import LINES, derailed_at, shared_legend
from wrcore.analysis.assessment.wheels import wheel_forces, wheelsets_of
from wrcore.analysis.pictures.style import ACCENT, MM, styled
from wrcore.geometry.track import SIDES
from wrcore.run.output.derived import quotient

KN = 1e-3

VEHICLES = (
    {"marker": "o", "markersize": 3.5},
    {"marker": "s", "markersize": 3.5, "markerfacecolor": "white"},
    {"marker": "^", "markersize": 4.0, "markerfacecolor": "white"},
)
"""Markers of the vehicles in a figure, in order."""

CRITICAL = ({"linestyle": "-."}, {"linestyle": ":"})
"""Line styles of the linear critical speeds of the vehicles in a figure, in order."""

SWINGS = 10
"""Number of oscillations of the leading wheelset in a figure of motion. With more, the lines would merge."""

LAST = 4.0
"""Duration at the end of a run for which forces are drawn, s."""

WIDE = (20.0, 1e5)
"""Range of the ratio of maximum to minimum value for which an axis is logarithmic."""


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


HUNTING = (
    ("amplitude_m", MM, "lateral amplitude / mm"),
    ("frequency_Hz", 1.0, "hunting frequency / Hz"),
    ("damping_ratio", 1.0, "damping ratio"),
)
"""Columns of the figure of hunting: name, factor to the printed unit, and label."""

RESPONSE = (
    ("Y_over_Q_max", 1.0, "largest Y/Q"),
    ("Y_max_N", KN, "largest Y / kN"),
    ("Q_max_N", KN, "largest Q / kN"),
    ("T_gamma_mean_N", 1.0, r"mean wear number T$\gamma$ / N"),
    ("car_body_ay_rms_m_per_s2", 1.0, "lateral acceleration, rms / (m/s²)"),
    ("car_body_az_rms_m_per_s2", 1.0, "vertical acceleration, rms / (m/s²)"),
)


@styled
def over_speed(tables, track, quantities, critical=None):
    """Draw the results of a sweep over speed (`speed_table` by vehicle) on one track, planar and spatial.

    Each (column, factor, label) of ``HUNTING`` or ``RESPONSE`` has a panel. Derailed runs are crosses at the top.
    Linear critical speeds (m/s) are marked, because vehicles hunt above them on any track.
    """
    rows = -(-len(quantities) // 3)
    figure = Figure(figsize=(7.6, 0.7 + 2.2 * rows), layout="constrained")
    panels = figure.subplots(rows, 3, sharex=True)
    for axes, (column, factor, label) in zip(np.ravel(panels), quantities, strict=True):
        for marker, (vehicle, table) in zip(VEHICLES, tables.items(), strict=False):
            for detection, line in LINES.items():
                part = table[(table["track"] == track) & (table["detection"] == detection)]
                values = factor * part[column].where(part["status"] == "completed")  # no line across missing values
                if values.notna().any():
                    style = {**line, **marker, "markevery": 2}
                    axes.plot(part["speed_m_per_s"], values, label=f"{vehicle}, {detection}", **style)
                derailed_at(axes, part.loc[part["status"] == "derailed", "speed_m_per_s"], line["color"])
        for look, (vehicle, speed) in zip(CRITICAL, (critical or {}).items(), strict=False):
            if np.isfinite(speed):
                axes.axvline(speed, color=ACCENT, linewidth=0.9, label=f"{vehicle}, linear critical", **look)
        axes.set(ylabel=label, yscale="log" if _wide(axes) else "linear")
    for axes in np.atleast_2d(panels)[-1]:
        axes.set_xlabel("speed / (m/s)")
    shared_legend(figure, np.ravel(panels), ncols=2)
    return figure


def _wide(axes):
    """Whether all values of a panel are positive and their ratio of maximum to minimum is in the range `WIDE`."""
    drawn = [line.get_ydata() for line in axes.lines if line.get_transform() == axes.transData]
    values = np.concatenate([[], *drawn])
    values = values[np.isfinite(values)]
    return bool(values.size) and values.min() > 0.0 and WIDE[0] < values.max() / values.min() < WIDE[1]
