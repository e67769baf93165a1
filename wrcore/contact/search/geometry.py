"""Wheel, rail and their placement compiled for the contact search: plain arrays with equally spaced nodes."""

import math
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

SCAN_STEP = 0.6e-3
"""Distance of the nodes of the scan for overlaps, m. Where a patch may be narrower, the search looks closer."""

# Columns of the profile arrays.
VALUE, SLOPE, CURVATURE = range(3)
# Rows of the strip arrays (scan, fine and spread); with along = tilt R' a strip's radius has the shares
# R along = tilt ALONG and R sqrt(1 - along^2) = R - tilt^2 (DOWN_2 + tilt^2 (DOWN_4 + tilt^2 DOWN_6)) to along^8/26.
RADIUS, ALONG, DOWN_2, DOWN_4, DOWN_6 = range(5)
# Further rows of the scan arrays.
WHEEL_RESERVE, RADIUS_SLOPE, WHEEL_COSINE = range(5, 8)
RAIL_RESERVE, RAIL_COSINE = 4, 5

LANES = 8
"""Strips are taken in multiples of this: whole vector registers."""

SPREAD = 4
"""Of the profile's own nodes each of so many is a spread one."""

_MOST_BLOCKS = 56
"""Blocks that are told apart: of the 64 bits of a word, in whole registers, one left over."""

MARGIN = 4
SAFETY = 1.5
"""Covers what roll and yaw add to a profile's second derivative."""
SECOND_BOUND = 8.0 / (SAFETY * SCAN_STEP**2)
"""Bound of a second derivative (1/m) over its reserve (m)."""

LARGEST_OFFSET = 0.6 * SCAN_STEP
"""Distance by which the scan's nodes may leave their rail cell, m; the second reserve covers what that costs."""
OFFSET_PER_ROLL, OFFSET_PER_YAW_SQUARE = 0.03, 1.5
"""What roll and yaw^2 move a strip sideways, m: by its radius' difference to the tape circle (0.03 m at the flange tip)
and by R R' psi^2 (R R' = 1.5 m on a flange of 70 degrees)."""

PARTS = 4
"""Parts of a scan cell that bounds of gaps are told apart for."""

SMALL_SHARE = 0.15
"""Share of LARGEST_OFFSET up to which tighter bounds hold."""

YAW_LIMIT = 0.02
"""Yaw (rad) up to which `zone_planar_errors` holds."""


class ContactGeometry(NamedTuple):
    """Wheel, rail and their placement, for kernels."""

    wheel: np.ndarray
    """(n, 3): R - r0, R', R'' for Hertz; without r0, so that rounding does not spoil slopes."""
    rail: np.ndarray
    """(m, 3): ordinate f, f', f'' for Hertz."""
    scan_wheel: np.ndarray
    """(8, nodes): strip rows, the reserve, R' and the cosine of the wheel's inclination at the scan nodes; padding has
    R = 0."""
    scan_rail: np.ndarray
    """(6, cells): the rail in each scan cell as a cubic of the distance from the cell's start (4 coefficients), the
    reserve, and the cosine of its inclination; padding lies 1 m below the track. The reserves of a wheel node and its
    rail cell together bound how much deeper than the nodes the gap between them can go (M h^2/8)."""
    zone_gaps: np.ndarray
    """(shifts 2 PARTS, blocks): see `_zone_gaps`; of each shift poses of small angles first."""
    zone_planar_errors: np.ndarray
    """(shifts, blocks): see `zone_planar_errors`."""
    block: int
    """Strips per block: LANES, or a multiple of it where the rail is very wide."""
    fine_wheel: np.ndarray
    """(5, n + LANES): strip rows at the profile's own nodes, and padding."""
    fine_rail: np.ndarray
    """(4, m - 1 + LANES): the rail between its own nodes, as in ``scan_rail``, and padding; padding alone where the two
    spacings differ."""
    spread_wheel: np.ndarray
    """(5, n / SPREAD + LANES): ``fine_wheel`` at its spread nodes, from the first on, and padding."""
    spread_rail: np.ndarray
    """(SPREAD, 4, m / SPREAD + LANES): ``fine_rail`` in as many cells, from each of the first on."""
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
    along: np.ndarray | tuple = ()
    """(m, 5) where the rail changes along the track, at the rail's nodes: see
    `wrcore.contact.changing_rails.sections`."""
    over: np.ndarray | tuple = ()
    """(n, 1 + m): stations along the track, evenly apart, from the wheelset's cross-section, m; how much higher than at
    its nodes the rail is there, as it is, not as a parabola, m: for grids."""


def contact_geometry(wheel, rail, rolling_radius, half_distance, rail_distance):
    """ContactGeometry of the profiles of a `WheelOnRail` and its lengths."""
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
    """M h^2/8 around scan nodes, m: M from differences of the exact slopes within one step of the node."""
    second = np.abs(np.diff(curve.df) / np.diff(curve.u))
    second = np.maximum(np.append(second, second[-1]), np.insert(second, 0, second[0]))
    first = np.searchsorted(curve.u, nodes - SCAN_STEP, side="left")
    last = np.searchsorted(curve.u, nodes + SCAN_STEP, side="right")
    bound = [second[i:j].max() if j > i else 0.0 for i, j in zip(first, last, strict=True)]
    return SAFETY * 0.125 * SCAN_STEP**2 * np.array(bound)


