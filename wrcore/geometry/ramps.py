"""Curvature, cant, height and widening along a path, as piecewise cubics.

A quantity changes from one knot's value to the next in one of three shapes over u = 0 to 1:

    linear   u                     curvature: a clothoid
    bloss    3 u^2 - 2 u^3         the cubic Hermite blend of its ends
    cosine   (1 - cos pi u)/2      as a C2 cubic spline of `COSINE_CELLS` cells, within 3e-9 of the change

Corners between linear ramps are rounded: the function is replaced by its moving mean with a hat function of the
rounding length as weight. The other shapes begin and end with zero slope, without a corner; by their definitions the
second derivative jumps there.

References
----------
EN 13803, Track alignment design parameters, annex on transition curves (clothoid, Bloss, cosine).
"""

import math
from functools import cache
from typing import NamedTuple

import numpy as np

STEEPEST = {"linear": 1.0, "bloss": 1.5, "cosine": 0.5 * math.pi}
"""Shapes, with the ratio of their largest to their mean slope."""

COSINE_CELLS = 128


@cache
def blend(shape):
    """Return the piecewise cubic (`scipy.interpolate.PPoly`) from 0 to 1 over 0 to 1 of a nonlinear shape."""
    from scipy.interpolate import CubicHermiteSpline, CubicSpline  # not needed where ramps are linear

    if shape == "bloss":
        return CubicHermiteSpline([0.0, 1.0], [0.0, 1.0], [0.0, 0.0])
    u = np.linspace(0.0, 1.0, COSINE_CELLS + 1)
    return CubicSpline(u, 0.5 - 0.5 * np.cos(math.pi * u), bc_type="clamped")


class Broken(NamedTuple):
    """A piecewise linear function, constant outside its knots."""

    knots: np.ndarray
    values: np.ndarray

    def slopes(self):
        """Return the slopes (k + 1,) before each knot and after the last."""
        return np.concatenate(([0.0], np.diff(self.values) / np.diff(self.knots), [0.0]))

    def corners(self):
        """Return arc lengths (m) and slope jumps of the corners."""
        jumps = np.diff(self.slopes())
        real = np.abs(jumps) > 1e-15
        return self.knots[real], jumps[real]

    def line(self, s):
        """Return the value at s (m) and the slope of the straight part around s."""
        return np.interp(s, self.knots, self.values), self.slopes()[np.searchsorted(self.knots, s)]

    def integral(self, s):
        """Return the integral from the first knot to s (m)."""
        i = max(np.searchsorted(self.knots, s) - 1, 0)
        means = 0.5 * (self.values[1:] + self.values[:-1])
        rest = 0.5 * (self.values[i] + self.line(s)[0]) * (s - self.knots[i])
        return np.dot(means[:i], np.diff(self.knots)[:i]) + rest

    def taylor(self, s, half):
        """Return the Taylor coefficients (4,) about s (m) of the function with corners rounded over ±half (m)."""
        at, jumps = self.corners()
        near = np.abs(at - s) < half
        if not near.any():
            return np.array([*self.line(s), 0.0, 0.0])
        first = at[near][0]
        slope = self.slopes()[np.searchsorted(self.knots, first)]
        coefficients = np.array([np.interp(first, self.knots, self.values) + slope * (s - first), slope, 0.0, 0.0])
        for corner, jump in zip(at[near], jumps[near], strict=True):
            coefficients += jump * rounded_ramp(s - corner, half)
        return coefficients


def rounded_ramp(x, half):
    """Return the Taylor coefficients of max(x, 0), rounded over ±half (moving mean weighted by a hat function)."""
    return _rounding(x, half) + (np.array([x, 1.0, 0.0, 0.0]) if x > 0.0 else 0.0)


def _rounding(x, half):
    """Return the Taylor coefficients (4,) of the difference that rounding makes to max(x, 0), within ±half."""
    r = half - abs(x)
    sign = -1.0 if x > 0.0 else 1.0
    return np.array([r**3, sign * 3.0 * r**2, 3.0 * r, sign]) / (6.0 * half**2)


