"""Contact detection on a tangent track: planar and spatial search for the patches between a wheel and its rail.

:mod:`wrcore.contact.search.strip` computes the gap between wheel and rail over the wheel's lateral coordinate. Every
interval of negative gap is an overlap. One of two rules reduces it to a Hertz patch
(:mod:`wrcore.contact.search.reduction`).

Each search evaluates all strips and uses no result of an earlier search, so that it cannot lose a patch. Between two
nodes of the scan the gap is less than at the nodes by at most a known reserve (M h^2/8). Where the nodes alone cannot
exclude an overlap, the search evaluates points between them.

References
----------
Ferreira, Flores, Marques, On the utilization of simplified methodologies for the wheel-rail contact, section 3.
Marques et al., Mechanism and Machine Theory 149 (2020) 103825 (spatial search by wheel strips).
"""

import math
from dataclasses import dataclass

import numpy as np

from wrcore.contact.search.geometry import (
    RADIUS,
    RAIL_COSINE,
    RAIL_RESERVE,
    SCAN_STEP,
    SECOND_BOUND,
    WHEEL_RESERVE,
    YAW_LIMIT,
)
from wrcore.contact.search.reduction import (
    BEYOND,
    CURVATURE_Y,
    MAX_PATCHES,
    MAXIMUM,
    MOMENT,
    OUTSIDE,
    PATCH_COLUMNS,
    PENETRATION,
    REDUCTIONS,
    SLOPE_TOLERANCE,
    deepest_point,
    edges_of_overlap,
    overlap_moments,
    patch_at_maximum,
    patch_from_moments,
)
from wrcore.contact.search.scan import (
    MOST_STRIPS,
    blocks_with_planar_errors,
    deepest_strip,
    fine_cell_shift,
    fine_sums,
    first_zone,
    leaves_cells,
    make_window,
    near_blocks,
    planar_bound,
    rail_cell,
    scan,
    strip_gap,
    strip_position,
)
from wrcore.contact.search.strip import changes_along, gap_at, make_pose, strip_point
from wrcore.errors import InputError, one_of
from wrcore.kernels.handles import Handle
from wrcore.kernels.jit import jit, rarely_called

DETECTIONS = {"planar": 0, "spatial": 1, "auto": 2}
PLANAR, SPATIAL, AUTO = 0, 1, 2
"""Codes of the detections. ``auto`` is planar while the bound of the planar error is below a tolerance, else
spatial."""

_PARTS, _EXACT_PARTS = 3, 12
"""Sub-intervals of a scan step where the search evaluates points between two nodes: for common positions and attitudes,
and for those where strips leave their rail cells (`leaves_cells`). In the second case strips on a curved flange have up
to four times the spacing over the rail."""

_FLANK = 2
"""Number of strips with a small gap on either side of an overlap that are attributed to this overlap."""

WIDE = 10
"""Minimum number of nodes for a sum over nodes. Overlaps with fewer scan nodes are integrated over the nodes of the
profiles. If these are too few as well, Gauss-Legendre quadrature between the edges is used."""

_AS_ONE = 0.5
"""Maximum change of the rail's inclination (rad) between two overlaps that are merged when there are more overlaps than
rows."""


@jit(allocates=False)
def _take_out(patches, k):
    """Remove the k-th row of a full patch array; the order of the other rows does not change."""
    for i in range(k, MAX_PATCHES - 1):
        for column in range(PATCH_COLUMNS):
            patches[i, column] = patches[i + 1, column]


