"""Figures of vehicles: motion of all wheelsets, guiding forces, and results over speed.

Units, colours and the difference between planar and spatial are those of :mod:`wrcore.analysis.pictures.style`.
"""

import numpy as np
from matplotlib.figure import Figure

from wrcore.analysis.pictures.plot_motion import KN
from wrcore.analysis.pictures.style import ACCENT, LINES, MM, derailed_at, shared_legend, styled

VEHICLES = (
    {"marker": "o", "markersize": 3.5},
    {"marker": "s", "markersize": 3.5, "markerfacecolor": "white"},
    {"marker": "^", "markersize": 4.0, "markerfacecolor": "white"},
)
"""Markers of the vehicles in a figure, in order."""

CRITICAL = ({"linestyle": "-."}, {"linestyle": ":"})
"""Line styles of the linear critical speeds of the vehicles in a figure, in order."""


WIDE = (20.0, 1e5)
"""Range of the ratio of maximum to minimum value for which an axis is logarithmic."""


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
