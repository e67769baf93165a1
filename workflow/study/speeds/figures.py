"""Figures of vehicles: motion of all wheelsets, guiding forces, and what changes with speed.

Units, colours and the difference between planar and spatial are those of :mod:`wrcore.analysis.style`.
"""

import numpy as np
from matplotlib.figure import Figure

from wrcore.analysis.motion import SIDES
from wrcore.analysis.style import LINES, MM, derailed_at, shared_legend, styled
from wrcore.analysis.wheels import wheel_forces, wheelsets_of
from wrcore.run.derived import quotient

KN = 1e-3

VEHICLES = ({"marker": "o", "markersize": 3.5}, {"marker": "s", "markersize": 3.5, "markerfacecolor": "white"})
"""Markers of the vehicles that one figure compares, in order."""


@styled
def lateral_motion(runs):
    """Lateral position of every wheelset over time, planar and spatial, one column per speed.

    Parameters
    ----------
    runs : dict of str to dict of str to Run
        Runs by title of the column and by detection.

    Returns
    -------
    matplotlib.figure.Figure
    """
    names = wheelsets_of(next(iter(next(iter(runs.values())).values())))
    figure = Figure(figsize=(0.6 + 3.1 * len(runs), 0.9 + 1.15 * len(names)), layout="constrained")
    panels = figure.subplots(len(names), len(runs), squeeze=False, sharex="col", sharey="col")
    for column, (title, pair) in enumerate(runs.items()):
        for row, name in enumerate(names):
            axes = panels[row, column]
            for detection, line in LINES.items():
                axes.plot(pair[detection].t, MM * pair[detection][name].y_m, label=detection, **line)
            axes.set(xmargin=0)
            axes.set_title(f"{name.replace('_', ' ')}, {title}", loc="left")
            axes.set_ylabel("y / mm")
        panels[-1, column].set_xlabel("time / s")
    shared_legend(figure, panels.ravel())
    return figure


@styled
def guiding_forces(run, title):
    """Vertical force Q, lateral force Y and Y/Q of every wheel of a run over time.

    Parameters
    ----------
    run : Run
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    names = wheelsets_of(run)
    figure = Figure(figsize=(7.2, 0.9 + 1.35 * len(names)), layout="constrained")
    panels = figure.subplots(len(names), 3, squeeze=False, sharex=True, sharey="col")
    lines = {"left": {"color": "0.1"}, "right": {"color": "0.55", "linestyle": (0, (4, 2))}}
    for row, name in enumerate(names):
        for side in SIDES:
            vertical, lateral = wheel_forces(run, name, side)
            series = (KN * vertical, KN * lateral, quotient(vertical, lateral))
            for axes, values, label in zip(panels[row], series, ("Q / kN", "Y / kN", "Y/Q"), strict=True):
                axes.plot(run.t, values, label=f"{side} wheel", **lines[side])
                axes.set(ylabel=label, xmargin=0)
        panels[row, 0].set_title(name.replace("_", " "), loc="left")
    for axes in panels[-1]:
        axes.set_xlabel("time / s")
    figure.suptitle(title)
    shared_legend(figure, panels.ravel())
    return figure


HUNTING = (
    ("amplitude_m", MM, "lateral amplitude / mm"),
    ("frequency_Hz", 1.0, "hunting frequency / Hz"),
    ("damping_ratio", 1.0, "damping ratio"),
)
"""Column, factor to the printed unit, and label."""

RESPONSE = (
    ("Y_over_Q_max", 1.0, "largest Y/Q"),
    ("Y_max_N", KN, "largest Y / kN"),
    ("Q_max_N", KN, "largest Q / kN"),
    ("T_gamma_mean_N", 1.0, r"mean wear number T$\gamma$ / N"),
    ("car_body_ay_rms_m_per_s2", 1.0, "lateral acceleration, rms / (m/s²)"),
    ("car_body_az_rms_m_per_s2", 1.0, "vertical acceleration, rms / (m/s²)"),
)


@styled
def over_speed(tables, track, quantities):
    """Results of a sweep over speed: every vehicle, planar and spatial. Runs that derailed are crosses at the top.

    Parameters
    ----------
    tables : dict of str to pandas.DataFrame
        By vehicle, from :func:`study.speeds.tables.speed_table`.
    track : str
        Which of the tables' tracks to show.
    quantities : sequence of (column, factor, label)
        One panel each: ``HUNTING`` or ``RESPONSE``.

    Returns
    -------
    matplotlib.figure.Figure
    """
    rows = -(-len(quantities) // 3)
    figure = Figure(figsize=(7.6, 0.7 + 2.2 * rows), layout="constrained")
    panels = figure.subplots(rows, 3, sharex=True)
    for axes, (column, factor, label) in zip(np.ravel(panels), quantities, strict=True):
        for marker, (vehicle, table) in zip(VEHICLES, tables.items(), strict=False):
            for detection, line in LINES.items():
                part = table[(table["track"] == track) & (table["detection"] == detection)]
                values = factor * part[column].where(part["status"] == "completed")  # a gap is not bridged
                if values.notna().any():
                    style = {**line, **marker, "markevery": 2}
                    axes.plot(part["speed_m_per_s"], values, label=f"{vehicle}, {detection}", **style)
                derailed_at(axes, part.loc[part["status"] == "derailed", "speed_m_per_s"], line["color"])
        axes.set(ylabel=label)
    for axes in np.atleast_2d(panels)[-1]:
        axes.set_xlabel("speed / (m/s)")
    shared_legend(figure, np.ravel(panels), ncols=2)
    return figure
