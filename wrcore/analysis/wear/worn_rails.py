"""Rails that wear beside the wheels of a plan: a left and a right one for each scene, where all wheels pass.

A rail is worn by the traffic of its line: while the vehicle of a plan runs one metre, so many kilograms pass on the
rails of each scene (``rails.tonnage``). All of that is taken for vehicles like this one, with wheels worn like these.
Rails keep their place and their cant; what the gauge face loses widens the gauge, by the mean of both rails.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from wrcore.analysis.wear.worn_profiles import file_of, onto_points, points_of, read_points, spacing_of, write_points
from wrcore.errors import InputError
from wrcore.geometry.profiles.profile import ProfileCurve
from wrcore.geometry.track import SIDES


class RailsOfStep(NamedTuple):
    """The rails of a scene at a step."""

    changes: dict
    """Of the scene's keys."""
    points: dict
    """u and f of the points of each side that wheels run on, m; stored ones have the same u."""
    shifts: dict
    """What brings u of a run to that of the points, m: a run counts from the rail's highest point."""


DEPTH = 0.010
"""Below its top, m, where a worn rail's place is held: a new rail's curve ends above the depth of the gauge."""

POINTS = 1e-4
"""Distance of the points of a stored rail, m: its gauge face is steep."""

FACE, FACE_SLOPE = 3e-4, 7.0
"""Width (m) and slope of the gauge face of a stored rail below its curve. That of 60E1 stands at 87 to 89 degrees and
takes up so much from 14 to 22 mm below the top, which no curve f(u) follows (`ProfileCurve`); this one stands at 82."""

EDGE = 0.1
"""Turn of a profile at a stored point, rad, from which it is an edge: a gauge corner of 13 mm turns by less. A spline
turns too far beside one that is steep, and the curve would end there."""

LEFT_OUT = 1e-3
"""Height of a stored rail's face that a curve may not follow, m."""

PASSES = 4
"""Of the means that soften an edge, over a point and its neighbours."""


def with_gauge_face(u, f):
    """Points of a new rail (n,), m, with those of its gauge face: where a corner is worn to a flank of 70 degrees, each
    mm across reaches 3 mm further down, below the end of a new rail's curve."""
    below = POINTS * np.arange(round(FACE / POINTS), 0, -1)
    return np.append(u[0] - below, u), np.append(f[0] - FACE_SLOPE * below, f)


def filled(u, f):
    """Ordinates (n,), m, of a rail that is nowhere steeper than its face."""
    return FACE_SLOPE * u + np.maximum.accumulate((f - FACE_SLOPE * u)[::-1])[::-1]


def softened(u, f):
    """Ordinates (n,), m, of a rail as it is laid: means over some 0.3 mm about its edges."""
    turns = np.abs(np.diff(np.arctan(np.diff(f) / np.diff(u))))
    near = maximum_filter1d(np.pad(turns > EDGE, 1), 2 * PASSES + 1)
    soft = f.copy()
    for _ in range(PASSES):
        soft[1:-1] = 0.25 * (soft[:-2] + soft[2:]) + 0.5 * soft[1:-1]
    return np.where(near, soft, f)


def worn_down(u, f, fall):
    """Points of a rail that has fallen by ``fall`` (n,), m.

    None falls further below the lowest around it, within what the deepest place loses, than by its own depth normal to
    the profile: a face that moves on by several points leaves level ground behind it, no groove, and nothing beyond the
    ends. Lips go from `DEPTH` below the top on, and what would be steeper than `FACE_SLOPE` is filled up."""
    depth = fall / np.hypot(1.0, np.gradient(f, u))
    around = 2 * math.ceil(depth.max() / spacing_of(u)) + 1
    now = np.maximum(f - fall, minimum_filter1d(f, around, mode="constant", cval=-math.inf) - depth)
    face = slice(0, np.argmax(now > now.max() - DEPTH))
    now[face] = np.minimum.accumulate(now[face][::-1])[::-1]
    return filled(u, now)


def _new_rails(scene):
    return {side: scene.pair(side).rail for side in SIDES}


def lay_rails(folder, scenes):
    """Store the new rails of all scenes."""
    for place, scene in enumerate(scenes):
        for side, rail in _new_rails(scene).items():
            _store(folder, 0, place, side, *with_gauge_face(*points_of(rail, POINTS)))


def _store(folder, step, place, side, u, f):
    """Store a rail: what is left of it, and what wheels run on."""
    write_points(rail_file(folder, step, place, side), u, f)
    write_points(rail_file(folder, step, place, side, "laid"), u, softened(u, f))


def rail_file(folder, step, place, side, kind="rail"):
    """Path of a scene's rail at the start of a step, the "rail" of which wear takes or the one that is "laid"."""
    return file_of(folder, f"{kind}_{place}_{side}", step)


def rails_of_step(folder, step, place, scene):
    """`RailsOfStep` of a scene as they lie at the start of a step; ``place`` is the scene's in the plan."""
    changes, points, shifts, gauge = {}, {}, {}, 0.0
    for side, new in _new_rails(scene).items():
        path = rail_file(folder, step, place, side, "laid")
        u, f = points[side] = read_points(path)
        curve = ProfileCurve.from_points(u, f, "rail", str(path), mends=False)
        missing = np.min(curve.f) - np.max(curve.f) - (f[0] - f.max())
        if missing > LEFT_OUT:
            got = f"got edges at which the curve ends {1e3 * missing:.1f} mm above its last point"
            raise InputError(path, "points", f"expected a gauge face that a curve f(u) follows, {got}")
        first = curve.outline.curve(0.0)
        shifts[side] = float(u[np.argmin(np.abs(f[: len(f) // 2] - f.max() - first[1]))] - first[0])
        gauge += scene.track.rail_distance(new) + shifts[side] - curve.gauge_offset(DEPTH)
        changes[f"rail.{side}"] = {"profile": {"points": str(path.resolve()), "unit": "m"}, "inclination": 0.0}
    return RailsOfStep(changes | {"track.gauge": gauge, "track.gauge_depth": DEPTH}, points, shifts)


def falls_of(laid, wheels, passages):
    """By what the rails' ordinates fall at the stored points, m per metre that the vehicle runs, by side, from the
    `WheelWear` of all wheels and the passages per metre that one vehicle runs (1/m).
    """
    falls = dict.fromkeys(SIDES, 0.0)
    for (_, side), wear in wheels.items():
        edges = wear.rail_edges + laid.shifts[side]
        falls[side] = falls[side] + onto_points(laid.points[side][0], edges, wear.rail_depth)
    return {side: passages * fall for side, fall in falls.items()}


def next_rails(folder, step, falls, length, renewed):
    """Store the rails of all scenes for the next step: new ones, or those of this one, which over its length (m) have
    fallen by ``falls`` (scene by scene and by side, m per m).
    """
    for place, fall in enumerate(falls):
        for side in SIDES:
            u, f = read_points(rail_file(folder, 0 if renewed else step, place, side))
            now = f if renewed else worn_down(u, f, fall[side] * length)
            _store(folder, step + 1, place, side, u, now)


def to_renewal(gone, renewal):
    """Way (m) from a distance to the next renewal of the rails, the whole interval at one."""
    if not renewal:
        return math.inf
    return renewal * (math.floor(gone / renewal + 1e-9) + 1.0) - gone
