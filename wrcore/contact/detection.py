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
from wrcore.contact.strip import gap_at, make_pose
from wrcore.errors import InputError

DETECTIONS = {"planar": 0, "spatial": 1, "auto": 2}
PLANAR, SPATIAL, AUTO = 0, 1, 2
"""``auto``: planar while the bound of its error stays below a tolerance, spatial else."""

_PARTS = 3
"""Sub-intervals of a scan step where the search looks closer."""

_STEEP_ROLL = 0.012
"""Beyond this roll (rad) the scan's nodes leave their rail cells by too much: every strip is looked up exactly."""

_WIDE = 10
"""Overlaps of at least this many scan nodes are integrated over the nodes, narrower ones by Gauss-Legendre."""


@jit(fastmath=FAST)
def _scan(pose, scan_wheel, scan_rail, node, reach, offset):
    """Sums over all strips that can lie over the rail: what a single wide overlap needs.

    The rail cell of the k-th strip is k: wheel nodes and rail cells have the same spacing. What roll and yaw take away
    from it (``d`` outside its cell) stays a fraction of a cell where overlaps are wide. All loads are contiguous and
    there is no branch, so that the loop runs in vector registers: 77 ns for 128 strips, 34 ns without the sums.

    Returns
    -------
    m0, m1, m2 : float
        Sums of g^2, g^2 k, g^2 k^2 over strips with negative gap g.
    n0, n1, n2 : float
        The same sums with 1 instead of g^2.
    t0, t1, t2 : float
        The same over strips with a gap below twice their reserve (the second one covers what leaving the cell costs).
    """
    cells = scan_rail.shape[1]
    radii, slopes = scan_wheel[RADIUS, node : node + cells], scan_wheel[RADIUS_SLOPE, node : node + cells]
    reserves, rail_reserves = scan_wheel[WHEEL_RESERVE, node : node + cells], scan_rail[RAIL_RESERVE]
    c0, c1, c2, c3 = scan_rail[0], scan_rail[1], scan_rail[2], scan_rail[3]
    side_y = pose.side * pose.ey
    y_down, y_along = pose.side * pose.y_down, pose.side * pose.y_along
    m0 = m1 = m2 = n0 = n1 = n2 = t0 = t1 = t2 = 0.0
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
        one = 1.0 if gap < 0.0 else 0.0
        n0 += one
        n1 += one * index
        n2 += one * index * index
        one = 1.0 if gap < 2.0 * (reserves[k] + rail_reserves[k]) else 0.0
        t0 += one
        t1 += one * index
        t2 += one * index * index
    return m0, m1, m2, n0, n1, n2, t0, t1, t2


@jit(fastmath=FAST)
def _gaps(pose, scan_wheel, scan_rail, node, reach, offset, gaps):
    """Gaps of all strips that can lie over the rail, as in `_scan`."""
    cells = scan_rail.shape[1]
    radii, slopes = scan_wheel[RADIUS, node : node + cells], scan_wheel[RADIUS_SLOPE, node : node + cells]
    c0, c1, c2, c3 = scan_rail[0], scan_rail[1], scan_rail[2], scan_rail[3]
    side_y = pose.side * pose.ey
    y_down, y_along = pose.side * pose.y_down, pose.side * pose.y_along
    for k in range(cells):
        radius, along = radii[k], slopes[k] * pose.tilt
        square = along * along
        down = 1.0 - square * (0.5 + square * (0.125 + square * 0.0625))
        position = k * SCAN_STEP
        axial = reach + position
        d = axial * side_y + radius * (down * y_down + along * y_along) - offset - position
        rail = c0[k] + d * (c1[k] + d * (c2[k] + d * c3[k]))
        gaps[k] = pose.z + axial * pose.ez + radius * (down * pose.z_down + along * pose.z_along) - rail


@jit(fastmath=FAST)
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


@jit
def _contiguous(n0, n1, n2):
    """Whether n0 integers with sum n1 and sum of squares n2 follow one another: their variance is (n0^2 - 1)/12."""
    mean = n1 / n0
    return n2 / n0 - mean * mean < (n0 * n0 - 1.0) / 12.0 + 0.25


@jit
def _add_overlap(geometry, pose, reduction, outside, first, last, beyond, deepest, m0, m1, m2, nodes, patches, count):
    """Reduce one overlap and store its patch; when all rows are taken the shallowest patch gives way.

    ``outside`` and ``beyond`` are points without overlap next to its ``first`` and ``last`` strip; m0, m1, m2 are sums
    of g^2 over its ``nodes`` scan nodes, positions counted from ``first``.
    """
    row = patches[count] if count < MAX_PATCHES else np.empty(PATCH_COLUMNS)
    if reduction == MOMENT:
        if nodes >= _WIDE:
            middle, scale = first, SCAN_STEP
            m0, m1, m2 = m0 * scale, m1 * scale, m2 * scale
        else:
            start = edge_of_overlap(geometry, pose, outside, first)
            end = edge_of_overlap(geometry, pose, beyond, last)
            middle = 0.5 * (start + end)
            m0, m1, m2 = overlap_moments(geometry, pose, start, end)
        found = patch_from_moments(geometry, pose, middle, m0, m1, m2, row)
    else:
        found = patch_at_maximum(geometry, pose, deepest, row)
    if count < MAX_PATCHES:
        return count + found
    if found:
        shallowest = np.argmin(patches[:, PENETRATION])
        if row[PENETRATION] > patches[shallowest, PENETRATION]:
            patches[shallowest] = row
    return count


