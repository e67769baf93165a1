"""Sessions: a scene that the caller steps in time, setting inputs and reading channels between the steps.

The integrator chooses its steps independently of the requested times: it integrates beyond a requested time and
interpolates the state there, as at the output times of a run. Without a change of inputs, a session is therefore
bitwise identical to one run. At a change of an input the integrator restarts, so that no step crosses the change. It
keeps the length of its next step and discards the earlier rates.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import groupby, pairwise
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np

from wrcore.creep.table import show_progress
from wrcore.equations.equations_of_motion import Equations
from wrcore.equations.own_law_failures import LawWatch
from wrcore.errors import InputError, check_number, one_of, short
from wrcore.errors.checked_calls import Within, checked
from wrcore.integrate import engine
from wrcore.integrate.integrator import CHUNK, REFERENCES, STALL_STEP, Headway, Integration, beginning
from wrcore.integrate.trajectory import Checkpoint, Trajectory
from wrcore.run.asked import condition_of, on_grid, told_by, value_of
from wrcore.run.checkpoints import model_fingerprint
from wrcore.run.checks.reach import check_reach
from wrcore.run.checks.validity import LOOK_UP_ERRORS
from wrcore.run.inputs import Input, inputs_of, with_copied_arrays
from wrcore.run.output.run import Run
from wrcore.run.simulate import LARGEST_RUN, STARTS, bytes_per_time, opened
from wrcore.run.simulation import DERAILED_Y, Simulation
from wrcore.run.state import State
from wrcore.scene.description import Source

RESOLUTION = 1e-9
"""Resolution in time with which the beginning of a condition is located, s."""

PARTS = 16
"""Number of parts into which the interval is divided in each pass of the search for the beginning of a condition."""

ROUNDING = 1e-9
"""Tolerance of an output time for rounding errors, relative to the distance between two output times."""

STEP = Within(1e-12, 1e5, "s")
"""Bounds of the length of a step, s."""

Values = tuple[np.ndarray, ...]
"""Values of all inputs of a session, in the order of their names."""


class _Output(NamedTuple):
    """One time (s) of a session's history, with the state there and the inputs that were applied up to it."""

    t: float
    state: np.ndarray
    values: Values
    is_output: bool
    """Whether this is an output time; another time is kept only as long as it is the last time."""


@dataclass(frozen=True)
class Saved:
    """Saved condition of a session: everything that determines how it continues."""

    time: float
    state: np.ndarray
    checkpoint: Checkpoint
    values: Values
    held: Values
    history: Any
    counted: np.ndarray
    ending: tuple[str, str]
    of: object
    """Identity of the session, so that another session refuses to restore it."""


