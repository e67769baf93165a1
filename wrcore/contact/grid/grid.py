"""Contact of one patch on a uniform grid: reference and fallback of other patch models.

`grid_normal` finds the overlaps of the surfaces in a contact plane, chooses a grid over the part in contact, and solves
the normal problem (`grid.pressure`). `grid_rolling` solves the tangential problem (`grid.traction`). Neither can fail:
the normal problem is convex, the tangential problem monotone. Both iterations stop after a maximum number of steps with
a result within all bounds. All kernels can be called from other kernels; they allocate.
"""

import math
from typing import NamedTuple

import numpy as np

from wrcore.contact.grid.edges import with_sharp_edges
from wrcore.contact.grid.pressure import solve_pressure
from wrcore.contact.grid.traction import solve_traction
from wrcore.contact.normal.gap import JOINED
from wrcore.contact.search.surfaces import NO_RAIL, rail_height, rail_over, station_of, surface_gap, wheel_height
from wrcore.kernels.jit import jit

REACH = 0.04
"""Half width around a plane's origin of the search for overlaps, m."""

SEARCH_STEP = 2.5e-4
"""Spacing of the strips in this search, m."""

COARSE, COARSE_STEP, MOST_COARSE = 16, 4e-4, 64
"""Grid of the first solution, which locates the contact: number of elements along x, also the minimum across; size of
the elements across (m), small enough for the smallest sub-patches; maximum number across."""

MOST_EXTENSIONS = 10
"""Maximum number of extensions of a grid, by a quarter each, where contact reaches its border."""

MOST_ACROSS = 4
"""Maximum number of elements across over the requested number, for sub-patches with a gap between them."""

TOLERANCE, COARSE_TOLERANCE = 1e-5, 1e-3
"""Tolerances of the conditions of normal contact, over the maximum overlap: final and first solution."""


class GridPatch(NamedTuple):
    """Normal contact on a grid; arrays over elements have shape (nx, ns)."""

    x: np.ndarray
    s: np.ndarray
    """Centres of elements relative to the plane's origin, m."""
    dx: float
    ds: float
    gap: np.ndarray
    """Gap between the undeformed surfaces, m."""
    height: np.ndarray
    """Height of the wheel over the plane, m."""
    pressure: np.ndarray
    """Normal pressure, Pa."""


class GridTraction(NamedTuple):
    """Tangential contact on a grid; arrays of shape (nx, ns)."""

    px: np.ndarray
    ps: np.ndarray
    """Traction on the wheel, Pa."""
    sx: np.ndarray
    ss: np.ndarray
    """Slip of the wheel over the rail, over the speed; zero in adhesion."""
    fx: float
    fs: float
    mn: float
    """Force (N) and moment about the normal at the plane's origin (N m), extrapolated to dx = 0."""
    fine: tuple
    coarse: tuple
    """Forces and moment without extrapolation: on the grid, and with elements of twice the length."""
    iterations: int
    """Number of iterations, negative if the tolerance was not met."""
    pressure: np.ndarray
    """Pressure with accurate ends that bounds the tractions, Pa."""


@jit(allocates=False)
def _overlap_over(geometry, pose, plane, s, u, rail):
    """Return the results of `_strip_overlap` on a rail that changes along the track, evaluated at its stations."""
    least, first, last, guess = NO_RAIL, 0.0, -1.0, rail
    step = station_of(geometry, 1) - station_of(geometry, 0)
    for i in range(len(geometry.over)):
        x = station_of(geometry, i) - plane.x
        wheel = wheel_height(geometry, pose, plane, x, s, guess)
        if wheel == wheel:
            guess = wheel
            gap = wheel - rail - plane.cosine * rail_over(geometry, plane.x + x, u)
            least = min(least, gap)
            if gap < 0.0:
                first, last = (first if last >= first else x - step), x + step
    return u, 0.5 * (first + last), least, 0.5 * max(last - first, 0.0)


