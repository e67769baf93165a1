"""First contact points of a rigid wheelset without yaw that is lowered onto the rails.

Each wheel touches where the height of the wheelset's centre at contact,

    h(u) = f_rail(u_r) - (c sin(roll) - r cos(roll)),   u_r = y + c cos(roll) + r sin(roll) - d_rail,

has its maximum over the wheel's lateral coordinate u (c = half distance + u along the axle, r = r0 - f(u)). Formulas
are for the left side; the right side is its mirror image (y and roll change sign). Roll is either solved, so that both
wheels touch, or zero, so that each side is searched separately, as in the reference values of EN 15302.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import ArrayLike

from wrcore.contact.rigid.wheel_on_rail import WheelsetOnTrack
from wrcore.errors.checked_calls import Within, checked
from wrcore.kernels.jit import FAST, jit

if TYPE_CHECKING:
    import pandas as pd

NODE_STEP = 1e-4
"""Spacing of the wheel's nodes in the search for the first touch, m."""

_RESERVE = 1e-6
"""Distance below the highest node within which local maxima are refined, m; NODE_STEP^2 / 8 times 800 1/m."""

_ROLL_STEPS = 40

_LEVEL = 1e-9
"""Maximum difference of the heights of both sides, m. The search ends at 1e-12; a contact jump is 1e-7 or more."""

_HEIGHT, _U_WHEEL, _U_RAIL, _SLOPE, _RADIUS = range(5)


@jit(fastmath=FAST, inline="always")
def _hermite(nodes, start, step, u):
    """Value and slope of the cubic Hermite interpolant at ``u``; end cells are extrapolated."""
    position = (u - start) / step
    i = min(max(int(position), 0), nodes.shape[0] - 2)
    t = position - i
    d0, d1, rise = nodes[i, 1] * step, nodes[i + 1, 1] * step, nodes[i + 1, 0] - nodes[i, 0]
    c2, c3 = 3.0 * rise - 2.0 * d0 - d1, d0 + d1 - 2.0 * rise
    return nodes[i, 0] + t * (d0 + t * (c2 + t * c3)), (d0 + t * (2.0 * c2 + 3.0 * t * c3)) / step


@jit
def _height(side, u, y, cosine, sine):
    """Height (m) of the wheelset's centre for contact at wheel coordinate ``u``, its slope over u, u_r, f' and r."""
    extra, slope = _hermite(side.wheel, side.wheel_start, side.wheel_step, u)
    radius, reach = side.rolling_radius + extra, side.half_distance + u
    u_rail = y + reach * cosine + radius * sine - side.rail_distance
    f, df = _hermite(side.rail, side.rail_start, side.rail_step, u_rail)
    rate = df * (cosine + slope * sine) - (sine - slope * cosine)
    return f - reach * sine + radius * cosine, rate, u_rail, df, radius


@jit
def _summit(side, low, high, y, cosine, sine):
    """Wheel coordinate of the maximum height between ``low`` and ``high``; an end if there is no maximum inside."""
    while high - low > 1e-9:  # narrow the interval to one maximum: noisy profiles have several
        if _height(side, low, y, cosine, sine)[1] >= 0.0 >= _height(side, high, y, cosine, sine)[1]:
            break
        part, best, best_at = (high - low) / 8.0, -np.inf, 0
        for k in range(9):
            height = _height(side, low + k * part, y, cosine, sine)[0]
            if height > best:
                best, best_at = height, k
        low, high = low + max(best_at - 1, 0) * part, low + min(best_at + 1, 8) * part
    while high - low > 1e-13:
        middle = 0.5 * (low + high)
        if _height(side, middle, y, cosine, sine)[1] > 0.0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@jit
def _touch(side, y, roll, heights, found):
    """Fill ``found`` with the first touch of one side (mirrored to the left); NaN if it is at an end of a profile."""
    cosine, sine = math.cos(roll), math.sin(roll)
    rail_end = side.rail_start + side.rail_step * (side.rail.shape[0] - 1)
    n, best = heights.shape[0], -np.inf
    for k in range(n):
        height, _, u_rail, _, _ = _height(side, side.wheel_start + k * NODE_STEP, y, cosine, sine)
        heights[k] = height if side.rail_start <= u_rail <= rail_end else -np.inf
        best = max(best, heights[k])
    found[:] = np.nan
    for k in range(1, n - 1):
        before, after = heights[k - 1], heights[k + 1]
        if heights[k] < best - _RESERVE or heights[k] < before or heights[k] < after:
            continue
        if min(before, after) == -np.inf:  # touches with the end of the rail's profile
            continue
        low = side.wheel_start + (k - 1) * NODE_STEP
        u = _summit(side, low, low + 2.0 * NODE_STEP, y, cosine, sine)
        height, _, u_rail, df, radius = _height(side, u, y, cosine, sine)
        if math.isnan(found[_HEIGHT]) or height > found[_HEIGHT]:
            found[_HEIGHT], found[_U_WHEEL], found[_U_RAIL] = height, u, u_rail
            found[_SLOPE], found[_RADIUS] = df, radius


