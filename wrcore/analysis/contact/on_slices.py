"""Contact of a loaded wheel on a rail of slices, or of a wheel out of round: crossings, switches, joints, flats."""

import math

import numpy as np

from wrcore.analysis.contact.loaded import LoadedWheels
from wrcore.contact.normal import solve
from wrcore.contact.normal.gap import CREST, GAP, SHAPE, TILT, frame_of_overlaps
from wrcore.contact.search.strip import make_pose
from wrcore.contact.search.surfaces import ContactPlane, surface_gap
from wrcore.errors import InputError, one_of
from wrcore.geometry.track import SIDES
from wrcore.run.checks.shape_along import ROUGH
from wrcore.wheels.contact_model import ON_FIXED, ON_GRID

MODELS = ("maximum", "moment", "exact", "grid")
"""Patch models for rails that vary along the track."""

FINER = (2.0, 1.75, 1.5, 1.0, 0.75)
"""Numbers of strips of a window, relative to those on ordinary rails: slender patches on sharp edges of heads need more
strips. If the first number gives no solution, the next ones are tried."""

_STATIONS = 81  # number of points over the length of a patch

_SUNK = 5e-5  # first guess of a wheel's approach to its rail, m


class LoadedOnSlices(LoadedWheels):
    """`LoadedWheels` out of round or on rails of slices, from a `WheelOnSlices` for both sides.

    ``s`` (m) is the arc length of the wheelset's cross-section, ``turned`` (rad) the angle by which it has rolled. The
    section of the rail depends on position and attitude of the wheel (`wrcore.contact.changing_rails.sections`). Strips
    approximate surfaces along the track by parabolas, a grid uses the surfaces. If both differ by more than `ROUGH`
    within a patch, a grid is used until the wheel is moved, so that a search for a height does not alternate."""

    refines = False

    def __init__(self, pair, model="exact", *how, **more):
        if model not in MODELS:
            raise InputError("contact", "patch", one_of(MODELS, model) + " on rails of slices")
        self.pair, self.s, self.turned, self._seen = pair, 0.0, 0.0, {}
        self._rough = {}
        super().__init__(self._blank(), model, *how, **more)
        self._levels = [round(f * self._still.strips.strips) for f in FINER]
        self._level = 0
        self._solve_with(0)

    def _solve_with(self, level):
        """Select one of the numbers of strips."""
        self._level = level
        if self._still.strips.strips:
            self._still = self._still._replace(strips=self._still.strips._replace(strips=self._levels[level]))
        self._renew()

    def _renew(self):
        self._still_handle.renew(self._still)
        for handle in self._rolling.values():
            handle.renew(handle.value._replace(geometry=self.geometry, strips=self._still.strips))

    def _blank(self):
        """Return the geometry at the first position of the rail that has one; all geometries have the same type."""
        for s in self.pair.rail.s:
            for side in SIDES:
                geometry, _ = self.pair.under(side, float(s), 0.0)
                if geometry is not None:
                    return geometry
        raise InputError(self.pair.rail.name, "", "expected a rail below the wheels, got none at y = 0")

    def _lie(self, side, y, roll, yaw):
        """Set the geometry under a wheel and return the height of its first contact, m; NaN if there is no rail."""
        pose = (self.s, y, roll, yaw, self.turned)
        if self._seen.get(side, (None,))[0] != pose:
            self._seen[side] = pose, *self.pair.under(side, *pose)
        _, geometry, touch = self._seen[side]
        if geometry is not None and geometry is not self.geometry:
            self.geometry = geometry
            self._still = self._still._replace(geometry=geometry)
            self._solve_with(0)
        return touch

    def at_height(self, side, y, z, roll=0.0, yaw=0.0, rolling=None, friction=0.3, fields=False):
        """Return patches of one wheel at the arc length ``s``; arguments are those of `LoadedWheels.at_height`."""
        if math.isnan(self._lie(side, y, roll, yaw)):
            return []
        while True:
            before = self._stood_in()
            found = super().at_height(side, y, z, roll, yaw, rolling, friction, fields)
            if self._stood_in() == before or self._level + 1 == len(self._levels) or self._on_grids(side):
                return found
            self._solve_with(self._level + 1)

    def _stood_in(self):
        """Return the number of patches so far for which a grid or fixed strips were used."""
        return self._counters[[ON_GRID, ON_FIXED]].sum()

    def _on_grids(self, side):
        """Return the numbers of patches of a wheel, at its present position, that are solved on grids because parabolas
        do not fit."""
        pose = self._seen.get(side, (None,))[0]
        return {group for (at, group), rough in self._rough.items() if at == side and rough == pose}

    def _is_rough(self, which, left, first, last, on_grid):
        """Whether a parabola does not fit the gap of a patch along the rail, see `ROUGH`."""
        if self.always or left.vx < 0.0:
            return False
        side, group = which
        if not on_grid and group not in self._on_grids(side) and self._misfit(left, first, last) > ROUGH:
            self._rough[which] = self._seen.get(side, (None,))[0]
        return group in self._on_grids(side)

    def _misfit(self, left, first, last):
        """Return the largest difference of gap and parabolas of the strips solved last, relative to the largest
        penetration."""
        work, pose = self._work, make_pose(*left[:6], self.spatial)
        frame = frame_of_overlaps(self.geometry, pose, self._rows, first, last)
        plane = ContactPlane(frame.x, frame.ur + self.geometry.rail_distance, frame.z, frame.cosine, frame.sine)
        gap = work.normal.gap[: work.solved[0]]
        centre, half, middle = work.strips[[solve.CENTRE, solve.HALF_LENGTH, solve.MIDDLE], : len(gap)]
        x = np.linspace(work.sums[solve.X_MIN], work.sums[solve.X_MAX], _STATIONS)
        real = np.empty((2, x.size, centre.size))
        surface_gap(self.geometry, pose, plane, x, centre, *real)
        x = x[:, None]
        off = real[0] / np.sqrt(1.0 + gap[:, TILT] ** 2) - gap[:, GAP] - gap[:, SHAPE] * (x - gap[:, CREST]) ** 2
        return np.max(np.abs(off), where=np.abs(x - middle) < half, initial=0.0) / max(-gap[:, GAP].min(), 1e-9)

    def height(self, side, y, load, roll=0.0, yaw=0.0, rolling=None, friction=0.3, vertical=True, guess=math.nan):
        """Return the height z (m) at which one wheel carries a load, at ``s``; arguments as in
        `LoadedWheels.height`."""
        touch = self._lie(side, y, roll, yaw)
        if math.isnan(touch):
            return math.nan
        z = touch - _SUNK if math.isnan(guess) else guess
        for _ in FINER:  # repeat if the number of strips, or the use of grids, has changed
            level, grids = self._level, self._on_grids(side)
            z = super().height(side, y, load, roll, yaw, rolling, friction, vertical, z)
            if math.isnan(z) or (self._level == level and self._on_grids(side) == grids):
                break
        return z

    def settled(self, y, load, yaw=0.0, rolling=None, friction=0.3, vertical=True):
        """Return roll (rad) and height (m) at which each wheel carries a load, at the arc length ``s``."""
        return self._levelled(0.0, math.nan, y, load, yaw, rolling, friction, vertical)
