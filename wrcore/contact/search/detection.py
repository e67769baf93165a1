"""Contact detection on a tangent track: planar and spatial search for the patches between a wheel and its rail.

Wheel and rail become a gap over the wheel's lateral coordinate (:mod:`wrcore.contact.search.strip`); every interval in
which it is negative is a patch, reduced to a Hertz patch by one of two rules (:mod:`wrcore.contact.search.reduction`).

The search looks at all strips every time: nothing is tracked, nothing can be lost. Between two nodes of the scan the
gap can go deeper than at them by no more than a known reserve (M h^2/8), and only where that matters it looks closer.

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
"""``auto``: planar while the bound of its error stays below a tolerance, spatial else."""

_PARTS, _EXACT_PARTS = 3, 12
"""Sub-intervals of a scan step where the search looks closer: of common poses, and of those beyond the rail's cells,
whose strips on a curved flange lie up to four times as far apart along the rail."""

_FLANK = 2
"""Close strips on either side of an overlap that are taken for its own flanks."""

WIDE = 10
"""Overlaps of at least this many scan nodes are integrated over them, narrower ones over the profiles' own nodes, and
those that hold fewer than so many even of these by Gauss-Legendre between their edges."""

_AS_ONE = 0.5
"""Overlaps become one row, where rows are short, if the rail turns by less (rad) between them."""


@jit(allocates=False)
def _take_out(patches, k):
    """Take the k-th row out of full ones; the others stay in order."""
    for i in range(k, MAX_PATCHES - 1):
        for column in range(PATCH_COLUMNS):
            patches[i, column] = patches[i + 1, column]


@jit(allocates=False)
def _join_shallowest(geometry, pose, outside, beyond, depth, patches):
    """Make one row of the shallowest overlap and the nearer one of its neighbours, where all rows are taken by moments
    and another overlap follows from ``outside`` to ``beyond``, of a ``depth``. Returns the row that is free for that
    one now, MAX_PATCHES where it has become part of the last row, -1 where the rail turns too much between both."""
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
    """Reduce one overlap and store its patch; when all rows are taken the shallowest one becomes one with its neighbour
    (`_join_shallowest`), or gives way to a deeper one.

    ``outside`` and ``beyond`` are points without overlap next to its ``first`` and ``last`` strip, ``deepest`` and
    ``depth`` (along the normal) its deepest strip; m0, m1, m2 are sums of g^2 over its ``nodes`` scan nodes, positions
    counted from ``first``."""
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
    """All overlaps strip by strip, with a closer look wherever the reserve allows one between two nodes without.

    Only strips from ``first_close`` to ``last_close`` and their neighbours can take part: of those over the rail's
    cells or, where strips leave these, of the whole wheel. Patches are added to the ``count`` there are; returns their
    new number."""
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
        if exact:  # yaw draws strips of a curved flange apart along the rail: the gap bends with the square of that
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
    """Bound (m) of the normal penetration that planar detection misses for one wheel, from yaw and contact angle; 0
    where no strip comes near the rail. Arguments as for :func:`find_patches`."""
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
    # the law is of first order in yaw; the next order is psi^2 (1 + R'^2) of it: below 2 % up to 50 mrad on the flange
    return 1.05 * bound


@jit(allocates=False, forceinline=True)
def _reduce_one(geometry, pose, grid, reduction, begin, overlap, m0, m1, m2, patch):
    """Patch of the only overlap of a zone that begins at strip ``begin``: 1, 0 without penetration, -1 if too narrow.
    ``overlap`` and the sums m0, m1, m2: see `scan`."""
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
    """Patches of the strips from ``begin`` to before ``end``, added to ``count`` others; returns their new number."""
    grid = window.grid
    if end - begin > MOST_STRIPS:
        return _search(geometry, pose, grid, reduction, begin, end - 1, patches, count)
    m0, m1, m2, overlap, close = scan(window, geometry.scan_wheel, geometry.scan_rail, begin, end)
    if close.count == 0:
        return count
    # one overlap, and next to its ends no more close strips than its own flanks make
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
    """Number of contact patches of one wheel, which fill ``patches`` (MAX_PATCHES, PATCH_COLUMNS) from the flange side
    to the field side in the columns U_WHEEL to CURVATURE_Y.

    ``side`` is +1 left, -1 right; the wheelset's centre y, z (m) and the wheel's outward axle direction ex, ey, ez
    (unit vector) are in the track frame. X counts from the wheelset's cross-section, the curvatures are A and B of the
    gap A x^2 + B y^2 (1/m). Two overlaps separated by less than the scan's step of 0.6 mm count as one: patches so
    close carry load as one."""
    pose = make_pose(side, y, z, ex, ey, ez, spatial)
    window = make_window(geometry, pose)
    node, cells = window.grid.node, geometry.scan_rail.shape[1]
    if node < 0 or node + cells > geometry.scan_wheel.shape[1]:
        return 0
    if leaves_cells(pose):
        nodes = geometry.scan_wheel.shape[1]
        return _search(geometry, pose, window.grid, reduction, -nodes, nodes, patches, np.int64(0))
    count = np.int64(0)  # of one type with what is handed over above: one copy of the search
    near = near_blocks(geometry, window)
    while near > 0:
        begin, end, near = first_zone(near, geometry.block)
        count = _search_zone(geometry, pose, window, reduction, begin, end, patches, count)
    return count


@dataclass(frozen=True)
class HertzPatch:
    """One contact patch in the track frame (x from the wheelset's cross-section); SI units, angles in rad."""

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
    """Direction of the axle, pointing left: (-sin yaw cos roll, cos yaw cos roll, sin roll)."""
    return -np.sin(yaw) * np.cos(roll), np.cos(yaw) * np.cos(roll), np.sin(roll)


def detect(geometry, y, z, roll=0.0, yaw=0.0, detection="spatial", reduction="maximum"):
    """List of `HertzPatch` of both wheels of a wheelset, centre at y, z (m) in the track frame, with roll and yaw
    (rad): left wheel first, from flange to field side. ``detection`` is planar or spatial, ``reduction`` maximum or
    moment."""
    if detection not in ("planar", "spatial"):
        raise InputError("detect", "detection", f"expected planar or spatial, got {detection!r}")
    if reduction not in REDUCTIONS:
        raise InputError("detect", "reduction", one_of(REDUCTIONS, reduction))
    axle = axle_direction(roll, yaw)
    found, geometry = [], Handle(geometry)  # as in runs, which share the kernel
    for side, sign in (("left", 1.0), ("right", -1.0)):
        rows = np.empty((MAX_PATCHES, PATCH_COLUMNS))
        sided = (sign * c for c in axle)
        count = find_patches(geometry, sign, y, z, *sided, detection == "spatial", REDUCTIONS[reduction], rows)
        found += [HertzPatch(side, *map(float, row[: CURVATURE_Y + 1])) for row in rows[:count]]
    return found
