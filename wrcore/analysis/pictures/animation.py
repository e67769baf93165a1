"""Animation of a run as one HTML page with data and program, which any browser shows without a network.

The upper part is a plan view of the vehicle in the axes of the track, with displacements magnified by a stated factor.
The lower part is one wheelset from behind, true to scale: profiles of wheel and rail, patches, and forces on the wheel.
"""

import json
import math
import re
from dataclasses import dataclass, field
from html import escape
from importlib.resources import files

import numpy as np

from wrcore.analysis.assessment.wheels import wheelsets_of
from wrcore.analysis.pictures.plot_vehicle import box_of
from wrcore.errors import InputError, check_number
from wrcore.errors.new_files import appearing
from wrcore.geometry.path import centreline
from wrcore.geometry.track import SIDES
from wrcore.run.motion import path_of

MOST_FRAMES = 600
FRAME_RATE = 50.0  # frames per second of simulated time, as near as the run's output times allow
SHOWN = 0.5  # largest displacement from above, as the factor is chosen, m
POINTS = 160  # number of points of a profile
OVERHANG = (
    0.5  # a wheelset so far beyond the end of a body's box, m, still is below it: boxes are only as long as inertia
)

PATCH = ("y_m", "z_m", "b_m", "contact_angle_rad", "N_N", "Fx_N", "Fy_N")


@dataclass(frozen=True)
class Animation:
    """A page (``html``) with the animation of a run; a notebook shows it.

    ``data`` are the drawn numbers. Per body: nominal position and size (m), ``y`` (m; without the offset of straight
    bodies in curves) and ``yaw`` (rad) over the frames, both times ``factor``. Per wheelset: position and attitude,
    true to scale, and per wheel profiles, patches and forces.
    """

    html: str = field(repr=False)
    data: dict = field(repr=False)

    def write(self, path):
        """Write the page to a file, which appears under its name only when it is complete."""
        with appearing(path) as file:
            file.write(self.html.encode())

    def _repr_html_(self):
        return f'<iframe srcdoc="{escape(self.html)}" width="100%" height="720" frameborder="0"></iframe>'


def animate(run, scene, factor=None, begin=0.0, end=math.inf):
    """Animate a run with the channels pose and contact over ``begin``..``end`` (s; the first `MOST_FRAMES` frames).

    Displacements are magnified by ``factor``; by default a round number with which the largest is about `SHOWN` m.
    """
    frames = _frames(run, begin, end)
    vehicle = scene.vehicle
    strange = [name for name in wheelsets_of(run) if name not in vehicle.body_names]
    if strange or not wheelsets_of(run):
        raise InputError("draw", "scene", f"expected that of the run, with {', '.join(strange) or 'wheelsets'}")
    for name in vehicle.body_names:
        if "yaw_rad" not in run.groups.get(name, {}):
            raise InputError("draw", name, "expected a run with the output channels pose and contact")
    poses, path = {name: run[name] for name in vehicle.body_names}, path_of(run)
    aside = {name: _aside(vehicle, path, name, poses[name], frames) for name in vehicle.body_names}
    largest = max(float(np.abs(shifts).max()) for shifts in aside.values())
    factor = _round(SHOWN / max(largest, 1e-6)) if factor is None else factor
    check_number(factor, 1.0, 1e6, "draw", "factor")
    data = {
        "name": run.scene.get("name", "run"), "status": run.status, "factor": factor,
        "speed": float(run.scene.get("speed", 0.0)), "t": _numbers(run.t[frames], 4),
        "half_distance": vehicle.half_distance, "radius": vehicle.rolling_radius,
        "bodies": [_body(vehicle, name, aside[name], poses[name]["yaw_rad"][frames], factor) for name in aside],
        "wheelsets": [_wheelset(run, scene, name, frames) for name in vehicle.wheelset_names],
    }  # fmt: skip
    page = files("wrcore.analysis.pictures").joinpath("animation.html").read_text(encoding="utf-8")
    content = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    parts = {"TITLE": escape(data["name"]), "DATA": content}  # neither is looked for in what takes its place
    return Animation(re.sub("TITLE|DATA", lambda found: parts[found[0]], page), data)