@jit(allocates=False)
def _join_shallowest(geometry, pose, outside, beyond, depth, patches):
    """Merge the shallowest overlap with its nearer neighbour, to make room for one more overlap in a full array.

    The further overlap reaches from ``outside`` to ``beyond`` and has the penetration ``depth`` (m). All rows come from
    the reduction ``moment``. Returns the row that is free for the further overlap, MAX_PATCHES if it was merged with
    the last row, or -1 if the rail's inclination differs too much (`_AS_ONE`)."""
    last, shallowest = MAX_PATCHES - 1, MAX_PATCHES
    for k in range(MAX_PATCHES):
        if patches[k, PENETRATION] < depth:
            shallowest, depth = k, patches[k, PENETRATION]
    first = max(shallowest - 1, 0)
    if 0 < shallowest < MAX_PATCHES:
        after = outside if shallowest == last else patches[shallowest + 1, OUTSIDE]
        if after - patches[shallowest, BEYOND] < patches[shallowest, OUTSIDE] - patches[first, BEYOND]:
            first = shallowest
    start, begin, end = patches[first, OUTSIDE], patches[first, BEYOND], beyond
    turn = math.atan(gap_at(geometry, pose, outside)[1])
    if first < last:
        turn, end = math.atan(gap_at(geometry, pose, patches[first + 1, OUTSIDE])[1]), patches[first + 1, BEYOND]
    if abs(turn - math.atan(gap_at(geometry, pose, begin)[1])) > _AS_ONE:
        return -1
    middle = 0.5 * (start + end)
    shift = fine_cell_shift(geometry, middle, strip_point(geometry, pose, middle)[0])
    m0, m1, m2, middle, _ = fine_sums(geometry, pose, shift, start, end)
    if not patch_from_moments(geometry, pose, middle, m0, m1, m2, patches[first]):
        return -1
    patches[first, OUTSIDE], patches[first, BEYOND] = start, end
    if first < last:
        _take_out(patches, first + 1)
    return last if first < last else MAX_PATCHES


@jit(allocates=False)
def _add_overlap(geometry, pose, reduction, outside, first, last, beyond, deepest, depth, m0, m1, m2, nodes, patches,
                 count):  # fmt: skip
    """Reduce one overlap to a patch, store it and return the new number of patches.

    If all rows are in use, the shallowest patch is merged with its neighbour (`_join_shallowest`) or replaced by a
    deeper one. ``outside`` and ``beyond`` are points without overlap next to the overlap's ``first`` and ``last``
    strip. ``deepest`` is the deepest strip and ``depth`` its penetration along the normal. m0, m1, m2 are sums of g^2,
    g^2 e and g^2 e^2 over the ``nodes`` scan nodes, with e (m) from ``first``."""
    if count == MAX_PATCHES and reduction == MOMENT and not (leaves_cells(pose) or changes_along(geometry)):
        free = _join_shallowest(geometry, pose, outside, beyond, depth, patches)
        if free == MAX_PATCHES:
            return count
        count = free if free >= 0 else count
    if count == MAX_PATCHES:
        shallowest = 0
        for k in range(1, MAX_PATCHES):
            if patches[k, PENETRATION] < patches[shallowest, PENETRATION]:
                shallowest = k
        if depth <= patches[shallowest, PENETRATION]:
            return count
        count -= 1
        _take_out(patches, shallowest)
    row = patches[count]
    if reduction == MOMENT:
        if nodes >= WIDE:
            middle = first
            m0, m1, m2 = m0 * SCAN_STEP, m1 * SCAN_STEP, m2 * SCAN_STEP
        else:
            fine_nodes, middle = 0, 0.5 * (outside + beyond)
            if not leaves_cells(pose):
                shift = fine_cell_shift(geometry, middle, strip_point(geometry, pose, middle)[0])
                m0, m1, m2, middle, fine_nodes = fine_sums(geometry, pose, shift, outside, beyond)
            if fine_nodes < WIDE:
                start, end = edges_of_overlap(geometry, pose, outside, first, last, beyond, deepest)
                middle = 0.5 * (start + end)
                m0, m1, m2 = overlap_moments(geometry, pose, start, end)
        row[OUTSIDE], row[BEYOND] = outside, beyond
        return count + patch_from_moments(geometry, pose, middle, m0, m1, m2, row)
    return count + patch_at_maximum(geometry, pose, deepest, outside, beyond, row)