@jit
def _search(geometry, pose, reduction, node, reach, offset, patches):
    """All overlaps strip by strip, with a closer look wherever the reserve allows one between two nodes."""
    cells = geometry.scan_rail.shape[1]
    gaps = np.empty(cells)
    _gaps(pose, geometry.scan_wheel, geometry.scan_rail, node, reach, offset, gaps)
    reserves, rail_reserves = geometry.scan_wheel[WHEEL_RESERVE], geometry.scan_rail[RAIL_RESERVE]
    exact = abs(pose.ez) > _STEEP_ROLL
    window = geometry.scan_wheel_start + node * SCAN_STEP
    wheel_end = geometry.wheel_start + (geometry.wheel.shape[0] - 1) * geometry.wheel_step
    count = 0
    inside = False
    outside = first = last = deepest = window
    depth = m0 = m1 = m2 = 0.0
    nodes = 0
    two_back, one_back, one_back_at = 1.0, 1.0, window
    before = 1.0
    near_before, near = False, gaps[0] < 2.0 * (reserves[node] + rail_reserves[0])
    reserve = reserves[node] + rail_reserves[0]
    for k in range(cells):
        at = window + k * SCAN_STEP
        next_reserve = reserves[node + k + 1] + rail_reserves[k + 1] if k + 1 < cells else 0.0
        near_after = k + 1 < cells and gaps[k + 1] < 2.0 * next_reserve
        worth = near_before or near or near_after or inside or exact
        near_before, near, here_reserve, reserve = near, near_after, reserve, next_reserve
        if not worth:
            two_back, one_back, one_back_at, before = 1.0, 1.0, at, 1.0
            continue
        if at < geometry.wheel_start or at > wheel_end:
            coarse = 1.0
        elif exact:
            coarse = gap_at(geometry, pose, at)[0]
        else:
            coarse = gaps[k]
        lower, upper = min(coarse, before), max(coarse, before)
        parts = _PARTS if lower < here_reserve and upper > -here_reserve and upper < 0.5 else 1
        for part in range(1, parts + 1):
            u = at - SCAN_STEP * (parts - part) / parts
            gap = coarse if part == parts else gap_at(geometry, pose, u)[0]
            if gap < 0.0:
                if not inside:
                    inside, outside, first, deepest, depth = True, one_back_at, u, u, 0.0
                    m0 = m1 = m2 = 0.0
                    nodes = 0
                if gap * geometry.scan_rail[RAIL_COSINE, k] < depth:
                    depth, deepest = gap * geometry.scan_rail[RAIL_COSINE, k], u
                last = u
                if part == parts:
                    square = gap * gap
                    m0 += square
                    m1 += square * (u - first)
                    m2 += square * (u - first) ** 2
                    nodes += 1
            elif inside:
                count = _add_overlap(geometry, pose, reduction, outside, first, last, u, deepest, m0, m1, m2, nodes,
                                     patches, count)  # fmt: skip
                inside = False
            elif 0.0 <= one_back < here_reserve and one_back <= two_back and one_back <= gap < 0.5:
                lowest = deepest_point(geometry, pose, one_back_at)
                if gap_at(geometry, pose, lowest)[0] < 0.0:
                    count = _add_overlap(geometry, pose, reduction, one_back_at - SCAN_STEP / parts, lowest, lowest, u,
                                         lowest, 0.0, 0.0, 0.0, 0, patches, count)  # fmt: skip
            two_back, one_back, one_back_at = one_back, gap, u
        before = coarse
    if inside:
        count = _add_overlap(geometry, pose, reduction, outside, first, last, last, deepest, m0, m1, m2, nodes, patches,
                             count)  # fmt: skip
    return count


@jit
def _window(geometry, pose):
    """First wheel node over the rail, its distance along the axle, and the track coordinate of the first rail cell."""
    offset = geometry.rail_distance + geometry.scan_rail_start - pose.side * pose.y
    shift = (geometry.half_distance + geometry.scan_wheel_start) * pose.side * pose.ey
    shift += geometry.rolling_radius * pose.side * pose.y_down
    node = int(math.floor((offset - shift) / SCAN_STEP)) + 1
    return node, geometry.half_distance + geometry.scan_wheel_start + node * SCAN_STEP, offset


@jit
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


@jit
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
    if reduction == MOMENT and abs(pose.ez) <= _STEEP_ROLL:
        m0, m1, m2, n0, n1, n2, t0, t1, t2 = _scan(pose, geometry.scan_wheel, geometry.scan_rail, node, reach, offset)
        if t0 == 0.0:
            return 0
        if n0 >= _WIDE and _contiguous(n0, n1, n2) and _contiguous(t0, t1, t2):
            start = geometry.scan_wheel_start + node * SCAN_STEP
            m0, m1, m2 = m0 * SCAN_STEP, m1 * SCAN_STEP**2, m2 * SCAN_STEP**3
            return int(patch_from_moments(geometry, pose, start, m0, m1, m2, patches[0]))
    return _search(geometry, pose, reduction, node, reach, offset, patches)


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
