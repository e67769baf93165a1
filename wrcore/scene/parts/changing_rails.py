"""Rails that change along the track, such as a crossing, from a scene's key ``track.crossing``.

The module also builds the contact geometry of each wheel on changing or corrugated rails and of wheels out of round.
"""

import json
import math
import os
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np

from wrcore.contact.changing_rails.section_table import BLEND, SectionTable
from wrcore.contact.changing_rails.sections import REACH
from wrcore.errors.checked_yaml import parse_ratio
from wrcore.errors.messages import warn
from wrcore.geometry.changing_rails.crossing import Crossing
from wrcore.geometry.changing_rails.files import profiles_in, read_slices
from wrcore.geometry.changing_rails.joint import Joint
from wrcore.geometry.changing_rails.slices import RailSlices
from wrcore.geometry.changing_rails.switch import Switch
from wrcore.geometry.corrugation import Corrugation
from wrcore.geometry.track import SIDES
from wrcore.scene.parts.kept_tables import kept_shape, kept_table
from wrcore.track.changing_rails import crossing_of, layout_of_corrugation, layout_of_rail, layout_of_wheel

JOINED = 1e-4
"""Largest distance of the first and the last slice's surface from the adjoining plain rail, m."""

STEEPEST_ALONG = 0.2
"""Slopes of a surface along the track must be below this: then the contact lies within `REACH` (m) of the axle."""

RUNNING = -0.03, 0.01, -0.012
"""Part of the profile that is checked for joints and overshoot: lateral coordinates from and to, lowest height, m."""

SWING = 5e-4
"""Overshoot of a rail beyond the heights of the slices before and behind above which wrcore warns, m."""

BENEATH, BELOW, CROWN = 0.08, -0.03, 3e-3
"""Bounds of a rail head, m: largest lateral coordinate, lowest height of its top, depth of the running surface below
the top."""


@dataclass(frozen=True, eq=False)
class PlacedCrossing:
    """A stretch of track where one rail or both change."""

    rails: tuple
    """`RailSlices` of the left and the right rail, in the coordinates of the plain rails; None for a rail that does not
    change."""
    at: float
    """Arc length of the track at s = 0 of the slices, m."""
    backwards: bool
    """Whether s of the slices decreases along the track."""

    @property
    def ends(self):
        """Arc lengths between which a rail differs from the plain rail, m."""
        slices = next(rail for rail in self.rails if rail is not None)
        low, high = slices.s[0] - REACH - BLEND, slices.s[-1] + REACH + BLEND
        return (self.at - high, self.at - low) if self.backwards else (self.at + low, self.at + high)


def read_crossings(data, vehicle, pairs, reader):
    """Return a `PlacedCrossing` for each stretch where a scene's rails change, sorted along the track.

    ``data`` is the scene's content, checked against the schema; ``pairs`` are the `WheelOnRail` of at least one
    wheelset. Stretches whose slices are all equal are left out, as they are the plain rail.
    """
    specs, laid, known = data["track"].get("crossing", []), [], {}
    for k, spec in enumerate([specs] if isinstance(specs, dict) else specs):
        part = reader.at("track.crossing") if isinstance(specs, dict) else reader.at("track.crossing", k)
        what = json.dumps([spec["slices"], spec["rail"]], sort_keys=True)
        if what not in known:
            known[what] = _rails(spec, data["track"]["gauge_depth"], pairs, part.at("slices"))
        crossing = known[what] and PlacedCrossing(known[what], float(spec["at"]), spec["reversed"])
        if crossing is not None:
            _check_begin(crossing, vehicle, part)
            laid.append((crossing, part))
    for side, name in enumerate(SIDES):
        along = sorted((*one.ends, part.key) for one, part in laid if one.rails[side] is not None)
        for (low, high, _), (begin, end, key) in pairwise(along):
            if begin < high:
                expected = f"expected stretches of the {name} rail apart, got {low:g} to {high:g} m and {begin:g} to"
                raise reader.error(f"{key}.at", f"{expected} {end:g} m")
    return tuple(sorted((one for one, _ in laid), key=lambda one: one.ends))


def _rails(spec, depth, pairs, reader):
    """Return the rails of a `PlacedCrossing`, or None if all slices are equal."""
    slices = _slices(spec["slices"], reader)
    sides = list(SIDES) if spec["rail"] == "both" else [spec["rail"]]
    rails = [
        slices.along(pair.rail, depth) if side in sides else None for side, pair in zip(SIDES, pairs, strict=False)
    ]
    for rail, pair in zip(rails, pairs, strict=False):
        if rail is not None:
            _check_joints(rail, pair.rail, reader)
            _check_surface(rail, reader)
            _warn_of_swings(rail, reader)
    return None if slices.alike else tuple(rails)


