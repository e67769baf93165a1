"""Contact detection on a tangent track: planar and spatial search for the patches between a wheel and its rail.

Wheel and rail become a gap over the wheel's lateral coordinate (:mod:`wrcore.contact.strip`); every interval in which
it is negative is a patch, reduced to a Hertz patch by one of two rules (:mod:`wrcore.contact.reduction`).

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

from wrcore._jit import FAST, jit
from wrcore.contact.geometry import (
    RADIUS,
    RADIUS_SLOPE,
    RAIL_COSINE,
    RAIL_RESERVE,
    RESERVE_TO_SECOND,
    SCAN_STEP,
    WHEEL_RESERVE,
)
from wrcore.contact.reduction import (
    CURVATURE_Y,
    MAX_PATCHES,
    MOMENT,
    PATCH_COLUMNS,
    PENETRATION,
    REDUCTIONS,
    deepest_point,
    edge_of_overlap,
    overlap_moments,
    patch_at_maximum,
    patch_from_moments,
)
from wrcore.contact.strip import gap_at, make_pose, strip_point
from wrcore.errors import InputError

DETECTIONS = {"planar": 0, "spatial": 1, "auto": 2}
PLANAR, SPATIAL, AUTO = 0, 1, 2
"""``auto``: planar while the bound of its error stays below a tolerance, spatial else."""

_PARTS = 3
"""Sub-intervals of a scan step where the search looks closer."""

_CHUNK = 8
"""Strips that are passed over together where none of them is close."""

_CELL_SHARE = 0.6
"""Share of a rail cell by which the scan's nodes may leave it; the second reserve covers what that costs."""

_WIDE = 10
"""Overlaps of at least this many scan nodes are integrated over the nodes, narrower ones by Gauss-Legendre."""


@jit(allocates=False, fastmath=FAST)
def _scan(pose, scan_wheel, scan_rail, node, reach, offset):
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


@jit(allocates=False)
def _strip_gap(pose, scan_wheel, scan_rail, node, reach, offset, k):
    """Gap of the k-th strip, as in `_scan`."""
    radius, along = scan_wheel[RADIUS, node + k], scan_wheel[RADIUS_SLOPE, node + k] * pose.tilt
    square = along * along
    down = 1.0 - square * (0.5 + square * (0.125 + square * 0.0625))
    axial = reach + k * SCAN_STEP
    lateral = axial * pose.ey + radius * (down * pose.y_down + along * pose.y_along)
    d = pose.side * lateral - offset - k * SCAN_STEP
    rail = scan_rail[0, k] + d * (scan_rail[1, k] + d * (scan_rail[2, k] + d * scan_rail[3, k]))
    return pose.z + axial * pose.ez + radius * (down * pose.z_down + along * pose.z_along) - rail


@jit(allocates=False, fastmath=FAST)
def _any_close(pose, scan_wheel, scan_rail, node, reach, offset, first):
    """Number of strips with a gap below twice their reserve among the ``_CHUNK + 8`` strips from ``first`` on."""
    count = 0
    for i in range(_CHUNK + 8):
        k = first + i
        radius, along = scan_wheel[RADIUS, node + k], scan_wheel[RADIUS_SLOPE, node + k] * pose.tilt
        square = along * along
        down = 1.0 - square * (0.5 + square * (0.125 + square * 0.0625))
        axial = reach + k * SCAN_STEP
        lateral = axial * pose.ey + radius * (down * pose.y_down + along * pose.y_along)
        d = pose.side * lateral - offset - k * SCAN_STEP
        rail = scan_rail[0, k] + d * (scan_rail[1, k] + d * (scan_rail[2, k] + d * scan_rail[3, k]))
        gap = pose.z + axial * pose.ez + radius * (down * pose.z_down + along * pose.z_along) - rail
        count += gap < 2.0 * (scan_wheel[WHEEL_RESERVE, node + k] + scan_rail[RAIL_RESERVE, k])
    return count


@jit(allocates=False, fastmath=FAST)
def _planar_bound(pose, scan_wheel, scan_rail, node, reach, offset):
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


@jit(allocates=False)
def _add_overlap(geometry, pose, reduction, outside, first, last, beyond, deepest, depth, m0, m1, m2, nodes, patches,
                 count):  # fmt: skip
    """Reduce one overlap and store its patch; when all rows are taken the shallowest patch gives way to a deeper one.

    ``outside`` and ``beyond`` are points without overlap next to its ``first`` and ``last`` strip, ``deepest`` and
    ``depth`` (along the normal) its deepest strip; m0, m1, m2 are sums of g^2 over its ``nodes`` scan nodes, positions
    counted from ``first``.
    """
    row = count
    if count == MAX_PATCHES:
        row = 0
        for k in range(1, MAX_PATCHES):
            if patches[k, PENETRATION] < patches[row, PENETRATION]:
                row = k
        if depth <= patches[row, PENETRATION]:
            return count
    if reduction == MOMENT:
        if nodes >= _WIDE:
            middle = first
            m0, m1, m2 = m0 * SCAN_STEP, m1 * SCAN_STEP, m2 * SCAN_STEP
        else:
            start = edge_of_overlap(geometry, pose, outside, first)
            end = edge_of_overlap(geometry, pose, beyond, last)
            middle = 0.5 * (start + end)
            m0, m1, m2 = overlap_moments(geometry, pose, start, end)
        found = patch_from_moments(geometry, pose, middle, m0, m1, m2, patches[row])
    else:
        found = patch_at_maximum(geometry, pose, deepest, patches[row])
    return count + found if row == count else count


