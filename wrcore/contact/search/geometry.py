"""Data of the contact search: profiles and positions of wheel and rail as arrays with equally spaced nodes."""

import math
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

SCAN_STEP = 0.6e-3
"""Node spacing of the scan for overlaps, m. Where a patch may be narrower, points between nodes are evaluated too."""

# Columns of the profile arrays.
VALUE, SLOPE, CURVATURE = range(3)
# Rows of the strip arrays (scan, fine and spread). With along = tilt R' the components of a strip's radius are
# R along = tilt ALONG and R sqrt(1 - along^2) = R - tilt^2 (DOWN_2 + tilt^2 (DOWN_4 + tilt^2 DOWN_6)); the series has
# an error of along^8/26.
RADIUS, ALONG, DOWN_2, DOWN_4, DOWN_6 = range(5)
# Further rows of the scan arrays.
WHEEL_RESERVE, RADIUS_SLOPE, WHEEL_COSINE = range(5, 8)
RAIL_RESERVE, RAIL_COSINE = 4, 5

LANES = 8
"""Strips per vector register; strips are evaluated in multiples of this number."""

SPREAD = 4
"""Ratio of the spacing of the spread nodes to that of the profile's nodes: every fourth node is a spread node."""

_MOST_BLOCKS = 56
"""Maximum number of blocks: each has a bit of a 64-bit word, in whole registers, and at least one bit stays unused."""

MARGIN = 4
SAFETY = 1.5
"""Safety factor for the effect of roll and yaw on a profile's second derivative."""
SECOND_BOUND = 8.0 / (SAFETY * SCAN_STEP**2)
"""Bound of a second derivative (1/m) over its reserve (m)."""

LARGEST_OFFSET = 0.6 * SCAN_STEP
"""Maximum distance by which the scan's nodes may leave their rail cell, m; the second reserve covers the error."""
OFFSET_PER_ROLL, OFFSET_PER_YAW_SQUARE = 0.03, 1.5
"""Lateral displacement of a strip per roll (m/rad) and per yaw^2 (m/rad²): the difference of its radius to that at the
tape circle (0.03 m at the flange tip), and R R' (1.5 m on a flange of 70 degrees)."""

PARTS = 4
"""Parts of a scan cell with separate bounds of gaps."""

SMALL_SHARE = 0.15
"""Fraction of LARGEST_OFFSET up to which the tighter of two tables of bounds holds."""

YAW_LIMIT = 0.02
"""Yaw (rad) up to which `zone_planar_errors` holds."""


class ContactGeometry(NamedTuple):
    """Profiles and positions of one wheel and one rail, for kernels."""

    wheel: np.ndarray
    """(n, 3): R - r0, R', R'' for Hertz; without r0, so that rounding does not spoil slopes."""
    rail: np.ndarray
    """(m, 3): ordinate f, f', f'' for Hertz."""
    scan_wheel: np.ndarray
    """(8, nodes): strip rows, the reserve, R' and the cosine of the wheel's inclination at the scan nodes; padding has
    R = 0."""
    scan_rail: np.ndarray
    """(6, cells): the rail in each scan cell as a cubic of the distance from the cell's start (4 coefficients), the
    reserve, and the cosine of its inclination; padding lies 1 m below the track. Between two nodes the gap is less than
    at the nodes by at most the sum of the reserves of wheel node and rail cell (M h^2/8)."""
    zone_gaps: np.ndarray
    """(shifts 2 PARTS, blocks): lower bounds of gaps, see `_zone_gaps`; in each shift, those for small angles first."""
    zone_planar_errors: np.ndarray
    """(shifts, blocks): penetration over yaw^2 that planar detection can miss, see `zone_planar_errors`."""
    block: int
    """Strips per block: LANES, or a multiple of it where the rail is very wide."""
    fine_wheel: np.ndarray
    """(5, n + LANES): strip rows at the nodes of the wheel profile, and padding."""
    fine_rail: np.ndarray
    """(4, m - 1 + LANES): cubics of the rail between the nodes of its profile, as in ``scan_rail``, and padding; only
    padding if the node spacings of wheel and rail differ."""
    spread_wheel: np.ndarray
    """(5, n / SPREAD + LANES): every SPREAD-th column of ``fine_wheel``, beginning with the first, and padding."""
    spread_rail: np.ndarray
    """(SPREAD, 4, m / SPREAD + LANES): every SPREAD-th cell of ``fine_rail``, beginning with each of its first SPREAD
    cells."""
    wheel_start: float
    wheel_step: float
    rail_start: float
    rail_step: float
    scan_wheel_start: float
    scan_rail_start: float
    rolling_radius: float
    """Radius r0 at the tape circle, m."""
    half_distance: float
    """Distance of the tape circle from the wheelset's centre, m."""
    rail_distance: float
    """Distance of the rail profile's origin from the track's centre line, m."""
    along: np.ndarray | tuple = ()
    """(m, 5): corrections of a strip at the rail's nodes if the rail changes along the track, else (). See
    `wrcore.contact.changing_rails.sections`."""
    over: np.ndarray | tuple = ()
    """(n, 1 + m): equally spaced stations along the track, from the wheelset's cross-section, m, and the height of the
    rail over its section at each node of the profile, m: the true height, not a parabola. For contact on grids."""


