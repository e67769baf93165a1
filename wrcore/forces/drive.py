"""Motors, brakes and a speed controller: torques about axles, against the bodies that carry motors and calipers.

A torque M along the axle e (pointing left: M > 0 drives forward) acts on a wheelset, its opposite on the body that
takes the reaction, so that the pair gains no angular momentum, and the power put in is M times the relative rotation
rate omega = e . (w_wheelset - w_body). With the moving frame as that body the reaction leaves the vehicle.

On a wheelset whose wheels turn independently of each other a torque acts on one of them, and omega is that wheel's.

*Motor*: M by a table, or as a control law commands (:mod:`wrcore.forces.control`). *Brake*:
M = -M_b tanh(omega/`GRIP`), with M_b by a table: a friction brake whose sign changes within some `GRIP`, so that it
holds at standstill and takes energy at every instant. *Controller*: proportional and integral, on the speed v of a body
along its own x axis, with limits of the force at the wheels' rims,

    F = clip(F*, -brake limit, limit),   F* = Kp (v* - v) + Ki z,   z' = v* - v - (F* - F)/Kp,

shared equally among the motors that state no torque of their own. Where a limit holds, the last term lets the
integral follow it (back-calculation): nothing winds up.

References
----------
Astrom, Hagglund, PID Controllers: Theory, Design, and Tuning (1995), section 3.5 (back-calculation; here with the
tracking time Kp/Ki over the integral's own gain).
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
"""Columns of ``Drive.rows``."""

BODY, FOREMOST, SPEED, SPEED_OVER = range(4)
"""Columns of ``Drive.control``."""

PROPORTIONAL, INTEGRAL, LEAST, MOST = range(4)
"""Columns of ``Drive.gains``."""

TIME, ARC_LENGTH = range(2)
"""What a table is over."""

GRIP = 0.05
"""Relative rotation rate at which a brake has tanh(1) = 76 % of its torque, rad/s. Chosen: some 2 cm/s at the rim."""


class Drive(NamedTuple):
    """Motors, brakes and controller, for kernels."""

    rows: np.ndarray
    """(m, 7) int: wheelset (body), body that takes the reaction or FRAME, number of the wheelset among all wheelsets,
    kind, table (or output of a control law), what that is over, and the wheel that turns by itself: 1 for the left
    one, -1 for the right one, 0 for a solid wheelset."""
    lever: np.ndarray  # (m,): torque per unit of the table, or of the controller's force: 1 or a radius (m)
    control: np.ndarray
    """(c, 4) int, c = 0 or 1: body whose speed counts, number of the wheelset whose arc length does, table, what that
    is over."""
    gains: np.ndarray  # (c, 4): Kp (N s/m), Ki (N/m), least and largest force (N)
    tables: Schedules


def no_drive():
    """A `Drive` of nothing."""
    return Drive(
        np.zeros((0, 7), np.int64), np.zeros(0), np.zeros((0, 4), np.int64), np.zeros((0, 4)), pack_schedules([])
    )


def undriven(model):
    """The model without motors, brakes, controller and control laws: its state ends with that of force elements."""
    if not (len(model.drive.rows) or len(model.drive.control) or len(model.controls.rows)):
        return model
    none = model.controls._make(array[:0] for array in model.controls)
    return model._replace(drive=no_drive(), torques=0, samples=0, controls=none)


def may_drive(model):
    """Whether motors, brakes or a controller can ever exert a torque."""
    driven = len(model.drive.control) > 0 or len(model.controls.rows) > 0
    return driven or bool(model.drive.tables.points[:, 1].any())


def lowest_speed(model):
    """Speed (m/s) to which motors, brakes and a controller may bring a vehicle that runs forward down, infinite where
    they cannot: of all that may brake it is known of a controller alone where that ends."""
    drive, points = model.drive, np.split(model.drive.tables.points[:, 1], model.drive.tables.starts[1:-1])
    brakes = len(model.controls.rows) > 0
    for row in drive.rows[np.isin(drive.rows[:, KIND], (MOTOR, BRAKE))]:
        torques = points[row[TABLE]]
        brakes = brakes or bool(torques.any() if row[KIND] == BRAKE else torques.min() < 0.0)
    return 0.0 if brakes else min((points[row[SPEED]].min() for row in drive.control), default=math.inf)


def drive_links(model):
    """Pairs of bodies that motors, brakes or the controller link: one's motion enters the other's acceleration. A speed
    profile's arc length is left out: what a wheelset's place does through it is next to nothing, and a link from one
    wheelset to all others would double the cost of a Jacobian."""
    pairs = [(row[WHEELSET], row[REACTION]) for row in model.drive.rows if row[REACTION] != FRAME]
    for body in model.drive.control[:, BODY]:
        pairs += [(body, end) for end in _controlled(model) if end != body]
    return pairs


def drive_state_bodies(model):
    """For the controller's integral, if there is one, the set of bodies that it acts on or follows."""
    return [{int(body)} | _controlled(model) for body in model.drive.control[:, BODY]]


def _controlled(model):
    """Bodies that the controller's force acts on."""
    rows = model.drive.rows
    return set(rows[rows[:, KIND] == CONTROLLED][:, [WHEELSET, REACTION]].ravel().tolist()) - {FRAME}


@jit(allocates=False)
def independent_wheels_at(bodies, k):
    """Place in the state of half the difference of rolling rates of the k-th wheelset; that of the last independent one
    if it has none."""
    place = -1
    for j in range(bodies.independent.shape[0]):
        place = bodies.independent[j, 1]
        if bodies.independent[j, 0] == k:
            break
    return STATE_SIZE * bodies.mass.shape[0] + place


@jit(allocates=False)
def _table_value(model, table, over, k, t, state, work):
    """Value of a table at the time, or at the arc length of the k-th wheelset."""
    return scheduled(model.drive.tables, table, arc_length_at(model, state, work, k) if over == ARC_LENGTH else t)


@jit(allocates=False)
def controlled_force(model, t, state, work):
    """The controller's force at the rims (N), the speed that it wants (m/s), and the rate of its integral (m/s)."""
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
    """Torque of the i-th actuator along the axle of its wheelset (N m), and the relative rotation rate (rad/s)."""
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
    """Add the torques of motors and brakes to the wrenches of the bodies, and write the rate of the controller's
    integral (m/s) into ``rate``; ``work`` has the rotations and arc lengths of this state."""
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
