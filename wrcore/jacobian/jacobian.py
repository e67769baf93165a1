"""Jacobian of the equations of motion by finite differences, in blocks.

Unknowns are, per body, a displacement (r, and a rotation vector in track axes that changes the Euler parameters by
``p += 1/2 E(p)^T theta``) and a velocity (r', w); then the internal states. Only accelerations and rates of internal
states need differences; derivatives of the rates of positions are known analytically.

The columns of a body are nonzero only in rows of bodies that elements or joints link to it. One evaluation therefore
serves several bodies (Curtis, Powell and Reid, J. Inst. Maths Applics 13 (1974) 117-119). Contact forces are constant
in these evaluations. The contacts' part, which is refreshed more often, is in :mod:`wrcore.jacobian.wheels`.

All bodies move along the track at some 20 m/s. Columns of different age, whose effects should cancel, would make this
the largest error. Positions are therefore relative to a motion at constant velocity, the ``drift`` when the Jacobian
was computed. The derivative with respect to time is along this drift.

Most of the Jacobian is up to twenty steps old. If the contacts' part serves only one step, all other unknowns are also
relative to a drift, their rates at the step's start. Errors of the Jacobian then multiply increments of second order in
the step. With an exact Jacobian the result would be the same. With an old one, and boxes of 1 kg on stiff bushings,
Rodas5 has an error of 300 µm in y without this drift, and of 0.6 µm with it.
"""

import math
from typing import NamedTuple

import numpy as np

from wrcore.bodies.body import EULER, OMEGA, STATE_SIZE, VELOCITY
from wrcore.bodies.vector import copy_into, cross, dot
from wrcore.equations.equations_of_motion import derivatives_at
from wrcore.equations.interface import turn_rate
from wrcore.equations.model import state_size
from wrcore.equations.pace import HALF_GAUGE, pace
from wrcore.jacobian.flexible_track import hold_speeds, in_balance, without_mass
from wrcore.jacobian.hertzian_wheel import differentiable, slope_scratch
from wrcore.jacobian.links import (
    contact_places,
    internal_state_bodies,
    internal_state_groups,
    joined_sets,
    packed,
    reached_bodies,
)
from wrcore.jacobian.moving_axes import ANGLE, RATE, carry, rates_of_increments, turn_of
from wrcore.jacobian.wheels import (
    DIRECTIONS,
    DISPLACEMENT,
    SPEED,
    SPIN,
    TURN,
    renew_contacts,
    slopes_of_patches,
)
from wrcore.kernels.handles import Kernel
from wrcore.kernels.jit import jit
from wrcore.wheels.exact_force import STOOD_IN
from wrcore.wheels.modes import BARE, ELLIPSES, SPEEDS_GIVEN, WRENCHES_HELD
from wrcore.wheels.motion import MOTION

FINE_BELOW = 0.1
"""Speed (m/s) below which differences of velocities are reduced in proportion. Friction saturates at creepages of some
1e-3; the difference of a creepage must be far smaller."""

USUAL = 0.3
"""Coefficient of friction below which differences of velocities are reduced in proportion, for the same reason."""

SLIPS = 2.0
"""Minimum rolling speed for implied speeds of rails, m/s, at the friction `USUAL` (in proportion at a lower one). At
lower speed, friction saturates at rail speeds below the accuracy of the implied ones."""

MOMENT = 1e-7
"""Difference of time, s."""


class Sweep(NamedTuple):
    """Plan of the evaluations: columns that each evaluation perturbs together, and nonzero rows of each column."""

    starts: np.ndarray  # (e + 1,) int: evaluation i perturbs the columns starts[i] <= k < starts[i + 1]
    columns: np.ndarray
    """(p,) int: displacements of all bodies (6 each), velocities of all bodies (6 each), elements' internal states."""
    row_starts: np.ndarray  # (p + 1,) int
    rows: np.ndarray  # (q,) int: accelerations of all bodies (6 each), rates of the elements' internal states


class Joined(NamedTuple):
    """Bodies that accelerate together with each wheelset: the wheelset and those that joints connect to it."""

    starts: np.ndarray  # (k + 1,) int
    bodies: np.ndarray  # (p,) int


