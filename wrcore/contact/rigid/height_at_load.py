"""A wheelset at rest on the rails: height and roll at which each wheel carries a given vertical load."""

import math
from typing import NamedTuple

import numpy as np

from wrcore.contact.hertz import loaded_ellipse
from wrcore.contact.search import reduction as columns
from wrcore.contact.search.detection import find_patches
from wrcore.kernels.jit import jit

Z_RANGE = 0.03
"""Half range of the search for heights around the nominal height, m."""

ROLL_RANGE = 0.05
"""Half range of the search for roll angles, rad."""


@jit(allocates=False)
def static_wheel_force(geometry, hertz, modulus, side, y, z, roll, yaw, spatial, reduction, patches):
    """Return the number of patches and the vertical force (N) of one wheel at rest (``side`` +1 left, -1 right).

    Fills ``patches`` (MAX_PATCHES, PATCH_COLUMNS), with semi-axes and normal forces. Position and attitude of the
    wheelset are in m and rad. ``modulus`` (Pa) is the stiffness factor of Hertz's law: E*, or E* (1 + c_e)/2 with the
    damping factor at rest."""
    ex, ey, ez = -math.sin(yaw) * math.cos(roll), math.cos(yaw) * math.cos(roll), math.sin(roll)
    count = find_patches(geometry, side, y, z, side * ex, side * ey, side * ez, spatial, reduction, patches)
    force = 0.0
    for k in range(count):
        row = patches[k]
        normal, row[columns.SEMI_A], row[columns.SEMI_B], _, _ = loaded_ellipse(
            hertz, modulus, 1.0, 1.0, row[columns.PENETRATION], row[columns.CURVATURE_X], row[columns.CURVATURE_Y], 0.0
        )
        row[columns.NORMAL] = normal
        force += normal * math.cos(row[columns.ANGLE])
    return count, force


FIRST_STEP = 1e-5
"""First step of the search for an interval of heights, m; each further step is four times as long."""

CLOSE = 1e-12
"""Relative error of F^(2/3) at which the search for a height ends: that of rounding of the height."""

ROLL_SLOPE = -1.5
"""First guess of d(z_left - z_right)/d(roll) of the heights at load of both wheels, m: minus the rails' distance."""

MOST_SECANTS = 20
"""Number of secant steps in the search for a height, after which its interval is halved instead."""

LARGEST_TURN = 0.02
"""Maximum step in roll of the secant method, rad."""

LEVEL = 1e-12
"""Maximum difference of the heights at load of both wheels, m. A penetration of 50 µm then has an error of 2e-8; the
searches end at 1e-13."""

BRANCH_REACH, BRANCH_STEP = 6e-5, 2e-6
"""Range and step of the search for a second height at load, m. Where overlaps merge into one patch, its force falls by
several per cent, so that a wheel carries its load at two heights. On S1002 and 60E1 they differ by 12 µm."""


@jit(allocates=False)
def _bisected_height(geometry, hertz, modulus, side, y, roll, yaw, spatial, reduction, load, low, high, patches):
    """Height (m) at which one wheel carries ``load`` (N), by bisection to rounding between ``low`` and ``high``.

    The force is larger than the load at ``low`` and smaller at ``high``."""
    while high - low > 1e-14:
        middle = 0.5 * (low + high)
        if middle == low or middle == high:
            break
        if (
            static_wheel_force(geometry, hertz, modulus, side, y, middle, roll, yaw, spatial, reduction, patches)[1]
            > load
        ):
            low = middle
        else:
            high = middle
    return low


@jit(allocates=False)
def height_at_load(geometry, hertz, modulus, side, y, roll, yaw, spatial, reduction, load, nominal, patches):
    """Wheelset height z (m) at which one wheel carries the vertical ``load`` (N), by bisection to rounding.

    NaN if there is no such height within ``Z_RANGE`` of ``nominal``."""
    low, high = nominal - Z_RANGE, nominal + Z_RANGE
    if static_wheel_force(geometry, hertz, modulus, side, y, low, roll, yaw, spatial, reduction, patches)[1] < load:
        return np.nan
    if static_wheel_force(geometry, hertz, modulus, side, y, high, roll, yaw, spatial, reduction, patches)[1] > load:
        return np.nan
    return _bisected_height(geometry, hertz, modulus, side, y, roll, yaw, spatial, reduction, load, low, high, patches)


