"""Contact detection on a tangent track: planar and spatial search for the patches between a wheel and its rail.

The wheel is cut into strips, each a circle of radius R(u) about the axle. With the side's outward axle direction e,
a strip's point is P = C + R d with d normal to e, and the wheel's outward normal there is N ~ d - R' e.

* spatial: the strip's extreme point against an extruded rail has no longitudinal normal component, N_x = 0, which is
  solved in closed form by d_x = R' e_x. No iteration along the rail is needed.
* planar: the strip's lowest point, d_x = -e_x * 0 = 0 in the strip's own frame; the wheel's lowest generator is laid
  into the cross-section at the wheelset's arc length.

Both give a height z(u) over the lateral position y(u), to be compared with the rail's profile: the gap
g(u) = z - f(u_r). Every interval with g < 0 is a patch. It is reduced as in the paper (``maximum``): the point of
greatest penetration, refined to where wheel and rail slopes agree, and the curvatures there.

References
----------
Ferreira, Flores, Marques, On the utilization of simplified methodologies for the wheel-rail contact, section 3.
Marques et al., Mechanism and Machine Theory 149 (2020) 103825 (spatial search by wheel strips).
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from wrcore._jit import FAST, jit
from wrcore.errors import InputError

DETECTIONS = ("planar", "spatial")
MAX_PATCHES = 3
"""Patches kept per wheel; tread, flange root and flange can touch at once."""

SCAN_STEP = 0.2e-3
"""Distance of the nodes of the scan for overlaps, m; flange patches are less than 1 mm wide."""

_SLOPE_TOLERANCE = 1e-12
"""Slopes agree to this: the contact point is then right to about 1e-13 m, on nearly conformal pairs to 1e-11 m."""

_BLOCK = 32
"""Scan nodes that share one offset between wheel and rail nodes."""

_PAD = 4 * _BLOCK
"""Cells far below the track on both sides of the rail, so that the scan needs no border check."""

CURVATURE_FLOOR = 0.5
"""Smallest relative curvature that is handed to Hertz, 1/m (radius 2 m; below it the pair is conformal)."""

# Columns of the patch array: geometry first, then what the forces add (wrcore.dynamics.wheel).
U_WHEEL, S_WHEEL, U_RAIL, X, Y, Z, ANGLE, PENETRATION, CURVATURE_X, CURVATURE_Y = range(10)
SEMI_A, SEMI_B, NORMAL, FX, FY, MZ, XI, ETA, PHI = range(10, 19)
PATCH_COLUMNS = 19

# Columns of the node arrays, rows of the scan arrays.
_VALUE, _SLOPE, _CURVATURE = range(3)
_COSINE = 4


class ContactGeometry(NamedTuple):
    """Wheel, rail and their placement, for kernels. Profile nodes are equally spaced."""

    wheel: np.ndarray
    """(n, 3): R - r0, R', R'' (window mean); without r0, so that rounding does not spoil slopes."""
    rolling_radius: float
    """Radius r0 at the tape circle, m."""
    wheel_start: float
    wheel_step: float
    rail: np.ndarray
    """(m, 3): ordinate f, f', f'' (window mean)."""
    rail_start: float
    rail_step: float
    half_distance: float
    """Tape circle from the wheelset's centre, m."""
    rail_distance: float
    """Rail profile origin from the track's centre line, m."""
    scan_wheel: np.ndarray
    """(2, blocks * _BLOCK): R and R' at the scan nodes, which start at ``wheel_start``."""
    scan_rail: np.ndarray
    """(5, cells): cubic of the rail in each scan cell (coefficients of the distance from the cell's start in m), and
    the cosine of its inclination."""
    scan_rail_start: float
    wheel_bound: np.ndarray
    """(blocks,): bound of |R''| in a block of scan nodes."""
    rail_bound: np.ndarray
    """(cells,): bound of |f''| within a block's length of a cell."""


def _bound_of_second_derivative(curve):
    """|f''| at the nodes from differences of the exact slopes, the larger of both sides."""
    second = np.abs(np.diff(curve.df) / np.diff(curve.u))
    return np.maximum(np.append(second, second[-1]), np.insert(second, 0, second[0]))


