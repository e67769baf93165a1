"""The track: gauge, path and irregularity, from a scene's key ``track``."""

import os
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from pathlib import Path

import numpy as np

from wrcore.errors import InputError
from wrcore.errors.checked_yaml import validate
from wrcore.geometry.irregularity import (
    CHANNELS,
    LARGEST,
    IrregularityData,
    faded,
    generate,
    no_irregularity,
    read_irregularity,
    sum_of,
)  # fmt: skip
from wrcore.geometry.path import PathData, path_data, tangent_path
from wrcore.geometry.profiles.profile import GAUGE_DEPTH
from wrcore.geometry.ramps import STEEPEST, incline
from wrcore.kernels import own
from wrcore.kernels.named_laws import Laws

SIDES = {"left": 1.0, "right": -1.0}
"""Sign of the lateral coordinate y of a rail."""

GAUGES = 0.5, 2.0
"""Smallest and largest accepted gauge, m; they detect wrong units."""

LEAST_RADIUS = 20.0
"""Smallest accepted curve radius, m; it detects wrong units."""

STEEPEST_RAMP = 0.01
"""Largest accepted slope of a cant ramp, m/m; real lines have at most a quarter of it."""

MOST_SAMPLES = 2_000_000
"""Largest number of samples of a generated irregularity, which limits memory."""

_KINDS = ("tangent", "transition", "curve")
_SEGMENT_KEYS = {
    "tangent": set(),
    "transition": {"shape", "radius", "cant", "widening"},
    "curve": {"radius", "cant", "widening"},
}
_SYNONYMS = {"hermite": "bloss"}


WIDENED = {"both": 0.0, "left": 0.5, "right": -0.5}
"""Fraction of the widening by which the middle between the rails moves to the left, by the rails that are widened."""


@dataclass(frozen=True, eq=False)
class Track:
    """A track: gauge, path and irregularity; by default straight, level and without irregularity."""

    gauge: float = 1.435
    """Distance of the rails' innermost points within the gauge depth of their tops, m; the path's widening is added."""
    path: PathData = field(default_factory=tangent_path, repr=False)
    """Centre line, cant and widening."""
    irregularity: IrregularityData = field(default_factory=no_irregularity, repr=False)
    """Deviation of the rails."""
    gauge_depth: float = GAUGE_DEPTH
    """Height below the rail top down to which the gauge is measured, m."""
    by_law: Callable | None = field(default=None, repr=False)
    """Irregularity from a user-defined law that has not been called: a function from `Laws` to IrregularityData."""

    @cached_property
    def tangent(self):
        """Whether the track is straight, level and without irregularity."""
        bare = self.irregularity.coefficients.shape[0] == 0 and self.by_law is None
        return self.path.pieces.shape[0] == 0 and bare

    def with_laws(self, laws):
        """Return the track with the irregularity of its user-defined law added; without a law, the track itself."""
        if self.by_law is None:
            return self
        return replace(self, irregularity=sum_of([self.irregularity, self.by_law(laws)]), by_law=None)

    def rail_distance(self, rail):
        """Return the distance (m) from the track's centre line to the origin (highest point) of a rail's profile.

        ``rail`` is a ProfileCurve with its inclination in the track. Widening and irregularity are not included. An
        InputError is raised for a rail that ends above the gauge depth.
        """
        offset = rail.gauge_offset(self.gauge_depth)
        if not np.isfinite(offset):
            expected = (
                f"expected a rail down to {self.gauge_depth:g} m (track.gauge_depth) below its top on the gauge side"
            )
            raise InputError(rail.name, "gauge", expected)
        return 0.5 * self.gauge + offset


