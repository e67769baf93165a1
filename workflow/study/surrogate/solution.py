"""Contact patches at given positions: descriptors, exact solution, and the targets of the network.

The targets are computed with the kernels of wrcore. A network that reproduces them reproduces exact contact in
`wrcore.wheels.surrogate_force`:

* Corrections (N_CORRECTIONS): ln N, ln a, ln b and ln p_max minus their values for the parabolic overlap; position
  along and across the patch over l, contact angle and height over l. The last ones are relative to the parabolas of
  `PatchShape` at the exact position across the patch and the exact semi-axis b.
* Remainder: creep force of the exact solution minus that of the creep table at the exact ellipse, load, position and
  angle, at `POINTS` creepages of a rolling wheel. Forces are divided by friction times N, moments also by c.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from study.surrogate.finding import LIMITS, LOAD, LOG_A, LOG_B, P_MAX, PLACE, fill_base, find_described, first_touch
from wrcore.analysis.contact.loaded import LoadedWheels
from wrcore.contact.normal.windows import BLENDING_RATIO
from wrcore.contact.patch.model import strip_work, with_tables
from wrcore.contact.rigid.wheel_on_rail import WheelOnRail
from wrcore.contact.search.reduction import MAX_PATCHES, PATCH_COLUMNS
from wrcore.contact.surrogate.descriptors import N_DESCRIPTORS, PatchShape, parabola_at
from wrcore.contact.surrogate.network import N_CORRECTIONS
from wrcore.contact.surrogate.strips import new_strips
from wrcore.creep.kalker import coefficients_at
from wrcore.creep.laws import LAWS
from wrcore.geometry.profiles.standards import named_profile
from wrcore.kernels.handles import Handle
from wrcore.wheels.contact_model import without_wheels
from wrcore.wheels.surrogate_patch import _MOST_ANGLE, _MOST_LOG_AXIS, _MOST_LOG_LOAD, _MOST_SHIFT, _MOST_WIDTH, bounded
from wrcore.wheels.table import lookup as columns
from wrcore.wheels.table.lookup import DISK
from wrcore.wheels.table.node import (
    AT_REST,
    NUMBERS,
    SLIPS,
    SUMS,
    along_normal,
    press_lobe,
    roll_lobe_on,
    rolling_slip,
    slide,
)

N_RANDOM = 12
"""Number of rolling solutions at random creepages, in addition to five near rest."""

POINTS = len(AT_REST) + N_RANDOM
"""Number of rolling solutions of each patch; those near rest come first."""

MOST_CREEPAGE = 0.5
"""Maximum creepage of a rolling solution. Without this bound, small patches with high friction would need creepages
above that of a locked wheel to slide."""

MOST_FOUND = 4
"""Maximum number of patches at one position."""

END_MARGIN = 2e-4
"""Minimum distance between a patch and the end of a profile, m. Patches that are cut off by the end of a profile have
ten times the pressure of an ellipse."""


class Found(NamedTuple):
    """A contact patch at a position of the wheelset, without its solution."""

    position: np.ndarray
    """(5,): y and z of the wheelset's centre (m) and the direction of its axle."""
    numbers: np.ndarray
    """(6,): columns `PLACE` to `P_MAX` of `study.surrogate.finding`."""
    descriptors: np.ndarray
    """(N_DESCRIPTORS,): inputs of the network before scaling."""
    shape: PatchShape


class Solved(NamedTuple):
    """Exact solution of a contact patch and the targets of the network."""

    load: float
    """Normal force, N."""
    angle: float
    """Contact angle, rad."""
    corrections: np.ndarray
    """(N_CORRECTIONS,): targets for the corrections."""
    exact: np.ndarray
    base: np.ndarray
    """(POINTS, 3): creep forces and moment of the exact solution (``exact``) and of the creep table (``base``); forces
    over friction times N, moments over friction times N times c."""
    disk: np.ndarray
    """(POINTS, 2): position of the creepages in the disk of the force modes."""
    velocities: np.ndarray
    """(POINTS, 6): linear and angular velocity of the wheelset, divided by its velocity along the track."""


def random_points(random, count=N_RANDOM):
    """Return random creepages (count, 2), divided by those of saturation.

    They are uniformly distributed over the disk of the force modes up to the radius 0.965."""
    r, angle = 0.965 * np.sqrt(random.random(count)), 2.0 * math.pi * random.random(count)
    return 2.0 * DISK * np.stack([r * np.cos(angle), r * np.sin(angle)], 1) / (1.0 - r[:, None] ** 2)


