"""Rosenbrock methods, for scenes in which stiffness and not accuracy limits an explicit step.

At low speed creepage damps the wheelset's motion at a rate proportional to 1/V. A Rosenbrock method solves one linear
system per stage, all with the matrix 1/(h gamma) - J. Displacements are eliminated, as their rates are the velocities.
The factorised matrix has six unknowns per body, and one per force element with an internal state.
"""

from typing import NamedTuple

import numpy as np

from wrcore.bodies.vector import copy_into
from wrcore.equations.equations_of_motion import derivatives_at
from wrcore.equations.interface import after_rejection, before_attempt, touching
from wrcore.equations.pace import pace
from wrcore.integrate import engine
from wrcore.integrate.engine import accept, error_size, interpolate, judge, keep_short, take_samples, write_outputs
from wrcore.jacobian.block_elimination import factorise, solve_stage
from wrcore.jacobian.flexible_track import hold_speeds, imply_speeds, speeds_error
from wrcore.jacobian.jacobian import Jacobian, Joined, Sweep, joined_bodies, new_jacobian, plan_sweep, refresh_jacobian
from wrcore.jacobian.moving_axes import ANGLE, RATE, carry, rates_of_increments, turn_of
from wrcore.kernels.jit import jit
from wrcore.wheels.modes import SPEEDS_GIVEN, STAGE

CONTACT_REFRESHES = 20
"""Number of refreshes of the contacts' part of the Jacobian between two refreshes of the full Jacobian."""

HOLD = 1.2
"""Minimum factor by which a step grows if a Jacobian serves several steps; a constant step reuses the factorised
matrix."""


class Linear(NamedTuple):
    """Jacobian of a run, and the plan by which it is computed."""

    sweep: Sweep
    joined: Joined
    jacobian: Jacobian
    differences: np.ndarray  # (p,): scratch of the Jacobian


def new_linear(equations):
    """Plan the Jacobian of a model's equations and allocate its arrays."""
    sweep, joined = equations.planned(plan_sweep), equations.planned(joined_bodies)
    return Linear(sweep, joined, new_jacobian(equations), np.zeros(int(np.diff(sweep.starts).max())))


@jit(allocates=False)
def _renew(tableau, memory, scratch, linear, system, equations, model, work):
    """Refresh the Jacobian if it is too old, and factorise the matrix if the step has changed; False if singular.

    After a rejected step a Jacobian from an earlier state is refreshed first."""
    clock, counters = memory.clock, memory.counters
    age, step = counters[engine.AGE], clock[engine.NEXT]
    if age < 0 or age >= tableau.reuse or (age > 0 and counters[engine.RETRY]):
        whole = age < 0 or not model.bodies.wheelsets.shape[0] or counters[engine.SINCE_FULL] >= CONTACT_REFRESHES
        if whole:
            counters[engine.SINCE_FULL], linear.jacobian.turn[ANGLE] = 0, 0.0
        counters[engine.EVALUATIONS] += refresh_jacobian(
            linear.sweep, linear.joined, whole, tableau.reuse == 1, linear.jacobian, clock[engine.T], memory.state,
            memory.rate, scratch.trial, scratch.slope, linear.differences, equations, model, work,
        )  # fmt: skip
        counters[engine.JACOBIANS] += 1
        counters[engine.SINCE_FULL] += 1
        counters[engine.AGE] = 0
        clock[engine.MATRIX_STEP] = 0.0
    if clock[engine.MATRIX_STEP] != step:
        clock[engine.MATRIX_STEP] = step
        counters[engine.FACTORISATIONS] += 1
        return factorise(linear.jacobian, system, 1.0 / (step * tableau.gamma))
    return True


@jit(allocates=False)
def _residual_error(tableau, control, memory, scratch, linear, system, theta, there, pace_there, model):
    """Error norm of the residual of an attempt's dense output at ``theta``: model's rate minus the output's derivative.

    ``there`` is the state of the dense output, ``scratch.defect`` its rate by the model, which is overwritten. Stiff
    components of the residual are damped by solving with the factorised matrix."""
    step, stages, defect = memory.clock[engine.NEXT], memory.stages, scratch.defect
    bodies, turn, drift = model.bodies.mass.shape[0], turn_of(linear.jacobian), linear.jacobian.drift
    rates_of_increments(bodies, turn, drift, theta * step, memory.state, there, defect)
    for i in range(stages.shape[0]):
        weight = 0.0
        for k in range(tableau.dense.shape[1] - 1, -1, -1):
            weight = weight * theta + (k + 1) * tableau.dense[i, k]
        for k in range(defect.shape[0]):
            defect[k] -= weight / step * stages[i, k]
    solve_stage(linear.jacobian, system, 1.0 / (step * tableau.gamma), defect)
    return error_size(control.tolerances, pace_there, bodies, there, defect)


@jit(allocates=False)
def _error_between(tableau, control, memory, scratch, linear, system, pace_there, equations, model, work):
    """Error norm of an attempt's dense output at the ``looked_at`` of the tableau, times the tableau's ``residual``."""
    theta, there, step = tableau.looked_at, scratch.between, memory.clock[engine.NEXT]
    interpolate(tableau.dense, theta, 1.0, memory.stages, there)
    carry(
        model.bodies.mass.shape[0], turn_of(linear.jacobian), linear.jacobian.drift, theta * step, memory.state, there
    )
    derivatives_at(equations, memory.clock[engine.T] + theta * step, there, model, work, scratch.defect, STAGE)
    memory.counters[engine.EVALUATIONS] += 1
    return tableau.residual * _residual_error(
        tableau, control, memory, scratch, linear, system, theta, there, pace_there, model
    )


