"""Inputs that a session may set while it runs: numbers in the arrays of a compiled model, by name.

Kernels read these arrays at every evaluation, so a new value needs no compilation and no new model.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from wrcore.equations.model import Model
from wrcore.errors import InputError, check_number, one_of
from wrcore.forces import law
from wrcore.forces.drive import COMMANDED, CONTROLLED, KIND, LEAST, MOST, SPEED, TABLE
from wrcore.forces.kinds.actuator import given
from wrcore.geometry.track import SIDES
from wrcore.scene.description import Scene
from wrcore.track.schedule import Schedules


@dataclass(frozen=True)
class Input:
    """A named input of a session: its meaning, unit, bounds and the numbers of the model that it sets."""

    meaning: str
    unit: str
    places: np.ndarray
    """View of the model's numbers, shape (n,); setting a value makes all of them the value times the factor."""
    factor: float = 1.0
    low: float = -1e15
    high: float = 1e15

    @property
    def value(self) -> float:
        """Present value in the input's unit; NaN while the scene's table holds several values."""
        return float(self.places[0]) / self.factor if np.all(self.places == self.places[0]) else float("nan")


Values = tuple[np.ndarray, ...]
"""Values of all inputs of a session, in the order of their names."""


class Inputs(dict[str, Input]):
    """Inputs of a session by name."""

    def present(self) -> Values:
        """Return a copy of the present values."""
        return tuple(item.places.copy() for item in self.values())

    def put(self, values: Values) -> None:
        """Set all inputs to the result of an earlier call of :meth:`present`."""
        for item, numbers in zip(self.values(), values, strict=True):
            item.places[:] = numbers

    def set(self, name: str, value: float) -> bool:
        """Set an input in its unit and return whether it has changed; InputError for another name or out of range."""
        if name not in self:
            raise InputError("session", name, one_of(self, name) if self else "this scene has no inputs")
        item = self[name]
        if not item.low <= value <= item.high:
            check_number(value, item.low, item.high, "session", name, item.unit.replace("1", ""))
        is_changed = bool((item.places != value * item.factor).any())
        if is_changed:
            item.places[:] = value * item.factor
        return is_changed


def with_copied_arrays(model: Model) -> Model:
    """Return the model with copies of its input arrays, which it otherwise shares with the scene."""
    elements = model.elements._replace(directed=model.elements.directed.copy())
    drive, friction = copy.deepcopy((model.drive, model.friction))
    return model._replace(elements=elements, drive=drive, friction=friction)


def inputs_of(scene: Scene, model: Model) -> Inputs:
    """Return the inputs of a compiled scene by name: actuators, motors and brakes, controller and friction."""
    return Inputs([*_of_actuators(scene, model), *_of_drive(scene, model), *_of_friction(model)])


def _of_actuators(scene: Scene, model: Model) -> Iterator[tuple[str, Input]]:
    number = law.LAWS.index(given)
    for k, name in enumerate(scene.vehicle.directed):
        if model.elements.law[k, law.LAW] == number:
            places = model.elements.directed[k, law.NUMBERS : law.NUMBERS + 1]
            yield f"{name}.force", Input("force on the first body along the actuator's direction", "N", places)


def _of_drive(scene: Scene, model: Model) -> Iterator[tuple[str, Input]]:
    """Yield torque or force of each motor and brake, or its share of the controller's force, and controller inputs."""
    spec, drive = scene.data.get("drive") or {"motors": [], "brakes": []}, model.drive
    for k, item in enumerate([*spec["motors"], *spec["brakes"]]):
        name, brake = item["name"], k >= len(spec["motors"])
        if drive.rows[k, KIND] == COMMANDED:  # a control law sets the torque
            continue
        if drive.rows[k, KIND] == CONTROLLED:
            radius = scene.vehicle.rolling_radius
            yield f"{name}.share", Input("share of the controller's force", "1", drive.lever[k : k + 1], radius, 0.0)
            continue
        key, unit, place = ("torque", "N m", "on the wheelset") if "torque" in item else ("force", "N", "at the rims")
        values = _values(drive.tables, drive.rows[k, TABLE])
        yield f"{name}.{key}", Input(f"{key} {place}", unit, values, low=0.0 if brake else -1e15)
    if "controller" in spec:
        yield "controller.speed", Input("speed to be kept", "m/s", _values(drive.tables, drive.control[0, SPEED]))
        yield "controller.limit", Input("largest force ahead", "N", drive.gains[0, MOST : MOST + 1], low=0.0)
        least = drive.gains[0, LEAST : LEAST + 1]
        yield "controller.brake_limit", Input("largest force back", "N", least, -1.0, 0.0)


def _of_friction(model: Model) -> Iterator[tuple[str, Input]]:
    """Yield the coefficient of friction of each rail, if the scene has one per rail.

    With tables of contact, the largest value of the scene is the upper bound, because the tables end there.
    """
    for rail, side in enumerate(SIDES if len(model.friction.points) else ()):
        values = _values(model.friction, rail)
        most = float(values.max()) if model.contact.strips.looked_up else 1.0
        yield f"friction.{side}", Input(f"coefficient of friction of the {side} rail", "1", values, 1.0, 1e-9, most)


def _values(tables: Schedules, k: int) -> np.ndarray:
    """Return a view of the values of the k-th table."""
    return tables.points[tables.starts[k] : tables.starts[k + 1], 1]