class Jacobian(NamedTuple):
    """Blocks of the Jacobian, stored column by column; columns and rows as in `Sweep`."""

    by_position: np.ndarray  # (6 n, m): with respect to displacements
    by_velocity: np.ndarray  # (m, m): with respect to velocities and the elements' internal states
    turning: np.ndarray
    """(n, 4, 6): rate of the rotation vector, and of the length of p, with respect to rotation and angular velocity."""
    length: np.ndarray
    """(1,): rate of the length of p with respect to itself, which is that of Baumgarte's feedback, 1/s."""
    spin: np.ndarray
    """(n, 3): rate of the rotation vector with respect to the length of p: the frame's angular velocity, rad/s."""
    by_time: np.ndarray  # (size,): time derivative of the rate of a state that moves with the drift
    drift: np.ndarray
    """(size,): velocities of all bodies at the indices of their positions; elsewhere the rates of the increments when
    the Jacobian was computed, or zero if it serves several steps."""
    axes: np.ndarray  # (n, 4, 4): rows of E(p), then p, of the state of the Jacobian
    turn: np.ndarray
    """(2,): turning rate of the axes of increments (rad/s), and their angle relative to the track's axes (rad); see
    `wrcore.jacobian.moving_axes`."""
    contact: np.ndarray  # (k, c, 6 n + r): contribution of each wheelset's contacts to the Jacobian
    mobility: np.ndarray  # (k, 6, 6 n): accelerations of all bodies by force or moment on a wheelset, in its axes
    columns: np.ndarray
    rails: np.ndarray
    motions: np.ndarray
    wrenches: np.ndarray
    idle: np.ndarray
    patches: np.ndarray
    counts: np.ndarray
    slopes: np.ndarray
    law: np.ndarray
    """Scratch of :mod:`wrcore.jacobian.wheels`."""
    column_numbers: np.ndarray  # (k, c) int: numbers of the state whose columns contacts change
    row_numbers: np.ndarray  # (k, r) int
    implied: np.ndarray
    """(1,): 1 if stages use implied speeds of massless rails. Conditions: the rails' speeds were solved, the Jacobian
    serves one step and is that of the model without ellipses in place of strips, and the speed exceeds `SLIPS`."""


def _groups(reach):
    """Return groups of columns without common rows; ``reach`` contains the set of rows of each column."""
    groups = []
    for item, rows in enumerate(reach):
        for members, taken in groups:
            if not taken & rows:
                members.append(item)
                taken |= rows
                break
        else:
            groups.append(([item], set(rows)))
    return [members for members, _ in groups]


def plan_sweep(model):
    """Plan the evaluations for the full Jacobian and return the `Sweep`."""
    n, linked, reached = len(model.bodies.mass), internal_state_bodies(model), reached_bodies(model)

    def column(body, direction):
        return 6 * body + direction if direction < 6 else 6 * n + 6 * body + direction - 6

    rows = [{6 * b + k for b in reached[body] for k in range(6)} for body in range(n)]
    for state, ends in enumerate(linked):
        for body in ends:
            rows[body].add(6 * n + state)
    full = [
        [(column(body, direction), rows[body]) for body in group]
        for group in _groups(rows)
        for direction in range(DIRECTIONS)
    ]
    inner = [{6 * n + state} | {6 * body + k for body in ends for k in range(6)} for state, ends in enumerate(linked)]
    for states in internal_state_groups(model):
        for state in states:
            inner[state] |= {6 * n + other for other in states}
    full += [[(12 * n + state, inner[state]) for state in group] for group in _groups(inner)]
    columns = [[k for k, _ in evaluation] for evaluation in full]
    return Sweep(*packed(columns), *packed([sorted(rows) for evaluation in full for _, rows in evaluation]))


def joined_bodies(model):
    """Return the bodies that accelerate together with each wheelset, as `Joined`."""
    joined = joined_sets(model)
    return Joined(*packed([sorted(joined[body]) for body in model.bodies.wheelsets]))


