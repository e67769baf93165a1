"""The track's path: its centre line and the moving frame [t n b], as functions of arc length.

The path is divided into pieces on which curvature, cant, height and widening are cubics of the arc length s (straight
line, circle, clothoid, Bloss; a cosine transition is a spline of such pieces). A piece stores its centre line as
polynomials in the distance from the piece's middle. Pieces are so short that the truncation error is below the rounding
error (`wrcore.geometry.path_pieces.LARGEST_TURN`). A point and its tangent cost two Horner schemes, without quadrature
or trigonometric functions.

Conventions
-----------
* s is the arc length of the centre line in space, so dr/ds = t exactly, also where a cant ramp lifts the line.
* heading is the angle of t's projection onto the ground from the x axis, to the left positive; d heading/ds is the
  curvature.
* cant h is the height of the right rail above the left one over `CANT_BASE`: positive in a canted left curve. The
  frame's roll about t is -asin(h / CANT_BASE). The line of constant height is selectable. If it is the lower rail, the
  centre line is raised by |h|/2, so that t and both rails climb in a ramp.
* The corners of linear ramps of cant, height and widening are rounded: each corner is replaced over the path's rounding
  length by a cubic spline. They are C2, t is C1, curvature is continuous. Bloss and cosine ramps have no corners; at
  their ends they are C1. Gradients joined by vertical curves (parabolas) are C2, too.
"""

import math
from typing import NamedTuple

import numpy as np

from wrcore.geometry.path_pieces import CENTRE, COLUMNS, CURVATURE, HEADING, RAISE, ROLL, WIDENING, X, Y, cut
from wrcore.kernels.jit import jit


class PathData(NamedTuple):
    """A path for kernels; a tangent track has no pieces (``pieces.shape[0] == 0``) and x = s."""

    pieces: np.ndarray
    """(n, 34): middle; polynomials of x, y; heading; cubics of curvature, sin(roll), height, widening."""
    starts: np.ndarray
    """(n,): arc length at which each piece begins, m; the first begins at -inf, the last has no end."""
    lookup: np.ndarray
    """(m,) int: piece at the beginning of each cell of a uniform grid."""
    lookup_start: float
    lookup_step: float
    """First arc length and cell length of the grid, m."""
    aside: float
    """Fraction of the widening by which the middle between the rails moves to the left: 0 for equal widening of both
    rails, 1/2 for widening of the left rail only, -1/2 of the right rail only."""
    climbs: bool = True
    """Whether the direction of the rails' lines has the twist of cant ramps."""


class Station(NamedTuple):
    """The centre line at one arc length; derivatives are with respect to s."""

    x: float
    y: float
    z: float
    """Position, m."""
    tx: float
    ty: float
    slope: float
    """Unit tangent t = (tx, ty, slope); slope is dz/ds."""
    level: float
    """Length of (tx, ty): the incline's cosine."""
    slope_rate: float
    """Derivative of slope, 1/m."""
    heading: float
    """Angle of the tangent's ground projection from the x axis, rad, to the left positive."""
    curvature: float
    """d heading/ds, 1/m, positive to the left."""
    curvature_rate: float
    """Derivative of curvature, 1/m^2."""
    sin_roll: float
    cos_roll: float
    roll_rate: float
    """Derivative of roll, 1/m; roll is right-handed about t, so negative in a canted left curve."""
    roll_rate_rate: float
    """Second derivative of roll, 1/m^2."""
    widening: float
    """Gauge widening, m, of both rails together; see `PathData.aside`."""
    widening_rate: float


def tangent_path():
    """Return the PathData of a straight, level path of infinite length."""
    return PathData(np.zeros((0, COLUMNS)), np.zeros(0), np.zeros(0, np.int64), 0.0, 1.0, 0.0)


def path_data(
    knots, curvature, cant, widening, rounding, shapes=None, cant_about="lower_rail", incline=None, aside=0.0,
    climbs=True,
):  # fmt: skip
    """Return the PathData from curvature, cant and widening at arc lengths ``knots``, all (k,).

    Curvature in 1/m, 0 at the first knot; cant in m, right rail higher; widening in m; knots increasing, in m. The path
    is straight before the first knot and constant after the last.

    The k - 1 ``shapes`` are those of `wrcore.geometry.ramps`, linear by default; corners of cant and widening are
    rounded over the length ``rounding`` (m). ``cant_about`` is the line of constant height: "lower_rail", "inner_rail"
    (of the curve) or "centreline". ``incline`` (`wrcore.geometry.ramps.Incline`) is the height without cant, ``aside``
    and ``climbs`` are those of `PathData`."""
    knots = np.asarray(knots, float)
    pieces, borders = cut(knots, curvature, cant, widening, rounding, shapes, cant_about, incline)
    starts = np.concatenate(([-math.inf], borders))
    cells = min(16 * len(pieces), 100_000)
    grid, step = np.linspace(borders[0], borders[-1], cells, endpoint=False, retstep=True)
    lookup = np.searchsorted(starts, grid, side="right") - 1
    return PathData(pieces, starts, lookup, float(borders[0]), float(step), float(aside), bool(climbs))


