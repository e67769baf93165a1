"""What all patch models of a loaded wheel share: motion of the wheelset, search for height and roll, free rolling.

A wheelset rolls with the speed V along the track and omega about its axle, moves sideways and turns; all of it is
optional. Without a motion a patch carries its normal force alone. Without omega the wheel rolls freely: the mean of its
longitudinal rigid slip over the pressure of all its patches vanishes.
"""

import math
from typing import NamedTuple

import numpy as np

from wrcore.contact import reduction as columns
from wrcore.contact.detection import axle_direction, find_patches
from wrcore.contact.normal import contact_modulus, hertz_table
from wrcore.contact.patch.normal import height_of_zero
from wrcore.contact.patch.result import Patch
from wrcore.contact.patch.surfaces import Motion
from wrcore.contact.reduction import MAX_PATCHES, MOMENT, PATCH_COLUMNS
from wrcore.contact.statics import ROLL_SLOPE, height_at_load, settle
from wrcore.errors import InputError, check_number
from wrcore.geometry.track import SIDES

_CARRIED = 1e-9
"""Relative error of F^(2/3) that ends the search for a height."""

_LEVEL = 1e-10
"""Step in roll that ends the search for it, rad."""

_MOST_ROLLS = 25


DEEPEST = 1e-3
"""Overlap that a given height may make, m; the greatest load, 1 MN, makes 0.35 mm on a tread."""

LOWEST = 0.1
"""A wheelset lies at most so much below its rolling radius, m: beyond, flanges stand on the rail's foot."""


class Rolling(NamedTuple):
    """Motion of a wheelset: speed V > 0 and lateral velocity (m/s), rates of rolling (NaN: free) and yaw (rad/s)."""

    speed: float
    rate: float = math.nan
    vy: float = 0.0
    yaw_rate: float = 0.0

    def motion(self, roll, yaw, rate=None):
        """`Motion` of a wheelset in a pose."""
        rate = self.rate if rate is None else rate
        wx, wy, wz = (rate * c for c in axle_direction(roll, yaw))
        return Motion(self.speed, self.vy, 0.0, wx, wy, wz + self.yaw_rate, self.speed)

    def per_rate(self, roll, yaw):
        """What one rad/s about the axle adds to that motion."""
        return Motion(0.0, 0.0, 0.0, *axle_direction(roll, yaw), self.speed)


class Found(NamedTuple):
    """One patch of a wheel."""

    row: np.ndarray
    """(PATCH_COLUMNS,) as in runs; point, creepages and moment refer to the pressure's centroid, the coordinates of the
    profiles to the deepest overlap. Creepages are means of the rigid slip over the pressure; NaN without a motion."""
    extent: tuple
    """x_min, x_max (from the wheelset's cross-section) and width in the contact plane, m."""
    patch: Patch = None
    """With its fields, where the model has them and they were asked for."""
    on_grid: bool = False

    @property
    def vertical(self):
        """Force upwards on the wheel, N."""
        angle = self.row[columns.ANGLE]
        return self.row[columns.NORMAL] * math.cos(angle) + self.row[columns.FY] * math.sin(angle)


