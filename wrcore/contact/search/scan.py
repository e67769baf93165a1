"""Scan of the strips of a wheel near its rail: gaps of eight strips at a time.

Wheel nodes and rail cells have the same spacing, so that the k-th strip lies over the k-th cell and all loads are
contiguous. Roll and yaw displace the strips by a fraction of a cell; for larger displacements see `leaves_cells`.

A table of lower bounds (`geometry.zone_gaps`) excludes blocks of strips that cannot come close to contact. The other
blocks form zones, and only zones are scanned.
"""

import math
from typing import NamedTuple

import numpy as np

from wrcore.contact.search.geometry import (
    ALONG,
    DOWN_2,
    DOWN_4,
    DOWN_6,
    LANES,
    LARGEST_OFFSET,
    OFFSET_PER_ROLL,
    OFFSET_PER_YAW_SQUARE,
    PARTS,
    RADIUS,
    RAIL_COSINE,
    RAIL_RESERVE,
    SCAN_STEP,
    SECOND_BOUND,
    SMALL_SHARE,
    SPREAD,
    WHEEL_COSINE,
    WHEEL_RESERVE,
)
from wrcore.contact.search.strip import strip_point
from wrcore.kernels import lanes
from wrcore.kernels.jit import FUSED, jit

MOST_STRIPS = 128
"""Maximum number of strips in one call of `scan`: it has a bit for each strip in two words of 64 bits."""


class Grid(NamedTuple):
    """Coefficients of the position of a wheel's strips over rail cells of the same spacing.

    The k-th strip, with the components ``down`` and ``along`` of its radius (strip rows, see `geometry`), lies
    d = lateral + k lateral_rate + down y_down + along y_along from the start of its cell, and at the height
    height + k height_rate + down z_down + along z_along."""

    node: int
    cell: int
    """Rail cell below strip 0; ``node`` is the wheel node of strip 0."""
    lateral: float
    lateral_rate: float
    height: float
    height_rate: float
    y_down: float
    y_along: float
    z_down: float
    z_along: float
    tilt_square: float


class Window(NamedTuple):
    """Strips of a wheel over the rail cells, and limits of the scan."""

    grid: Grid
    zone_row: int
    """Row of ``zone_gaps`` for small angles, by wheel node and by the part of a rail cell in which the strips lie."""
    reserves: float
    """Limit of small gaps as a multiple of the reserve, 1 to 2. The first reserve bounds the gap between two nodes. The
    part over 1 bounds the error where strips leave their rail cells; it grows as the square of the distance."""