def _wheel_scan(wheel, rolling_radius, window):
    """Scan nodes of the wheel, padded by one window of rail cells on either side, and where they start."""
    count = int((wheel.u[-1] - wheel.u[0]) / SCAN_STEP + 1e-9) + 1
    u = wheel.u[0] + SCAN_STEP * np.arange(count)
    nodes = np.zeros((8, count + 2 * window))
    middle, slope = slice(window, window + count), -wheel(u, 1)
    nodes[:5, middle] = _strip_rows(rolling_radius - wheel(u), slope)
    nodes[WHEEL_RESERVE, middle], nodes[RADIUS_SLOPE, middle] = _reserve(wheel, u), slope
    nodes[WHEEL_COSINE, middle] = 1.0 / np.sqrt(1.0 + slope**2)
    return nodes, float(u[0] - window * SCAN_STEP)


def _whole(count):
    """The next multiple of LANES."""
    return LANES * math.ceil(count / LANES)


def _strip_rows(radius, slope):
    """Rows RADIUS to DOWN_6 from R and R'."""
    square = slope**2
    return np.stack([radius, radius * slope, radius * square / 2, radius * square**2 / 8, radius * square**3 / 16])


def _padded(rows):
    return np.pad(rows, ((0, 0), (0, LANES)))


def _spread(cells):
    """See ``spread_rail``; all of one length, of cells that there are."""
    count = cells.shape[1] // SPREAD
    return np.stack([_padded(cells[:, first::SPREAD][:, :count]) for first in range(SPREAD)])


def zone_gaps(wheel, rail, block, rolling_radius):
    """Lower bounds of gaps, so that the scan can leave out what is far from contact: see `_zone_gaps`; of each shift
    those for small angles first."""
    limits = SMALL_SHARE * LARGEST_OFFSET, LARGEST_OFFSET
    gaps = [_zone_gaps(wheel, rail, block, rolling_radius, limit) for limit in limits]
    return np.concatenate(gaps, 1).reshape(-1, gaps[0].shape[2])


def _zone_gaps(wheel, rail, block, rolling_radius, limit):
    """Entry (shift, part, block): at height 0 and roll 0 no strip of the block, a run of rail cells, comes closer than
    this to being close (see `scan`), if the first wheel node is ``shift`` and the strips stand in the part
    ``part`` of PARTS of their cells. Roll and yaw of a `scan.cell_offset` up to ``limit`` move a strip by up to
    ``offset`` from there, and only upwards but for ``sag``."""
    cells = rail.shape[1]
    radius, along = wheel[RADIUS], np.abs(wheel[ALONG])
    tilt_square, roll = limit / OFFSET_PER_YAW_SQUARE, limit / OFFSET_PER_ROLL
    # lateral: roll times the radius' difference, yaw by R R' psi^2, and the axle's foreshortening along the profile
    offset = (np.abs(radius - rolling_radius) + tilt_square * wheel[DOWN_2]) * roll + tilt_square * along
    offset += 0.51 * SCAN_STEP * np.arange(wheel.shape[1]) * max(tilt_square, roll * roll)
    offset = sliding_window_view(1.01 * offset, cells)
    sag = along * 0.25 * tilt_square * roll  # R R' tilt^2 ez: at most where half the limit is used up by either
    reserves = 1.0 + (limit / LARGEST_OFFSET) ** 2
    height = sliding_window_view(-radius - sag - reserves * wheel[WHEEL_RESERVE], cells) - reserves * rail[RAIL_RESERVE]
    c0, c1, c2, c3 = rail[:4]
    gaps = np.full((len(height), PARTS, _whole(cells // block)), 1.0)
    for part in range(PARTS):
        low, high = part / PARTS * SCAN_STEP - offset, (part + 1) / PARTS * SCAN_STEP + offset
        # highest point of a cubic over an interval: its ends, and how far it can rise above their chord
        top = np.maximum(*(c0 + d * (c1 + d * (c2 + d * c3)) for d in (low, high)))
        bend = np.maximum(*(np.abs(2.0 * c2 + 6.0 * c3 * d) for d in (low, high)))
        gap = height - top - 0.125 * bend * (high - low) ** 2
        gaps[:, part, : cells // block] = gap.reshape(len(gap), -1, block).min(axis=2)
    return gaps


def zone_planar_errors(wheel, rail, block):
    """Largest penetration, over yaw^2 up to YAW_LIMIT, that planar detection can miss in each block (shift, block)."""
    cells = rail.shape[1]
    missed = YAW_LIMIT**2 * 0.5 * SECOND_BOUND * rail[RAIL_RESERVE] * sliding_window_view(wheel[ALONG] ** 2, cells)
    missed += sliding_window_view(wheel[DOWN_2], cells)
    missed_most = np.zeros((len(missed), _whole(cells // block)))
    missed_most[:, : cells // block] = missed.reshape(len(missed), -1, block).max(axis=2)
    return missed_most


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
    """Scan cells of the rail, padded to whole blocks, where they start, and the size of a block."""
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
