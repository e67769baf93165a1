"""The pieces of a path: stretches on which the centre line is a short power series of the arc length.

Each piece is a row: its middle, polynomials of x and y, heading, curvature and its rate in the middle, and cubics of
sin(roll), raise and gauge widening, all in the distance from the middle. See :mod:`wrcore.geometry.path`.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.polynomial.polynomial import polyval

CANT_BASE = 1.5
"""Distance of the rails' running circles over which cant is stated, m (EN 13803 for standard gauge)."""

LARGEST_TURN = 0.04
"""Largest change of heading within a piece, rad; from its middle 0.02, and 0.02^7 / 7! = 3e-16."""

CENTRE, X, Y, HEADING, CURVATURE, CURVATURE_RATE = 0, 1, 9, 17, 18, 19
ROLL, RAISE, WIDENING, COLUMNS = 20, 24, 28, 32
"""Columns of a row at which its parts begin."""

_DEGREE = 7


def cut(knots, curvature, cant, widening, rounding):
    """Cut a path into pieces; the arguments are those of :func:`wrcore.geometry.path.path_data`.

    Returns
    -------
    pieces : (n + 1, COLUMNS) ndarray
        The first is straight and reaches back without end, the last keeps curvature, cant and widening.
    borders : (n,) ndarray
        Arc lengths between the pieces, m.
    """
    turn = _Broken(knots, np.asarray(curvature, float))
    cant = np.asarray(cant, float)
    ramps = [_Broken(knots, -cant / CANT_BASE), _raise(knots, cant), _Broken(knots, np.asarray(widening, float))]
    half = 0.5 * rounding
    breaks = [knots[[0, -1]], turn.corners()[0]]
    breaks += [ramp.corners()[0] + shift for ramp in ramps for shift in (-half, 0.0, half)]
    borders = _divide(np.unique(np.concatenate(breaks)), turn)
    return _assemble(borders, turn, ramps, half), borders


class _Broken(NamedTuple):
    """A piecewise linear function, constant outside its knots."""

    knots: np.ndarray
    values: np.ndarray

    def slopes(self):
        """Slope before each knot and after the last, (k + 1,)."""
        return np.concatenate(([0.0], np.diff(self.values) / np.diff(self.knots), [0.0]))

    def corners(self):
        """Arc lengths and slope jumps of the corners."""
        jumps = np.diff(self.slopes())
        real = np.abs(jumps) > 1e-15
        return self.knots[real], jumps[real]

    def line(self, s):
        """Value at s and slope of the straight part around s."""
        return np.interp(s, self.knots, self.values), self.slopes()[np.searchsorted(self.knots, s)]

    def integral(self, s):
        """Integral from the first knot to s."""
        i = max(np.searchsorted(self.knots, s) - 1, 0)
        means = 0.5 * (self.values[1:] + self.values[:-1])
        rest = 0.5 * (self.values[i] + self.line(s)[0]) * (s - self.knots[i])
        return np.dot(means[:i], np.diff(self.knots)[:i]) + rest

    def rounded(self, s, half):
        """Taylor coefficients (4,) about s of the function whose corners are rounded over +-half."""
        at, jumps = self.corners()
        near = np.abs(at - s) < half
        if not near.any():
            return np.array([*self.line(s), 0.0, 0.0])
        first = at[near][0]
        slope = self.slopes()[np.searchsorted(self.knots, first)]
        coefficients = np.array([np.interp(first, self.knots, self.values) + slope * (s - first), slope, 0.0, 0.0])
        for corner, jump in zip(at[near], jumps[near], strict=True):
            coefficients += jump * _rounded_ramp(s - corner, half)
        return coefficients


def _rounded_ramp(x, half):
    """Taylor coefficients of max(x, 0), rounded over +-half (its mean weighted by a hat function)."""
    r = half - abs(x)
    sign = -1.0 if x > 0.0 else 1.0
    cubic = np.array([r**3, sign * 3.0 * r**2, 3.0 * r, sign]) / (6.0 * half**2)
    return cubic + (np.array([x, 1.0, 0.0, 0.0]) if x > 0.0 else 0.0)