@jit(allocates=False)
def _search(geometry, pose, reduction, node, reach, offset, first_close, last_close, patches):
    """All overlaps strip by strip, with a closer look wherever the reserve allows one between two nodes.

    Only strips from ``first_close`` to ``last_close`` and their neighbours can take part.
    """
    scan_wheel, scan_rail = geometry.scan_wheel, geometry.scan_rail
    cells = scan_rail.shape[1]
    exact = _leaves_cells(pose)
    window = geometry.scan_wheel_start + node * SCAN_STEP
    wheel_end = geometry.wheel_start + (geometry.wheel.shape[0] - 1) * geometry.wheel_step
    count = nodes = 0
    inside = False
    outside = first = last = deepest = window
    depth = m0 = m1 = m2 = 0.0
    two_back, one_back, one_back_at, before = 1.0, 1.0, window, 1.0
    k = max(first_close - 1, 0)
    end = min(last_close + 2, cells)
    while k < end:
        # a chunk without a close strip in it or next to it is passed over
        if k % _CHUNK == 0 and not (inside or exact) and 4 <= k < cells - _CHUNK - 4:
            if _any_close(pose, scan_wheel, scan_rail, node, reach, offset, k - 4) == 0:
                k += _CHUNK
                two_back, one_back, one_back_at, before = 1.0, 1.0, window + (k - 1) * SCAN_STEP, 1.0
                continue
        at = window + k * SCAN_STEP
        if at < geometry.wheel_start or at > wheel_end:
            coarse = 1.0
        elif exact:
            coarse = gap_at(geometry, pose, at)[0]
        else:
            coarse = _strip_gap(pose, scan_wheel, scan_rail, node, reach, offset, k)
        cell = _rail_cell(geometry, pose, at) if exact else k
        reserve = scan_wheel[WHEEL_RESERVE, node + k] + scan_rail[RAIL_RESERVE, cell]
        if abs(coarse) < reserve and not exact:  # the node may have left its rail cell: its sign is not safe
            coarse = gap_at(geometry, pose, at)[0]
        cosine = scan_rail[RAIL_COSINE, cell]
        lower, upper = min(coarse, before), max(coarse, before)
        parts = _PARTS if lower < reserve and upper > -reserve else 1
        for part in range(1, parts + 1):
            u = at - SCAN_STEP * (parts - part) / parts
            gap = coarse if part == parts else gap_at(geometry, pose, u)[0]
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
                lowest = deepest_point(geometry, pose, one_back_at)
                overlap = -gap_at(geometry, pose, lowest)[0]
                if overlap > 0.0:
                    count = _add_overlap(geometry, pose, reduction, one_back_at - SCAN_STEP / parts, lowest, lowest, u,
                                         lowest, overlap * cosine, 0.0, 0.0, 0.0, 0, patches, count)  # fmt: skip
            two_back, one_back, one_back_at = one_back, gap, u
        before = coarse
        k += 1
        if k == end and inside:
            end = min(end + 1, cells)
    if inside:
        count = _add_overlap(geometry, pose, reduction, outside, first, last, last, deepest, depth, m0, m1, m2, nodes,
                             patches, count)  # fmt: skip
    return count


@jit(allocates=False)
def _leaves_cells(pose):
    """Whether the scan's nodes leave their rail cells by too much, so that every strip must be looked up exactly.

    Roll moves a strip sideways by its radius' difference to the tape circle (0.03 m at the flange tip), yaw by
    R R' psi^2 (R R' = 1.5 m on a flange of 70 degrees). Small angles on real runs stay far below the limit: 12 mrad of
    roll or 15 mrad of yaw alone.
    """
    return 0.03 * abs(pose.ez) + 1.5 * pose.tilt * pose.tilt > _CELL_SHARE * SCAN_STEP


@jit(allocates=False)
def _rail_cell(geometry, pose, u):
    """Rail cell that really lies below the strip at u."""
    ur = strip_point(geometry, pose, u)[0]
    return min(max(int((ur - geometry.scan_rail_start) / SCAN_STEP), 0), geometry.scan_rail.shape[1] - 1)


