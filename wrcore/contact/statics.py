"""A wheelset at rest on the rails: height and roll at which each wheel carries a given vertical load."""

import math
from typing import NamedTuple

import numpy as np

from wrcore.contact import reduction as columns
from wrcore.contact.detection import find_patches
from wrcore.contact.normal import loaded_ellipse
from wrcore.kernels.jit import jit

Z_RANGE = 0.03
"""Half of the range of heights that is searched around the nominal one, m."""

ROLL_RANGE = 0.05
"""Half of the range of roll angles that is searched, rad."""


@jit(allocates=False)
def wheel_at_rest(geometry, hertz, modulus, side, y, z, roll, yaw, spatial, reduction, patches):
    """Number of patches of one wheel (``side`` +1 left, -1 right) in a pose of the wheelset (m, rad) and the vertical
    force on it (N), at rest; fills ``patches`` (MAX_PATCHES, PATCH_COLUMNS), semi-axes and normal forces with them.

    ``modulus`` (Pa) is the stiffness factor in front of Hertz's law: E*, or E* (1 + c_e)/2 with the damping factor at
    rest.
    """
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
"""First step of the search for two heights around the one sought, m; each next one is four times as long."""

CLOSE = 1e-12
"""Relative error of F^(2/3) that ends the search for a height: what the rounding of a height leaves."""

ROLL_SLOPE = -1.5
"""First guess of the change with roll of the left wheel's own height less the right wheel's, m: the rails' distance."""

MOST_SECANTS = 20
"""Heights tried before the search for one halves its interval instead."""

LARGEST_TURN = 0.02
"""A step in roll beyond this is not trusted, rad."""


@jit(allocates=False)
def height_at_load(geometry, hertz, modulus, side, y, roll, yaw, spatial, reduction, load, nominal, patches):
    """Wheelset height z (m) at which one wheel carries ``load`` (N) vertically; bisection to rounding. NaN if no height
    within ``Z_RANGE`` of ``nominal`` does."""
    low, high = nominal - Z_RANGE, nominal + Z_RANGE
    if wheel_at_rest(geometry, hertz, modulus, side, y, low, roll, yaw, spatial, reduction, patches)[1] < load:
        return np.nan
    if wheel_at_rest(geometry, hertz, modulus, side, y, high, roll, yaw, spatial, reduction, patches)[1] > load:
        return np.nan
    while high - low > 1e-14:
        middle = 0.5 * (low + high)
        if middle == low or middle == high:
            break
        if wheel_at_rest(geometry, hertz, modulus, side, y, middle, roll, yaw, spatial, reduction, patches)[1] > load:
            low = middle
        else:
            high = middle
    return low


@jit(allocates=False)
def _height_near(geometry, hertz, modulus, side, y, roll, yaw, spatial, reduction, load, guess, patches):
    """As `height_at_load`, from a guess: regula falsi (Illinois) on F^(2/3), almost linear in z. NaN if it is lost."""
    goal = load ** (2.0 / 3.0)
    z, step, last = guess, FIRST_STEP, 0
    low = high = np.nan
    excess_low = excess_high = 0.0
    for k in range(90):
        force = wheel_at_rest(geometry, hertz, modulus, side, y, z, roll, yaw, spatial, reduction, patches)[1]
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
def _settle_near(left, right, hertz, modulus, y, yaw, spatial, reduction, load, nominal, patches):
    """As `settle`, by secants: far faster. NaN where it is lost."""
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
            return roll, 0.5 * (z + other)
        if not abs(step) < LARGEST_TURN:
            break
        roll -= step
        z, other = z - 0.5 * slope * step, other + 0.5 * slope * step
    return np.nan, np.nan


@jit(nogil=True)
def settle(left, right, hertz, modulus, y, yaw, spatial, reduction, load, nominal):
    """Roll (rad) and height (m) at which each wheel, of `ContactGeometry` ``left`` and ``right``, carries ``load`` (N)
    vertically; NaN where there is none. The left wheel's own height falls and the right wheel's rises with roll, so
    bisection on their difference is safe; it runs where secants do not get there."""
    patches = np.empty((columns.MAX_PATCHES, columns.PATCH_COLUMNS))
    roll, z = _settle_near(left, right, hertz, modulus, y, yaw, spatial, reduction, load, nominal, patches)
    if not np.isnan(z):
        return roll, z
    low, high = -ROLL_RANGE, ROLL_RANGE
    z = other = 0.0
    for _ in range(60):
        roll = 0.5 * (low + high)
        z = height_at_load(left, hertz, modulus, 1.0, y, roll, yaw, spatial, reduction, load, nominal, patches)
        other = height_at_load(right, hertz, modulus, -1.0, y, roll, yaw, spatial, reduction, load, nominal, patches)
        # roll lifts the left wheel: too much of it and the left wheel must come down further than the right one
        if z < other or (np.isnan(z) and roll > 0.0) or (np.isnan(other) and roll > 0.0):
            high = roll
        else:
            low = roll
        if high - low < 1e-13:
            break
    return 0.5 * (low + high), 0.5 * (z + other)


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
