"""Corrugation: a short wave of a rail's running surface, constant over its width."""

import math
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Corrugation:
    """A cosine wave of one rail or both over arc length; lengths in m."""

    wavelength: float
    amplitude: float
    begin: float
    """Arc length at which the corrugated stretch begins, m; the unfaded wave has a crest there."""
    length: float
    """Length of the corrugated stretch, m."""
    fade: float
    """Length of the fade at either end, m."""
    sides: tuple
    level = False
    """Whether contact patches stay level on this surface."""

    def nodes(self, step, pad):
        """Return first arc length (m), step (m) and number of nodes over one wave with ``pad`` more at either end.

        The nodes are at most half a ``step`` (m) apart.
        """
        count = math.ceil(2.0 * self.wavelength / step)
        step = self.wavelength / count
        return -pad * step, step, count + 2 * pad + 1

    def reach(self, radii, place, x):
        """Return the height of the wave (n, m), m, at distances ``x`` (n,) ahead of the arc length ``place``, m.

        It is equal for all radii (m,).
        """
        wave = self.amplitude * np.cos(2.0 * math.pi / self.wavelength * (place + x))
        return wave[:, None] + np.zeros_like(radii)
