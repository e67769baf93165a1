"""Wheel, rail and their placement compiled for the contact search: plain arrays with equally spaced nodes."""

import math
from typing import NamedTuple

import numpy as np

from wrcore.errors import InputError

SCAN_STEP = 0.6e-3
"""Distance of the nodes of the scan for overlaps, m. Where a patch may be narrower, the search looks closer."""

# Columns of the profile arrays.
VALUE, SLOPE, CURVATURE = range(3)
# Rows of the scan arrays.
RADIUS, RADIUS_SLOPE, WHEEL_RESERVE = range(3)
RAIL_RESERVE, RAIL_COSINE = 4, 5

_MARGIN = 4
_SAFETY = 1.5
"""Covers what roll and yaw add to a profile's second derivative."""
RESERVE_TO_SECOND = 8.0 / (_SAFETY * SCAN_STEP**2)
"""Bound of a second derivative (1/m) from a reserve (m)."""


class ContactGeometry(NamedTuple):
    """Wheel, rail and their placement, for kernels."""

    wheel: np.ndarray
    """(n, 3): R - r0, R', R'' for Hertz; without r0, so that rounding does not spoil slopes."""
    rail: np.ndarray
    """(m, 3): ordinate f, f', f'' for Hertz."""
    scan_wheel: np.ndarray
    """(3, nodes): R, R' and the reserve at the scan nodes; padding has R = 0."""
    scan_rail: np.ndarray
    """(6, cells): the rail in each scan cell as a cubic of the distance from the cell's start (4 coefficients), the
    reserve, and the cosine of its inclination; padding lies 1 m below the track. The reserves of a wheel node and its
    rail cell together bound how much deeper than the nodes the gap between them can go (M h^2/8)."""
    fine_wheel: np.ndarray
    """(2, n): R and R' at the profile's own nodes."""
    fine_rail: np.ndarray
    """(4, m - 1): the rail between its own nodes, as in ``scan_rail``; no cells where the two spacings differ."""
    wheel_start: float
    wheel_step: float
    rail_start: float
    rail_step: float
    scan_wheel_start: float
    scan_rail_start: float
    rolling_radius: float
    """Radius r0 at the tape circle, m."""
    half_distance: float
    """Tape circle from the wheelset's centre, m."""
    rail_distance: float
    """Rail profile origin from the track's centre line, m."""


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
    scan_rail, scan_rail_start = _rail_scan(rail)
    scan_wheel, scan_wheel_start = _wheel_scan(wheel, rolling_radius, scan_rail.shape[1])
    return ContactGeometry(
        np.column_stack([-wheel.f, -wheel.df, -wheel.d2f]), np.column_stack([rail.f, rail.df, rail.d2f]),
        scan_wheel, scan_rail, np.stack([rolling_radius - wheel.f, -wheel.df]), _fine_rail(wheel, rail),
        float(wheel.u[0]), wheel.spacing, float(rail.u[0]), rail.spacing,
        scan_wheel_start, scan_rail_start,
        float(rolling_radius), float(half_distance), float(track.rail_distance(rail)),
    )  # fmt: skip


def _reserve(curve, nodes):
    """M h^2/8 around scan nodes, m: M from differences of the exact slopes within one step of the node."""
    second = np.abs(np.diff(curve.df) / np.diff(curve.u))
    second = np.maximum(np.append(second, second[-1]), np.insert(second, 0, second[0]))
    first = np.searchsorted(curve.u, nodes - SCAN_STEP, side="left")
    last = np.searchsorted(curve.u, nodes + SCAN_STEP, side="right")
    bound = [second[i:j].max() if j > i else 0.0 for i, j in zip(first, last, strict=True)]
    return _SAFETY * 0.125 * SCAN_STEP**2 * np.array(bound)


def _wheel_scan(wheel, rolling_radius, window):
    """Scan nodes of the wheel, padded by one window of rail cells on either side, and where they start."""
    count = int((wheel.u[-1] - wheel.u[0]) / SCAN_STEP + 1e-9) + 1
    u = wheel.u[0] + SCAN_STEP * np.arange(count)
    nodes = np.zeros((3, count + 2 * window))
    middle = slice(window, window + count)
    nodes[RADIUS, middle], nodes[RADIUS_SLOPE, middle] = rolling_radius - wheel(u), -wheel(u, 1)
    nodes[WHEEL_RESERVE, middle] = _reserve(wheel, u)
    return nodes, float(u[0] - window * SCAN_STEP)


def _fine_rail(wheel, rail):
    """Cubics of the rail between its nodes, or none if wheel and rail nodes are not equally far apart."""
    step = rail.spacing
    if abs(wheel.spacing - step) > 1e-9 * step:
        return np.zeros((4, 0))
    return _cubics(rail.f, rail.df, step)


def _cubics(f, df, step):
    """Coefficients (4, n - 1) of the cubic Hermite interpolant through values and slopes (n,)."""
    rise = np.diff(f) / step
    second, third = (3.0 * rise - 2.0 * df[:-1] - df[1:]) / step, (df[:-1] + df[1:] - 2.0 * rise) / step**2
    return np.stack([f[:-1], df[:-1], second, third])


def _rail_scan(rail):
    """Scan cells of the rail, padded to whole vectors of eight, and where they start."""
    count = int((rail.u[-1] - rail.u[0]) / SCAN_STEP + 1e-9)
    u = rail.u[0] + SCAN_STEP * np.arange(count + 1)
    f, df = rail(u), rail(u, 1)
    cells = np.zeros((6, 8 * math.ceil((count + 2 * _MARGIN) / 8)))
    cells[0], cells[RAIL_COSINE] = -1.0, 1.0
    middle = slice(_MARGIN, _MARGIN + count)
    cells[:4, middle] = _cubics(f, df, SCAN_STEP)
    cells[RAIL_RESERVE, middle] = _reserve(rail, u[:-1] + 0.5 * SCAN_STEP)
    cells[RAIL_COSINE, middle] = 1.0 / np.sqrt(1.0 + (0.5 * (df[:-1] + df[1:])) ** 2)
    return cells, float(u[0] - _MARGIN * SCAN_STEP)