def _wheel_scan(wheel, rolling_radius):
    """Scan nodes of the wheel: (R, R') and the bound of |R''| per block; padding lies at the axle."""
    blocks = math.ceil((wheel.u[-1] - wheel.u[0]) / SCAN_STEP / _BLOCK + 1e-9)
    u = wheel.u[0] + SCAN_STEP * np.arange(blocks * _BLOCK)
    inside = u <= wheel.u[-1]
    nodes = np.zeros((2, len(u)))
    nodes[0, inside] = rolling_radius - wheel(u[inside])
    nodes[1, inside] = -wheel(u[inside], 1)
    second = _bound_of_second_derivative(wheel)
    block = np.minimum(((wheel.u - wheel.u[0]) / (SCAN_STEP * _BLOCK) + 1e-9).astype(int), blocks - 1)
    bound = np.zeros(blocks)
    np.maximum.at(bound, block, second)
    return nodes, bound


def _rail_scan(rail):
    """Scan cells of the rail: cubic coefficients, cosine, start of the first cell and the bound of |f''|."""
    cells = int((rail.u[-1] - rail.u[0]) / SCAN_STEP + 1e-9)
    u = rail.u[0] + SCAN_STEP * np.arange(cells + 1)
    f, df = rail(u), rail(u, 1)
    rise = np.diff(f) / SCAN_STEP
    coefficients = np.zeros((5, cells + 2 * _PAD))
    coefficients[0], coefficients[4] = -1.0, 1.0
    middle = slice(_PAD, _PAD + cells)
    coefficients[0, middle], coefficients[1, middle] = f[:-1], df[:-1]
    coefficients[2, middle] = (3.0 * rise - 2.0 * df[:-1] - df[1:]) / SCAN_STEP
    coefficients[3, middle] = (df[:-1] + df[1:] - 2.0 * rise) / SCAN_STEP**2
    coefficients[4, middle] = 1.0 / np.sqrt(1.0 + (0.5 * (df[:-1] + df[1:])) ** 2)
    second = np.interp(u, rail.u, _bound_of_second_derivative(rail))
    bound = np.pad(second, (_PAD + _BLOCK, 2 * _PAD + _BLOCK), mode="edge")
    bound = np.lib.stride_tricks.sliding_window_view(bound, 2 * _BLOCK + 1).max(axis=1)[: cells + 2 * _PAD]
    return coefficients, float(rail.u[0] - _PAD * SCAN_STEP), np.ascontiguousarray(bound)


def contact_geometry(wheel, rail, track, rolling_radius, half_distance):
    """Compile a wheel-rail pair and its placement for the contact search.

    Parameters
    ----------
    wheel, rail : ProfileCurve
        Profiles with equally spaced nodes.
    track : Track
    rolling_radius : float
        Radius at the tape circle, m.
    half_distance : float
        Distance of the tape circle from the wheelset's centre, m.

    Returns
    -------
    ContactGeometry

    Raises
    ------
    InputError
        If wheel and rail are exchanged.
    """
    if wheel.kind != "wheel" or rail.kind != "rail":
        raise InputError(wheel.name, "kind", f"expected a wheel and a rail, got {wheel.kind} and {rail.kind}")
    scan_wheel, wheel_bound = _wheel_scan(wheel, rolling_radius)
    scan_rail, scan_rail_start, rail_bound = _rail_scan(rail)
    return ContactGeometry(
        np.column_stack([-wheel.f, -wheel.df, -wheel.d2f]), float(rolling_radius), float(wheel.u[0]), wheel.spacing,
        np.column_stack([rail.f, rail.df, rail.d2f]), float(rail.u[0]), rail.spacing,
        float(half_distance), float(track.rail_distance(rail)),
        scan_wheel, scan_rail, scan_rail_start, wheel_bound, rail_bound,
    )  # fmt: skip


@jit
def _cubic_at(nodes, start, step, u):
    """Value, slope and second derivative of the cubic Hermite interpolant; end cells are continued outwards."""
    position = (u - start) / step
    i = min(max(int(position), 0), nodes.shape[0] - 2)
    t = position - i
    y0, y1 = nodes[i, _VALUE], nodes[i + 1, _VALUE]
    d0, d1 = nodes[i, _SLOPE] * step, nodes[i + 1, _SLOPE] * step
    c2 = 3.0 * (y1 - y0) - 2.0 * d0 - d1
    c3 = d0 + d1 - 2.0 * (y1 - y0)
    value = y0 + t * (d0 + t * (c2 + t * c3))
    slope = (d0 + t * (2.0 * c2 + 3.0 * t * c3)) / step
    return value, slope, (2.0 * c2 + 6.0 * t * c3) / (step * step)


