"""Out-of-round wheels: flats, polygons and measured deviations of a wheel's radius over its angle.

The deviation is constant over the wheel's width. Angles are defined in
`wrcore.geometry.changing_rails.slices.WheelSlices`."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from wrcore.geometry.changing_rails.slices import TURN

FLAT_MARGIN = 0.01
"""Length beyond either end of a flat at which it still affects the contact section, m: more than half a window of
`wrcore.contact.changing_rails.sections`."""


def whole_turn(step, pad, low=0.0):
    """Return first angle (rad), step (rad) and number of nodes of a whole turn from ``low`` (rad) on.

    The nodes are at most a ``step`` (rad) apart; ``pad`` nodes are added at either end.
    """
    count = math.ceil(TURN / step)
    step = TURN / count
    return low - pad * step, step, count + 2 * pad + 1


@dataclass(frozen=True)
class Flat:
    """A wheel flat: without a depth a fresh flat, a chord of the wheel's circle; with a depth its ends are rounded."""

    length: float
    depth: float | None = None  # m
    at: float = 0.0  # angle of its middle, rad

    def half_angle(self, radius):
        """Return half of the flat's angle (rad) on a wheel with a radius (m)."""
        return math.asin(0.5 * self.length / radius)

    def deviation(self, angles, radius):
        """Return the deviation of the wheel's radius at angles (rad), m; for a rounded flat -d/2 (1 + cos(2 pi x/L)).

        ``radius`` is that of the round wheel, m.
        """
        half, angle = self.half_angle(radius), np.remainder(angles - self.at + math.pi, TURN) - math.pi
        inside = np.clip(angle, -half, half)
        if self.depth is None:
            return radius * (math.cos(half) / np.cos(inside) - 1.0)
        return -0.5 * self.depth * (1.0 + np.cos(math.pi * inside / half))


@dataclass(frozen=True)
class Wave:
    """A wave of a polygonal wheel; a wave of order 1 is an eccentricity."""

    order: int
    amplitude: float  # m
    phase: float = 0.0  # angle of a crest, rad

    def deviation(self, angles, radius):
        """Return the deviation of the wheel's radius at angles (rad), m; ``radius`` has no effect."""
        return self.amplitude * np.cos(self.order * (angles - self.phase))


@dataclass(frozen=True, eq=False)
class Measured:
    """A periodic spline through measured deviations (m) at increasing angles (rad) within a turn."""

    angles: np.ndarray
    deviations: np.ndarray

    @property
    def order(self):
        """Order of the shortest well-resolved wave."""
        return 0.125 * self.angles.size

    @cached_property
    def _spline(self):
        from scipy.interpolate import CubicSpline

        once = np.append(self.angles, self.angles[0] + TURN), np.append(self.deviations, self.deviations[0])
        return CubicSpline(*once, bc_type="periodic")

    def deviation(self, angles, radius):
        """Return the deviation of the wheel's radius at angles (rad), m; ``radius`` has no effect."""
        return self._spline(angles)


@dataclass(frozen=True, eq=False)
class OutOfRound:
    """The shape of a wheel: a circle and the sum of deviations from it."""

    radius: float  # at the tape circle, m
    flats: tuple
    waves: tuple = ()
    """Deviations, each a `Wave` or `Measured`."""
    level = True
    """Whether contact patches stay level under this wheel."""

    def deviation(self, angles):
        """Return the difference of the wheel's radius from that of its circle at angles (rad), m."""
        return sum(part.deviation(angles, self.radius) for part in (*self.flats, *self.waves))

    @property
    def shortest(self):
        """Length of the shortest flat or wave, m."""
        return min([flat.length for flat in self.flats] + [TURN * self.radius / wave.order for wave in self.waves])

    def nodes(self, step, pad):
        """Return first angle (rad), step (rad) and number of nodes that cover all deviations.

        The nodes are at most a ``step`` (m) apart, half a step if there are only flats; ``pad`` nodes are added at
        either end.
        """
        step *= (1.0 if self.waves else 0.5) / self.radius
        reaches = [flat.half_angle(self.radius) + FLAT_MARGIN / self.radius for flat in self.flats]
        low = min((flat.at - reach for flat, reach in zip(self.flats, reaches, strict=True)), default=0.0)
        high = max((flat.at + reach for flat, reach in zip(self.flats, reaches, strict=True)), default=0.0)
        count = math.ceil((high - low) / step)
        if self.waves or (count + 2 * pad) * step > TURN:
            return whole_turn(step, pad, low)
        return low - pad * step, step, count + 2 * pad + 1

    def reach(self, radii, turned, x):
        """Return the depth (n, m), m, by which the wheel reaches below circles of the given ``radii`` (m,), m.

        ``x`` (n,) are distances ahead of the axle, m; ``turned`` is the wheel's forward rotation, rad.
        """
        x = x[:, None]
        long = radii + np.zeros_like(x)
        for _ in range(4):  # each iteration reduces the error at least a hundredfold
            long = radii + self.deviation(turned + np.arcsin(x / long))
        return np.sqrt(long**2 - x**2) - np.sqrt(radii**2 - x**2)
