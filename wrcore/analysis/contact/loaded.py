"""Contact of a loaded wheel on its rail at a given height or load, by the kernels of runs, for a given position and
velocity.

A wheelset rolls with the speed V along the track and omega about its axle, with optional lateral velocity and yaw rate.
Without a motion a patch has only a normal force. Without omega the wheel rolls freely: the mean of its longitudinal
rigid slip, weighted by the pressure of all its patches, is zero.
"""

import math
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from wrcore.analysis.contact.strip_fields import ends_on_profiles, patch_of_strips
from wrcore.contact.creepage import creepages
from wrcore.contact.hertz import contact_modulus, hertz_table
from wrcore.contact.normal import solve
from wrcore.contact.normal.gap import frame_of_overlaps, group_end
from wrcore.contact.normal.strips import STEPS
from wrcore.contact.patch.model import PATCHES, RESOLUTIONS, SLIPS, strip_model, strip_work
from wrcore.contact.patch.reference import FINE, solve_on_grids
from wrcore.contact.patch.result import Patch
from wrcore.contact.rigid.height_at_load import ROLL_SLOPE, height_at_load, height_of_zero, settle
from wrcore.contact.search import reduction as columns
from wrcore.contact.search.detection import DETECTIONS, axle_direction, find_patches
from wrcore.contact.search.reduction import MAX_PATCHES, MOMENT, PATCH_COLUMNS, PENETRATION, REDUCTIONS
from wrcore.contact.search.strip import make_pose
from wrcore.contact.search.surfaces import Motion, contact_plane
from wrcore.contact.surrogate.network import load_surrogate
from wrcore.creep.laws import LAWS, creep_data
from wrcore.creep.table import ensure_table
from wrcore.errors import InputError, check_number, one_of
from wrcore.geometry.track import SIDES
from wrcore.kernels.handles import Handle
from wrcore.wheels.contact_model import COUNTERS, ON_FIXED, ON_GRID, ContactModel
from wrcore.wheels.exact_force import group_wrench, mirror
from wrcore.wheels.hertzian_force import wheel_wrenches
from wrcore.wheels.kernels import with_fallback, with_late
from wrcore.wheels.motion import MOTION, WheelMotion, as_left
from wrcore.wheels.surrogate_force import surrogate_wrenches
from wrcore.wheels.table_force import UNKNOWN, tabulated_wrench

MODELS = (*PATCHES, "grid")

GRIDS = {"coarse": ((32, 24),), "middle": ((32, 24), (40, 32)), "fine": FINE}
"""Grids of each resolution (elements along x, across)."""

DEEPEST = 1e-3  # largest overlap at a given height, m; the maximum load, 1 MN, causes 0.35 mm on a tread
LOWEST = 0.1  # largest distance of a wheelset below its rolling radius, m: lower, flanges stand on the rail's foot
SMOOTH = 1e-9  # coefficient of friction if only normal forces are needed
SLOWEST = 1e-9  # smallest speed by which creepages are divided, m/s: smaller than any speed that users can give
_CARRIED = 1e-9  # relative error of F^(2/3) at which the search for a height ends
_LEVEL = 1e-10  # step in roll at which the search for roll ends, rad

_MOST_ROLLS = 25

SIDES_BY_SIGN = {sign: side for side, sign in SIDES.items()}


class Rolling(NamedTuple):
    """Motion of a wheelset: speed V > 0 and lateral velocity (m/s), rates of rolling (NaN: free) and yaw (rad/s)."""

    speed: float
    rate: float = math.nan
    vy: float = 0.0
    yaw_rate: float = 0.0

    def motion(self, roll, yaw, rate):
        """Return the `Motion` of a wheelset with a roll, a yaw (rad) and a rate of rolling (rad/s)."""
        wx, wy, wz = (rate * c for c in axle_direction(roll, yaw))
        return Motion(self.speed, self.vy, 0.0, wx, wy, wz + self.yaw_rate, self.speed)


