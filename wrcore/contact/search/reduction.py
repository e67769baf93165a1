"""Two reductions of an overlap of wheel and rail to a Hertz patch.

* ``maximum`` (the paper's): the point of maximum penetration, where wheel and rail slopes agree, with the curvatures of
  both profiles at this point. Its result jumps when another point becomes the deepest one and where curvatures jump.
* ``moment``: the Hertz patch whose parabolic overlap g = -(d0 - B e^2) has the same first three moments of g^2,

      M_k = int g^2 u^k du:   e_c = M1/M0,   w^2 = 7 (M2/M0 - e_c^2),   d0 = sqrt(15 M0 / (16 w)),   B = d0/w^2.

  It is exact for constant curvatures and does not use the profiles' curvatures. Its result is continuous for an
  asymmetric patch.
"""

import math

import numpy as np

from wrcore.contact.search.geometry import SCAN_STEP
from wrcore.contact.search.strip import (
    AHEAD,
    BEND,
    LIFT,
    cubic_at,
    curvature_at,
    gap_and_slope,
    gap_at,
    on_rail,
    radius_direction,
    slope_difference,
    strip_point,
    wheel_slope,
    with_rail_along,
)
from wrcore.kernels.jit import jit

REDUCTIONS = {"maximum": 0, "moment": 1}
MAXIMUM, MOMENT = 0, 1

MAX_PATCHES = 3
"""Maximum number of patches per wheel; tread, flange root and flange can touch at once."""

CURVATURE_FLOOR = 0.5
"""Minimum relative curvature of the reduction ``maximum``, 1/m (radius 2 m). Where profiles are conformal, or the
overlap is even deeper at its sides, the curvature at one point does not describe the patch."""

# Columns of the patch array: first geometry, then results of the force model (wrcore.wheels.hertzian_force).
U_WHEEL, S_WHEEL, U_RAIL, X, Y, Z, ANGLE, PENETRATION, CURVATURE_X, CURVATURE_Y = range(10)
SEMI_A, SEMI_B, NORMAL, FX, FY, MZ, XI, ETA, PHI = range(10, 19)
OUTSIDE, BEYOND = 10, 11  # patch by moments, before SEMI_A, SEMI_B: points without overlap on either side, m
COSINE, SINE = 19, 20  # of the contact angle
P_MAX = 21  # maximum pressure, filled for non-elliptical patches
PSI = 22  # shape number, filled where the creep table needs it
CELL = 22  # same column, patches on strips: cell of the lookup table, 0 for patches that were solved directly
PATCH_COLUMNS = 23

CHANNELS = {
    "u_wheel_m": U_WHEEL, "s_wheel_rad": S_WHEEL, "u_rail_m": U_RAIL, "x_m": X, "y_m": Y, "z_m": Z,
    "contact_angle_rad": ANGLE, "penetration_m": PENETRATION, "a_m": SEMI_A, "b_m": SEMI_B, "N_N": NORMAL,
    "Fx_N": FX, "Fy_N": FY, "Mz_Nm": MZ, "xi": XI, "eta": ETA, "phi_per_m": PHI,
}  # fmt: skip
"""Columns of the patch array by their names in runs and tables."""

SLOPE_TOLERANCE = 1e-12
"""Tolerance of the slope difference at a contact point. The point then has an error of about 1e-13 m, on nearly
conformal pairs of 1e-11 m."""

_LOOSE_TOLERANCE = 1e-9
"""Tolerance of the slope difference where the point only starts the search for the overlap's edges."""

_LAST_STEP = 2e-5
"""Newton step towards an edge (m) below which the error of the edge is less than ``_EDGE_TOLERANCE``."""

_EDGE_TOLERANCE = 4e-7
"""Tolerance of the edges of an overlap, m. The error of the integral of g^2 is of third order in it."""

GAUSS_POINTS, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(6)


@jit(allocates=False)
def deepest_point(geometry, pose, u, tolerance, outside, beyond):
    """Lateral wheel coordinate (m) of the deepest point of an overlap, where the slopes of wheel and rail agree.

    Newton steps start at ``u`` and stay inside a shrinking bracket, at first from ``outside`` to ``beyond``; points
    outside it belong to other overlaps. Returns ``u`` if the bracket contains no such point (edge of a profile)."""
    low, high, new = outside, beyond, u
    for _ in range(60):
        value, rate = slope_difference(geometry, pose, new)
        if abs(value) < tolerance:
            return new
        if value < 0.0:
            low = new
        else:
            high = new
        step = -value / rate if rate > 0.0 else math.copysign(SCAN_STEP, -value)
        new += min(max(step, -SCAN_STEP), SCAN_STEP)
        if not low < new < high:
            new = 0.5 * (low + high)
        if high - low < 1e-13:
            break
    near = 1e-3 * (beyond - outside)
    return new if outside + near < new < beyond - near else u