@jit(allocates=False)
def _search(geometry, pose, grid, reduction, first_close, last_close, patches, count):
    """Find all overlaps strip by strip, add their patches to the ``count`` present ones and return the new number.

    Where the reserve allows an overlap between two nodes that have none, points between the nodes are evaluated. Only
    strips from ``first_close`` to ``last_close`` and their neighbours are searched. Strips are numbered over the rail
    cells; where strips leave their cells, all strips of the wheel are included."""
    rarely_called()
    wheel, rail = geometry.scan_wheel, geometry.scan_rail
    cells = rail.shape[1]
    exact = leaves_cells(pose)
    begin = geometry.scan_wheel_start + grid.node * SCAN_STEP
    wheel_end = geometry.wheel_start + (geometry.wheel.shape[0] - 1) * geometry.wheel_step
    nodes = 0
    inside = False
    outside = first = last = deepest = begin
    depth = m0 = m1 = m2 = 0.0
    least, most = 0, cells
    if exact:
        least, most = cells - grid.node, wheel.shape[1] - cells - grid.node
    k = max(first_close - 1, least)
    two_back, one_back, before = 1.0, 1.0, 1.0
    two_back_at, one_back_at = begin + (k - 2) * SCAN_STEP, begin + (k - 1) * SCAN_STEP
    end = min(last_close + 2, most)
    while k < end:
        here = begin + k * SCAN_STEP
        if here < geometry.wheel_start or here > wheel_end:
            coarse = 1.0
        elif exact:
            coarse = gap_at(geometry, pose, here)[0]
        else:
            coarse = strip_gap(grid, wheel, rail, k)
        cell = rail_cell(geometry, pose, here) if exact else k
        reserve = wheel[WHEEL_RESERVE, grid.node + k] + rail[RAIL_RESERVE, cell]
        if exact:  # yaw increases the spacing of a curved flange's strips over the rail; curvature grows as its square
            second = SECOND_BOUND * wheel[WHEEL_RESERVE, grid.node + k]
            reserve *= (1.0 + grid.tilt_square * wheel[RADIUS, grid.node + k] * second) ** 2
        if abs(coarse) < reserve and not exact:  # the node may have left its rail cell: its sign is not safe
            coarse = gap_at(geometry, pose, here)[0]
        cosine = rail[RAIL_COSINE, cell]
        closer = _EXACT_PARTS if exact else _PARTS
        parts = closer if 0.0 <= min(coarse, before) < reserve else 1
        for part in range(1, parts + 1):
            u, gap = here, coarse
            if part < parts:
                u -= (parts - part) * (SCAN_STEP / closer)
                gap = gap_at(geometry, pose, u)[0]
            if gap < 0.0:
                if not inside:
                    inside, outside, first, deepest, depth = True, one_back_at, u, u, 0.0
                    m0 = m1 = m2 = 0.0
                    nodes = 0
                if -gap * cosine > depth:
                    depth, deepest = -gap * cosine, u
                last = u
                if part == parts:
                    square = gap * gap
                    m0 += square
                    m1 += square * (u - first)
                    m2 += square * (u - first) ** 2
                    nodes += 1
            elif inside:
                count = _add_overlap(geometry, pose, reduction, outside, first, last, u, deepest, depth, m0, m1, m2,
                                     nodes, patches, count)  # fmt: skip
                inside = False
            elif 0.0 <= one_back < reserve and one_back <= two_back and one_back <= gap < 0.5:
                lowest = deepest_point(geometry, pose, one_back_at, SLOPE_TOLERANCE, two_back_at, u)
                overlap = -gap_at(geometry, pose, lowest)[0]
                if overlap > 0.0:
                    none = np.int64(0)
                    count = _add_overlap(geometry, pose, reduction, two_back_at, lowest, lowest, u,
                                         lowest, overlap * cosine, 0.0, 0.0, 0.0, none, patches, count)  # fmt: skip
            two_back, one_back, two_back_at, one_back_at = one_back, gap, one_back_at, u
        before = coarse
        k += 1
        if k == end and inside:
            end = min(end + 1, most)
    if inside:
        count = _add_overlap(geometry, pose, reduction, outside, first, last, last, deepest, depth, m0, m1, m2, nodes,
                             patches, count)  # fmt: skip
    return count


