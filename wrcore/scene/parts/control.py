"""User-defined control laws of a scene."""

import math
from functools import partial

import numpy as np

from wrcore.bodies.body import STATE_SIZE
from wrcore.errors import one_of, short
from wrcore.forces import law
from wrcore.forces.control import PITCH, QUANTITIES, ROLLING, SPEEDS, Controls, no_controls
from wrcore.forces.kinds.actuator import given
from wrcore.kernels import own


def outputs_of(spec):
    """Return the names of the outputs of all control laws, laws in alphabetical order as in run files."""
    return [name for _, item in sorted((spec or {}).items()) for name in item["outputs"]]


def read_controls(data, vehicle, track_states, reader):
    """Return the `Controls` of a scene's checked ``control`` (or none), and a function per law that tests the law.

    The functions call the laws with the inputs that are measured in the vehicle's nominal position. ``track_states`` is
    the number of states of a flexible track. An InputError names the law and the key.
    """
    spec, drive = data.get("control") or {}, data.get("drive") or {}
    if not spec:
        return no_controls(), []
    names = outputs_of(spec)
    for name in names:
        if names.count(name) > 1:
            raise reader.error("control", f"expected each output once, got {name} {names.count(name)} times")
    motors, actuators = [item["name"] for item in drive.get("motors", ())], _actuators(vehicle)
    end = STATE_SIZE * len(vehicle.bodies.mass) + vehicle.elements.states + track_states
    end += "controller" in drive
    rows: list[list[int]] = []
    inputs: list[tuple[int, ...]] = []
    places: list[int] = []
    parameters: list[float] = []
    start: list[float] = []
    period, digests, tests = [], [], []
    for name, item in sorted(spec.items()):
        part, sampled = reader.at("control", name), "rate" in item
        if sampled and data["integration"]["method"].startswith(("scipy", "cvode")):
            expected = f"expected a method of the compiled engine, as {part.key} is sampled"
            raise reader.error("integration.method", expected)
        known = [*motors, *(actuators if sampled else ())]
        for k, output in enumerate(item["outputs"]):
            if output not in known:
                raise part.error(f"outputs.{k}", one_of(known, output))
        measured = [_input(text, data, vehicle, part.at("inputs", k)) for k, text in enumerate(item["inputs"])]
        found, test = _found(item, [nominal for _, nominal in measured], part)
        tests.append(test)
        row = [len(inputs), len(inputs) + len(measured), len(places), len(places) + len(item["outputs"])]
        for output in item["outputs"]:
            in_tail = sampled and output in motors
            places.append(end + len(start) if in_tail else actuators[output] if sampled else -1)
            start += [0.0] * in_tail
        first, last = end + len(start), end + len(start) + len(item["states"])
        start += [*item["states"], *[0.0] * sampled]
        row += [first, last, len(parameters), len(parameters) + len(item["parameters"])]
        rows.append([*row, last if sampled else -1])
        inputs += [one for one, _ in measured]
        parameters += item["parameters"]
        period.append(1.0 / item["rate"] if sampled else 0.0)
        digests.append(found.digest)
    whole = np.int64
    controls = Controls(
        np.array(rows, whole), np.array(period), np.array(inputs, whole).reshape(-1, 4), np.array(places, whole),
        np.array(parameters, float), np.array(digests, whole), np.array(start, float),
    )  # fmt: skip
    return controls, tests


def _actuators(vehicle):
    """Return the index of each actuator's force in the state vector, by the actuator's name."""
    elements, inner = vehicle.elements, STATE_SIZE * len(vehicle.bodies.mass)
    number = law.LAWS.index(given)
    return {
        name: inner + int(elements.law[k, law.INNER])
        for k, name in enumerate(vehicle.directed) if elements.law[k, law.LAW] == number
    }  # fmt: skip


def _input(text, data, vehicle, reader):
    """Return the row of a control law's input and its approximate value in nominal position.

    The row holds the indices of quantity and body, the number of the nearest wheelset, and the index in the state
    vector of the wheels' speed difference (-1 unless the wheels are independent).
    """
    name, _, channel = text.rpartition(".")
    channel = "x_m" if channel == "s_m" else channel
    if name not in vehicle.body_names:
        raise reader.error("", f"expected BODY.CHANNEL; {one_of(vehicle.body_names, name)}")
    body = vehicle.body_names.index(name)
    spins, numbers = vehicle.bodies.spins[body], list(vehicle.bodies.wheelsets)
    apart = dict(vehicle.bodies.independent).get(numbers.index(body)) if body in numbers else None
    most = ROLLING if apart is None else len(QUANTITIES)
    known = [one for k, one in enumerate(QUANTITIES[:most]) if k != PITCH or not spins]
    if channel not in known:
        raise reader.error("", one_of(known, channel))
    what, position, speed = QUANTITIES.index(channel), vehicle.positions[body], float(data["speed"])
    nominal = position[what] if what < 3 else speed if what == SPEEDS else 0.0
    if what >= ROLLING:
        nominal = speed / vehicle.rolling_radius
    distances = np.abs(vehicle.positions[vehicle.bodies.wheelsets, 0] - position[0])
    near = int(np.argmin(distances)) if distances.size else 0
    place = -1 if apart is None else STATE_SIZE * len(vehicle.bodies.mass) + int(apart)
    return (what, body, near, place), float(nominal)


def _found(item, nominal, reader):
    """Return the function of a control law, and a function that calls it with the inputs ``nominal``."""
    if not all(map(math.isfinite, nominal)):
        raise reader.error("law", "expected a vehicle with wheelsets for what is measured")
    with reader.errors_of("law"):
        found = reader.laws.find(item["law"])
    sizes = [list(nominal), item["states"], item["parameters"], len(item["outputs"]), len(item["states"])]
    return found, partial(_test, found, sizes, reader)


def _test(found, sizes, reader):
    """Raise an InputError if a control law cannot be called, returns a value, or writes numbers that are not finite."""
    with reader.errors_of("law"):
        answer, arrays = own.tried(found, sizes, 0.0, reads=3)
        own.finite(*arrays)
    if answer is not None:
        raise reader.error(
            "law", f"expected a function that writes its outputs and returns nothing, got {short(answer)}"
        )