def contact_geometry(wheel, rail, rolling_radius, half_distance, rail_distance):
    """Return the `ContactGeometry` of the profiles and lengths (m) of a `WheelOnRail`."""
    scan_rail, scan_rail_start, block = _rail_scan(rail)
    scan_wheel, scan_wheel_start = _wheel_scan(wheel, rolling_radius, scan_rail.shape[1])
    gaps = zone_gaps(scan_wheel, scan_rail, block, rolling_radius)
    strips, cells = _strip_rows(rolling_radius - wheel.f, -wheel.df), _fine_rail(wheel, rail)
    return ContactGeometry(
        np.column_stack([-wheel.f, -wheel.df, -wheel.d2f]), np.column_stack([rail.f, rail.df, rail.d2f]),
        scan_wheel, scan_rail,
        gaps, zone_planar_errors(scan_wheel, scan_rail, block), block,
        _padded(strips), _padded(cells), _padded(strips[:, ::SPREAD]), _spread(cells),
        float(wheel.u[0]), wheel.spacing, float(rail.u[0]), rail.spacing,
        scan_wheel_start, scan_rail_start,
        float(rolling_radius), float(half_distance), rail_distance,
    )  # fmt: skip


def _reserve(curve, nodes):
    """Reserves M h^2/8 (m) at scan nodes, with the maximum second derivative M within one scan step of the node.

    Second derivatives are differences of the exact slopes."""
    second = np.abs(np.diff(curve.df) / np.diff(curve.u))
    second = np.maximum(np.append(second, second[-1]), np.insert(second, 0, second[0]))
    first = np.searchsorted(curve.u, nodes - SCAN_STEP, side="left")
    last = np.searchsorted(curve.u, nodes + SCAN_STEP, side="right")
    bound = [second[i:j].max() if j > i else 0.0 for i, j in zip(first, last, strict=True)]
    return SAFETY * 0.125 * SCAN_STEP**2 * np.array(bound)


def _wheel_scan(wheel, rolling_radius, window):
    """Return the wheel's rows at the scan nodes, padded by ``window`` nodes on either side, and the first node (m)."""
    count = int((wheel.u[-1] - wheel.u[0]) / SCAN_STEP + 1e-9) + 1
    u = wheel.u[0] + SCAN_STEP * np.arange(count)
    nodes = np.zeros((8, count + 2 * window))
    middle, slope = slice(window, window + count), -wheel(u, 1)
    nodes[:5, middle] = _strip_rows(rolling_radius - wheel(u), slope)
    nodes[WHEEL_RESERVE, middle], nodes[RADIUS_SLOPE, middle] = _reserve(wheel, u), slope
    nodes[WHEEL_COSINE, middle] = 1.0 / np.sqrt(1.0 + slope**2)
    return nodes, float(u[0] - window * SCAN_STEP)


def _whole(count):
    """Return the smallest multiple of LANES that is not less than ``count``."""
    return LANES * math.ceil(count / LANES)


def _strip_rows(radius, slope):
    """Return the rows RADIUS to DOWN_6 from R and R'."""
    square = slope**2
    return np.stack([radius, radius * slope, radius * square / 2, radius * square**2 / 8, radius * square**3 / 16])


def _padded(rows):
    return np.pad(rows, ((0, 0), (0, LANES)))


def _spread(cells):
    """Return `ContactGeometry.spread_rail`; all parts have the same number of cells."""
    count = cells.shape[1] // SPREAD
    return np.stack([_padded(cells[:, first::SPREAD][:, :count]) for first in range(SPREAD)])


