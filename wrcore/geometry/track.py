"""The track: where the rails stand."""

import os
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from wrcore.errors import InputError
from wrcore.errors.checked_yaml import validate
from wrcore.geometry.irregularity import (
    IrregularityData,
    faded_irregularity,
    generate,
    no_irregularity,
    read_irregularity,
)
from wrcore.geometry.path import PathData, path_data, tangent_path

GAUGES = 0.5, 2.0
"""Gauges of which there are tracks, m; others are taken for another unit."""

GAUGE_DEPTH = 0.014
"""Height below the rail top at which the gauge is measured, m (Manchester contact benchmark)."""

LEAST_RADIUS = 20.0
"""Smaller radii are taken for another unit, m."""

STEEPEST_RAMP = 0.01
"""Cant ramps that are steeper are taken for a mistake, m/m (lines are laid with at most a quarter of it)."""

MOST_SAMPLES = 2_000_000
"""More samples of a generated irregularity take too much memory."""

_KINDS = ("tangent", "transition", "curve")


@dataclass(frozen=True, eq=False)
class Track:
    """A track with two rails of the same profile.

    Parameters
    ----------
    gauge : float
        Distance between the innermost points of the rails within ``GAUGE_DEPTH`` of their tops, m; where the path
        has a widening, it is added.
    path : PathData
        Centre line, cant and widening; without it the track is straight and level.
    irregularity : IrregularityData
        Deviation of the rails; without it they are perfect.
    """

    gauge: float = 1.435
    path: PathData = field(default_factory=tangent_path, repr=False)
    irregularity: IrregularityData = field(default_factory=no_irregularity, repr=False)

    @cached_property
    def tangent(self):
        """Whether the track is straight, level and without irregularity."""
        return self.path.pieces.shape[0] == 0 and self.irregularity.coefficients.shape[0] == 0

    def rail_distance(self, rail):
        """Distance from the track's centre line to the origin (highest point) of a rail's profile, m.

        Half of the widening and the irregularity come on top.

        Parameters
        ----------
        rail : ProfileCurve
            Rail profile in the pose in which it lies in the track.
        """
        return 0.5 * self.gauge + rail.gauge_offset(GAUGE_DEPTH)


def build_track(data, source, folder="."):
    """Build a track from a scene's key ``track``.

    Parameters
    ----------
    data : dict
        Content of the key (``wrcore/scene/schemas/track.yaml``); left as it is.
    source : str
        Named in errors.
    folder : str or Path
        A points file is looked for here, then in the folder above.

    Returns
    -------
    Track

    Raises
    ------
    InputError
        One line; the field names the segment by its position in the list (from 0) and its key.
    """
    try:
        data = validate(data, "track", source)
    except InputError as error:
        raise InputError(source, f"track.{error.field}".rstrip("."), error.expected) from None
    if data["path"] == "tangent":
        path = tangent_path()
    elif isinstance(data["path"], str):
        raise InputError(source, "track.path", f"expected 'tangent' or a list of segments, got {data['path']!r}")
    else:
        path = path_data(*_knots(data["path"], data["rounding"], source), data["rounding"])
    irregularity = no_irregularity()
    if "irregularity" in data:
        irregularity = _irregularity(data["irregularity"], source, Path(folder))
    return Track(float(data["gauge"]), path, irregularity)


def _knots(segments, rounding, source):
    """Arc lengths of the joints, and curvature, cant (right rail higher) and widening there."""
    kinds = [_kind(i, segment, source) for i, segment in enumerate(segments)]
    values = [_values(i, kind, segment, source) for i, (kind, segment) in enumerate(zip(kinds, segments, strict=True))]
    joints = [np.zeros(3)]
    for i, kind in enumerate(kinds):
        after = values[i + 1] if i + 1 < len(kinds) else None
        joints.append(_joint(i, kind, values[i], after, joints[-1], source))
        if kind == "transition":
            _check_ramp(i, segments[i]["transition"], joints[-1] - joints[-2], rounding, source)
    lengths = [segment[kind] for kind, segment in zip(kinds, segments, strict=True)]
    return np.concatenate(([0.0], np.cumsum(lengths))), *np.array(joints).T


def _kind(i, segment, source):
    kinds = [kind for kind in _KINDS if kind in segment]
    if len(kinds) != 1:
        raise InputError(source, f"track.path.{i}", f"expected one of {', '.join(_KINDS)}, got {sorted(segment)}")
    extra = sorted(set(segment) - {kinds[0]} - ({"radius", "cant", "widening"} if kinds[0] == "curve" else set()))
    if extra:
        raise InputError(source, f"track.path.{i}.{extra[0]}", f"expected no such key in a {kinds[0]}")
    return kinds[0]


def _values(i, kind, segment, source):
    """Curvature, cant and widening of a segment; None for a transition."""
    if kind != "curve":
        return np.zeros(3) if kind == "tangent" else None
    if "radius" not in segment:
        raise InputError(source, f"track.path.{i}.radius", "expected a radius in m, but the key is missing")
    radius = segment["radius"]
    if abs(radius) < LEAST_RADIUS:
        raise InputError(source, f"track.path.{i}.radius", f"expected {LEAST_RADIUS:g} m or more, got {radius!r}")
    cant = np.copysign(1.0, radius) * segment.get("cant", 0.0)
    return np.array([1.0 / radius, cant, segment.get("widening", 0.0)])


def _joint(i, kind, here, after, before, source):
    """Values at the end of segment i; they may change in a transition only."""
    if kind == "transition":
        if after is None:
            raise InputError(source, f"track.path.{i}.transition", "expected a tangent or a curve after a transition")
        return after
    if np.any(here != before):
        expected = f"expected a transition before this {kind}: curvature, cant or widening would jump"
        raise InputError(source, f"track.path.{i}.{kind}", expected)
    return here


def _check_ramp(i, length, change, rounding, source):
    field_name = f"track.path.{i}.transition"
    if np.any(change[1:] != 0.0) and length < rounding:
        expected = f"expected at least the rounding length of {rounding:g} m where cant or widening changes"
        raise InputError(source, field_name, f"{expected}, got {length!r}")
    if abs(change[1]) > STEEPEST_RAMP * length:
        got = f"got {abs(change[1]):g} m over {length!r} m"
        raise InputError(source, field_name, f"expected a cant ramp of at most {STEEPEST_RAMP:g} m/m, {got}")


def _irregularity(data, source, folder):
    """IrregularityData of the key ``track.irregularity``."""
    key = "track.irregularity"
    if ("points" in data) == ("spectrum" in data):
        raise InputError(source, key, "expected either points or spectrum")
    if "points" in data:
        found = [base / data["points"] for base in (folder, folder.parent) if os.path.isfile(base / data["points"])]
        if not found:
            raise InputError(source, f"{key}.points", f"expected an existing file, got {data['points']!r}")
        s, values = read_irregularity(found[0])
    else:
        s, values = _generated(data["spectrum"], source, f"{key}.spectrum")
    return faded_irregularity(s, values, data["fade_in"], data["fade_out"], source, key)


def _generated(data, source, key):
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
    """Rotation matrix of a wheelset's frame: first roll about x, then yaw about z, shape (3, 3).

    The second column is the axle's direction, (-sin yaw cos roll, cos yaw cos roll, sin roll). The wheelset's
    pitch is left out: it does not move the wheel's surface.
    """
    cr, sr, cy, sy = np.cos(roll), np.sin(roll), np.cos(yaw), np.sin(yaw)
    return np.array([[cy, -sy * cr, sy * sr], [sy, cy * cr, -cy * sr], [0.0, sr, cr]])
