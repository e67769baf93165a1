"""A switch made by a formula, as a table of slices: stock rail and blade of a turnout, usable by anybody.

    python -m wrcore.geometry.changing_rails.switch FOLDER

writes ``switch.csv`` and its profiles, of the rail on whose side the wheels pass from the stock rail to the blade. Seen
along either route the stock rail leaves to the field side by s^2/(2 R), as tangent and circle part, and the blade fills
what it leaves: straight on where the stock rail is curved, and curved, on a track with a curve of the radius R from the
toe on, where it is straight. The blade is the inner side of a head, as wide as the stock rail has moved, and rises from
under the stock rail's gauge corner. The other rail of a route is the plain one. Heads are those of 60E1, upright. The
radius is a common one; how deep the blade lies at its toe, at which width it has risen, and its rounding are chosen.
"""

import math
import sys
from dataclasses import dataclass

import numpy as np

from wrcore.geometry.changing_rails.made_rails import MadeRail, half_width, narrow_head, whole_head


@dataclass(frozen=True)
class Switch(MadeRail):
    """Dimensions, m."""

    radius: float = 500.0
    sunk: float = 0.016
    """Depth of the blade at its toe; it is low as it is narrow, too."""
    risen: float = 0.045
    """Width of the blade from which on it is as high as the stock rail."""
    toe: float = 0.002
    """Width of the blade there."""
    ridge: float = 1e-3
    """Height over which the ridge of a narrow blade is rounded."""
    steep: float = 4.0
    """How many times as steep as a head's side the narrow blade's is that lies against the stock rail."""
    step: float = 0.1
    """Distance of the slices, about."""
    before: float = 0.4
    """Length before the toe, where the blade lies hidden below the stock rail."""

    names = ("stock", "blade")

    @property
    def after(self):
        """Length behind the toe, up to where the blade is a whole head."""
        return math.sqrt(4.0 * self.radius * half_width())

    def arc_lengths(self):
        """Of the slices, m."""
        length = self.before + self.after
        return np.linspace(-self.before, self.after, round(length / self.step) + 1)

    def heads(self, s):
        """Points u, f (m) of stock rail and blade at s (m)."""
        away = max(s, 0.0) ** 2 / (2.0 * self.radius)
        low = self.sunk * max(0.0, 1.0 - away / self.risen) ** 2
        return {"stock": whole_head(away), "blade": narrow_head(max(away, self.toe), self.ridge, low, self.steep)}


if __name__ == "__main__":
    print(Switch().write(sys.argv[1], "switch.csv"))
