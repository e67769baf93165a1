"""Strips of the wheel across one contact patch: the input data of the surrogate.

The strips are at nodes of the wheel profile: at every fourth one on a tread
(:func:`wrcore.contact.search.moved.smooth_nodes`). Where these are more than `ENOUGH`, only every second or every
fourth of them has a strip; 32 or more are then left.
"""

import math
from typing import NamedTuple

import numpy as np

from wrcore.contact.search.approach import Pressed
from wrcore.contact.search.geometry import ALONG, DOWN_2, DOWN_4, DOWN_6, LANES, RADIUS
from wrcore.contact.search.moved import STEEP, smooth_nodes
from wrcore.contact.search.reduction import BEYOND, OUTSIDE
from wrcore.contact.search.scan import leaves_cells
from wrcore.contact.search.strip import (
    AHEAD,
    BEND,
    LIFT,
    changes_along,
    cubic_at,
    leaning,
    on_rail,
    strip_point,
    wheel_slope,
    with_rail_along,
)
from wrcore.kernels import lanes
from wrcore.kernels.jit import FUSED, jit

MOST_STRIPS = 1024
"""Maximum number of strips of one patch."""

ENOUGH = 64
"""Number of nodes above which only every second node has a strip; above twice this number, every fourth."""

_END_STRIPS = 16
"""Number of array elements reserved for the ends of overlaps."""

_NO_RAIL = 1.0
"""Gap of a strip beyond the end of the rail's profile, m."""

_ANGLE_SERIES = tuple(
    np.polynomial.chebyshev.Chebyshev.interpolate(
        lambda q: np.arctan(np.sqrt(q)) / np.sqrt(q), 10, [0.0, 0.81]
    ).convert(kind=np.polynomial.Polynomial).coef
)  # fmt: skip
"""Coefficients of atan(h)/h in powers of h^2, for |h| below 0.9; with h the tangent of half an angle, up to 1.46 rad,
the error of the angle is below 1e-8."""


class Strips(NamedTuple):
    """Arrays (MOST_STRIPS,) over the strips of one patch of a left wheel."""

    gap: np.ndarray
    """Vertical gap, negative in overlap, m."""
    arc: np.ndarray
    """Arc length across the patch from the first strip, m."""
    weight: np.ndarray
    """Square of the penetration normal to the strip, times its width, m^3."""
    angle: np.ndarray
    """Mean of the inclinations of wheel and rail, rad."""
    curvature: np.ndarray
    """Half of the curvature along the rail, cos(angle) / (2 R), 1/m."""
    ahead: np.ndarray
    """Position of the strip's contact point along the rail from the wheelset's centre, m."""
    lateral: np.ndarray
    """Rail coordinate below the strip, m."""
    cosine: np.ndarray
    secant: np.ndarray
    """Cosine of the angle, and 1 over it."""
    height: np.ndarray
    """Height over the wheelset's centre, m."""
    rail_slope: np.ndarray
    rail_bend: np.ndarray
    """Slope of the rail's profile below the strip, and its derivative across the track, 1/m."""


