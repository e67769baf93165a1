"""Rosenbrock methods for scenes in which stiffness, not accuracy, would bound an explicit step.

At low speed creepage damps the wheelset's motion at a rate that grows as 1/V. A Rosenbrock method solves one linear
system per stage, all with the matrix 1/(h gamma) - J. The displacements are eliminated: they change at the rate of the
velocities, so that what is factorised has six unknowns a body and one per force element with a state of its own.
"""

from typing import NamedTuple

import numpy as np

from wrcore._jit import jit
from wrcore.dynamics.body import STATE_SIZE
from wrcore.dynamics.engine import (
    AGE,
    EVALUATIONS,
    FACTORISATIONS,
    HAS_RATE,
    JACOBIANS,
    MATRIX_STEP,
    NEXT,
    NOT_FINITE,
    RETRY,
    RUNNING,
    SINCE_FULL,
    T,
    accept,
    copy_into,
    error_size,
    judge,
    take_stock,
)
from wrcore.dynamics.jacobian import Jacobian, Sweep, elimination_order, new_jacobian, plan_sweeps, refresh_jacobian
from wrcore.dynamics.system import fill_derivatives

CONTACT_REFRESHES = 20
"""Refreshes of the contacts' part of the Jacobian between two of the whole."""

HOLD = 1.2
"""With a Jacobian that serves several steps, a step that could grow by less than this factor stays, and with it the
factorised matrix."""

PIVOTING = 10.0
"""A pivot off the diagonal is taken where it is larger by this factor."""


class Linear(NamedTuple):
    """The Jacobian and the factorised matrix of a run."""

    full: Sweep
    contact: Sweep
    jacobian: Jacobian
    order: np.ndarray
    """(m,) int: unknowns of the matrix in the order of their elimination."""
    matrix: np.ndarray
    """(m, m): factors of 1/(h gamma) - J after elimination of the displacements, column by column."""
    pivots: np.ndarray
    """(m,) int."""
    inverse: np.ndarray
    """(n, 3, 3): of 1/(h gamma) less the rotations' own part."""
    carried: np.ndarray
    """(n, 3, 3): rotation per angular velocity."""
    column: np.ndarray
    """(m,): scratch."""
    right: np.ndarray
    """(m,): right-hand side, then solution."""
    shift: np.ndarray
    """(6 n,): displacements that do not depend on the velocities sought."""
    differences: np.ndarray
    """(p,): scratch of the Jacobian."""


def new_linear(model):
    """Plan the Jacobian of a model and allocate its arrays.

    Returns
    -------
    Linear
    """
    full, contact = plan_sweeps(model)
    jacobian = new_jacobian(model)
    m, n = len(jacobian.by_velocity), len(model.bodies.mass)
    most = int(max(np.diff(sweep.starts).max() for sweep in (full, contact)))
    return Linear(
        full, contact, jacobian, elimination_order(model), np.zeros((m, m)), np.zeros(m, np.int64),
        np.zeros((n, 3, 3)), np.zeros((n, 3, 3)), np.zeros(m), np.zeros(m), np.zeros(6 * n), np.zeros(most),
    )  # fmt: skip


@jit(allocates=False)
def factorise(matrix, pivots):
    """LU factors of a matrix stored column by column, in place; False if a pivot is zero or not finite.

    The diagonal stays the pivot unless an entry below it is `PIVOTING` times larger: other pivots would undo the order
    of elimination. All loops run down a column, without sums whose order a compiler would have to keep or could change.
    """
    n = pivots.shape[0]
    for k in range(n):
        left = matrix[k]
        pivot = k
        for i in range(k + 1, n):
            if abs(left[i]) > abs(left[pivot]):
                pivot = i
        if PIVOTING * abs(left[k]) >= abs(left[pivot]):
            pivot = k
        pivots[k] = pivot
        if not 0.0 < abs(left[pivot]) < np.inf:
            return False
        if pivot != k:
            for j in range(n):
                matrix[j, k], matrix[j, pivot] = matrix[j, pivot], matrix[j, k]
        inverse = 1.0 / left[k]
        for i in range(k + 1, n):
            left[i] *= inverse
        for j in range(k + 1, n):
            column = matrix[j]
            factor = column[k]
            if factor != 0.0:
                for i in range(k + 1, n):
                    column[i] -= factor * left[i]
    return True


