"""Pieces of a path, on which the centre line is a short power series of the arc length.

Each piece is a row: arc length of its middle, polynomials of x and y, heading in the middle, and cubics of curvature,
sin(roll), height and gauge widening, all in the distance from the middle. See :mod:`wrcore.geometry.path`.
"""

import math

import numpy as np
from numpy.polynomial.polynomial import polyval

from wrcore.geometry.ramps import height, ramps

CANT_BASE = 1.5
"""Distance of the rails' running circles over which cant is stated, m (EN 13803 for standard gauge)."""

LARGEST_TURN = 0.04
"""Largest change of heading within a piece, rad. From the middle it is 0.02, and 0.02^7 / 7! = 3e-16 is the truncation
error."""

CENTRE, X, Y, HEADING, CURVATURE = 0, 1, 9, 17, 18
ROLL, RAISE, WIDENING, COLUMNS = 22, 26, 30, 34
"""Columns of a row at which the polynomials begin."""

CANT_ABOUT = {
    "lower_rail": lambda cant, curvature: 0.5 * np.abs(cant),
    "inner_rail": lambda cant, curvature: 0.5 * np.where(curvature == 0.0, np.abs(cant), cant * np.sign(curvature)),
    "centreline": lambda cant, curvature: np.zeros_like(cant),
}
"""Functions from cant (m, right rail higher) and curvature to the height of the centre line (m), by the line of
constant height."""

_DEGREE = 7


def cut(knots, curvature, cant, widening, rounding, shapes, cant_about, incline):
    """Return the pieces (n + 1, COLUMNS) of a path and the arc lengths (n,) between them, m.

    The first piece is straight and begins at -inf. The arguments are those of :func:`wrcore.geometry.path.path_data`.
    """
    curvature, cant, half = np.asarray(curvature, float), np.asarray(cant, float), 0.5 * rounding
    shapes = ["linear"] * (len(knots) - 1) if shapes is None else shapes
    turn = ramps(knots, curvature, shapes, 0.0)
    raised = CANT_ABOUT[cant_about](cant, curvature)
    others = [
        ramps(knots, -cant / CANT_BASE, shapes, half), height(knots, cant, raised, shapes, half),
        ramps(knots, np.asarray(widening, float), shapes, half),
    ]  # fmt: skip
    climbs = [] if incline is None else [incline]
    breaks = [knots[[0, -1]], *(part.breaks() for part in (turn, *others, *climbs))]
    borders = _divide(np.unique(np.concatenate(breaks)), turn, climbs)
    return _assemble(borders, turn, others, climbs), borders


def _divide(breaks, turn, climbs):
    """Return ``breaks`` with further borders, so that the power series of each piece converges fast.

    The number of pieces follows from the derivatives of heading and incline.
    """
    borders = [breaks[:1]]
    for a, b in zip(breaks[:-1], breaks[1:], strict=True):
        _, rate, second, third = np.abs(turn.taylor(0.5 * (a + b)))
        largest = max(abs(turn.taylor(a)[0]), abs(turn.taylor(b)[0]), rate**0.5, second ** (1.0 / 3.0), third**0.25)
        largest = max([largest, *(2.0 * abs(climb.taylor(0.5 * (a + b))[2]) for climb in climbs)])
        borders.append(np.linspace(a, b, max(1, math.ceil(largest * (b - a) / LARGEST_TURN)) + 1)[1:])
    return np.concatenate(borders)


def _assemble(borders, turn, others, climbs):
    """Return the rows of all pieces: straight before the path, one between each two borders, and one after the path."""
    before = np.zeros(COLUMNS)
    before[RAISE : RAISE + 4] = sum(climb.taylor(borders[0]) for climb in climbs)
    level = math.sqrt(1.0 - before[RAISE + 1] ** 2)
    before[CENTRE], before[X], before[X + 1] = borders[0], level * borders[0], level
    rows, position = [before], complex(before[X])
    for a, b in zip(borders[:-1], borders[1:], strict=True):
        reach = 0.5 * (b - a)
        row = _row(0.5 * (a + b), turn, others, climbs)
        line = _plan_series(row)
        line[0] = position - polyval(-reach, line)
        row[X : X + _DEGREE + 1], row[Y : Y + _DEGREE + 1] = line.real, line.imag
        position = polyval(reach, line)
        rows.append(row)
    after = _row(borders[-1], turn, others, climbs)
    for column in (CURVATURE, ROLL, RAISE, WIDENING):
        after[column + 1 : column + 4] = 0.0
    after[RAISE + 1] = sum(climb.taylor(borders[-1])[1] for climb in climbs)
    level, heading = math.sqrt(1.0 - after[RAISE + 1] ** 2), after[HEADING]
    after[[X, X + 1, Y, Y + 1]] = position.real, level * math.cos(heading), position.imag, level * math.sin(heading)
    return np.array([*rows, after])


def _row(middle, turn, others, climbs):
    """Return the row of a piece without its polynomials of x and y."""
    row = np.zeros(COLUMNS)
    row[CENTRE], row[HEADING] = middle, turn.integral(middle)
    for column, part in zip((CURVATURE, ROLL, RAISE, WIDENING), (turn, *others), strict=True):
        row[column : column + 4] = part.taylor(middle)
    for climb in climbs:
        row[RAISE : RAISE + 4] += climb.taylor(middle)
    return row


def _plan_series(row):
    """Return the power series of x + i y about a piece's middle, without the constant.

    It is the integral of cos(incline) e^(i heading).
    """
    series = np.zeros(_DEGREE, complex)
    series[0] = np.exp(1j * row[HEADING])
    for n in range(_DEGREE - 1):
        series[n + 1] = 1j * sum(row[CURVATURE + k] * series[n - k] for k in range(min(n, 3) + 1)) / (n + 1)
    series = np.convolve(series, _cosine_series(row[RAISE + 1 : RAISE + 4] * np.array([1.0, 2.0, 3.0])))[:_DEGREE]
    return np.concatenate(([0.0], series / np.arange(1, _DEGREE + 1)))


def _cosine_series(slope):
    """Return the power series of sqrt(1 - slope^2) for a polynomial slope, by the recurrence for powers of series."""
    square = np.zeros(_DEGREE)
    square[: 2 * len(slope) - 1] = -np.convolve(slope, slope)
    square[0] += 1.0
    root = np.zeros(_DEGREE)
    root[0] = math.sqrt(square[0])
    for n in range(1, _DEGREE):
        total = sum((0.5 * k - (n - k)) * square[k] * root[n - k] for k in range(1, n + 1))
        root[n] = total / (n * square[0])
    return root
