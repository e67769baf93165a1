"""A crossing made by a formula, as a table of slices: wing rail and nose of a turnout 1:12, free to use.

    python -m wrcore.geometry.changing_rails.crossing FOLDER

writes ``crossing.csv`` and its profiles. A straight crossing is mirror-symmetric for its two routes. The wing rail
bends to the field side at s = 0, the knuckle. The nose begins with a width of 12 mm; its running edge continues that of
the wing. All heads are those of 60E1, upright. Angle and flangeway are common values; the nose's first width, its depth
there, its ramp and the rounding of its ridge are chosen.
"""

import sys
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from wrcore.geometry.changing_rails.made_rails import MadeRail, half_width, narrow_head, whole_head


@dataclass(frozen=True)
class Crossing(MadeRail):
    """Dimensions of a crossing, m."""

    angle: float = 1.0 / 12.0
    flangeway: float = 0.044
    first_width: float = 0.012
    """Width of the nose at its beginning."""
    sunk: float = 0.002
    """Depth of the nose at its beginning, in addition to that of its narrow shape."""
    ramp: float = 0.25
    """Length over which the nose rises to the wing's height."""
    ridge: float = 1e-3
    """Height over which the ridge of a narrow nose is rounded."""
    step: float = 0.025
    """Approximate distance of the slices."""
    before: float = 0.3
    """Length before the knuckle."""

    names = ("wing", "nose")

    @property
    def nose_begins(self):
        """Arc length of the nose's beginning, m.

        The running edges meet at the theoretical point, flangeway / angle behind the knuckle; there the nose has width
        0.
        """
        return (self.flangeway + self.first_width) / self.angle

    @property
    def after(self):
        """Length from the beginning of the nose to its full head width, m."""
        return (2.0 * half_width() - self.first_width) / self.angle

    def arc_lengths(self):
        """Return the arc lengths of the slices, m; the nose begins at one of them."""
        ends = -self.before, 0.0, self.nose_begins, self.nose_begins + self.after
        parts = [np.linspace(a, b, round((b - a) / self.step), endpoint=False) for a, b in pairwise(ends)]
        return np.concatenate([*parts, ends[-1:]])

    def heads(self, s):
        """Return the points u, f (m) of wing and nose at arc length s (m), by the heads' names."""
        heads, behind = {"wing": whole_head(self.angle * max(s, 0.0))}, s - self.nose_begins
        if behind < -1e-9:
            return heads
        low = self.sunk * max(0.0, 1.0 - behind / self.ramp)
        return heads | {"nose": narrow_head(self.first_width + self.angle * behind, self.ridge, low)}


if __name__ == "__main__":
    print(Crossing().write(sys.argv[1], "crossing.csv"))
