"""Integrate a compiled model from one requested time to the next, with inputs that may change between them."""

from __future__ import annotations

import copy
from dataclasses import replace
from typing import Any

import numpy as np

from wrcore.equations.model import Model
from wrcore.equations.own_law_failures import LawWatch
from wrcore.errors import InputError
from wrcore.integrate import engine
from wrcore.integrate.integrator import CHUNK, REFERENCES, STALL_STEP, Headway, Integration, beginning
from wrcore.integrate.trajectory import Checkpoint, Trajectory
from wrcore.run.simulation import DERAILED_Y


class SteppedIntegration(Integration):
    """Integration of a model by the settings ``integration`` of the scene ``source``, to one time after another."""

    def __init__(self, model: Model, start: Any, begin: float, settings: dict[str, Any], source: str) -> None:
        step, longest = settings["step"], settings["longest_step"]
        start, method, looks = beginning(model, start, settings["method"], step)
        if method in REFERENCES:
            raise InputError(source, "integration.method", f"expected a compiled method for a session, got {method}")
        tolerance = settings["rtol"], settings["atol"]
        super().__init__(model, start, begin, method, tolerance, step, longest, DERAILED_Y, looks=looks)
        self._headway = Headway(self.memory, settings["most_steps"], 0.0 if step else min(STALL_STEP, 0.1 * longest))
        self._counted, self._in_python = self.memory.counters.copy(), LawWatch(model).in_python
        self._one_time = self.record(np.array([begin]))
        self.without_dispatch(self._one_time)

    def reach(self, t: float, state: np.ndarray, between: np.ndarray, end: float) -> tuple[Any, str, str]:
        """Integrate from a time (s) with a state (size,) to ``end``; return a record, the status and the reason.

        The record holds the times ``between`` and ``end``. If an error or Ctrl-C interrupts the integration, it goes on
        from the given time and state.
        """
        record, given_up = self._one_time, ""
        record.times[0], record.reached[0] = end, 0
        if len(between):
            record = self.record(np.append(between, end))
        before = copy.deepcopy(self.checkpoint(t)) if self._in_python else None
        try:
            outcome = self.advance(record, CHUNK)
            while outcome == engine.RUNNING and not (given_up := self._headway.lost()):
                outcome = self.advance(record, min(CHUNK, self._headway.attempts_left()))
        except BaseException:
            if before is None:
                self.begin_anew(t, state)
            else:  # in a plain Python law: no kernel was interrupted
                self.go_on_from(before)
            raise
        return record, *(("running", "") if outcome == engine.COMPLETED else self.ending(outcome, given_up))

    def save(self, t: float) -> tuple[Checkpoint, np.ndarray]:
        """Return a checkpoint at a requested time (s), and the counters of contacts, for :meth:`restore`."""
        return copy.deepcopy(self.checkpoint(t)), self.equations.work.counters.copy()

    def restore(self, saved: tuple[Checkpoint, np.ndarray]) -> None:
        """Return to a saved condition."""
        self.go_on_from(saved[0])
        self.equations.work.counters[:] = saved[1]

    def whole(self, times: np.ndarray, states: np.ndarray) -> Trajectory:
        """Return the trajectory of the whole integration, with states (n, size) at times (n,), s."""
        record = self.record(times)
        record.states[:], record.reached[0] = states, len(times)
        whole = self.trajectory(record, engine.COMPLETED, "", self._counted, 0.0)
        return replace(whole, end=copy.deepcopy(whole.end))
