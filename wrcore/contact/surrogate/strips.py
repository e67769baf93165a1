"""Strips of the wheel across one contact patch, and what the surrogate needs to know of each.

The strips stand at nodes of the wheel profile: at every fourth one on a tread
(:func:`wrcore.contact.moved.smooth_nodes`), and of these again at every second or fourth one where an overlap is so
wide that 32 strips or more are left.
"""

import math
from typing import NamedTuple

import numpy as np

from wrcore.contact.geometry import ALONG, DOWN_2, DOWN_4, DOWN_6, RADIUS
from wrcore.contact.moved import smooth_nodes
from wrcore.contact.reduction import BEYOND, OUTSIDE
from wrcore.contact.scan import leaves_cells
from wrcore.contact.strip import (
    AHEAD,
    BEND,
    LIFT,
    changes_along,
    cubic_at,
    on_rail,
    strip_point,
    wheel_slope,
    with_rail_along,
)
from wrcore.kernels.jit import FAST, FUSED, jit

MOST_STRIPS = 1024
"""Most strips of one patch; at 0.1 mm a patch is at most 60 mm wide."""

ENOUGH = 64
"""Nodes beyond which every second one is left out."""

_END_STRIPS = 16
"""Places kept for the ends of overlaps."""

_NO_RAIL = 1.0
"""Gap of a strip beyond the end of the rail's profile, m."""

_ANGLE_SERIES = -1.0 / 3.0, 1.0 / 5.0, -1.0 / 7.0, 1.0 / 9.0, -1.0 / 11.0
"""Coefficients of atan(h)/h in powers of h^2; with h the tangent of a quarter of the angle the error is below 1e-6."""


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
    """Cosine of the angle."""
    height: np.ndarray
    """Height over the wheelset's centre, m."""


def new_strips():
    """Scratch arrays of `Strips`."""
    return Strips(*(np.zeros(MOST_STRIPS) for _ in Strips._fields))


@jit(allocates=False, forceinline=True, fastmath=FAST)
def _fill_nodes(nodes, first, stride, wheel, rail, pose, reach, strips):
    """Fill ``strips`` but for arc and weight at every ``stride``-th node from the ``first`` one on; ``reach``: from the
    wheelset's centre to node 0 along the axle, m. Returns their number."""
    grid, n = nodes.grid, (nodes.end - first + stride - 1) // stride
    square, turned = grid.tilt_square, pose.tilt * pose.q
    for k in range(n):
        i = first + stride * k
        node, cell = np.uint64(grid.node + i), np.uint64(grid.cell + i)
        radius, along = max(wheel[RADIUS, node], 1e-3), wheel[ALONG, node]  # 0 beyond the profile
        down = radius - square * (wheel[DOWN_2, node] + square * (wheel[DOWN_4, node] + square * wheel[DOWN_6, node]))
        d = grid.lateral + i * grid.lateral_rate + down * grid.y_down + along * grid.y_along
        height = grid.height + i * grid.height_rate + down * grid.z_down + along * grid.z_along
        c1, c2, c3 = rail[1, cell], rail[2, cell], rail[3, cell]
        rail_slope = c1 + d * (2.0 * c2 + d * (3.0 * c3))
        slope = along / radius
        tilted = slope * pose.tilt
        lower = math.sqrt(1.0 - tilted * tilted)
        dy, dz = lower * pose.y_down + tilted * pose.y_along, lower * pose.z_down + tilted * pose.z_along
        wheel_slope = -(dy - slope * pose.ey) / (dz - slope * pose.ez)
        tangent = 0.5 * (rail_slope + wheel_slope)
        secant = math.sqrt(1.0 + tangent * tangent)
        half = tangent / (1.0 + secant)
        quarter = half / (1.0 + math.sqrt(1.0 + half * half))
        q = quarter * quarter
        series = _ANGLE_SERIES[3] + q * _ANGLE_SERIES[4]
        series = 1.0 + q * (_ANGLE_SERIES[0] + q * (_ANGLE_SERIES[1] + q * (_ANGLE_SERIES[2] + q * series)))
        cosine = 1.0 / secant
        strips.gap[k] = height - (rail[0, cell] + d * (c1 + d * (c2 + d * c3)))
        strips.angle[k] = 4.0 * quarter * series
        strips.cosine[k], strips.curvature[k] = cosine, 0.5 * cosine / radius
        strips.ahead[k] = turned * along + (reach + nodes.step * i) * pose.ex
        strips.lateral[k] = nodes.ur + nodes.step * i + d
        strips.height[k] = height - pose.z
    return n


