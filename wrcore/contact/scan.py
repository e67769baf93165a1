"""The scan: gaps of all strips of a wheel that can lie over its rail, in vector registers.

Scan nodes of the wheel and cells of the rail have the same spacing, so that the k-th strip lies over the k-th cell and
all loads are contiguous. What roll and yaw take away from that stays a fraction of a cell, or the search is told so.
"""

import math

from wrcore._jit import FAST, jit
from wrcore.contact.geometry import RADIUS, RADIUS_SLOPE, RAIL_RESERVE, RESERVE_TO_SECOND, SCAN_STEP, WHEEL_RESERVE
from wrcore.contact.strip import strip_point

CHUNK = 8
"""Strips that are passed over together where none of them is close."""

_CELL_SHARE = 0.6
"""Share of a rail cell by which the scan's nodes may leave it; the second reserve covers what that costs."""


@jit(allocates=False, forceinline=True)
def leaves_cells(pose):
    """Whether the scan's nodes leave their rail cells by too much, so that every strip must be looked up exactly.

    Roll moves a strip sideways by its radius' difference to the tape circle (0.03 m at the flange tip), yaw by
    R R' psi^2 (R R' = 1.5 m on a flange of 70 degrees). Small angles on real runs stay far below the limit: 12 mrad of
    roll or 15 mrad of yaw alone.
    """
    return 0.03 * abs(pose.ez) + 1.5 * pose.tilt * pose.tilt > _CELL_SHARE * SCAN_STEP


@jit(allocates=False, forceinline=True)
def rail_cell(geometry, pose, u):
    """Rail cell that really lies below the strip at u."""
    ur = strip_point(geometry, pose, u)[0]
    return min(max(int((ur - geometry.scan_rail_start) / SCAN_STEP), 0), geometry.scan_rail.shape[1] - 1)


@jit(allocates=False, forceinline=True)
def window(geometry, pose):
    """First wheel node over the rail, its distance along the axle, and the track coordinate of the first rail cell."""
    offset = geometry.rail_distance + geometry.scan_rail_start - pose.side * pose.y
    shift = (geometry.half_distance + geometry.scan_wheel_start) * pose.side * pose.ey
    shift += geometry.rolling_radius * pose.side * pose.y_down
    node = int(math.floor((offset - shift) / SCAN_STEP)) + 1
    return node, geometry.half_distance + geometry.scan_wheel_start + node * SCAN_STEP, offset


@jit(allocates=False, fastmath=FAST)
def scan(pose, scan_wheel, scan_rail, node, reach, offset):
    """Sums over all strips that can lie over the rail: what a single wide overlap needs.

    The rail cell of the k-th strip is k: wheel nodes and rail cells have the same spacing. What roll and yaw take away
    from it (``d`` outside its cell) stays a fraction of a cell where overlaps are wide. All loads are contiguous and
    there is no branch, so that the loop runs in vector registers.

    Returns
    -------
    m0, m1, m2 : float
        Sums of g^2, g^2 k, g^2 k^2 over strips with negative gap g.
    overlapping, first, last : int
        Number of those strips, the first and the last of them.
    close, first_close, last_close : int
        The same for strips with a gap below twice their reserve (the second one covers what leaving the cell costs).
    """
    cells = scan_rail.shape[1]
    radii, slopes = scan_wheel[RADIUS, node : node + cells], scan_wheel[RADIUS_SLOPE, node : node + cells]
    reserves, rail_reserves = scan_wheel[WHEEL_RESERVE, node : node + cells], scan_rail[RAIL_RESERVE]
    c0, c1, c2, c3 = scan_rail[0], scan_rail[1], scan_rail[2], scan_rail[3]
    side_y = pose.side * pose.ey
    y_down, y_along = pose.side * pose.y_down, pose.side * pose.y_along
    m0 = m1 = m2 = 0.0
    overlapping = close = 0
    first = first_close = cells
    last = last_close = -1
    for k in range(cells):
        radius, along = radii[k], slopes[k] * pose.tilt
        square = along * along
        down = 1.0 - square * (0.5 + square * (0.125 + square * 0.0625))  # sqrt(1 - along^2) to along^8/26
        position = k * SCAN_STEP
        axial = reach + position
        d = axial * side_y + radius * (down * y_down + along * y_along) - offset - position
        rail = c0[k] + d * (c1[k] + d * (c2[k] + d * c3[k]))
        gap = pose.z + axial * pose.ez + radius * (down * pose.z_down + along * pose.z_along) - rail
        index = float(k)
        negative = min(gap, 0.0)
        square = negative * negative
        m0 += square
        m1 += square * index
        m2 += square * index * index
        below = gap < 0.0
        overlapping += below
        first = min(first, k if below else cells)
        last = max(last, k if below else -1)
        below = gap < 2.0 * (reserves[k] + rail_reserves[k])
        close += below
        first_close = min(first_close, k if below else cells)
        last_close = max(last_close, k if below else -1)
    return m0, m1, m2, overlapping, first, last, close, first_close, last_close


