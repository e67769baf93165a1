"""User-defined control laws of a scene."""

import math

import numpy as np

from wrcore.bodies.body import STATE_SIZE
from wrcore.errors import InputError, one_of, short
from wrcore.forces import law
from wrcore.forces.control import PITCH, QUANTITIES, ROLLING, SPEEDS, Controls, no_controls
from wrcore.forces.kinds.actuator import given
from wrcore.kernels import own


def outputs_of(spec):
    """Return the names of the outputs of all control laws, laws in alphabetical order as in run files."""
    return [name for _, item in sorted((spec or {}).items()) for name in item["outputs"]]


def read_controls(data, vehicle, laws, source, call=True):
    """Return the `Controls` of a scene's checked ``control`` (or none); an InputError names the law and the key.

    ``laws`` finds the functions. With ``call`` each function gets a test call with the inputs that are measured in the
    vehicle's nominal position.
    """
    spec, drive = data.get("control") or {}, data.get("drive") or {}
    if not spec:
        return no_controls()
    names = outputs_of(spec)
    for name in names:
        if names.count(name) > 1:
            raise InputError(source, "control", f"expected each output once, got {name} {names.count(name)} times")
    motors, actuators = [item["name"] for item in drive.get("motors", ())], _actuators(vehicle)
    end = STATE_SIZE * len(vehicle.bodies.mass) + vehicle.elements.states + _track_states(data, vehicle)
    end += "controller" in drive
    rows: list[list[int]] = []
    inputs: list[tuple[int, ...]] = []
    places: list[int] = []
    parameters: list[float] = []
    start: list[float] = []
    period, digests = [], []
    for name, item in sorted(spec.items()):
        field, sampled = f"control.{name}", "rate" in item
        if sampled and data["integration"]["method"].startswith(("scipy", "cvode")):
            expected = f"expected a method of the compiled engine, as {field} is sampled"
            raise InputError(source, "integration.method", expected)
        known = [*motors, *(actuators if sampled else ())]
        for k, output in enumerate(item["outputs"]):
            if output not in known:
                raise InputError(source, f"{field}.outputs.{k}", one_of(known, output))
        measured = [_input(text, data, vehicle, source, f"{field}.inputs.{k}") for k, text in enumerate(item["inputs"])]
        found = _found(item, [nominal for _, nominal in measured], laws, source, f"{field}.law", call)
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
    return Controls(
        np.array(rows, whole), np.array(period), np.array(inputs, whole).reshape(-1, 4), np.array(places, whole),
        np.array(parameters, float), np.array(digests, whole), np.array(start, float),
    )  # fmt: skip


def _track_states(data, vehicle):
    """Return the number of internal states that a flexible track adds to those of the elements."""
    support = data["track"].get("support")
    if not support:
        return 0
    from wrcore.scene.support import track_support

    _, elements = track_support(support, 1.5, vehicle.elements, len(vehicle.bodies.wheelsets))
    return elements.states - vehicle.elements.states


def _actuators(vehicle):
    """Return the index of each actuator's force in the state vector, by the actuator's name."""
    elements, inner = vehicle.elements, STATE_SIZE * len(vehicle.bodies.mass)
    number = law.LAWS.index(given)
    return {
        name: inner + int(elements.law[k, law.INNER])
        for k, name in enumerate(vehicle.directed) if elements.law[k, law.LAW] == number
    }  # fmt: skip


def _input(text, data, vehicle, source, field):
    """Return the row of a control law's input and its approximate value in nominal position.

    The row holds the indices of quantity and body, the number of the nearest wheelset, and the index in the state
    vector of the wheels' speed difference (-1 unless the wheels are independent).
    """
    name, _, channel = text.rpartition(".")
    channel = "x_m" if channel == "s_m" else channel
    if name not in vehicle.body_names:
        raise InputError(source, field, f"expected BODY.CHANNEL; {one_of(vehicle.body_names, name)}")
    body = vehicle.body_names.index(name)
    spins, numbers = vehicle.bodies.spins[body], list(vehicle.bodies.wheelsets)
    apart = dict(vehicle.bodies.independent).get(numbers.index(body)) if body in numbers else None
    most = ROLLING if apart is None else len(QUANTITIES)
    known = [one for k, one in enumerate(QUANTITIES[:most]) if k != PITCH or not spins]
    if channel not in known:
        raise InputError(source, field, one_of(known, channel))
    what, position, speed = QUANTITIES.index(channel), vehicle.positions[body], float(data["speed"])
    nominal = position[what] if what < 3 else speed if what == SPEEDS else 0.0
    if what >= ROLLING:
        nominal = speed / vehicle.rolling_radius
    distances = np.abs(vehicle.positions[vehicle.bodies.wheelsets, 0] - position[0])
    near = int(np.argmin(distances)) if distances.size else 0
    place = -1 if apart is None else STATE_SIZE * len(vehicle.bodies.mass) + int(apart)
    return (what, body, near, place), float(nominal)


def _found(item, nominal, laws, source, field, call):
    """Return the function of a control law; with ``call`` it is test-called first."""
    if not all(map(math.isfinite, nominal)):
        raise InputError(source, field, "expected a vehicle with wheelsets for what is measured")
    try:
        found = laws.find(item["law"])
        if call:
            laws.allow()
            sizes = [list(nominal), item["states"], item["parameters"], len(item["outputs"]), len(item["states"])]
            answer, arrays = own.tried(found, sizes, 0.0, reads=3)
            own.finite(*arrays)
            if answer is not None:
                expected = "expected a function that writes its outputs and returns nothing"
                raise InputError(source, field, f"{expected}, got {short(answer)}")
    except InputError as error:
        raise InputError(source, field, error.expected) from None
    return found
