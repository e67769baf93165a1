"""Trains of several equal vehicles, one behind the other."""

from dataclasses import replace

import numpy as np

from wrcore.bodies.body import STATE_SIZE
from wrcore.errors import InputError
from wrcore.vehicle.description import compile_vehicle
from wrcore.vehicle.layout import FRAME_NAME


def train_of(vehicle, count, spacing, source):
    """Return a train of ``count`` equal vehicles, each ``spacing`` (m) behind the preceding vehicle.

    The vehicles are not coupled to each other; elements and joints to the moving frame are repeated for each vehicle.
    For a count of 1 the vehicle itself is returned. Else the names of bodies, elements and joints begin with
    ``vehicle_1_`` (the leading vehicle), ``vehicle_2_``, and so on. An InputError is raised if there is no spacing or
    if vehicles overlap.
    """
    if count == 1:
        return vehicle
    if spacing is None:
        raise InputError(source, "vehicle.spacing", f"expected a distance in m, as vehicle.count is {count}")
    length = float(np.ptp(vehicle.positions[:, 0]))
    if spacing <= length:
        expected = f"expected more than the {length:g} m between the outermost bodies of a vehicle, got {spacing:g}"
        raise InputError(source, "vehicle.spacing", expected)
    train = compile_vehicle(repeated(vehicle.data, count, spacing), vehicle.source_file)
    internal_states_in_order = not len(vehicle.bodies.independent)  # of vehicle after vehicle
    return replace(train, unit=vehicle if internal_states_in_order else None)


def repeated(data, count, spacing):
    """Return the content of a checked vehicle file, repeated for ``count`` vehicles at a ``spacing`` (m)."""
    train = {**data, "bodies": {}, "elements": [], "joints": []}
    for k in range(count):
        prefix, shift = f"vehicle_{k + 1}_", -k * spacing
        for name, part in data["bodies"].items():
            moved = {**part, "position": _moved(part["position"], shift)}
            if "wheelset" in part:
                moved["wheelset"] = prefix + part["wheelset"]
            train["bodies"][prefix + name] = moved
        for group in ("elements", "joints"):
            for item in data[group]:
                ends = [end if end == FRAME_NAME else prefix + end for end in item["bodies"]]
                moved = {**item, "name": prefix + item["name"], "bodies": ends}
                if "normal" in item:
                    moved["normal"] = prefix + item["normal"]
                if "at" in item:
                    moved["at"] = _moved(item["at"], shift)
                train[group].append(moved)
    return train


def repeated_equilibrium(equilibrium, train):
    """Return the static equilibrium of a train from the equilibrium of its single vehicle ``train.unit``."""
    bodies = len(train.unit.body_names)
    count = len(train.body_names) // bodies
    end = STATE_SIZE * bodies
    state = np.concatenate([np.tile(equilibrium.state[:end], count), np.tile(equilibrium.state[end:], count)])
    shifts = np.repeat(train.positions[::bodies, 0] - train.positions[0, 0], bodies)
    state[0 : count * end : STATE_SIZE] += shifts
    return replace(equilibrium, state=state, wheel_loads=np.tile(equilibrium.wheel_loads, (count, 1)))


def _moved(at, shift):
    """Return a point, or a list of points, shifted along the track by ``shift`` (m)."""
    if isinstance(at[0], list):
        return [_moved(point, shift) for point in at]
    return [at[0] + shift, *at[1:]]