@jit(allocates=False)
def _touchdown_error(tableau, control, memory, scratch, linear, system, pace_there, model):
    """Error norm of the residual at an attempt's end: rate (``scratch.slope``) minus the dense output's derivative.

    Both agree to the method's order. If a wheel touches down near the end of a step, no stage contains the contact. The
    embedded method cannot detect this at any tolerance, and the impact would add energy.
    """
    copy_into(scratch.defect, scratch.slope)
    return _residual_error(tableau, control, memory, scratch, linear, system, 1.0, scratch.trial, pace_there, model)


@jit(allocates=False)
def factorise_again(tableau, memory, linear, system):
    """Factorise the matrix of ``system`` again after a checkpoint, which does not contain it."""
    if memory.clock[engine.MATRIX_STEP] > 0.0:
        factorise(linear.jacobian, system, 1.0 / (memory.clock[engine.MATRIX_STEP] * tableau.gamma))


@jit(allocates=False, nogil=True)
def advance_rosenbrock(tableau, control, memory, scratch, linear, system, record, budget, equations, model, work):
    """Advance a run by a Rosenbrock method by at most ``budget`` attempts, and return its outcome."""
    clock, counters, state, stages = memory.clock, memory.counters, memory.state, memory.stages
    trial, slope, drift = scratch.trial, scratch.slope, linear.jacobian.drift
    n, last, bodies = state.shape[0], stages.shape[0] - 1, model.bodies.mass.shape[0]
    hold, implied = HOLD if tableau.reuse > 1 else 1.0, False
    while True:
        take_samples(control, memory, scratch, equations, model, work)
        keep_short(control, memory, model, work)
        axes = turn_of(linear.jacobian)
        outcome = write_outputs(control, tableau.dense, 1.0, axes, drift, memory, record, model, work)
        if outcome != engine.RUNNING or budget == 0:
            return outcome
        budget -= 1
        before_attempt(work, scratch.places)
        step, regular = clock[engine.NEXT], True
        for i in range(last + 1):
            trial[:] = 0.0
            for j in range(i):
                weight = tableau.stages[i, j]
                if weight != 0.0:
                    for k in range(n):
                        trial[k] += weight * stages[j, k]
            moment = tableau.nodes[i] * step
            carry(bodies, turn_of(linear.jacobian), drift, moment, state, trial)
            if i > 0 and implied:
                imply_speeds(tableau.begun[i], tableau.speeds[i, :i], step, memory.rate, drift, stages, model, work)
            if i > 0 or not counters[engine.HAS_RATE]:
                mode = STAGE | SPEEDS_GIVEN if i > 0 and implied else STAGE
                derivatives_at(equations, clock[engine.T] + moment, trial, model, work, slope, mode)
                counters[engine.EVALUATIONS] += 1
            if i == 0:
                if not counters[engine.HAS_RATE]:
                    copy_into(memory.rate, slope)
                    counters[engine.HAS_RATE], counters[engine.TOUCHING] = 1, touching(work)
                regular = _renew(tableau, memory, scratch, linear, system, equations, model, work)
                implied = linear.jacobian.implied[0] > 0.0
                copy_into(slope, memory.rate)
                copy_into(trial, state)
                if implied:
                    hold_speeds(linear.jacobian.slopes, memory.rate, model, work)
            rates_of_increments(bodies, turn_of(linear.jacobian), drift, moment, state, trial, slope)
            increment, by_time = stages[i], step * tableau.by_time[i]
            for k in range(n):
                increment[k] = slope[k] + by_time * linear.jacobian.by_time[k]
            for j in range(i):
                weight = tableau.couplings[i, j] / step
                for k in range(n):
                    increment[k] += weight * stages[j, k]
            solve_stage(linear.jacobian, system, 1.0 / (step * tableau.gamma), increment)
        trial[:], slope[:] = 0.0, 0.0
        for i in range(last + 1):
            for k in range(n):
                trial[k] += tableau.weights[i] * stages[i, k]
                slope[k] += tableau.error[i] * stages[i, k]
        carry(bodies, turn_of(linear.jacobian), drift, step, state, trial)
        rate = pace(model.bodies.wheelsets, model.contact.least_speed, state, trial)
        error = error_size(control.tolerances, rate, bodies, trial, slope) if regular else np.nan
        if implied and error <= 1.0:
            found = speeds_error(
                tableau.begun[last + 1], tableau.speeds[last + 1], step, memory.rate, drift, stages,
                control.tolerances, rate, model,
            )  # fmt: skip
            error = found if not found <= error else error
        if error <= 1.0 and tableau.looked_at > 0.0:
            found = _error_between(tableau, control, memory, scratch, linear, system, rate, equations, model, work)
            error = found if not found <= error else error
        fresh, contacts = error <= 1.0, 0
        if fresh:  # first rate of the next step
            derivatives_at(equations, clock[engine.T] + step, trial, model, work, slope, STAGE)
            counters[engine.EVALUATIONS] += 1
            contacts = touching(work)
            if contacts > counters[engine.TOUCHING]:
                found = _touchdown_error(tableau, control, memory, scratch, linear, system, rate, model)
                error = found if not found <= error else error
        if judge(control, tableau.exponent, hold, memory, error):
            accept(control, memory, trial, step)
            linear.jacobian.turn[ANGLE] += linear.jacobian.turn[RATE] * step
            counters[engine.AGE] += 1
            counters[engine.HAS_RATE], counters[engine.TOUCHING] = fresh, contacts
            if fresh:
                copy_into(memory.rate, slope)
        elif control.fixed_step > 0.0:
            return engine.NOT_FINITE
        else:
            after_rejection(work, scratch.places)