def new_jacobian(equations):
    """Allocate the `Jacobian` of a model's equations, and set the kernel of derivatives of contact forces in the model.

    The address is 0 for contact models without such a kernel."""
    _, model, work = equations.arguments
    jacobian = _empty_jacobian(model.value)
    by_hand = _slopes_by_hand(model.value.contact)
    kernels = model.value.kernels
    if (by_hand is not None) != (kernels.contact_derivatives_kernel != 0):
        kernel = Kernel(by_hand, jacobian, model, work).address if by_hand else 0
        model.lay(model.value._replace(kernels=kernels._replace(contact_derivatives_kernel=kernel)))
    return jacobian


def _slopes_by_hand(contact):
    """Return the kernel of the derivatives of a contact model's forces, or None if differences are used."""
    if differentiable.py_func(contact):
        return slopes_of_patches
    if len(contact.surrogate.median) > 0:
        from wrcore.jacobian.surrogate_wheel import slopes_of_surrogate

        return slopes_of_surrogate
    if not contact.strips.looked_up:
        return None
    from wrcore.jacobian.table_wheel import slopes_of_lobes

    return slopes_of_lobes


def _empty_jacobian(model):
    n, size = len(model.bodies.mass), state_size(model)
    m, k = size - 7 * n, len(model.bodies.wheelsets)
    columns, rows = contact_places(model)
    contacts, rates = columns.shape[1], rows.shape[1]
    return Jacobian(
        np.zeros((6 * n, m)), np.zeros((m, m)), np.zeros((n, 4, 6)), np.zeros(1), np.zeros((n, 3)), np.zeros(size),
        np.zeros(size), np.zeros((n, 4, 4)), np.zeros(2), np.zeros((k, contacts, 6 * n + rates)),
        np.zeros((k, 6, 6 * n)), np.zeros((k, contacts, 6 + rates)), np.zeros((k, 2, 3, 3)),
        np.zeros((k, 2, len(MOTION))), np.zeros((k, 2, 6)), np.zeros(6 * n),
        *slope_scratch(model), columns, rows, np.zeros(1),
    )  # fmt: skip


@jit(allocates=False)
def _take_axes(jacobian, state, rate):
    """Fill ``jacobian.axes`` with E(p) and p, and ``jacobian.spin`` with 2 E(p) p' of all bodies."""
    c, s = math.cos(0.5 * jacobian.turn[ANGLE]), math.sin(0.5 * jacobian.turn[ANGLE])
    for b in range(jacobian.axes.shape[0]):
        at, rows = STATE_SIZE * b + EULER, jacobian.axes[b]
        e0, e3 = c * state[at] + s * state[at + 3], c * state[at + 3] - s * state[at]
        e1, e2 = c * state[at + 1] + s * state[at + 2], c * state[at + 2] - s * state[at + 1]
        rows[0, 0], rows[0, 1], rows[0, 2], rows[0, 3] = -e1, e0, -e3, e2
        rows[1, 0], rows[1, 1], rows[1, 2], rows[1, 3] = -e2, e3, e0, -e1
        rows[2, 0], rows[2, 1], rows[2, 2], rows[2, 3] = -e3, -e2, e1, e0
        rows[3, 0], rows[3, 1], rows[3, 2], rows[3, 3] = e0, e1, e2, e3
        for i in range(3):
            jacobian.spin[b, i] = 0.0
            for j in range(4):
                jacobian.spin[b, i] += 2.0 * rows[i, j] * rate[at + j]