@jit(allocates=False)
def _height_near(geometry, hertz, modulus, side, y, roll, yaw, spatial, reduction, load, guess, patches):
    """Height (m) at which one wheel carries ``load`` (N), from a guess; NaN without convergence.

    The method is regula falsi (Illinois) on F^(2/3), which is almost linear in z."""
    goal = load ** (2.0 / 3.0)
    z, step, last = guess, FIRST_STEP, 0
    low = high = np.nan
    excess_low = excess_high = 0.0
    for k in range(90):
        force = static_wheel_force(geometry, hertz, modulus, side, y, z, roll, yaw, spatial, reduction, patches)[1]
        excess = force ** (2.0 / 3.0) - goal
        if abs(excess) <= CLOSE * goal:
            return z
        pressed = excess > 0.0
        if pressed:
            low, excess_low = z, excess
            excess_high *= 0.5 if last > 0 else 1.0
        else:
            high, excess_high = z, excess
            excess_low *= 0.5 if last < 0 else 1.0
        if np.isnan(low) or np.isnan(high):
            z += step if pressed else -step
            step *= 4.0
            continue
        last = 1 if pressed else -1
        z = low + (high - low) * excess_low / (excess_low - excess_high)
        if k > MOST_SECANTS or not low < z < high:  # the force jumps over the load: find the place of the jump
            z = 0.5 * (low + high)
        if high - low < 1e-14 or z == low or z == high:
            return low
    return np.nan


@jit(allocates=False)
def _branch_height(geometry, hertz, modulus, side, y, roll, yaw, spatial, reduction, load, nominal, highest, patches):
    """Highest or lowest of the heights (m) near that of `height_at_load` at which one wheel carries ``load`` (N); NaN
    if there is none."""
    near = height_at_load(geometry, hertz, modulus, side, y, roll, yaw, spatial, reduction, load, nominal, patches)
    if np.isnan(near):
        return near
    step = -BRANCH_STEP if highest else BRANCH_STEP
    start = near - BRANCH_REACH * math.copysign(1.0, step)
    low = high = np.nan  # the wheel carries more at ``low``, less at ``high``
    for k in range(2 * int(BRANCH_REACH / BRANCH_STEP + 0.5) + 2):
        z = start + k * step
        pressed = (
            static_wheel_force(geometry, hertz, modulus, side, y, z, roll, yaw, spatial, reduction, patches)[1] > load
        )
        if pressed:
            low = z
        else:
            high = z
        if pressed == highest and k > 0:
            break
    if np.isnan(low) or np.isnan(high):
        return near
    return _bisected_height(geometry, hertz, modulus, side, y, roll, yaw, spatial, reduction, load, low, high, patches)


@jit(allocates=False)
def _settle_near(left, right, hertz, modulus, y, yaw, spatial, reduction, load, nominal, patches):
    """Roll (rad) and height (m) of `settle` by the faster secant method; NaN without convergence."""
    roll = before = difference = 0.0
    slope, z, other = ROLL_SLOPE, nominal, nominal
    for k in range(25):
        z = _height_near(left, hertz, modulus, 1.0, y, roll, yaw, spatial, reduction, load, z, patches)
        other = _height_near(right, hertz, modulus, -1.0, y, roll, yaw, spatial, reduction, load, other, patches)
        if k > 0 and roll != before:
            slope = (z - other - difference) / (roll - before)
        difference, before = z - other, roll
        step = difference / slope
        if abs(step) < 1e-13:
            if abs(difference) <= LEVEL:
                return roll, 0.5 * (z + other)
            break  # a height has jumped to another branch: the slope is that of the jump
        if not abs(step) < LARGEST_TURN:
            break
        roll -= step
        z, other = z - 0.5 * slope * step, other + 0.5 * slope * step
    return np.nan, np.nan


