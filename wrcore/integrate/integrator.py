"""Time integration by a named method: compiled methods of wrcore, and solvers of scipy and SUNDIALS as references.

=====================================================  =============================================================
``rk45``, ``tsit5``, ``rk23``, ``rk4``                 explicit pairs of order 5(4), 5(4), 3(2), 4(3), compiled
``rodas5``, ``rodas4``, ``rodas4p2``, ``ros34pw2``     Rosenbrock methods of order 5(4), 4(3), 4(3), 3(2)
``auto``                                               ``rodas5``, or ``rk4`` where this is cheaper:
                                                       :mod:`wrcore.integrate.choice`
``scipy_rk45``, ``_rk23``, ``_dop853``, ``_radau``,    scipy's solvers over the same right-hand side
``_bdf``, ``_lsoda``
``cvode``                                              SUNDIALS' BDF, if scikit-sundae is installed
=====================================================  =============================================================

A failure is a status, never an exception: states up to the failure and the last valid state are kept. The status is

============  ======================================================================================================
completed     the end of the duration was reached, also by a vehicle at rest
derailed      the lateral distance of a wheelset from the track's centre exceeded the limit
stalled       the run was ended without a fault: by the caller, after ``most_steps``, or after `STALL_ATTEMPTS`
              consecutive steps shorter than `STALL_STEP` on average
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
from wrcore.errors.messages import reaching
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
from wrcore.wheels.contact_model import ON_FIXED, ON_GRID, OUT_OF_RANGE, OUTSIDE_TRAINING, SOLVED

METHODS = (*EXPLICIT, *ROSENBROCK)
"""Names of the compiled methods."""

REFERENCES = ("scipy_rk45", "scipy_rk23", "scipy_dop853", "scipy_radau", "scipy_bdf", "scipy_lsoda", "cvode")
"""Names of the methods of other libraries."""

STALL_ATTEMPTS, STALL_STEP = 20_000, 2e-8
"""Number of consecutive attempts, and mean step (s) below which a run with these attempts is stalled. This is some
0.1 s of work for a wheelset; a simulated second would take fifty million steps. The shortest time scale of a stiff
contact is 10 µs. Explicit methods have steps of 5 µs at 0.1 m/s, and of 50 ns at the least speed of creepages, 1 mm/s.
Fixed steps, and steps limited by ``longest_step``, may be shorter.
"""

CHUNK, FIRST_CHUNK, BREATH = 2000, 16, 0.5
"""Calls of the kernel between returns to Python, for progress and interrupts: maximum number of attempts, number in the
first call, and target of the duration, s. An attempt with exact patches takes some 10 ms."""


def integrate(
    model, start, times, method="auto", rtol=1e-4, atol=0.0, step=0.0, longest_step=0.05, derailed_y=np.inf,
    progress=None, chunk=CHUNK, stop=None, most_steps=0, equations=None,
):  # fmt: skip
    """Integrate a model's equations of motion and return its `Trajectory` at increasing output times (s).

    The last output time ends the run. ``start`` is the state at the first time, or the Checkpoint of an earlier run,
    which continues by the same method, not before its ``t``. ``method`` is one of `METHODS` or `REFERENCES`, or
    ``auto``. The tolerance of positions in a step is ``rtol`` times 1 cm plus ``atol`` (m); other tolerances follow
    (:mod:`wrcore.integrate.tolerances`), but reference methods average over all components. ``step`` (s) fixes the
    length of all steps (0: step size control), ``longest_step`` (s) limits it. The run ends if a wheelset is farther
    than ``derailed_y`` (m) from the track's centre.

    At most every ``chunk`` attempts, without effect on the result, ``progress`` is called with the time reached;
    ``stop()`` then returns a reason to end the run as stalled, or an empty string. ``most_steps`` limits the attempts,
    with those before a checkpoint (references: accepted steps; 0: no limit). ``equations`` are existing `Equations` of
    this model; these and ``step`` are for compiled methods only (with ``step``, ``auto`` uses one method). Raises an
    InputError if the start does not fit the model, or is a checkpoint of a reference.
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
        tolerances = tolerances[0] + rate * tolerances[1]  # reference integrators cannot change tolerances in a run
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
    """Return the checked start, the first method, and whether the run compares methods (``auto``).

    Arguments are those of `integrate`."""
    start, looks = _checked(start, model), method == "auto" and step == 0.0
    if isinstance(start, Checkpoint):
        return start, start.method, looks
    return start, CHOICES[0] if method == "auto" else method, looks