@jit(inline="always")
def segment_at(path, s):
    """Return the index of the piece that contains arc length s (m); cost is independent of the path's length."""
    if s < path.lookup_start:
        return 0
    cell = min(max(int((s - path.lookup_start) / path.lookup_step), 0), path.lookup.shape[0] - 1)
    i = path.lookup[cell]
    while i + 1 < path.starts.shape[0] and s >= path.starts[i + 1]:
        i += 1
    return i


@jit(inline="always")
def _horner(pieces, i, at, d):
    """Return value and derivative of the polynomial of degree 7 at column ``at`` of piece i.

    Even and odd part are independent, so that the processor evaluates them in parallel.
    """
    a1, a2, a3, a4 = pieces[i, at + 1], pieces[i, at + 2], pieces[i, at + 3], pieces[i, at + 4]
    a5, a6, a7 = pieces[i, at + 5], pieces[i, at + 6], pieces[i, at + 7]
    q = d * d
    even, odd = pieces[i, at] + q * (a2 + q * (a4 + q * a6)), a1 + q * (a3 + q * (a5 + q * a7))
    even_rate, odd_rate = 2.0 * a2 + q * (4.0 * a4 + q * 6.0 * a6), a1 + q * (3.0 * a3 + q * (5.0 * a5 + q * 7.0 * a7))
    return even + d * odd, odd_rate + d * even_rate


@jit(inline="always")
def _cubic(pieces, i, at, d):
    """Return value and two derivatives of the cubic at column ``at`` of piece i."""
    c1, c2, c3 = pieces[i, at + 1], pieces[i, at + 2], pieces[i, at + 3]
    return pieces[i, at] + d * (c1 + d * (c2 + d * c3)), c1 + d * (2.0 * c2 + 3.0 * d * c3), 2.0 * c2 + 6.0 * d * c3


@jit
def _on_last_circle(x, y, tx, ty, curvature, d):
    """Return x, y, tx, ty at distance d (m) along the circle that begins at (x, y) in the direction (tx, ty)."""
    half = 0.5 * curvature * d
    c, s = math.cos(half), math.sin(half)
    chord = d * (s / half if half != 0.0 else 1.0)
    ahead, aside = c * tx - s * ty, s * tx + c * ty
    return x + chord * ahead, y + chord * aside, c * ahead - s * aside, s * ahead + c * aside


@jit(forceinline=True)
def centreline(path, s):
    """Return the Station at arc length s (m).

    Before the path it is straight; after the path curvature, cant, widening and gradient keep their last values.
    """
    if path.pieces.shape[0] == 0:
        return Station(s, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0)
    pieces, i = path.pieces, segment_at(path, s)
    d = s - pieces[i, CENTRE]
    x, tx = _horner(pieces, i, X, d)
    y, ty = _horner(pieces, i, Y, d)
    bend, bend_1 = pieces[i, CURVATURE], pieces[i, CURVATURE + 1]
    bend_2, bend_3 = pieces[i, CURVATURE + 2], pieces[i, CURVATURE + 3]
    if i == pieces.shape[0] - 1 and bend != 0.0:
        x, y, tx, ty = _on_last_circle(pieces[i, X], pieces[i, Y], pieces[i, X + 1], pieces[i, Y + 1], bend, d)
    heading = pieces[i, HEADING] + d * (bend + d * (0.5 * bend_1 + d * (bend_2 / 3.0 + d * (0.25 * bend_3))))
    curvature = bend + d * (bend_1 + d * (bend_2 + d * bend_3))
    curvature_rate = bend_1 + d * (2.0 * bend_2 + 3.0 * bend_3 * d)
    sin_roll, sin_rate, sin_second = _cubic(pieces, i, ROLL, d)
    z, slope, slope_rate = _cubic(pieces, i, RAISE, d)
    widening, widening_rate, _ = _cubic(pieces, i, WIDENING, d)
    cos_roll = math.sqrt(1.0 - sin_roll * sin_roll)
    secant = 1.0 / cos_roll
    roll_rate = sin_rate * secant
    return Station(
        x, y, z, tx, ty, slope, math.sqrt(1.0 - slope * slope), slope_rate, heading, curvature, curvature_rate,
        sin_roll, cos_roll, roll_rate, (sin_second + sin_roll * roll_rate * roll_rate) * secant, widening,
        widening_rate,
    )  # fmt: skip


