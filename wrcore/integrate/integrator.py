"""Time integration by name: the compiled engine's methods, and scipy's and SUNDIALS' solvers as references.

=====================================================  =============================================================
``rk45``, ``tsit5``, ``rk23``, ``rk4``                 explicit pairs of order 5(4), 5(4), 3(2), 4(3), compiled
``rodas4``, ``ros34pw2``                               Rosenbrock methods of order 4(3), 3(2), compiled
``auto``                                               ``rodas4`` or ``tsit5``: :mod:`wrcore.integrate.choice`
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

import time

import numpy as np

from wrcore.dynamics.contract import begin, places, why_outside
from wrcore.dynamics.drive import may_drive
from wrcore.dynamics.system import Equations, state_size
from wrcore.dynamics.wheel import ON_GRID, OUT_OF_RANGE, SOLVED
from wrcore.errors import InputError
from wrcore.integrate import engine
from wrcore.integrate.blocks import new_system
from wrcore.integrate.choice import cheaper_method
from wrcore.integrate.engine import Control, Record, advance_explicit, new_memory, new_scratch
from wrcore.integrate.rosenbrock import advance_rosenbrock, new_linear
from wrcore.integrate.tableaus import EXPLICIT, ROSENBROCK
from wrcore.integrate.tolerances import HALF_GAUGE, pace, step_tolerances
from wrcore.integrate.trajectory import Checkpoint, Trajectory

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

CHUNK = 2000
"""Attempts between two returns to Python, for progress and interrupts."""


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
    model, where they are at hand; these and ``step`` are for compiled methods only. An InputError if the start is none
    of this model, or a checkpoint of a reference.
    """
    times = np.ascontiguousarray(times, float)
    start, goes_on = _checked(start, model), isinstance(start, Checkpoint)
    method = start.method if goes_on else method
    if method == "auto":
        equations = equations or Equations(model)
        method = cheaper_method(model, equations, times[0], start, longest_step)
    tolerances = step_tolerances(model, rtol, atol, method)
    if method in REFERENCES:
        from wrcore.integrate.reference import integrate_by_reference

        rate = model.contact.least_speed / HALF_GAUGE if may_drive(model) else pace(model, start, start)
        tolerances = tolerances[0] + rate * tolerances[1]  # theirs stay what they are
        return integrate_by_reference(model, start, times, method, tolerances, longest_step, derailed_y, progress, stop,
                                      most_steps)  # fmt: skip
    tableau = EXPLICIT.get(method) or ROSENBROCK[method]
    equations = equations or Equations(model)
    work = equations.work
    state, first_step = start.memory.state if goes_on else start, step or min(engine.FIRST_STEP, longest_step)
    memory = new_memory(state, times[0], len(tableau.nodes), first_step)
    linear, system = (new_linear(model), new_system(model)) if method in ROSENBROCK else (None, None)
    begin(work)
    if goes_on:
        _take_over(memory, start.memory)
        _take_over(places(work), (start.arc_lengths, start.patches))
        _take_over(linear, start.linear, planned=True)
        if not np.isfinite(memory.clock[: engine.ERROR]).all():
            raise InputError("start", "checkpoint", f"expected finite times, got {memory.clock}")
        if step and step != memory.clock[engine.NEXT]:  # the grid of the steps begins anew
            memory.clock[engine.START] = memory.clock[engine.T] - memory.counters[engine.STEPS] * step
            memory.clock[engine.NEXT] = step
    scratch = new_scratch(len(memory.state), len(places(work)[0]))
    record = Record(times, np.full((len(times), len(memory.state)), np.nan), np.zeros(1, np.int64))
    control = Control(tolerances, float(step), float(longest_step), float(derailed_y))

    def advance(attempts):
        if linear is None:
            return advance_explicit(tableau, control, memory, scratch, record, attempts, *equations.arguments)
        return advance_rosenbrock(
            tableau, control, memory, scratch, linear, system, record, attempts, *equations.arguments
        )

    outcome, given_up = advance(0), ""  # compiles, or loads the kernel from the cache
    before, started = memory.counters.copy(), time.perf_counter()
    headway = _Headway(memory, most_steps, 0.0 if step else min(STALL_STEP, 0.1 * longest_step))
    while outcome == engine.RUNNING and not given_up:
        outcome = advance(min(chunk, headway.attempts_left()))
        if progress is not None:
            progress(min(memory.clock[engine.T], times[-1]))
        given_up = headway.lost() or (stop() if stop is not None else "")
    wall = time.perf_counter() - started
    counters, reached = memory.counters - before, int(record.reached[0])
    status, reason = _ending(outcome, given_up, model, memory, work)
    last = times[reached - 1] if reached else times[0]
    completed = status == "completed"
    return Trajectory(
        method, times[:reached], record.states[:reached], status, reason, int(counters[engine.STEPS]),
        int(counters[engine.REJECTED]), int(counters[engine.EVALUATIONS]), int(counters[engine.JACOBIANS]),
        int(counters[engine.FACTORISATIONS]), int(work.counters[OUT_OF_RANGE]), float(memory.clock[engine.SMALLEST]),
        wall, Checkpoint(method, float(last), memory, linear, *(place.copy() for place in places(work))),
        float(last if completed else memory.clock[engine.T]),
        (record.states[reached - 1] if completed else memory.state).copy(), int(counters[engine.COLLAPSES]),
        int(work.counters[ON_GRID]), int(work.counters[SOLVED]), int(work.flexible_track.unbalanced[0]),
    )  # fmt: skip


class _Headway:
    """Whether a run gets on: counts the steps that were tried, all of them and since it was last seen to get on."""

    def __init__(self, memory, most_steps, least_step):
        self.memory, self.least_step = memory, least_step
        self.most = most_steps or np.inf
        self.seen, self.t = self.attempts(), memory.clock[engine.T]

    def attempts(self):
        return int(self.memory.counters[engine.STEPS] + self.memory.counters[engine.REJECTED])

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