def _raise(knots, cant):
    """Height of the centre line, |cant| / 2: with a knot of its own where the cant changes sign."""
    i = np.flatnonzero(cant[:-1] * cant[1:] < 0.0)
    zeros = knots[i] + np.diff(knots)[i] * cant[i] / (cant[i] - cant[i + 1])
    order = np.argsort(np.concatenate((knots, zeros)))
    values = np.concatenate((0.5 * np.abs(cant), np.zeros(len(i))))
    return _Broken(np.concatenate((knots, zeros))[order], values[order])


def _divide(breaks, turn):
    """Insert borders so that neither curvature nor its rate makes the series of a piece converge slowly."""
    borders = [breaks[:1]]
    for a, b in zip(breaks[:-1], breaks[1:], strict=True):
        largest = max(abs(turn.line(a)[0]), abs(turn.line(b)[0]), abs(turn.line(0.5 * (a + b))[1]) ** 0.5)
        borders.append(np.linspace(a, b, max(1, math.ceil(largest * (b - a) / LARGEST_TURN)) + 1)[1:])
    return np.concatenate(borders)


def _assemble(borders, turn, ramps, half):
    """Rows of all pieces: straight before the path, each stretch between two borders, and what follows the path."""
    before = np.zeros(COLUMNS)
    before[CENTRE] = before[X] = borders[0]
    before[X + 1] = 1.0
    rows, position = [before], complex(borders[0])
    for a, b in zip(borders[:-1], borders[1:], strict=True):
        middle, reach = 0.5 * (a + b), 0.5 * (b - a)
        curvature, rate = turn.line(middle)
        row = _row(middle, turn.integral(middle), curvature, rate, ramps, half)
        line = _plan_series(row)
        line[0] = position - polyval(-reach, line)
        row[X : X + _DEGREE + 1], row[Y : Y + _DEGREE + 1] = line.real, line.imag
        position = polyval(reach, line)
        rows.append(row)
    heading = turn.integral(borders[-1])
    after = _row(borders[-1], heading, turn.values[-1], 0.0, ramps, half)
    for column in (ROLL, RAISE, WIDENING):
        after[column + 1 : column + 4] = 0.0
    after[[X, X + 1, Y, Y + 1]] = position.real, math.cos(heading), position.imag, math.sin(heading)
    return np.array([*rows, after])


def _row(middle, heading, curvature, rate, ramps, half):
    """Row of a piece without its polynomials of x and y."""
    row = np.zeros(COLUMNS)
    row[[CENTRE, HEADING, CURVATURE, CURVATURE_RATE]] = middle, heading, curvature, rate
    for column, ramp in zip((ROLL, RAISE, WIDENING), ramps, strict=True):
        row[column : column + 4] = ramp.rounded(middle, half)
    return row


def _plan_series(row):
    """Power series of x + i y about a piece's middle, up to the constant: integral of cos(incline) e^(i heading)."""
    series = np.zeros(_DEGREE, complex)
    series[0] = np.exp(1j * row[HEADING])
    for n in range(_DEGREE - 1):
        before = series[n - 1] if n else 0.0
        series[n + 1] = 1j * (row[CURVATURE] * series[n] + row[CURVATURE_RATE] * before) / (n + 1)
    series = np.convolve(series, _cosine_series(row[RAISE + 1 : RAISE + 4] * np.array([1.0, 2.0, 3.0])))[:_DEGREE]
    return np.concatenate(([0.0], series / np.arange(1, _DEGREE + 1)))


def _cosine_series(slope):
    """Power series of sqrt(1 - slope^2) for a polynomial slope, by the recurrence for powers of a series."""
    square = np.zeros(_DEGREE)
    square[: 2 * len(slope) - 1] = -np.convolve(slope, slope)
    square[0] += 1.0
    root = np.zeros(_DEGREE)
    root[0] = math.sqrt(square[0])
    for n in range(1, _DEGREE):
        total = sum((0.5 * k - (n - k)) * square[k] * root[n - k] for k in range(1, n + 1))
        root[n] = total / (n * square[0])
    return root
