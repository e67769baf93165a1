"""Where a scene puts single bodies at the start, and how fast."""

import numpy as np

from wrcore.bodies.body import EULER, OMEGA, STATE_SIZE, VELOCITY, angles, euler_parameters, matrix_of
from wrcore.errors import InputError, one_of
from wrcore.geometry.path import centreline, frame_turn

PLACES, ANGLES, RATES = ("x", "y", "z"), ("roll", "pitch", "yaw"), ("vx", "vy", "vz", "wx", "wy", "wz")
"""Keys of a body, named like the channels of runs."""

BOX = "pitch", "wy"
"""Keys of an axle box: its motions that the revolute joint to the axle of its wheelset leaves free."""


def check_bodies(bodies, vehicle, source):
    """Raise an InputError that names the body if ``initial.bodies`` asks for what a vehicle does not have."""
    for name, values in bodies.items():
        field = f"initial.bodies.{name}"
        if name not in vehicle.body_names:
            raise InputError(source, field, one_of(vehicle.body_names, name))
        described = vehicle.data["bodies"][name]
        if described["kind"] == "axle_box":
            for key in values.keys() - set(BOX):
                expected = f"expected {' and '.join(BOX)} alone of an axle box: a joint holds it to its wheelset"
                raise InputError(source, f"{field}.{key}", f"{expected}; set {key} of {described['wheelset']}")
        if name in vehicle.wheelset_names and "pitch" in values:
            raise InputError(source, f"{field}.pitch", "expected no pitch of a wheelset: its rotation is wy")


def put_bodies(bodies, vehicle, state, path):
    """Write what a scene says of its bodies into a state on a tangent track, in place; all else stays. ``bodies`` has
    values by name of the body and key, as channels have them (:mod:`wrcore.run.output.channels`): m, rad, m/s and
    rad/s, relative to the axes of the track, which turn as they go along the path with the body."""
    boxes = {name: values for name, values in bodies.items() if vehicle.data["bodies"][name]["kind"] == "axle_box"}
    for name, values in bodies.items():
        if name in boxes:
            continue
        at = STATE_SIZE * vehicle.body_names.index(name)
        part = state[at : at + STATE_SIZE]
        part[:3] = [values.get(key, now) for key, now in zip(PLACES, part[:3], strict=True)]
        if values.keys() & set(ANGLES):
            turned = dict(zip(ANGLES, angles(part[EULER:VELOCITY]), strict=True))
            part[EULER:VELOCITY] = euler_parameters(*(values.get(key, turned[key]) for key in ANGLES))
        carried = _carried(path, part)
        part[VELOCITY] = values["vx"] / (1.0 + carried[0]) if "vx" in values else part[VELOCITY]
        for i, key in enumerate(RATES[1:], start=1):
            part[VELOCITY + i] = values[key] - part[VELOCITY] * carried[i] if key in values else part[VELOCITY + i]
        _carry_boxes(name, vehicle, state)
    for name, values in boxes.items():  # once all wheelsets are in their places
        _turn_box(name, values, vehicle, state, path)


def _carried(path, part):
    """Velocity and angular velocity (6,) that the axes of the track give a body there, per m/s along the path."""
    turn = np.array(frame_turn(centreline(path, part[0])))
    return np.concatenate([np.cross(turn, [0.0, part[1], part[2]]), turn])


def _carry_boxes(wheelset, vehicle, state):
    """Let the axle boxes of a wheelset go along with its axle, without turning about it."""
    parts = dict(zip(vehicle.body_names, state[: STATE_SIZE * len(vehicle.body_names)].reshape(-1, 13), strict=True))
    places, axle = dict(zip(vehicle.body_names, vehicle.positions, strict=True)), parts[wheelset]
    axes = matrix_of(axle[EULER:VELOCITY])
    turn = axle[OMEGA:] - (axle[OMEGA:] @ axes[:, 1]) * axes[:, 1]
    for name, box in parts.items():
        if vehicle.data["bodies"][name].get("wheelset") == wheelset:
            arm = axes @ (places[name] - places[wheelset])
            box[:3], box[EULER:VELOCITY] = axle[:3] + arm, axle[EULER:VELOCITY]
            box[VELOCITY:OMEGA], box[OMEGA:] = axle[VELOCITY:OMEGA] + np.cross(turn, arm), turn


def _turn_box(name, values, vehicle, state, path):
    """Turn an axle box about the axle of its wheelset until its pitch and its angular velocity about y are those of
    the scene."""
    parts = dict(zip(vehicle.body_names, state[: STATE_SIZE * len(vehicle.body_names)].reshape(-1, 13), strict=True))
    box, axle = parts[name], parts[vehicle.data["bodies"][name]["wheelset"]]
    roll, _, yaw = angles(axle[EULER:VELOCITY])
    if "pitch" in values:
        box[EULER:VELOCITY] = euler_parameters(roll, values["pitch"], yaw)
    if "wy" in values:
        about = matrix_of(axle[EULER:VELOCITY])[:, 1]
        wanted = values["wy"] - axle[VELOCITY] * _carried(path, axle)[4]
        box[OMEGA:] += (wanted - box[OMEGA + 1]) / about[1] * about
