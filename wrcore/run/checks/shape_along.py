"""Patches of a run whose surfaces along the rail are no parabola: flats, bumps, joints, noses of crossings.

Runs know the gap along the rail by one parabola per place across. Where the real gap leaves it within a patch by more
than `ROUGH` of the penetration, the maximum pressure of that patch may be too low; single positions of a wheelset are
solved on a grid there (`wrcore.analysis.contact.on_slices`). Runs count such patches at their output times, from the
section of the real surfaces along the middle of each patch. They are compared with the parabola that the run's tables
hold: of a wheelset in the middle without yaw, a yaw moves it along the rail.
"""

import math
from functools import cached_property, partial

import numpy as np

from wrcore.contact.changing_rails.out_of_round import STEP, SlicedWheel
from wrcore.contact.changing_rails.sections import AHEAD, BEND, HEIGHT, WheelOnSlices
from wrcore.contact.search import reduction
from wrcore.geometry.changing_rails.slices import TURN, RailSlices
from wrcore.geometry.track import SIDES
from wrcore.kernels.cache import warn

ROUGH = 0.05
"""Share of its largest penetration by which a patch's gap may leave, on a strip and within its length, the parabola
that strips know. A wave h cos(pi x/a) on a length 2a is flattened by a pressure pi E* h/(2a), Hertz's largest is
2 E* d/(pi a): this share moves it by pi^2/4 of itself, 12 %, half a wave on that length by half as much."""

NAME = "not_parabolic"
"""Counter of such patches; with a wheelset and a side behind it, of output times at which that wheel has one."""

STATIONS = 41
"""Over the length of a patch, where its gap is compared."""

ACROSS = 5e-4
"""Distance of lateral coordinates at which slices are taken, m."""

LEAST_STEP, LARGEST_STEP, PER_SLICE = 1e-3, 1e-2, 10
"""Distance of sections of a rail, m, and their number between two slices of a rail whose heads go through."""

LENGTH = 2.0
"""Length of rail whose sections are taken at a time, m."""

_AT_A_TIME = 2000  # patches, for memory: 3 MB an array


