"""Wheels out of round: flats, polygons and measured deviations of a wheel's radius over its angle.

The deviation is the same over the wheel's width. Angles count as in
`wrcore.geometry.changing_rails.slices.WheelSlices`."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from wrcore.geometry.changing_rails.slices import TURN

FLAT_MARGIN = 0.01
"""Length beside a flat over which a wheel sees it yet, m: more than half a window of
`wrcore.contact.changing_rails.sections`."""


def whole_turn(step, pad, low=0.0):
    """First angle (rad), step and number of nodes all round, a ``step`` (rad) apart at most, from ``low`` and ``pad``
    before it on, to ``pad`` behind it."""
    count = math.ceil(TURN / step)
    step = TURN / count
    return low - pad * step, step, count + 2 * pad + 1


@dataclass(frozen=True)
class Flat:
    """A flat: without a depth a fresh one, a chord of the wheel's circle; with one its ends are rounded."""

    length: float
    depth: float | None = None  # m
    at: float = 0.0  # angle of its middle, rad

    def half_angle(self, radius):
        """Half of the angle (rad) that it takes of a wheel with a radius (m)."""
        return math.asin(0.5 * self.length / radius)

    def deviation(self, angles, radius):
        """What a wheel's radius (m) is longer at angles (rad), m: of a rounded flat -d/2 (1 + cos(2 pi x/L))."""
        half, angle = self.half_angle(radius), np.remainder(angles - self.at + math.pi, TURN) - math.pi
        inside = np.clip(angle, -half, half)
        if self.depth is None:
            return radius * (math.cos(half) / np.cos(inside) - 1.0)
        return -0.5 * self.depth * (1.0 + np.cos(math.pi * inside / half))


@dataclass(frozen=True)
class Wave:
    """A wave of a polygonal wheel; one of the order 1 is an eccentricity."""

    order: int
    amplitude: float  # m
    phase: float = 0.0  # angle of a crest, rad

    def deviation(self, angles, radius):
        """As that of a `Flat`."""
        return self.amplitude * np.cos(self.order * (angles - self.phase))


@dataclass(frozen=True, eq=False)
class Measured:
    """A periodic spline through deviations (m) at angles (rad) that increase, within a turn."""

    angles: np.ndarray
    deviations: np.ndarray

    @property
    def order(self):
        """Of the shortest wave that it resolves well."""
        return 0.125 * self.angles.size

    @cached_property
    def _spline(self):
        from scipy.interpolate import CubicSpline

        once = np.append(self.angles, self.angles[0] + TURN), np.append(self.deviations, self.deviations[0])
        return CubicSpline(*once, bc_type="periodic")

    def deviation(self, angles, radius):
        """As that of a `Flat`."""
        return self._spline(angles)


@dataclass(frozen=True, eq=False)
class OutOfRound:
    """The shape of a wheel: its circle, and deviations from it that add up."""

    radius: float  # at the tape circle, m
    flats: tuple
    waves: tuple = ()
    """Each a `Wave` or `Measured`."""
    level = True
    """Whether patches stay level under it."""

    def deviation(self, angles):
        """What its radius is longer at angles (rad) than that of the circle, m."""
        return sum(part.deviation(angles, self.radius) for part in (*self.flats, *self.waves))

    @property
    def shortest(self):
        """Length (m) of its shortest flat or wave."""
        return min([flat.length for flat in self.flats] + [TURN * self.radius / wave.order for wave in self.waves])

    def nodes(self, step, pad):
        """First angle (rad), step and number of nodes, a ``step`` (m) apart at most, half of it where only flats are
        not round: all of it, and ``pad`` more at either end."""
        step *= (1.0 if self.waves else 0.5) / self.radius
        reaches = [flat.half_angle(self.radius) + FLAT_MARGIN / self.radius for flat in self.flats]
        low = min((flat.at - reach for flat, reach in zip(self.flats, reaches, strict=True)), default=0.0)
        high = max((flat.at + reach for flat, reach in zip(self.flats, reaches, strict=True)), default=0.0)
        count = math.ceil((high - low) / step)
        if self.waves or (count + 2 * pad) * step > TURN:
            return whole_turn(step, pad, low)
        return low - pad * step, step, count + 2 * pad + 1

    def reach(self, radii, turned, x):
        """How much further down than circles of radii (m,) it reaches at stations (n,) ahead of its axle, (n, m), m,
        ``turned`` forward by an angle (rad)."""
        x = x[:, None]
        long = radii + np.zeros_like(x)
        for _ in range(4):  # each step leaves a hundredth at most of the one before
            long = radii + self.deviation(turned + np.arcsin(x / long))
        return np.sqrt(long**2 - x**2) - np.sqrt(radii**2 - x**2)
