"""Kernels that find and describe the contact patches of a wheel for the training of the surrogate."""

import math

from wrcore.contact.creepage import creepages
from wrcore.contact.normal.gap import group_end
from wrcore.contact.search.approach import LEVEL, pressed_together
from wrcore.contact.search.detection import find_patches
from wrcore.contact.search.reduction import BEYOND, MOMENT, OUTSIDE
from wrcore.contact.search.strip import gap_at, make_pose
from wrcore.contact.surrogate.descriptors import describe
from wrcore.contact.surrogate.strips import close_strips, fill_strips
from wrcore.creep.kalker import coefficients_at
from wrcore.kernels.jit import jit
from wrcore.wheels.exact_force import copy_deepest
from wrcore.wheels.surrogate_patch import _pressed
from wrcore.wheels.table.lookup import APART, DISK, FAR, SADDLE, _at_ellipse, lobe_end, log_depth_of

LIMITS = APART, FAR, SADDLE
"""Limits of `lobe_end` below which several overlaps form one contact patch; `wrcore.wheels.surrogate_force` uses the
same limits."""

FLANGE, FIELD = -0.058, 0.050
"""Range of the wheel profile in which first contact is searched, m."""

_TOUCH_STEPS = 1200
"""Number of steps of the search for first contact. A step of 0.09 mm gives the height of a crown within 0.01 µm."""

PLACE, OVERLAPS, LOAD, LOG_A, LOG_B, P_MAX = range(6)
"""Columns of `Found.numbers`: position on the wheel profile (m) and number of overlaps. The other columns describe the
contact of a parabolic overlap with the same scales: load (N), ln of the semi-axes over 1 m, maximum pressure (Pa)."""


@jit(allocates=False)
def first_touch(geometry, y, ex, ey, ez):
    """Height of the wheelset's centre at which the wheel first touches the rail, m."""
    pose, least = make_pose(1.0, y, 0.0, ex, ey, ez, True), 1.0
    for k in range(_TOUCH_STEPS + 1):
        gap = gap_at(geometry, pose, FLANGE + (FIELD - FLANGE) * k / _TOUCH_STEPS)[0]
        if gap < 0.9:  # outside the profiles `gap_at` returns a gap of 1
            least = min(least, gap)
    return -least


@jit(allocates=False)
def find_described(model, position, rows, row, sums, strips, corrections, zeros, numbers, descriptors, shapes):
    """Fill ``numbers``, ``descriptors`` and ``shapes`` of the patches at a position; return the number of patches."""
    geometry, n, first = model.geometry, 0, 0
    y, z, ex, ey, ez = position[0], position[1], position[2], position[3], position[4]
    pose = make_pose(1.0, y, z, ex, ey, ez, True)
    count = find_patches(geometry, 1.0, y, z, ex, ey, ez, True, MOMENT, rows)
    while first < count and n < len(numbers):
        group = group_end(geometry, rows, count, first)
        while first < group and n < len(numbers):
            last = lobe_end(geometry, pose, rows, first, group, LIMITS)
            place = log_depth_of(pressed_together(geometry, pose, True, LEVEL, rows, first, last, sums))[1]
            copy_deepest(rows, first, last, row)
            low, high = rows[first, OUTSIDE], rows[last - 1, BEYOND]
            nodes, _ = fill_strips(geometry, pose, row, low, high, strips)
            total = close_strips(strips, nodes) if nodes > 0 else 0
            shape = describe(strips, total, nodes, geometry.rolling_radius, ez, model.friction, descriptors[n])
            if shape.square > 0.0:
                p = _pressed(model, shape, 1.0, corrections, zeros)
                numbers[n, PLACE], numbers[n, OVERLAPS], numbers[n, LOAD] = place, last - first, p.load
                numbers[n, LOG_A], numbers[n, LOG_B], numbers[n, P_MAX] = p.log_a, p.log_b, p.p_max
                for k in range(len(shape)):
                    shapes[n, k] = shape[k]
                n += 1
            first = last
    return n


@jit(allocates=False)
def fill_base(model, velocities, slip, log_a, log_b, angle, limit, base, disk):
    """Fill ``base`` (n, 3) with creep forces of the creep table and ``disk`` (n, 2) with positions in the unit disk.

    Both belong to ``velocities`` (n, 6) and have the normalisation of
    :func:`wrcore.wheels.surrogate_patch.roll_patch`."""
    cosine, sine = math.cos(angle), math.sin(angle)
    c11, c22, _, _ = coefficients_at(log_a - log_b, model.creep.table.kalker)
    unit = model.shear_modulus * math.exp(log_a + log_b) / (3.0 * limit)
    for k in range(len(velocities)):
        v = velocities[k]
        xi, eta, phi, _ = creepages(
            v[0], v[1], v[2], v[3], v[4], v[5], slip[0], slip[1], slip[2], cosine, sine, 1.0
        )  # fmt: skip
        base[k, 0], base[k, 1], base[k, 2], _, _ = _at_ellipse(model, log_a, log_b, limit, xi, eta, phi)
        p, q = xi * unit * c11, eta * unit * c22
        root = 1.0 / (DISK + math.sqrt(DISK * DISK + p * p + q * q))
        disk[k, 0], disk[k, 1] = p * root, q * root