@jit(allocates=False, fastmath=FUSED)
def _fill_one_by_one(geometry, nodes, first, stride, pose, strips):
    """As `_fill_nodes` for any position, for rails that change along the track and wheels out of round; slower."""
    n = (nodes.end - first + stride - 1) // stride
    for k in range(n):
        u = nodes.u + nodes.step * (first + stride * k)
        ur, height, radius, slope, _, along = strip_point(geometry, pose, u)
        rail, rail_slope, _ = cubic_at(geometry.rail, geometry.rail_start, geometry.rail_step, ur)
        tangent = 0.5 * (rail_slope + wheel_slope(pose, slope, along))
        cosine = 1.0 / math.sqrt(1.0 + tangent * tangent)
        ahead = radius * along * pose.q + (geometry.half_distance + u) * pose.ex
        strips.gap[k] = height - rail if on_rail(geometry, ur) else _NO_RAIL
        strips.angle[k], strips.cosine[k], strips.lateral[k] = math.atan(tangent), cosine, ur
        strips.curvature[k] = with_rail_along(geometry, BEND, ur, cosine, 0.5 * cosine / radius)
        strips.ahead[k] = with_rail_along(geometry, AHEAD, ur, 1.0, ahead)
        strips.height[k] = with_rail_along(geometry, LIFT, ur, 1.0, height) - pose.z
    return n


@jit(allocates=False, fastmath=FUSED)
def _add_end(strips, low, count):
    """Add what sums over nodes miss where the gap changes its sign between the nodes ``low`` and ``low + 1``.

    There the overlap falls to 0 as a straight line, at the share theta of the step from the node inside. A sum of its
    square lacks rise^2 h B3(theta)/3, with the third Bernoulli polynomial (Euler-Maclaurin formula)."""
    gap, next_gap = strips.gap[low], strips.gap[low + 1]
    rise = abs(next_gap - gap)
    inside = -min(gap, next_gap) / rise
    share = inside if gap < 0.0 else 1.0 - inside
    for values in (strips.arc, strips.angle, strips.curvature, strips.ahead, strips.lateral, strips.cosine,
                   strips.height):  # fmt: skip
        values[count] = values[low] + share * (values[low + 1] - values[low])
    rise *= strips.cosine[count]
    bernoulli = inside * (1.0 - inside) * (0.5 - inside)
    strips.gap[count] = 0.0
    strips.weight[count] = (strips.arc[low + 1] - strips.arc[low]) * rise * rise * bernoulli / 3.0


@jit(allocates=False, fastmath=FUSED)
def fill_strips(geometry, pose, row, low, high, strips):
    """Fill ``strips`` of a patch of a left wheel between wheel coordinates without overlap, ``low`` and ``high`` (m).

    ``row`` is one of its overlaps (a row of patches, overwritten in OUTSIDE and BEYOND). Returns the number of strips,
    and of those the number at nodes, which come first; 0 if there are fewer than three nodes."""
    step = geometry.wheel_step
    margin = 4.0 * step if high - low < 0.75 * ENOUGH * step else 16.0 * step  # a node beyond each end
    row[OUTSIDE], row[BEYOND] = low - margin, high + margin
    nodes, wheel, rail = smooth_nodes(geometry, pose, row)
    stride = 1 if nodes.end <= ENOUGH else 2 if nodes.end <= 2 * ENOUGH else 4
    first = -nodes.grid.node % stride  # always the same nodes of the wheel
    if nodes.end < 3 or nodes.end > 4 * (MOST_STRIPS - _END_STRIPS):
        return 0, 0
    is_planar, reach = pose.tilt == 0.0 and pose.ex != 0.0, geometry.half_distance + nodes.u
    if is_planar or changes_along(geometry) or leaves_cells(pose):
        n = _fill_one_by_one(geometry, nodes, first, stride, pose, strips)
    elif stride == 1:
        n = _fill_nodes(nodes, 0, 1, wheel, rail, pose, reach, strips)
    elif stride == 2:
        n = _fill_nodes(nodes, first, 2, wheel, rail, pose, reach, strips)
    else:
        n = _fill_nodes(nodes, first, 4, wheel, rail, pose, reach, strips)
    for k in range(n):
        u = nodes.u + nodes.step * (first + stride * k)
        if not low < u < high:
            strips.gap[k] = max(strips.gap[k], 0.0)
    strips.arc[0] = 0.0
    for k in range(1, n):
        width = strips.lateral[k] - strips.lateral[k - 1]
        strips.arc[k] = strips.arc[k - 1] + 0.5 * width * (1.0 / strips.cosine[k] + 1.0 / strips.cosine[k - 1])
    for k in range(n):
        depth = min(strips.gap[k], 0.0) * strips.cosine[k]
        before, after = max(k - 1, 0), min(k + 1, n - 1)
        width = (strips.lateral[after] - strips.lateral[before]) / (after - before)
        strips.weight[k] = depth * depth * width / strips.cosine[k]
    count = n
    for k in range(n - 1):
        if (strips.gap[k] < 0.0) != (strips.gap[k + 1] < 0.0) and count < MOST_STRIPS:
            _add_end(strips, k, count)
            count += 1
    return count, n
