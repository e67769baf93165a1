"""Find inputs of a scene that lie outside the distance or the time of a run."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from wrcore.errors import InputError
from wrcore.errors.messages import warn
from wrcore.geometry.irregularity import irregularity_extents
from wrcore.scene.description import Scene

SLACK, SLACK_M = 0.01, 1.0
"""Margins, relative and in m, by which the distance of a run may exceed speed times duration: wheels slip and sway."""

FAR_M = 1000.0
"""Distance ahead of a session's vehicle, m, beyond which the beginning of an irregularity file causes a warning: its
chainage probably has another origin."""

POINTS = "track.irregularity.points"


class Extent(NamedTuple):
    """Range of arc length or time in which an input of a scene has an effect."""

    field: str
    begin: float
    """Begin of the range: arc length in m, or time in s."""
    end: float
    what: str
    """Name of the input in messages."""
    unit: str = "m"


def extents(scene: Scene) -> Iterator[Extent]:
    """Yield the extents of a scene's inputs over arc length or time; -inf and inf if an input has no end."""
    data = scene.data
    yield from _irregularities(scene)
    yield from _path(data["track"])
    for crossing in scene.crossings:
        yield Extent("track.crossing.at", *crossing.ends, "rails that change")
    for k, rail in enumerate(data["track"].get("check_rails", ())):
        yield Extent(f"track.check_rails.{k}.begin", rail["begin"], rail["begin"] + rail["length"], "a check rail")
    if "corrugation" in data["track"]:
        wave = data["track"]["corrugation"]
        yield Extent("track.corrugation.begin", wave["begin"], wave["begin"] + wave["length"], "a corrugation")
    friction = data["contact"]["friction"]
    friction = friction if isinstance(friction, dict) else {}
    if "law" in friction:
        begin = friction.get("begin", 0.0)
        yield Extent("contact.friction.begin", begin, begin + friction["length"], "friction along the track")
    for name, spec in (("", friction), (".left", friction.get("left")), (".right", friction.get("right"))):
        yield from _table(spec, f"contact.friction{name}", "a friction table")
    drive = data.get("drive") or {"motors": [], "brakes": []}
    for kind in ("motors", "brakes"):
        for item in drive[kind]:
            for key in ("torque", "force"):
                yield from _table(item.get(key), f"drive.{kind}.{item['name']}.{key}", f"a table of {key}")
    if "controller" in drive:
        yield from _table(drive["controller"]["speed"], "drive.controller.speed", "a table of speed")


def _irregularities(scene: Scene) -> Iterator[Extent]:
    spec = scene.data["track"].get("irregularity", {})
    points = spec.get("points", [])
    names = [points] if isinstance(points, str) else points
    fields = [POINTS] * len(names)
    fields += ["track.irregularity.spectrum.begin"] * ("spectrum" in spec)
    whats = [f"irregularity in {name}" for name in names] + ["an irregularity"]
    for field, what, ends in zip(fields, whats, irregularity_extents(scene.track.irregularity), strict=False):
        yield Extent(field, float(ends[0]), float(ends[1]), what)
    if "own" in spec:  # a user's irregularity: its law is not called before the scene is compiled
        begin = spec["own"]["begin"]
        yield Extent("track.irregularity.own.begin", begin, begin + spec["own"]["length"], "an irregularity")


def _path(track: dict[str, Any]) -> Iterator[Extent]:
    """Yield extents of curves, transitions and gradients, each from its beginning to infinity: the last segment has no
    end."""
    begin = 0.0
    for k, segment in enumerate(track["path"] if isinstance(track["path"], list) else ()):
        kind = next(key for key in ("tangent", "transition", "curve") if key in segment)
        if kind != "tangent":
            yield Extent(f"track.path.{k}.{kind}", begin, math.inf, f"a {kind}")
        begin += segment[kind]
    begin = 0.0
    for k, gradient in enumerate(track["gradients"]):
        if k:
            yield Extent(f"track.gradients.{k}.gradient", begin, math.inf, "a change of gradient")
        begin += gradient.get("length", math.inf)