class Session:
    """A scene that is integrated step by step under the caller's control; :func:`start` creates one.

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
        self.scene, self._simulation, self._recorded = simulation.scene, simulation, record
        model = simulation.model = with_copied_arrays(simulation.model)
        settings = self.scene.data["integration"]
        step, longest = settings["step"], settings["longest_step"]
        start, method, looks = beginning(model, simulation.start, settings["method"], step)
        if method in REFERENCES:
            expected = f"expected a compiled method for a session, got {method}"
            raise InputError(self.scene.source, "integration.method", expected)
        tolerance = settings["rtol"], settings["atol"]
        self._run = Integration(model, start, begin, method, tolerance, step, longest, DERAILED_Y, looks=looks)
        self._headway = Headway(
            self._run.memory, settings["most_steps"], 0.0 if step else min(STALL_STEP, 0.1 * longest)
        )
        self._counted, self._arc_lengths = self._run.memory.counters.copy(), simulation.arc_lengths
        self._outputs: Equations | None = None
        self._inputs: dict[str, Input] = inputs_of(self.scene, model)
        self._values = self._held = self._present_values()
        self.status, self.reason = "running", ""
        self._in_python = LawWatch(model).in_python
        self._record = self._run.record(np.array([begin]))
        self._run.without_dispatch(self._record)
        self._rate = float(self.scene.data["output"]["rate"])
        self._begin, self._most = begin, LARGEST_RUN / bytes_per_time(self.scene.vehicle)
        self._history: Any = None  # linked list: (last `_Output`, earlier history)
        self._self = object()
        self.time, self._state = begin, np.array(self._run.memory.state)
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
        item = self._input(name)
        if not item.low <= value <= item.high:
            check_number(value, item.low, item.high, "session", name, item.unit.replace("1", ""))
        if (item.places != value * item.factor).any():
            item.places[:] = value * item.factor
            self._values = self._present_values()

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
        self._reach(self._after(dt))

    def _set_all(self, inputs):
        """Set several inputs, or none of them if one is refused."""
        if not isinstance(inputs, Mapping):
            raise InputError("session", "inputs", f"expected values by names, got {short(inputs)}")
        before, values = self._present_values(), self._values
        try:
            for name, value in inputs.items():
                self.set(name, value)
        except BaseException:
            self._put(before)
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
        groups = self._simulation.present(trajectory, asked, self._run.places[0], self._equations_of_outputs())
        run = Run(self.scene.data, "completed", "", trajectory.t, groups)
        if not names:
            return {".".join(map(str, name)): float(values[0]) for name, values in run.columns()}
        return {name: value_of(run, name) for name in names}

    def save(self) -> Saved:
        """Return the present condition of the session, for :meth:`restore`."""
        run, ending = self._run, (self.status, self.reason)
        return Saved(
            self.time, self._state, copy.deepcopy(run.checkpoint(self.time)), self._values, self._held,
            self._history, run.equations.work.counters.copy(), ending, self._self,
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
        self._run.go_on_from(saved.checkpoint)
        self._run.equations.work.counters[:] = saved.counted
        self._put(saved.values)
        self._values, self._held, self._state = saved.values, saved.held, saved.state
        self.time, (self.status, self.reason) = saved.time, saved.ending
        self._history = saved.history

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
                self._reach(min(self._after(dt), end))
            return self.time >= end
        names, holds = ((), lambda values: told_by(end, values, self.channels)) if callable(end) else condition_of(end)
        while not holds(self.channels(*names)):
            if self.time >= latest or self.status != "running":
                return False
            before = self.save()
            self._reach(min(self._after(dt), latest))
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
        if not self._recorded:
            raise InputError("session", "run", "expected a session that keeps a record of its steps")
        self._settle()
        simulation, kept, history = self._simulation, self._simulation.arc_lengths, self._steps()
        simulation.arc_lengths = self._arc_lengths
        groups: dict[str, dict[str, list[np.ndarray]]] = {}
        limits: dict[str, Any] = {}
        try:
            for _, items in groupby(history, key=lambda item: id(item.values)):
                piece = list(items)
                self._put(piece[0].values)
                times, states = _times_and_states(piece)
                part = Trajectory(self._run.method, times, states, "completed", "")
                found, more = simulation.channels(part, self._equations_of_outputs())
                for group, name, values in ((g, n, v) for g, of in found.items() for n, v in of.items()):
                    groups.setdefault(group, {}).setdefault(name, []).append(values)
                for name, value in more.items():
                    before = limits.get(name, 0)
                    limits[name] = max(before, value) if name in LOOK_UP_ERRORS else before + value
        finally:
            self._put(self._values)
            simulation.arc_lengths = kept
        simulation.mark = model_fingerprint(simulation.model)
        joined = {group: {name: np.concatenate(v) for name, v in of.items()} for group, of in groups.items()}
        record = self._run.record(np.empty(len(history)))
        record.times[:], record.states[:] = _times_and_states(history)
        record.reached[0] = len(history)
        whole = self._run.trajectory(record, engine.COMPLETED, "", self._counted, 0.0)
        whole = replace(whole, end=copy.deepcopy(whole.end))
        if self.status != "running":
            ending = {"status": self.status, "reason": self.reason, "end_t": self.time, "end_state": self._state}
            whole = replace(whole, end=None, **ending)
        return simulation.run_of(whole, float(whole.t[0]), 0.0, joined, limits)

    def _equations_of_outputs(self):
        """Return equations for outputs; those of the integration hold scratch arrays that it continues from."""
        self._outputs = self._outputs or Equations(self._simulation.model)
        return self._outputs

    def _input(self, name):
        if name not in self._inputs:
            raise InputError(
                "session", name, one_of(self._inputs, name) if self._inputs else "this scene has no inputs"
            )
        return self._inputs[name]

    def _present_values(self):
        return tuple(item.places.copy() for item in self._inputs.values())

    def _put(self, values):
        for item, numbers in zip(self._inputs.values(), values, strict=True):
            item.places[:] = numbers

    def _settle(self):
        """Restart the integrator if inputs differ from the values that were applied up to the present time."""
        if self._values is self._held:
            return
        if all(map(np.array_equal, self._values, self._held)):
            self._values = self._held
            return
        self._run.begin_anew(self.time, self._state)
        first, before = self._history
        if before is None:  # no step has been made: the inputs apply from the beginning
            self._history = first._replace(values=self._values), None
        self._held = self._values

    def _reach(self, t):
        """Integrate to a time (s) and add the states at its output times to the history."""
        if self.status != "running":
            self._check_running()
        if self._values is not self._held:
            self._settle()
        record, given_up = self._record_to(t), ""
        before = copy.deepcopy(self._run.checkpoint(self.time)) if self._in_python else None
        try:
            outcome = self._run.advance(record, CHUNK)
            while outcome == engine.RUNNING and not (given_up := self._headway.lost()):
                outcome = self._run.advance(record, min(CHUNK, self._headway.attempts_left()))
        except BaseException:  # Ctrl-C: the session keeps its time and state
            if before is None:
                self._run.begin_anew(self.time, self._state)
            else:  # in a plain Python law: no kernel was interrupted
                self._run.go_on_from(before)
            raise
        times = record.times[: record.reached[0]].tolist()
        for time, state in zip(times, record.states, strict=False):
            self._keep(time, state.copy(), time < t or self._is_output(t))
        if outcome == engine.COMPLETED:
            self.time, self._state = t, self._history[0].state
            return
        self.status, self.reason = self._run.ending(outcome, given_up)
        self.time, self._state = float(self._run.memory.clock[engine.T]), self._run.memory.state.copy()

    def _check_running(self):
        if self.status != "running":
            expected = f"expected no further step: {self.status} at {self.time:g} s, {self.reason}"
            raise InputError("session", "", expected)

    def _record_to(self, t):
        """Return an empty record for the output times between the present time and a time (s), and for this time."""
        first = math.floor(self.time * self._rate + ROUNDING) + 1
        count = math.ceil(t * self._rate - ROUNDING) - first
        if not self._recorded or self._history is None or count <= 0:
            self._record.times[0], self._record.reached[0] = t, 0
            return self._record
        if (t - self._begin) * self._rate > self._most:
            expected = f"expected at most {self._most:.2g} output times in memory; or a session with record=False"
            raise InputError(self.scene.source, "output.rate", expected)
        return self._run.record(np.append(np.arange(first, first + count) / self._rate, t))

    def _after(self, dt):
        """Return the time one step (s) ahead, rounded to a multiple of the step or an output time if it is close."""
        t, rate = on_grid(self.time + dt, dt), self._rate
        near = round(t * rate) / rate
        return near if abs(near - t) <= ROUNDING * min(dt, 1.0 / rate) else t

    def _is_output(self, t):
        """Whether a time (s) is an output time up to rounding errors."""
        return abs(t * self._rate - round(t * self._rate)) <= ROUNDING

    def _keep(self, t, state, is_output):
        """Add a time (s) to the history; it replaces the last entry if that is not an output time."""
        before = self._history if self._recorded else None
        if before is not None and before[1] is not None and not before[0].is_output:
            before = before[1]
        self._history = _Output(t, state, self._held, is_output), before

    def _steps(self):
        """Return all entries of the history, in order of time."""
        steps, rest = [], self._history
        while rest is not None:
            step, rest = rest
            steps.append(step)
        return steps[::-1]

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


def _times_and_states(items):
    """Return times (n,), s, and states (n, size) of entries of a session's history."""
    return np.array([item.t for item in items]), np.array([item.state for item in items])