@jit(forceinline=True)
def track_frame(path, s, matrix):
    """Return the Station at arc length s (m) and fill ``matrix`` (3, 3) with the track's frame A = [t n b], Eq. (3).

    The frame is rolled by the cant about t: columns t forward, n left in the canted plane, b up.
    """
    station = centreline(path, s)
    tx, ty, tz, level = station.tx, station.ty, station.slope, station.level
    inverse = 1.0 / level
    nx, ny = -ty * inverse, tx * inverse
    bx, by = -tz * ny, tz * nx
    c, s = station.cos_roll, station.sin_roll
    matrix[0, 0], matrix[1, 0], matrix[2, 0] = tx, ty, tz
    matrix[0, 1], matrix[1, 1], matrix[2, 1] = c * nx + s * bx, c * ny + s * by, s * level
    matrix[0, 2], matrix[1, 2], matrix[2, 2] = c * bx - s * nx, c * by - s * ny, c * level
    return station


@jit(inline="always")
def frame_turn(station):
    """Return the rotation of the frame per metre of arc length: components (1/m) along t, n, b of the vector D.

    D is defined by dt/ds = D x t, dn/ds = D x n, db/ds = D x b.
    """
    incline_rate = station.slope_rate / station.level
    along = station.roll_rate + station.curvature * station.slope
    upright = station.curvature * station.level
    c, s = station.cos_roll, station.sin_roll
    return along, upright * s - incline_rate * c, upright * c + incline_rate * s


@jit
def rail_direction(station, y, z, dy, dz):
    """Return the slopes of a rail's line towards n and b per advance along t, and this advance per metre of s.

    The rail's origin lies at y n + z b (m); ``dy`` and ``dz`` are derivatives with respect to s. The slopes include the
    twist of a cant ramp. The advance is 1 - curvature y on a level curve.
    """
    along, left, up = frame_turn(station)
    stretch = 1.0 - up * y + left * z
    return (dy - along * z) / stretch, (dz + along * y) / stretch, stretch


@jit
def _newton(path, x, y, z, s):
    """Solve (p - r(s)) . t(s) = 0 for s (m) by Newton's method; NaN if it does not converge."""
    for _ in range(30):
        p = centreline(path, s)
        dx, dy, dz = x - p.x, y - p.y, z - p.z
        ahead = dx * p.tx + dy * p.ty + dz * p.slope
        bend = p.curvature * (p.tx * dy - p.ty * dx)
        lift = p.slope_rate * (dz - p.slope * (p.tx * dx + p.ty * dy) / (p.level * p.level))
        step = ahead / max(1.0 - bend - lift, 0.1)
        s += step
        if not math.isfinite(step):
            break
        if abs(step) < 1e-6:  # quadratic convergence: the error is below curvature * step^2
            return s
    return math.nan


@jit
def _nearest(path, x, y, z):
    """Return the arc length (m) of a point of the path close to (x, y, z), from the tangents of all pieces."""
    best, least = 0.0, math.inf
    n = path.pieces.shape[0]
    for i in range(n):
        row = path.pieces[i]
        low = path.starts[i] if i > 0 else -math.inf
        high = path.starts[i + 1] if i + 1 < n else (low if row[CURVATURE] != 0.0 else math.inf)
        ahead = row[X + 1] * (x - row[X]) + row[Y + 1] * (y - row[Y])
        s = min(max(row[CENTRE] + ahead, low), high)
        p = centreline(path, s)
        distance = (x - p.x) ** 2 + (y - p.y) ** 2 + (z - p.z) ** 2
        if distance < least:
            best, least = s, distance
    return best


@jit
def arc_length_of(path, x, y, z, guess):
    """Return the arc length (m) near ``guess`` whose cross-section contains the point: (p - r(s)) . t(s) = 0.

    The point must be closer to the path than the path's radius. The result is NaN if there is no solution. With a NaN
    ``guess`` the whole path is searched first.
    """
    if path.pieces.shape[0] == 0:
        return x
    s = _newton(path, x, y, z, guess)
    return s if math.isfinite(s) else _newton(path, x, y, z, _nearest(path, x, y, z))
