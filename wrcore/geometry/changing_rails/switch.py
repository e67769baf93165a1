"""A switch made by a formula, as a table of slices: stock rail and blade of a turnout, free to use.

    python -m wrcore.geometry.changing_rails.switch FOLDER

writes ``switch.csv`` and its profiles, of the rail on which the wheels pass from the stock rail to the blade. Along
either route the stock rail moves to the field side by s^2/(2 R), the distance between tangent and circle, and the blade
fills the gap. On straight track the stock rail is curved and the blade straight. On a track with a curve of the radius
R from the toe on, the stock rail is straight and the blade curved. The blade is the inner side of a head, as wide as
the stock rail has moved, and rises from below the stock rail's gauge corner. The other rail of a route is plain. Heads
are those of 60E1, upright. The radius is a common value; the blade's depth at the toe, its width at full height and its
rounding are chosen.
"""

import math
import sys
from dataclasses import dataclass

import numpy as np

from wrcore.geometry.changing_rails.made_rails import MadeRail, half_width, narrow_head, whole_head


@dataclass(frozen=True)
class Switch(MadeRail):
    """Dimensions of a switch, m."""

    radius: float = 500.0
    sunk: float = 0.016
    """Depth of the blade at its toe, in addition to that of its narrow shape."""
    risen: float = 0.045
    """Width of the blade at which it reaches the height of the stock rail."""
    toe: float = 0.002
    """Width of the blade at its toe."""
    ridge: float = 1e-3
    """Height over which the ridge of a narrow blade is rounded."""
    steep: float = 4.0
    """Ratio of the slope of the narrow blade's side at the stock rail to that of a head's side."""
    step: float = 0.1
    """Approximate distance of the slices."""
    before: float = 0.4
    """Length before the toe, in which the blade is hidden below the stock rail."""

    names = ("stock", "blade")

    @property
    def after(self):
        """Length from the toe to the full head width of the blade, m."""
        return math.sqrt(4.0 * self.radius * half_width())

    def arc_lengths(self):
        """Return the arc lengths of the slices, m."""
        length = self.before + self.after
        return np.linspace(-self.before, self.after, round(length / self.step) + 1)

    def heads(self, s):
        """Return the points u, f (m) of stock rail and blade at arc length s (m), by the heads' names."""
        away = max(s, 0.0) ** 2 / (2.0 * self.radius)
        low = self.sunk * max(0.0, 1.0 - away / self.risen) ** 2
        return {"stock": whole_head(away), "blade": narrow_head(max(away, self.toe), self.ridge, low, self.steep)}


if __name__ == "__main__":
    print(Switch().write(sys.argv[1], "switch.csv"))
