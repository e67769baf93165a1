"""Wear of the rails of a wear plan: a left and a right rail for each scene, over which all wheels pass.

A rail is worn by the traffic of its line. ``rails.tonnage`` is the mass, in kg, that passes over the rails of each
scene while the vehicle of a plan runs one metre. All traffic is assumed to be vehicles like this one, with equally worn
wheels. Rails keep their position and their cant. Wear of the gauge faces widens the gauge.
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
    """The rails of a scene at the start of a step."""

    changes: dict
    """Changes of the scene's keys, by key."""
    points: dict
    """Points u and f of the rail of each side on which wheels run, m; stored rails have the same u."""
    shifts: dict
    """Difference of u of the points and u of a run, m, by side: the origin of a run is the rail's highest point."""


DEPTH = 0.010
"""Depth below its top at which a worn rail's gauge is measured, m: a new rail's curve ends above the depth of the
gauge."""

POINTS = 1e-4
"""Distance between the points of a stored rail, m: its gauge face is steep."""

FACE, FACE_SLOPE = 3e-4, 7.0
"""Width (m) and slope of the gauge face of a stored rail below its curve. The face of 60E1 has 87 to 89 degrees and
this width from 14 to 22 mm below the top, which a curve f(u) cannot follow (`ProfileCurve`); this slope is 82 degrees.
"""

EDGE = 0.1
"""Smallest turn of a profile at a stored point that is an edge, rad: a gauge corner of 13 mm turns by less. Next to a
steep edge a spline overshoots, and the curve would end there."""

LEFT_OUT = 1e-3
"""Largest height of a stored rail's face that its curve may omit, m."""

PASSES = 4
"""Number of passes of the mean, over a point and its neighbours, that smooths an edge."""


def with_gauge_face(u, f):
    """Return points of a new rail (n,), m, extended by points of its gauge face.

    If a corner is worn to a flank of 70 degrees, each mm in lateral direction extends it by 3 mm downwards, below the
    end of a new rail's curve."""
    below = POINTS * np.arange(round(FACE / POINTS), 0, -1)
    return np.append(u[0] - below, u), np.append(f[0] - FACE_SLOPE * below, f)


def filled(u, f):
    """Return ordinates (n,), m, of a rail filled up so that its slope is nowhere above `FACE_SLOPE`."""
    return FACE_SLOPE * u + np.maximum.accumulate((f - FACE_SLOPE * u)[::-1])[::-1]


def softened(u, f):
    """Return ordinates (n,), m, of a rail for simulation: smoothed over some 0.3 mm at its edges."""
    turns = np.abs(np.diff(np.arctan(np.diff(f) / np.diff(u))))
    near = maximum_filter1d(np.pad(turns > EDGE, 1), 2 * PASSES + 1)
    soft = f.copy()
    for _ in range(PASSES):
        soft[1:-1] = 0.25 * (soft[:-2] + soft[2:]) + 0.5 * soft[1:-1]
    return np.where(near, soft, f)


def worn_down(u, f, fall):
    """Return ordinates (n,), m, of a rail after a decrease by ``fall`` (n,), m.

    A point falls below the lowest neighbour, within the largest wear depth, by at most its own depth normal to the
    profile. Thus a face that moves by several points leaves a level surface, not a groove. Lips are removed from
    `DEPTH` below the top on, and slopes above `FACE_SLOPE` are filled up."""
    depth = fall / np.hypot(1.0, np.gradient(f, u))
    around = 2 * math.ceil(depth.max() / spacing_of(u)) + 1
    now = np.maximum(f - fall, minimum_filter1d(f, around, mode="constant", cval=-math.inf) - depth)
    face = slice(0, np.argmax(now > now.max() - DEPTH))
    now[face] = np.minimum.accumulate(now[face][::-1])[::-1]
    return filled(u, now)


def _new_rails(scene):
    return {side: scene.pair(side).rail for side in SIDES}


def lay_rails(folder, scenes):
    """Write the new rails of all scenes to a folder."""
    for place, scene in enumerate(scenes):
        for side, rail in _new_rails(scene).items():
            _store(folder, 0, place, side, *with_gauge_face(*points_of(rail, POINTS)))


def _store(folder, step, place, side, u, f):
    """Write a rail at the start of a step: the worn profile, and its smoothed form on which wheels run."""
    write_points(rail_file(folder, step, place, side), u, f)
    write_points(rail_file(folder, step, place, side, "laid"), u, softened(u, f))


def rail_file(folder, step, place, side, kind="rail"):
    """Return the path of a scene's rail at the start of a step: the worn "rail", or its smoothed form "laid"."""
    return file_of(folder, f"{kind}_{place}_{side}", step)


def rails_of_step(folder, step, place, scene):
    """Return the `RailsOfStep` of a scene at the start of a step; ``place`` is the index of the scene in the plan."""
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
    """Return the decrease of the rails' ordinates at the stored points, m per metre that the vehicle runs, by side.

    ``wheels`` are the `WheelWear` of all wheels, ``passages`` the passages of vehicles per metre that one vehicle runs,
    1/m.
    """
    falls = dict.fromkeys(SIDES, 0.0)
    for (_, side), wear in wheels.items():
        edges = wear.rail_edges + laid.shifts[side]
        falls[side] = falls[side] + onto_points(laid.points[side][0], edges, wear.rail_depth)
    return {side: passages * fall for side, fall in falls.items()}


def next_rails(folder, step, falls, length, renewed):
    """Write the rails of all scenes for the next step: new rails if ``renewed``, else worn ones.

    Their ordinates decrease by ``falls`` (by scene and side, m per m) times the length of the step (m).
    """
    for place, fall in enumerate(falls):
        for side in SIDES:
            u, f = read_points(rail_file(folder, 0 if renewed else step, place, side))
            now = f if renewed else worn_down(u, f, fall[side] * length)
            _store(folder, step + 1, place, side, u, now)


def to_renewal(gone, renewal):
    """Return the distance (m) to the next renewal of the rails; directly after a renewal it is the whole interval."""
    if not renewal:
        return math.inf
    return renewal * (math.floor(gone / renewal + 1e-9) + 1.0) - gone