class StripRange(NamedTuple):
    """Count, first and last of the strips of a zone with a gap below a limit, numbered from the zone's first strip."""

    count: int
    first: int
    last: int


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def cell_offset(pose):
    """Upper bound of the distance by which roll and yaw move the scan's nodes out of their rail cells, m."""
    return OFFSET_PER_ROLL * abs(pose.ez) + OFFSET_PER_YAW_SQUARE * pose.tilt * pose.tilt


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def leaves_cells(pose):
    """Whether the scan's nodes leave their rail cells by too much, so that the rail cell of each strip must be found.

    The limit is 12 mrad of roll without yaw, or 15 mrad of yaw without roll. Angles in real runs are far smaller."""
    return cell_offset(pose) > LARGEST_OFFSET


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def rail_cell(geometry, pose, u):
    """Number of the rail cell below the strip at wheel coordinate ``u``, for any roll and yaw."""
    ur = strip_point(geometry, pose, u)[0]
    return min(max(int((ur - geometry.scan_rail_start) / SCAN_STEP), 0), geometry.scan_rail.shape[1] - 1)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _grid(pose, node, cell, reach, offset, step):
    """Return the `Grid` of strips with a spacing of ``step`` (m).

    The first strip is at ``reach`` (m) on the axle; its rail cell starts at ``offset`` (m)."""
    side_y = pose.side * pose.ey
    return Grid(
        node, cell, reach * side_y - offset, step * (side_y - 1.0), pose.z + reach * pose.ez,
        step * pose.ez, pose.side * pose.y_down, pose.side * pose.y_along * pose.tilt, pose.z_down,
        pose.z_along * pose.tilt, pose.tilt * pose.tilt,
    )  # fmt: skip


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def make_window(geometry, pose):
    """Return the `Window` of the scan, with one strip for each rail cell.

    ``grid.node`` may lie outside the wheel's nodes."""
    offset = geometry.rail_distance + geometry.scan_rail_start - pose.side * pose.y
    start = geometry.half_distance + geometry.scan_wheel_start
    position = offset - pose.side * (start * pose.ey + geometry.rolling_radius * pose.y_down)
    position *= 1.0 / SCAN_STEP
    node = int(math.floor(position)) + 1
    part = min(int((node - position) * PARTS), PARTS - 1)
    share = cell_offset(pose) * (1.0 / LARGEST_OFFSET)
    grid = _grid(pose, node, 0, start + node * SCAN_STEP, offset, SCAN_STEP)
    return Window(grid, 2 * PARTS * node + part, 1.0 + share * share)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def near_blocks(geometry, window):
    """Bit set of the blocks in which a strip can have a small gap."""
    small = window.reserves < 1.0 + SMALL_SHARE * SMALL_SHARE
    return _near_blocks(geometry, window.grid, window.zone_row if small else window.zone_row + PARTS, 0.0)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def blocks_with_planar_errors(geometry, window, yaw_square):
    """Bit set of the blocks in which a strip can contribute to `planar_bound`."""
    return _near_blocks(geometry, window.grid, window.zone_row + PARTS, yaw_square)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _near_blocks(geometry, grid, row, yaw_square):
    rise = geometry.block * grid.height_rate
    low = grid.height + 0.5 * (rise - abs(rise)) + lanes.ramp8() * rise
    near = np.uint64(0)
    for first in range(0, geometry.zone_gaps.shape[1], LANES):
        block, limit = np.uint64(first), lanes.lanes8(0.0)
        if yaw_square > 0.0:
            limit = yaw_square * lanes.load8(geometry.zone_planar_errors, np.uint64(grid.node), block)
        gaps = lanes.load8(geometry.zone_gaps, np.uint64(row), block)
        near |= lanes.below(gaps + (low + float(first) * rise), limit) << block
    return near


@jit(allocates=False, forceinline=True)
def first_zone(near, block):
    """Return the first strip of the first run of near blocks, the strip after its last one, and the bits of later
    blocks."""
    first = lanes.lowest_bit(near)
    end = first + lanes.lowest_bit(~(near >> np.uint64(first)))
    return first * block, end * block, near & (~np.uint64(0) << np.uint64(end))


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def strip_position(grid, wheel, k):
    """Distance of the k-th strip from the start of its rail cell, and its height, both in m."""
    square, node = grid.tilt_square, np.uint64(grid.node + k)
    down = square * (wheel[DOWN_4, node] + square * wheel[DOWN_6, node])
    down = wheel[RADIUS, node] - square * (wheel[DOWN_2, node] + down)
    along = wheel[ALONG, node]
    d = grid.lateral + k * grid.lateral_rate + down * grid.y_down + along * grid.y_along
    return d, grid.height + k * grid.height_rate + down * grid.z_down + along * grid.z_along


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def strip_gap(grid, wheel, rail, k):
    """Vertical gap of the k-th strip, m."""
    d, height = strip_position(grid, wheel, k)
    cell = np.uint64(grid.cell + k)
    return height - (rail[0, cell] + d * (rail[1, cell] + d * (rail[2, cell] + d * rail[3, cell])))


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def gaps_of_eight(grid, wheel, rail, k):
    """Vertical gaps of the eight strips k to k + 7, m."""
    square, node = grid.tilt_square, np.uint64(grid.node + k)
    down = square * (lanes.load8(wheel, DOWN_4, node) + square * lanes.load8(wheel, DOWN_6, node))
    down = lanes.load8(wheel, RADIUS, node) - square * (lanes.load8(wheel, DOWN_2, node) + down)
    along, index = lanes.load8(wheel, ALONG, node), float(k) + lanes.ramp8()
    d = grid.lateral + index * grid.lateral_rate + down * grid.y_down + along * grid.y_along
    height = grid.height + index * grid.height_rate + down * grid.z_down + along * grid.z_along
    return height - _rail_heights(rail, grid.cell + k, d)