def _check_begin(crossing, vehicle, reader):
    """Raise an InputError if a wheelset stands on the crossing at the beginning of the run."""
    low, high = crossing.ends
    for name, x in zip(vehicle.wheelset_names, vehicle.positions[vehicle.bodies.wheelsets, 0], strict=True):
        if low < x < high:
            expected = (
                f"expected no wheelset on it at the beginning, got {name} at {x:g} m, it from {low:g} to {high:g} m"
            )
            raise reader.error("at", expected)


MADE = {
    "crossing": (Crossing, 1.0 / 30.0, 1.0 / 5.0, "a crossing from 1/30 to 1/5, such as crossing:1/12"),
    "switch": (Switch, 100.0, 5000.0, "a switch of 100 to 5000 m, such as switch:500"),
    "joint": (Joint, 1e-4, 0.05, "a joint of 0.0001 to 0.05 rad, such as joint:0.01"),
}
"""Rails made by a formula: class, lower and upper bound of its dimension, and text of the error outside the bounds."""


def _slices(spec, reader) -> RailSlices:
    """Return the slices that a scene names: a file, or a rail made by a formula."""
    how = spec if isinstance(spec, dict) else {"slices": spec}
    named = how.get("slices")
    kind, colon, value = named.partition(":") if isinstance(named, str) else ("", "", "")
    if colon and kind in MADE:
        if others := sorted(map(str, how.keys() - {"slices"})):
            raise reader.error(others[0], f"expected no such key beside {named}, made by a formula")
        made, low, high, expected = MADE[kind]
        if not low <= (size := parse_ratio(value)) <= high:
            raise reader.error("", f"expected {expected}, got {spec!r}")
        return made(size).rail(f"{kind}:{value}")
    return slices_named(spec, "rail", reader)[0]


def slices_named(spec, kind, reader):
    """Return slices of the kind "rail" or "wheel" from the file that a part of a scene names, and the path of the file.

    The part is the name of the file, or a mapping with the name as ``slices`` and with further keys.
    """
    how = spec if isinstance(spec, dict) else {"slices": spec}
    if not isinstance(how.get("slices"), str):
        raise reader.error("", f"expected a file of slices, or {{slices: FILE, ...}}, got {spec!r}")
    path = reader.file(how["slices"])
    for profile in filter(os.path.isfile, profiles_in(path)):
        reader.record(profile)
    return read_slices({**how, "slices": str(path)}, kind, f"{reader.source}: {reader.key}"), path


def _check_joints(slices, plain, reader):
    """Raise an InputError if the first or the last slice does not continue the plain rail within `JOINED`."""
    low, high, depth = RUNNING
    u = np.arange(low, high, 1e-3)
    f, slope = plain(u), plain(u, 1)
    for k, which in ((0, "first"), (-1, "last")):
        off = np.abs(slices.heights(slices.s[k], u)[0, 0] - f) / np.sqrt(1.0 + slope**2)
        off = np.where(f > depth, np.nan_to_num(off, nan=math.inf), 0.0)
        worst = int(np.argmax(off))
        if off[worst] > JOINED:
            got = f"{1e3 * off[worst]:.3f} mm" if off[worst] < math.inf else "none"
            expected = f"expected a {which} slice within {1e3 * JOINED:g} mm of the scene's rail {plain.name}"
            raise reader.error("", f"{expected}, got {got} at u = {u[worst]:.3f} m")


def _check_surface(slices, reader):
    """Raise an InputError if a rail has no head under the wheels, or a head that is too steep along the track."""
    between = 0.5 * (slices.s[1:] + slices.s[:-1])
    s, u = np.sort(np.concatenate([slices.s, between])), np.arange(RUNNING[0], BENEATH, 1e-3)
    for part in np.array_split(s, math.ceil(s.size / 500)):
        f, _, along = slices.heights(part, u)
        top = np.max(f, axis=1, where=np.isfinite(f), initial=-np.inf)
        if (gone := np.flatnonzero(top < BELOW)).size:
            expected = f"expected a head under the wheels everywhere, got none at s = {part[gone[0]]:g} m"
            raise reader.error("", expected)
        steep = np.max(np.abs(along), axis=1, where=f > top[:, None] - CROWN, initial=0.0)
        worst = int(np.argmax(steep))
        if not steep[worst] < STEEPEST_ALONG:
            expected = f"expected heads that rise less than {STEEPEST_ALONG:g} along the track"
            raise reader.error("", f"{expected}, got {steep[worst]:.3g} at s = {part[worst]:g} m")


