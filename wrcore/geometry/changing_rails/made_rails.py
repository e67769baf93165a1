"""Rails made by a formula that change along the track: what crossings and switches have in common."""

from abc import ABC, abstractmethod
from pathlib import Path
from typing import ClassVar

import numpy as np

from wrcore.geometry.changing_rails.slices import RailSlices, Slice, sheets_of
from wrcore.geometry.profiles.standards import named_profile

EVEN = 5e-4
"""Distance of points, m."""

_SIDE = 6e-3  # height of a head's sides, m


class MadeRail(ABC):
    """A rail with heads of 60E1, upright, each a curve of its own."""

    names: ClassVar[tuple]
    """Of its heads."""

    @abstractmethod
    def arc_lengths(self):
        """Of the slices, m; at one of them each head begins."""

    @abstractmethod
    def heads(self, s):
        """Points u, f (m) of the heads at s (m), by their names."""

    def rail(self, name):
        """All of it as `RailSlices`."""
        s = self.arc_lengths()
        slices = [{one: Slice.through(at, *points) for one, points in self.heads(at).items()} for at in s]
        sheets = [sheet for head in self.names for sheet in sheets_of(s, [one.get(head) for one in slices])]
        return RailSlices(
            name, s, tuple(sheets), f"{s.size} slices made by a formula, from s = {s[0]:g} to {s[-1]:g} m"
        )

    def write(self, folder, file):
        """Write it as a table of slices, a ``file`` of a folder, with a profile per head and slice; its path."""
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        rows = ["s_m,head,profile"]
        for k, s in enumerate(self.arc_lengths()):
            for name, points in self.heads(s).items():
                profile, columns = f"{name}_{k + 1}.csv", np.column_stack(points)
                np.savetxt(folder / profile, columns, fmt="%.9f", delimiter=",", header="u_m,f_m", comments="")
                rows.append(f"{s:.6f},{name},{profile}")
        path = folder / file
        path.write_text("\n".join(rows) + "\n")
        return path


def whole_head(moved=0.0):
    """Points u, f (m) of a head ``moved`` to the field side, m."""
    head = named_profile("60E1", "rail", 0.0)
    return evenly(head.u + moved, head.f)


def half_width():
    """Of a head, m."""
    head = named_profile("60E1", "rail", 0.0)
    return head.gauge_offset(-head.f[0])


def narrow_head(width, ridge, sunk, steep=1.0):
    """Points u, f (m) of the inner half of a head and another one turned round beside it, as wide as asked, whose
    ridge is rounded over the height ``ridge``, and all ``sunk``, m. The outer side is so many times as ``steep``."""
    head, edge = named_profile("60E1", "rail", 0.0), half_width()
    narrow = min(1.0, max(0.0, 2.0 * edge - width) / edge)  # a full head has no ridge, and is symmetrical
    u = np.arange(-edge, width - edge, 0.1 * EVEN)
    beside = (1.0 + (steep - 1.0) * narrow) * (width - edge - u) - edge
    inner, outer = (np.where(at < 0.0, head(np.clip(at, -edge, 0.0)), 0.0) for at in (u, beside))
    lower = 0.5 * (inner + outer - np.hypot(inner - outer, ridge)) + 0.5 * ridge
    f = narrow * (lower - 0.5 * ridge) + (1.0 - narrow) * np.minimum(inner, outer)
    return evenly(u, f - sunk)


def evenly(u, f):
    """Points at even distances along a head's outline, with sides 1:20 below it."""
    u = np.concatenate([u[:1] - 0.05 * _SIDE, u, u[-1:] + 0.05 * _SIDE])
    f = np.concatenate([f[:1] - _SIDE, f, f[-1:] - _SIDE])
    length = np.append(0.0, np.cumsum(np.hypot(np.diff(u), np.diff(f))))
    at = np.linspace(0.0, length[-1], round(length[-1] / EVEN) + 1)
    return np.interp(at, length, u), np.interp(at, length, f)