@jit
def _curvature_at(nodes, start, step, u):
    """Second derivative for Hertz: its window mean, interpolated linearly."""
    position = (u - start) / step
    i = min(max(int(position), 0), nodes.shape[0] - 2)
    t = position - i
    return nodes[i, _CURVATURE] * (1.0 - t) + nodes[i + 1, _CURVATURE] * t


@jit
def _strip_point(radius, slope, reach, side, y, z, ex, ey, ez, q, spatial):
    """Extreme point of the strip at distance ``reach`` along the axle: (y, z) in the track frame and d_x / q."""
    along = slope * ex / q if spatial else 0.0
    down = math.sqrt(max(1.0 - along * along, 0.0))
    py = y + reach * ey + radius * (down * side * ez - along * ex * ey) / q
    pz = z + reach * ez - radius * (down * side * ey + along * ex * ez) / q
    return py, pz, along


@jit(fastmath=FAST)
def _scan_block(scan_wheel, scan_rail, node, cell, start, height, reach, axis, limit, gap):
    """Vertical gaps of one block of strips; returns how many of them are below ``limit``.

    The rail cell of the k-th node is ``cell + k``: wheel and rail nodes have the same spacing, and what roll and yaw
    take away from it within a block stays a fraction of a cell. All loads are contiguous, so the loop vectorises.

    ``axis`` holds (ey, ez, side ez/q, -ex ey/q, -side ey/q, -ex ez/q, ex/q, side); ``reach`` is the first node's
    distance along the axle, ``start`` the first node's cell start in track coordinates.
    """
    ey, ez, y_down, y_along, z_down, z_along, tilt, side = axis
    radii, slopes = scan_wheel[0, node : node + _BLOCK], scan_wheel[1, node : node + _BLOCK]
    c0, c1 = scan_rail[0, cell : cell + _BLOCK], scan_rail[1, cell : cell + _BLOCK]
    c2, c3 = scan_rail[2, cell : cell + _BLOCK], scan_rail[3, cell : cell + _BLOCK]
    below = 0
    for k in range(_BLOCK):
        radius, along = radii[k], slopes[k] * tilt
        down = math.sqrt(1.0 - along * along)
        axial = reach + k * SCAN_STEP
        lateral = axial * ey + radius * (down * y_down + along * y_along)
        d = side * lateral - (start + k * SCAN_STEP)
        rail = c0[k] + d * (c1[k] + d * (c2[k] + d * c3[k]))
        here = height + axial * ez + radius * (down * z_down + along * z_along) - rail
        gap[k] = here
        below += here < limit
    return below


@jit
def _slope_difference(geometry, u, side, y, z, ex, ey, ez, q, spatial):
    """Slope of the wheel minus slope of the rail below it, both over the rail's lateral coordinate, and its rate.

    The difference is negative on the near and positive on the far side of a point of greatest penetration. The rate
    (1/m) leaves out the small turn of the wheel's slope by roll and yaw: good enough for Newton's steps.
    """
    extra, slope, second = _cubic_at(geometry.wheel, geometry.wheel_start, geometry.wheel_step, u)
    radius = geometry.rolling_radius + extra
    py, _, along = _strip_point(radius, slope, geometry.half_distance + u, side, y, z, ex, ey, ez, q, spatial)
    ur = side * py - geometry.rail_distance
    _, df, rail_second = _cubic_at(geometry.rail, geometry.rail_start, geometry.rail_step, ur)
    if spatial:  # normal d - R' e has no x component: its y, z part is normal to the tangent in the cross-section
        down = math.sqrt(max(1.0 - along * along, 0.0))
        ny = (down * side * ez - along * ex * ey) / q - slope * ey
        nz = -(down * side * ey + along * ex * ez) / q - slope * ez
        return -side * ny / nz - df, -second - rail_second
    ty = ey + slope * side * ez / q
    tz = ez - slope * side * ey / q
    return side * tz / ty - df, -second - rail_second


@jit
def _refine(geometry, u, side, y, z, ex, ey, ez, q, spatial):
    """Lateral wheel coordinate near ``u`` where the slopes agree: Newton's steps inside a shrinking bracket.

    Returns ``u`` itself where the overlap ends (edge of a profile) before the slopes agree.
    """
    low, high = u - 8.0 * SCAN_STEP, u + 8.0 * SCAN_STEP
    new = u
    for _ in range(60):
        value, rate = _slope_difference(geometry, new, side, y, z, ex, ey, ez, q, spatial)
        if abs(value) < _SLOPE_TOLERANCE:
            return new
        if value < 0.0:
            low = new
        else:
            high = new
        step = -value / rate if rate > 0.0 else math.copysign(SCAN_STEP, -value)
        new += min(max(step, -2.0 * SCAN_STEP), 2.0 * SCAN_STEP)
        if not low < new < high:
            new = 0.5 * (low + high)
        if high - low < 1e-13:
            break
    reached = abs(new - u) < 7.9 * SCAN_STEP
    return new if reached else u