@jit(allocates=False)
def edge_by_newton(geometry, pose, u, low, high):
    """Zero of the gap (m) by a few Newton steps from the guess ``u``; NaN if they do not converge in (low, high)."""
    for _ in range(6):
        if not low <= u <= high:
            return np.nan
        gap, slope = gap_and_slope(geometry, pose, u)
        step = gap / slope
        u -= step
        if abs(step) < _LAST_STEP:
            return u
    return np.nan


@jit(allocates=False)
def edge_by_bracket(geometry, pose, outside, inside):
    """Zero of the gap (m) between a point outside and a point inside an overlap (Illinois steps), or the rail's end."""
    high, low = gap_at(geometry, pose, outside)[0], gap_at(geometry, pose, inside)[0]
    while high >= 0.5 and abs(outside - inside) > _EDGE_TOLERANCE:  # the rail ends between the two
        new = 0.5 * (outside + inside)
        value = gap_at(geometry, pose, new)[0]
        if value < 0.0:
            inside, low = new, value
        else:
            outside, high = new, value
    kept = 0
    for _ in range(30):
        if abs(outside - inside) < _EDGE_TOLERANCE or high - low <= 0.0:
            break
        new = (outside * low - inside * high) / (low - high)
        value = gap_at(geometry, pose, new)[0]
        if abs(value) < _EDGE_TOLERANCE * abs(high - low) / abs(outside - inside):
            return new
        if value < 0.0:
            inside, low = new, value
            if kept == -1:
                high *= 0.5
            kept = -1
        else:
            outside, high = new, value
            if kept == 1:
                low *= 0.5
            kept = 1
    return 0.5 * (outside + inside)


@jit(allocates=False)
def edges_of_overlap(geometry, pose, outside, first, last, beyond, deepest):
    """Return both ends (m) of a narrow overlap.

    Newton steps start from the parabola at its deepest point; where they do not converge, the end is found by
    bracketing. ``outside`` and ``beyond`` lie outside, ``first`` and ``last`` inside the overlap; ``deepest`` is a
    strip near its deepest point."""
    u = deepest_point(geometry, pose, deepest, _LOOSE_TOLERANCE, outside, beyond)
    gap, rate = gap_at(geometry, pose, u)[0], slope_difference(geometry, pose, u)[1]
    start = end = np.nan
    if gap < 0.0 < rate:
        half = math.sqrt(-2.0 * gap / rate)
        start = edge_by_newton(geometry, pose, u - half, outside, u)
        end = edge_by_newton(geometry, pose, u + half, u, beyond)
    if not start == start:
        start = edge_by_bracket(geometry, pose, outside, first)
    if not end == end:
        end = edge_by_bracket(geometry, pose, beyond, last)
    return start, end


@jit(allocates=False)
def overlap_moments(geometry, pose, first, last):
    """Moments M0, M1, M2 of g^2 over [first, last], M1 and M2 about the middle, by Gauss-Legendre quadrature in
    panels."""
    panels = int((last - first) / SCAN_STEP) + 1
    middle, half = 0.5 * (first + last), 0.5 * (last - first) / panels
    m0 = m1 = m2 = 0.0
    for panel in range(panels):
        for i in range(len(GAUSS_POINTS)):
            e = half * (2 * panel + 1 - panels + GAUSS_POINTS[i])
            gap = min(gap_at(geometry, pose, middle + e)[0], 0.0)
            square = GAUSS_WEIGHTS[i] * gap * gap
            m0 += square
            m1 += square * e
            m2 += square * e * e
    return half * m0, half * m1, half * m2


@jit(allocates=False, forceinline=True)
def _fill_patch(geometry, pose, u, along, radius, ur, rail_z, slope, penetration, patch):
    """Fill the position columns of a patch, which lies midway between the undeformed surfaces (equal materials).

    ``rail_z`` is the rail's height at ``ur``, ``slope`` the slope of the contact plane over the rail's lateral
    coordinate. ``u``, ``along`` and ``radius`` describe the wheel's strip."""
    secant = math.sqrt(1.0 + slope * slope)
    cosine = 1.0 / secant
    dy, _ = radius_direction(pose, along)
    patch[U_WHEEL] = u
    patch[S_WHEEL] = -_arc_sine((along * pose.q * pose.ey - pose.ex * dy) / math.sqrt(1.0 - pose.ez * pose.ez))
    patch[U_RAIL] = ur
    patch[ANGLE] = pose.side * _arc_tangent(slope)
    patch[COSINE], patch[SINE] = cosine, pose.side * slope * cosine
    patch[PENETRATION] = penetration
    x = radius * along * pose.q + (geometry.half_distance + u) * pose.ex
    patch[X] = with_rail_along(geometry, AHEAD, ur, 1.0, x)
    patch[Z] = with_rail_along(geometry, LIFT, ur, 1.0, rail_z - penetration * (secant - 0.5 * cosine))
    patch[Y] = pose.side * (ur + geometry.rail_distance - 0.5 * penetration * slope * cosine)