@jit(allocates=False)
def solve(matrix, pivots, right):
    """Solve with the factors of :func:`factorise`, in place."""
    n = pivots.shape[0]
    for k in range(n):
        right[k], right[pivots[k]] = right[pivots[k]], right[k]
    for k in range(n):
        column, factor = matrix[k], right[k]
        for i in range(k + 1, n):
            right[i] -= factor * column[i]
    for k in range(n - 1, -1, -1):
        column = matrix[k]
        right[k] /= column[k]
        factor = right[k]
        for i in range(k):
            right[i] -= factor * column[i]


@jit(allocates=False)
def _invert(a, out):
    """Inverse of a matrix (3, 3) by its cofactors."""
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        for col in range(3):
            p, q = (col + 1) % 3, (col + 2) % 3
            out[col, i] = a[j, p] * a[k, q] - a[j, q] * a[k, p]
    scale = 1.0 / (a[0, 0] * out[0, 0] + a[0, 1] * out[1, 0] + a[0, 2] * out[2, 0])
    for i in range(3):
        for j in range(3):
            out[i, j] *= scale


@jit(allocates=False)
def _carry_rotations(linear, sigma):
    """Rotations by angular velocities: theta = (sigma - Q)^-1 (g + R w) for the blocks Q, R of each body's turning."""
    for b in range(linear.carried.shape[0]):
        turning, inverse, carried = linear.jacobian.turning[b], linear.inverse[b], linear.carried[b]
        for i in range(3):
            for j in range(3):
                carried[i, j] = (sigma if i == j else 0.0) - turning[i, j]
        _invert(carried, inverse)
        for i in range(3):
            for j in range(3):
                carried[i, j] = 0.0
                for k in range(3):
                    carried[i, j] += inverse[i, k] * turning[k, 3 + j]


@jit(allocates=False)
def prepare(linear, sigma):
    """Assemble and factorise the matrix for sigma = 1/(h gamma); False if it is singular."""
    jacobian, matrix, order, column = linear.jacobian, linear.matrix, linear.order, linear.column
    n, m = jacobian.axes.shape[0], order.shape[0]
    _carry_rotations(linear, sigma)
    for place in range(m):
        unknown = order[place]
        body, direction = unknown // 6, unknown % 6
        by_velocity = jacobian.by_velocity[unknown]
        for i in range(m):
            column[i] = -by_velocity[i]
        if body < n and direction < 3:
            by_position, share = jacobian.by_position[unknown], 1.0 / sigma
            for i in range(m):
                column[i] -= share * by_position[i]
        elif body < n:
            for k in range(3):
                by_position, share = jacobian.by_position[6 * body + 3 + k], linear.carried[body, k, direction - 3]
                for i in range(m):
                    column[i] -= share * by_position[i]
        column[unknown] += sigma
        ordered = matrix[place]
        for i in range(m):
            ordered[i] = column[order[i]]
    return factorise(matrix, linear.pivots)


@jit(allocates=False)
def solve_stage(linear, sigma, increment):
    """Turn the right-hand side of a stage, in the shape of a state, into the stage's increment, in place."""
    jacobian, order, right, shift, column = linear.jacobian, linear.order, linear.right, linear.shift, linear.column
    n, m = jacobian.axes.shape[0], right.shape[0]
    for b in range(n):
        at, to, axes, inverse = STATE_SIZE * b, 6 * b, jacobian.axes[b], linear.inverse[b]
        for i in range(3):
            shift[to + i] = increment[at + i] / sigma
            shift[to + 3 + i] = 0.0
            column[to + i] = increment[at + 7 + i]
            column[to + 3 + i] = increment[at + 10 + i]
        for k in range(3):
            turn = 0.0
            for j in range(4):
                turn += 2.0 * axes[k, j] * increment[at + 3 + j]
            for i in range(3):
                shift[to + 3 + i] += inverse[i, k] * turn
    for i in range(6 * n, m):
        column[i] = increment[7 * n + i]
    for j in range(6 * n):
        by_position, share = jacobian.by_position[j], shift[j]
        for i in range(m):
            column[i] += share * by_position[i]
    for i in range(m):
        right[i] = column[order[i]]
    solve(linear.matrix, linear.pivots, right)
    for i in range(m):
        column[order[i]] = right[i]
    for b in range(n):
        at, to, axes = STATE_SIZE * b, 6 * b, jacobian.axes[b]
        carried, turning = linear.carried[b], jacobian.turning[b]
        length = 0.0
        for j in range(4):
            length += axes[3, j] * increment[at + 3 + j]
        for i in range(3):
            increment[at + i] = shift[to + i] + column[to + i] / sigma
            increment[at + 7 + i] = column[to + i]
            increment[at + 10 + i] = column[to + 3 + i]
            for j in range(3):
                shift[to + 3 + i] += carried[i, j] * column[to + 3 + j]
        for j in range(3):
            length += turning[3, j] * shift[to + 3 + j] + turning[3, 3 + j] * column[to + 3 + j]
        for j in range(4):
            increment[at + 3 + j] = axes[3, j] * length / sigma
            for i in range(3):
                increment[at + 3 + j] += 0.5 * axes[i, j] * shift[to + 3 + i]
    for i in range(6 * n, m):
        increment[7 * n + i] = column[i]