def zone_gaps(wheel, rail, block, rolling_radius):
    """Lower bounds of gaps (m), with which the scan skips strips far from contact.

    See `_zone_gaps`; for each shift, the bounds for small angles come first."""
    limits = SMALL_SHARE * LARGEST_OFFSET, LARGEST_OFFSET
    gaps = [_zone_gaps(wheel, rail, block, rolling_radius, limit) for limit in limits]
    return np.concatenate(gaps, 1).reshape(-1, gaps[0].shape[2])


def _zone_gaps(wheel, rail, block, rolling_radius, limit):
    """Lower bounds (m) of gap minus reserves in each block of rail cells, at height 0 and roll 0: (shift, part, block).

    ``shift`` is the number of the first wheel node. The strips lie in the part ``part`` of PARTS of their cells. Roll
    and yaw with a `scan.cell_offset` up to ``limit`` move a strip laterally by at most ``offset`` and down by at most
    ``sag``."""
    cells = rail.shape[1]
    radius, along = wheel[RADIUS], np.abs(wheel[ALONG])
    tilt_square, roll = limit / OFFSET_PER_YAW_SQUARE, limit / OFFSET_PER_ROLL
    # lateral: roll times the difference of radii, R R' psi^2 by yaw, and the foreshortening of the axle
    offset = (np.abs(radius - rolling_radius) + tilt_square * wheel[DOWN_2]) * roll + tilt_square * along
    offset += 0.51 * SCAN_STEP * np.arange(wheel.shape[1]) * max(tilt_square, roll * roll)
    offset = sliding_window_view(1.01 * offset, cells)
    sag = along * 0.25 * tilt_square * roll  # R R' tilt^2 ez: maximum where roll and yaw each take half the limit
    reserves = 1.0 + (limit / LARGEST_OFFSET) ** 2
    height = sliding_window_view(-radius - sag - reserves * wheel[WHEEL_RESERVE], cells) - reserves * rail[RAIL_RESERVE]
    c0, c1, c2, c3 = rail[:4]
    gaps = np.full((len(height), PARTS, _whole(cells // block)), 1.0)
    for part in range(PARTS):
        low, high = part / PARTS * SCAN_STEP - offset, (part + 1) / PARTS * SCAN_STEP + offset
        # bound of a cubic over an interval: its higher end, and its maximum height over the chord
        top = np.maximum(*(c0 + d * (c1 + d * (c2 + d * c3)) for d in (low, high)))
        bend = np.maximum(*(np.abs(2.0 * c2 + 6.0 * c3 * d) for d in (low, high)))
        gap = height - top - 0.125 * bend * (high - low) ** 2
        gaps[:, part, : cells // block] = gap.reshape(len(gap), -1, block).min(axis=2)
    return gaps


def zone_planar_errors(wheel, rail, block):
    """Maximum penetration over yaw^2 (m/rad²) that planar detection can miss in each block: (shift, block).

    Valid for yaw up to YAW_LIMIT."""
    cells = rail.shape[1]
    missed = YAW_LIMIT**2 * 0.5 * SECOND_BOUND * rail[RAIL_RESERVE] * sliding_window_view(wheel[ALONG] ** 2, cells)
    missed += sliding_window_view(wheel[DOWN_2], cells)
    missed_most = np.zeros((len(missed), _whole(cells // block)))
    missed_most[:, : cells // block] = missed.reshape(len(missed), -1, block).max(axis=2)
    return missed_most


def _fine_rail(wheel, rail):
    """Cubics of the rail between its nodes; an empty array if wheel and rail have different node spacings."""
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
    """Return the scan cells of the rail, padded to whole blocks, their start (m), and the number of cells per block."""
    count = int((rail.u[-1] - rail.u[0]) / SCAN_STEP + 1e-9)
    u = rail.u[0] + SCAN_STEP * np.arange(count + 1)
    f, df = rail(u), rail(u, 1)
    block = LANES * math.ceil((count + 2 * MARGIN) / (LANES * _MOST_BLOCKS))
    cells = np.zeros((6, block * math.ceil((count + 2 * MARGIN) / block)))
    cells[0], cells[RAIL_COSINE] = -1.0, 1.0
    middle = slice(MARGIN, MARGIN + count)
    cells[:4, middle] = _cubics(f, df, SCAN_STEP)
    cells[RAIL_RESERVE, middle] = _reserve(rail, u[:-1] + 0.5 * SCAN_STEP)
    cells[RAIL_COSINE, middle] = 1.0 / np.sqrt(1.0 + (0.5 * (df[:-1] + df[1:])) ** 2)
    return cells, float(u[0] - MARGIN * SCAN_STEP), block