def _warn_of_swings(slices, reader):
    """Warn if the splines through the slices leave the range of heights of both neighbouring slices.

    A notch between two heads that moves laterally from slice to slice is no overshoot.
    """
    u, worst = np.arange(RUNNING[0], RUNNING[1], 1e-3), (0.0, 0.0)
    for part in np.array_split(np.arange(slices.s.size - 1), math.ceil(slices.s.size / 500)):
        ends, middle = slices.s[[part, part + 1]], 0.5 * (slices.s[part] + slices.s[part + 1])
        (low, high), f = (slices.heights(at, u)[0] for at in ends), slices.heights(middle, u)[0]
        top = np.max(f, axis=1, where=np.isfinite(f), initial=-np.inf)
        under = np.where(f > top[:, None] - CROWN, np.minimum(low, high) - f, 0.0)
        out = np.maximum(under, f - np.maximum(low, high))
        out = np.max(out, axis=1, where=np.isfinite(out) & (f > RUNNING[2]), initial=0.0)
        worst = max(worst, (float(out.max(initial=0.0)), float(middle[np.argmax(out)]) if out.size else 0.0))
    if worst[0] > SWING:
        text = f"the rail swings out by {1e3 * worst[0]:.1f} mm between slices near s = {worst[1]:g} m"
        warn(f"{reader.source}: {reader.key}: {text}: add slices there")


def read_corrugation(data, crossings, shapes, reader):
    """Return the `Corrugation` that a scene's content describes, or None for smooth rails."""
    spec = data["track"].get("corrugation")
    if spec is None:
        return None
    sides = tuple(SIDES) if spec["rail"] == "both" else (spec["rail"],)
    for k, side in enumerate(SIDES):
        changes = any(crossing.rails[k] is not None for crossing in crossings)
        if side in sides and (changes or any(shape for shape, _ in shapes[k::2])):
            other = "track.crossing" if changes else "wheels out of round"
            expected = f"expected no {other} on the {side} rail where it is corrugated"
            raise reader.error("track.corrugation.rail", expected)
    slope = 2.0 * math.pi * spec["amplitude"] / spec["wavelength"]
    if not slope < STEEPEST_ALONG:
        expected = f"expected a wave that rises less than {STEEPEST_ALONG:g}, got {slope:.3g}"
        raise reader.error("track.corrugation.amplitude", expected)
    return Corrugation(spec["wavelength"], spec["amplitude"], spec["begin"], spec["length"], spec["fade"], sides)


def sections_under_wheels(crossings, shapes, corrugation, pairs, starts):
    """Return the `ContactGeometry` of each wheel on the plain rail and the `wrcore.track.changing_rails.Crossing`.

    All geometries are of one type, as kernels need. ``pairs`` are those of all wheelsets, left and right, from the
    front. ``shapes`` come from `read_out_of_round`; ``starts`` (k,) are the arc lengths at which wheelsets begin, m.
    """
    known: dict[tuple, int] = {}
    tables: list[SectionTable] = []
    geometries, of_wheels = [], []

    def number(pair, what, make, backwards=False):
        """Return the index of the section table of a pair and a shape; make the table if it is missing."""
        key = id(pair.wheel), id(pair.rail), pair.rolling_radius, id(what), backwards
        if key not in known:
            known[key] = len(tables)
            tables.append(make())
        return known[key]

    for k, pair in enumerate(pairs):
        laid = [crossing for crossing in crossings if crossing.rails[k % 2] is not None]
        shape, angle = shapes[k] if shapes else (None, 0.0)
        wave = corrugation if corrugation and list(SIDES)[k % 2] in corrugation.sides else None
        passed = []
        if laid:
            wide = [crossing.rails[k % 2].lateral for crossing in laid]
            lateral = min(low for low, _ in wide), max(high for _, high in wide)
            for crossing in laid:
                slices, back = crossing.rails[k % 2], crossing.backwards
                table = number(pair, slices, partial(kept_table, pair, slices, back, lateral), back)
                passed.append(
                    (table, layout_of_rail(tables[table], tables[table].begin + crossing.at, pair.half_distance))
                )
        elif shape is not None:
            table = number(pair, shape, partial(kept_shape, pair, shape))
            radius = 0.5 * (pairs[k - k % 2].rolling_radius + pairs[k + 1 - k % 2].rolling_radius)
            passed.append((table, layout_of_wheel(tables[table], starts[k // 2], angle, radius, shape.shortest)))
        elif wave is not None:
            table = number(pair, wave, partial(kept_shape, pair, wave))
            passed.append((table, layout_of_corrugation(tables[table], wave, pair.half_distance)))
        geometries.append(_on_plain_rail(pair, [tables[table] for table, _ in passed]))
        of_wheels.append(passed)
    return tuple(geometries), crossing_of(tables, of_wheels)


def _on_plain_rail(pair, tables):
    """Return the `ContactGeometry` of a wheel on the plain rail; its error bounds hold for all tables it passes."""
    if not tables:
        return pair.geometry._replace(along=np.zeros((len(pair.geometry.rail), 5)))
    errors = np.max([table.geometry.zone_planar_errors for table in tables], axis=0)
    return tables[0].geometry._replace(zone_planar_errors=errors)


def warn_of_rigid_rails(source):
    """Warn that impact forces on rigid rails are meaningless."""
    warn(f"{source}: impact on rigid rails is no result; track.support says how the track gives")
