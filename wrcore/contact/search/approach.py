"""Penetration, normal and approach speed of all overlaps of a contact patch together.

With the vertical gap g of a left wheel's strips, the sum M0 of int g^2 du over the overlaps has the differential

    dM0 = 2 sum of int g dg du

for a displacement of the wheel. Let G be the magnitude of the gradient of M0 over y and z. A displacement along
n = -grad M0 / G by

    depth = 2.5 M0 / G

would separate a single parabolic overlap. This is its maximum penetration; the approach speed is (dM0/dt) / G. All
three are sums over the overlaps, so that they are continuous where two overlaps merge. The sums use the nodes of the
wheel profile. With the scan's nodes the position of an overlap fluctuates, which costs 0.2 m/s of critical speed with
contact from the lookup table.
"""

import math
from typing import NamedTuple

from wrcore.contact.search.detection import WIDE
from wrcore.contact.search.moved import ACROSS, ROLL, UP, YAW, slopes_of_square, smooth_nodes
from wrcore.contact.search.reduction import ANGLE, COSINE, CURVATURE_Y, PENETRATION, U_WHEEL, X, Y, Z
from wrcore.contact.search.scan import leaves_cells
from wrcore.contact.search.strip import (
    AHEAD,
    LIFT,
    changes_along,
    cubic_at,
    leaning,
    on_rail,
    strip_point,
    with_rail_along,
)
from wrcore.kernels.jit import FUSED, jit

LEVEL = 1.0, 0.0
"""Cosine and sine of the angle of axes without inclination, see `wrcore.contact.search.strip.lean_at`."""


class Pressed(NamedTuple):
    """Moments of the overlaps of a patch and their derivatives with respect to the position of the wheel.

    M0 (m^3) and M1, M0 times the mean wheel coordinate of the overlaps (m^4). Derivatives of M0 with respect to lateral
    and vertical displacement (m^2) and to rotation about x, y and z (m^3). Derivatives of M1 with respect to lateral
    and vertical displacement (m^3)."""

    square: float
    moment: float
    across: float
    up: float
    about_x: float
    about_y: float
    about_z: float
    moment_across: float
    moment_up: float


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def add_pressed(one, other):
    """Sum of the moments of two groups of overlaps, and of their derivatives."""
    return Pressed(
        one.square + other.square, one.moment + other.moment, one.across + other.across, one.up + other.up,
        one.about_x + other.about_x, one.about_y + other.about_y, one.about_z + other.about_z,
        one.moment_across + other.moment_across, one.moment_up + other.moment_up,
    )  # fmt: skip


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def approach_of(pressed, m):
    """Return penetration (m), cosine and sine of the normal's angle, and approach speed (m/s) for a motion ``m``."""
    size = math.sqrt(pressed.across * pressed.across + pressed.up * pressed.up)
    rate = pressed.across * m.vy + pressed.up * m.vz + pressed.about_x * m.wx + pressed.about_y * m.wy
    inverse = 1.0 / size
    rate += pressed.about_z * m.wz
    return 2.5 * pressed.square * inverse, -pressed.up * inverse, pressed.across * inverse, rate * inverse


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _strip_rates(gap, slope, px, py, pz):
    """Derivatives of g^2 of one strip with respect to the five motions of the wheel in `Pressed`.

    ``slope`` is the rail's slope; ``px``, ``py``, ``pz`` is the strip's point from the wheelset's centre (m)."""
    g = 2.0 * gap
    return -g * slope, g, g * (py + slope * pz), -g * px, -g * slope * px


@jit(allocates=False, fastmath=FUSED)
def _of_parabola(pose, row):
    """`Pressed` of an overlap with few nodes, from the parabola in its ``row``, found at this ``pose``."""
    depth, cosine = row[PENETRATION], row[COSINE]
    square = depth * depth * math.sqrt(depth / row[CURVATURE_Y]) / (0.9375 * cosine)
    gap = -1.25 * square * cosine / depth
    rates, u = _strip_rates(gap, math.tan(row[ANGLE]), row[X], row[Y] - pose.y, row[Z] - pose.z), row[U_WHEEL]
    return Pressed(square, square * u, *rates, u * rates[0], u * rates[1])


@jit(allocates=False, fastmath=FUSED)
def _strip_by_strip(geometry, pose, lean, nodes):
    """Return the number of nodes in overlap and the overlap's `Pressed`, summed node by node.

    ``lean`` is the inclination of the axes, see `wrcore.contact.search.strip.lean_at`."""
    square = moment = across = up = about_x = about_y = about_z = moment_across = moment_up = 0.0
    count = 0
    for k in range(nodes.first, nodes.end):
        u = nodes.u + k * nodes.step
        ur, height, radius, _, _, along = strip_point(geometry, pose, u)
        f, slope, _ = cubic_at(geometry.rail, geometry.rail_start, geometry.rail_step, ur)
        gap = height - f
        if gap < 0.0 and on_rail(geometry, ur):
            x = radius * along * pose.q + (geometry.half_distance + u) * pose.ex
            px, pz = with_rail_along(geometry, AHEAD, ur, 1.0, x), with_rail_along(geometry, LIFT, ur, 1.0, height)
            px, pz = leaning(geometry, lean, px, pz - pose.z)
            one = _strip_rates(gap, slope, px, ur + geometry.rail_distance - pose.y, pz)
            square, moment, count = square + gap * gap, moment + gap * gap * u, count + 1
            across, up = across + one[0], up + one[1]
            moment_across, moment_up = moment_across + one[0] * u, moment_up + one[1] * u
            about_x, about_y, about_z = about_x + one[2], about_y + one[3], about_z + one[4]
    step = nodes.step
    return count, Pressed(
        step * square, step * moment, step * across, step * up, step * about_x, step * about_y, step * about_z,
        step * moment_across, step * moment_up,
    )  # fmt: skip


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def pressed_from(pose, middle, sums):
    """`Pressed` of an overlap from the ``sums`` of `slopes_of_square`, which are relative to the coordinate ``middle``
    (m)."""
    roll, yaw = sums[0, 1 + ROLL], sums[0, 1 + YAW]
    turned = -(pose.ex * roll + pose.ez * yaw) / pose.ey  # rotation about the axle does not change M0
    across, up = sums[0, 1 + ACROSS], sums[0, 1 + UP]
    return Pressed(
        sums[0, 0], middle * sums[0, 0] + sums[1, 0], across, up, roll, turned, yaw,
        middle * across + sums[1, 1 + ACROSS], middle * up + sums[1, 1 + UP],
    )  # fmt: skip


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def pressed_by(geometry, pose, spatial, lean, row, sums):
    """`Pressed` of one overlap of a left wheel, whose ``row`` was found by moments at this ``pose``.

    ``sums`` (3, 1 + MOVES) is scratch."""
    if spatial and not changes_along(geometry) and not leaves_cells(pose):
        middle = slopes_of_square(geometry, pose, row, sums)
        return _of_parabola(pose, row) if math.isnan(middle) else pressed_from(pose, middle, sums)
    count, found = _strip_by_strip(geometry, pose, lean, smooth_nodes(geometry, pose, row)[0])
    return found if count >= WIDE else _of_parabola(pose, row)


@jit(allocates=False, fastmath=FUSED)
def pressed_together(geometry, pose, spatial, lean, rows, first, last, sums):
    """Sum of the `Pressed` of the overlaps in rows ``first`` to ``last`` - 1."""
    total = pressed_by(geometry, pose, spatial, lean, rows[first], sums)
    for k in range(first + 1, last):
        total = add_pressed(total, pressed_by(geometry, pose, spatial, lean, rows[k], sums))
    return total