@jit(allocates=False)
def _renew(tableau, memory, scratch, linear, model, work):
    """Refresh the Jacobian if it is too old and factorise the matrix if it is not that of the step; False if singular.

    After a rejected step a Jacobian from an earlier state is refreshed first.
    """
    clock, counters = memory.clock, memory.counters
    age, step = counters[AGE], clock[NEXT]
    if age < 0 or age >= tableau.reuse or (age > 0 and counters[RETRY]):
        sweep = linear.contact
        if age < 0 or counters[SINCE_FULL] >= CONTACT_REFRESHES:
            sweep = linear.full
            counters[SINCE_FULL] = 0
        counters[EVALUATIONS] += refresh_jacobian(
            sweep, linear.jacobian, clock[T], memory.state, memory.rate, scratch.trial, scratch.slope,
            linear.differences, model, work,
        )  # fmt: skip
        counters[JACOBIANS] += 1
        counters[SINCE_FULL] += 1
        counters[AGE] = 0
        clock[MATRIX_STEP] = 0.0
    if clock[MATRIX_STEP] != step:
        clock[MATRIX_STEP] = step
        counters[FACTORISATIONS] += 1
        return prepare(linear, 1.0 / (step * tableau.gamma))
    return True


@jit(allocates=False, nogil=True)
def advance_rosenbrock(tableau, control, memory, scratch, linear, record, budget, model, work):
    """Advance a run by a Rosenbrock method.

    Parameters
    ----------
    tableau : RosenbrockTableau
    control : Control
    memory : Memory
    scratch : Scratch
    linear : Linear
    record : Record
    budget : int
        Attempts before the kernel returns.
    model : Model
    work : Workspace

    Returns
    -------
    int
        Outcome.
    """
    clock, counters, state, stages = memory.clock, memory.counters, memory.state, memory.stages
    trial, slope = scratch.trial, scratch.slope
    n, last = state.shape[0], stages.shape[0] - 1
    hold = HOLD if tableau.reuse > 1 else 1.0
    while True:
        outcome = take_stock(control, tableau.dense, 1.0, memory, record, model, work)
        if outcome != RUNNING or budget == 0:
            return outcome
        budget -= 1
        step, regular = clock[NEXT], True
        for i in range(last + 1):
            copy_into(trial, state)
            for j in range(i):
                weight = tableau.stages[i, j]
                if weight != 0.0:
                    for k in range(n):
                        trial[k] += weight * stages[j, k]
            if i > 0 or not counters[HAS_RATE]:
                fill_derivatives(clock[T] + tableau.nodes[i] * step, trial, model, work, slope)
                counters[EVALUATIONS] += 1
            if i == 0:
                if not counters[HAS_RATE]:
                    copy_into(memory.rate, slope)
                    counters[HAS_RATE] = 1
                regular = _renew(tableau, memory, scratch, linear, model, work)
                copy_into(slope, memory.rate)
            increment, drift = stages[i], step * tableau.drift[i]
            for k in range(n):
                increment[k] = slope[k] + drift * linear.jacobian.by_time[k]
            for j in range(i):
                weight = tableau.couplings[i, j] / step
                for k in range(n):
                    increment[k] += weight * stages[j, k]
            solve_stage(linear, 1.0 / (step * tableau.gamma), increment)
        copy_into(trial, state)
        slope[:] = 0.0
        for i in range(last + 1):
            for k in range(n):
                trial[k] += tableau.weights[i] * stages[i, k]
                slope[k] += tableau.error[i] * stages[i, k]
        error = error_size(control, scratch.caps, state, trial, slope) if regular else np.nan
        if judge(control, tableau.exponent, hold, memory, error):
            accept(control, memory, trial, step)
            counters[HAS_RATE] = 0
            counters[AGE] += 1
        elif control.fixed_step > 0.0:
            return NOT_FINITE
