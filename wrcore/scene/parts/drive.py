"""A scene's motors, brakes and speed controller."""

import numpy as np

from wrcore.bodies.marker import FRAME
from wrcore.errors import one_of
from wrcore.forces.drive import BRAKE, COMMANDED, CONTROLLED, KIND, MOTOR, NUMBER, Drive, no_drive
from wrcore.geometry.track import SIDES
from wrcore.scene.parts.schedule import read_schedule
from wrcore.track.schedule import pack_schedules
from wrcore.vehicle.layout import FRAME_NAME

OVER = ("time", "arc_length")  # abscissas of tables, in the order of TIME and ARC_LENGTH in `wrcore.forces.drive`


def read_drive(spec, vehicle, commanded, reader):
    """Return the `Drive` (motors, brakes, speed controller) of a scene's checked ``drive``, or of None.

    ``commanded`` are the names of the outputs of control laws. An InputError names the motor or brake and the key.
    """
    reader = reader.at("drive")
    if spec is None:
        return no_drive()
    items = [("motors", item) for item in spec["motors"]] + [("brakes", item) for item in spec["brakes"]]
    _check_names(items, vehicle, reader)
    rows, levers = [], []
    tables: list[np.ndarray] = []
    for group, item in items:
        row, lever = _actuator(group, item, vehicle, reader.at(group, item["name"]), tables, commanded)
        rows.append(row)
        levers.append(lever)
    controlled = [row[KIND] == CONTROLLED for row in rows]
    if any(controlled) != ("controller" in spec):
        expected = "expected a controller exactly where motors state neither torque nor force and no control has them"
        raise reader.error("controller", expected)
    levers = [lever / sum(controlled) if shares else lever for lever, shares in zip(levers, controlled, strict=True)]
    control, gains = [], []
    if any(controlled):
        control, gains = _controller(spec["controller"], rows, vehicle, reader.at("controller"), tables)
    return Drive(
        np.array(rows, np.int64).reshape(-1, 7), np.array(levers, float), np.array(control, np.int64).reshape(-1, 4),
        np.array(gains, float).reshape(-1, 4), pack_schedules(tables),
    )  # fmt: skip


def _check_names(items, vehicle, reader):
    """Raise an InputError if motors, brakes, controller or the vehicle's actuators share a name.

    Sessions address their inputs, and control laws their outputs, by these names.
    """
    known = {"controller": "the speed controller is drive.controller"}
    known |= {
        item["name"]: f"elements.{item['name']} of the vehicle is an actuator"
        for item in vehicle.data["elements"] if item["kind"] == "actuator"
    }  # fmt: skip
    for group, item in items:
        field = f"{group}.{item['name']}"
        if item["name"] in known:
            raise reader.error(field, f"expected another name, as {known[item['name']]}")
        known[item["name"]] = f"drive.{field} is a {group.removesuffix('s')}"


def _actuator(group, item, vehicle, reader, tables, commanded):
    """Return row and lever of a motor or brake for `Drive`; its table is appended to ``tables``."""
    wheelset, body = item["bodies"]
    if wheelset not in vehicle.wheelset_names:
        known = ", ".join(vehicle.wheelset_names)
        raise reader.error("bodies", f"expected first one of {known}, got {wheelset!r}")
    carrier = FRAME if body == FRAME_NAME else _body(body, vehicle, reader.at("bodies"))
    if body in vehicle.wheelset_names:
        raise reader.error("bodies", f"expected a body or {FRAME_NAME} as the second one")
    given, wheel = [key for key in ("torque", "force") if key in item], _wheel(item, vehicle, reader)
    if len(given) > 1 or (group == "brakes" and not given):
        raise reader.error("", "expected either torque or force")
    number, k = vehicle.body_names.index(wheelset), vehicle.wheelset_names.index(wheelset)
    lever = 1.0 if given == ["torque"] else vehicle.rolling_radius
    if item["name"] in commanded and group == "motors":
        if given:
            raise reader.error(given[0], "expected none, as a control law commands this motor")
        return [number, carrier, k, COMMANDED, commanded.index(item["name"]), 0, wheel], 1.0
    if not given:
        return [number, carrier, k, CONTROLLED, 0, 0, wheel], lever
    over, points = read_schedule(item[given[0]], given[0], OVER, reader.at(given[0]))
    if group == "brakes" and np.any(points[:, 1] < 0.0):
        raise reader.error(given[0], "expected no negative value: a brake acts against the rotation")
    tables.append(points)
    return [number, carrier, k, BRAKE if group == "brakes" else MOTOR, len(tables) - 1, over, wheel], lever


def _wheel(item, vehicle, reader):
    """Return the wheel that a motor or brake acts on: 1 left, -1 right, 0 both wheels of a solid wheelset."""
    independent = vehicle.data["bodies"][item["bodies"][0]].get("independent_wheels", False)
    if independent and "wheel" not in item:
        expected = f"expected left or right, as the wheels of {item['bodies'][0]} turn independently of each other"
        raise reader.error("wheel", expected)
    if not independent and "wheel" in item:
        expected = f"expected no such key, as the wheels of {item['bodies'][0]} turn together"
        raise reader.error("wheel", expected)
    return SIDES[item["wheel"]] if independent else 0


def _controller(spec, rows, vehicle, reader, tables):
    """Return row and gains of the controller; its speed table is appended to ``tables``.

    The arc length of the speed table is that of the foremost wheelset that the controller drives.
    """
    body = _body(spec["body"], vehicle, reader.at("body"))
    over, points = read_schedule(spec["speed"], "speed", OVER, reader.at("speed"))
    tables.append(points)
    foremost = min(row[NUMBER] for row in rows if row[KIND] == CONTROLLED)
    return [body, foremost, len(tables) - 1, over], [
        spec["proportional"], spec["integral"], -spec.get("brake_limit", spec["limit"]), spec["limit"],
    ]  # fmt: skip


def _body(name, vehicle, reader):
    """Return the index of a body in the state vector's order."""
    if name not in vehicle.body_names:
        raise reader.error("", one_of(vehicle.body_names, name))
    return vehicle.body_names.index(name)
