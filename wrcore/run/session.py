"""Sessions: a scene that the caller steps in time, setting inputs and reading channels between the steps.

The integrator chooses its steps independently of the requested times: it integrates beyond a requested time and
interpolates the state there, as at the output times of a run. Without a change of inputs, a session is therefore
bitwise identical to one run. At a change of an input the integrator restarts, so that no step crosses the change. It
keeps the length of its next step and discards the earlier rates.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import groupby, pairwise
from typing import Annotated, Any

import numpy as np

from wrcore.equations.equations_of_motion import Equations
from wrcore.errors import InputError, check_number, short
from wrcore.errors.checked_calls import Within, checked
from wrcore.integrate import engine
from wrcore.integrate.trajectory import Checkpoint, Trajectory
from wrcore.run.asked import condition_of, told_by, value_of
from wrcore.run.checkpoints import model_fingerprint
from wrcore.run.history import Entry, History, times_and_states
from wrcore.run.inputs import Values, inputs_of, with_copied_arrays
from wrcore.run.output.run import Run
from wrcore.run.simulate import LARGEST_RUN, bytes_per_time
from wrcore.run.simulation import Simulation, joined_counters
from wrcore.run.state import State
from wrcore.run.stepped import SteppedIntegration

RESOLUTION = 1e-9
"""Resolution in time with which the beginning of a condition is located, s."""

PARTS = 16
"""Number of parts into which the interval is divided in each pass of the search for the beginning of a condition."""

STEP = Within(1e-12, 1e5, "s")
"""Bounds of the length of a step, s."""


@dataclass(frozen=True)
class Saved:
    """Saved condition of a session: everything that determines how it continues."""

    time: float
    state: np.ndarray
    integration: tuple[Checkpoint, np.ndarray]
    values: Values
    held: Values
    history: Any
    ending: tuple[str, str]
    of: object
    """Identity of the session, so that another session refuses to restore it."""


class Session:
    """A scene that is integrated step by step under the caller's control; :func:`wrcore.start` creates one.

    Attributes
    ----------
    time : float
        Time reached, s.
    status, reason : str
        ``running`` until the vehicle has derailed (``derailed``), the step size collapses (``stalled``) or a number is
        not finite (``failed``), and why.

    Examples
    --------
    >>> import wrcore as wr
    >>> session = wr.start(wr.example("suspended_wheelset"), speed=50, contact__friction={"left": 0.3, "right": 0.3})
    >>> isinstance(session, Session), session.inputs
    (True, {'friction.left': 0.3, 'friction.right': 0.3})
    >>> before = session.save()
    >>> session.step(0.01, {"friction.left": 0.1})
    >>> session.time, session.status
    (0.01, 'running')
    >>> session.restore(before)
    >>> session.time, session.inputs["friction.left"]
    (0.0, 0.3)
    """

    def __init__(self, simulation: Simulation, begin: float, record: bool = True) -> None:
        self.scene, self._simulation = simulation.scene, simulation
        model = simulation.outputs.model = with_copied_arrays(simulation.model)
        settings, source = self.scene.data["integration"], self.scene.source
        self._run = SteppedIntegration(model, simulation.start, begin, settings, source)
        self._arc_lengths = simulation.outputs.arc_lengths
        self._outputs: Equations | None = None
        self._inputs = inputs_of(self.scene, model)
        self._values = self._held = self._inputs.present()
        self.status, self.reason = "running", ""
        self._history = History(float(self.scene.data["output"]["rate"]), record)
        self._begin, self._most = begin, LARGEST_RUN / bytes_per_time(self.scene.vehicle)
        self._self = object()
        self.time, self._state = begin, self._run.memory.state.copy()
        self._reach(begin)

    def __repr__(self) -> str:
        inputs = ", ".join(self._inputs) or "none"
        return f"Session {self.scene.data['name']!r}: {self.status}, t = {self.time:g} s; inputs: {inputs}"

    def __reduce__(self) -> str:
        raise InputError("session", "copy", "expected save and restore, or run().end_state for another session")

    @property
    def state(self) -> State:
        """State at the present time, ndarray of shape (size,), in the form of the ``end_state`` of a :class:`Run`.
        :func:`simulate` takes it as a start."""
        return self._simulation.state_at(self.time, self._state)

    @property
    def inputs(self) -> dict[str, float]:
        """Present values of the inputs that :meth:`set` sets, by name.

        ``NAME.force`` of actuators (N), ``NAME.torque`` (N m) or ``NAME.force`` (N) of motors and brakes,
        ``NAME.share`` of motors under the speed controller, ``controller.speed`` (m/s), ``.limit`` and
        ``.brake_limit`` (N), ``friction.left`` and ``friction.right`` if the scene has a coefficient per rail. NaN
        while a table of the scene determines the value.
        """
        return {name: item.value for name, item in self._inputs.items()}

    @property
    def meanings(self) -> dict[str, str]:
        """Meaning and unit of each input, by name."""
        return {name: f"{item.meaning}, {item.unit}" for name, item in self._inputs.items()}

    @checked
    def set(self, name: str, value: float) -> None:
        """Set an input from the present time on.

        Parameters
        ----------
        name : str
            One of ``inputs``.
        value : float
            In the input's unit. If it is the present value, the results stay bitwise identical.

        Raises
        ------
        InputError
            If there is no such input, or the value is outside its bounds.
        """
        if self._inputs.set(name, value):
            self._values = self._inputs.present()

    def step(self, dt: float, inputs: Mapping[str, float] | None = None) -> None:
        """Integrate by one step of length ``dt``.

        Parameters
        ----------
        dt : float
            Length of the step, s, 1e-12 to 1e5. If the time reached is an integer multiple of it up to rounding errors,
            it becomes exactly this multiple, like the output times of runs.
        inputs : dict of str to float, optional
            Inputs that are set before the step, by name.

        Raises
        ------
        InputError
            If the session has ended, if ``dt`` is out of range, or if :meth:`set` refuses an input; then no input is
            changed.
        """
        if type(dt) is not float or not STEP.low <= dt <= STEP.high:
            dt = check_number(dt, STEP.low, STEP.high, "session", "dt", "s")
        if inputs is not None:
            self._check_running()
            self._set_all(inputs)
        self._reach(self._history.after(self.time, dt))

    def _set_all(self, inputs):
        """Set several inputs, or none of them if one is refused."""
        if not isinstance(inputs, Mapping):
            raise InputError("session", "inputs", f"expected values by names, got {short(inputs)}")
        before, values = self._inputs.present(), self._values
        try:
            for name, value in inputs.items():
                self.set(name, value)
        except BaseException:
            self._inputs.put(before)
            self._values = values
            raise

    @checked
    def channels(self, *names: str) -> dict[str, float]:
        """Return present values of channels by their column names in a table of a run.

        Parameters
        ----------
        *names : str
            Such as ``wheelset.y_m`` or ``wheelset/left.N_N.0`` (the wheel's first patch), or channels that are derived
            from the contacts, ``wheelset/left.Q_N``. Without names: all channels of the scene's ``output.channels``.

        Returns
        -------
        dict of str to float
            SI units, as the names say; NaN where a patch is absent.

        Raises
        ------
        InputError
            For a name that a run of this scene does not have.
        """
        trajectory = Trajectory(self._run.method, np.array([self.time]), self._state[None, :], "completed", "")
        asked = {name.partition(".")[0] for name in names} or {*self.scene.vehicle.body_names, "drive/", "energy"}
        groups = self._simulation.outputs.present(trajectory, asked, self._run.places[0], self._equations_of_outputs())
        run = Run(self.scene.data, "completed", "", trajectory.t, groups)
        if not names:
            return {".".join(map(str, name)): float(values[0]) for name, values in run.columns()}
        return {name: value_of(run, name) for name in names}

    def save(self) -> Saved:
        """Return the present condition of the session, for :meth:`restore`."""
        return Saved(
            self.time, self._state, self._run.save(self.time), self._values, self._held, self._history.entries,
            (self.status, self.reason), self._self,
        )  # fmt: skip

    def restore(self, saved: Saved) -> None:
        """Return to a saved condition of this session; the continuation is bitwise identical to the first one.

        Parameters
        ----------
        saved : Saved
            Result of :meth:`save` of this session; it can be restored any number of times.

        Raises
        ------
        InputError
            If ``saved`` is anything else, or from another session.
        """
        if not isinstance(saved, Saved) or saved.of is not self._self:
            raise InputError("session", "saved", "expected what this session's save returned")
        self._run.restore(saved.integration)
        self._inputs.put(saved.values)
        self._values, self._held, self._state = saved.values, saved.held, saved.state
        self.time, (self.status, self.reason) = saved.time, saved.ending
        self._history.entries = saved.history

    @checked
    def run_until(
        self,
        end: Annotated[float, Within(0.0, 1e6, "s")] | str | Callable[[Mapping[str, float]], bool],
        dt: Annotated[float, STEP] = 0.01,
        latest: Annotated[float, Within(0.0, 1e6, "s")] = 100.0,
    ) -> bool:
        """Step to a time, or until a condition holds; the time of the latter is located to a nanosecond.

        Parameters
        ----------
        end : float, str or callable
            A time, s; a condition such as ``"wheelset.y_m > 0.004"`` (a name of :meth:`channels`, ``<`` or ``>``, a
            number); or a function of all :meth:`channels`, stored and derived, that returns whether the condition
            holds. A condition is tested at the end of each step. If it holds already, the session does not step.
        dt : float
            Length of the steps, s.
        latest : float
            Time at which the session stops if the condition has not been met, s.

        Returns
        -------
        bool
            Whether the time or the condition was reached.

        Raises
        ------
        InputError
            If a text is not a condition, a channel does not exist, a function returns neither True nor False, or the
            session has ended before.

        Notes
        -----
        A function is called several times near the time at which its condition begins to hold. It should depend on the
        channels only.
        """
        if not isinstance(end, str) and not callable(end):
            while self.time < end and self.status == "running":
                self._reach(min(self._history.after(self.time, dt), end))
            return self.time >= end
        names, holds = ((), lambda values: told_by(end, values, self.channels)) if callable(end) else condition_of(end)
        while not holds(self.channels(*names)):
            if self.time >= latest or self.status != "running":
                return False
            before = self.save()
            self._reach(min(self._history.after(self.time, dt), latest))
            if self.status == "running" and holds(self.channels(*names)):
                self._locate(before, lambda: holds(self.channels(*names)))
                return True
        return True

    def run(self) -> Run:
        """Return the session from its beginning to the present time as a run.

        Returns
        -------
        Run
            Output times are those of :func:`simulate`: multiples of 1/``output.rate``, the beginning and the present
            time, independent of the steps. Channels of each time use the inputs that were applied up to it. ``status``
            is ``completed`` while the session is running. Any run can start from ``end_state``. A run can start from
            ``end`` only if its scene contains the present values of the inputs.

        Raises
        ------
        InputError
            If the session was started with ``record=False``.
        """
        if not self._history.is_kept:
            raise InputError("session", "run", "expected a session that keeps a record of its steps")
        self._settle()
        simulation, outputs, history = self._simulation, self._simulation.outputs, self._history.in_order()
        kept, outputs.arc_lengths = outputs.arc_lengths, self._arc_lengths
        pieces: list[dict[str, dict[str, np.ndarray]]] = []
        limits: dict[str, Any] = {}
        try:
            for _, entries in groupby(history, key=lambda entry: id(entry.values)):
                piece = list(entries)
                self._inputs.put(piece[0].values)
                part = Trajectory(self._run.method, *times_and_states(piece), "completed", "")
                found, more = outputs.channels(part, self._equations_of_outputs())
                pieces.append(found)
                limits = joined_counters(limits, more)
        finally:
            self._inputs.put(self._values)
            outputs.arc_lengths = kept
        simulation.mark = model_fingerprint(simulation.model)
        joined = {
            group: {name: np.concatenate([piece[group][name] for piece in pieces]) for name in channels}
            for group, channels in pieces[0].items()
        }
        whole = self._run.whole(*times_and_states(history))
        if self.status != "running":
            ending = {"status": self.status, "reason": self.reason, "end_t": self.time, "end_state": self._state}
            whole = replace(whole, end=None, **ending)
        return simulation.run_of(whole, float(whole.t[0]), 0.0, joined, limits)

    def _equations_of_outputs(self):
        """Return equations for outputs; those of the integration hold scratch arrays that it continues from."""
        self._outputs = self._outputs or Equations(self._simulation.model)
        return self._outputs

    def _settle(self):
        """Restart the integrator if inputs differ from the values that were applied up to the present time."""
        if self._values is self._held:
            return
        if all(map(np.array_equal, self._values, self._held)):
            self._values = self._held
            return
        self._run.begin_anew(self.time, self._state)
        self._history.begin_with(self._values)
        self._held = self._values

    def _reach(self, t):
        """Integrate to a time (s) and add the states at its output times to the history."""
        if self.status != "running":
            self._check_running()
        if self._values is not self._held:
            self._settle()
        between = self._history.times_between(self.time, t)
        if len(between) and (t - self._begin) * self._history.rate > self._most:
            expected = f"expected at most {self._most:.2g} output times in memory; or a session with record=False"
            raise InputError(self.scene.source, "output.rate", expected)
        record, self.status, self.reason = self._run.reach(self.time, self._state, between, t)
        for time, state in zip(record.times[: record.reached[0]].tolist(), record.states, strict=False):
            is_output = time < t or self._history.is_output(t)
            self._history.add(Entry(time, state.copy(), self._held, is_output))
        if self.status == "running":
            self.time, self._state = t, self._history.last.state
        else:
            self.time, self._state = float(self._run.memory.clock[engine.T]), self._run.memory.state.copy()

    def _check_running(self):
        if self.status != "running":
            expected = f"expected no further step: {self.status} at {self.time:g} s, {self.reason}"
            raise InputError("session", "", expected)

    def _locate(self, before, holds):
        """Go to the time at which a condition begins to hold, after the saved condition ``before`` of the session."""
        low, high = before.time, self.time
        while high - low > RESOLUTION:
            self.restore(before)
            for below, t in pairwise(np.linspace(low, high, PARTS + 1).tolist()):
                self._reach(t)
                if holds():
                    low, high = below, t
                    break
        self.restore(before)
        self._reach(high)