@jit(allocates=False, fastmath=FAST)
def fine_sums(geometry, pose, first, last):
    """Moments of g^2 over the strips at the wheel profile's own nodes from ``first`` to ``last``.

    Returns
    -------
    m0, m1, m2 : float
        Integrals of g^2, g^2 e, g^2 e^2 over the overlap, e from the position ``origin``.
    origin : float
        m.
    nodes : float
        Number of nodes in overlap; 0 where the nodes of wheel and rail do not go together.
    """
    step = geometry.wheel_step
    begin = max(int((first - geometry.wheel_start) / step), 0)
    end = min(int((last - geometry.wheel_start) / step) + 2, geometry.fine_wheel.shape[1])
    middle = (begin + end) // 2
    ur = strip_point(geometry, pose, geometry.wheel_start + middle * step)[0]
    ahead = int(math.floor((ur - geometry.rail_start) / step)) - middle  # cell less node
    begin, end = max(begin, -ahead), min(end, geometry.fine_rail.shape[1] - ahead)
    origin = geometry.wheel_start + begin * step
    count, cell = end - begin, begin + ahead
    if count <= 0:
        return 0.0, 0.0, 0.0, origin, 0.0
    radii, slopes = geometry.fine_wheel[0, begin : begin + count], geometry.fine_wheel[1, begin : begin + count]
    c0, c1 = geometry.fine_rail[0, cell : cell + count], geometry.fine_rail[1, cell : cell + count]
    c2, c3 = geometry.fine_rail[2, cell : cell + count], geometry.fine_rail[3, cell : cell + count]
    reach = geometry.half_distance + origin
    offset = geometry.rail_distance - pose.side * pose.y + geometry.rail_start + cell * step
    side_y = pose.side * pose.ey
    y_down, y_along = pose.side * pose.y_down, pose.side * pose.y_along
    m0 = m1 = m2 = nodes = 0.0
    for k in range(count):
        radius, along = radii[k], slopes[k] * pose.tilt
        square = along * along
        down = 1.0 - square * (0.5 + square * (0.125 + square * 0.0625))
        position = k * step
        axial = reach + position
        d = axial * side_y + radius * (down * y_down + along * y_along) - offset - position
        rail = c0[k] + d * (c1[k] + d * (c2[k] + d * c3[k]))
        gap = pose.z + axial * pose.ez + radius * (down * pose.z_down + along * pose.z_along) - rail
        negative = min(gap, 0.0)
        square = negative * negative
        m0 += square
        m1 += square * position
        m2 += square * position * position
        nodes += 1.0 if gap < 0.0 else 0.0
    return m0 * step, m1 * step, m2 * step, origin, nodes


@jit(allocates=False, forceinline=True)
def strip_gap(pose, scan_wheel, scan_rail, node, reach, offset, k):
    """Gap of the k-th strip, as in `scan`."""
    radius, along = scan_wheel[RADIUS, node + k], scan_wheel[RADIUS_SLOPE, node + k] * pose.tilt
    square = along * along
    down = 1.0 - square * (0.5 + square * (0.125 + square * 0.0625))
    axial = reach + k * SCAN_STEP
    lateral = axial * pose.ey + radius * (down * pose.y_down + along * pose.y_along)
    d = pose.side * lateral - offset - k * SCAN_STEP
    rail = scan_rail[0, k] + d * (scan_rail[1, k] + d * (scan_rail[2, k] + d * scan_rail[3, k]))
    return pose.z + axial * pose.ez + radius * (down * pose.z_down + along * pose.z_along) - rail


@jit(allocates=False, forceinline=True, fastmath=FAST)
def any_close(pose, scan_wheel, scan_rail, node, reach, offset, first):
    """Number of strips with a gap below twice their reserve among the ``CHUNK + 8`` strips from ``first`` on."""
    count = 0
    for i in range(CHUNK + 8):
        k = first + i
        gap = strip_gap(pose, scan_wheel, scan_rail, node, reach, offset, k)
        count += gap < 2.0 * (scan_wheel[WHEEL_RESERVE, node + k] + scan_rail[RAIL_RESERVE, k])
    return count


@jit(allocates=False, fastmath=FAST)
def planar_bound(pose, scan_wheel, scan_rail, node, reach, offset):
    """Largest normal penetration (m) that planar detection misses where it could matter.

    At a strip with slope R' the extreme point lies R R' psi^2 further out, over a rail of the same slope and of second
    derivative f'': missed is the height R (psi R')^2/2 + |f''| (R R' psi^2)^2/2. The first term, along the normal, is
    the first-order law r psi^2 tan^2(delta) cos(delta)/2; the second one counts on the flange. It matters where the
    planar gap is below that height (or its reserve).
    """
    cells = scan_rail.shape[1]
    radii, slopes = scan_wheel[RADIUS, node : node + cells], scan_wheel[RADIUS_SLOPE, node : node + cells]
    reserves, rail_reserves = scan_wheel[WHEEL_RESERVE, node : node + cells], scan_rail[RAIL_RESERVE]
    c0, c1, c2, c3 = scan_rail[0], scan_rail[1], scan_rail[2], scan_rail[3]
    yaw_square = pose.ex * pose.ex
    bound = 0.0
    for k in range(cells):
        position = k * SCAN_STEP
        axial = reach + position
        d = pose.side * (axial * pose.ey + radii[k] * pose.y_down) - offset - position
        gap = pose.z + axial * pose.ez + radii[k] * pose.z_down - (c0[k] + d * (c1[k] + d * (c2[k] + d * c3[k])))
        steep = slopes[k] * slopes[k]
        shift = radii[k] * yaw_square * slopes[k]
        missed = 0.5 * radii[k] * yaw_square * steep + rail_reserves[k] * RESERVE_TO_SECOND * 0.5 * shift * shift
        along_normal = missed / math.sqrt(1.0 + steep)
        close = gap < missed + 2.0 * (reserves[k] + rail_reserves[k])
        bound = max(bound, along_normal if close else 0.0)
    return bound