def new_strips():
    """Return empty arrays for `Strips`."""
    return Strips(*(np.zeros(MOST_STRIPS + LANES) for _ in Strips._fields))


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _load(rows, row, start, stride):
    """Return eight numbers of a row, every ``stride``-th from ``start`` on."""
    if stride == 1:
        return lanes.load8(rows, np.uint64(row), start)
    return lanes.every8(rows, np.uint64(row), start, np.uint64(stride))


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _angles(tangent, secant):
    """Angles (rad) from their tangents and secants."""
    half, (c0, c1, c2, c3, c4, c5, c6, c7, c8, c9, c10) = tangent / (1.0 + secant), _ANGLE_SERIES
    q = half * half
    low = c0 + q * (c1 + q * (c2 + q * (c3 + q * c4)))
    square = q * q
    return 2.0 * half * (low + square * square * q * (c5 + q * (c6 + q * (c7 + q * (c8 + q * (c9 + q * c10))))))


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _fill_nodes(nodes, first, stride, wheel, rail, pose, reach, ends, strips):
    """Fill ``strips`` but for arc and weight at every ``stride``-th node from the ``first`` one on. ``reach``: from the
    wheelset's centre to node 0 along the axle, m; ``ends``: wheel coordinates beyond which no overlap counts. Returns
    the number of strips. Strips are filled eight at a time; the last eight may include some that were filled before."""
    grid, n = nodes.grid, (nodes.end - first + stride - 1) // stride
    square, turned, least = grid.tilt_square, pose.tilt * pose.q, lanes.lanes8(1e-3)
    zero, low, high = lanes.lanes8(0.0), lanes.lanes8(ends[0] - nodes.u), lanes.lanes8(ends[1] - nodes.u)
    for block in range(0, n, LANES):
        k = np.uint64(min(block, max(n - LANES, 0)))
        i = first + stride * int(k)
        node, cell, index = np.uint64(grid.node + i), np.uint64(grid.cell + i), float(i) + stride * lanes.ramp8()
        radius, along = _load(wheel, RADIUS, node, stride), _load(wheel, ALONG, node, stride)
        radius = lanes.where_below(radius, least, least, radius)  # 0 beyond the profile
        second, fourth = _load(wheel, DOWN_2, node, stride), _load(wheel, DOWN_4, node, stride)
        down = radius - square * (second + square * (fourth + square * _load(wheel, DOWN_6, node, stride)))
        d = grid.lateral + index * grid.lateral_rate + down * grid.y_down + along * grid.y_along
        height = grid.height + index * grid.height_rate + down * grid.z_down + along * grid.z_along
        c1, c2, c3 = _load(rail, 1, cell, stride), _load(rail, 2, cell, stride), _load(rail, 3, cell, stride)
        rail_slope, per_radius = c1 + d * (2.0 * c2 + d * (3.0 * c3)), 1.0 / radius
        slope = along * per_radius
        tilted = slope * pose.tilt
        sink = tilted * tilted
        lower = 1.0 - sink * (0.5 + sink * (0.125 + sink * 0.0625))  # the root of 1 - sink, which is below 0.02
        dy, dz = lower * pose.y_down + tilted * pose.y_along, lower * pose.z_down + tilted * pose.z_along
        tangent = 0.5 * (rail_slope + (slope * pose.ey - dy) / (dz - slope * pose.ez))
        secant = lanes.root(1.0 + tangent * tangent)
        cosine = 1.0 / secant
        gap, along_wheel = height - (_load(rail, 0, cell, stride) + d * (c1 + d * (c2 + d * c3))), nodes.step * index
        apart = lanes.where_below(gap, zero, zero, gap)
        gap = lanes.where_below(along_wheel, low, apart, lanes.where_below(along_wheel, high, gap, apart))
        lanes.put8(strips.gap, k, gap)
        lanes.put8(strips.angle, k, _angles(tangent, secant))
        lanes.put8(strips.cosine, k, cosine)
        lanes.put8(strips.secant, k, secant)
        lanes.put8(strips.curvature, k, 0.5 * cosine * per_radius)
        lanes.put8(strips.ahead, k, turned * along + (reach + along_wheel) * pose.ex)
        lanes.put8(strips.lateral, k, nodes.ur + along_wheel + d)
        lanes.put8(strips.height, k, height - pose.z)
        lanes.put8(strips.rail_slope, k, rail_slope)
        lanes.put8(strips.rail_bend, k, 2.0 * c2 + d * (6.0 * c3))
    return n