@jit
def _describe(geometry, u, side, y, z, ex, ey, ez, q, spatial, patch):
    """Fill one row of the patch array for wheel coordinate ``u``; returns whether there is penetration."""
    extra, slope, _ = _cubic_at(geometry.wheel, geometry.wheel_start, geometry.wheel_step, u)
    radius = geometry.rolling_radius + extra
    second = _curvature_at(geometry.wheel, geometry.wheel_start, geometry.wheel_step, u)
    reach = geometry.half_distance + u
    py, pz, along = _strip_point(radius, slope, reach, side, y, z, ex, ey, ez, q, spatial)
    ur = side * py - geometry.rail_distance
    if ur < geometry.rail_start or ur > geometry.rail_start + (geometry.rail.shape[0] - 1) * geometry.rail_step:
        return False
    f, df, _ = _cubic_at(geometry.rail, geometry.rail_start, geometry.rail_step, ur)
    rail_second = _curvature_at(geometry.rail, geometry.rail_start, geometry.rail_step, ur)
    rail_cos = 1.0 / math.sqrt(1.0 + df * df)
    penetration = (f - pz) * rail_cos
    if penetration <= 0.0:
        return False
    wheel_cos = 1.0 / math.sqrt(1.0 + slope * slope)
    around = wheel_cos / radius
    across = -second * wheel_cos * wheel_cos * wheel_cos
    rail_across = -rail_second * rail_cos * rail_cos * rail_cos
    down = math.sqrt(max(1.0 - along * along, 0.0))
    dy = (down * side * ez - along * ex * ey) / q  # lateral component of the strip's radius
    hxx, hxy, hyy = around, 0.0, across + rail_across
    if spatial:
        # The circle's tangent leaves the rolling direction by the angle turn in the tangent plane.
        cy = (-down * ex * ey - along * side * ez) / q
        cz = (-down * ex * ez + along * side * ey) / q
        sine = (cy + cz * side * df) * rail_cos
        square = sine * sine
        hxx = around * (1.0 - square) + across * square
        hxy = (around - across) * sine * math.sqrt(max(1.0 - square, 0.0))
        hyy = around * square + across * (1.0 - square) + rail_across
    mean, half = 0.5 * (hxx + hyy), 0.5 * (hxx - hyy)
    spread = math.sqrt(half * half + hxy * hxy)
    if half < 0.0:
        spread = -spread
    patch[U_WHEEL] = u
    patch[S_WHEEL] = -math.asin((along * q * ey - ex * dy) / math.sqrt(ex * ex + ey * ey))
    patch[U_RAIL] = ur
    patch[X] = reach * ex + radius * along * q
    # The contact surface of two equal bodies lies midway between the two undeformed surfaces.
    patch[Y] = py - 0.5 * penetration * side * df * rail_cos
    patch[Z] = pz + 0.5 * penetration * rail_cos
    patch[ANGLE] = side * math.atan(df)
    patch[PENETRATION] = penetration
    patch[CURVATURE_X] = max(0.5 * (mean + spread), 0.5 * CURVATURE_FLOOR)
    patch[CURVATURE_Y] = max(0.5 * (mean - spread), 0.5 * CURVATURE_FLOOR)
    return True


@jit
def _add_patch(geometry, u, side, y, z, ex, ey, ez, q, spatial, patches, count):
    """Refine and store a patch; when all rows are taken the shallowest patch gives way."""
    u = _refine(geometry, u, side, y, z, ex, ey, ez, q, spatial)
    if count < MAX_PATCHES:
        return count + _describe(geometry, u, side, y, z, ex, ey, ez, q, spatial, patches[count])
    row = np.empty(PATCH_COLUMNS)
    if _describe(geometry, u, side, y, z, ex, ey, ez, q, spatial, row):
        shallowest = np.argmin(patches[:, PENETRATION])
        if row[PENETRATION] > patches[shallowest, PENETRATION]:
            patches[shallowest] = row
    return count


