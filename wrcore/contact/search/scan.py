"""The scan: gaps of the strips of a wheel that can come close to its rail, eight at a time.

Wheel nodes and rail cells have the same spacing, so that the k-th strip lies over the k-th cell and all loads are
contiguous. What roll and yaw take away from that stays a fraction of a cell, or the search is told so.

Blocks of strips that cannot come close to contact are known from a table of lower bounds (`geometry.zone_gaps`); the
others form zones, and only these are scanned.
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
"""Strips that one call of `scan` can tell apart: the bits of two words."""


class Grid(NamedTuple):
    """How the strips of a wheel (its strip rows, see `geometry`) lie over rail cells of the same spacing (its cubics).

    The k-th strip, with its radius' shares ``down`` and ``along``, lies
    d = lateral + k lateral_rate + down y_down + along y_along from the start of its cell, and at the height
    height + k height_rate + down z_down + along z_along."""

    node: int
    cell: int
    """Those of the strip 0."""
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
    """The wheel nodes over the rail."""

    grid: Grid
    zone_row: int
    """Row of ``zone_gaps`` for poses of small angles: by node, and part of a cell that the strips stand in."""
    reserves: float
    """Gaps below so many reserves are close: the first one bounds what lies between two nodes, the rest, up to another
    one, what leaving the rail cell costs (in proportion to the square of the distance)."""


class StripRange(NamedTuple):
    """Which strips of a zone are below some limit, counted from its first one."""

    count: int
    first: int
    last: int


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def cell_offset(pose):
    """How far roll and yaw may move the scan's nodes away from their rail cells, m."""
    return OFFSET_PER_ROLL * abs(pose.ez) + OFFSET_PER_YAW_SQUARE * pose.tilt * pose.tilt


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def leaves_cells(pose):
    """Whether the scan's nodes leave their rail cells by too much, so that every strip must be looked up exactly. Small
    angles on real runs stay far below the limit: 12 mrad of roll or 15 mrad of yaw alone."""
    return cell_offset(pose) > LARGEST_OFFSET


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def rail_cell(geometry, pose, u):
    """Rail cell that really lies below the strip at u."""
    ur = strip_point(geometry, pose, u)[0]
    return min(max(int((ur - geometry.scan_rail_start) / SCAN_STEP), 0), geometry.scan_rail.shape[1] - 1)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _grid(pose, node, cell, reach, offset, step):
    """Strips ``step`` apart, the first one at ``reach`` along the axle over a cell that starts at ``offset``."""
    side_y = pose.side * pose.ey
    return Grid(
        node, cell, reach * side_y - offset, step * (side_y - 1.0), pose.z + reach * pose.ez,
        step * pose.ez, pose.side * pose.y_down, pose.side * pose.y_along * pose.tilt, pose.z_down,
        pose.z_along * pose.tilt, pose.tilt * pose.tilt,
    )  # fmt: skip


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def make_window(geometry, pose):
    """The scan's strips, one for each rail cell; ``grid.node`` may lie outside the nodes there are."""
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
    """Blocks with a strip that can be close, a bit for each."""
    small = window.reserves < 1.0 + SMALL_SHARE * SMALL_SHARE
    return _near_blocks(geometry, window.grid, window.zone_row if small else window.zone_row + PARTS, 0.0)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def blocks_with_planar_errors(geometry, window, yaw_square):
    """Blocks with a strip that can take part in `planar_bound`, a bit for each."""
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
    """First run of near blocks: its first strip, the strip after its last one, and the bits beyond."""
    first = lanes.lowest_bit(near)
    end = first + lanes.lowest_bit(~(near >> np.uint64(first)))
    return first * block, end * block, near & (~np.uint64(0) << np.uint64(end))


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def strip_position(grid, wheel, k):
    """Distance of the k-th strip from the start of its rail cell, and its height."""
    square, node = grid.tilt_square, np.uint64(grid.node + k)
    down = square * (wheel[DOWN_4, node] + square * wheel[DOWN_6, node])
    down = wheel[RADIUS, node] - square * (wheel[DOWN_2, node] + down)
    along = wheel[ALONG, node]
    d = grid.lateral + k * grid.lateral_rate + down * grid.y_down + along * grid.y_along
    return d, grid.height + k * grid.height_rate + down * grid.z_down + along * grid.z_along


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def strip_gap(grid, wheel, rail, k):
    """Gap of the k-th strip."""
    d, height = strip_position(grid, wheel, k)
    cell = np.uint64(grid.cell + k)
    return height - (rail[0, cell] + d * (rail[1, cell] + d * (rail[2, cell] + d * rail[3, cell])))


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def gaps_of_eight(grid, wheel, rail, k):
    """Gaps of eight strips from the k-th on, as `strip_gap`."""
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
    """From a bit for each strip, the first 64 of them in ``low``."""
    first = lanes.lowest_bit(low) if low > 0 else 64 + lanes.lowest_bit(high)
    last = 64 + lanes.highest_bit(high) if high > 0 else lanes.highest_bit(low)
    return StripRange(lanes.count_bits(low) + lanes.count_bits(high), first, last)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def scan(window, wheel, rail, begin, end):
    """Sums of g^2, g^2 i, g^2 i^2 over strips with negative gap g, from ``begin``, where i = 0, to before ``end``, at
    most `MOST_STRIPS`: what a single overlap needs; then the `StripRange` with a negative gap, and those with one below
    ``window.reserves`` times their reserve."""
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
    """The strip that overlaps most along the rail's normal, if the only overlap reaches from ``first`` to ``last``."""
    best, chosen = lanes.lanes8(0.0), lanes.lanes8(0.0)
    for k in range(first // LANES * LANES, last + 1, LANES):
        depth = -1.0 * gaps_of_eight(grid, wheel, rail, k) * lanes.load8(rail, RAIL_COSINE, np.uint64(k))
        chosen = lanes.where_below(best, depth, float(k) + lanes.ramp8(), chosen)
        best = lanes.where_below(best, depth, depth, best)
    shallower = lanes.below(best, lanes.lanes8(lanes.maximum(best)))
    return int(lanes.lane(chosen, lanes.lowest_bit(~shallower)))


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def fine_cell_shift(geometry, u, ur):
    """Number of the fine rail cell less that of the fine wheel node over it, at wheel u over rail ur."""
    return int(math.floor((ur - geometry.rail_start - u + geometry.wheel_start) / geometry.wheel_step))


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _profile_grid(geometry, pose, wheel, rail, rail_start, step, shift, first, last):
    """`Grid` of strips ``step`` apart from the profile's first node on, where they lie between ``first`` and ``last``
    on the wheel (m); where the first one lies, its number, and that after the last one. ``shift``: number of the rail
    cell below a strip less the strip's."""
    density = 1.0 / step
    begin = max(max(int((first - geometry.wheel_start) * density) + 1, 0), -shift)
    end = min(int((last - geometry.wheel_start) * density) + 1, wheel.shape[1] - LANES)
    end = min(end, rail.shape[1] - LANES - shift)
    origin, cell = geometry.wheel_start + begin * step, begin + shift
    offset = geometry.rail_distance - pose.side * pose.y + rail_start + cell * step
    return _grid(pose, begin, cell, geometry.half_distance + origin, offset, step), origin, begin, end


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def fine_grid(geometry, pose, shift, first, last):
    """`_profile_grid` of the strips at all of the profile's nodes. ``shift``: see `fine_cell_shift`, for the middle of
    an
    overlap."""
    return _profile_grid(
        geometry, pose, geometry.fine_wheel, geometry.fine_rail, geometry.rail_start, geometry.wheel_step, shift, first,
        last,
    )  # fmt: skip


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def spread_grid(geometry, pose, shift, first, last):
    """The same at its spread nodes, and the rail's cells below them."""
    part, step = shift % SPREAD, geometry.wheel_step
    rail, start = geometry.spread_rail[part], geometry.rail_start + part * step
    own = _profile_grid(
        geometry, pose, geometry.spread_wheel, rail, start, SPREAD * step, (shift - part) // SPREAD, first, last
    )
    return own, start, rail


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def fine_sums(geometry, pose, shift, first, last):
    """Integrals of g^2, g^2 e, g^2 e^2 over the strips at the wheel profile's own nodes between ``first`` and ``last``,
    the position (m) from which e counts, and the number of nodes in overlap, 0 where those of wheel and rail do not go
    together."""
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
    """Largest normal penetration (m) that planar detection misses where it could matter, at some strips.

    At a strip with slope R' the extreme point lies R R' psi^2 further out, over a rail of the same slope and of second
    derivative f'': missed is the height R (psi R')^2/2 + |f''| (R R' psi^2)^2/2. The first term, along the normal, is
    the first-order law r psi^2 tan^2(delta) cos(delta)/2; the second one counts on the flange. It matters where the
    planar gap is below that height (or its reserve)."""
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
