"""The thing itself: a wheel on its rail, and the patch between them."""

import numpy as np
from matplotlib.figure import Figure

import wrcore as wr
from wrcore.analysis.style import ACCENT, MM, RAIL, WHEEL, styled

AROUND = 0.045
"""Half the width of the cross-section shown, m."""

ARROW = 0.022
"""Length of the arrow of the force, m."""


@styled
def fig_wheel_on_rail(pair, load, y, rolling):
    """Left wheel on its rail, to scale, and pressure, traction, adhesion and slip in the patch between them.

    Parameters
    ----------
    pair : WheelsetOnTrack
    load : float
        Of a wheel, N.
    y : float
        Lateral position of the wheelset, m.
    rolling : dict
        speed (m/s) and friction.

    Returns
    -------
    matplotlib.figure.Figure
    """
    (*_, patch) = sorted(wr.patch(pair, y, load=load, speed=rolling["speed"], mu=rolling["friction"]), key=_normal)
    figure = Figure(figsize=(8.4, 3.9), layout="constrained")
    section, field = figure.subplots(1, 2, width_ratios=[1.0, 1.1])
    _draw_section(section, pair, patch)
    patch.plot(field)
    field.set_title(f"the patch: {1e-6 * patch.p_max:.0f} MPa at most, {1e6 * patch.area:.0f} mm²", loc="left")
    return figure


def _normal(patch):
    return patch.normal


def _draw_section(axes, pair, patch):
    """The cross-section seen from behind, the wheelset in the patch's pose."""
    side, (y, z, roll, _) = pair.left, patch.pose
    across, radius = pair.half_distance + side.wheel.u, side.rolling_radius - side.wheel.f
    wheel = y + across * np.cos(roll) + radius * np.sin(roll), z + across * np.sin(roll) - radius * np.cos(roll)
    rail = pair.rail_distance(side) + side.rail.u, side.rail.f
    at = patch.origin[1], patch.origin[2]
    axes.fill_between(MM * wheel[0], MM * wheel[1], MM, color=WHEEL, alpha=0.35, linewidth=0)
    axes.fill_between(MM * rail[0], MM * rail[1], -MM, color=RAIL, alpha=0.5, linewidth=0)
    axes.plot(MM * wheel[0], MM * wheel[1], color=WHEEL)
    axes.plot(MM * rail[0], MM * rail[1], color="0.4")
    _, lateral, vertical = patch.track_force / np.linalg.norm(patch.track_force)
    tip = MM * (at[0] + ARROW * lateral), MM * (at[1] + ARROW * vertical)
    arrow = {"arrowstyle": "-|>", "color": ACCENT, "linewidth": 1.6, "shrinkA": 0.0, "shrinkB": 0.0}
    axes.annotate("", tip, (MM * at[0], MM * at[1]), arrowprops=arrow)
    axes.text(tip[0] - 2.0, tip[1], f"{1e-3 * np.linalg.norm(patch.track_force):.0f} kN", color=ACCENT)
    middle = pair.half_distance
    axes.set(xlim=(MM * (middle + AROUND), MM * (middle - AROUND)), ylim=(-26.0, 40.0), aspect="equal")
    axes.set(xlabel="y, to the left / mm", ylabel="z, up / mm")
    axes.set_title(f"left wheel, {MM * y:g} mm off the centre", loc="left")