def _table(spec: Any, field: str, what: str) -> Iterator[Extent]:
    """Yield the extent of a table over arc length or time, between its ends; beyond them its values are constant."""
    for key, unit in (("arc_length", "m"), ("time", "s")):
        if isinstance(spec, dict) and key in spec:
            yield Extent(f"{field}.{key}", float(spec[key][0]), float(spec[key][-1]), what, unit)


def check_reach(scene: Scene, duration: float = math.inf) -> None:
    """Refuse inputs that a run from the scene's initial state cannot reach, and warn of inputs beyond its end.

    Inputs behind the last wheelset or before time 0 are refused. Irregularity files that begin beyond the end are
    refused, too: their chainage has another origin. ``duration`` is in s; if it is infinite, as in sessions, no input
    lies beyond the end. With a drive or gradients the end is not known beforehand (`warn_of_unreached`).
    """
    way = duration * scene.data["speed"]
    behind, ahead = _places(scene)
    ends = {"m": (behind - SLACK_M, ahead + SLACK_M + (1.0 + SLACK) * way), "s": (0.0, duration)}
    for one in extents(scene) if math.isfinite(behind) else ():
        low, high = ends[one.unit]
        expected = f"expected {one.what} on the way of the run, {low:.6g} to {high:.6g} {one.unit}"
        expected += f", got {one.begin:.6g} to {one.end:.6g} {one.unit}"
        if one.field == POINTS and not (one.begin < high and one.end > low):
            shift = scene.data["track"]["irregularity"].get("chainage_at_start", 0.0)
            hint = "track.irregularity.chainage_at_start says where in the file the run begins"
            hint += f", such as {one.begin + shift:g}" + (f" instead of {shift:g}" if shift else "")
            raise InputError(scene.source, one.field, f"{expected}; {hint}")
        if one.end <= low:
            raise InputError(scene.source, one.field, expected)
        if one.field == POINTS and high == math.inf and one.begin > ahead + FAR_M:
            _warn(scene, one, f"begins {one.begin - ahead:.6g} m ahead of the vehicle, see chainage_at_start")
    if math.isfinite(duration):
        _warn_ahead(scene, {"s": duration} if _is_free(scene) else {unit: high for unit, (_, high) in ends.items()})


def warn_of_unreached(scene: Scene, arc_lengths: np.ndarray) -> None:
    """Warn of inputs ahead of the arc lengths (n,), m, that wheelsets have reached at the end of a run.

    This is for runs with a drive or gradients, whose distance is not known beforehand.
    """
    if _is_free(scene) and len(arc_lengths):
        _warn_ahead(scene, {"m": float(np.max(arc_lengths))})


def _places(scene: Scene) -> tuple[float, float]:
    """Return the initial arc lengths of the last and the first wheelset, m; both infinite without wheelsets."""
    vehicle, moved = scene.vehicle, scene.data["initial"]["bodies"]
    nominal = zip(vehicle.wheelset_names, vehicle.positions[vehicle.bodies.wheelsets, 0], strict=True)
    places = [float(moved.get(name, {}).get("x", x)) for name, x in nominal]
    return min(places, default=math.inf), max(places, default=math.inf)


def _is_free(scene: Scene) -> bool:
    """Whether a drive or gradients change the speed."""
    return "drive" in scene.data or bool(scene.data["track"]["gradients"])


def _warn_ahead(scene: Scene, ends: dict[str, float]) -> None:
    """Warn of inputs that begin beyond the end of a run, ``ends`` by unit; of path segments and gradients only of the
    first."""
    said = set()
    for one in extents(scene):
        group = one.field.rpartition(".")[0] if one.end < math.inf else one.field.split(".")[1]
        if one.unit in ends and one.begin >= ends[one.unit] and group not in said:
            said.add(group)
            _warn(scene, one, f"begins at {one.begin:.6g} {one.unit}, the run ends at {ends[one.unit]:.6g} {one.unit}")


def _warn(scene: Scene, one: Extent, text: str) -> None:
    warn(f"{scene.source}: {one.field}: {one.what} {text}")