@jit(allocates=False, forceinline=True)
def _arc_tangent(x):
    """Return atan x; for small x from a series of eight terms, with errors at the level of rounding."""
    s = x * x
    if s > 0.01:
        return math.atan(x)
    s2 = s * s
    high = 1.0 / 9.0 - s * (1.0 / 11.0) + s2 * (1.0 / 13.0 - s * (1.0 / 15.0))
    return x - x * s * (1.0 / 3.0 - s * (1.0 / 5.0) + s2 * (1.0 / 7.0 - s * high))


@jit(allocates=False, forceinline=True)
def _arc_sine(x):
    """Return asin x; for small x from a series of eight terms, with errors at the level of rounding."""
    s = x * x
    if s > 0.01:
        return math.asin(x)
    s2 = s * s
    high = 35.0 / 1152.0 + s * (63.0 / 2816.0) + s2 * (231.0 / 13312.0 + s * (143.0 / 10240.0))
    return x + x * s * (1.0 / 6.0 + s * (3.0 / 40.0) + s2 * (15.0 / 336.0 + s * high))


@jit(allocates=False)
def patch_at_maximum(geometry, pose, u, outside, beyond, patch):
    """Fill ``patch`` by the reduction ``maximum``; return whether there is penetration.

    ``u`` is the deepest strip; ``outside`` and ``beyond`` are points without overlap on either side of its overlap."""
    u = deepest_point(geometry, pose, u, SLOPE_TOLERANCE, outside, beyond)
    ur, z, radius, slope, _, along = strip_point(geometry, pose, u)
    if not on_rail(geometry, ur):
        return False
    f, df, _ = cubic_at(geometry.rail, geometry.rail_start, geometry.rail_step, ur)
    rail_cos = 1.0 / math.sqrt(1.0 + df * df)
    penetration = (f - z) * rail_cos
    if penetration <= 0.0:
        return False
    second = curvature_at(geometry.wheel, geometry.wheel_start, geometry.wheel_step, u)
    rail_second = curvature_at(geometry.rail, geometry.rail_start, geometry.rail_step, ur)
    wheel_cos = 1.0 / math.sqrt(1.0 + slope * slope)
    around = wheel_cos / radius
    across = -second * wheel_cos * wheel_cos * wheel_cos
    rail_across = -rail_second * rail_cos * rail_cos * rail_cos
    hxx, hxy, hyy = around, 0.0, across + rail_across
    if pose.tilt != 0.0:
        # The circle's tangent leaves the rolling direction by an angle in the tangent plane.
        down = math.sqrt(max(1.0 - along * along, 0.0))
        cy = down * pose.y_along - along * pose.y_down
        cz = down * pose.z_along - along * pose.z_down
        sine = (cy + cz * pose.side * df) * rail_cos
        square = sine * sine
        hxx = around * (1.0 - square) + across * square
        hxy = (around - across) * sine * math.sqrt(max(1.0 - square, 0.0))
        hyy = around * square + across * (1.0 - square) + rail_across
    mean, half = 0.5 * (hxx + hyy), 0.5 * (hxx - hyy)
    spread = math.copysign(math.sqrt(half * half + hxy * hxy), half)
    _fill_patch(geometry, pose, u, along, radius, ur, f, df, penetration, patch)
    around = with_rail_along(geometry, BEND, ur, 2.0 * rail_cos, mean + spread)
    patch[CURVATURE_X] = 0.5 * max(around, CURVATURE_FLOOR)
    patch[CURVATURE_Y] = 0.5 * max(mean - spread, CURVATURE_FLOOR)
    return True


@jit(allocates=False, forceinline=True)
def patch_from_moments(geometry, pose, middle, m0, m1, m2, patch):
    """Fill ``patch`` by the reduction ``moment`` from the moments of g^2 about ``middle``; return whether there is
    penetration."""
    if not m0 > 0.0:
        return False
    inverse = 1.0 / m0
    centre = m1 * inverse
    spread = 7.0 * (m2 * inverse - centre * centre)
    if not spread > 0.0:
        return False
    width = math.sqrt(spread)
    depth = math.sqrt(0.9375 * m0 / width)
    u = middle + centre
    ur, _, radius, slope, _, along = strip_point(geometry, pose, u)
    f, df, _ = cubic_at(geometry.rail, geometry.rail_start, geometry.rail_step, ur)
    slope_both = 0.5 * (wheel_slope(pose, slope, along) + df)
    cosine = 1.0 / math.sqrt(1.0 + slope_both * slope_both)
    _fill_patch(geometry, pose, u, along, radius, ur, f, slope_both, depth * cosine, patch)
    patch[CURVATURE_X] = with_rail_along(geometry, BEND, ur, cosine, 0.5 / (radius * math.sqrt(1.0 + slope * slope)))
    patch[CURVATURE_Y] = depth / spread * cosine * cosine * cosine
    return True