@jit(allocates=False, forceinline=True)
def _rail_heights(rail, first, d):
    cell = np.uint64(first)
    slope = lanes.load8(rail, 1, cell) + d * (lanes.load8(rail, 2, cell) + d * lanes.load8(rail, 3, cell))
    return lanes.load8(rail, 0, cell) + d * slope


@jit(allocates=False, forceinline=True)
def _strips(low, high):
    """Return the `StripRange` of the bits set in two words, with strips 0 to 63 in ``low``."""
    first = lanes.lowest_bit(low) if low > 0 else 64 + lanes.lowest_bit(high)
    last = 64 + lanes.highest_bit(high) if high > 0 else lanes.highest_bit(low)
    return StripRange(lanes.count_bits(low) + lanes.count_bits(high), first, last)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def scan(window, wheel, rail, begin, end):
    """Sum the moments of a single overlap over the strips ``begin`` to ``end`` - 1, and find strips with small gaps.

    Returns sums of g^2, g^2 i, g^2 i^2 over strips with negative gap g, with i = 0 at ``begin``. Then the `StripRange`
    of strips with a negative gap, and that of strips with a gap below ``window.reserves`` times their reserve. At most
    `MOST_STRIPS` strips."""
    grid, zero = window.grid, lanes.lanes8(0.0)
    m0, m1, m2 = zero, zero, zero
    overlap_low = overlap_high = close_low = close_high = np.uint64(0)
    for i in range(0, end - begin, LANES):
        index, gap = float(i) + lanes.ramp8(), gaps_of_eight(grid, wheel, rail, begin + i)
        negative = lanes.where_below(gap, zero, gap, zero)
        weight = negative * negative
        first_moment = weight * index
        m0, m1, m2 = m0 + weight, m1 + first_moment, m2 + first_moment * index
        cell = np.uint64(begin + i)
        reserve = lanes.load8(wheel, WHEEL_RESERVE, np.uint64(grid.node) + cell) + lanes.load8(rail, RAIL_RESERVE, cell)
        overlap, close, shift = lanes.below(gap, zero), lanes.below(gap, window.reserves * reserve), np.uint64(i & 63)
        if i < 64:
            overlap_low, close_low = overlap_low | overlap << shift, close_low | close << shift
        else:
            overlap_high, close_high = overlap_high | overlap << shift, close_high | close << shift
    overlaps, near = _strips(overlap_low, overlap_high), _strips(close_low, close_high)
    return lanes.total(m0), lanes.total(m1), lanes.total(m2), overlaps, near


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def deepest_strip(grid, wheel, rail, first, last):
    """Number of the strip with the maximum penetration along the rail's normal, in one overlap from ``first`` to
    ``last``."""
    best, chosen = lanes.lanes8(0.0), lanes.lanes8(0.0)
    for k in range(first // LANES * LANES, last + 1, LANES):
        depth = -1.0 * gaps_of_eight(grid, wheel, rail, k) * lanes.load8(rail, RAIL_COSINE, np.uint64(k))
        chosen = lanes.where_below(best, depth, float(k) + lanes.ramp8(), chosen)
        best = lanes.where_below(best, depth, depth, best)
    shallower = lanes.below(best, lanes.lanes8(lanes.maximum(best)))
    return int(lanes.lane(chosen, lanes.lowest_bit(~shallower)))


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def fine_cell_shift(geometry, u, ur):
    """Number of the fine rail cell at the rail coordinate ``ur`` minus that of the fine wheel node at ``u`` over it."""
    return int(math.floor((ur - geometry.rail_start - u + geometry.wheel_start) / geometry.wheel_step))


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _profile_grid(geometry, pose, wheel, rail, rail_start, step, shift, first, last):
    """Return the `Grid` of the strips at nodes between ``first`` and ``last`` on the wheel (m).

    The nodes have a spacing of ``step`` (m) from the profile's first node. ``shift`` is the number of the rail cell
    below a strip minus that of the strip. Further results: wheel coordinate (m) and number of the first strip, and the
    number after that of the last strip."""
    density = 1.0 / step
    begin = max(max(int((first - geometry.wheel_start) * density) + 1, 0), -shift)
    end = min(int((last - geometry.wheel_start) * density) + 1, wheel.shape[1] - LANES)
    end = min(end, rail.shape[1] - LANES - shift)
    origin, cell = geometry.wheel_start + begin * step, begin + shift
    offset = geometry.rail_distance - pose.side * pose.y + rail_start + cell * step
    return _grid(pose, begin, cell, geometry.half_distance + origin, offset, step), origin, begin, end


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def fine_grid(geometry, pose, shift, first, last):
    """Return the results of `_profile_grid` for the strips at all nodes of the wheel profile.

    ``shift`` is that of `fine_cell_shift` at the middle of an overlap."""
    return _profile_grid(
        geometry, pose, geometry.fine_wheel, geometry.fine_rail, geometry.rail_start, geometry.wheel_step, shift, first,
        last,
    )  # fmt: skip


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def spread_grid(geometry, pose, shift, first, last):
    """Return the results of `_profile_grid` at the spread nodes, the rail coordinate (m) of the first rail cell, and
    the rail cells (4, ...)."""
    part, step = shift % SPREAD, geometry.wheel_step
    rail, start = geometry.spread_rail[part], geometry.rail_start + part * step
    own = _profile_grid(
        geometry, pose, geometry.spread_wheel, rail, start, SPREAD * step, (shift - part) // SPREAD, first, last
    )
    return own, start, rail


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def fine_sums(geometry, pose, shift, first, last):
    """Integrate g^2, g^2 e, g^2 e^2 over the strips at the wheel profile's nodes between ``first`` and ``last``.

    Returns the three integrals, the wheel coordinate (m) of e = 0, and the number of nodes in overlap. This number is 0
    if the node spacings of wheel and rail differ."""
    wheel, rail, step = geometry.fine_wheel, geometry.fine_rail, geometry.wheel_step
    grid, origin, begin, end = fine_grid(geometry, pose, shift, first, last)
    zero, size = lanes.lanes8(0.0), lanes.lanes8(float(end - begin))
    m0, m1, m2 = zero, zero, zero
    nodes = 0
    for k in range(0, end - begin, LANES):
        index, gap = float(k) + lanes.ramp8(), gaps_of_eight(grid, wheel, rail, k)
        negative = lanes.where_below(index, size, lanes.where_below(gap, zero, gap, zero), zero)
        weight = negative * negative
        first_moment = weight * index
        m0, m1, m2 = m0 + weight, m1 + first_moment, m2 + first_moment * index
        nodes += lanes.count_bits(lanes.below(negative, zero))
    return lanes.total(m0) * step, lanes.total(m1) * step**2, lanes.total(m2) * step**3, origin, nodes


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def planar_bound(grid, yaw_square, wheel, rail, begin, end):
    """Maximum normal penetration (m) that planar detection misses at the strips ``begin`` to ``end`` - 1.

    At a strip with slope R' the extreme point lies R R' psi^2 further out, over a rail of the same slope and of second
    derivative f''. Planar detection misses the height R (psi R')^2/2 + |f''| (R R' psi^2)^2/2. The first term, along
    the normal, is the first-order law r psi^2 tan^2(delta) cos(delta)/2; the second is significant on the flange. Only
    strips whose planar gap is below this height plus two reserves contribute."""
    largest = lanes.lanes8(0.0)
    for k in range(begin, end, LANES):
        node = np.uint64(grid.node + k)
        index, radius = float(k) + lanes.ramp8(), lanes.load8(wheel, RADIUS, node)
        d = grid.lateral + index * grid.lateral_rate + radius * grid.y_down
        gap = grid.height + index * grid.height_rate + radius * grid.z_down - _rail_heights(rail, k, d)
        shift, reserve = yaw_square * lanes.load8(wheel, ALONG, node), lanes.load8(rail, RAIL_RESERVE, np.uint64(k))
        missed = yaw_square * lanes.load8(wheel, DOWN_2, node) + (0.5 * SECOND_BOUND) * reserve * shift * shift
        limit = missed + 2.0 * (lanes.load8(wheel, WHEEL_RESERVE, node) + reserve)
        counted = lanes.where_below(gap, limit, missed * lanes.load8(wheel, WHEEL_COSINE, node), lanes.lanes8(0.0))
        largest = lanes.where_below(largest, counted, counted, largest)
    return lanes.maximum(largest)