@jit
def _turn_rate(side, found, roll):
    """Derivative of a side's height with respect to the roll of this side at contact, m/rad (envelope theorem)."""
    cosine, sine = math.cos(roll), math.sin(roll)
    reach = side.half_distance + found[_U_WHEEL]
    sideways = found[_RADIUS] * cosine - reach * sine
    return found[_SLOPE] * sideways - reach * cosine - found[_RADIUS] * sine


@jit
def _touch_both(left, right, y, solve_roll, buffers, found):
    """Return the roll (rad) of the wheelset at lateral position ``y``; fill the contact points of both sides."""
    roll = 0.0
    for _ in range(_ROLL_STEPS):
        _touch(left, y, roll, buffers[0], found[0])
        _touch(right, -y, -roll, buffers[1], found[1])
        error = found[0, _HEIGHT] - found[1, _HEIGHT]
        if not solve_roll or not abs(error) > 1e-12:  # ends on NaN, too
            break
        roll -= error / (_turn_rate(left, found[0], roll) + _turn_rate(right, found[1], -roll))
    return roll


@jit
def _tabulate(left, right, shifts, solve_roll, rolls, found):
    """Fill rolls and contact points for all lateral positions; ``found`` has shape (n, 2, 5)."""
    nodes_left = int((left.wheel.shape[0] - 1) * left.wheel_step / NODE_STEP + 1e-9) + 1
    nodes_right = int((right.wheel.shape[0] - 1) * right.wheel_step / NODE_STEP + 1e-9) + 1
    buffers = (np.empty(nodes_left), np.empty(nodes_right))
    for i in range(shifts.shape[0]):
        rolls[i] = _touch_both(left, right, shifts[i], solve_roll, buffers, found[i])


@checked
def first_touch(
    pair: WheelsetOnTrack, shifts: Annotated[ArrayLike, Within(-0.1, 0.1, "m", dimensions=1)], roll: bool = True
) -> pd.DataFrame:
    """Compute first contact points of a rigid wheelset without yaw, and the rolling radius difference.

    Parameters
    ----------
    pair : WheelsetOnTrack
    shifts : array_like, shape (n,)
        Lateral positions y of the wheelset's centre, m, positive to the left.
    roll : bool
        True: roll is solved so that both wheels touch. False: roll is zero and each side is searched by itself, as
        the reference values of EN 15302 are.

    Returns
    -------
    pandas.DataFrame
        y_m, roll_rad, rolling_radius_difference_m (left less right) and, per side, u_wheel, u_rail (m, positive to
        the field side), contact_angle (rad, rotation about x, as in `wrcore.contact.search.detection`) and height (m,
        of the wheelset's centre above the rails' tops; alike on both sides if roll is solved). NaN where a profile ends
        before it touches. Flags, 0 or 1: profile_edge, a wheel touches with the end of a profile; not_level, the search
        for the roll ended with heights that differ by more than 1 nm.

    Examples
    --------
    >>> import wrcore as wr
    >>> pair = wr.WheelsetOnTrack.alike(wr.named_profile("S1002", "wheel"), wr.named_profile("60E1", "rail", 1 / 40))
    >>> touch = wr.first_touch(pair, [0.0, 0.003])
    >>> touch["rolling_radius_difference_m"].round(5).tolist()
    [0.0, 0.00096]
    """
    import pandas as pd

    shifts = np.atleast_1d(np.asarray(shifts, dtype=float))
    rolls, found = np.empty(shifts.size), np.empty((shifts.size, 2, 5))
    _tabulate(pair.left.geometry, pair.right.geometry, shifts, bool(roll), rolls, found)
    table = {"y_m": shifts, "roll_rad": rolls}
    table["rolling_radius_difference_m"] = found[:, 0, _RADIUS] - found[:, 1, _RADIUS]
    for i, (name, sign) in enumerate((("left", 1.0), ("right", -1.0))):
        table[f"u_wheel_{name}_m"] = found[:, i, _U_WHEEL]
        table[f"u_rail_{name}_m"] = found[:, i, _U_RAIL]
        table[f"contact_angle_{name}_rad"] = sign * np.arctan(found[:, i, _SLOPE])
        table[f"height_{name}_m"] = found[:, i, _HEIGHT]
    edge = np.isnan(found[..., _HEIGHT]).any(axis=1)
    gap = np.abs(found[:, 0, _HEIGHT] - found[:, 1, _HEIGHT])
    table |= {"profile_edge": edge.astype(int), "not_level": (bool(roll) & (gap > _LEVEL)).astype(int)}
    return pd.DataFrame(table)