@checked
def start(
    scene: Source,
    overrides: Iterable[str] | Mapping[str, Any] = (),
    start: Annotated[Checkpoint | np.ndarray | Literal["initial"], STARTS] = "initial",
    record: bool = True,
    **changes: Any,
) -> Session:
    """Start a session: a scene that the caller steps in time.

    Parameters
    ----------
    scene, overrides, start, **changes
        As for :func:`simulate`; ``integration.duration`` is ignored.
    record : bool
        Whether all steps are kept for :meth:`Session.run`; a step of a coach takes 1 kB.

    Returns
    -------
    Session
        The session at its first time.

    Raises
    ------
    InputError
        One line that names the file, the field and the expected value. Integration methods of other libraries are
        refused, too.

    Examples
    --------
    >>> import wrcore as wr
    >>> session = wr.start("config/scenes/suspended_wheelset.yaml", speed=30)
    >>> for _ in range(10):
    ...     session.step(0.01)
    >>> once = wr.simulate("config/scenes/suspended_wheelset.yaml", speed=30, integration__duration=0.1)
    >>> bool(session.channels("wheelset.y_m")["wheelset.y_m"] == once["wheelset"].y_m[-1])
    True
    """
    scene, begin_at, begin = opened("start", scene, overrides, start, changes)
    if begin_at is None:
        check_reach(scene)
    return Session(Simulation(scene, begin_at, show_progress), begin, record)