@jit(allocates=False)
def _strip_overlap(geometry, pose, plane, s, u, middle):
    """Overlap of one strip at s: rail coordinate u, position of the minimum gap along x, this gap, and half the length.

    The gap over x is a parabola up to fourth order, fitted to three points around the last guess."""
    rail, u = rail_height(geometry, pose, plane, s, u)
    gap, curvature, step = NO_RAIL, 1.0, 2e-3
    if rail != rail:
        return u, middle, gap, 0.0
    if len(geometry.over) > 0:
        return _overlap_over(geometry, pose, plane, s, u, rail)
    for _ in range(3):
        ahead = wheel_height(geometry, pose, plane, middle + step, s, rail)
        here = wheel_height(geometry, pose, plane, middle, s, rail)
        behind = wheel_height(geometry, pose, plane, middle - step, s, rail)
        second = ahead - 2.0 * here + behind
        if not second > 0.0:  # also beyond the end of a profile
            return u, middle, NO_RAIL, 0.0
        move = 0.5 * step * (behind - ahead) / second
        gap, curvature = here - rail - 0.125 * (behind - ahead) ** 2 / second, 0.5 * second / step**2
        middle += min(max(move, -0.02), 0.02)
        if abs(move) < 0.1 * step:
            break
    return u, middle, gap, math.sqrt(max(-gap, 0.0) / curvature)


@jit
def overlap_window(geometry, pose, plane):
    """Bounds x_min, x_max, s_min, s_max (m) of the overlap of the undeformed surfaces around a plane's origin.

    Without overlap x_min > x_max. Overlaps further than `JOINED` from those nearer to the origin are left out."""
    count = int(REACH / SEARCH_STEP)
    x_min, x_max, s_min, s_max = np.inf, -np.inf, np.inf, -np.inf
    for direction in (1, -1):
        u, middle = pose.side * plane.y - geometry.rail_distance, 0.0
        for k in range(0 if direction > 0 else 1, count):
            s = direction * k * SEARCH_STEP
            if s_max >= s_min and (s - s_max > JOINED or s_min - s > JOINED):
                break
            u, middle, gap, half = _strip_overlap(geometry, pose, plane, s, u, middle)
            if gap < 0.0:
                x_min, x_max = min(x_min, middle - half), max(x_max, middle + half)
                s_min, s_max = min(s_min, s - SEARCH_STEP), max(s_max, s + SEARCH_STEP)
    return x_min, x_max, s_min, s_max


@jit
def _solve_window(geometry, pose, plane, modulus, window, nx, ns, tolerance):
    """Solve normal contact on nx by ns elements over a window; return the `GridPatch`."""
    dx, ds = (window[1] - window[0]) / nx, (window[3] - window[2]) / ns
    x = window[0] + dx * (np.arange(nx) + 0.5)
    s = window[2] + ds * (np.arange(ns) + 0.5)
    gap, height, pressure = np.empty((nx, ns)), np.empty((nx, ns)), np.empty((nx, ns))
    surface_gap(geometry, pose, plane, x, s, gap, height)
    solve_pressure(gap, dx, ds, modulus, tolerance, pressure)
    return GridPatch(x, s, dx, ds, gap, height, pressure)


@jit
def contact_window(patch, margin):
    """Return the bounds (m) of the contact on a grid, extended by ``margin`` elements, and the fraction of rows in
    contact.

    Rows are counted between the bounds across. Without contact the bounds are 0 and the fraction is 1."""
    i0, i1, j0, j1 = patch.x.size, 0, patch.s.size, 0
    touching = np.zeros(patch.s.size, np.int64)
    for i in range(patch.x.size):
        for j in range(patch.s.size):
            if patch.pressure[i, j] > 0.0:
                i0, i1, j0, j1 = min(i0, i), max(i1, i), min(j0, j), max(j1, j)
                touching[j] = 1
    if i0 > i1 or j0 > j1:
        return (0.0, 0.0, 0.0, 0.0), 1.0
    half_x, half_s = (0.5 + margin) * patch.dx, (0.5 + margin) * patch.ds
    share = touching.sum() / max(j1 - j0 + 1, 1)
    return (patch.x[i0] - half_x, patch.x[i1] + half_x, patch.s[j0] - half_s, patch.s[j1] + half_s), share


