"""A dipped joint made by a formula, as a table of slices, free to use.

    python -m wrcore.geometry.changing_rails.joint FOLDER

writes ``joint.csv`` and its profiles: two straight rail ends with an angle 2 alpha between them, as defined by Jenkins
et al. (Railway Engineering Journal 3, 1974), which level out away from the joint. Heads are those of 60E1, upright. The
lengths of the parts are chosen.
"""

import sys
from dataclasses import dataclass

import numpy as np

from wrcore.geometry.changing_rails.made_rails import MadeRail, whole_head

NEAR = 1e-3, 2e-3, 5e-3, 0.01, 0.02, 0.05
"""Distances of the closest slices from the kink, m; they are dense because splines along the track round the kink."""


@dataclass(frozen=True)
class Joint(MadeRail):
    """Dimensions of a dipped joint, m."""

    angle: float = 0.01
    """Angle 2 alpha between the rail ends, rad."""
    straight: float = 1.0
    """Length of the straight part of each rail end."""
    level: float = 1.0
    """Length over which each rail end levels out."""
    step: float = 0.1
    """Approximate distance of the slices away from the kink."""

    names = ("rail",)

    def arc_lengths(self):
        """Return the arc lengths of the slices, m."""
        length = self.straight + self.level
        away = np.linspace(0.0, length, round(length / self.step) + 1)[1:]
        one = np.array([*NEAR, *away, length + self.step])
        return np.concatenate([-one[::-1], [0.0], one])

    def heads(self, s):
        """Return the points u, f (m) of the rail at arc length s (m), by the head's name."""
        near, beyond = min(abs(s), self.straight), min(max(abs(s) - self.straight, 0.0), self.level)
        risen = near + beyond - 0.5 * beyond**2 / self.level
        u, f = whole_head()
        return {"rail": (u, f - 0.5 * self.angle * (self.straight + 0.5 * self.level - risen))}


if __name__ == "__main__":
    print(Joint().write(sys.argv[1], "joint.csv"))