class Change(NamedTuple):
    """Change of a quantity over one segment in a nonlinear shape.

    It is ``size`` times the shape before ``crossing`` and ends at ``total`` with ``size_after`` times the shape after
    it. At the crossing, where the cant changes sign, the height has a fold, which is rounded like a corner.
    """

    start: float
    length: float
    shape: str
    size: float
    total: float
    crossing: float = math.inf
    size_after: float = 0.0

    def breaks(self, half):
        """Return the arc lengths (m) between which the quantity is one cubic."""
        fold = self.crossing + half * np.array([-1.0, 0.0, 1.0])
        return np.concatenate((self.start + self.length * blend(self.shape).x, fold[np.isfinite(fold)]))

    def taylor(self, s, half):
        """Return the Taylor coefficients (4,) about s (m)."""
        u = (s - self.start) / self.length
        if u <= 0.0:
            found = np.zeros(4)
        elif u >= 1.0:
            found = np.array([self.total, 0.0, 0.0, 0.0])
        else:
            found = np.array([blend(self.shape)(u, n) / (self.length**n * math.factorial(n)) for n in range(4)])
            found = self.size * found if s < self.crossing else self.size_after * (found - np.eye(4)[0])
            found[0] += self.total if s >= self.crossing else 0.0
        if abs(s - self.crossing) < half:
            steepness = blend(self.shape)((self.crossing - self.start) / self.length, 1) / self.length
            found += (self.size_after - self.size) * steepness * _rounding(s - self.crossing, half)
        return found

    def integral(self, s):
        """Return the integral up to s (m) of a change without a fold."""
        u = (s - self.start) / self.length
        inner = float(blend(self.shape).antiderivative()(min(max(u, 0.0), 1.0)))
        return self.size * self.length * (inner + max(u - 1.0, 0.0))


class Ramps(NamedTuple):
    """A quantity along the path: linear ramps with corners rounded over ±half (m), and nonlinear changes."""

    linear: Broken
    changes: tuple
    half: float

    def breaks(self):
        """Return the arc lengths (m) between which the quantity is one cubic."""
        corners = [self.linear.corners()[0] + shift for shift in (-self.half, 0.0, self.half)]
        return np.concatenate([*corners, *(change.breaks(self.half) for change in self.changes)])

    def taylor(self, s):
        """Return the Taylor coefficients (4,) about s (m)."""
        return sum((change.taylor(s, self.half) for change in self.changes), self.linear.taylor(s, self.half))

    def integral(self, s):
        """Return the integral from the first knot to s (m)."""
        return sum((change.integral(s) for change in self.changes), self.linear.integral(s))


def ramps(knots, values, shapes, half):
    """Return the Ramps between values at knots, both (k,), with the k - 1 ``shapes`` of `STEEPEST`.

    ``half`` is half the rounding length of corners (m); with 0 they are not rounded.
    """
    changes = [
        Change(knots[i], knots[i + 1] - knots[i], shapes[i], size, size)
        for i, size in enumerate(np.diff(values))
        if shapes[i] != "linear" and size != 0.0
    ]
    return Ramps(Broken(knots, values - _others(values, shapes)), tuple(changes), half)


def height(knots, cant, raised, shapes, half):
    """Return the Ramps of the centre line's height from its values ``raised`` (k,) at the knots, m.

    Between the knots the height changes with the cant. If the cant changes sign, the height is zero there, because the
    rail of constant height changes.
    """
    shapes = list(shapes)
    crossed = cant[:-1] * cant[1:] < 0.0
    linear = np.array([shape == "linear" for shape in shapes])
    i = np.flatnonzero(crossed & linear)
    zeros = knots[i] + np.diff(knots)[i] * cant[i] / (cant[i] - cant[i + 1])
    order = np.argsort(np.concatenate((knots, zeros)))
    others = _others(raised, shapes)
    values = np.concatenate((raised - others, -others[i]))[order]
    plain = ramps(knots, raised, shapes, half).changes
    changes = tuple(_folded(change, knots, cant, raised) for change in plain)
    changes += tuple(
        _fold(k, knots, cant, raised, shapes[k])
        for k in np.flatnonzero(crossed & ~linear & (np.diff(raised) == 0.0) & (raised[1:] != 0.0))
    )
    return Ramps(Broken(np.concatenate((knots, zeros))[order], values), changes, half)