@jit
def grid_normal(geometry, pose, plane, modulus, nx, ns):
    """Solve normal contact of a wheel on a grid over a contact plane; return the `GridPatch`.

    All overlaps are one patch; ``modulus`` is E* (Pa). About ``nx`` by ``ns`` elements cover the contact, more across
    for sub-patches with a gap between them. Without overlap the grid is one element without pressure."""
    window = overlap_window(geometry, pose, plane)
    if not window[0] < window[1]:
        one = np.zeros(1)
        return GridPatch(one, one, 1e-4, 1e-4, np.ones((1, 1)), np.zeros((1, 1)), np.zeros((1, 1)))
    across = min(max(COARSE, int(math.ceil((window[3] - window[2]) / COARSE_STEP))), MOST_COARSE)
    patch = _solve_window(geometry, pose, plane, modulus, window, COARSE, across, COARSE_TOLERANCE)
    if not patch.pressure.max() > 0.0:
        return patch
    (x0, x1, s0, s1), share = contact_window(patch, 0.25)
    ns = min(int(math.ceil(ns / share)), MOST_ACROSS * ns)
    x_more, s_more = 1.1 * (x1 - x0) / nx, 1.1 * (s1 - s0) / ns
    x0, x1, s0, s1 = x0 - x_more, x1 + x_more, s0 - s_more, s1 + s_more
    for _ in range(MOST_EXTENSIONS):
        x0, x1, s0, s1 = max(x0, window[0]), min(x1, window[1]), max(s0, window[2]), min(s1, window[3])
        patch = _solve_window(geometry, pose, plane, modulus, (x0, x1, s0, s1), nx, ns, TOLERANCE)
        if not patch.pressure.max() > 0.0:
            break
        (a0, a1, b0, b1), _ = contact_window(patch, 0.0)
        near_x, near_s, x_more, s_more = 0.5 * patch.dx, 0.5 * patch.ds, 0.25 * (x1 - x0), 0.25 * (s1 - s0)
        fits = a0 > x0 + near_x or x0 <= window[0], a1 < x1 - near_x or x1 >= window[1]
        fits_s = b0 > s0 + near_s or s0 <= window[2], b1 < s1 - near_s or s1 >= window[3]
        if fits[0] and fits[1] and fits_s[0] and fits_s[1]:
            break
        x0, x1 = x0 - (0.0 if fits[0] else x_more), x1 + (0.0 if fits[1] else x_more)
        s0, s1 = s0 - (0.0 if fits_s[0] else s_more), s1 + (0.0 if fits_s[1] else s_more)
    return patch


@jit
def _resultant(x, s, dx, ds, px, ps):
    """Forces fx, fs (N) and moment mn (N m) of tractions."""
    fx = fs = mn = 0.0
    for i in range(x.size):
        for j in range(s.size):
            fx += px[i, j]
            fs += ps[i, j]
            mn += x[i] * ps[i, j] - s[j] * px[i, j]
    area = dx * ds
    return fx * area, fs * area, mn * area


@jit
def _paired(field):
    """Mean of each pair of neighbours along x."""
    return 0.5 * (field[::2] + field[1::2])


@jit
def grid_rolling(patch, wx, ws, friction, shear_modulus, poisson, tolerance):
    """Solve steady rolling contact for the pressure on a grid; return the `GridTraction`.

    The grid has an even number of elements along x. ``wx``, ``ws`` (nx, ns): rigid slip of the wheel over the rail,
    over the speed; ``tolerance``: last change of the tractions, relative to them."""
    nx, ns = patch.pressure.shape
    px, ps, sx, ss = np.zeros((nx, ns)), np.zeros((nx, ns)), np.zeros((nx, ns)), np.zeros((nx, ns))
    none = (0.0, 0.0, 0.0)
    if not (patch.pressure.max() > 0.0 and friction > 0.0):
        return GridTraction(px, ps, sx, ss, 0.0, 0.0, 0.0, none, none, 0, patch.pressure)
    pressure = with_sharp_edges(patch.pressure, patch.x, patch.dx)
    bound, dx, ds = friction * pressure, patch.dx, patch.ds
    count = solve_traction(bound, wx, ws, dx, ds, shear_modulus, poisson, tolerance, px, ps, sx, ss)
    fine = _resultant(patch.x, patch.s, dx, ds, px, ps)
    wide = np.empty((4, nx // 2, ns))
    other = solve_traction(_paired(bound), _paired(wx), _paired(ws), 2.0 * dx, ds, shear_modulus, poisson, tolerance,
                           wide[0], wide[1], wide[2], wide[3])  # fmt: skip
    coarse = _resultant(_paired(patch.x), patch.s, 2.0 * dx, ds, wide[0], wide[1])
    fx, fs, mn = 2.0 * fine[0] - coarse[0], 2.0 * fine[1] - coarse[1], 2.0 * fine[2] - coarse[2]
    return GridTraction(px, ps, sx, ss, fx, fs, mn, fine, coarse, count if other > 0 else -abs(count), pressure)
