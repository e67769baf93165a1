"""Derivatives of a patch by moments with respect to small displacements of its wheel, without another search.

The strips of an overlap are fixed in the wheel. The gap g of a strip changes by dp_z - f' dp_y, with the displacement
dp of its point and the rail's slope f'. Yaw also moves the point on the circle of the strip. The differential is

    dM_k = 2 sum of g dg u^k

over the nodes of the search's sums M_k. The displaced patch follows from the displaced moments.
"""

import math
from typing import NamedTuple

import numpy as np

from wrcore.contact.search.detection import WIDE
from wrcore.contact.search.geometry import ALONG, DOWN_2, DOWN_4, DOWN_6, LANES, RADIUS, SCAN_STEP, SPREAD
from wrcore.contact.search.reduction import (
    BEYOND,
    COSINE,
    CURVATURE_Y,
    GAUSS_POINTS,
    GAUSS_WEIGHTS,
    OUTSIDE,
    PENETRATION,
    U_RAIL,
    U_WHEEL,
    edge_by_newton,
    patch_from_moments,
)
from wrcore.contact.search.scan import (
    Grid,
    fine_cell_shift,
    fine_grid,
    leaves_cells,
    make_window,
    spread_grid,
    strip_position,
)
from wrcore.contact.search.strip import cubic_at, make_pose, strip_point
from wrcore.kernels import lanes
from wrcore.kernels.jit import FUSED, jit

ACROSS, UP, ROLL, YAW = range(4)
MOVES = 4
"""Number of displacements of a wheel that displace its patches."""

DIFFERENCE = 1e-9
"""Step of the displacements, m and rad. It can be so small because there is no search whose rounding would matter."""

ROUNDING = 1e-6
"""Tolerance of a position relative to the nodes, in node spacings."""

TREAD, MANY = 0.9928, 20
"""Minimum cosine of the contact angle, and minimum number of spread nodes (4 mm), of an overlap that is summed over
spread nodes. The error of its position is 0.01 µm."""

STEEP = 10.0
"""Slope of a gap that exceeds all slopes of profiles; a steeper gap marks the end of a profile."""