@jit(allocates=False)
def planar_error_bound(geometry, side, y, z, ex, ey, ez):
    """Upper bound (m) of the normal penetration that planar detection misses for one wheel.

    The bound depends on yaw and contact angle; it is 0 where no strip comes near the rail. Arguments:
    :func:`find_patches`."""
    pose = make_pose(side, y, z, ex, ey, ez, False)
    window = make_window(geometry, pose)
    grid, wheel, rail = window.grid, geometry.scan_wheel, geometry.scan_rail
    cells = rail.shape[1]
    if grid.node < 0 or grid.node + cells > wheel.shape[1]:
        return 0.0
    yaw_square, bound = ex * ex, 0.0
    if yaw_square > YAW_LIMIT * YAW_LIMIT or leaves_cells(pose):
        bound = planar_bound(grid, yaw_square, wheel, rail, 0, cells)
    else:
        near = blocks_with_planar_errors(geometry, window, yaw_square)
        while near > 0:
            begin, end, near = first_zone(near, geometry.block)
            bound = max(bound, planar_bound(grid, yaw_square, wheel, rail, begin, end))
    # The bound is of lowest order in yaw; the next order is psi^2 (1 + R'^2) of it: < 2 % up to 50 mrad on the flange.
    return 1.05 * bound


@jit(allocates=False, forceinline=True)
def _reduce_one(geometry, pose, grid, reduction, begin, overlap, m0, m1, m2, patch):
    """Fill ``patch`` from the only overlap of a zone that begins at strip ``begin``.

    Returns 1, or 0 without penetration, or -1 if the overlap holds too few nodes. `scan` returns ``overlap`` and the
    sums m0, m1, m2."""
    wheel, start = geometry.scan_wheel, geometry.scan_wheel_start + (grid.node + begin) * SCAN_STEP
    outside, beyond = start + (overlap.first - 1) * SCAN_STEP, start + (overlap.last + 1) * SCAN_STEP
    if reduction == MAXIMUM:
        strip = deepest_strip(grid, wheel, geometry.scan_rail, begin + overlap.first, begin + overlap.last)
        deepest = start + (strip - begin) * SCAN_STEP
        return int(patch_at_maximum(geometry, pose, deepest, outside, beyond, patch))
    if overlap.count >= WIDE:
        m0, m1, m2 = m0 * SCAN_STEP, m1 * SCAN_STEP**2, m2 * SCAN_STEP**3
    else:
        middle = (overlap.first + overlap.last) // 2
        ur = geometry.scan_rail_start + (begin + middle) * SCAN_STEP + strip_position(grid, wheel, begin + middle)[0]
        shift = fine_cell_shift(geometry, start + middle * SCAN_STEP, ur)
        m0, m1, m2, start, nodes = fine_sums(geometry, pose, shift, outside, beyond)
        if nodes < WIDE:
            return -1
    patch[OUTSIDE], patch[BEYOND] = outside, beyond
    return int(patch_from_moments(geometry, pose, start, m0, m1, m2, patch))


@jit(allocates=False, forceinline=True)
def _search_zone(geometry, pose, window, reduction, begin, end, patches, count):
    """Add the patches of the strips ``begin`` to ``end`` - 1 to the ``count`` present ones; return the new number."""
    grid = window.grid
    if end - begin > MOST_STRIPS:
        return _search(geometry, pose, grid, reduction, begin, end - 1, patches, count)
    m0, m1, m2, overlap, close = scan(window, geometry.scan_wheel, geometry.scan_rail, begin, end)
    if close.count == 0:
        return count
    # A single overlap: all strips with a small gap belong to it or to its flanks.
    one_overlap = overlap.count > 0 and overlap.last - overlap.first + 1 == overlap.count
    one_overlap = one_overlap and close.last - close.first + 1 == close.count
    one_overlap = one_overlap and overlap.first - close.first <= _FLANK and close.last - overlap.last <= _FLANK
    if one_overlap and count < MAX_PATCHES:
        found = _reduce_one(geometry, pose, grid, reduction, begin, overlap, m0, m1, m2, patches[count])
        if found >= 0:
            return count + found
    return _search(geometry, pose, grid, reduction, begin + close.first, begin + close.last, patches, count)