def _folded(change, knots, cant, raised):
    """Return a change of height, with a fold if the cant changes sign in its segment."""
    k = int(np.searchsorted(knots, change.start, side="right")) - 1
    return _fold(k, knots, cant, raised, change.shape) if cant[k] * cant[k + 1] < 0.0 else change


def _fold(k, knots, cant, raised, shape):
    """Return the change of height in segment k, in which the cant changes sign."""
    from scipy.optimize import brentq

    length, change = knots[k + 1] - knots[k], cant[k + 1] - cant[k]
    u = brentq(lambda u: cant[k] + change * blend(shape)(u), 0.0, 1.0, xtol=1e-15)
    before, after = raised[k] / cant[k] * change, raised[k + 1] / cant[k + 1] * change
    return Change(knots[k], length, shape, before, raised[k + 1] - raised[k], knots[k] + u * length, after)


def _others(values, shapes):
    """Return the accumulated changes (k,) of the nonlinear shapes at the knots."""
    steps = np.where([shape == "linear" for shape in shapes], 0.0, np.diff(values))
    return np.concatenate(([0.0], np.cumsum(steps)))


class Incline(NamedTuple):
    """Height along gradients with vertical curves: dz/ds is piecewise linear, with corners rounded over ±half (m).

    A vertical curve is a parabola, or a circle approximated by short linear parts of dz/ds.
    """

    slope: Broken
    half: float

    def breaks(self):
        """Return the arc lengths (m) between which the height is one cubic."""
        at = self.slope.corners()[0]
        return np.concatenate((at - self.half, at + self.half))

    def taylor(self, s):
        """Return the Taylor coefficients (4,) of the height about s (m); the first gradient passes 0 at s = 0."""
        first = self.slope.values[0]
        found = np.array([first * s, first, 0.0, 0.0])
        for corner, jump in zip(*self.slope.corners(), strict=True):
            x = s - corner
            r = x + self.half
            if r > 2.0 * self.half:
                found += jump * np.array([0.5 * x * x + self.half**2 / 6.0, x, 0.5, 0.0])
            elif r > 0.0:
                found += jump * np.array([r**3, 3.0 * r**2, 3.0 * r, 1.0]) / (12.0 * self.half)
        return found


LARGEST_CHORD = 1e-3
"""Largest change of incline, rad, over which dz/ds of a circular vertical curve is linear. The relative error of its
curvature is half of this times the slope."""


def incline(lengths, gradients, radii, half, circles=()):
    """Return the Incline along n gradients and the ends (k, 2) of the vertical curves, m.

    ``gradients`` are rise over horizontal distance, each over its arc length in ``lengths`` (m); the first begins at 0,
    the last has no end. Vertical curves of ``radii`` (m) extend by equal lengths to either side of a change; they are
    circles if the entry of ``circles`` (n,) is true, else parabolas. ``half`` is half the rounding length, m.
    """
    angles = np.arctan(np.asarray(gradients, float))
    slopes, changes = np.sin(angles), np.cumsum(np.asarray(lengths, float)[:-1])
    knots, values, ends = [], [], []
    for i, (at, radius) in enumerate(zip(changes, radii[1:], strict=True)):
        circular = bool(len(circles)) and circles[i + 1]
        turn = angles[i + 1] - angles[i] if circular else slopes[i + 1] - slopes[i]
        if turn == 0.0:
            continue
        count = math.ceil(abs(turn) / LARGEST_CHORD) if circular else 1
        u = np.linspace(0.0, 1.0, count + 1)[1:-1]
        ends.append((at - 0.5 * radius * abs(turn), at + 0.5 * radius * abs(turn)))
        knots += [ends[-1][0], *(at + (u - 0.5) * radius * abs(turn)), ends[-1][1]]
        values += [slopes[i], *np.sin(angles[i] + u * turn), slopes[i + 1]]
    line = Broken(np.array(knots), np.array(values)) if knots else Broken(np.array([0.0, 1.0]), np.full(2, slopes[0]))
    return Incline(line, half), np.array(ends).reshape(-1, 2)
