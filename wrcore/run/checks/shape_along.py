"""Count contact patches of a run whose gap along the rail is not a parabola: flats, bumps, joints, crossing noses.

Runs approximate the gap along the rail by one parabola per lateral coordinate. If the real gap within a patch differs
from it by more than `ROUGH` times the penetration, the maximum pressure of that patch may be too low. For single
positions of a wheelset such patches are solved on a grid (`wrcore.analysis.contact.on_slices`). Runs count them at
their output times, from the section of the real surfaces along the middle of each patch. It is compared with the
parabola in the run's tables, which is that of a centred wheelset without yaw; yaw shifts the parabola along the rail.
"""

import math
from functools import cached_property, partial

import numpy as np

from wrcore.contact.changing_rails.out_of_round import STEP, SlicedWheel
from wrcore.contact.changing_rails.sections import AHEAD, BEND, HEIGHT, WheelOnSlices
from wrcore.contact.search import reduction
from wrcore.errors.messages import warn
from wrcore.geometry.changing_rails.slices import TURN, RailSlices
from wrcore.geometry.track import SIDES

ROUGH = 0.05
"""Largest difference between the gap on a strip of a patch and the parabola of the strips, relative to the patch's
largest penetration d. A wave h cos(pi x/a) on a length 2a is flattened by a pressure pi E* h/(2a). Hertz's maximum is
2 E* d/(pi a). Thus h = 0.05 d changes the maximum pressure by pi^2/4 times 0.05, 12 %; half a wave on that length
changes it by half as much."""

NAME = "not_parabolic"
"""Counter of such patches. Followed by a wheelset and a side, it counts output times at which that wheel has one."""

STATIONS = 41
"""Number of points over the length of a patch at which its gap is compared."""

ACROSS = 5e-4
"""Distance between lateral coordinates at which slices are evaluated, m."""

LEAST_STEP, LARGEST_STEP, PER_SLICE = 1e-3, 1e-2, 10
"""Smallest and largest distance between sections of a rail, m, and their number between two slices of a rail with a
continuous head."""

LENGTH = 2.0
"""Length of rail whose sections are evaluated at a time, m."""

_AT_A_TIME = 2000  # number of patches evaluated at a time, to save memory: 3 MB an array