@jit(allocates=False)
def _take_turning(jacobian, spins, state):
    """Fill ``jacobian.turning``: derivatives of the rotations' rates with respect to rotation and angular velocity.

    With p' = 1/2 Omega p (quaternions; Omega = w, or w - (w a) a for a body of revolution about a, whose frame does not
    spin) and p + 1/2 theta p in place of p: the rotation vector's rate changes by dOmega + 1/2 Omega x theta, the rate
    of the length of p by -1/4 Omega theta. In rotating axes, Omega is relative to them.
    """
    c, s = math.cos(jacobian.turn[ANGLE]), math.sin(jacobian.turn[ANGLE])
    for b in range(jacobian.axes.shape[0]):
        at, p, omega, out = STATE_SIZE * b + OMEGA, jacobian.axes[b, 3], jacobian.spin[b], jacobian.turning[b]
        w = c * state[at] + s * state[at + 1], c * state[at + 1] - s * state[at], state[at + 2]
        a = (
            2.0 * (p[1] * p[2] - p[0] * p[3]),
            p[0] * p[0] - p[1] * p[1] + p[2] * p[2] - p[3] * p[3],
            2.0 * (p[2] * p[3] + p[0] * p[1]),
        )
        spinning = 1.0 if spins[b] == 1 else 0.0
        along = dot(w, a)
        for k in range(3):
            axis = 1.0 if k == 0 else 0.0, 1.0 if k == 1 else 0.0, 1.0 if k == 2 else 0.0
            tilt, turned = cross(axis, a), cross((omega[0], omega[1], omega[2]), axis)
            for i in range(3):
                out[i, k] = 0.5 * turned[i] - spinning * (dot(w, tilt) * a[i] + along * tilt[i])
                out[i, 3 + k] = axis[i] - spinning * a[i] * a[k]
            out[3, k], out[3, 3 + k] = -0.25 * omega[k], 0.0


@jit(allocates=False)
def _take_drift(jacobian, state):
    """Set ``jacobian.drift`` of positions to the velocities of all bodies, and all other drifts to zero."""
    c, s = math.cos(jacobian.turn[ANGLE]), math.sin(jacobian.turn[ANGLE])
    jacobian.drift[:] = 0.0
    for b in range(jacobian.axes.shape[0]):
        at = STATE_SIZE * b
        vx, vy = state[at + VELOCITY], state[at + VELOCITY + 1]
        jacobian.drift[at], jacobian.drift[at + 1] = c * vx + s * vy, c * vy - s * vx
        jacobian.drift[at + 2] = state[at + VELOCITY + 2]


