"""Time integration by name: the compiled engine's methods, and scipy's and SUNDIALS' solvers as references.

=====================================================  =============================================================
``rk45``, ``tsit5``, ``rk23``, ``rk4``                 explicit pairs of order 5(4), 5(4), 3(2), 4(3), compiled
``rodas5``, ``rodas4``, ``rodas4p2``, ``ros34pw2``     Rosenbrock methods of order 5(4), 4(3), 4(3), 3(2)
``auto``                                               ``rodas5``, or ``rk4`` where that gets cheaper:
                                                       :mod:`wrcore.integrate.choice`
``scipy_rk45``, ``_rk23``, ``_dop853``, ``_radau``,    scipy's solvers over the same right-hand side
``_bdf``, ``_lsoda``
``cvode``                                              SUNDIALS' BDF, if scikit-sundae is installed
=====================================================  =============================================================

Failure is a value, never an exception: the states reached so far and the last valid one are kept. A run ends as

============  ======================================================================================================
completed     the end of the duration was reached; a vehicle at rest there has completed its run, too
derailed      a wheelset went too far from the track's centre
stalled       it was given up without a fault: told to stop, ``most_steps`` tried, or `STALL_ATTEMPTS` steps in a row
              that brought it no further than `STALL_STEP` each on average
failed        a number is not finite, or the step size fell below the resolution of time
============  ======================================================================================================
"""

import copy
import time
from dataclasses import replace

import numpy as np
from numba import typeof

from wrcore.equations.equations_of_motion import Equations
from wrcore.equations.interface import begin, kept_size, places, why_outside
from wrcore.equations.model import state_size
from wrcore.equations.own_law_failures import LawWatch, blame
from wrcore.equations.pace import HALF_GAUGE, pace
from wrcore.errors import InputError
from wrcore.forces.drive import may_drive
from wrcore.integrate import choice, engine
from wrcore.integrate.choice import CHOICES
from wrcore.integrate.engine import Control, Record, advance_explicit, new_memory, new_scratch
from wrcore.integrate.rosenbrock import advance_rosenbrock, factorise_again, new_linear
from wrcore.integrate.tableaus import EXPLICIT, ROSENBROCK
from wrcore.integrate.tolerances import LENGTH, step_tolerances
from wrcore.integrate.trajectory import Checkpoint, Trajectory
from wrcore.jacobian.block_elimination import new_system
from wrcore.kernels.aside import planning
from wrcore.kernels.told import reaching
from wrcore.wheels.contact_model import ON_FIXED, ON_GRID, OUT_OF_RANGE, OUTSIDE_TRAINING, SOLVED

METHODS = (*EXPLICIT, *ROSENBROCK)
"""Methods of the compiled engine."""

REFERENCES = ("scipy_rk45", "scipy_rk23", "scipy_dop853", "scipy_radau", "scipy_bdf", "scipy_lsoda", "cvode")
"""Methods of other libraries."""

STALL_ATTEMPTS, STALL_STEP = 20_000, 2e-8
"""So many steps (tried ones) in a row that are this short on average, s, are no headway: some 0.1 s of work for a
wheelset, and at this pace a simulated second takes fifty million steps. The shortest time scale of a stiff contact is
10 us, and explicit methods take steps of 5 us at 0.1 m/s and of 50 ns at the least speed of creepages, 1 mm/s. Steps of
a stated length, or bounded by ``longest_step``, may be as short as they are asked to be.
"""

CHUNK, FIRST_CHUNK, BREATH = 2000, 16, 0.5
"""Most attempts between two returns to Python, for progress and interrupts, how many there are at first, and how long
(s) they may take: an attempt with exact patches takes some 10 ms."""


