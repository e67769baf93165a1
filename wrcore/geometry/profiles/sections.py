"""Profile sections: arcs, straight lines and polynomials, evaluated in closed form.

A profile is a tuple of sections in order of increasing u (see ``wrcore`` for the axes). The methods of all sections are
described at `Arc`. Arcs and lines remain arcs and lines when the rail is inclined, so an inclined rail is as exact as
the upright rail.
"""

from dataclasses import dataclass, replace

import numpy as np

_ROUNDING = 1e-15  # m; slack of comparisons between points that coincide in exact arithmetic


@dataclass(frozen=True)
class Arc:
    """Circular arc c + sign R (sin b, cos b), b from ``first`` to ``last`` in the order of increasing u."""

    uc: float
    fc: float
    """Centre, m."""
    radius: float
    first: float
    last: float
    """Angle b of the normal against the vertical at both ends, rad; the slope is -tan(b)."""
    sign: int = 1
    """+1: upper half of the circle (rail head), -1: lower half (flange tip)."""

    @classmethod
    def between(cls, start, end, uc, fc, radius, sign):
        """Return the arc whose ends have the abscissae ``start`` and ``end`` (all lengths in m)."""
        first, last = (float(np.arcsin(np.clip(sign * (u - uc) / radius, -1.0, 1.0))) for u in (start, end))
        return cls(uc, fc, radius, first, last, sign)

    def point(self, angle):
        """Return the point (u, f), m, at the normal angle ``angle`` (rad)."""
        reach = self.sign * self.radius
        return self.uc + reach * np.sin(angle), self.fc + reach * np.cos(angle)

    @property
    def ends(self):
        """First and last point, ((u, f), (u, f)) in m."""
        return self.point(self.first), self.point(self.last)

    def evaluate(self, u):
        """Return ordinate (m) and slope at the abscissae ``u`` (m)."""
        off = u - self.uc
        height = np.sqrt((self.radius - off) * (self.radius + off))
        return self.fc + self.sign * height, -self.sign * off / height

    def rotated(self, angle):
        """Return the arc rotated counter-clockwise about (0, 0) by ``angle`` (rad)."""
        uc, fc = _rotate(self.uc, self.fc, angle)
        return replace(self, uc=uc, fc=fc, first=self.first - angle, last=self.last - angle)

    def shifted(self, du, df):
        """Return the arc moved by (``du``, ``df``), m."""
        return replace(self, uc=self.uc + du, fc=self.fc + df)

    def _holds(self, angle):
        low, high = sorted((self.first, self.last))
        return low <= angle <= high

    def highest(self):
        """Return the highest point (u, f), m."""
        if self.sign > 0 and self._holds(0.0):
            return self.uc, self.fc + self.radius
        return max(self.ends, key=lambda p: p[1])

    def span(self, steepest):
        """Return the range of u (m) in which the slope does not exceed ``steepest``, or None."""
        limit = np.arctan(steepest)
        first, last = np.clip((self.first, self.last), -limit, limit)
        return None if first == last else (float(self.point(first)[0]), float(self.point(last)[0]))

    def leftmost(self, level):
        """Return candidates (u, f), m, for the leftmost point that is not below the ordinate ``level`` (m)."""
        cosine = np.clip(self.sign * (level - self.fc) / self.radius, -1.0, 1.0)
        angles = [self.first, self.last]
        angles += [b for b in (np.arccos(cosine), -np.arccos(cosine), -self.sign * np.pi / 2) if self._holds(b)]
        return [self.point(b) for b in angles]