@jit(allocates=False)
def _perturb(trial, column, axes, fine):
    """Add a difference in one unknown to increments and return it; differences of velocities are scaled by ``fine``."""
    n = axes.shape[0]
    if column >= 12 * n:
        at, difference = STATE_SIZE * n + column - 12 * n, DISPLACEMENT
    elif column >= 6 * n:
        k = (column - 6 * n) % 6
        at, difference = STATE_SIZE * ((column - 6 * n) // 6) + VELOCITY + k, fine * (SPEED if k < 3 else SPIN)
    else:
        k = column % 6
        at, difference = STATE_SIZE * (column // 6) + k, DISPLACEMENT
        if k >= 3:
            for i in range(4):
                trial[at - k + EULER + i] += 0.5 * TURN * axes[column // 6, k - 3, i]
            return TURN
    trial[at] += difference
    return difference


@jit(allocates=False)
def _resolved(difference, column, bodies, turn, state, trial):
    """Return the actual difference of a position after rounding, which is large far along the track."""
    k = column % 6
    if column >= 6 * bodies or k >= 3:
        return difference
    at = STATE_SIZE * (column // 6)
    if k == 2:
        return trial[at + 2] - state[at + 2]
    c, s, dx, dy = math.cos(turn[ANGLE]), math.sin(turn[ANGLE]), trial[at] - state[at], trial[at + 1] - state[at + 1]
    return c * dx + s * dy if k == 0 else c * dy - s * dx


@jit(allocates=False)
def _take_column(sweep, jacobian, k, difference, bodies, base, slope):
    """Write one column of the Jacobian from the rates without (``base``) and with the difference (``slope``)."""
    column = sweep.columns[k]
    for j in range(sweep.row_starts[k], sweep.row_starts[k + 1]):
        row = sweep.rows[j]
        at = STATE_SIZE * (row // 6) + VELOCITY + row % 6 if row < 6 * bodies else 7 * bodies + row
        value = (slope[at] - base[at]) / difference
        if column < 6 * bodies:
            jacobian.by_position[column, row] = value
        else:
            jacobian.by_velocity[column - 6 * bodies, row] = value


@jit(allocates=False)
def refresh_jacobian(
    sweep, joined, whole, along, jacobian, t, state, rate, trial, slope, differences, equations, model, work
):
    """Refresh the Jacobian at a state and its ``rate``, and return the number of evaluations.

    If ``whole`` is false, only the contacts' part, the drift and the derivative along it are refreshed. With ``along``,
    the drift is that of all states, otherwise of positions only. ``trial`` and ``slope`` (size,) are scratch, as is
    ``differences`` (maximum number of columns perturbed together,)."""
    n, drift, base = jacobian.axes.shape[0], jacobian.drift, jacobian.by_time
    jacobian.turn[RATE] = turn_rate(state, model, work)
    axes = turn_of(jacobian)
    _take_drift(jacobian, state)
    jacobian.length[0] = -2.0 * model.alpha
    speed = pace(model.bodies.wheelsets, model.contact.least_speed, state, state) * HALF_GAUGE
    saturating = min(1.0, model.contact.friction / USUAL)
    fine, slips = min(1.0, speed / FINE_BELOW) * saturating, speed * saturating
    strips, wheels = model.contact.strips, model.bodies.wheelsets.shape[0] > 0
    rough, repeated = strips.strips > 0 and strips.looked_up == 0.0, False
    copy_into(base, rate)
    if rough or whole:  # rate of a smooth approximation of the model
        derivatives_at(equations, t, state, model, work, base, BARE | ELLIPSES)
    rates_of_increments(n, axes, drift, 0.0, state, state, base)
    _take_axes(jacobian, state, base)
    _take_turning(jacobian, model.bodies.spins, state)
    last = sweep.starts.shape[0] - 1
    for i in range(0 if whole else last, last + 1):
        in_time = i == last
        mode = BARE | ELLIPSES | WRENCHES_HELD if wheels and not in_time else BARE | ELLIPSES
        first, end = (0, 0) if in_time else (sweep.starts[i], sweep.starts[i + 1])
        moment = MOMENT if in_time else 0.0
        if in_time and wheels:  # before ``base`` is overwritten by the time derivative
            work.strips.flags[STOOD_IN] = 0.0
            renew_contacts(joined, whole, jacobian, jacobian.turn[ANGLE], t, state, base, model, work, fine)
            if not (rough or whole) and work.strips.flags[STOOD_IN] > 0.0:
                rough = True
                derivatives_at(equations, t, state, model, work, base, BARE | ELLIPSES)
                rates_of_increments(n, axes, drift, 0.0, state, state, base)
            rough = rough or work.strips.flags[STOOD_IN] > 0.0
            jacobian.implied[0] = 1.0 if along and without_mass(model) and not rough and slips > SLIPS else 0.0
            if jacobian.implied[0] > 0.0:
                hold_speeds(jacobian.slopes, rate, model, work)
                mode |= SPEEDS_GIVEN
        if in_time and along:
            for j in range(state.shape[0]):
                if j >= STATE_SIZE * n or j % STATE_SIZE >= EULER:
                    drift[j], base[j] = base[j], 0.0
        trial[:] = 0.0
        for k in range(first, end):
            differences[k - first] = _perturb(trial, sweep.columns[k], jacobian.axes, fine)
        carry(n, axes, drift, moment, state, trial)
        for k in range(first, end):
            differences[k - first] = _resolved(differences[k - first], sweep.columns[k], n, axes, state, trial)
        derivatives_at(equations, t + moment, trial, model, work, slope, mode)
        if mode & SPEEDS_GIVEN and not in_balance(rate, model, work):
            jacobian.implied[0], repeated = 0.0, True
            derivatives_at(equations, t + moment, trial, model, work, slope, mode ^ SPEEDS_GIVEN)
        rates_of_increments(n, axes, drift, moment, state, trial, slope)
        if in_time:
            for j in range(state.shape[0]):
                jacobian.by_time[j] = (slope[j] - base[j]) / MOMENT
        for k in range(first, end):
            _take_column(sweep, jacobian, k, differences[k - first], n, base, slope)
    return (sweep.starts.shape[0] + 1 if whole else 1 + rough) + repeated
