"""A scene that is stepped from outside: its inputs are set, its channels read, between one time and the next.

The integrator goes its own way: it reaches beyond a time that is asked for, and the state there is interpolated, as at
the output times of a run. Where no input changes, a session therefore follows the very trajectory of one run, bit by
bit. Where one does, the integrator begins anew at that time, with the length of its next step and without the rates of
before, so that no step runs across the change.
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
"""To this a crossing is located, s."""

PARTS = 16
"""Of an interval in which a crossing is sought, at a time."""

ROUNDING = 1e-9
"""Of an output time, over the distance of two."""

STEP = Within(1e-12, 1e5, "s")
"""Bounds of a step."""

Values = tuple[np.ndarray, ...]
"""Of all inputs, in their order."""


class _Output(NamedTuple):
    """A time (s) of a session's history with the state and the inputs that held up to it."""

    t: float
    state: np.ndarray
    values: Values
    is_output: bool
    """Whether it is an output time; else it is kept while it is the last one."""


@dataclass(frozen=True)
class Saved:
    """Where a session was: everything that decides on how it goes on."""

    time: float
    state: np.ndarray
    checkpoint: Checkpoint
    values: Values
    held: Values
    history: Any
    counted: np.ndarray
    ending: tuple[str, str]
    of: object
    """What tells the session from others."""


