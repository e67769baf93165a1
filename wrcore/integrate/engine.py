"""Compiled integration by explicit pairs, and functions of all methods: error norm, step control, dense output, stop.

A kernel advances by a number of attempts and returns. Its complete state is in a `Memory`, so that results are bitwise
identical wherever it pauses or a run is continued. Steps are never shortened to end at an output time or at the end of
the run: outputs are interpolated, and the last step ends beyond the end.

The tolerated error of a step is defined in `wrcore.integrate.tolerances`.
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
"""Step size control: safety factor, minimum and maximum factor from one step to the next."""

LEAST_STEP = 1e-13
"""Minimum step as a fraction of the time reached, or of 1 s if this is larger."""

COLLAPSE = 3
"""Consecutive rejections that count as a collapse of the step size: each can shorten the step fivefold."""

STILL = (0.0, 0.0)
"""Rate and angle of axes that do not turn."""

FIRST_STEP = 1e-5
"""Length of the first attempt of a run with step control, s: below all time scales of a vehicle. The next steps can
grow fivefold each."""

T, T_OLD, NEXT, ERROR, SMALLEST, START, MATRIX_STEP = range(7)
"""Indices in the clock (all in s except ERROR). T: time reached. T_OLD: time before the last step. NEXT: length of the
next attempt. ERROR: error norm of the last step. SMALLEST: minimum accepted step, over steps that the error limits (the
step after them grows by less than the factor `GROW`). START: start of the run. MATRIX_STEP: step of the factorised
matrix."""

STEPS, REJECTED, EVALUATIONS, JACOBIANS, FACTORISATIONS, COLLAPSES = range(6)
HAS_RATE, RETRY, AGE, SINCE_FULL, TOUCHING = range(6, 11)
COUNTERS_SIZE = 11
"""Indices in the counters; COLLAPSES: steps rejected `COLLAPSE` times or more. The last five are for control. HAS_RATE:
1 if the rate at the state is computed. RETRY: rejections since the last accepted step. AGE: steps since the last
refresh of the Jacobian (-1: none). SINCE_FULL: contact refreshes since the last full one. TOUCHING: patches at the
state."""


class Control(NamedTuple):
    """Tolerances and limits of a run."""

    tolerances: np.ndarray
    """(2, n): tolerated error of a step for each component of the state, see `wrcore.integrate.tolerances`."""
    fixed_step: float  # s; 0: step size control by the error estimate
    longest_step: float  # s
    limit: float  # maximum lateral distance of a wheelset from the track's centre, m; see `outside`


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
    """Scratch arrays, whose content is not used in the next attempt."""

    trial: np.ndarray  # (n,)
    slope: np.ndarray  # (n,)
    defect: np.ndarray  # (n,)
    between: np.ndarray  # (n,)
    still: np.ndarray  # (n,): zeros
    places: np.ndarray  # (k,): saved starting values of searches, see `wrcore.equations.interface.kept_size`


class Record(NamedTuple):
    """Output times and the states there."""

    times: np.ndarray  # (m,), s
    states: np.ndarray  # (m, n)
    reached: np.ndarray  # (1,) int: outputs written


def new_memory(state, start, stages, first_step):
    """Return the `Memory` of a new run: ``start`` and ``first_step`` in s, number of ``stages`` of the method."""
    clock = np.array([start, start, first_step, 1.0, np.inf, start, 0.0])
    counters = np.zeros(COUNTERS_SIZE, np.int64)
    counters[AGE] = -1
    state = np.array(state, float)
    return Memory(clock, counters, state, np.zeros_like(state), state.copy(), np.zeros((stages, len(state))))


def new_scratch(size, places):
    """Allocate the `Scratch` for a state vector of length ``size`` and a number of saved starting values."""
    return Scratch(*np.zeros((5, size)), np.zeros(places))


@jit(allocates=False)
def error_size(tolerances, rate, bodies, new, errors):
    """Maximum over all bodies of a step's error norm: the root mean square of 13 components relative to tolerances.

    ``rate`` is the step's `pace` (1/s). All internal states together count as one further body. The result is NaN or
    infinite if any component of the state is not finite."""
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
    """Accept or reject an attempt by its error, and set the length of the next step; return whether it is accepted.

    The length does not change if it could grow by less than the factor ``hold``; ``exponent`` is the order of the error
    estimate in h. Proportional-integral control with exponents 0.7 and 0.4 (Gustafsson, ACM Trans. Math. Softw. 17
    (1991) 533-554) converges to the stability bound; control by the last error only oscillates about it.
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
    """Accept a step: advance time and counters, and copy the trial state to the state reached."""
    clock, counters = memory.clock, memory.counters
    counters[STEPS] += 1
    clock[T_OLD] = clock[T]
    clock[T] += step
    if control.fixed_step > 0.0:  # no accumulated rounding
        clock[T] = clock[START] + counters[STEPS] * step
    if control.fixed_step > 0.0 or clock[NEXT] < GROW * step:
        clock[SMALLEST] = min(clock[SMALLEST], step)
    for i in range(trial.shape[0]):
        memory.old[i] = memory.state[i]
        memory.state[i] = trial[i]


@jit(allocates=False)
def take_samples(control, memory, scratch, equations, model, work):
    """Take the samples of control laws that are due, and adapt the next step to the time of the next sample.

    The next step, or the one after it, ends at the next sample (fixed steps are not changed)."""
    if model.kernels.control_samples_kernel == 0:
        return
    clock, sampling = memory.clock, work.control.sampling
    call_address(model.kernels.control_samples_kernel, model, clock[T], memory.state, work, False)
    if sampling[DUE] > 0.0:
        derivatives_at(equations, clock[T], memory.state, model, work, scratch.slope, WARM)
        memory.counters[EVALUATIONS] += 1
        call_address(model.kernels.control_samples_kernel, model, clock[T], memory.state, work, True)
        memory.counters[HAS_RATE] = 0
    left = sampling[NEXT_SAMPLE] - clock[T]
    if control.fixed_step == 0.0 and clock[NEXT] > 0.5 * left:
        clock[NEXT] = left if clock[NEXT] >= left else 0.5 * left


@jit(allocates=False)
def keep_short(control, memory, model, work):
    """Shorten the next step where rails change along the track and near check rails (fixed steps are not changed)."""
    if model.kernels.step_limit_kernel != 0 and control.fixed_step == 0.0:
        call_address(model.kernels.step_limit_kernel, model, memory.state, work, memory.clock, NEXT)


@jit(allocates=False)
def interpolate(dense, theta, scale, stages, out):
    """Fill ``out`` (n,) with the dense output at ``theta``: the weighted sum of the stages times ``scale``."""
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
    """Write the outputs up to the time reached, and return RUNNING, COMPLETED, DERAILED or TOO_SMALL.

    ``dense`` (s, d) are the coefficients of the dense output, for stages times ``scale``. ``turn`` and ``drift``
    describe the axes of the stages at the step's end, see `wrcore.jacobian.moving_axes`."""
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
    """Advance a run by an explicit pair by at most ``budget`` attempts, and return its outcome."""
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
