"""A wheelset at rest on the rails: height and roll at which each wheel carries a given vertical load."""

import math

import numpy as np

from wrcore.contact.detection import find_patches
from wrcore.contact.normal import hertz_ellipse
from wrcore.contact.reduction import (
    ANGLE,
    CURVATURE_X,
    CURVATURE_Y,
    MAX_PATCHES,
    NORMAL,
    PATCH_COLUMNS,
    PENETRATION,
    SEMI_A,
    SEMI_B,
)
from wrcore.kernels.handles import Handle
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
        stiffness, a_factor, b_factor = hertz_ellipse(hertz, row[CURVATURE_X], row[CURVATURE_Y])
        root = math.sqrt(row[PENETRATION])
        row[SEMI_A], row[SEMI_B] = a_factor * root, b_factor * root
        row[NORMAL] = modulus * stiffness * row[PENETRATION] * root
        force += row[NORMAL] * math.cos(row[ANGLE])
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
def _settle_near(geometry, hertz, modulus, y, yaw, spatial, reduction, load, nominal, patches):
    """As `settle`, by secants: far faster. NaN where it is lost."""
    roll = before = difference = 0.0
    slope, left, right = ROLL_SLOPE, nominal, nominal
    for k in range(25):
        left = _height_near(geometry, hertz, modulus, 1.0, y, roll, yaw, spatial, reduction, load, left, patches)
        right = _height_near(geometry, hertz, modulus, -1.0, y, roll, yaw, spatial, reduction, load, right, patches)
        if k > 0 and roll != before:
            slope = (left - right - difference) / (roll - before)
        difference, before = left - right, roll
        step = difference / slope
        if abs(step) < 1e-13:
            return roll, 0.5 * (left + right)
        if not abs(step) < LARGEST_TURN:
            break
        roll -= step
        left, right = left - 0.5 * slope * step, right + 0.5 * slope * step
    return np.nan, np.nan


@jit(nogil=True)
def settle(geometry, hertz, modulus, y, yaw, spatial, reduction, load, nominal):
    """Roll (rad) and height (m) at which each wheel carries ``load`` (N) vertically; NaN where there is none. The left
    wheel's own height falls and the right wheel's rises with roll, so bisection on their difference is safe; it runs
    where secants do not get there."""
    patches = np.empty((MAX_PATCHES, PATCH_COLUMNS))
    roll, z = _settle_near(geometry, hertz, modulus, y, yaw, spatial, reduction, load, nominal, patches)
    if not np.isnan(z):
        return roll, z
    low, high = -ROLL_RANGE, ROLL_RANGE
    left = right = 0.0
    for _ in range(60):
        roll = 0.5 * (low + high)
        left = height_at_load(geometry, hertz, modulus, 1.0, y, roll, yaw, spatial, reduction, load, nominal, patches)
        right = height_at_load(geometry, hertz, modulus, -1.0, y, roll, yaw, spatial, reduction, load, nominal, patches)
        # roll lifts the left wheel: too much of it and the left wheel must come down further than the right one
        if left < right or (np.isnan(left) and roll > 0.0) or (np.isnan(right) and roll > 0.0):
            high = roll
        else:
            low = roll
        if high - low < 1e-13:
            break
    return 0.5 * (low + high), 0.5 * (left + right)


def settle_apart(geometries, hertz, modulus, y, yaw, spatial, reduction, load, nominal):
    """As `settle`, for a left and a right wheel, or rail, that differ: ``geometries`` of both."""
    from scipy.optimize import brentq  # its import takes longer than most starts

    handles, patches = [Handle(geometry) for geometry in geometries], np.empty((MAX_PATCHES, PATCH_COLUMNS))

    def heights(roll):
        return [
            height_at_load(handle, hertz, modulus, side, y, roll, yaw, spatial, reduction, load, nominal, patches)
            for handle, side in zip(handles, (1.0, -1.0), strict=True)
        ]

    def difference(roll):
        left, right = heights(roll)
        return left - right if math.isfinite(left - right) else -roll

    if difference(-ROLL_RANGE) * difference(ROLL_RANGE) > 0.0:
        return math.nan, math.nan
    roll = brentq(difference, -ROLL_RANGE, ROLL_RANGE, xtol=1e-14)
    return roll, float(np.mean(heights(roll)))