class LoadedWheels:
    """Wheels of a wheelset by one patch model; see `loaded_wheels`."""

    reduction = MOMENT

    def __init__(self, geometry, shear_modulus=8.2e10, poisson_ratio=0.28, detection="spatial"):
        check_number(shear_modulus, 1e9, 1e12, "contact", "shear_modulus", "Pa")
        check_number(poisson_ratio, 0.0, 0.5, "contact", "poisson_ratio")
        if detection not in ("planar", "spatial"):
            raise InputError("detection", "", f"expected planar or spatial, got {detection!r}")
        self.geometry, self.shear_modulus, self.poisson_ratio = geometry, float(shear_modulus), float(poisson_ratio)
        self.modulus, self.detection = contact_modulus(self.shear_modulus, self.poisson_ratio), detection
        self.spatial, self._hertz = detection == "spatial", hertz_table()
        self._rows = np.zeros((MAX_PATCHES, PATCH_COLUMNS))

    def at_height(self, side, y, z, roll=0.0, yaw=0.0, rolling=None, friction=0.3, fields=False):
        """Patches (list of `Found`, flange first; with a `Patch` if ``fields``) of one wheel of a wheelset at y, z (m),
        roll, then yaw about the vertical (rad); without ``rolling`` it stands and there are no creep forces.
        """
        raise NotImplementedError

    def check_depth(self, side, y, z, roll, yaw, source, field):
        """Refuse a height at which a wheel lies deeper in its rail than `DEEPEST`."""
        axle = (SIDES[side] * c for c in axle_direction(roll, yaw))
        lifted = (SIDES[side], y, z + DEEPEST, *axle, self.spatial)
        if find_patches(self.geometry, *lifted, MOMENT, self._rows) or z < self.geometry.rolling_radius - LOWEST:
            raise InputError(source, field, f"expected at most {1e3 * DEEPEST:g} mm of overlap, got z = {z:g} m")

    def height(self, side, y, load, roll=0.0, yaw=0.0, rolling=None, friction=0.3, vertical=True, guess=math.nan):
        """Height z (m) of the wheelset at which one wheel carries a load (N; of all forces vertically, or of the normal
        forces), sought near ``guess`` (m); NaN where there is none.
        """
        goal = load ** (2.0 / 3.0)

        def excess(z):
            found = self.at_height(side, y, z, roll, yaw, rolling, friction)
            force = sum(f.vertical if vertical else f.row[columns.NORMAL] for f in found)
            rest = max(force, 0.0) ** (2.0 / 3.0) - goal
            return 0.0 if abs(rest) < _CARRIED * goal else rest

        if math.isnan(guess):
            guess = self._still_height(side, y, load, roll, yaw)
        return math.nan if math.isnan(guess) else height_of_zero(excess, guess)

    def _still_height(self, side, y, load, roll, yaw):
        """Height at which an ellipse carries a load vertically."""
        return height_at_load(
            self.geometry, self._hertz, self.modulus, SIDES[side], y, roll, yaw, self.spatial, self.reduction, load,
            self.geometry.rolling_radius, self._rows,
        )  # fmt: skip

    def _still_settled(self, y, load, yaw):
        """Roll and height at which ellipses carry a load each vertically."""
        nominal = self.geometry.rolling_radius
        return settle(
            self.geometry, self._hertz, self.modulus, y, yaw, self.spatial, self.reduction, load, nominal
        )  # fmt: skip

    def settled(self, y, load, yaw=0.0, rolling=None, friction=0.3, vertical=True):
        """Roll (rad) and height (m) at which each wheel carries a load; NaN where there are none. As for `height`."""
        roll, z = self._still_settled(y, load, yaw)
        if math.isnan(z):
            return math.nan, math.nan
        before = difference = math.nan
        slope, left, right = ROLL_SLOPE, z, z
        for _ in range(_MOST_ROLLS):
            left = self.height("left", y, load, roll, yaw, rolling, friction, vertical, left)
            right = self.height("right", y, load, roll, yaw, rolling, friction, vertical, right)
            if roll != before and not math.isnan(before):
                slope = (left - right - difference) / (roll - before)
            difference, before = left - right, roll
            step = difference / slope
            if not abs(step) < 0.02:
                break
            if abs(step) < _LEVEL:
                return roll, 0.5 * (left + right)
            roll -= step
            left, right = left - 0.5 * slope * step, right + 0.5 * slope * step
        return math.nan, math.nan


def free_rate(at, rolling, roll, yaw, mean):
    """Slip at the rolling rate, or where none is given at the one without a mean; and the rate."""
    if not math.isnan(rolling.rate):
        return at(rolling.motion(roll, yaw)), rolling.rate
    still, turning = at(rolling.motion(roll, yaw, 0.0)), at(rolling.per_rate(roll, yaw))
    rate = -mean(still) / mean(turning)
    return [one + rate * other for one, other in zip(still, turning, strict=True)], rate


def free_creepages(at, rolling, roll, yaw, mean):
    """Creepages (n, 3) by `free_rate`."""
    return np.array(free_rate(at, rolling, roll, yaw, lambda rows: mean(np.asarray(rows)))[0])