@dataclass(frozen=True)
class Line:
    """Straight line from (``u0``, ``f0``) to (``u1``, ``f1``), m; may be steep or vertical."""

    u0: float
    f0: float
    u1: float
    f1: float

    @property
    def ends(self):
        return (self.u0, self.f0), (self.u1, self.f1)

    def evaluate(self, u):
        slope = (self.f1 - self.f0) / (self.u1 - self.u0)
        return self.f0 + slope * (u - self.u0), np.full_like(u, slope)

    def rotated(self, angle):
        return Line(*_rotate(self.u0, self.f0, angle), *_rotate(self.u1, self.f1, angle))

    def shifted(self, du, df):
        return Line(self.u0 + du, self.f0 + df, self.u1 + du, self.f1 + df)

    def highest(self):
        return max(self.ends, key=lambda p: p[1])

    def span(self, steepest):
        run, rise = self.u1 - self.u0, abs(self.f1 - self.f0)
        return (self.u0, self.u1) if run > 0.0 and rise <= steepest * run else None

    def leftmost(self, level):
        points = list(self.ends)
        if min(self.f0, self.f1) < level < max(self.f0, self.f1):
            points.append((self.u0 + (level - self.f0) / (self.f1 - self.f0) * (self.u1 - self.u0), level))
        return points


@dataclass(frozen=True)
class Polynomial:
    """Polynomial f = scale * sum c_k (u / scale)^k from ``u0`` to ``u1`` (m), ``coefficients`` in ascending order.

    ``scale`` (m) is the unit in which they are published. Polynomials are for wheels only: they cannot be rotated.
    """

    u0: float
    u1: float
    coefficients: tuple
    scale: float = 1e-3

    def evaluate(self, u):
        """Return ordinate (m) and slope at the abscissae ``u`` (m), by Horner's rule."""
        t = u / self.scale
        value, slope = np.zeros_like(t), np.zeros_like(t)
        for c in reversed(self.coefficients):
            slope = slope * t + value
            value = value * t + c
        return value * self.scale, slope

    @property
    def ends(self):
        u = np.array([self.u0, self.u1])
        f = self.evaluate(u)[0]
        return (self.u0, float(f[0])), (self.u1, float(f[1]))

    def span(self, steepest):
        """Return the range of u (m); ``steepest`` has no effect, as published polynomial sections are not steep."""
        return self.u0, self.u1


def _rotate(u, f, angle):
    c, s = np.cos(angle), np.sin(angle)
    return u * c - f * s, u * s + f * c


def incline(sections, inclination):
    """Return the sections of an upright rail rotated by atan(inclination), top towards the gauge side (-u).

    The origin is moved to the highest point of the inclined rail.
    """
    turned = [s.rotated(np.arctan(inclination)) for s in sections]
    u, f = max((s.highest() for s in turned), key=lambda p: p[1])
    return tuple(s.shifted(-u, -f) for s in turned)


def usable_span(sections, steepest):
    """Return the connected range of u around 0 (low, high, m) without slopes above ``steepest``, and its sections."""
    spans = [s.span(steepest) for s in sections]
    home = next(i for i, s in enumerate(spans) if s is not None and s[0] <= 0.0 <= s[1])
    first = last = home
    while first > 0 and _joined(spans[first - 1], spans[first], sections[first - 1].ends[1][0]):
        first -= 1
    while last + 1 < len(spans) and _joined(spans[last], spans[last + 1], sections[last].ends[1][0]):
        last += 1
    return spans[first][0], spans[last][1], tuple(sections[first : last + 1])


def _joined(left, right, border):
    """Whether both spans (None: no span) reach the border between their sections."""
    if left is None or right is None:
        return False
    return abs(left[1] - border) < 1e-9 and abs(right[0] - border) < 1e-9


def evaluate(sections, u):
    """Return ordinate (m) and slope of a profile at the abscissae ``u`` (m, array inside the sections' range)."""
    f, df = np.empty_like(u), np.empty_like(u)
    index = np.searchsorted([s.ends[0][0] for s in sections[1:]], u, side="right")
    for i, section in enumerate(sections):
        here = index == i
        f[here], df[here] = section.evaluate(u[here])
    return f, df


def innermost(sections, depth):
    """Return the abscissa (m) of the leftmost point at most ``depth`` (m) below the ordinate 0.

    The result is NaN if the sections end above that depth on the gauge side.
    """
    level = -depth
    if min(s.ends[0][1] for s in sections if s.ends[0][0] < 0.0) > level:
        return float("nan")
    points = [p for s in sections for p in s.leftmost(level) if p[1] >= level - _ROUNDING]
    return float(min(u for u, _ in points))
