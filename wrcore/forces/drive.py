"""Motors, brakes and a speed controller: torques about axles, with reactions on the bodies that carry them.

A torque M along the axle e (pointing left: M > 0 drives forward) acts on a wheelset, and -M on the body that takes the
reaction, so that the pair gains no angular momentum. The power input is M times the relative rotation rate
omega = e . (w_wheelset - w_body). If the moving frame is that body, no reaction acts on the vehicle.

On a wheelset with independently rotating wheels a torque acts on one wheel, and omega is the rate of that wheel.

*Motor*: M from a table, or from a control law (:mod:`wrcore.forces.control`). *Brake*: M = -M_b tanh(omega/`GRIP`),
with M_b from a table. The sign of this friction torque changes over a few `GRIP`, so that the brake holds at standstill
and always dissipates energy. *Controller*: a proportional-integral controller of the speed v of a body along the
body's x axis, with limits of the force at the wheel rims,

    F = clip(F*, -brake limit, limit),   F* = Kp (v* - v) + Ki z,   z' = v* - v - (F* - F)/Kp,

shared equally among the motors without a given torque. At a limit, the last term makes the integral follow the limit
(back-calculation), which prevents integrator windup.

References
----------
Astrom, Hagglund, PID Controllers: Theory, Design, and Tuning (1995), section 3.5 (back-calculation; here with the
tracking time Kp/Ki over the gain of the integral).
"""

import math
from typing import NamedTuple

import numpy as np

from wrcore.bodies.body import OMEGA, STATE_SIZE, VELOCITY
from wrcore.bodies.marker import FRAME
from wrcore.bodies.vector import load
from wrcore.kernels.jit import jit
from wrcore.track.schedule import Schedules, pack_schedules, scheduled
from wrcore.track.track import arc_length_at

MOTOR, BRAKE, CONTROLLED, COMMANDED = range(4)
"""Kinds of actuators."""

WHEELSET, REACTION, NUMBER, KIND, TABLE, OVER, WHEEL = range(7)
"""Columns of ``Drive.rows``; OVER is `TIME` or `ARC_LENGTH`."""

BODY, FOREMOST, SPEED, SPEED_OVER = range(4)
"""Columns of ``Drive.control``; SPEED is the table of the set speed."""

PROPORTIONAL, INTEGRAL, LEAST, MOST = range(4)
"""Columns of ``Drive.gains``; LEAST and MOST are the limits of the force."""

TIME, ARC_LENGTH = range(2)
"""Abscissa of a table."""

GRIP = 0.05
"""Relative rotation rate at which a brake has tanh(1) = 76 % of its torque, rad/s; chosen, about 2 cm/s at the rim."""


class Drive(NamedTuple):
    """Motors, brakes and the speed controller of a model as arrays for kernels."""

    rows: np.ndarray
    """(m, 7) int: wheelset (body), body that takes the reaction or FRAME, number of the wheelset among all wheelsets,
    kind, table (or output of a control law), abscissa of the table, and the wheel on which the torque acts: 1 for the
    left and -1 for the right independent wheel, 0 for a solid wheelset."""
    lever: np.ndarray  # (m,): torque per unit of the table or of the controller's force: 1 or a radius (m)
    control: np.ndarray
    """(c, 4) int, c = 0 or 1: body whose speed is controlled, number of the wheelset whose arc length enters the table,
    table of the set speed, abscissa of the table."""
    gains: np.ndarray  # (c, 4): Kp (N s/m), Ki (N/m), least and largest force (N)
    tables: Schedules


def no_drive():
    """Return a `Drive` without motors, brakes and controller."""
    return Drive(
        np.zeros((0, 7), np.int64), np.zeros(0), np.zeros((0, 4), np.int64), np.zeros((0, 4)), pack_schedules([])
    )


def undriven(model):
    """Return the model without motors, brakes, controller, control laws and their internal states."""
    if not (len(model.drive.rows) or len(model.drive.control) or len(model.controls.rows)):
        return model
    none = model.controls._make(array[:0] for array in model.controls)
    kernels = model.kernels._replace(drive_torques_kernel=0, control_samples_kernel=0)
    return model._replace(drive=no_drive(), kernels=kernels, controls=none)


def may_drive(model):
    """Whether motors, brakes, a controller or control laws may exert a torque at any time."""
    driven = len(model.drive.control) > 0 or len(model.controls.rows) > 0
    return driven or bool(model.drive.tables.points[:, 1].any())


def drive_links(model):
    """Return pairs of bodies coupled by motors, brakes or the controller: the motion of one accelerates the other.

    The coupling through the arc length of a speed profile is neglected. Its effect is very small, and coupling one
    wheelset to all others would double the cost of a Jacobian."""
    pairs = [(row[WHEELSET], row[REACTION]) for row in model.drive.rows if row[REACTION] != FRAME]
    for body in model.drive.control[:, BODY]:
        pairs += [(body, end) for end in _controlled(model) if end != body]
    return pairs


