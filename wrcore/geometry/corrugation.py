"""Corrugation: a short wave of a rail's running surface, the same over its width."""

import math
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Corrugation:
    """A cosine over arc length, of one rail or both."""

    wavelength: float
    amplitude: float
    begin: float
    """Of the corrugated stretch, m; a crest would lie there."""
    length: float
    """Of the stretch, m."""
    fade: float
    """Length over which it comes and goes, m."""
    sides: tuple
    level = False
    """Whether patches stay level on it."""

    def nodes(self, step, pad):
        """First arc length (m), step and number of nodes, half a ``step`` (m) apart at most: one wave, and ``pad`` more
        at either end."""
        count = math.ceil(2.0 * self.wavelength / step)
        step = self.wavelength / count
        return -pad * step, step, count + 2 * pad + 1

    def reach(self, radii, place, x):
        """How high the rail is at stations (n,) ahead of an arc length, (n, m), m; the same under all radii (m,)."""
        wave = self.amplitude * np.cos(2.0 * math.pi / self.wavelength * (place + x))
        return wave[:, None] + np.zeros_like(radii)
