"""A dipped joint made by a formula, as a table of slices, usable by anybody.

    python -m wrcore.geometry.changing_rails.joint FOLDER

writes ``joint.csv`` and its profiles: two straight ends of rail that lean towards each other by an angle 2 alpha, the
measure of Jenkins et al. (Railway Engineering Journal 3, 1974), and level out behind them. Heads are those of 60E1,
upright. How long the parts are is chosen.
"""

import sys
from dataclasses import dataclass

import numpy as np

from wrcore.geometry.changing_rails.made_rails import MadeRail, whole_head

NEAR = 1e-3, 2e-3, 5e-3, 0.01, 0.02, 0.05
"""Arc lengths of slices beside the kink, m: cubics run through them."""


@dataclass(frozen=True)
class Joint(MadeRail):
    """Dimensions, m."""

    angle: float = 0.01
    """2 alpha, rad."""
    straight: float = 1.0
    """Length of each end."""
    level: float = 1.0
    """Length over which each levels out."""
    step: float = 0.1
    """Distance of the slices further away, about."""

    names = ("rail",)

    def arc_lengths(self):
        """Of the slices, m."""
        length = self.straight + self.level
        away = np.linspace(0.0, length, round(length / self.step) + 1)[1:]
        one = np.array([*NEAR, *away, length + self.step])
        return np.concatenate([-one[::-1], [0.0], one])

    def heads(self, s):
        """Points u, f (m) of the rail at s (m)."""
        near, beyond = min(abs(s), self.straight), min(max(abs(s) - self.straight, 0.0), self.level)
        risen = near + beyond - 0.5 * beyond**2 / self.level
        u, f = whole_head()
        return {"rail": (u, f - 0.5 * self.angle * (self.straight + 0.5 * self.level - risen))}


if __name__ == "__main__":
    print(Joint().write(sys.argv[1], "joint.csv"))
