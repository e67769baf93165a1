"""The compiled run: explicit pairs, and what every method needs (error norm, step control, dense output, stop).

A kernel advances by a number of attempts and returns; everything it knows lies in a `Memory`, so that neither where it
pauses nor where a run is taken up again changes a bit of the result. Steps are never cut to meet an output time or
the end: outputs are interpolated, and the last step reaches beyond the end.

What a step may err is in `wrcore.integrate.tolerances`.
"""

import math
from typing import NamedTuple

import numpy as np

from wrcore.bodies.body import STATE_SIZE
from wrcore.bodies.vector import copy_into
from wrcore.equations.equations_of_motion import derivatives_at
from wrcore.equations.interface import after_rejection, before_attempt, outside
from wrcore.equations.pace import pace
from wrcore.forces.control import DUE, NEXT_SAMPLE
from wrcore.jacobian.moving_axes import ANGLE, RATE, carry
from wrcore.kernels.handles import call_address
from wrcore.kernels.jit import jit
from wrcore.wheels.modes import STAGE, WARM

RUNNING, COMPLETED, DERAILED, TOO_SMALL, NOT_FINITE = range(5)
"""Outcomes of a chunk of attempts."""

SAFETY, SHRINK, GROW = 0.9, 0.2, 5.0
LEAST_STEP = 1e-13
"""Smallest step as a fraction of the time reached, or of 1 s where that is more."""

COLLAPSE = 3
"""Rejections in a row that make a collapse of the step size: each may shorten the step fivefold."""

STILL = (0.0, 0.0)
"""Axes that do not turn."""

FIRST_STEP = 1e-5
"""Length of the first attempt of a run with step control, s: below every time scale of a vehicle. The steps after it
may grow fivefold each."""

T, T_OLD, NEXT, ERROR, SMALLEST, START, MATRIX_STEP = range(7)
"""Places in the clock: time reached, time before the last step, length of the next attempt (s), error norm of the last
step, smallest accepted step (of those that the error bounds: it allows less than five times as much), start of the
run (s), and the step that the factorised matrix belongs to (s)."""

STEPS, REJECTED, EVALUATIONS, JACOBIANS, FACTORISATIONS, COLLAPSES = range(6)
HAS_RATE, RETRY, AGE, SINCE_FULL, TOUCHING = range(6, 11)
COUNTERS_SIZE = 11
"""Places in the counters; COLLAPSES: steps rejected `COLLAPSE` times or more. The last five belong to the control: the
rate at the state is known, rejections since the last accepted step, steps since the Jacobian was refreshed (-1: there
is none), contact refreshes since the last full one, patches at the state."""


class Control(NamedTuple):
    """What a run is asked for."""

    tolerances: np.ndarray
    """(2, n): error of a step that each component of the state is allowed, see `wrcore.integrate.tolerances`."""
    fixed_step: float  # s; 0 for steps by the error estimate
    longest_step: float  # s
    limit: float  # a state `outside` of it ends the run, m


class Memory(NamedTuple):
    """State of a run between two attempts."""

    clock: np.ndarray
    counters: np.ndarray
    state: np.ndarray
    """(n,): state reached."""
    rate: np.ndarray  # (n,): its derivative, if known
    old: np.ndarray  # (n,): state before the last step
    stages: np.ndarray
    """(s, n): derivatives (explicit pairs) or increments (Rosenbrock methods) of the last step's stages."""


class Scratch(NamedTuple):
    """Arrays that hold nothing between two attempts."""

    trial: np.ndarray  # (n,)
    slope: np.ndarray  # (n,)
    defect: np.ndarray  # (n,)
    between: np.ndarray  # (n,)
    still: np.ndarray  # (n,): zeros
    places: np.ndarray  # (k,): where searches started before the attempt, see `wrcore.equations.interface.kept_size`


class Record(NamedTuple):
    """Output times and the states there."""

    times: np.ndarray  # (m,), s
    states: np.ndarray  # (m, n)
    reached: np.ndarray  # (1,) int: outputs written


def new_memory(state, start, stages, first_step):
    """Memory of a run that has not begun: ``start`` and ``first_step`` in s, ``stages`` of the method."""
    clock = np.array([start, start, first_step, 1.0, np.inf, start, 0.0])
    counters = np.zeros(COUNTERS_SIZE, np.int64)
    counters[AGE] = -1
    state = np.array(state, float)
    return Memory(clock, counters, state, np.zeros_like(state), state.copy(), np.zeros((stages, len(state))))