@jit(allocates=False, fastmath=FUSED)
def _fill_one_by_one(geometry, nodes, first, stride, pose, ends, strips):
    """Fill ``strips`` like `_fill_nodes`, but at any position, also on rails that change along the track and under
    wheels out of round; slower."""
    n = (nodes.end - first + stride - 1) // stride
    for k in range(n):
        u = nodes.u + nodes.step * (first + stride * k)
        ur, height, radius, slope, _, along = strip_point(geometry, pose, u)
        rail, rail_slope, rail_bend = cubic_at(geometry.rail, geometry.rail_start, geometry.rail_step, ur)
        tangent = 0.5 * (rail_slope + wheel_slope(pose, slope, along))
        cosine = 1.0 / math.sqrt(1.0 + tangent * tangent)
        ahead = radius * along * pose.q + (geometry.half_distance + u) * pose.ex
        gap = height - rail if on_rail(geometry, ur) else _NO_RAIL
        strips.gap[k] = gap if ends[0] < u < ends[1] else max(gap, 0.0)
        strips.angle[k], strips.lateral[k] = math.atan(tangent), ur
        strips.cosine[k], strips.secant[k] = cosine, 1.0 / cosine
        strips.curvature[k] = with_rail_along(geometry, BEND, ur, cosine, 0.5 * cosine / radius)
        strips.ahead[k] = with_rail_along(geometry, AHEAD, ur, 1.0, ahead)
        strips.height[k] = with_rail_along(geometry, LIFT, ur, 1.0, height) - pose.z
        strips.rail_slope[k], strips.rail_bend[k] = rail_slope, rail_bend
    return n


@jit(allocates=False, fastmath=FUSED)
def _add_end(strips, low, count):
    """Add what sums over nodes miss where the gap changes its sign between the nodes ``low`` and ``low + 1``.

    There the overlap falls to 0 as a straight line, at the share theta of the step from the node inside. A sum of its
    square lacks rise^2 h B3(theta)/3, with the third Bernoulli polynomial (Euler-Maclaurin formula). At an end of the
    rail's profile, where the gap rises by more, nothing is added."""
    gap, next_gap = strips.gap[low], strips.gap[low + 1]
    rise = abs(next_gap - gap)
    inside = -min(gap, next_gap) / rise
    share = inside if gap < 0.0 else 1.0 - inside
    for values in (strips.arc, strips.angle, strips.curvature, strips.ahead, strips.lateral, strips.cosine,
                   strips.height):  # fmt: skip
        values[count] = values[low] + share * (values[low + 1] - values[low])
    bernoulli = inside * (1.0 - inside) * (0.5 - inside)
    strips.gap[count] = 0.0
    is_end_of_rail = rise > STEEP * (strips.lateral[low + 1] - strips.lateral[low])
    arc, rise = strips.arc[low + 1] - strips.arc[low], rise * strips.cosine[count]
    strips.weight[count] = 0.0 if is_end_of_rail else arc * rise * rise * bernoulli / 3.0


