"""State in which a run ended, with its time, the position of the moving frame and the names of its vehicle."""

from __future__ import annotations

from typing import Any

import numpy as np

from wrcore.bodies.body import STATE_SIZE
from wrcore.bodies.marker import FRAME
from wrcore.equations.model import Model, state_size
from wrcore.errors import InputError
from wrcore.geometry.path import arc_length_of
from wrcore.vehicle.description import Vehicle

REACH = 1.0
"""Largest distance along the track at time 0 between a body that elements connect to the moving frame and its nominal
position, m (chosen)."""


class State(np.ndarray):
    """State vector with its time ``t`` (s), the arc length ``frame`` (m) that the moving frame has travelled, and the
    names of the ``vehicle`` and its bodies (empty: not known). Arrays computed from it carry these attributes, too.
    """

    t: float = 0.0
    frame: float = 0.0
    vehicle: tuple[str, ...] = ()

    def __new__(cls, values: Any, t: float = 0.0, frame: float = 0.0, vehicle: tuple[str, ...] = ()) -> State:
        state = np.array(values, float).view(cls)
        state.t, state.frame, state.vehicle = t, frame, vehicle
        return state

    def __array_finalize__(self, other: Any) -> None:
        self.__dict__.update(getattr(other, "__dict__", {}))

    def __reduce__(self) -> Any:
        return State, (np.asarray(self), self.t, self.frame, self.vehicle)


def from_state(model: Model, vehicle: Vehicle, state: np.ndarray, source: str) -> Model:
    """Return the model with its moving frame at the position of a state.

    A plain array is a state at time 0, with the frame at its initial position. InputError if the state is of another
    vehicle, or if the bodies of a plain array are too far from their nominal positions.
    """
    if not isinstance(state, State):
        _check_position(model, vehicle, state, source)
        return model
    names = vehicle.name, *vehicle.body_names
    if state.vehicle and state.vehicle != names:
        other = state.vehicle[0] if state.vehicle[0] != vehicle.name else f"one of {', '.join(state.vehicle[1:])}"
        raise InputError(source, "start", f"expected a state of this very vehicle, {vehicle.name}, got that of {other}")
    elements, joints, moved = model.elements, model.joints, state.frame - model.speed * state.t
    if moved == 0.0:
        return model
    markers = joints.markers.copy()
    markers[joints.bodies[:, 1] == FRAME, 1, 0] += moved
    elements = elements._replace(offset=elements.offset + moved)
    return model._replace(elements=elements, joints=joints._replace(markers=markers))


def _check_position(model, vehicle, state, source):
    """Refuse an array at time 0 if bodies connected to the moving frame are more than `REACH` away from it."""
    if np.shape(state) != (state_size(model),) or np.asarray(state).dtype.kind not in "fiu":
        return  # not a state at all: the integrator refuses it
    for body in model.elements.pairs[model.elements.pairs[:, 1] == FRAME, 0]:
        s = arc_length_of(model.track.path, *np.asarray(state, float)[STATE_SIZE * body :][:3], np.nan)
        if abs(s - vehicle.positions[body, 0]) > REACH:
            expected = f"expected one at time 0, {vehicle.body_names[body]} beside the moving frame"
            got = f"got it {s - vehicle.positions[body, 0]:.6g} m ahead (the run's end_state knows its time)"
            raise InputError(source, "start", f"{expected}, {got}")