class Nodes(NamedTuple):
    """Strips at the nodes over an overlap, and their spacing ``step`` (m)."""

    grid: Grid
    u: float
    ur: float
    """Rail coordinate of the start of the cell below the first strip, m; ``u`` is the strip's wheel coordinate, m."""
    step: float
    first: int
    end: int
    """End of the range of strips that are summed, ``first`` to ``end`` - 1."""


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _put(sums, row, scale, square, across, up, rolled, yawed):
    """Write a row of ``sums``: the integral of g^2 u^k and its derivatives 2 g dg u^k, from sums over nodes."""
    sums[row, 0], scale = scale * lanes.total(square), 2.0 * scale
    sums[row, 1 + ACROSS], sums[row, 1 + UP] = scale * lanes.total(across), scale * lanes.total(up)
    sums[row, 1 + ROLL], sums[row, 1 + YAW] = scale * lanes.total(rolled), scale * lanes.total(yawed)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _moment_slopes(geometry, pose, nodes, wheel, rail, whole, sums):
    """Fill ``sums`` (3, 1 + MOVES) with M0 to M2 about the first node and their derivatives in each displacement.

    Unless ``whole``, M2 and the derivatives of M1 with respect to roll and yaw are left out. Returns the number of
    nodes in overlap, the first and the last one."""
    grid, zero, reach = nodes.grid, lanes.lanes8(0.0), geometry.half_distance + nodes.u
    begin, end = lanes.lanes8(float(nodes.first)), lanes.lanes8(float(nodes.end))
    ahead, aside = pose.tilt * pose.q, nodes.ur + geometry.rail_distance - pose.side * pose.y
    tilted = -pose.ey / (pose.q * pose.q * pose.q)
    sink, along_y, along_z = -2.0 * tilted * pose.tilt, tilted * pose.side * pose.y_along, tilted * pose.z_along
    m0 = m1 = m2 = y0 = y1 = y2 = z0 = z1 = z2 = r0 = r1 = r2 = w0 = w1 = w2 = zero
    count, first, last = 0, -1, 0
    for k in range(0, nodes.end, LANES):
        node, cell, index = np.uint64(grid.node + k), np.uint64(grid.cell + k), float(k) + lanes.ramp8()
        square, along = grid.tilt_square, lanes.load8(wheel, ALONG, node)
        second, fourth = lanes.load8(wheel, DOWN_2, node), lanes.load8(wheel, DOWN_4, node)
        down = square * (fourth + square * lanes.load8(wheel, DOWN_6, node))
        down = lanes.load8(wheel, RADIUS, node) - square * (second + down)
        d = grid.lateral + index * grid.lateral_rate + down * grid.y_down + along * grid.y_along
        height = grid.height + index * grid.height_rate + down * grid.z_down + along * grid.z_along
        c1, c2, c3 = lanes.load8(rail, 1, cell), lanes.load8(rail, 2, cell), lanes.load8(rail, 3, cell)
        gap = height - (lanes.load8(rail, 0, cell) + d * (c1 + d * (c2 + d * c3)))
        slope = c1 + d * (2.0 * c2 + d * (3.0 * c3))
        lower = sink * (second + (2.0 * square) * fourth)
        circled = lower * grid.z_down + along * along_z - slope * (lower * grid.y_down + along * along_y)
        slope = pose.side * slope
        gap = lanes.where_below(index, begin, zero, lanes.where_below(index, end, gap, zero))
        gap = lanes.where_below(gap, zero, gap, zero)
        overlap = lanes.below(gap, zero)
        if overlap > 0:
            first = k + lanes.lowest_bit(overlap) if first < 0 else first
            last, count = k + lanes.highest_bit(overlap), count + lanes.count_bits(overlap)
        px, py = ahead * along + (reach + nodes.step * index) * pose.ex, pose.side * (aside + nodes.step * index + d)
        across, rolled, yawed = zero - slope, py + slope * (height - pose.z), circled - slope * px
        one = gap * index
        m0, m1 = m0 + gap * gap, m1 + one * gap
        y0, z0, r0, w0 = y0 + gap * across, z0 + gap, r0 + gap * rolled, w0 + gap * yawed
        y1, z1 = y1 + one * across, z1 + one
        if whole:
            two = one * index
            r1, w1 = r1 + one * rolled, w1 + one * yawed
            y2, z2, r2, w2 = y2 + two * across, z2 + two, r2 + two * rolled, w2 + two * yawed
            m2 = m2 + two * gap
    step = nodes.step
    _put(sums, 0, step, m0, y0, z0, r0, w0)
    _put(sums, 1, step * step, m1, y1, z1, r1, w1)
    if whole:
        _put(sums, 2, step * step * step, m2, y2, z2, r2, w2)
    return count, first, last


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _at_node(nodes, wheel, rail, k):
    """Gap at a node (m), its height (m), its distance from the start of the rail cell below (m), and the rail's
    slope."""
    d, height = strip_position(nodes.grid, wheel, k)
    cell = np.uint64(nodes.grid.cell + k)
    c1, c2, c3 = rail[1, cell], rail[2, cell], rail[3, cell]
    return height - (rail[0, cell] + d * (c1 + d * (c2 + d * c3))), height, d, c1 + d * (2.0 * c2 + d * (3.0 * c3))


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _add_end(geometry, pose, nodes, wheel, rail, inside, outside, sums):
    """Correct ``sums`` at an end of an overlap between two nodes: M0, M1 and their derivatives, except for yaw.

    Near the end g is linear and reaches 0 at theta h from the node inside. Sums of g^2 and of g over the nodes are less
    than their integrals by g'^2 h^3 B3(theta) / 3 and g' h^2 B2(theta) / 2, with Bernoulli polynomials (Euler and
    Maclaurin)."""
    node, cell = nodes.grid.node + outside, nodes.grid.cell + outside
    if min(node, cell) < 0 or node >= wheel.shape[1] - LANES or cell >= rail.shape[1] - LANES:
        return
    gap, height, d, slope = _at_node(nodes, wheel, rail, inside)
    beyond, h = _at_node(nodes, wheel, rail, outside)[0], nodes.step
    if not 0.0 <= beyond < STEEP * h:  # the profile ends there
        return
    rise, slope = beyond - gap, pose.side * slope
    theta = -gap / rise
    less = theta * (1.0 - theta)
    square, fall = h * rise * rise * less * (0.5 - theta) / 3.0, h * rise * (less - 1.0 / 6.0)
    place, py = h * (inside + (outside - inside) * theta), nodes.ur + geometry.rail_distance + h * inside + d
    rolled = pose.side * py - pose.y + slope * (height - pose.z)
    sums[0, 0], sums[1, 0] = sums[0, 0] + square, sums[1, 0] + square * place
    sums[0, 1 + UP], sums[1, 1 + UP] = sums[0, 1 + UP] + fall, sums[1, 1 + UP] + fall * place
    sums[0, 1 + ROLL], fall = sums[0, 1 + ROLL] + fall * rolled, fall * slope
    sums[0, 1 + ACROSS], sums[1, 1 + ACROSS] = sums[0, 1 + ACROSS] - fall, sums[1, 1 + ACROSS] - fall * place


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def scan_nodes(geometry, pose, row):
    """Return the scan's `Nodes` over the overlap of the patch ``row``."""
    grid, inverse = make_window(geometry, pose).grid, 1.0 / SCAN_STEP
    start = geometry.scan_wheel_start + grid.node * SCAN_STEP
    first = max(int((row[OUTSIDE] - start) * inverse + ROUNDING) + 1, 0)
    end = min(int(math.ceil((row[BEYOND] - start) * inverse - ROUNDING)), geometry.scan_rail.shape[1])
    skipped = first - first % LANES
    moved = Grid(
        grid.node + skipped, skipped, grid.lateral + skipped * grid.lateral_rate, grid.lateral_rate,
        grid.height + skipped * grid.height_rate, grid.height_rate, grid.y_down, grid.y_along, grid.z_down,
        grid.z_along, grid.tilt_square,
    )  # fmt: skip
    u, ur = start + skipped * SCAN_STEP, geometry.scan_rail_start + skipped * SCAN_STEP
    return Nodes(moved, u, ur, SCAN_STEP, first - skipped, end - skipped)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def fine_nodes(geometry, pose, row):
    """Return the `Nodes` of the wheel profile over the overlap of the patch ``row``."""
    shift, step = fine_cell_shift(geometry, row[U_WHEEL], row[U_RAIL]), geometry.wheel_step
    grid, u, begin, end = fine_grid(geometry, pose, shift, row[OUTSIDE], row[BEYOND])
    return Nodes(grid, u, geometry.rail_start + grid.cell * step, step, 0, end - begin)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def smooth_nodes(geometry, pose, row):
    """Return the `Nodes` for smooth sums over the overlap of the patch ``row``, the wheel's strip rows and rail cubics.

    These are the nodes of the wheel profile; on a tread with many nodes, only spread nodes; if the node spacings of
    wheel and rail differ, the scan's nodes."""
    step = SPREAD * geometry.wheel_step
    if geometry.fine_rail.shape[1] <= LANES:
        return scan_nodes(geometry, pose, row), geometry.scan_wheel, geometry.scan_rail
    if row[COSINE] <= TREAD or row[BEYOND] - row[OUTSIDE] <= MANY * step:
        return fine_nodes(geometry, pose, row), geometry.fine_wheel, geometry.fine_rail
    shift = fine_cell_shift(geometry, row[U_WHEEL], row[U_RAIL])
    (grid, u, begin, end), start, rail = spread_grid(geometry, pose, shift, row[OUTSIDE], row[BEYOND])
    return Nodes(grid, u, start + grid.cell * step, step, 0, end - begin), geometry.spread_wheel, rail


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def moved_axle(ex, ey, ez, move, turn):
    """Direction of the axle after a small rotation ``turn`` (rad) if ``move`` is ROLL or YAW, else unchanged."""
    if move == ROLL:
        return ex, ey - turn * ez, ez + turn * ey
    if move == YAW:
        return ex - turn * ey, ey + turn * ex, ez
    return ex, ey, ez


