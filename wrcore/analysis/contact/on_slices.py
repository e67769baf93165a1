"""A loaded wheel on a rail of slices, or a wheel out of round: crossings, switches, joints, flats."""

import math

from wrcore.analysis.contact.loaded import LoadedWheels
from wrcore.dynamics.wheel import ON_FIXED, ON_GRID
from wrcore.errors import InputError, one_of
from wrcore.geometry.track import SIDES

MODELS = ("maximum", "moment", "exact", "grid")
"""Patch models that serve rails which change along the track."""

FINER = (2.0, 1.75, 1.5, 1.0, 0.75)
"""Strips of a window, over those elsewhere: slender patches on sharp edges of heads want them. Where no solution is
found with the first number, the next ones are tried."""

_SUNK = 5e-5  # first guess of a wheel's approach to its rail, m


class LoadedOnSlices(LoadedWheels):
    """`LoadedWheels` out of round or on rails of slices, both alike: of a `WheelOnSlices`; arguments as there.

    ``s`` (m) is the arc length of the wheelset's cross-section, ``turned`` (rad) the angle by which it has rolled. The
    rail is what a wheel sees of it in its pose (`wrcore.contact.seen_rail`). Strips know parabolas along the track, a
    ``grid`` knows the surfaces: where an edge lies in a patch their greatest pressures differ."""

    refines = False

    def __init__(self, pair, model="exact", *how, **more):
        if model not in MODELS:
            raise InputError("contact", "patch", one_of(MODELS, model) + " on rails of slices")
        self.pair, self.s, self.turned, self._seen = pair, 0.0, 0.0, {}
        super().__init__(self._blank(), model, *how, **more)
        self._levels = [round(f * self._still.strips.strips) for f in FINER]
        self._level = 0
        self._solve_with(0)

    def _solve_with(self, level):
        """Take one of the numbers of strips."""
        self._level = level
        if self._still.strips.strips:
            self._still = self._still._replace(strips=self._still.strips._replace(strips=self._levels[level]))
        self._renew()

    def _renew(self):
        self._still_handle.renew(self._still)
        for handle in self._rolling.values():
            handle.renew(handle.value._replace(geometry=self.geometry, strips=self._still.strips))

    def _blank(self):
        """Geometry of the type that all have, of the first place of the rail with one."""
        for s in self.pair.rail.s:
            for side in SIDES:
                geometry, _ = self.pair.under(side, float(s), 0.0)
                if geometry is not None:
                    return geometry
        raise InputError(self.pair.rail.name, "", "expected a rail below the wheels, got none at y = 0")

    def _lie(self, side, y, roll, yaw):
        """Lay a wheel on what it sees; returns the height of its first touch, NaN where there is nothing."""
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
        """As for `LoadedWheels`, at ``s``."""
        if math.isnan(self._lie(side, y, roll, yaw)):
            return []
        while True:
            before = self._stood_in()
            found = super().at_height(side, y, z, roll, yaw, rolling, friction, fields)
            if self._stood_in() == before or self._level + 1 == len(self._levels):
                return found
            self._solve_with(self._level + 1)

    def _stood_in(self):
        """Patches so far on which a grid or fixed strips stood in."""
        return self._counters[[ON_GRID, ON_FIXED]].sum()

    def height(self, side, y, load, roll=0.0, yaw=0.0, rolling=None, friction=0.3, vertical=True, guess=math.nan):
        """As for `LoadedWheels`, at ``s``."""
        touch = self._lie(side, y, roll, yaw)
        if math.isnan(touch):
            return math.nan
        z = touch - _SUNK if math.isnan(guess) else guess
        for _ in FINER:  # anew where another number of strips has been taken on the way
            level = self._level
            z = super().height(side, y, load, roll, yaw, rolling, friction, vertical, z)
            if self._level == level or math.isnan(z):
                break
        return z

    def settled(self, y, load, yaw=0.0, rolling=None, friction=0.3, vertical=True):
        """As for `LoadedWheels`, at ``s``."""
        return self._levelled(0.0, math.nan, y, load, yaw, rolling, friction, vertical)