def unbounded(x, bound):
    """Return the inverse of `wrcore.wheels.surrogate_patch.bounded` at x; |x| is limited to 0.95 of the bound."""
    half = 0.5 * bound
    over = min(abs(x), 0.95 * bound) - half
    if not over > 0.0:
        return x
    return math.copysign(half + over / math.sqrt(1.0 - (over / half) ** 2), x)


@lru_cache(maxsize=1)
def _template():
    """Return the `ContactModel` of exact contact at the resolution ``middle`` with the creep table.

    Its geometry and its friction are replaced for each pair."""
    pair = WheelOnRail(named_profile("S1002", "wheel"), named_profile("60E1", "rail", 1 / 40))
    exact, table = (LoadedWheels(pair.geometry, name, "middle").contact for name in ("exact", "surrogate"))
    return without_wheels(exact, law=LAWS["table"], creep=table.creep, strips=with_tables(exact.strips), damping=1.0)


@lru_cache(maxsize=1)
def _works():
    """Return the work arrays of two solutions, with fewer and with more strips."""
    return [Handle(strip_work(_template().strips, 1, SLIPS)) for _ in range(2)]


class ExactPatches:
    """Exact contact of a `WheelOnRail` at one coefficient of friction: search and solution of its contact patches."""

    def __init__(self, pair, friction):
        self.pair = pair
        self.model = _template()._replace(geometry=pair.geometry, friction=float(friction))
        self._handle, self._strips = Handle(self.model), new_strips()
        self._rows, self._row, self._sums = (
            np.zeros((MAX_PATCHES, PATCH_COLUMNS)),
            np.zeros(PATCH_COLUMNS),
            np.zeros((3, 5)),
        )
        self._numbers, self._shapes = np.zeros((MOST_FOUND, 6)), np.zeros((MOST_FOUND, len(PatchShape._fields)))
        self._descriptors = np.zeros((MOST_FOUND, N_DESCRIPTORS))

    def touch(self, y, axle):
        """Return the height of the wheelset's centre at first contact, m."""
        return first_touch(self.model.geometry, y, *axle)

    def find(self, y, z, axle):
        """Return the list of the patches (`Found`) at a position of the wheelset."""
        position, zeros = np.array([y, z, *axle]), np.zeros(N_CORRECTIONS)
        n = find_described(
            self._handle, position, self._rows, self._row, self._sums, self._strips, zeros, zeros, self._numbers,
            self._descriptors, self._shapes,
        )  # fmt: skip
        return [
            Found(position, self._numbers[k].copy(), self._descriptors[k].copy(), PatchShape(*self._shapes[k]))
            for k in range(n)
        ]

    def is_inside(self, found):
        """Whether a patch is far enough from the ends of both profiles, which would cut off its overlap."""
        half_width = 3.0 * found.shape.sigma * math.cos(found.shape.angle)  # a parabolic overlap ends at 2.65 sigma
        wheel, rail, margin = self.pair.wheel.u, self.pair.rail.u, END_MARGIN + half_width
        return (
            rail[0] + margin < found.shape.lateral < rail[-1] - margin
            and wheel[0] + margin < found.numbers[PLACE] < wheel[-1] - margin
        )

    def _press(self, found):
        """Return the sums of `press_lobe` and the list of solutions (weight, frame, work) of which they are the mean.

        Return None if the strips have no solution."""
        y, z, *axle = found.position
        free = np.array([1.0, 0.0, 0.0, *(np.array(axle) / self.model.geometry.rolling_radius)])
        sums, each, pressed = np.zeros(SUMS), np.zeros(SUMS), []
        for work, more in zip(_works(), (1.0, BLENDING_RATIO), strict=True):
            windows, frame, share = press_lobe(
                self._handle, y, z, tuple(axle), found.numbers[PLACE], LIMITS, free, more, each, work
            )
            if windows == 0:
                return None
            weight = 1.0 - pressed[0][0] if pressed else 1.0 - max(share, 0.0)
            pressed.append((weight, frame, work))
            sums += weight * each
            if weight == 1.0:
                break
        return sums, pressed

    def _wrenches(self, found, pressed, velocities):
        """Return the wrenches of friction (n, 6) about the wheelset's centre for velocities (n, 6)."""
        y, z, *axle = found.position
        total = np.zeros((len(velocities), 6))
        for weight, frame, work in pressed:
            for first in range(0, len(velocities), SLIPS):
                some, count = velocities[first : first + SLIPS], work.value.solved[0]
                slips, forces = (np.zeros((len(some), rows, count)) for rows in (4, 3))
                wrenches = np.zeros((len(some), 6))
                roll_lobe_on(self._handle, y, z, tuple(axle), frame, some, slips, forces, wrenches, work)
                total[first : first + SLIPS] += weight * wrenches
        return total

    def solve(self, found, points):
        """Return the solution (`Solved`) near rest and at ``points`` (N_RANDOM, 2), or None if the strips have none.

        The ``points`` are creepages divided by those of saturation."""
        pressed = self._press(found)
        if pressed is None:
            return None
        sums, solutions = pressed
        slip, (a, b), load = sums[6:9].copy(), sums[9:11], math.hypot(sums[1], sums[2])
        cosine, sine, limit = sums[2] / load, -sums[1] / load, self.model.friction * load
        angle, log_a, log_b, c = math.atan2(sine, cosine), math.log(a), math.log(b), math.sqrt(a * b)
        velocities = self._velocities(found, slip, angle, log_a, log_b, limit, np.vstack([AT_REST, points]))
        exact, base, disk = np.zeros((POINTS, 3)), np.zeros((POINTS, 3)), np.zeros((POINTS, 2))
        wrenches = self._wrenches(found, solutions, velocities)
        along_normal(wrenches, tuple(slip), cosine, sine, c, limit, exact)
        fill_base(self._handle, velocities, tuple(slip), log_a, log_b, angle, limit, base, disk)
        numbers = math.log(load), log_a, log_b, math.log(sums[11])
        corrections = self._corrections(found, slip, angle, b, numbers)
        solved = Solved(load, angle, corrections, exact, base, disk, velocities)
        return solved if all(np.isfinite(part).all() for part in solved) else None

    def _velocities(self, found, slip, angle, log_a, log_b, limit, points):
        """Return the velocities (n, 6) of a rolling wheel, divided by its velocity along the track.

        The ``points`` are creepages, divided by those of saturation, at the position ``slip`` of the contact."""
        geometry, axle, numbers = self.model.geometry, found.position[2:], np.zeros(NUMBERS)
        numbers[columns.ANGLE] = angle
        numbers[columns.PLACE_X : columns.PLACE_Z + 1] = (
            slip - geometry.half_distance * axle + [0.0, 0.0, geometry.rolling_radius]
        )
        free = rolling_slip(numbers, axle[2], axle[0], geometry.half_distance, geometry.rolling_radius, 0.0, 0.0)
        kalker = np.array(coefficients_at(log_a - log_b, self.model.creep.table.kalker)[:2])
        unit = self.model.shear_modulus * math.exp(log_a + log_b) / (3.0 * limit)
        creepages = np.clip(points / (kalker * unit), -MOST_CREEPAGE, MOST_CREEPAGE)
        velocities = np.empty((len(points), 6))
        # `slide` refers creepages to the speed of the free wheel (1), ``points`` to the speed with creepage
        slide(free, tuple(slip), math.cos(angle), creepages / (1.0 - creepages[:, :1]), velocities)
        return velocities / velocities[:, :1]

    def _corrections(self, found, slip, angle, b, numbers):
        """Return the corrections (N_CORRECTIONS,) with which `surrogate_force` reproduces the exact solution.

        The solution is the position ``slip``, the contact angle, b, and ``numbers``: ln of N, a, b and p_max."""
        shape, base, y = found.shape, found.numbers, found.position[0]
        lateral = slip[1] + y - self.model.geometry.rail_distance - shape.lateral
        e = lateral / (shape.sigma * math.cos(shape.angle))
        spread = bounded(0.2 * (b / shape.sigma) ** 2, 2.0 * _MOST_WIDTH)
        of_angle = parabola_at(shape.angle, shape.angle_1, shape.angle_2, shape.third, e, spread)
        ahead = parabola_at(shape.ahead, shape.ahead_1, shape.ahead_2, shape.third, e, spread)
        height = parabola_at(shape.height, shape.height_1, shape.height_2, shape.third, e, spread)
        load, log_a, log_b, log_peak = numbers
        return np.array(
            [
                unbounded(load - math.log(base[LOAD]), _MOST_LOG_LOAD),
                unbounded(log_a - base[LOG_A], _MOST_LOG_AXIS),
                unbounded(log_b - base[LOG_B], _MOST_LOG_AXIS),
                unbounded(log_peak - math.log(base[P_MAX]), 2.0 * _MOST_LOG_AXIS),
                unbounded((slip[0] - ahead) / shape.length, 1.0),
                unbounded(e, _MOST_SHIFT) * shape.sigma / shape.length,
                unbounded(angle - of_angle, _MOST_ANGLE),
                unbounded((slip[2] - height) / shape.length, 1.0),
            ]
        )