class Session:
    """A scene under way, one step at a time; :func:`start` makes one.

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
        self._history: Any = None  # the last `_Output` and, before it, what was the history then
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
        """State at the present time, ndarray of shape (size,) as the ``end_state`` of a :class:`Run`, a start for
        :func:`simulate`."""
        return self._simulation.state_at(self.time, self._state)

    @property
    def inputs(self) -> dict[str, float]:
        """Present values of what :meth:`set` sets, by name: ``NAME.force`` of actuators (N), ``NAME.torque`` (N m) or
        ``NAME.force`` (N) of motors and brakes, ``NAME.share`` of motors under the speed controller,
        ``controller.speed`` (m/s), ``.limit`` and ``.brake_limit`` (N), ``friction.left`` and ``friction.right`` where
        the scene tells the rails apart. NaN while a table of the scene rules."""
        return {name: item.value for name, item in self._inputs.items()}

    @property
    def meanings(self) -> dict[str, str]:
        """What each input is, with its unit."""
        return {name: f"{item.meaning}, {item.unit}" for name, item in self._inputs.items()}

    @checked
    def set(self, name: str, value: float) -> None:
        """Set an input from the present time on.

        Parameters
        ----------
        name : str
            One of ``inputs``.
        value : float
            In the input's unit. The value that it has already changes nothing, not even a bit.

        Raises
        ------
        InputError
            If there is no such input, or the value is none for it.
        """
        item = self._input(name)
        if not item.low <= value <= item.high:
            check_number(value, item.low, item.high, "session", name, item.unit.replace("1", ""))
        if (item.places != value * item.factor).any():
            item.places[:] = value * item.factor
            self._values = self._present_values()

    def step(self, dt: float, inputs: Mapping[str, float] | None = None) -> None:
        """Go on by a time.

        Parameters
        ----------
        dt : float
            s, 1e-12 to 1e5. A time that but for rounding is a whole multiple of it becomes just that, as output times
            of runs are.
        inputs : dict of str to float, optional
            Inputs to be set before, by name.

        Raises
        ------
        InputError
            If the session has ended, for a time that is none, and as :meth:`set`; then no input is changed.
        """
        if type(dt) is not float or not STEP.low <= dt <= STEP.high:
            dt = check_number(dt, STEP.low, STEP.high, "session", "dt", "s")
        if inputs is not None:
            self._check_running()
            self._set_all(inputs)
        self._reach(self._after(dt))

    def _set_all(self, inputs):
        """Set all of some inputs, or none of them where one is refused."""
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
        """Present values, by the names that they have in a table of a run.

        Parameters
        ----------
        *names : str
            Such as ``wheelset.y_m`` or ``wheelset/left.N_N.0`` (of the wheel's first patch), or what follows from the
            contacts, ``wheelset/left.Q_N``. Without any: all that the scene's ``output.channels`` ask for.

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
        """Keep where the session is, for :meth:`restore`."""
        run, ending = self._run, (self.status, self.reason)
        return Saved(
            self.time, self._state, copy.deepcopy(run.checkpoint(self.time)), self._values, self._held,
            self._history, run.equations.work.counters.copy(), ending, self._self,
        )  # fmt: skip

    def restore(self, saved: Saved) -> None:
        """Return to where this session was; it goes on from there bit by bit as it did then.

        Parameters
        ----------
        saved : Saved
            What :meth:`save` of this session has returned, as often as one likes.

        Raises
        ------
        InputError
            For anything else.
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
        """Step on to a time, or until a condition holds, which is located to a nanosecond.

        Parameters
        ----------
        end : float, str or callable
            A time, s; a condition such as ``"wheelset.y_m > 0.004"`` (a name of :meth:`channels`, ``<`` or ``>``, a
            number); or a function of all :meth:`channels`, and of what follows from them, that says whether it holds.
            It is seen if it holds at the end of a step. Where it holds already, the session stays.
        dt : float
            Length of the steps, s.
        latest : float
            Time at which a condition is given up, s.

        Returns
        -------
        bool
            Whether the time or the condition was reached.

        Raises
        ------
        InputError
            For a text that is no condition, a channel that there is not, a function that returns neither True nor
            False, or if the session has ended before.

        Notes
        -----
        A function is called several times where its condition begins to hold: it should depend on nothing else.
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
        """Everything so far as a run.

        Returns
        -------
        Run
            Output times are those of :func:`simulate`: multiples of 1/``output.rate``, the beginning and the present
            time, whatever the steps were. Each time with the inputs that held up to it. ``status`` is ``completed``
            while the session is running. The ``end_state`` is a start for any run, ``end`` for one whose scene says
            what the inputs are now.

        Raises
        ------
        InputError
            If the session keeps no record.
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
        """Apart from those of the integration, whose scratch arrays are part of what it goes on from."""
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
        """Let the integrator begin anew where inputs are others than those up to now."""
        if self._values is self._held:
            return
        if all(map(np.array_equal, self._values, self._held)):
            self._values = self._held
            return
        self._run.begin_anew(self.time, self._state)
        first, before = self._history
        if before is None:  # nothing has happened yet: they hold from the beginning
            self._history = first._replace(values=self._values), None
        self._held = self._values

    def _reach(self, t):
        """Integrate to a time (s) and keep what is there."""
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
        except BaseException:  # Ctrl-C: the session stays where it was
            if before is None:
                self._run.begin_anew(self.time, self._state)
            else:  # in a plain Python law: no kernel was left halfway
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
        """A record of the output times from here on to a time (s), and of this."""
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
        """The time a step (s) ahead; but for rounding a whole multiple of it, or an output time, where it is one."""
        t, rate = on_grid(self.time + dt, dt), self._rate
        near = round(t * rate) / rate
        return near if abs(near - t) <= ROUNDING * min(dt, 1.0 / rate) else t

    def _is_output(self, t):
        """Whether a time (s) is an output time but for rounding."""
        return abs(t * self._rate - round(t * self._rate)) <= ROUNDING

    def _keep(self, t, state, is_output):
        """Add a time (s) to the history; a step's end that is no output time goes when the next one comes."""
        before = self._history if self._recorded else None
        if before is not None and before[1] is not None and not before[0].is_output:
            before = before[1]
        self._history = _Output(t, state, self._held, is_output), before

    def _steps(self):
        """All output times so far, in their order."""
        steps, rest = [], self._history
        while rest is not None:
            step, rest = rest
            steps.append(step)
        return steps[::-1]

    def _locate(self, before, holds):
        """Go to where something begins to hold, after where the session was ``before``, at which it does not."""
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
    """Of pieces of a session's history, (n,) and (n, size)."""
    return np.array([item.t for item in items]), np.array([item.state for item in items])


@checked
def start(
    scene: Source,
    overrides: Iterable[str] | Mapping[str, Any] = (),
    start: Annotated[Checkpoint | np.ndarray | Literal["initial"], STARTS] = "initial",
    record: bool = True,
    **changes: Any,
) -> Session:
    """Begin a scene that is then stepped from outside.

    Parameters
    ----------
    scene, overrides, start, **changes
        As for :func:`simulate`; ``integration.duration`` does not count.
    record : bool
        Whether all steps are kept for :meth:`Session.run`; one of a coach takes 1 kB.

    Returns
    -------
    Session
        At its first time.

    Raises
    ------
    InputError
        One line that names the file, the field and what was expected; also for the methods of other libraries.

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