@jit(allocates=False, fastmath=FUSED)
def _narrow(geometry, pose, row):
    """Middle and half width (m) of an overlap that contains few nodes; NaN if its edges are not found."""
    width = row[COSINE] * math.sqrt(row[PENETRATION] / row[CURVATURE_Y])
    low = edge_by_newton(geometry, pose, row[U_WHEEL] - width, row[OUTSIDE], row[BEYOND])
    high = edge_by_newton(geometry, pose, row[U_WHEEL] + width, row[OUTSIDE], row[BEYOND])
    return 0.5 * (low + high), 0.5 * (high - low)


@jit(allocates=False, fastmath=FUSED)
def _narrow_slopes(geometry, pose, row, sums):
    """Fill ``sums`` (see `_moment_slopes`) for an overlap with few nodes, by Gauss quadrature between its edges.

    The moments are about the middle of the overlap. Returns the wheel coordinate of the middle (m), or NaN if the edges
    are not found."""
    (place, width), tilted = _narrow(geometry, pose, row), -pose.ey / (pose.q * pose.q * pose.q)
    if not width > 0.0:
        return math.nan
    sums[:] = 0.0
    for i in range(len(GAUSS_POINTS)):
        e = width * GAUSS_POINTS[i]
        ur, height, radius, bend, _, along = strip_point(geometry, pose, place + e)
        f, slope, _ = cubic_at(geometry.rail, geometry.rail_start, geometry.rail_step, ur)
        lower = -bend * along / math.sqrt(1.0 - along * along)
        circled = lower * pose.z_down + bend * pose.z_along
        circled = tilted * radius * (circled - slope * pose.side * (lower * pose.y_down + bend * pose.y_along))
        gap, slope = min(height - f, 0.0), pose.side * slope
        px = radius * along * pose.q + (geometry.half_distance + place + e) * pose.ex
        py, share = pose.side * (ur + geometry.rail_distance) - pose.y, 2.0 * gap * width * GAUSS_WEIGHTS[i]
        for n in range(3):
            sums[n, 0] += 0.5 * share * gap
            sums[n, 1 + ACROSS] -= share * slope
            sums[n, 1 + UP] += share
            sums[n, 1 + ROLL] += share * (py + slope * (height - pose.z))
            sums[n, 1 + YAW] += share * (circled - slope * px)
            share *= e
    return place


