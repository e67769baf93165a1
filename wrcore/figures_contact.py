"""Figures of the rigid contact geometry: where the contact lies, what it does to the radii, and the conicity.

The first two work on the table of `wrcore.contact.first_touch.first_touch`, the last on curves of
`wrcore.contact.conicity.conicity_curve`. Units change here and nowhere before: lengths to mm, angles to mrad.
"""

import numpy as np
from matplotlib.figure import Figure

from wrcore.contact.conicity import en15302_tolerance
from wrcore.figures import ACCENT, MM, RAIL, WHEEL, styled
from wrcore.geometry.surface import SIDES

LIFT = 0.020
"""Height by which the wheel is drawn above the rail, m."""

_LABEL_WIDTH = 3.5  # mm

STYLES = (
    {"color": "#0072B2", "linestyle": "-"},
    {"color": "#E69F00", "linestyle": (0, (4, 2))},
    {"color": "#009E73", "linestyle": (0, (1, 1))},
    {"color": "#CC79A7", "linestyle": "-."},
)
"""Okabe-Ito colours, each with its own line: told apart in grey too."""


@styled
def fig_contact_location(pair, table):
    """Contact points on wheel and rail, joined by a line for each lateral shift of the wheelset.

    Seen from behind: the left side stands on the left. The wheels are drawn at y = 0, lifted by `LIFT`.

    Parameters
    ----------
    pair : WheelsetOnTrack
    table : pandas.DataFrame
        From `first_touch`, one row per line; whole millimetres of shift are labelled where there is room.

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = Figure(figsize=(7.2, 3.2), layout="constrained")
    for axes, side in zip(figure.subplots(1, 2), SIDES, strict=True):
        _location(axes, pair, table, side)
        axes.set_title(f"{side}, {getattr(pair, side).wheel.name} on {getattr(pair, side).rail.name}", fontsize=9)
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
    axes.plot(y, z, color=ACCENT, linewidth=0.6)
    _label_shifts(axes, MM * table.y_m.to_numpy(), y[0], z[0])
    inner, outer = np.nanmin(np.abs(y)) - 12.0, np.nanmax(np.abs(y)) + 12.0
    axes.set(xlabel="y, to the left / mm", ylabel="z / mm", ylim=(-20, MM * LIFT + 14))
    axes.set_xlim((outer, inner) if side == "left" else (-inner, -outer))
    axes.legend(fontsize=7, loc="lower left" if side == "right" else "lower right")


def _label_shifts(axes, shifts, across, height):
    """Write whole millimetres of shift above the wheel, small shifts first; leave out what would overlap."""
    written = []
    for k in np.argsort(np.abs(shifts)):
        whole = abs(shifts[k] - round(shifts[k])) < 1e-6 and np.isfinite(across[k])
        if whole and all(abs(across[k] - other) > _LABEL_WIDTH for other in written):
            text = f"{shifts[k]:.0f}".replace("-", "\N{MINUS SIGN}")
            at = {"textcoords": "offset points", "fontsize": 6, "ha": "center", "clip_on": True}
            axes.annotate(text, (across[k], height[k]), (0, 3), **at)
            written.append(across[k])


@styled
def fig_rolling_radius_difference(tables):
    """Rolling radius difference over the lateral shift.

    Parameters
    ----------
    tables : dict of str to pandas.DataFrame
        From `first_touch`, by label.

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure, axes = _single()
    for style, (label, table) in zip(STYLES, tables.items(), strict=False):
        axes.plot(MM * table.y_m, MM * table.rolling_radius_difference_m, label=label, **style)
    axes.set(xlabel="lateral shift y, to the left / mm", ylabel="rolling radius difference,\nleft less right / mm")
    axes.legend(fontsize=8)
    return figure


@styled
def fig_contact_angle(tables):
    """Contact angles of both sides over the lateral shift.

    Parameters
    ----------
    tables : dict of str to pandas.DataFrame
        From `first_touch`, by label. Angles are rotations about x: positive on a left wheel, negative on a right one.

    Returns
    -------
    matplotlib.figure.Figure
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
    """Equivalent conicity over the amplitude, with the tolerance band of EN 15302 around a reference.

    Parameters
    ----------
    curves : dict of str to pandas.DataFrame
        From `conicity_curve`, by label.
    reference : tuple of array_like, optional
        Amplitudes (m) and reference values.

    Returns
    -------
    matplotlib.figure.Figure
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


def _single():
    figure = Figure(figsize=(5.2, 3.2), layout="constrained")
    return figure, figure.subplots()