class _Depths(NamedTuple):
    """Integrals over the wheel's profile: of the gap's square, and twice those of the gap times 1, the rail's slope,
    the rail coordinate, the place along the rail, that times the slope, the height over the wheelset's centre, and
    that times the slope."""

    square: float
    depth: float
    sloped: float
    aside: float
    ahead: float
    ahead_sloped: float
    up: float
    up_sloped: float


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _rise_at(gap, n, k, most):
    """Change of the gap from node to node at the node ``k`` of ``n``. Changes beyond ``most`` are those at an end of a
    profile, and do not count."""
    before, after = max(k - 1, 0), min(k + 1, n - 1)
    before = before if abs(gap[k] - gap[before]) < most else k
    after = after if abs(gap[after] - gap[k]) < most else k
    return (gap[after] - gap[before]) / max(after - before, 1)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _with_end(strips, n, low, step, total):
    """``total`` (`_Depths` of sums over ``n`` nodes) with what it misses where the gap changes its sign between the
    nodes ``low`` and ``low + 1``, see `_add_end`: rise^2 h B3(theta)/3 of the square, rise h B2(theta) of twice the
    gap.

    The rise is that of both nodes, interpolated. With the difference between them the second number would jump by 1e-4
    of the depth where the end passes a node, as B2 is not 0 there."""
    k, other = (low, low + 1) if strips.gap[low] < 0.0 else (low + 1, low)
    difference, most = strips.gap[other] - strips.gap[k], STEEP * step
    if difference > most:  # the profile ends there
        return total
    theta = -strips.gap[k] / difference
    rise = abs((1.0 - theta) * _rise_at(strips.gap, n, k, most) + theta * _rise_at(strips.gap, n, other, most))
    less = theta * (1.0 - theta)
    square, fall = step * rise * rise * less * (0.5 - theta) / 3.0, step * rise * (less - 1.0 / 6.0)
    slope = strips.rail_slope[k] + theta * (strips.rail_slope[other] - strips.rail_slope[k])
    lateral = strips.lateral[k] + theta * (strips.lateral[other] - strips.lateral[k])
    x = strips.ahead[k] + theta * (strips.ahead[other] - strips.ahead[k])
    z = strips.height[k] + theta * (strips.height[other] - strips.height[k])
    return _Depths(
        total.square + square, total.depth + fall, total.sloped + fall * slope, total.aside + fall * lateral,
        total.ahead + fall * x, total.ahead_sloped + fall * slope * x, total.up + fall * z,
        total.up_sloped + fall * slope * z,
    )  # fmt: skip


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _fill_arcs(strips, n):
    """Arc lengths of ``n`` strips at nodes, with those between neighbours in ``weight``."""
    lateral, secant, weight = strips.lateral, strips.secant, strips.weight
    for start in range(0, n - 1, LANES):
        k, after = np.uint64(start), np.uint64(start + 1)
        width = lanes.take8(lateral, after) - lanes.take8(lateral, k)
        lanes.put8(weight, k, 0.5 * width * (lanes.take8(secant, after) + lanes.take8(secant, k)))
    strips.arc[0] = 0.0
    for k in range(1, n):
        strips.arc[k] = strips.arc[k - 1] + weight[k - 1]


@jit(allocates=False, fastmath=FUSED)
def fill_strips(geometry, pose, row, low, high, strips):
    """Fill ``strips`` but for weights at nodes of the wheel, over a patch of a left wheel between wheel coordinates
    without overlap, ``low`` and ``high`` (m).

    ``row`` is one of its overlaps (a row of patches, overwritten in OUTSIDE and BEYOND). Returns the number of strips,
    0 if there are fewer than three, and their spacing on the wheel, m."""
    step = geometry.wheel_step
    margin = 4.0 * step if high - low < 0.7 * ENOUGH * step else 24.0 * step  # room for nodes beyond the ends
    row[OUTSIDE], row[BEYOND] = low - margin, high + margin
    nodes, wheel, rail = smooth_nodes(geometry, pose, row)
    stride = 1 if nodes.end <= ENOUGH else 2 if nodes.end <= 2 * ENOUGH else 4
    first = -nodes.grid.node % stride if stride > 1 else 0  # always the same nodes of the wheel
    if nodes.end < 3 or nodes.end > 4 * (MOST_STRIPS - _END_STRIPS):
        return 0, step
    is_planar, reach = pose.tilt == 0.0 and pose.ex != 0.0, geometry.half_distance + nodes.u
    if is_planar or changes_along(geometry) or leaves_cells(pose):
        n = _fill_one_by_one(geometry, nodes, first, stride, pose, (low, high), strips)
    elif stride == 1:  # compiled without gathers
        n = _fill_nodes(nodes, 0, 1, wheel, rail, pose, reach, (low, high), strips)
    else:
        n = _fill_nodes(nodes, first, stride, wheel, rail, pose, reach, (low, high), strips)
    _fill_arcs(strips, n)
    return n, nodes.step * stride