@jit(allocates=False)
def _window(geometry, pose):
    """First wheel node over the rail, its distance along the axle, and the track coordinate of the first rail cell."""
    offset = geometry.rail_distance + geometry.scan_rail_start - pose.side * pose.y
    shift = (geometry.half_distance + geometry.scan_wheel_start) * pose.side * pose.ey
    shift += geometry.rolling_radius * pose.side * pose.y_down
    node = int(math.floor((offset - shift) / SCAN_STEP)) + 1
    return node, geometry.half_distance + geometry.scan_wheel_start + node * SCAN_STEP, offset


@jit(allocates=False)
def planar_error_bound(geometry, side, y, z, ex, ey, ez):
    """Bound of the normal penetration that planar detection misses for one wheel, from yaw and contact angle.

    Parameters
    ----------
    geometry, side, y, z, ex, ey, ez
        As for :func:`find_patches`.

    Returns
    -------
    float
        Metres; 0 where no strip comes near the rail.
    """
    pose = make_pose(side, y, z, ex, ey, ez, False)
    node, reach, offset = _window(geometry, pose)
    if node < 0 or node + geometry.scan_rail.shape[1] > geometry.scan_wheel.shape[1]:
        return 0.0
    # the law is of first order in yaw; the next order is psi^2 (1 + R'^2) of it: below 2 % up to 50 mrad on the flange
    return 1.05 * _planar_bound(pose, geometry.scan_wheel, geometry.scan_rail, node, reach, offset)


@jit(allocates=False)
def find_patches(geometry, side, y, z, ex, ey, ez, spatial, reduction, patches):
    """All contact patches of one wheel.

    Parameters
    ----------
    geometry : ContactGeometry
    side : float
        +1 left, -1 right.
    y, z : float
        Wheelset centre in the track frame, m.
    ex, ey, ez : float
        The wheel's outward axle direction (unit vector in the track frame).
    spatial : bool
        Spatial instead of planar detection.
    reduction : int
        MAXIMUM or MOMENT of :mod:`wrcore.contact.reduction`.
    patches : numpy.ndarray, shape (MAX_PATCHES, PATCH_COLUMNS)
        Filled from the top: columns U_WHEEL to CURVATURE_Y; X counts from the wheelset's cross-section, the curvatures
        are A and B of the gap A x^2 + B y^2 (1/m).

    Returns
    -------
    int
        Number of patches, from the flange side to the field side.

    Notes
    -----
    Two overlaps separated by a gap narrower than the scan's nodes (0.2 mm where it looks closer) count as one.
    """
    pose = make_pose(side, y, z, ex, ey, ez, spatial)
    node, reach, offset = _window(geometry, pose)
    if node < 0 or node + geometry.scan_rail.shape[1] > geometry.scan_wheel.shape[1]:
        return 0
    if _leaves_cells(pose):
        return _search(geometry, pose, reduction, node, reach, offset, 0, geometry.scan_rail.shape[1], patches)
    m0, m1, m2, overlapping, first, last, close, first_close, last_close = _scan(
        pose, geometry.scan_wheel, geometry.scan_rail, node, reach, offset
    )
    if close == 0:
        return 0
    one_overlap = last - first + 1 == overlapping and last_close - first_close + 1 == close
    if reduction == MOMENT and overlapping >= _WIDE and one_overlap:
        start = geometry.scan_wheel_start + node * SCAN_STEP
        m0, m1, m2 = m0 * SCAN_STEP, m1 * SCAN_STEP**2, m2 * SCAN_STEP**3
        return int(patch_from_moments(geometry, pose, start, m0, m1, m2, patches[0]))
    return _search(geometry, pose, reduction, node, reach, offset, first_close, last_close, patches)


@dataclass(frozen=True)
class Patch:
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
    return -math.sin(yaw) * math.cos(roll), math.cos(yaw) * math.cos(roll), math.sin(roll)


def detect(geometry, y, z, roll=0.0, yaw=0.0, detection="spatial", reduction="maximum"):
    """Contact patches of both wheels of a wheelset.

    Parameters
    ----------
    geometry : ContactGeometry
    y, z : float
        Wheelset centre in the track frame, m.
    roll, yaw : float
        Rad.
    detection : {"planar", "spatial"}
    reduction : {"maximum", "moment"}

    Returns
    -------
    list of Patch
        Left wheel first, from flange to field side.

    Raises
    ------
    InputError
        For an unknown detection or reduction.
    """
    if detection not in ("planar", "spatial"):
        raise InputError("detect", "detection", f"expected planar or spatial, got {detection!r}")
    if reduction not in REDUCTIONS:
        raise InputError("detect", "reduction", f"expected one of {', '.join(REDUCTIONS)}, got {reduction!r}")
    axle = axle_direction(roll, yaw)
    found = []
    for side, sign in (("left", 1.0), ("right", -1.0)):
        rows = np.empty((MAX_PATCHES, PATCH_COLUMNS))
        sided = (sign * c for c in axle)
        count = find_patches(geometry, sign, y, z, *sided, detection == "spatial", REDUCTIONS[reduction], rows)
        found += [Patch(side, *map(float, row[: CURVATURE_Y + 1])) for row in rows[:count]]
    return found
