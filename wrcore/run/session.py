"""A scene that is stepped from outside: its inputs are set, its channels read, between one time and the next.

The integrator goes its own way: it reaches beyond a time that is asked for, and the state there is interpolated, as at
the output times of a run. Where no input changes, a session therefore follows the very trajectory of one run, bit by
bit. Where one does, the integrator begins anew at that time, with the length of its next step and without the rates of
before, so that no step runs across the change.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import groupby, pairwise
from typing import Annotated, Any, Literal

import numpy as np

from wrcore.creep.table import show_progress
from wrcore.dynamics.system import Equations
from wrcore.errors import InputError, check_number, one_of, short
from wrcore.errors.checked_calls import Within, checked
from wrcore.integrate import engine
from wrcore.integrate.integrator import CHUNK, REFERENCES, STALL_STEP, Headway, Integration, beginning
from wrcore.integrate.trajectory import Checkpoint, Trajectory
from wrcore.run.asked import Named, condition_of, on_grid, value_of
from wrcore.run.checkpoints import model_fingerprint
from wrcore.run.inputs import Input, inputs_of, with_own_arrays
from wrcore.run.reach import check_reach
from wrcore.run.run import Run
from wrcore.run.simulate import STARTS, opened
from wrcore.run.simulation import DERAILED_Y, Simulation
from wrcore.run.state import State
from wrcore.run.validity import LOOK_UP_ERRORS
from wrcore.scene.description import Source

RESOLUTION = 1e-9
"""To this a crossing is located, s."""

PARTS = 16
"""Of an interval in which a crossing is sought, at a time."""

STEP = Within(1e-12, 1e5, "s")
"""Bounds of a step."""

Values = tuple[np.ndarray, ...]
"""Of all inputs, in their order."""


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
        model = simulation.model = with_own_arrays(simulation.model)
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
        self._record = self._run.record(np.array([begin]))
        self._run.without_dispatch(self._record)
        self._history: Any = None  # the last step (time, state, inputs) and, before it, what was the history then
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
            If the session has ended, for a time that is none, and as :meth:`set`.
        """
        if inputs is not None:
            if not isinstance(inputs, Mapping):
                raise InputError("session", "inputs", f"expected values by names, got {short(inputs)}")
            for name, value in inputs.items():
                self.set(name, value)
        if type(dt) is not float or not STEP.low <= dt <= STEP.high:
            dt = check_number(dt, STEP.low, STEP.high, "session", "dt", "s")
        self._reach(on_grid(self.time + dt, dt))

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
            For a text that is no condition, a channel that there is not, or if the session has ended before.

        Notes
        -----
        A function is called several times where its condition begins to hold: it should depend on nothing else.
        """
        if not isinstance(end, str) and not callable(end):
            while self.time < end and self.status == "running":
                self._reach(min(on_grid(self.time + dt, dt), float(end)))
            return self.time >= end
        names, holds = ((), lambda values: end(Named(values, self.channels))) if callable(end) else condition_of(end)
        while not holds(self.channels(*names)):
            if self.time >= latest or self.status != "running":
                return False
            before = self.save()
            self._reach(min(on_grid(self.time + dt, dt), latest))
            if self.status == "running" and holds(self.channels(*names)):
                self._locate(before, lambda: holds(self.channels(*names)))
                return True
        return True

    def run(self) -> Run:
        """Everything so far as a run, whose output times are those of the steps.

        Returns
        -------
        Run
            Each time with the inputs that held up to it. ``status`` is ``completed`` while the session is running. The
            ``end_state`` is a start for any run, ``end`` for one whose scene says what the inputs are now.

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
            for _, items in groupby(history, key=lambda item: id(item[2])):
                piece = list(items)
                self._put(piece[0][2])
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
            self._history = (*first[:2], self._values), None
        self._held = self._values

    def _reach(self, t):
        """Integrate to a time (s) and keep what is there."""
        if self.status != "running":
            raise InputError(
                "session", "", f"expected no further step: {self.status} at {self.time:g} s, {self.reason}"
            )
        if self._values is not self._held:
            self._settle()
        record, given_up = self._record, ""
        record.times[0], record.reached[0] = t, 0
        outcome = self._run.advance(record, CHUNK)
        while outcome == engine.RUNNING and not (given_up := self._headway.lost()):
            outcome = self._run.advance(record, min(CHUNK, self._headway.attempts_left()))
        if outcome == engine.COMPLETED:
            self.time, self._state = t, record.states[0].copy()
            self._keep(t, self._state)
            return
        if record.reached[0]:
            self._keep(t, record.states[0].copy())
        self.status, self.reason = self._run.ending(outcome, given_up)
        self.time, self._state = float(self._run.memory.clock[engine.T]), self._run.memory.state.copy()

    def _keep(self, t, state):
        self._history = (t, state, self._held), self._history if self._recorded else None

    def _steps(self):
        """All steps so far, in their order."""
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
    return np.array([t for t, _, _ in items]), np.array([state for _, state, _ in items])


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