def needed_last(model, method):
    """Return the kernels that a run compiles last, each with its argument types.

    These are the kernels of the Jacobian and of the method, or of both methods of ``auto``."""
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
    """Run by a compiled method, with its complete state between two calls of `advance`.

    Arguments are those of `integrate`, with the ``tolerance`` (rtol, atol). A run that ``looks`` compares methods and
    may change its method. ``compiled_s`` is the time of compiling kernels after such a change, s."""

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
            if step and step != memory.clock[engine.NEXT]:  # restart the grid of fixed steps
                memory.clock[engine.NEXT] = step
                self._begin_grid()

    def _take(self, method):
        """Set the method, and allocate its stages and Jacobian."""
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
        """Return an empty `Record` for output times (n,), s."""
        return Record(times, np.full((len(times), len(self.memory.state)), np.nan), np.zeros(1, np.int64))

    def advance(self, record, attempts):
        """Advance the run by at most ``attempts`` towards the end of a record, and return the outcome."""
        if not len(self.notes):
            return self._advance(record, attempts)
        while True:
            ahead = max(int(self.notes[choice.Note.DUE]) - choice.attempts(self.memory.counters), 0)
            outcome = self._advance(record, min(attempts, ahead))
            if outcome != engine.RUNNING or attempts <= ahead:
                return outcome  # compare methods in the next call: outputs of the last step may be missing
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
        """Compare the methods, and change the method if the other one is cheaper."""
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
        """Return the kernel that advances the run, and its argument types with records of this layout."""
        return self._kernel, tuple(map(typeof, (*self._before, record, 0, *self.equations.arguments)))

    def without_dispatch(self, record):
        """Let `advance` call the kernel without numba's dispatch by types, which costs five times as much as a call.

        All later records must have this layout."""
        self._direct = True
        self._advance(record, 0)

    def begin_anew(self, t, state):
        """Restart at a time (s) and a state (size,) with any rate; the length of the next step is kept."""
        self.memory.clock[[engine.T, engine.T_OLD]] = t
        self.memory.state[:] = self.memory.old[:] = state
        self._forget()
        self._begin_grid()

    def _forget(self):
        """Discard rate, error, Jacobian and matrix of earlier steps."""
        clock, counters = self.memory.clock, self.memory.counters
        clock[engine.ERROR], clock[engine.MATRIX_STEP] = 1.0, 0.0
        counters[[engine.HAS_RATE, engine.RETRY, engine.SINCE_FULL]], counters[engine.AGE] = 0, -1

    def _begin_grid(self):
        """Start the grid of fixed steps at the time reached."""
        clock, counters = self.memory.clock, self.memory.counters
        clock[engine.START] = clock[engine.T] - counters[engine.STEPS] * clock[engine.NEXT]

    def checkpoint(self, t):
        """Return a `Checkpoint` with the last output time (s); memory and Jacobian are those of the run, not copies."""
        places = (place.copy() for place in self.places)
        return Checkpoint(self.method, float(t), self.memory, self.linear, *places, notes=self.notes.copy())

    def go_on_from(self, checkpoint):
        """Copy the state of a checkpoint of this model to the run."""
        if checkpoint.method != self.method:
            self._take(checkpoint.method)
        self.notes = choice.checked_notes(checkpoint)
        _take_over(self.memory, checkpoint.memory)
        _take_over(self.places, (checkpoint.arc_lengths, checkpoint.patches))
        _take_over(self.linear, checkpoint.linear, planned=True)
        if self.linear is not None:
            factorise_again(self._tableau, self.memory, self.linear, self._system)

    def ending(self, outcome, given_up=""):
        """Return status and reason of an outcome; ``given_up`` is the reason of a stalled run."""
        if self.fault:
            return "failed", f"{self.fault} at t = {self.memory.clock[engine.T]:.6g} s"
        status, reason = _ending(outcome, given_up, self.model, self.memory, self.equations.work)
        if status == "failed":
            clock = self.memory.clock
            reason += blame(self.model, clock[engine.T], self.memory.state, self.memory.rate, clock[engine.NEXT])
        return status, reason

    def trajectory(self, record, outcome, given_up, before, wall):
        """Return the `Trajectory` of a record; ``before`` are the counters at its start, ``wall`` is in s."""
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
    """Monitor of a run's progress: ends runs with too many attempts or too short steps."""

    def __init__(self, memory, most_steps, least_step):
        self.memory, self.least_step = memory, least_step
        self.most = most_steps or np.inf
        self.seen, self.t = self.attempts(), memory.clock[engine.T]

    def attempts(self):
        return choice.attempts(self.memory.counters)

    def attempts_left(self):
        """Return the number of attempts up to the next check."""
        return int(max(min(self.seen + STALL_ATTEMPTS, self.most) - self.attempts(), 0))

    def lost(self):
        """Return a reason to end the run as stalled, or an empty string."""
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
    """Return the start; raise an InputError if its state does not fit the model or is not finite."""
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
    """Copy the arrays of a checkpoint to those of the model; with ``planned``, only floating-point arrays."""
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
    """Return status and reason of a compiled run's outcome; ``given_up`` is the reason of a stalled run."""
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