@jit(nogil=True)
def settle(left, right, hertz, modulus, y, yaw, spatial, reduction, load, nominal):
    """Return roll (rad) and height (m) at which each wheel carries the vertical ``load`` (N); NaN if impossible.

    ``left`` and ``right`` are `ContactGeometry`. If secants do not converge, bisection is used: with roll, the height
    of the left wheel falls and that of the right wheel rises, except at jumps (`BRANCH_REACH`). Bisection is repeated
    for each choice of branches until both heights are equal. If no choice succeeds, the roll with the minimum
    difference is returned; callers must compare the loads."""
    patches = np.empty((columns.MAX_PATCHES, columns.PATCH_COLUMNS))
    roll, z = _settle_near(left, right, hertz, modulus, y, yaw, spatial, reduction, load, nominal, patches)
    if not np.isnan(z):
        return roll, z
    best, gap = (np.nan, np.nan), np.inf
    for choice in range(4):
        high_left, high_right = choice in (0, 2), choice in (0, 3)
        low, high = -ROLL_RANGE, ROLL_RANGE
        for _ in range(60):
            roll = 0.5 * (low + high)
            z = _branch_height(left, hertz, modulus, 1.0, y, roll, yaw, spatial, reduction, load, nominal, high_left,
                               patches)  # fmt: skip
            other = _branch_height(right, hertz, modulus, -1.0, y, roll, yaw, spatial, reduction, load, nominal,
                                   high_right, patches)  # fmt: skip
            if abs(z - other) < gap:
                best, gap = (roll, 0.5 * (z + other)), abs(z - other)
            # roll lifts the left wheel: too much of it and the left wheel must come down further than the right one
            if z < other or (np.isnan(z) and roll > 0.0) or (np.isnan(other) and roll > 0.0):
                high = roll
            else:
                low = roll
            if high - low < 1e-13:
                break
        if gap <= LEVEL or gap == np.inf:
            break
    return best


CARRIED = 1e-4
"""Relative error of a wheel's load from which it counts as not carried. The searches leave 2e-6; where no height
carries a load, as where a reduction's force jumps over it, 1e-3 to 5e-2 are missing."""


def is_not_loaded(residual, load, penetration):
    """Whether wheels with a ``residual`` (...), carried less asked ``load`` (...), N, do not carry it; ``penetration``
    (..., patches), m, NaN without a patch. A height that is `LEVEL` off is no error: it matters for tiny loads only."""
    deepest = np.max(np.nan_to_num(penetration), axis=-1, initial=0.0)
    rounding = np.divide(1.5 * LEVEL, deepest, out=np.zeros_like(deepest), where=deepest > 0.0)
    return np.abs(residual) > load * (CARRIED + rounding)


class Bracket(NamedTuple):
    """Where a function that falls has its zero: between the last place where it was above and where it was not (NaN
    without), with its values there, halved as Illinois's rule says; the next place to try, the next step where there
    is no bracket yet, and the sign found last."""

    at: float
    step: float
    low: float
    high: float
    e_low: float
    e_high: float
    last: float


@jit(allocates=False, nogil=True)
def bracket_from(at, step):
    """No `Bracket` yet: where the search begins."""
    return Bracket(at, step, math.nan, math.nan, 0.0, 0.0, 0.0)


@jit(allocates=False, nogil=True)
def narrowed(b, e):
    """`Bracket` with the function's value at its place, and the next place."""
    if e > 0.0:
        low, e_low, high, e_high, last = b.at, e, b.high, b.e_high * (0.5 if b.last > 0.0 else 1.0), 1.0
    else:
        low, e_low, high, e_high, last = b.low, b.e_low * (0.5 if b.last < 0.0 else 1.0), b.at, e, -1.0
    if math.isnan(low) or math.isnan(high):
        return Bracket(b.at + last * b.step, 2.0 * b.step, low, high, e_low, e_high, 0.0)
    return Bracket(low + (high - low) * e_low / (e_low - e_high), b.step, low, high, e_low, e_high, last)


def height_of_zero(excess, z):
    """Zero of a function that falls with z, nearly linear near it: a bracket, then Illinois steps; NaN if lost."""
    bracket = bracket_from(z, 2e-5)
    for _ in range(60):
        e = excess(bracket.at)
        if math.isnan(e):
            return math.nan
        before, bracket = bracket.at, narrowed(bracket, e)
        if abs(bracket.at - before) < 1e-13 or bracket.high - bracket.low < 1e-13:
            return bracket.at
    return math.nan