@jit
def find_patches(geometry, side, y, z, ex, ey, ez, spatial, patches):
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
    patches : numpy.ndarray, shape (MAX_PATCHES, PATCH_COLUMNS)
        Filled from the top: columns U_WHEEL to CURVATURE_Y of this module; X counts from the wheelset's
        cross-section, the curvatures are A and B of the gap A x^2 + B y^2 (1/m).

    Returns
    -------
    int
        Number of patches, from the flange side to the field side.

    Notes
    -----
    All strips that can lie over the rail are evaluated every time: nothing is tracked, nothing can be lost. An overlap
    narrower than the node spacing shows as a smallest positive gap between its neighbours, below M h^2/8 with M the
    bound of the gap's second derivative; such a node is refined like any other.
    """
    q = math.sqrt(1.0 - ex * ex)
    tilt = ex / q if spatial else 0.0
    axis = (ey, ez, side * ez / q, -ex * ey / q, -side * ey / q, -ex * ez / q, tilt, side)
    gap = np.empty(_BLOCK)
    blocks = geometry.wheel_bound.shape[0]
    cells = geometry.scan_rail.shape[1]
    shift = (
        geometry.rail_distance - side * y + geometry.scan_rail_start
    )  # lateral start of the cells, from the wheelset
    count = 0
    inside = False
    deepest, deepest_at = 0.0, 0.0
    two_back, one_back = 1.0, 1.0  # gaps at the two nodes before
    for block in range(blocks):
        node = block * _BLOCK
        reach = geometry.half_distance + geometry.wheel_start + node * SCAN_STEP
        # rail cell under the block's middle node
        half = _BLOCK // 2
        radius, along = geometry.scan_wheel[0, node + half], geometry.scan_wheel[1, node + half] * tilt
        lateral = (reach + half * SCAN_STEP) * ey + radius * (axis[2] + along * axis[3])
        cell = int(math.floor((side * lateral - shift) / SCAN_STEP)) - half
        if cell < 0 or cell + _BLOCK > cells:
            continue
        bound = geometry.wheel_bound[block] + geometry.rail_bound[cell + half]
        reserve = 0.125 * SCAN_STEP * SCAN_STEP * bound
        below = _scan_block(geometry.scan_wheel, geometry.scan_rail, node, cell, shift + cell * SCAN_STEP, z, reach,
                            axis, reserve, gap)  # fmt: skip
        if below == 0 and not inside:
            two_back, one_back = gap[_BLOCK - 2], gap[_BLOCK - 1]
            continue
        for k in range(_BLOCK):
            here = gap[k]
            if here < 0.0:
                depth = here * geometry.scan_rail[_COSINE, cell + k]
                if not inside or depth < deepest:
                    deepest, deepest_at = depth, geometry.wheel_start + (node + k) * SCAN_STEP
                inside = True
            elif inside:
                count = _add_patch(geometry, deepest_at, side, y, z, ex, ey, ez, q, spatial, patches, count)
                inside = False
            elif 0.0 <= one_back < reserve and one_back <= here and one_back <= two_back:
                u = geometry.wheel_start + (node + k - 1) * SCAN_STEP
                count = _add_patch(geometry, u, side, y, z, ex, ey, ez, q, spatial, patches, count)
            two_back, one_back = one_back, here
    if inside:
        count = _add_patch(geometry, deepest_at, side, y, z, ex, ey, ez, q, spatial, patches, count)
    return count


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


def detect(geometry, y, z, roll=0.0, yaw=0.0, detection="spatial"):
    """Contact patches of both wheels of a wheelset.

    Parameters
    ----------
    geometry : ContactGeometry
    y, z : float
        Wheelset centre in the track frame, m.
    roll, yaw : float
        Rad.
    detection : {"planar", "spatial"}

    Returns
    -------
    list of Patch
        Left wheel first, from flange to field side.
    """
    if detection not in DETECTIONS:
        raise InputError("detect", "detection", f"expected one of {', '.join(DETECTIONS)}, got {detection!r}")
    axle = axle_direction(roll, yaw)
    found = []
    for side, sign in (("left", 1.0), ("right", -1.0)):
        rows = np.empty((MAX_PATCHES, PATCH_COLUMNS))
        count = find_patches(geometry, sign, y, z, *(sign * c for c in axle), detection == "spatial", rows)
        found += [Patch(side, *map(float, row[: CURVATURE_Y + 1])) for row in rows[:count]]
    return found
