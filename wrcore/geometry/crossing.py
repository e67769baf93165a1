"""A crossing made by a formula, as a table of slices: wing rail and nose of a turnout 1:12, usable by anybody.

    python -m wrcore.geometry.crossing FOLDER

writes ``crossing.csv`` and its profiles, for a wheel that runs straight on. The wing bends away to the field side at
s = 0, the knuckle. The nose begins where it is 12 mm wide; its running edge continues the wing's. All heads are those
of 60E1, upright. Angle and flangeway are common ones; the nose's first width, its depth there, its ramp and the
rounding of its ridge are chosen.
"""

import sys
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from wrcore.geometry.slices import RailSlices, Slice, sheets_of
from wrcore.geometry.standards import named_profile

_EVEN = 5e-4  # distance of points, m
_SIDE = 6e-3  # height of a head's sides, m


@dataclass(frozen=True)
class Crossing:
    """Dimensions, m."""

    angle: float = 1.0 / 12.0
    flangeway: float = 0.044
    first_width: float = 0.012
    """Of the nose, where it begins."""
    sunk: float = 0.002
    """Depth of the nose there; it is low as it is narrow, too."""
    ramp: float = 0.25
    """Length over which the nose rises to the wing's height."""
    ridge: float = 1e-3
    """Height over which the ridge of a narrow nose is rounded."""
    step: float = 0.025
    """Distance of the slices, about."""
    before: float = 0.3
    """Length before the knuckle."""

    @property
    def nose_begins(self):
        """A flangeway behind the knuckle both running edges meet, at the theoretical point; the nose is wider."""
        return (self.flangeway + self.first_width) / self.angle

    @property
    def after(self):
        """Length behind the nose's beginning, up to where it is a whole head."""
        head = named_profile("60E1", "rail", 0.0)
        return (2.0 * head.gauge_offset(-head.f[0]) - self.first_width) / self.angle

    def arc_lengths(self):
        """Of the slices; at one of them the nose begins."""
        ends = -self.before, 0.0, self.nose_begins, self.nose_begins + self.after
        parts = [np.linspace(a, b, round((b - a) / self.step), endpoint=False) for a, b in pairwise(ends)]
        return np.concatenate([*parts, ends[-1:]])

    def heads(self, s):
        """Points u, f (m) of the heads at s (m), by their names."""
        heads = {"wing": self.wing(s)}
        return heads | {"nose": self.nose(s)} if s >= self.nose_begins - 1e-9 else heads

    def rail(self):
        """All of it as `RailSlices`."""
        s = self.arc_lengths()
        slices = [{name: Slice.through(at, *points) for name, points in self.heads(at).items()} for at in s]
        sheets = [sheet for name in ("wing", "nose") for sheet in sheets_of(s, [one.get(name) for one in slices])]
        name = f"crossing:1/{1.0 / self.angle:g}"
        return RailSlices(
            name, s, tuple(sheets), f"{s.size} slices made by a formula, from s = {s[0]:g} to {s[-1]:g} m"
        )

    def wing(self, s):
        """Points u, f (m) of the wing rail at s (m)."""
        head = named_profile("60E1", "rail", 0.0)
        return _evenly(head.u + self.angle * max(s, 0.0), head.f)

    def nose(self, s):
        """Points u, f (m) of the nose at s (m): the inner half of a head, and another one turned round beside it."""
        head = named_profile("60E1", "rail", 0.0)
        edge, width = head.gauge_offset(-head.f[0]), self.first_width + self.angle * (s - self.nose_begins)
        u = np.arange(-edge, width - edge, 0.1 * _EVEN)
        inner, outer = (np.where(at < 0.0, head(np.clip(at, -edge, 0.0)), 0.0) for at in (u, width - 2.0 * edge - u))
        lower = 0.5 * (inner + outer - np.hypot(inner - outer, self.ridge)) + 0.5 * self.ridge
        narrow = min(1.0, max(0.0, 2.0 * edge - width) / edge)  # a full head has no ridge
        f = narrow * (lower - 0.5 * self.ridge) + (1.0 - narrow) * np.minimum(inner, outer)
        return _evenly(u, f - self.sunk * max(0.0, 1.0 - (s - self.nose_begins) / self.ramp))


def write_crossing(folder, crossing=None):
    """Write a `Crossing` as ``crossing.csv``, and a profile per head and slice, to a folder; its path."""
    crossing, folder = crossing or Crossing(), Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    rows = ["s_m,head,profile"]
    for k, s in enumerate(crossing.arc_lengths()):
        for name, points in crossing.heads(s).items():
            file = f"{name}_{k + 1}.csv"
            np.savetxt(folder / file, np.column_stack(points), fmt="%.9f", delimiter=",", header="u_m,f_m", comments="")
            rows.append(f"{s:.6f},{name},{file}")
    path = folder / "crossing.csv"
    path.write_text("\n".join(rows) + "\n")
    return path


def _evenly(u, f):
    """Points at even distances along a head's outline, with sides 1:20 below it."""
    u = np.concatenate([u[:1] - 0.05 * _SIDE, u, u[-1:] + 0.05 * _SIDE])
    f = np.concatenate([f[:1] - _SIDE, f, f[-1:] - _SIDE])
    length = np.append(0.0, np.cumsum(np.hypot(np.diff(u), np.diff(f))))
    at = np.linspace(0.0, length[-1], round(length[-1] / _EVEN) + 1)
    return np.interp(at, length, u), np.interp(at, length, f)


if __name__ == "__main__":
    print(write_crossing(sys.argv[1]))