class Found(NamedTuple):
    """One contact patch of a wheel."""

    row: np.ndarray
    """Columns of the patch, shape (PATCH_COLUMNS,), as in runs; creepages are NaN without a motion."""
    extent: tuple
    """x_min, x_max (from the wheelset's cross-section) and width in the contact plane, m."""
    load: float
    slip: float
    """Normal force of the pressure (``load``), N, and mean of the longitudinal rigid slip weighted by the pressure."""
    patch: Patch = None
    """Patch with its fields, if the model has fields and they were requested."""
    places: np.ndarray = None
    """Both ends of its strips on the profiles of wheel and rail, shape (2, 2, strips), m."""
    on_grid: bool = False
    on_fixed: bool = False
    """Whether a grid (``on_grid``) or fixed strips (``on_fixed``) were used instead of strips."""

    @property
    def vertical(self):
        """Vertical force on the wheel, upwards positive, N."""
        angle = self.row[columns.ANGLE]
        return self.row[columns.NORMAL] * math.cos(angle) + self.row[columns.FY] * math.sin(angle)


def carried(found, vertical=True):
    """Return the load of a wheel, N, from its patches (`Found`): the vertical component of all forces, or the sum of
    normal forces."""
    return sum(one.vertical if vertical else one.row[columns.NORMAL] for one in found)


