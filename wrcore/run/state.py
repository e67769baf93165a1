"""The state in which a run ended, with all that its numbers do not say: time, moving frame, whose it is."""

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
"""At time 0 what elements hold to the moving frame is this near to its nominal place along the track, m (chosen)."""


class State(np.ndarray):
    """A state vector that knows its time ``t`` (s), the arc length ``frame`` (m) that the moving frame has gone, and
    the names of the ``vehicle`` and its bodies (empty: not known); what is computed from it does, too.
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
    """The model with its moving frame where a state has it; a plain array is one at time 0, the frame at its beginning.
    InputError for a state of another vehicle, or an array of bodies that are elsewhere.
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
    """Refuse an array whose bodies are not beside the frame, to which elements hold them, at its beginning."""
    if np.shape(state) != (state_size(model),) or np.asarray(state).dtype.kind not in "fiu":
        return  # no state at all: the integrator says so
    for body in model.elements.pairs[model.elements.pairs[:, 1] == FRAME, 0]:
        s = arc_length_of(model.track.path, *np.asarray(state, float)[STATE_SIZE * body :][:3], np.nan)
        if abs(s - vehicle.positions[body, 0]) > REACH:
            expected = f"expected one at time 0, {vehicle.body_names[body]} beside the moving frame"
            got = f"got it {s - vehicle.positions[body, 0]:.6g} m ahead (the run's end_state knows its time)"
            raise InputError(source, "start", f"{expected}, {got}")
