"""Changing rails made by a formula: common base of crossings, switches and joints."""

from abc import ABC, abstractmethod
from pathlib import Path
from typing import ClassVar

import numpy as np

from wrcore.geometry.changing_rails.slices import RailSlices, Slice, sheets_of
from wrcore.geometry.profiles.standards import named_profile

EVEN = 5e-4
"""Distance of points along a head's outline, m."""

_SIDE = 6e-3  # height of a head's sides, m


class MadeRail(ABC):
    """A changing rail with one or several upright heads of 60E1."""

    names: ClassVar[tuple]
    """Names of the heads."""

    @abstractmethod
    def arc_lengths(self):
        """Return the arc lengths of the slices, m; each head begins at one of them."""

    @abstractmethod
    def heads(self, s):
        """Return the points u, f (m) of the heads at arc length s (m), by their names."""

    def rail(self, name):
        """Return the rail as `RailSlices` with this name."""
        s = self.arc_lengths()
        slices = [{one: Slice.through(at, *points) for one, points in self.heads(at).items()} for at in s]
        sheets = [sheet for head in self.names for sheet in sheets_of(s, [one.get(head) for one in slices])]
        return RailSlices(
            name, s, tuple(sheets), f"{s.size} slices made by a formula, from s = {s[0]:g} to {s[-1]:g} m"
        )

    def write(self, folder, file):
        """Write a table of slices and one profile for each head and slice into a folder; return the table's path."""
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
    """Return the points u, f (m) of a full head, ``moved`` to the field side (m)."""
    head = named_profile("60E1", "rail", 0.0)
    return evenly(head.u + moved, head.f)


def half_width():
    """Return half of the width of a 60E1 head, m."""
    head = named_profile("60E1", "rail", 0.0)
    return head.gauge_offset(-head.f[0])


def narrow_head(width, ridge, sunk, steep=1.0):
    """Return the points u, f (m) of a narrow head: the inner half of a 60E1 head joined to a mirrored half.

    ``width`` is the head's width, m; the ridge between both halves is rounded over the height ``ridge``, m. The head is
    lowered by ``sunk``, m. ``steep`` multiplies the slope of the outer side.
    """
    head, edge = named_profile("60E1", "rail", 0.0), half_width()
    narrow = min(1.0, max(0.0, 2.0 * edge - width) / edge)  # a full head has no ridge, and is symmetrical
    u = np.arange(-edge, width - edge, 0.1 * EVEN)
    beside = (1.0 + (steep - 1.0) * narrow) * (width - edge - u) - edge
    inner, outer = (np.where(at < 0.0, head(np.clip(at, -edge, 0.0)), 0.0) for at in (u, beside))
    lower = 0.5 * (inner + outer - np.hypot(inner - outer, ridge)) + 0.5 * ridge
    f = narrow * (lower - 0.5 * ridge) + (1.0 - narrow) * np.minimum(inner, outer)
    return evenly(u, f - sunk)


def evenly(u, f):
    """Return points at equal distances `EVEN` along a head's outline, extended downwards by sides of 1:20."""
    u = np.concatenate([u[:1] - 0.05 * _SIDE, u, u[-1:] + 0.05 * _SIDE])
    f = np.concatenate([f[:1] - _SIDE, f, f[-1:] - _SIDE])
    length = np.append(0.0, np.cumsum(np.hypot(np.diff(u), np.diff(f))))
    at = np.linspace(0.0, length[-1], round(length[-1] / EVEN) + 1)
    return np.interp(at, length, u), np.interp(at, length, f)