class LoadedWheels:
    """Loaded wheels of a wheelset with one patch model: a model of runs, or ``grid``, their reference.

    Strips and grids have a ``resolution`` (coarse, middle, fine) and a rigid ``slip`` (of the real surfaces, or one set
    of creepages). If strips find no solution, a grid is used. The search for contact windows takes at most ``steps``
    steps, then fixed strips are used. ``more`` are further fields of a `ContactModel`.
    """

    refines = True
    """Whether a patch without a solution on strips is solved again on finer grids."""

    def __init__(self, geometry, model="exact", resolution="middle", slip="surfaces", shear_modulus=8.2e10,
                 poisson_ratio=0.28, detection="spatial", steps=STEPS, **more):  # fmt: skip
        known = {"patch": (model, MODELS), "resolution": (resolution, RESOLUTIONS), "slip": (slip, SLIPS),
                 "detection": (detection, ("planar", "spatial"))}  # fmt: skip
        for name, (value, names) in known.items():
            if value not in names:
                raise InputError("contact", name, one_of(names, value))
        check_number(shear_modulus, 1e9, 1e12, "contact", "shear_modulus", "Pa")
        check_number(poisson_ratio, 0.0, 0.5, "contact", "poisson_ratio")
        self.geometry, self.spatial, self.always = geometry, detection == "spatial", model == "grid"
        self.shear_modulus, self.poisson_ratio = float(shear_modulus), float(poisson_ratio)
        self.modulus, self.surfaces = contact_modulus(self.shear_modulus, self.poisson_ratio), slip == "surfaces"
        self.tabulated = model == "tabulated"
        self.grids = GRIDS[resolution] if self.always else GRIDS["middle"][-1:]
        strips = strip_model("exact" if self.always or self.tabulated else model, resolution, slip, self.poisson_ratio)
        self.is_surrogate, self.is_elliptic = model == "surrogate", model in REDUCTIONS
        self._work = strip_work(strips, 1, surrogate=load_surrogate() if self.is_surrogate else None)
        self._work.normal.left[1:] = steps
        contact = ContactModel(
            geometry, hertz_table(), LAWS["she"], creep_data(self.poisson_ratio), DETECTIONS[detection], 0.0,
            REDUCTIONS.get(model, MOMENT), self.shear_modulus, self.poisson_ratio, SMOOTH, 1.0, 1.0, SLOWEST, strips,
            **more,
        )  # fmt: skip
        if strips.strips:
            contact = with_fallback(contact)
        elif self.is_surrogate:
            law = {"law": LAWS["table"], "creep": _table(self.poisson_ratio)}
            contact = contact._replace(surrogate=load_surrogate(), **law)
        self._still, self._still_handle, self._work_handle = contact, Handle(contact), Handle(self._work)
        self._rolling = {}
        self._rows, self._counters = np.zeros((MAX_PATCHES, PATCH_COLUMNS)), np.zeros(COUNTERS, np.int64)

    @property
    def contact(self):
        """`ContactModel` of wheels at rest."""
        return self._still

    def at_height(self, side, y, z, roll=0.0, yaw=0.0, rolling=None, friction=0.3, fields=False):
        """Return patches (list of `Found`, flange first; with a `Patch` if ``fields``) of one wheel.

        The wheelset is at y, z (m), with roll, then yaw about the vertical (rad). Without ``rolling`` it is at rest and
        there are no creep forces.
        """
        pose, motion, contact = (side, y, z, roll, yaw), None, self._still_handle
        if rolling is not None:
            motion = rolling.motion(roll, yaw, self._free_rate(pose, rolling))
            contact = self._at_work(friction if self.tabulated and not fields else 0.0)
        else:
            friction = SMOOTH
        found = list(self._patches(contact, pose, motion, friction, fields))
        if rolling is None:
            for one in found:
                one.row[columns.FX : columns.MZ + 1], one.row[columns.XI : columns.PHI + 1] = 0.0, math.nan
        return found

    def in_motion(self, m, fields=False, warm=False):
        """Return patches of a wheel with the `WheelMotion` of a run, for models with strips; if ``warm``, the solver
        starts from the last solutions."""
        side, motion = SIDES_BY_SIGN[m.side], Motion(*m[MOTION.vx : MOTION.wz + 1], abs(m.vx))
        pose = side, m.y, m.z, math.asin(m.ez), math.atan2(-m.ex, m.ey)
        return list(self._on_strips(self._still_handle, as_left(m), pose, motion, m.friction, fields, warm))

    def _at_work(self, looked_up=0.0):
        """Return the handle of the contact model of rolling wheels.

        It is exact, with the creep table for ellipses, or uses a pair's lookup table for the coefficient of friction
        ``looked_up`` (0: no lookup table).
        """
        if looked_up not in self._rolling:
            contact = self._still
            if looked_up or self.is_elliptic:
                contact = contact._replace(law=LAWS["table"], creep=_table(self.poisson_ratio))
            if looked_up:
                contact = with_late(contact._replace(strips=contact.strips._replace(looked_up=float(looked_up))))
            self._rolling[looked_up] = Handle(contact)
        return self._rolling[looked_up]

    def _free_rate(self, pose, rolling):
        """Return the rate of rolling, rad/s; by default that of free rolling, as slip is linear in the rate."""
        if not math.isnan(rolling.rate):
            return rolling.rate
        usual, means = rolling.speed / self.geometry.rolling_radius, []
        for rate in (usual, 1.001 * usual):
            motion = rolling.motion(*pose[3:], rate)
            patches = self._patches(self._still_handle, pose, motion, SMOOTH, None)
            means.append(sum(one.load * one.slip for one in patches))
        return usual + 1e-3 * usual * means[0] / (means[0] - means[1]) if means[0] != means[1] else usual

    def _patches(self, contact, pose, motion, friction, fields):
        """Yield `Found` of each patch by the kernels of runs; if ``fields`` is None, grids of this class are not
        used."""
        side, y, z, roll, yaw = pose
        velocity = motion[:6] if motion else (0.0,) * 6
        m = WheelMotion(*map(float, (SIDES[side], y, z, *axle_direction(roll, yaw), *velocity, 0.0, 0.0, friction)))
        if self._still.strips.strips:
            yield from self._on_strips(contact, as_left(m), pose, motion, friction, fields)
            return
        motions, counts = np.array([[m, m]]), np.zeros((1, 2), np.int64)
        rows, wheel = np.zeros((1, 2, MAX_PATCHES, PATCH_COLUMNS)), int(SIDES[side] < 0.0)
        motions[0, 1 - wheel, MOTION.z] += 1.0  # the other wheel is out of reach
        wrenches = surrogate_wrenches if self.is_surrogate else wheel_wrenches
        wrenches(contact, motions, rows, counts, np.zeros((1, 2)), np.zeros((1, 2, 6)), self._counters,
                 self._work_handle)  # fmt: skip
        for one in rows[0, wheel, : counts[0, wheel]]:
            a, b, x = float(one[columns.SEMI_A]), float(one[columns.SEMI_B]), float(one[columns.X])
            if self.is_elliptic:
                one[columns.P_MAX] = 1.5 * one[columns.NORMAL] / (math.pi * a * b)
            yield Found(one, (x - a, x + a, 2.0 * b), float(one[columns.NORMAL]), float(one[columns.XI]))

    def _on_strips(self, contact, left, pose, motion, friction, fields, warm=False):
        """Yield `Found` of each group of overlaps that is one patch; a right wheel is the mirror image of a left
        wheel."""
        sign, work, overlaps = SIDES[pose[0]], self._work, self._rows
        if not fields and (motion is None or fields is None):
            left = left._replace(friction=0.0)  # without friction no rolling problem is solved
        count = find_patches(self.geometry, *left[:6], self.spatial, MOMENT, overlaps)
        out, wrench, first, group = np.zeros((1, PATCH_COLUMNS)), np.zeros(6), 0, 0
        while first < count:
            last, before = group_end(self.geometry, overlaps, count, first), self._counters.copy()
            memory = work.memory[0, int(sign < 0.0), group]
            if not warm:
                memory[0] = 0.0
            found = UNKNOWN
            if contact.value.strips.looked_up:
                found = tabulated_wrench(contact, left, self.spatial, overlaps, first, last, out[0], wrench,
                                         self._counters, self._work_handle)  # fmt: skip
            if found.load < 0.0:
                found = group_wrench(contact, left, self.spatial, overlaps, first, last, out[0], wrench,
                                     self._counters, memory, self._work_handle)  # fmt: skip
            sums = work.sums
            x = out[0, columns.X] - sums[solve.MEAN_X]
            extent = x + sums[solve.X_MIN], x + sums[solve.X_MAX], sums[solve.S_MAX] - sums[solve.S_MIN]
            if sign < 0.0:
                mirror(out, 1, wrench)
            on_grid, on_fixed = self._counters[[ON_GRID, ON_FIXED]] > before[[ON_GRID, ON_FIXED]]
            rough = fields is not None and self._is_rough((pose[0], group), left, first, last, on_grid)
            if on_grid and not (self.refines or rough):
                x, a, b = out[0, [columns.X, columns.SEMI_A, columns.SEMI_B]]
                yield Found(out[0].copy(), (x - a, x + a, 2.0 * b), found.load, found.xi, on_grid=True)
            elif fields is not None and (self.always or on_grid or rough):
                yield self._on_grid(out[0].copy(), left, first, last, pose, motion, friction)._replace(slip=found.xi)
            else:
                has = {"on_fixed": on_fixed}
                if fields:
                    strips, back = self._still.strips, left.vx < 0.0
                    has |= {"patch": patch_of_strips(work, strips, out[0], found.load, pose, friction, back)}
                    has |= {"places": ends_on_profiles(work)}
                yield Found(out[0].copy(), tuple(map(float, extent)), found.load, found.xi, **has)
            first, group = last, group + 1

    def _is_rough(self, which, left, first, last, on_grid):
        """Whether a patch (side, number) is to be solved on grids although strips, or a grid, have a solution."""
        return False

    def _on_grid(self, row, left, first, last, pose, motion, friction):
        """Return `Found` of a patch on grids, in the plane of its overlaps; the creepages are those of the strips."""
        side, y, z, roll, yaw = pose
        if left.vx < 0.0:
            raise InputError("contact", "motion", "expected a wheel that rolls ahead where strips find no solution")
        sign, depth = SIDES[side], self._rows[first:last, PENETRATION].max()
        frame = frame_of_overlaps(self.geometry, make_pose(*left[:6], self.spatial), self._rows, first, last)
        angle = sign * math.atan2(frame.sine, frame.cosine)
        origin = frame.x, sign * (frame.ur + self.geometry.rail_distance), frame.z
        rigid, (cosine, sine) = (0.0, 0.0, 0.0), (math.cos(angle), math.sin(angle))
        if motion is not None and self.surfaces:
            rigid = motion
        elif motion is not None:  # at the undeformed wheel's material point above the frame's origin
            place = origin[0], origin[1] + depth * sine - y, origin[2] - depth * cosine - z
            rigid = creepages(*motion[:6], *place, cosine, sine, motion.speed)[:3]
        axle = (sign * c for c in axle_direction(roll, yaw))
        solved = solve_on_grids(
            self.geometry, make_pose(sign, y, z, *axle, self.spatial), contact_plane(*origin, angle), rigid, friction,
            self.shear_modulus, self.poisson_ratio, self.grids,
        )  # fmt: skip
        patch = replace(solved, pose=(y, z, roll, yaw))
        mean_x, mean_s = patch.centroid
        load = patch.pressure * patch.cell_area
        row[[columns.SEMI_A, columns.SEMI_B]] = [
            math.sqrt(5.0 * max(load @ (q - mean) ** 2 / max(load.sum(), 1e-30), 1e-14))
            for q, mean in ((patch.x, mean_x), (patch.s, mean_s))
        ]
        row[[columns.X, columns.Y, columns.Z]] = np.array(origin) + [mean_x, mean_s * cosine, mean_s * sine]
        row[[columns.ANGLE, columns.NORMAL, columns.P_MAX]] = patch.contact_angle, patch.normal, patch.p_max
        row[columns.FX : columns.MZ + 1] = patch.fx, patch.fs, patch.mn + mean_s * patch.fx - mean_x * patch.fs
        x_min, x_max, s_min, s_max = patch.extent
        extent = origin[0] + x_min, origin[0] + x_max, s_max - s_min
        return Found(row, extent, patch.normal, math.nan, patch, on_grid=True)

    def placed(self, sides, y, yaw, known, load, how, told):
        """Return roll (rad), and height of the wheelset (m) by side.

        Of ``known``, its roll and z, NaN values are computed for the load (see `loaded_poses`), with arguments ``how``
        of `height`. InputError (source and field ``told``) if a wheel penetrates its rail by more than `DEEPEST`.
        """
        roll, z = known
        if math.isnan(z) and math.isnan(roll):
            roll, z = self.settled(y, load, yaw, **how)
        elif math.isnan(z):
            return roll, {side: self.height(side, y, load, roll, yaw, **how) for side in sides}
        else:
            roll = 0.0 if math.isnan(roll) else roll
            for side in sides:
                axle = (SIDES[side] * c for c in axle_direction(roll, yaw))
                lifted = (SIDES[side], y, z + DEEPEST, *axle, self.spatial)
                low = z < self.geometry.rolling_radius - LOWEST
                if low or find_patches(self.geometry, *lifted, MOMENT, self._rows):
                    raise InputError(*told, f"expected at most {1e3 * DEEPEST:g} mm of overlap, got z = {z:g} m")
        return roll, dict.fromkeys(sides, z)

    def height(self, side, y, load, roll=0.0, yaw=0.0, rolling=None, friction=0.3, vertical=True, guess=math.nan):
        """Return the height z (m) of the wheelset at which one wheel carries a load (N), searched near ``guess`` (m);
        NaN if there is none. The load is the vertical component of all forces, or the sum of the normal forces.
        """
        goal = load ** (2.0 / 3.0)
        solved = self.is_elliptic and rolling is None and vertical  # Hertz's law at rest needs no search

        def excess(z):
            force = carried(self.at_height(side, y, z, roll, yaw, rolling, friction), vertical)
            rest = max(force, 0.0) ** (2.0 / 3.0) - goal
            return 0.0 if abs(rest) < _CARRIED * goal else rest

        if math.isnan(guess) or solved:
            guess = height_at_load(
                self.geometry, self._still.hertz, self.modulus, SIDES[side], y, roll, yaw, self.spatial,
                self._still.reduction, load, self.geometry.rolling_radius, self._rows,
            )  # fmt: skip
        return guess if math.isnan(guess) or solved else height_of_zero(excess, guess)

    def settled(self, y, load, yaw=0.0, rolling=None, friction=0.3, vertical=True):
        """Return roll (rad) and height (m) at which each wheel carries a load, NaN if there are none; arguments are
        those of `height`."""
        roll, z = settle(self.geometry, self.geometry, self._still.hertz, self.modulus, y, yaw, self.spatial,
                         self._still.reduction, load, self.geometry.rolling_radius)  # fmt: skip
        if math.isnan(z) or (self.is_elliptic and rolling is None and vertical):
            return roll if not math.isnan(z) else math.nan, z
        return self._levelled(roll, z, y, load, yaw, rolling, friction, vertical)

    def _levelled(self, roll, z, y, load, yaw, rolling, friction, vertical):
        """Compute roll (rad) and height (m) at which each wheel carries a load by a secant method, from initial
        guesses."""
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
                if abs(difference) < _LEVEL:
                    return roll, 0.5 * (left + right)
                slope = ROLL_SLOPE  # a height has jumped, and the slope is that of the jump
                step = difference / slope
            roll -= step
            left, right = left - 0.5 * slope * step, right + 0.5 * slope * step
        return math.nan, math.nan


@lru_cache(maxsize=4)
def _table(nu):
    return creep_data(nu, ensure_table(nu).kernel_data())