def drive_state_bodies(model):
    """Return, for the integral of each controller, the set of bodies that it accelerates or measures."""
    return [{int(body)} | _controlled(model) for body in model.drive.control[:, BODY]]


def _controlled(model):
    """Return the set of bodies on which the force of the controller acts."""
    rows = model.drive.rows
    return set(rows[rows[:, KIND] == CONTROLLED][:, [WHEELSET, REACTION]].ravel().tolist()) - {FRAME}


@jit(allocates=False)
def independent_wheels_at(bodies, k):
    """Return the index in the state of half the difference of rolling rates of the k-th wheelset.

    For a solid wheelset the result is the index of the last wheelset with independent wheels."""
    place = -1
    for j in range(bodies.independent.shape[0]):
        place = bodies.independent[j, 1]
        if bodies.independent[j, 0] == k:
            break
    return STATE_SIZE * bodies.mass.shape[0] + place


@jit(allocates=False)
def _table_value(model, table, over, k, t, state, work):
    """Return the value of a table at the time, or at the arc length of the k-th wheelset."""
    return scheduled(model.drive.tables, table, arc_length_at(model, state, work, k) if over == ARC_LENGTH else t)


@jit(allocates=False)
def controlled_force(model, t, state, work):
    """Return force of the controller at the wheel rims (N), set speed (m/s), and rate of the integral (m/s)."""
    if model.drive.control.shape[0] == 0:
        return 0.0, 0.0, 0.0
    row, gains, n = model.drive.control[0], model.drive.gains[0], model.bodies.mass.shape[0]
    axes, (vx, vy, vz) = work.rotations[row[BODY]], load(state, STATE_SIZE * row[BODY] + VELOCITY)
    speed = axes[0, 0] * vx + axes[1, 0] * vy + axes[2, 0] * vz
    wanted = _table_value(model, row[SPEED], row[SPEED_OVER], row[FOREMOST], t, state, work)
    asked = gains[PROPORTIONAL] * (wanted - speed) + gains[INTEGRAL] * state[STATE_SIZE * n + model.elements.states]
    force = min(max(asked, gains[LEAST]), gains[MOST])
    return force, wanted, wanted - speed - (asked - force) / gains[PROPORTIONAL]


@jit(allocates=False)
def actuator(model, i, force, t, state, work):
    """Return the torque of the i-th actuator along the axle (N m) and its relative rotation rate (rad/s)."""
    row = model.drive.rows[i]
    axes, kind, rate = work.rotations[row[WHEELSET]], row[KIND], 0.0
    for k in range(3):
        turn = state[STATE_SIZE * row[WHEELSET] + OMEGA + k]
        if row[REACTION] != FRAME:
            turn -= state[STATE_SIZE * row[REACTION] + OMEGA + k]
        rate += axes[k, 1] * turn
    if row[WHEEL] != 0:
        rate += row[WHEEL] * state[independent_wheels_at(model.bodies, row[NUMBER])]
    value = force
    if kind == COMMANDED:
        value = work.control.outputs[row[TABLE]]
    elif kind != CONTROLLED:
        value = _table_value(model, row[TABLE], row[OVER], row[NUMBER], t, state, work)
    torque = model.drive.lever[i] * value
    return (-torque * math.tanh(rate / GRIP) if kind == BRAKE else torque), rate


@jit(allocates=False)
def add_drive(model, t, state, work, rate):
    """Add the torques of motors and brakes to the wrenches of the bodies.

    Also write the rate of the controller's integral (m/s) into ``rate``, and add the torques on independent wheels to
    their rates. ``work`` must have the rotations and arc lengths of this state."""
    force, _, change = controlled_force(model, t, state, work)
    if model.drive.control.shape[0] > 0:
        rate[STATE_SIZE * model.bodies.mass.shape[0] + model.elements.states] = change
    for i in range(model.drive.rows.shape[0]):
        wheelset, body = model.drive.rows[i, WHEELSET], model.drive.rows[i, REACTION]
        torque, _ = actuator(model, i, force, t, state, work)
        for k in range(3):
            moment = torque * work.rotations[wheelset, k, 1]
            work.wrenches[wheelset, 3 + k] += moment
            if body != FRAME:
                work.wrenches[body, 3 + k] -= moment
        if model.drive.rows[i, WHEEL] != 0:
            at = independent_wheels_at(model.bodies, model.drive.rows[i, NUMBER])
            rate[at] += model.drive.rows[i, WHEEL] * torque / model.bodies.inertia[wheelset, 1]