def _frames(run, begin, end):
    """Return the indices of the output times that are shown."""
    if not len(run.t) or not 0.0 <= begin < min(end, run.t[-1]):
        last = run.t[-1] if len(run.t) else 0.0
        raise InputError("draw", "begin", f"expected 0 <= begin < end, before the run's end at {last:g} s")
    seen = np.flatnonzero((run.t >= begin) & (run.t <= end))
    step = float(np.median(np.diff(run.t))) if len(run.t) > 1 else 1.0
    return seen[:: max(1, round(1.0 / (FRAME_RATE * step)))][:MOST_FRAMES]


def _round(value):
    """Return the largest of 1, 2, 5, 10, 20 and so on that is not above a value, at least 1."""
    power = 10.0 ** math.floor(math.log10(max(value, 1.0)))
    return max(one * power for one in (1.0, 2.0, 5.0) if one * power <= max(value, 1.0))


def _numbers(values, digits):
    """Convert values to a rounded list for JSON; absent values are null."""
    rounded = np.round(np.asarray(values, float), digits)
    return [None if math.isnan(value) else value for value in rounded.tolist()]


def _aside(vehicle, path, name, pose, frames):
    """Return the lateral displacement of a body over the frames, m, without the geometric offset in a curve.

    The middle of a straight body lies inside the arc of its wheelsets, by half the curvature times their mean square
    distance.
    """
    at = vehicle.body_names.index(name)
    shifts = pose["y_m"][frames] - vehicle.positions[at, 1]
    distances = vehicle.positions[vehicle.bodies.wheelsets, 0] - vehicle.positions[at, 0]
    below = distances[np.abs(distances) <= 0.5 * box_of(vehicle.data["bodies"][name])[0] + OVERHANG]
    if not path.pieces.size or not below.size or name in vehicle.wheelset_names:
        return shifts
    curvatures = np.array([centreline(path, s).curvature for s in pose["s_m"][frames]])
    return shifts - 0.5 * curvatures * np.mean(below**2)


def _body(vehicle, name, aside, yaw, factor):
    at, part = vehicle.body_names.index(name), vehicle.data["bodies"][name]
    wheelset = part["kind"] == "wheelset"
    size = [0.0, 2.0 * vehicle.half_distance] if wheelset else box_of(part)[:2].tolist()
    return {
        "name": name, "kind": part["kind"], "x": float(vehicle.positions[at, 0]), "size": size,
        "y0": float(vehicle.positions[at, 1]),
        "y": _numbers(factor * aside, 5),
        "yaw": _numbers(factor * yaw, 6),
    }  # fmt: skip


def _wheelset(run, scene, name, frames):
    pose = run[name]
    at = scene.vehicle.wheelset_names.index(name)
    return {
        "name": name, "y": _numbers(pose["y_m"][frames], 6), "z": _numbers(pose["z_m"][frames], 6),
        "roll": _numbers(pose["roll_rad"][frames], 7),
        "wheels": [_wheel(run[f"{name}/{side}"], side, scene.pair(side, at), frames) for side in SIDES],
    }  # fmt: skip


def _wheel(contact, side, pair, frames):
    """Return profiles (y, z from axle and track, m), displacements of the rail by irregularity, and patches over the
    frames."""
    sign, distance = SIDES[side], pair.rail_distance
    u_wheel, u_rail = (np.linspace(curve.u[0], curve.u[-1], POINTS) for curve in (pair.wheel, pair.rail))
    rows = np.stack([contact[name][frames] for name in PATCH], axis=-1)  # (frames, patches, columns)
    u = contact["u_rail_m"][frames]
    aside = rows[..., 0] - sign * (distance + u)
    height = rows[..., 1] - pair.rail(np.nan_to_num(u))
    return {
        "side": side,
        "wheel": [_numbers(sign * (pair.half_distance + u_wheel), 5),
                  _numbers(pair.wheel(u_wheel) - pair.rolling_radius, 6)],
        "rail": [_numbers(sign * (distance + u_rail), 5), _numbers(pair.rail(u_rail), 6)],
        "rail_at": [_numbers(_held(aside), 6), _numbers(_held(height), 6)],
        "patches": [[_numbers(patch, 5) for patch in frame if not np.isnan(patch[0])] for frame in rows],
    }  # fmt: skip


def _held(values):
    """Return the first patch's value in each frame; without a patch that of the previous frame, or 0."""
    first = values[:, 0]
    known = np.maximum.accumulate(np.where(np.isnan(first), -1, np.arange(len(first))))
    return np.where(known < 0, 0.0, first[known])