@jit(allocates=False, forceinline=True)
def find_patches(geometry, side, y, z, ex, ey, ez, spatial, reduction, patches):
    """Find the contact patches of one wheel, fill ``patches`` and return their number.

    ``patches`` (MAX_PATCHES, PATCH_COLUMNS) is filled from the flange side to the field side in the columns U_WHEEL to
    CURVATURE_Y. ``side`` is +1 left, -1 right. The wheelset's centre y, z (m) and the wheel's outward axle direction
    ex, ey, ez (unit vector) are in the track frame. X is measured from the wheelset's cross-section. The curvatures are
    A and B of the gap A x^2 + B y^2 (1/m). Two overlaps less than the scan step of 0.6 mm apart are one patch, because
    patches so close carry load together."""
    pose = make_pose(side, y, z, ex, ey, ez, spatial)
    window = make_window(geometry, pose)
    node, cells = window.grid.node, geometry.scan_rail.shape[1]
    if node < 0 or node + cells > geometry.scan_wheel.shape[1]:
        return 0
    if leaves_cells(pose):
        nodes = geometry.scan_wheel.shape[1]
        return _search(geometry, pose, window.grid, reduction, -nodes, nodes, patches, np.int64(0))
    count = np.int64(0)  # same type as in the call above, so that `_search` is compiled once
    near = near_blocks(geometry, window)
    while near > 0:
        begin, end, near = first_zone(near, geometry.block)
        count = _search_zone(geometry, pose, window, reduction, begin, end, patches, count)
    return count


@dataclass(frozen=True)
class HertzPatch:
    """Position, penetration and curvatures of one contact patch; SI units, angles in rad.

    Positions are in the track frame, with x from the wheelset's cross-section."""

    side: str
    u_wheel_m: float
    s_wheel_rad: float
    u_rail_m: float
    x_m: float
    y_m: float
    z_m: float
    contact_angle_rad: float
    penetration_m: float
    curvature_x_per_m: float
    curvature_y_per_m: float


def axle_direction(roll, yaw):
    """Unit vector of the axle, pointing left: (-sin yaw cos roll, cos yaw cos roll, sin roll)."""
    return -np.sin(yaw) * np.cos(roll), np.cos(yaw) * np.cos(roll), np.sin(roll)


def detect(geometry, y, z, roll=0.0, yaw=0.0, detection="spatial", reduction="maximum"):
    """Return the contact patches of both wheels of a wheelset as a list of `HertzPatch`.

    The wheelset's centre is at y, z (m) in the track frame; ``roll`` and ``yaw`` are in rad. The left wheel is first;
    patches of a wheel are sorted from flange to field side. ``detection`` is planar or spatial, ``reduction`` maximum
    or moment."""
    if detection not in ("planar", "spatial"):
        raise InputError("detect", "detection", f"expected planar or spatial, got {detection!r}")
    if reduction not in REDUCTIONS:
        raise InputError("detect", "reduction", one_of(REDUCTIONS, reduction))
    axle = axle_direction(roll, yaw)
    found, geometry = [], Handle(geometry)  # the same argument type as in runs, so that both share one kernel
    for side, sign in (("left", 1.0), ("right", -1.0)):
        rows = np.empty((MAX_PATCHES, PATCH_COLUMNS))
        sided = (sign * c for c in axle)
        count = find_patches(geometry, sign, y, z, *sided, detection == "spatial", REDUCTIONS[reduction], rows)
        found += [HertzPatch(side, *map(float, row[: CURVATURE_Y + 1])) for row in rows[:count]]
    return found