@jit(allocates=False, fastmath=FUSED)
def press_strips(geometry, pose, lean, strips, n, step):
    """`Pressed` of ``n`` strips at nodes with the spacing ``step`` (m), in axes that ``lean``; its moments are 0."""
    zero = lanes.lanes8(0.0)
    for values in (strips.gap, strips.lateral, strips.rail_slope, strips.ahead, strips.height):
        lanes.put8(values, np.uint64(n), zero)
    square, depth, sloped, aside, ahead, ahead_sloped, up, up_sloped = zero, zero, zero, zero, zero, zero, zero, zero
    for start in range(0, n, LANES):
        k = np.uint64(start)
        gap, slope = lanes.take8(strips.gap, k), lanes.take8(strips.rail_slope, k)
        g = lanes.where_below(gap, zero, gap, zero)
        one = g * slope
        square, depth, sloped, aside = (
            square + g * g,
            depth + g,
            sloped + one,
            aside + g * lanes.take8(strips.lateral, k),
        )
        x, z = lanes.take8(strips.ahead, k), lanes.take8(strips.height, k)
        ahead, ahead_sloped, up, up_sloped = ahead + g * x, ahead_sloped + one * x, up + g * z, up_sloped + one * z
    total = _Depths(
        step * lanes.total(square), 2.0 * step * lanes.total(depth), 2.0 * step * lanes.total(sloped),
        2.0 * step * lanes.total(aside), 2.0 * step * lanes.total(ahead), 2.0 * step * lanes.total(ahead_sloped),
        2.0 * step * lanes.total(up), 2.0 * step * lanes.total(up_sloped),
    )  # fmt: skip
    for k in range(n - 1):
        if (strips.gap[k] < 0.0) != (strips.gap[k + 1] < 0.0):
            total = _with_end(strips, n, k, step, total)
    (square, depth, sloped, aside, ahead, ahead_sloped, up, up_sloped) = total
    aside += depth * (geometry.rail_distance - pose.y)
    x, _ = leaning(geometry, lean, ahead, up)
    x_sloped, z_sloped = leaning(geometry, lean, ahead_sloped, up_sloped)
    return Pressed(square, 0.0, -sloped, depth, aside + z_sloped, -x, -x_sloped, 0.0, 0.0)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def lift_strips(strips, n, dy, dz):
    """Move ``n`` strips at nodes by a small distance across the track and up (m), with the wheel."""
    for start in range(0, n, LANES):
        k = np.uint64(start)
        bend = dy * lanes.take8(strips.rail_bend, k)
        slope, cosine = lanes.take8(strips.rail_slope, k), lanes.take8(strips.cosine, k)
        lanes.put8(strips.gap, k, lanes.take8(strips.gap, k) + (dz - dy * (slope + 0.5 * bend)))
        lanes.put8(strips.lateral, k, lanes.take8(strips.lateral, k) + dy)
        lanes.put8(strips.angle, k, lanes.take8(strips.angle, k) + 0.5 * bend * cosine * cosine)


@jit(allocates=False, fastmath=FUSED)
def close_strips(strips, n):
    """Fill the weights of ``n`` strips at nodes, three or more, and add the ends of overlaps. Returns the number of
    strips; eight after the last one have no weight."""
    gap, lateral, cosine, zero = strips.gap, strips.lateral, strips.cosine, lanes.lanes8(0.0)
    for start in range(1, n - 1, LANES):
        k = np.uint64(start)
        depth, width = lanes.take8(gap, k), lanes.take8(lateral, np.uint64(start + 1))
        depth = lanes.where_below(depth, zero, depth, zero)
        width = width - lanes.take8(lateral, np.uint64(start - 1))
        lanes.put8(strips.weight, k, 0.5 * depth * depth * width * lanes.take8(cosine, k))
    for k, width in ((0, lateral[1] - lateral[0]), (n - 1, lateral[n - 1] - lateral[n - 2])):
        depth = min(gap[k], 0.0)
        strips.weight[k] = depth * depth * width * cosine[k]
    count = n
    for k in range(n - 1):
        if (gap[k] < 0.0) != (gap[k + 1] < 0.0) and count < MOST_STRIPS:
            _add_end(strips, k, count)
            count += 1
    for values in (strips.weight, strips.arc, strips.curvature, strips.angle, strips.ahead, strips.height):
        lanes.put8(values, np.uint64(count), zero)
    return count
