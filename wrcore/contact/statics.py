"""A wheelset at rest on the rails: height and roll at which each wheel carries a given vertical load."""

import math

import numpy as np

from wrcore._jit import jit
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

Z_RANGE = 0.03
"""Half of the range of heights that is searched around the nominal one, m."""

ROLL_RANGE = 0.05
"""Half of the range of roll angles that is searched, rad."""


@jit(allocates=False)
def wheel_at_rest(geometry, hertz, modulus, side, y, z, roll, yaw, spatial, reduction, patches):
    """Patches of one wheel in a given pose with their static normal forces (damping factor 1).

    Parameters
    ----------
    geometry : ContactGeometry
    hertz : HertzTable
    modulus : float
        Stiffness factor in front of Hertz's law, Pa: E* or, with the damping factor at rest, E* (1 + c_e)/2.
    side : float
        +1 left, -1 right.
    y, z, roll, yaw : float
        Pose of the wheelset, m and rad.
    spatial : bool
    reduction : int
        MAXIMUM or MOMENT.
    patches : numpy.ndarray, shape (MAX_PATCHES, PATCH_COLUMNS)
        Filled, including semi-axes and normal force.

    Returns
    -------
    count : int
        Number of patches.
    force : float
        Vertical force on the wheel, N.
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


@jit(allocates=False)
def height_at_load(geometry, hertz, modulus, side, y, roll, yaw, spatial, reduction, load, nominal, patches):
    """Wheelset height z (m) at which one wheel carries ``load`` (N) vertically; bisection to rounding.

    NaN if no height within ``Z_RANGE`` of ``nominal`` does.
    """
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


@jit
def settle(geometry, hertz, modulus, y, yaw, spatial, reduction, load, nominal):
    """Roll (rad) and height (m) at which each wheel carries ``load`` (N) vertically; NaN where there is none.

    The left wheel's own height falls and the right wheel's rises with roll, so bisection on their difference is safe.
    """
    patches = np.empty((MAX_PATCHES, PATCH_COLUMNS))
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