def build_track(data, source, folder=".", laws=None):
    """Return the Track of a scene's key ``track`` (a dict, which is not changed).

    ``source`` is named in errors. Files of points are searched in ``folder``, then in the folder above. ``laws`` finds
    a user-defined law, which is not called. An InputError names a segment by its index in the list (from 0) and its
    key.
    """
    try:
        data = validate(data, "track", source)
    except InputError as error:
        raise InputError(source, f"track.{error.field}".rstrip("."), error.expected) from None
    segments = [] if data["path"] == "tangent" else data["path"]
    if isinstance(segments, str):
        raise InputError(source, "track.path", f"expected 'tangent' or a list of segments, got {segments!r}")
    path = tangent_path()
    if segments or data["gradients"]:
        climb = _incline(data["gradients"], data["rounding"], source) if data["gradients"] else None
        knots, values, shapes = _knots(segments or [{"tangent": 1.0}], data["rounding"], source)
        aside = WIDENED[data["widened"]]
        about, climbs = data["cant_about"], data["rail_climb"]
        path = path_data(knots, *values, data["rounding"], shapes, about, climb, aside, climbs)
    irregularity, by_law = no_irregularity(), None
    if "irregularity" in data:
        widened = any(segment.get("widening") for segment in segments)
        irregularity = _irregularity(data["irregularity"], source, Path(folder), None if widened else data["gauge"])
        if "own" in data["irregularity"]:
            by_law = partial(_by_law, data["irregularity"], source)
            by_law(laws or Laws(Path(folder)), call=False)
    return Track(float(data["gauge"]), path, irregularity, float(data["gauge_depth"]), by_law)


def _knots(segments, rounding, source):
    """Return the arc lengths (m) of the segments' ends, the values there (3, k) and the segments' shapes.

    The values are curvature (1/m), cant (m, right rail higher) and widening (m).
    """
    kinds = [_kind(i, segment, source) for i, segment in enumerate(segments)]
    followers = [*kinds[1:], ""]
    values = [_values(i, *item, source) for i, item in enumerate(zip(kinds, segments, followers, strict=True))]
    values = _completed(values, kinds, segments, source)
    shapes = [_SYNONYMS.get(shape, shape) for shape in (segment.get("shape", "linear") for segment in segments)]
    joints = [np.zeros(3)]
    for i, kind in enumerate(kinds):
        if values[i] is None:
            values[i] = values[i + 1]
        if kind != "transition" and np.any(values[i] != joints[-1]):
            raise InputError(source, f"track.path.{i}.{kind}", _jump(kind, values[i] - joints[-1], rounding))
        joints.append(values[i])
        if kind == "transition":
            _check_ramp(i, segments[i], joints[-1] - joints[-2], shapes[i], rounding, source)
    lengths = [segment[kind] for kind, segment in zip(kinds, segments, strict=True)]
    return np.concatenate(([0.0], np.cumsum(lengths))), np.array(joints).T, shapes


def _kind(i, segment, source):
    """Return the kind of a segment; InputError for several kinds or keys that do not belong to it."""
    kinds = [kind for kind in _KINDS if kind in segment]
    if len(kinds) != 1:
        raise InputError(source, f"track.path.{i}", f"expected one of {', '.join(_KINDS)}, got {sorted(segment)}")
    extra = sorted(set(segment) - {kinds[0]} - _SEGMENT_KEYS[kinds[0]])
    if extra:
        ramp = ": a cant ramp on straight track is {transition: LENGTH, cant: CANT} before the transition of the curve"
        expected = f"expected no such key in a {kinds[0]}{ramp * (extra[0] == 'cant')}"
        raise InputError(source, f"track.path.{i}.{extra[0]}", expected)
    return kinds[0]


