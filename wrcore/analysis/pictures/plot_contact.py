"""Plot of the contact points of a wheel profile and a rail profile over the lateral position of the wheelset."""

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from wrcore.analysis.pictures.style import ACCENT, MM, RAIL, WHEEL, plain, styled
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