@jit(allocates=False, fastmath=FUSED)
def slopes_of_moments(geometry, pose, row, sums):
    """Fill ``sums`` (3, 1 + MOVES) with M0 to M2 of the overlap of a ``row`` and their derivatives (MOVES).

    The ``row`` was found spatially, by moments, at a position and attitude near ``pose``. Returns the wheel coordinate
    (m) about which the moments are taken, or NaN if there are too few nodes."""
    nodes = scan_nodes(geometry, pose, row)
    if _moment_slopes(geometry, pose, nodes, geometry.scan_wheel, geometry.scan_rail, True, sums)[0] >= WIDE:
        return nodes.u
    nodes = fine_nodes(geometry, pose, row)
    count, _, _ = _moment_slopes(geometry, pose, nodes, geometry.fine_wheel, geometry.fine_rail, True, sums)
    return nodes.u if count >= WIDE else math.nan


@jit(allocates=False, fastmath=FUSED)
def slopes_of_square(geometry, pose, row, sums):
    """Fill ``sums`` with M0, M1 and their derivatives for `wrcore.contact.search.approach.pressed_from`.

    The sums are over `smooth_nodes`, with corrections at the ends; the derivatives of M1 with respect to roll and yaw
    are left out. Returns the wheel coordinate (m) about which M1 is taken, or NaN if there are too few nodes."""
    nodes, wheel, rail = smooth_nodes(geometry, pose, row)
    count, first, last = _moment_slopes(geometry, pose, nodes, wheel, rail, False, sums)
    if count < WIDE:
        return math.nan
    for side in range(-1, 2, 2):
        inside = first if side < 0 else last
        _add_end(geometry, pose, nodes, wheel, rail, inside, inside + side, sums)
    return nodes.u


@jit(allocates=False, fastmath=FUSED)
def move_patch(geometry, pose, row, patch, sums, moved):
    """Fill ``moved[0, patch]`` with a patch and ``moved[1 + k, patch]`` with the patch after displacement k.

    Each displacement has the size `DIFFERENCE`. The ``row`` of the patch was found spatially, by moments. Returns False
    if a search is necessary. ``sums`` (3, 1 + MOVES) is scratch."""
    if leaves_cells(pose):
        return False
    middle = slopes_of_moments(geometry, pose, row, sums)
    if math.isnan(middle):
        middle = _narrow_slopes(geometry, pose, row, sums)
        if math.isnan(middle):
            return False
    if not patch_from_moments(geometry, pose, middle, sums[0, 0], sums[1, 0], sums[2, 0], moved[0, patch]):
        return False
    for k in range(MOVES):
        m0, m1 = sums[0, 0] + DIFFERENCE * sums[0, 1 + k], sums[1, 0] + DIFFERENCE * sums[1, 1 + k]
        m2 = sums[2, 0] + DIFFERENCE * sums[2, 1 + k]
        ex, ey, ez = moved_axle(pose.ex, pose.ey, pose.ez, k, DIFFERENCE)
        y, z = pose.y + (DIFFERENCE if k == ACROSS else 0.0), pose.z + (DIFFERENCE if k == UP else 0.0)
        there = make_pose(pose.side, y, z, ex, ey, ez, True)
        if not patch_from_moments(geometry, there, middle, m0, m1, m2, moved[1 + k, patch]):
            return False
    return True