def _values(i, kind, segment, after, source):
    """Return curvature, cant and widening at the end of a segment; None for a transition to those of the next segment.

    A transition with cant or widening but no radius ends in a straight line; `_completed` sets the sign of its cant."""
    own = [key for key in ("radius", "cant", "widening") if key in segment]
    if kind == "tangent":
        return np.zeros(3)
    if kind == "transition" and after in ("tangent", "curve"):
        if own:
            raise InputError(source, f"track.path.{i}.{own[0]}", f"expected no such key in a transition to a {after}")
        return None
    if kind == "transition" and not own:
        return None
    if kind == "transition" and "radius" not in segment:
        return np.array([0.0, segment.get("cant", 0.0), segment.get("widening", 0.0)])
    if "radius" not in segment:
        raise InputError(source, f"track.path.{i}.radius", "expected a radius in m, but the key is missing")
    radius = segment["radius"]
    if abs(radius) < LEAST_RADIUS:
        raise InputError(source, f"track.path.{i}.radius", f"expected {LEAST_RADIUS:g} m or more, got {radius!r}")
    cant = np.copysign(1.0, radius) * segment.get("cant", 0.0)
    return np.array([1.0 / radius, cant, segment.get("widening", 0.0)])


def _completed(values, kinds, segments, source):
    """Return the values at the ends of segments, completed for transitions before another transition or at the end.

    Between curves of opposite direction the values are zero (inflection). Cant on straight track, without a radius,
    raises the rail that is higher before it, or else the outer rail of the next curve."""
    found = list(values)
    for i in [k for k, segment in enumerate(segments) if kinds[k] == "transition" and "radius" not in segment]:
        before = found[i - 1] if i else np.zeros(3)
        if values[i] is not None:
            ahead = next((value[0] for value in values[i + 1 :] if value is not None and value[0]), 0.0)
            side = before[1] or before[0] or ahead
            if values[i][1] and not side:
                expected = "expected a curve before or after straight track with cant: it says which rail is higher"
                raise InputError(source, f"track.path.{i}.cant", expected)
            found[i] = values[i] * np.array([1.0, np.copysign(1.0, side), 1.0])
        elif kinds[i + 1 : i + 2] in ([], ["transition"]):
            after = next((value for value in values[i + 1 : i + 3] if value is not None), np.zeros(3))
            if before[0] * after[0] >= 0.0:
                expected = (
                    "expected a tangent or a curve after a transition, or a radius or a cant of its own at its end"
                )
                expected += "; two transitions without meet between curves to either side, in an inflection"
                raise InputError(source, f"track.path.{i}.transition", expected)
            found[i] = np.zeros(3)
    return found


def _jump(kind, change, rounding):
    """Return the error text for a jump of curvature, cant or widening."""
    expected = f"expected a transition before this {kind}: curvature, cant or widening would jump"
    if not np.any(change[1:]):
        expected += f"; where the radius is so large that the line has none, write {{transition: {rounding:g}}}"
    return expected


def _check_ramp(i, segment, change, shape, rounding, source):
    """Raise an InputError for a transition shorter than the rounding length or with a too steep cant ramp."""
    field_name, length = f"track.path.{i}.transition", segment["transition"]
    if shape == "linear" and np.any(change[1:] != 0.0) and length < rounding:
        expected = f"expected at least the rounding length of {rounding:g} m where cant or widening changes"
        raise InputError(source, field_name, f"{expected}, got {length!r}")
    if STEEPEST[shape] * abs(change[1]) > STEEPEST_RAMP * length:
        got = f"got {abs(change[1]):g} m over {length!r} m"
        raise InputError(source, field_name, f"expected a cant ramp of at most {STEEPEST_RAMP:g} m/m, {got}")


def _incline(gradients, rounding, source):
    """Return the `Incline` of the key ``track.gradients``."""
    last = len(gradients) - 1
    for i, item in enumerate(gradients):
        for key, needed in (("length", i < last), ("radius", i > 0)):
            if (key in item) != needed:
                place = {"length": "last", "radius": "first"}[key]
                expected = f"expected a {key} in m in all but the {place} gradient, and none there"
                raise InputError(source, f"track.gradients.{i}.{key}", expected)
    lengths, radii = ([item.get(key, 0.0) for item in gradients] for key in ("length", "radius"))
    if "vertical_curve" in gradients[0]:
        expected = "expected no such key in the first gradient, at whose beginning there is no vertical curve"
        raise InputError(source, "track.gradients.0.vertical_curve", expected)
    circles = [item.get("vertical_curve") == "circle" for item in gradients]
    climb, ends = incline(lengths, [item["gradient"] for item in gradients], radii, 0.5 * rounding, circles)
    if np.any(ends[1:, 0] < ends[:-1, 1]):
        expected = "expected a length that holds half of the vertical curve at either end"
        raise InputError(source, "track.gradients", f"{expected}, got overlapping vertical curves")
    return climb


