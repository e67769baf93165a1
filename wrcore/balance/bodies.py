"""Initial positions and velocities of single bodies, from a scene's key ``initial.bodies``."""

import numpy as np

from wrcore.bodies.body import EULER, OMEGA, STATE_SIZE, VELOCITY, angles, euler_parameters, matrix_of
from wrcore.errors import InputError, one_of
from wrcore.geometry.path import centreline, frame_turn

PLACES, ANGLES, RATES = ("x", "y", "z"), ("roll", "pitch", "yaw"), ("vx", "vy", "vz", "wx", "wy", "wz")
"""Keys of a body in ``initial.bodies``: positions (m), angles (rad), velocities (m/s, rad/s), named like channels."""

BOX = "pitch", "wy"
"""Keys of an axle box: the motions that the revolute joint to its wheelset's axle allows."""


def check_bodies(bodies, vehicle, source):
    """Raise an InputError that names the body if ``initial.bodies`` has bodies or keys that the vehicle lacks."""
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
    """Write the values of ``initial.bodies`` into a state on a tangent track, in place; other values are unchanged.

    ``bodies`` has values by name of the body and key: m, rad, m/s and rad/s as in channels
    (:mod:`wrcore.run.output.channels`). They are relative to the track axes at the body, which move along the path with
    the body and turn with the path.
    """
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
    for name, values in boxes.items():  # after all wheelsets have their positions
        _turn_box(name, values, vehicle, state, path)


def _carried(path, part):
    """Return velocity and angular velocity (6,) of a body fixed to the moving track axes, per m/s along the path."""
    turn = np.array(frame_turn(centreline(path, part[0])))
    return np.concatenate([np.cross(turn, [0.0, part[1], part[2]]), turn])


def _carry_boxes(wheelset, vehicle, state):
    """Move the axle boxes of a wheelset with its axle, without rotation about the axle; ``state`` is changed."""
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
    """Set pitch (rad) and angular velocity about y (rad/s) of an axle box by rotation about its wheelset's axle."""
    parts = dict(zip(vehicle.body_names, state[: STATE_SIZE * len(vehicle.body_names)].reshape(-1, 13), strict=True))
    box, axle = parts[name], parts[vehicle.data["bodies"][name]["wheelset"]]
    roll, _, yaw = angles(axle[EULER:VELOCITY])
    if "pitch" in values:
        box[EULER:VELOCITY] = euler_parameters(roll, values["pitch"], yaw)
    if "wy" in values:
        about = matrix_of(axle[EULER:VELOCITY])[:, 1]
        wanted = values["wy"] - axle[VELOCITY] * _carried(path, axle)[4]
        box[OMEGA:] += (wanted - box[OMEGA + 1]) / about[1] * about
