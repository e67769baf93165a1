"""Integrate a compiled scene section by section in time."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

import wrcore
from wrcore.equations.model import Model
from wrcore.equations.own_law_failures import LawWatch
from wrcore.errors import InputError
from wrcore.errors.input_files import digest_of_all
from wrcore.integrate.integrator import integrate, needed_last
from wrcore.integrate.trajectory import Checkpoint, Trajectory
from wrcore.kernels.aside import compiled_aside
from wrcore.run.checkpoints import model_fingerprint
from wrcore.run.checks.validity import LOOK_UP_ERRORS
from wrcore.run.output.compute import ArcLengths, Outputs
from wrcore.run.output.run import Run
from wrcore.run.state import State, from_state
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import Scene

DERAILED_Y = 0.05
"""Lateral displacement from the track's centre above which a wheelset has derailed, m (flange tip on the rail: about
0.04 m)."""

COUNTERS = {
    "steps": "steps", "rejected": "rejected", "rhs_evaluations": "rhs_evaluations", "jacobians": "jacobians",
    "factorisations": "factorisations", "smallest_step_s": "smallest_step", "step_collapses": "collapses",
    "table_out_of_range": "out_of_range", "patches_on_grid": "on_grid",
    "patches_on_fixed_strips": "on_fixed_strips", "patches_not_tabulated": "not_tabulated",
    "patches_outside_training": "outside_training", "rails_unbalanced": "unbalanced", "wall_s": "wall_s",
}  # fmt: skip
"""Counters of a run, with the names of the same quantities in a `Trajectory`."""


def counters_of(trajectory: Trajectory, begin: float = 0.0) -> dict[str, Any]:
    """Return the counters of a trajectory that begins at a time (s), by their names in runs and sweeps."""
    simulated = float(trajectory.t[-1]) - begin if len(trajectory.t) else 0.0
    return {name: getattr(trajectory, attribute) for name, attribute in COUNTERS.items()} | {"simulated_s": simulated}


def integrate_by(settings: dict[str, Any], model: Model, start: Any, times: np.ndarray, **more: Any) -> Trajectory:
    """Integrate a model by the settings ``integration`` of a scene; ``more`` are further arguments of `integrate`."""
    return integrate(
        model, start, times, settings["method"], settings["rtol"], settings["atol"], settings["step"],
        settings["longest_step"], DERAILED_Y, most_steps=settings["most_steps"], **more,
    )  # fmt: skip


def joined_counters(before: dict[str, Any], more: dict[str, Any]) -> dict[str, Any]:
    """Return the counters of two successive sections of a run together; the time of compilation is the first one."""
    joined = dict(before)
    for name, value in more.items():
        if name == "compile_s":
            joined.setdefault(name, value)
        elif name == "smallest_step_s":
            joined[name] = min(value, joined.get(name, value))
        elif name in LOOK_UP_ERRORS:
            joined[name] = max(value, joined.get(name, 0.0))
        else:
            joined[name] = joined.get(name, 0) + value
    return joined


class Simulation:
    """A compiled scene and its present condition: its ``outputs``, the fingerprint ``mark`` of its ``model``, and the
    ``start`` (Checkpoint or state (size,)) of the next section in time.

    InputError if the run cannot begin at ``start``. ``progress`` wraps the patches of a creep table that has to be
    built.
    """

    def __init__(
        self,
        scene: Scene,
        start: Checkpoint | np.ndarray | None = None,
        progress: Callable | None = None,
    ) -> None:
        self._began = time.perf_counter()
        self.scene = scene
        method = scene.data["integration"]["method"]
        model, state = compile_scene(
            scene, progress, meanwhile=lambda model: compiled_aside(partial(needed_last, model, method))
        )
        self.outputs, self.mark = Outputs(scene, model), model_fingerprint(model)
        self.start, self._moved = state, 0.0
        if start is not None:
            self.begin_at(start)

    @property
    def model(self) -> Model:
        """Compiled model."""
        return self.outputs.model

    def begin_at(self, start: Checkpoint | np.ndarray, arc_lengths: ArcLengths | None = None) -> None:
        """Set the start of the next section; a checkpoint must be of exactly this model and method."""
        if isinstance(start, Checkpoint):
            method = self.scene.data["integration"]["method"]
            if start.model != self.mark:
                got = "another one's" if start.model else "one that does not say whose it is (of an older version)"
                expected = f"expected a checkpoint of this very model, got {got}"
                raise InputError(self.scene.source, "start", f"{expected}; the run's end_state is a start for any")
            if method not in (start.method, "auto"):
                expected = f"expected that of the start, {start.method}, got {method}"
                raise InputError(self.scene.source, "integration.method", expected)
        elif (begun := from_state(self.model, self.scene.vehicle, start, self.scene.source)) is not self.model:
            self.outputs.model, self.mark = begun, model_fingerprint(begun)
            self._moved = start.frame - begun.speed * start.t
        if arc_lengths is not None:
            if [known.shape for known in arc_lengths] != [known.shape for known in self.outputs.arc_lengths]:
                raise InputError(self.scene.source, "start", "expected as many places as wheelsets and bodies")
            self.outputs.arc_lengths = arc_lengths
        self.start = start

    def advance(
        self,
        times: np.ndarray,
        progress: Callable[[float], object] | None = None,
        stop: Callable[[], str] | None = None,
    ) -> Run:
        """Integrate one section over output times (n,), s, and return the run of this section.

        ``progress`` is called with the time reached (s). ``stop`` returns a reason to stop or an empty string.
        """
        settings = self.scene.data["integration"]
        begin = self.start.t if isinstance(self.start, Checkpoint) else float(times[0])
        trajectory = integrate_by(settings, self.model, self.start, times, progress=progress, stop=stop)
        compiled = time.perf_counter() - self._began - trajectory.wall_s
        run = self.run_of(*self._with_channels(trajectory, begin, compiled))
        self.start = run.end or self.start
        self._began = time.perf_counter()
        return run

    def _with_channels(self, trajectory, begin, compiled):
        """Arguments of `run_of`; a law of the user that raises an error at output times ends the run as failed."""
        watch, count = LawWatch(self.model), len(trajectory.t)
        if not watch.names:
            return trajectory, begin, compiled, *self.outputs.channels(trajectory)
        while True:
            found, fault = watch.fault_of(self.outputs.channels, trajectory)
            if fault and trajectory.status != "failed":
                trajectory = replace(trajectory, status="failed", reason=f"{fault} at an output time", end=None)
            if found is not None or not count:
                return trajectory, begin, compiled, *(found or ({}, {}))
            count //= 2  # a compiled law failed at an output: keep the outputs before it
            trajectory = replace(trajectory, t=trajectory.t[:count], states=trajectory.states[:count])

    def run_of(self, trajectory: Trajectory, begin: float, compiled: float, groups: dict, limits: dict) -> Run:
        """Return the run of a trajectory that begins at a time (s), with its `channels` and time of compilation (s)."""
        scene, settings = self.scene, self.scene.data["integration"]
        counters = counters_of(trajectory, begin) | {"compile_s": compiled}
        record = {"wrcore_version": wrcore.__version__, "detection": scene.detection, **flat(settings)}
        record |= {"method_used": trajectory.method, "files_sha256": digest_of_all(scene.files)}
        record |= {"laws_sha256": scene.laws.digests, "friction_largest": self.model.contact.friction}
        end = trajectory.end and replace(trajectory.end, model=self.mark)
        return Run(
            scene.data, trajectory.status, trajectory.reason, trajectory.t, groups, counters | limits, record,
            end, trajectory.end_t, self._end_state(trajectory),
        )  # fmt: skip

    def _end_state(self, trajectory: Trajectory) -> State | None:
        """Return the state at the end of a trajectory as a `State`, or None without a state."""
        return None if trajectory.end_state is None else self.state_at(trajectory.end_t, trajectory.end_state)

    def state_at(self, t: float, state: np.ndarray) -> State:
        """Return a state vector at a time (s) as a `State` with time, moving frame and names of the vehicle."""
        names = self.scene.vehicle.name, *self.scene.vehicle.body_names
        return State(state, t, self._moved + self.model.speed * t, names)


def flat(settings, prefix=""):
    """Return nested settings as a dict of one level, with keys joined by dots."""
    out: dict[str, Any] = {}
    for key, value in settings.items():
        out |= flat(value, f"{prefix}{key}.") if isinstance(value, dict) else {prefix + key: value}
    return out