def _irregularity(data, source, folder, gauge):
    """Return the IrregularityData of ``track.irregularity``; ``gauge`` (m) is subtracted from absolute gauges."""
    key = "track.irregularity"
    if not data.keys() & {"points", "spectrum", "own"}:
        raise InputError(source, key, "expected points, spectrum or own")
    points, shift = data.get("points", []), data.get("chainage_at_start", 0.0)
    if "chainage_at_start" in data and not points:
        expected = "expected points beside it: it is the chainage of their files at which the run begins"
        raise InputError(source, f"{key}.chainage_at_start", expected)
    sampled = []
    for name in [points] if isinstance(points, str) else points:
        found = [base / name for base in (folder, folder.parent) if os.path.isfile(base / name)]
        if not found:
            raise InputError(source, f"{key}.points", f"expected an existing file, got {name!r}")
        s, values = read_irregularity(found[0], gauge)
        sampled.append((s - shift, values))
    if "spectrum" in data:
        sampled.append(_generated(data["spectrum"], source, f"{key}.spectrum"))
    parts = [faded(*one, data["fade_in"], data["fade_out"], source, key) for one in sampled]
    return sum_of(parts) if parts else no_irregularity()


def _by_law(data, source, laws, call=True):
    """Return the IrregularityData of a user-defined law, or None if ``call`` is False."""
    key = "track.irregularity"
    s, values = own.on_grid(data["own"], len(CHANNELS), laws, source, f"{key}.own", call)
    if values is None:
        return None
    if np.abs(values).max() > LARGEST:
        expected = f"expected deviations in m, within {LARGEST:g}, got {np.abs(values).max():g}"
        raise InputError(source, f"{key}.own.law", expected)
    return faded(s, values.T, data["fade_in"], data["fade_out"], source, key)


def _generated(data, source, key):
    """Return arc lengths (m) and deviations (n, 4), m, of the key ``track.irregularity.spectrum``."""
    if data["shortest"] >= data["longest"]:
        expected = f"expected more than the shortest wavelength of {data['shortest']:g} m"
        raise InputError(source, f"{key}.longest", f"{expected}, got {data['longest']!r}")
    if data["spacing"] > 0.1 * data["shortest"]:
        expected = f"expected at most a tenth of the shortest wavelength, {0.1 * data['shortest']:g} m"
        raise InputError(source, f"{key}.spacing", f"{expected}, got {data['spacing']!r}")
    if data["length"] > MOST_SAMPLES * data["spacing"]:
        expected = f"expected at least {data['length'] / MOST_SAMPLES:g} m for {data['length']:g} m of track"
        raise InputError(source, f"{key}.spacing", f"{expected}, got {data['spacing']!r}")
    names = ("level", "seed", "length", "spacing", "shortest", "longest")
    s, values = generate(*(data[name] for name in names))
    return s + data["begin"], values


def rotation(roll, yaw):
    """Return the rotation matrix (3, 3) of a wheelset's frame: first roll about x, then yaw about z, rad.

    The second column is the axle's direction, (-sin yaw cos roll, cos yaw cos roll, sin roll). The wheelset's
    pitch is not included: it does not move the surface of a round wheel."""
    cr, sr, cy, sy = np.cos(roll), np.sin(roll), np.cos(yaw), np.sin(yaw)
    return np.array([[cy, -sy * cr, sy * sr], [sy, cy * cr, -cy * sr], [0.0, sr, cr]])
