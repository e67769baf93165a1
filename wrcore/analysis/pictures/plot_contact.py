"""Plots of rigid contact over the lateral position of a wheelset: points, rolling radii, angles, conicity."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from wrcore.analysis.pictures.style import ACCENT, MM, RAIL, WHEEL, plain, styled
from wrcore.contact.rigid.conicity import en15302_tolerance
from wrcore.contact.rigid.first_touch import first_touch
from wrcore.contact.rigid.wheel_on_rail import WheelsetOnTrack
from wrcore.errors.checked_calls import checked
from wrcore.geometry.track import SIDES

LIFT = 0.020  # height by which the wheel is drawn above the rail, m
_LABEL_WIDTH = 3.5  # mm


@styled
def fig_contact_location(pair, table):
    """Draw contact points of `first_touch` (``table``) on wheel and rail, joined by a line for each lateral shift.

    Integer millimetres are labelled if there is space. The view is from behind, with the left side on the left. The
    wheels are drawn at y = 0, lifted by `LIFT`.
    """
    figure = Figure(figsize=(7.2, 3.2), layout="constrained")
    for axes, side in zip(figure.subplots(1, 2), SIDES, strict=True):
        _location(axes, pair, table, side)
        axes.set_title(
            plain(f"{side}, {getattr(pair, side).wheel.name} on {getattr(pair, side).rail.name}"), fontsize=9
        )
    return figure


def _location(axes, pair, table, side):
    sign, one = SIDES[side], getattr(pair, side)
    from_wheel, from_rail = pair.half_distance, pair.rail_distance(one)
    for curve, origin, lift, style in (
        (one.wheel, from_wheel, LIFT, {"color": WHEEL, "label": "wheel"}),
        (one.rail, from_rail, 0.0, {"color": RAIL, "label": "rail"}),
    ):
        axes.plot(sign * MM * (origin + curve.u), MM * (lift + curve.f), linewidth=1.6, **style)
    u_wheel, u_rail = table[f"u_wheel_{side}_m"].to_numpy(), table[f"u_rail_{side}_m"].to_numpy()
    y = sign * MM * np.array([from_wheel + u_wheel, from_rail + u_rail])
    z = MM * np.array([LIFT + one.wheel(u_wheel), one.rail(u_rail)])
    joints = axes.plot(y, z, color=ACCENT, linewidth=0.6)
    joints[0].set_label("contact at the shift in mm")
    _label_shifts(axes, MM * table.y_m.to_numpy(), y[0], z[0])
    inner, outer = np.nanmin(np.abs(y)) - 12.0, np.nanmax(np.abs(y)) + 12.0
    axes.set(xlabel="y, to the left / mm", ylabel="z / mm", ylim=(-20, MM * LIFT + 14))
    axes.set_xlim((outer, inner) if side == "left" else (-inner, -outer))
    axes.legend(fontsize=7, loc="lower left" if side == "left" else "lower right")


def _label_shifts(axes, shifts, across, height):
    """Write integer millimetres of shift above the wheel, small shifts first; omit labels that would overlap."""
    written: list[float] = []
    for k in np.argsort(np.abs(shifts)):
        whole = abs(shifts[k] - round(shifts[k])) < 1e-6 and np.isfinite(across[k])
        if whole and all(abs(across[k] - other) > _LABEL_WIDTH for other in written):
            text = f"{shifts[k]:.0f}".replace("-", "\N{MINUS SIGN}")
            at = {"textcoords": "offset points", "fontsize": 6, "ha": "center", "clip_on": True}
            axes.annotate(text, (across[k], height[k]), (0, 3), **at)
            written.append(across[k])


@checked
def plot_pair(pair: WheelsetOnTrack, shifts: ArrayLike | None = None) -> Figure:
    """Draw a pair of profiles with its contact points for several lateral positions of the wheelset.

    Parameters
    ----------
    pair : WheelsetOnTrack
    shifts : array_like, shape (n,), optional
        Lateral positions, m; default: -6 to 6 mm.

    Returns
    -------
    matplotlib.figure.Figure

    Examples
    --------
    >>> import wrcore as wr
    >>> pair = wr.WheelsetOnTrack.alike(wr.named_profile("S1002", "wheel"), wr.named_profile("60E1", "rail", 1 / 40))
    >>> [axes.get_title() for axes in wr.plot_pair(pair).axes]
    ['left, S1002 on 60E1', 'right, S1002 on 60E1']
    """
    shifts = 1e-3 * np.arange(-6, 7) if shifts is None else shifts
    return fig_contact_location(pair, first_touch(pair, shifts))


STYLES: tuple[dict[str, Any], ...] = (
    {"color": "#0072B2", "linestyle": "-"},
    {"color": "#E69F00", "linestyle": (0, (4, 2))},
    {"color": "#009E73", "linestyle": (0, (1, 1))},
    {"color": "#CC79A7", "linestyle": "-."},
)
"""Okabe-Ito colours, each with a different line style, to be distinguished in greyscale."""


THIN: dict[str, Any] = {"linewidth": 0.7, "marker": "o", "markersize": 2.5, "markevery": 4}


@styled
def fig_rolling_radius_difference(tables):
    """Plot rolling radius difference over lateral shift, from tables of `first_touch` by label."""
    figure, axes = _single()
    for style, (label, table) in zip(STYLES, tables.items(), strict=False):
        axes.plot(MM * table.y_m, MM * table.rolling_radius_difference_m, label=label, **style)
    axes.set(xlabel="lateral shift y, to the left / mm", ylabel="rolling radius difference,\nleft less right / mm")
    axes.legend(fontsize=8)
    return figure


@styled
def fig_contact_angle(tables):
    """Plot contact angles of both sides over lateral shift, from tables of `first_touch` by label.

    Angles are rotations about x: positive on a left wheel, negative on a right wheel.
    """
    figure, axes = _single()
    for style, (label, table) in zip(STYLES, tables.items(), strict=False):
        for side, width in zip(SIDES, (1.4, 0.8), strict=True):
            angle = MM * table[f"contact_angle_{side}_rad"]
            axes.plot(MM * table.y_m, angle, label=f"{label}, {side}", **{**style, "linewidth": width})
    axes.set(xlabel="lateral shift y, to the left / mm", ylabel="contact angle about x / mrad")
    axes.legend(fontsize=8)
    return figure


@styled
def fig_conicity(curves, reference=None):
    """Plot equivalent conicity over amplitude, from `conicity_curve` by label.

    A ``reference`` (amplitudes (m) and values) is drawn with the tolerance band of EN 15302.
    """
    figure, axes = _single()
    if reference is not None:
        amplitude, value = np.asarray(reference[0]), np.asarray(reference[1])
        half = en15302_tolerance(value)
        low = np.maximum(value - half, 0.0)
        axes.fill_between(MM * amplitude, low, value + half, color="0.87", linewidth=0, label="tolerance, EN 15302")
        axes.plot(MM * amplitude, value, "o", color="0.35", markersize=2.5, label="reference, EN 15302")
    for style, (label, curve) in zip(STYLES, curves.items(), strict=False):
        axes.plot(MM * curve.amplitude_m, curve.equivalent_conicity, label=label, **style)
    axes.set(xlabel="amplitude / mm", ylabel="equivalent conicity", ylim=(0, None))
    axes.legend(fontsize=8)
    return figure


@styled
def fig_conicity_of_pairs(table):
    """Plot equivalent conicity of several pairs (`conicity_table`) over amplitude, with and without roll."""
    figure, axes = _single()
    for style, (label, rows) in zip(STYLES, table.groupby("pair", sort=False), strict=False):
        amplitude = MM * rows.amplitude_m
        axes.plot(amplitude, rows.conicity_with_roll, label=label, **style)
        axes.plot(amplitude, rows.conicity_without_roll, **{**style, **THIN})
    axes.plot([], [], color="0.4", label="without roll (EN 15302)", **THIN)
    axes.set(xlabel="amplitude / mm", ylabel="equivalent conicity", ylim=(0, None))
    axes.legend(fontsize=7)
    return figure


@styled
def fig_location_with_yaw(table):
    """Plot lateral and longitudinal position of the left contact over shift and yaw (`location_with_yaw`)."""
    figure = Figure(figsize=(7.2, 3.0), layout="constrained")
    across, along = figure.subplots(1, 2)
    left = table[table.side == "left"]
    for style, (yaw, rows) in zip(STYLES, left.groupby("yaw_rad"), strict=False):
        label = f"yaw {MM * yaw:g} mrad"
        across.plot(MM * rows.y_m, MM * rows.u_wheel_m, label=label, **style)
        along.plot(MM * rows.y_m, MM * rows.x_m, label=label, **style)
    across.set(ylabel="contact point on the wheel,\nto the field side / mm", title="(a) across")
    along.set(ylabel="contact point ahead\nof the axle / mm", title="(b) along")
    for axes in (across, along):
        axes.set_xlabel("lateral shift y, to the left / mm")
    across.legend(fontsize=7)
    return figure


def _single():
    figure = Figure(figsize=(5.2, 3.2), layout="constrained")
    return figure, figure.subplots()