class ShapesAlong:
    """Real surfaces along the rail of a scene's wheels, for wheels out of round and rails that vary along the track."""

    def __init__(self, scene):
        self._scene, self._grids, self._flat = scene, {}, {}
        vehicle = scene.vehicle
        self._names = vehicle.wheelset_names
        self._pairs = scene.wheels
        self._starts = vehicle.positions[vehicle.bodies.wheelsets, 0]

    @cached_property
    def _changing(self):
        """Varying surfaces by the number of the wheel: a list of first and last arc length (m) and the function that
        returns the heights between them."""
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
        """Return counters of patches that are not parabolic: `NAME`, and one of each wheel that has such patches.

        ``patches`` have shape (n, k, 2, MAX_PATCHES, PATCH_COLUMNS), NaN where absent; ``s``, arc lengths of the
        wheelsets (m), and ``yaw`` (rad) have shape (n, k).
        """
        counts = {NAME: 0}
        for number in self._changing:
            k, side = divmod(number, 2)
            rough = self.rough(number, patches[:, k, side], s[:, k], yaw[:, k])
            if rough.any():
                counts[NAME] += int(rough.sum())
                counts[f"{NAME}_{self._names[k]}_{list(SIDES)[side]}"] = int(rough.any(axis=1).sum())
        return counts

    def rough(self, number, patches, s, yaw):
        """Whether patches (n, MAX_PATCHES, PATCH_COLUMNS) of a wheel exceed `ROUGH`, bool (n, MAX_PATCHES)."""
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
        """Return the largest difference (m,) of gap and parabola within patches (m, PATCH_COLUMNS), relative to their
        penetration."""
        pair, sign = self._flat_pair(number), (1.0, -1.0)[number % 2]
        u = rows[:, reduction.U_WHEEL] + pair.half_distance - pair.rail_distance
        curvature, lead = pair.strips(u)
        below = -sign * np.sin(yaw) * (pair.half_distance + lead)  # contact point of a round wheel on a level rail

        def height(x):  # (n, m): height of the surfaces above those of a round wheel on a level rail
            return heights(s, below, x, rows[:, reduction.U_RAIL], rows[:, reduction.U_WHEEL], 1.0 / curvature)

        seen = pair.turned(np.zeros(1), u, lambda _, x, __: height(np.repeat(x[:, None], u.size, axis=1)))[0]
        middle, half = rows[:, reduction.X] - below, rows[:, reduction.SEMI_A]
        x = middle + half * np.linspace(-1.0, 1.0, STATIONS)[:, None]
        fitted = seen[HEIGHT] - (seen[BEND] + 0.5 * curvature) * (x - seen[AHEAD]) ** 2
        real = height(x) - (1.0 - np.sqrt(1.0 - (curvature * x) ** 2)) / curvature
        off = np.nan_to_num(np.abs(fitted - real), nan=np.inf).max(axis=0)  # NaN: no rail under part of the patch
        return off / np.maximum(rows[:, reduction.PENETRATION], 1e-9)

    def _flat_pair(self, number):
        """Return the `WheelOnSlices` of a wheel, by number, as a round wheel on the unchanged rail."""
        pair = self._pairs[number]
        if id(pair) not in self._flat:
            sizes = pair.rolling_radius, pair.half_distance, pair.rail_distance
            self._flat[id(pair)] = WheelOnSlices(pair.wheel, RailSlices.of(pair.rail), *sizes)
        return self._flat[id(pair)]

    def _of_wheel(self, number, shape, angle, s, below, x, u_rail, u_wheel, radii):
        """Return how far the surface of a wheel out of round lies below that of the round wheel at the begin, m."""
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
    """Return the first wheel coordinate (m), and heights of a wheel of slices on a grid with distances `STEP` in angle
    and `ACROSS` in wheel coordinate."""
    strips = np.arange(math.ceil(wheel.u[0] / ACROSS), wheel.u[-1] / ACROSS) * ACROSS
    first, last = shape.within(strips)
    angles = STEP * np.arange(math.ceil(TURN / STEP) + 1)
    return strips[first], shape.slices.heights(angles, strips[first : last + 1])[0]


def _between(values, i, j):
    """Interpolate values (n, m) bilinearly at fractional indices ``i`` and ``j``; constant beyond the ends."""
    (n, m), shape = values.shape, np.shape(i)
    i, j = np.clip(i, 0.0, n - 1.0), np.clip(j, 0.0, m - 1.0)
    low, left = np.minimum(i.astype(int), n - 2), np.minimum(j.astype(int), m - 2)
    up, right = i - low, j - left
    before = values[low, left] + right * (values[low, left + 1] - values[low, left])
    behind = values[low + 1, left] + right * (values[low + 1, left + 1] - values[low + 1, left])
    return np.reshape(before + up * (behind - before), shape)


def _eased(part):
    """Return a smooth step from 0 to 1, with which runs fade in varying surfaces."""
    part = np.clip(part, 0.0, 1.0)
    return part * part * (3.0 - 2.0 * part)


def _of_wave(wave, s, below, x, u_rail, u_wheel, radii):
    """Return the height of a corrugated rail above the smooth rail, m."""
    share = _eased(np.minimum(s - wave.begin, wave.begin + wave.length - s) / wave.fade)
    place = s + below + x - wave.begin
    return share * wave.reach(np.zeros(1), 0.0, place.ravel()).reshape(place.shape)


def _of_rail(rail, crossing, s, below, x, u_rail, u_wheel, radii):
    """Return heights of a rail of slices, m, computed in parts of `LENGTH` to save memory."""
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
    """Warn of patches whose gap along the rail is not a parabola: name the wheels and the number of their output times.

    ``rate`` is the number of output times per second, 1/s.
    """
    if not counters.get(NAME):
        return
    wheels = {name.removeprefix(f"{NAME}_"): n for name, n in counters.items() if name.startswith(f"{NAME}_")}
    said = ", ".join(f"{name} at {n} output times ({n / rate:.3g} s)" for name, n in wheels.items())
    warn(
        f"{source}: surfaces along the rail are no parabola within patches of {said}: their maximum pressure may be too"
        " low, by up to a quarter where it was measured; 'wrcore contact --patch grid' takes the real surfaces"
    )