def integrate(
    model, start, times, method="auto", rtol=1e-4, atol=0.0, step=0.0, longest_step=0.05, derailed_y=np.inf,
    progress=None, chunk=CHUNK, stop=None, most_steps=0, equations=None,
):  # fmt: skip
    """Trajectory of a model's equations of motion at increasing output times (s), the last of which ends the run.

    ``start`` is the state at the first time, or the Checkpoint of an earlier run, which goes on by the same method, not
    before its ``t``. ``method`` is one of `METHODS` or `REFERENCES`, or ``auto``. Positions may err in a step by the
    part ``rtol`` of 1 cm and by ``atol`` (m) on top; all else follows (:mod:`wrcore.integrate.tolerances`), but the
    references average over all components. ``step`` (s) fixes the length of all steps (0: by the tolerance),
    ``longest_step`` (s) bounds it. A wheelset farther than ``derailed_y`` (m) from the track's centre ends the run.

    Every ``chunk`` attempts, of no influence on the result, ``progress`` is called with the time reached and ``stop()``
    asked for a reason to end the run as stalled, or an empty string. ``most_steps`` bounds the steps tried, those
    before a checkpoint among them (references: the accepted ones; 0: no bound). ``equations``: those of this very
    model, where they are at hand; these and ``step`` are for compiled methods only (with it ``auto`` stays by one
    method). An InputError if the start is none of this model, or a checkpoint of a reference.
    """
    times = np.ascontiguousarray(times, float)
    start, method, looks = beginning(model, start, method, step)
    if method in REFERENCES:
        from wrcore.integrate.reference import integrate_by_reference

        tolerances = step_tolerances(model, rtol, atol)
        rate = (
            model.contact.least_speed / HALF_GAUGE
            if may_drive(model)
            else pace(model.bodies.wheelsets, model.contact.least_speed, start, start)
        )
        tolerances = tolerances[0] + rate * tolerances[1]  # theirs stay what they are
        return integrate_by_reference(model, start, times, method, tolerances, longest_step, derailed_y, progress, stop,
                                      most_steps)  # fmt: skip
    run = Integration(
        model, start, times[0], method, (rtol, atol), step, longest_step, derailed_y, equations, looks=looks
    )
    record = run.record(times)
    outcome, given_up = run.advance(record, 0), ""  # compiles, or loads the kernel from the cache
    before, run.compiled_s, started = run.memory.counters.copy(), 0.0, time.perf_counter()
    headway = Headway(run.memory, most_steps, 0.0 if step else min(STALL_STEP, 0.1 * longest_step))
    attempts = min(FIRST_CHUNK, chunk)
    clock = run.memory.clock

    def reached():
        return f"the run is at t = {clock[engine.T]:.3g} of {times[-1]:.6g} s"

    while outcome == engine.RUNNING and not given_up:
        begun = time.perf_counter()
        with reaching(reached):
            outcome = run.advance(record, min(attempts, headway.attempts_left()))
        spent = time.perf_counter() - begun
        if spent < 0.5 * BREATH:
            attempts = min(2 * attempts, chunk)
        elif spent > BREATH:
            attempts = max(attempts // 2, 1)
        if progress is not None:
            progress(min(run.memory.clock[engine.T], times[-1]))
        given_up = headway.lost() or (stop() if stop is not None else "")
    wall = time.perf_counter() - started - run.compiled_s
    return run.trajectory(record, outcome, given_up, before, wall)


def beginning(model, start, method, step=0.0):
    """A checked start, the method that it goes by, and whether to look for a better one; arguments as for
    `integrate`."""
    start, looks = _checked(start, model), method == "auto" and step == 0.0
    if isinstance(start, Checkpoint):
        return start, start.method, looks
    return start, CHOICES[0] if method == "auto" else method, looks


def needed_last(model, method):
    """Kernels that a run compiles last, each with its types: those of the Jacobian and of the method, or of both that
    ``auto`` may go by."""
    if method in REFERENCES:
        return []
    with planning() as kernels:
        start, equations = np.zeros(state_size(model)), Equations(model)
        before, methods = len(kernels), CHOICES if method == "auto" else (method,)
        runs = [Integration(model, start, 0.0, one, (0.0, 0.0), 0.0, 1.0, np.inf, equations) for one in methods]
        looks = [choice.power_method(model, equations, 0.0, start)] if method == "auto" else []
        looks = [(kernel, tuple(map(typeof, arguments))) for kernel, arguments in looks]
        return [*kernels[before:], *(run.kernel(run.record(np.zeros(1))) for run in runs), *looks]


class Integration:
    """A run by a compiled method between two calls of `advance`: ``equations``, ``memory`` and the rest of what it
    knows; arguments as for `integrate`, with the ``tolerance`` (rtol, atol). One that ``looks`` may change its method,
    as the one of whose checkpoint it goes on. ``compiled_s``: what that took in the way of kernels, s."""

    def __init__(
        self, model, start, t, method, tolerance, step, longest_step, derailed_y, equations=None, looks=False
    ):  # fmt: skip
        goes_on = isinstance(start, Checkpoint)
        self.model, self.equations, self.compiled_s, self._direct = model, equations or Equations(model), 0.0, False
        self._tolerance, self._limits = tolerance, (float(step), float(longest_step), float(derailed_y))
        state, first_step = start.memory.state if goes_on else start, step or min(engine.FIRST_STEP, longest_step)
        self.memory = memory = new_memory(state, t, 0, first_step)
        begin(self.equations.work)
        self.places, self._laws, self.fault = places(self.equations.work), LawWatch(model), ""
        self._scratch = new_scratch(len(memory.state), kept_size(model, self.equations.work))
        self._take(method)
        self.notes = choice.first_notes(method, memory) if looks and not goes_on else choice.no_notes()
        if goes_on:
            self.go_on_from(start if looks else replace(start, notes=self.notes))
            if not np.isfinite(memory.clock[: engine.ERROR]).all():
                raise InputError("start", "checkpoint", f"expected finite times, got {memory.clock}")
            if step and step != memory.clock[engine.NEXT]:  # the grid of the steps begins anew
                memory.clock[engine.NEXT] = step
                self._begin_grid()

    def _take(self, method):
        """Go by a method, with a Jacobian, and stages, that nothing is known of yet."""
        stiff, self.method = method in ROSENBROCK, method
        self._tableau = ROSENBROCK[method] if stiff else EXPLICIT[method]
        stages = np.zeros((len(self._tableau.nodes), len(self.memory.state)))
        self.memory = self.memory._replace(stages=stages)
        self.linear, self._system = (new_linear(self.equations), new_system(self.equations)) if stiff else (None, None)
        control = Control(step_tolerances(self.model, *self._tolerance, method), *self._limits)
        self._kernel, self._plain = advance_rosenbrock if stiff else advance_explicit, None
        self._before = self._tableau, control, self.memory, self._scratch
        self._before += (self.linear, self._system) if stiff else ()

    def record(self, times):
        """A `Record` for output times (n,), s."""
        return Record(times, np.full((len(times), len(self.memory.state)), np.nan), np.zeros(1, np.int64))

    def advance(self, record, attempts):
        """Outcome of at most so many attempts to reach the end of a record."""
        if not len(self.notes):
            return self._advance(record, attempts)
        while True:
            ahead = max(int(self.notes[choice.Note.DUE]) - choice.attempts(self.memory.counters), 0)
            outcome = self._advance(record, min(attempts, ahead))
            if outcome != engine.RUNNING or attempts <= ahead:
                return outcome  # the last step may be asked for outputs yet: it looks when it goes on
            attempts -= ahead
            self._look(record)

    def _advance(self, record, attempts):
        if not self._laws.names:
            return self._step(record, attempts)
        before = copy.deepcopy(self.checkpoint(0.0)) if self._laws.in_python else None
        try:
            outcome, self.fault = self._laws.fault_of(self._step, record, attempts)
        except KeyboardInterrupt:
            if before is not None:
                self.go_on_from(before)
            raise
        return engine.NOT_FINITE if self.fault else outcome

    def _step(self, record, attempts):
        arguments = *self._before, record, attempts, *self.equations.arguments
        if self._plain:
            return self._plain(*arguments)
        outcome = self._kernel(*arguments)
        if self._direct:
            self._plain = self._kernel.overloads[tuple(map(typeof, arguments))].entry_point
        return outcome

    def _look(self, record):
        """Go on by another method where that is worth it."""
        rtol, atol = self._tolerance
        tolerance = rtol + atol / LENGTH
        method = choice.method_after(self.notes, self.method, self.model, self.equations, self.memory, tolerance)
        if method != self.method:
            begun = time.perf_counter()
            self._take(method)
            self._forget()
            self._advance(record, 0)  # compiles, or loads the kernel from the cache
            self.compiled_s += time.perf_counter() - begun

    def kernel(self, record):
        """The kernel that advances it, and the types that this takes with records of this very layout."""
        return self._kernel, tuple(map(typeof, (*self._before, record, 0, *self.equations.arguments)))

    def without_dispatch(self, record):
        """Have `advance` take records of this very layout only, without numba's search for the kernel by the arguments'
        types, which costs five times as much as a call."""
        self._direct = True
        self._advance(record, 0)

    def begin_anew(self, t, state):
        """Begin again at a time (s) and a state (size,), which may have any rate: with the length of the next step."""
        self.memory.clock[[engine.T, engine.T_OLD]] = t
        self.memory.state[:] = self.memory.old[:] = state
        self._forget()
        self._begin_grid()

    def _forget(self):
        """Know nothing of the step before."""
        clock, counters = self.memory.clock, self.memory.counters
        clock[engine.ERROR], clock[engine.MATRIX_STEP] = 1.0, 0.0
        counters[[engine.HAS_RATE, engine.RETRY, engine.SINCE_FULL]], counters[engine.AGE] = 0, -1

    def _begin_grid(self):
        """Let steps of a fixed length count from the time reached."""
        clock, counters = self.memory.clock, self.memory.counters
        clock[engine.START] = clock[engine.T] - counters[engine.STEPS] * clock[engine.NEXT]

    def checkpoint(self, t):
        """Where the run is, with the last output time (s); it changes with the run but for its places."""
        places = (place.copy() for place in self.places)
        return Checkpoint(self.method, float(t), self.memory, self.linear, *places, notes=self.notes.copy())

    def go_on_from(self, checkpoint):
        """Take over all numbers of a checkpoint of this model."""
        if checkpoint.method != self.method:
            self._take(checkpoint.method)
        self.notes = choice.checked_notes(checkpoint)
        _take_over(self.memory, checkpoint.memory)
        _take_over(self.places, (checkpoint.arc_lengths, checkpoint.patches))
        _take_over(self.linear, checkpoint.linear, planned=True)
        if self.linear is not None:
            factorise_again(self._tableau, self.memory, self.linear, self._system)

    def ending(self, outcome, given_up=""):
        """Status and reason of an outcome, or why the run was given up."""
        if self.fault:
            return "failed", f"{self.fault} at t = {self.memory.clock[engine.T]:.6g} s"
        status, reason = _ending(outcome, given_up, self.model, self.memory, self.equations.work)
        if status == "failed":
            clock = self.memory.clock
            reason += blame(self.model, clock[engine.T], self.memory.state, self.memory.rate, clock[engine.NEXT])
        return status, reason

    def trajectory(self, record, outcome, given_up, before, wall):
        """`Trajectory` over a record; counters count from ``before``, ``wall`` in s."""
        memory, times, work = self.memory, record.times, self.equations.work
        counters, reached = memory.counters - before, int(record.reached[0])
        status, reason = self.ending(outcome, given_up)
        last = times[reached - 1] if reached else times[0]
        completed = status == "completed"
        return Trajectory(
            choice.used(self.notes, self.method), times[:reached], record.states[:reached], status, reason,
            int(counters[engine.STEPS]), int(counters[engine.REJECTED]), int(counters[engine.EVALUATIONS]),
            int(counters[engine.JACOBIANS]), int(counters[engine.FACTORISATIONS]), int(work.counters[OUT_OF_RANGE]),
            float(memory.clock[engine.SMALLEST]), wall, self.checkpoint(last),
            float(last if completed else memory.clock[engine.T]),
            (record.states[reached - 1] if completed else memory.state).copy(), int(counters[engine.COLLAPSES]),
            int(work.counters[ON_GRID]), int(work.counters[ON_FIXED]), int(work.counters[SOLVED]),
            int(work.counters[OUTSIDE_TRAINING]), int(work.flexible_track.unbalanced[0]),
        )  # fmt: skip


class Headway:
    """Whether a run gets on: counts the steps that were tried, all of them and since it was last seen to get on."""

    def __init__(self, memory, most_steps, least_step):
        self.memory, self.least_step = memory, least_step
        self.most = most_steps or np.inf
        self.seen, self.t = self.attempts(), memory.clock[engine.T]

    def attempts(self):
        return choice.attempts(self.memory.counters)

    def attempts_left(self):
        """Before the next look is due."""
        return int(max(min(self.seen + STALL_ATTEMPTS, self.most) - self.attempts(), 0))

    def lost(self):
        """A reason to give up, or an empty string."""
        t, attempts = self.memory.clock[engine.T], self.attempts()
        if attempts >= self.most:
            return f"{attempts} steps were tried, as many as integration.most_steps allows, at t = {t:.6g} s"
        if attempts >= self.seen + STALL_ATTEMPTS:
            if t - self.t < self.least_step * STALL_ATTEMPTS:
                return (
                    f"the step size collapsed: {STALL_ATTEMPTS} steps brought it {t - self.t:.2g} s ahead, to"
                    f" t = {t:.6g} s"
                )
            self.seen, self.t = attempts, t
        return ""


def _checked(start, model):
    """A start whose state fits the model and is finite."""
    if isinstance(start, Checkpoint):
        _checked(start.memory.state, model)
        if start.method not in METHODS:
            raise InputError("start", "checkpoint", f"expected one that a run of {model.bodies.mass.size} bodies left")
        return start
    size = state_size(model)
    state = np.asarray(start)
    if state.shape != (size,) or state.dtype.kind not in "fiu" or not np.isfinite(state).all():
        got = f"a {type(start).__name__} of {state.dtype} {state.shape}"
        raise InputError("start", "", f"expected a Checkpoint, or a state of {size} finite numbers, got {got}")
    return np.ascontiguousarray(state, float)


def _take_over(fresh, kept, planned=False):
    """Copy the numbers of a checkpoint into arrays made for the model, whose own ``planned`` indices stay."""
    if type(fresh) is not type(kept):
        raise InputError("start", "checkpoint", f"expected a {type(fresh).__name__}, got a {type(kept).__name__}")
    for array, other in zip(fresh or (), kept or (), strict=True):
        if isinstance(array, tuple):
            _take_over(array, other, planned)
        elif np.shape(other) != array.shape or np.asarray(other).dtype != array.dtype:
            raise InputError("start", "checkpoint", f"expected {array.dtype} {array.shape}, got {np.shape(other)}")
        elif array.dtype.kind == "f" or not planned:
            array[...] = other


def _ending(outcome, given_up, model, memory, work):
    """Status and reason of a compiled run's outcome, or why it was given up."""
    t = memory.clock[engine.T]
    if outcome == engine.COMPLETED:
        return "completed", ""
    if outcome == engine.DERAILED:
        return "derailed", why_outside(model, t, memory.state, places(work)[0])
    if outcome == engine.RUNNING:
        return "stalled", given_up
    if not np.isfinite(memory.rate).all():
        return "failed", f"the accelerations are not finite at t = {t:.6g} s"
    if outcome == engine.NOT_FINITE:
        return "failed", f"the state is not finite a step after t = {t:.6g} s"
    return "failed", f"step size fell below the resolution of time at t = {t:.6g} s"