def new_scratch(size, places):
    """Scratch arrays for a state vector of a length and a number of places."""
    return Scratch(*np.zeros((5, size)), np.zeros(places))


@jit(allocates=False)
def error_size(tolerances, rate, bodies, new, errors):
    """Largest error of any body, the root mean square of its 13 components in units of what they are allowed. ``rate``
    is the step's `pace`. The internal states make one more body. NaN or infinite if any number of the state is not
    finite."""
    largest, size = 0.0, new.shape[0]
    for b in range(bodies + 1):
        first = STATE_SIZE * b
        last = first + STATE_SIZE if b < bodies else size
        total = 0.0
        for i in range(first, last):
            ratio = errors[i] / (tolerances[0, i] + rate * tolerances[1, i])
            total += ratio * ratio + 0.0 * new[i]
        if last > first:
            mean = total / (last - first)
            largest = mean if not mean <= largest else largest
            if math.isnan(mean):
                return mean
    return math.sqrt(largest)


@jit(allocates=False)
def judge(control, exponent, hold, memory, error):
    """Accept or reject an attempt by its error and choose the next step's length, which stays if it could grow by less
    than ``hold``; ``exponent`` is the order of the error estimate in h.

    Proportional-integral control with exponents 0.7 and 0.4 (Gustafsson, ACM Trans. Math. Softw. 17 (1991) 533-554):
    where stability bounds the step it settles on the bound, while control by the last error alone swings about it.
    """
    clock, counters = memory.clock, memory.counters
    step = clock[NEXT]
    if control.fixed_step > 0.0:
        return math.isfinite(error)
    if error <= 1.0:
        now, before = max(error, 1e-10), max(clock[ERROR], 1e-4)
        factor = SAFETY * now ** (-0.7 / exponent) * before ** (0.4 / exponent)
        factor = min(max(factor, SHRINK), 1.0 if counters[RETRY] else GROW)
        if 1.0 < factor < hold:
            factor = 1.0
        clock[NEXT] = min(step * factor, control.longest_step)
        clock[ERROR] = error
        counters[RETRY] = 0
        return True
    factor = SHRINK
    if math.isfinite(error):
        factor = max(SHRINK, SAFETY * error ** (-1.0 / exponent))
    clock[NEXT] = step * factor
    counters[RETRY] += 1
    counters[COLLAPSES] += counters[RETRY] == COLLAPSE
    counters[REJECTED] += 1
    return False


@jit(allocates=False)
def accept(control, memory, trial, step):
    """Make the trial state the state reached."""
    clock, counters = memory.clock, memory.counters
    counters[STEPS] += 1
    clock[T_OLD] = clock[T]
    clock[T] += step
    if control.fixed_step > 0.0:  # no drift
        clock[T] = clock[START] + counters[STEPS] * step
    if control.fixed_step > 0.0 or clock[NEXT] < GROW * step:
        clock[SMALLEST] = min(clock[SMALLEST], step)
    for i in range(trial.shape[0]):
        memory.old[i] = memory.state[i]
        memory.state[i] = trial[i]


@jit(allocates=False)
def take_samples(control, memory, scratch, equations, model, work):
    """Let sampled control laws take what is due at the time reached, and have the next step, or the next but one, end
    where the next sample is; steps of a stated length stay."""
    if model.samples == 0:
        return
    clock, sampling = memory.clock, work.control.sampling
    call_address(model.samples, model, clock[T], memory.state, work, False)
    if sampling[DUE] > 0.0:
        derivatives_at(equations, clock[T], memory.state, model, work, scratch.slope, WARM)
        memory.counters[EVALUATIONS] += 1
        call_address(model.samples, model, clock[T], memory.state, work, True)
        memory.counters[HAS_RATE] = 0
    left = sampling[NEXT_SAMPLE] - clock[T]
    if control.fixed_step == 0.0 and clock[NEXT] > 0.5 * left:
        clock[NEXT] = left if clock[NEXT] >= left else 0.5 * left