class ShapesAlong:
    """Surfaces along the rail of the wheels of a scene whose rails or wheels change, side by side as in its tables."""

    def __init__(self, scene):
        self._scene, self._grids, self._flat = scene, {}, {}
        vehicle = scene.vehicle
        self._names = vehicle.wheelset_names
        self._pairs = scene.pairs or (scene.alike,) * (2 * len(self._names))
        self._starts = vehicle.positions[vehicle.bodies.wheelsets, 0]

    @cached_property
    def _changing(self):
        """By the number of each wheel that has any, arc lengths (m) between which heights below it change, and the
        function that returns them."""
        scene, found = self._scene, {}
        for number in range(len(self._pairs)):
            side = number % 2
            heights = [
                (*one.ends, partial(_of_rail, one.rails[side], one)) for one in scene.crossings if one.rails[side]
            ]
            shape, angle = scene.out_of_round[number] if scene.out_of_round else (None, 0.0)
            if shape is not None:
                heights.append((-np.inf, np.inf, partial(self._of_wheel, number, shape, angle)))
            if (wave := scene.corrugation) and list(SIDES)[side] in wave.sides:
                heights.append((wave.begin, wave.begin + wave.length, partial(_of_wave, wave)))
            if heights:
                found[number] = heights
        return found

    def counts(self, patches, s, yaw):
        """Counters of ``patches`` (n, k, 2, MAX_PATCHES, PATCH_COLUMNS), NaN where there is none, of wheelsets at arc
        lengths ``s`` (m) with a ``yaw`` (rad), (n, k): `NAME`, and that of each wheel that has any."""
        counts = {NAME: 0}
        for number in self._changing:
            k, side = divmod(number, 2)
            rough = self.rough(number, patches[:, k, side], s[:, k], yaw[:, k])
            if rough.any():
                counts[NAME] += int(rough.sum())
                counts[f"{NAME}_{self._names[k]}_{list(SIDES)[side]}"] = int(rough.any(axis=1).sum())
        return counts

    def rough(self, number, patches, s, yaw):
        """Whether patches (n, MAX_PATCHES, PATCH_COLUMNS) of a wheel, by number, are rough: bool (n, MAX_PATCHES)."""
        found = np.zeros(patches.shape[:2], bool)
        present = np.isfinite(patches[..., reduction.NORMAL])
        for low, high, heights in self._changing.get(number, ()):
            at, which = np.nonzero(present & ((s > low) & (s < high))[:, None])
            for first in range(0, at.size, _AT_A_TIME):
                part = slice(first, first + _AT_A_TIME)
                i, j = at[part], which[part]
                found[i, j] |= self._misfits(number, patches[i, j], s[i], yaw[i], heights) > ROUGH
        return found

    def _misfits(self, number, rows, s, yaw, heights):
        """By how much the gap leaves the parabola within patches (m, PATCH_COLUMNS), over their penetrations, (m,)."""
        pair, sign = self._flat_pair(number), (1.0, -1.0)[number % 2]
        u = rows[:, reduction.U_WHEEL] + pair.half_distance - pair.rail_distance
        curvature, lead = pair.strips(u)
        below = -sign * np.sin(yaw) * (pair.half_distance + lead)  # where the round wheel would touch a level rail

        def height(x):  # (n, m): of the surfaces above those of a round wheel on a level rail
            return heights(s, below, x, rows[:, reduction.U_RAIL], rows[:, reduction.U_WHEEL], 1.0 / curvature)

        seen = pair.turned(np.zeros(1), u, lambda _, x, __: height(np.repeat(x[:, None], u.size, axis=1)))[0]
        middle, half = rows[:, reduction.X] - below, rows[:, reduction.SEMI_A]
        x = middle + half * np.linspace(-1.0, 1.0, STATIONS)[:, None]
        fitted = seen[HEIGHT] - (seen[BEND] + 0.5 * curvature) * (x - seen[AHEAD]) ** 2
        real = height(x) - (1.0 - np.sqrt(1.0 - (curvature * x) ** 2)) / curvature
        off = np.nan_to_num(np.abs(fitted - real), nan=np.inf).max(axis=0)  # NaN: no rail, on part of the patch
        return off / np.maximum(rows[:, reduction.PENETRATION], 1e-9)

    def _flat_pair(self, number):
        """`WheelOnSlices` of a wheel, round, on the plain rail."""
        pair = self._pairs[number]
        if id(pair) not in self._flat:
            sizes = pair.rolling_radius, pair.half_distance, pair.rail_distance
            self._flat[id(pair)] = WheelOnSlices(pair.wheel, RailSlices.of(pair.rail), *sizes)
        return self._flat[id(pair)]

    def _of_wheel(self, number, shape, angle, s, below, x, u_rail, u_wheel, radii):
        """How much further down a wheel out of round reaches, from the round wheel with which a run begins."""
        both = self._pairs[number - number % 2 : number - number % 2 + 2]
        radius, start = 0.5 * sum(pair.rolling_radius for pair in both), self._starts[number // 2]
        turned, share = angle + (s - start) / radius, _eased(np.abs(s - start) / (math.pi * radius))
        if not isinstance(shape, SlicedWheel):
            return share * shape.reach(radii, turned, x)[:, 0]
        pair = self._pairs[number]
        if id(shape) not in self._grids:
            self._grids[id(shape)] = _grid_of(shape, pair.wheel)
        low, f = self._grids[id(shape)]
        at = (
            np.remainder(turned + np.arcsin(x / radii), TURN) / STEP,
            np.broadcast_to((u_wheel - low) / ACROSS, x.shape),
        )
        real = pair.rolling_radius - _between(f, *at)
        return share * (np.sqrt(real**2 - x**2) - np.sqrt(radii**2 - x**2))


def _grid_of(shape, wheel):
    """First wheel coordinate (m) and heights of a wheel of slices at angles `STEP` and coordinates `ACROSS` apart."""
    strips = np.arange(math.ceil(wheel.u[0] / ACROSS), wheel.u[-1] / ACROSS) * ACROSS
    first, last = shape.within(strips)
    angles = STEP * np.arange(math.ceil(TURN / STEP) + 1)
    return strips[first], shape.slices.heights(angles, strips[first : last + 1])[0]


def _between(values, i, j):
    """Values (n, m) at broken indices, as at its ends beyond these, by bilinear interpolation."""
    (n, m), shape = values.shape, np.shape(i)
    i, j = np.clip(i, 0.0, n - 1.0), np.clip(j, 0.0, m - 1.0)
    low, left = np.minimum(i.astype(int), n - 2), np.minimum(j.astype(int), m - 2)
    up, right = i - low, j - left
    before = values[low, left] + right * (values[low, left + 1] - values[low, left])
    behind = values[low + 1, left] + right * (values[low + 1, left + 1] - values[low + 1, left])
    return np.reshape(before + up * (behind - before), shape)


def _eased(part):
    """Smooth step from 0 to 1, by which runs go over into what changes."""
    part = np.clip(part, 0.0, 1.0)
    return part * part * (3.0 - 2.0 * part)


def _of_wave(wave, s, below, x, u_rail, u_wheel, radii):
    """How much higher a corrugated rail is."""
    share = _eased(np.minimum(s - wave.begin, wave.begin + wave.length - s) / wave.fade)
    place = s + below + x - wave.begin
    return share * wave.reach(np.zeros(1), 0.0, place.ravel()).reshape(place.shape)


def _of_rail(rail, crossing, s, below, x, u_rail, u_wheel, radii):
    """Heights of a rail of slices, in parts of it so long that its sections fit into memory."""
    place = s + below + x - crossing.at
    place = -place if crossing.backwards else place
    step = LEAST_STEP
    if not rail.begins().size and rail.s.size > 1:
        step = float(np.clip(np.diff(rail.s).min() / PER_SLICE, LEAST_STEP, LARGEST_STEP))
    found, middle = np.empty(place.shape), place[len(place) // 2]
    u = ACROSS * np.arange(math.floor(u_rail.min() / ACROSS), math.ceil(u_rail.max() / ACROSS) + 2)
    part = np.floor(middle / LENGTH)
    for one in np.unique(part):
        here = np.flatnonzero(part == one)
        low, high = place[:, here].min(), place[:, here].max()
        sections = rail.heights(low + step * np.arange(math.ceil((high - low) / step) + 2), u)[0]
        at = (place[:, here] - low) / step, np.broadcast_to((u_rail[here] - u[0]) / ACROSS, place[:, here].shape)
        found[:, here] = _between(sections, *at)
    return found


def warn_of_shapes(source, counters, rate):
    """Warn of patches that are no parabola along the rail: on which wheels, and at how many output times, which are at
    a ``rate`` (1/s)."""
    if not counters.get(NAME):
        return
    wheels = {name.removeprefix(f"{NAME}_"): n for name, n in counters.items() if name.startswith(f"{NAME}_")}
    said = ", ".join(f"{name} at {n} output times ({n / rate:.3g} s)" for name, n in wheels.items())
    warn(
        f"{source}: surfaces along the rail are no parabola within patches of {said}: their maximum pressure may be too"
        " low, by up to a quarter where it was measured; 'wrcore contact --patch grid' takes the real surfaces"
    )