@jit(allocates=False)
def keep_short(control, memory, model, work):
    """Have the next step end where the rails begin to change along the track, and stay short on them; steps of a stated
    length stay."""
    if model.strides != 0 and control.fixed_step == 0.0:
        call_address(model.strides, model, memory.state, work, memory.clock, NEXT)


@jit(allocates=False)
def interpolate(dense, theta, scale, stages, out):
    """Set ``out`` (n,) to the sum of the stages, times ``scale``, by the weights of a dense output at ``theta``."""
    out[:] = 0.0
    for i in range(stages.shape[0]):
        weight = 0.0
        for k in range(dense.shape[1] - 1, -1, -1):
            weight = (weight + dense[i, k]) * theta
        weight *= scale
        for j in range(out.shape[0]):
            out[j] += weight * stages[i, j]


@jit(allocates=False)
def write_outputs(control, dense, scale, turn, drift, memory, record, model, work):
    """Write the outputs that the run has come to and return RUNNING, COMPLETED, DERAILED or TOO_SMALL. ``dense`` (s, d)
    are the coefficients of the dense output, for stages times ``scale``; ``turn`` and ``drift`` are the axes of the
    stages at the step's end, see `wrcore.jacobian.moving_axes`."""
    clock = memory.clock
    times, reached = record.times, record.reached[0]
    while reached < times.shape[0] and times[reached] <= clock[T]:
        out = record.states[reached]
        if times[reached] == clock[T]:
            copy_into(out, memory.state)
        else:
            theta = (times[reached] - clock[T_OLD]) / (clock[T] - clock[T_OLD])
            interpolate(dense, theta, scale, memory.stages, out)
            begin = (turn[RATE], turn[ANGLE] - turn[RATE] * (clock[T] - clock[T_OLD]))
            carry(model.bodies.mass.shape[0], begin, drift, times[reached] - clock[T_OLD], memory.old, out)
        reached += 1
        record.reached[0] = reached
        if outside(control.limit, out, model, work):
            return DERAILED
    if reached == times.shape[0]:
        return COMPLETED
    if outside(control.limit, memory.state, model, work):
        return DERAILED
    if clock[NEXT] < LEAST_STEP * max(1.0, abs(clock[T])):
        return TOO_SMALL
    return RUNNING


@jit(allocates=False, nogil=True)
def advance_explicit(tableau, control, memory, scratch, record, budget, equations, model, work):
    """Advance a run by an explicit pair, at most ``budget`` attempts; returns its outcome."""
    clock, counters, state, stages, trial = memory.clock, memory.counters, memory.state, memory.stages, scratch.trial
    n, last = state.shape[0], stages.shape[0] - 1
    while True:
        take_samples(control, memory, scratch, equations, model, work)
        keep_short(control, memory, model, work)
        last_step = clock[T] - clock[T_OLD]
        outcome = write_outputs(control, tableau.dense, last_step, STILL, scratch.still, memory, record, model, work)
        if outcome != RUNNING or budget == 0:
            return outcome
        budget -= 1
        before_attempt(work, scratch.places)
        step = clock[NEXT]
        for i in range(last + 1):
            stage = stages[i]
            if i == 0 and counters[HAS_RATE]:
                copy_into(stage, memory.rate)
                continue
            copy_into(trial, state)
            for j in range(i):
                weight = step * tableau.stages[i, j]
                if weight != 0.0:
                    for k in range(n):
                        trial[k] += weight * stages[j, k]
            derivatives_at(equations, clock[T] + tableau.nodes[i] * step, trial, model, work, stage, STAGE)
            counters[EVALUATIONS] += 1
            if i == 0:
                copy_into(memory.rate, stage)
                counters[HAS_RATE] = 1
        errors = scratch.slope
        errors[:] = 0.0
        for i in range(last + 1):
            weight = step * tableau.error[i]
            for k in range(n):
                errors[k] += weight * stages[i, k]
        rate = pace(model.bodies.wheelsets, model.contact.least_speed, state, trial)
        error = error_size(control.tolerances, rate, model.bodies.mass.shape[0], trial, errors)
        if judge(control, tableau.exponent, 1.0, memory, error):
            accept(control, memory, trial, step)
            copy_into(memory.rate, stages[last])
        elif control.fixed_step > 0.0:
            return NOT_FINITE
        else:
            after_rejection(work, scratch.places)
