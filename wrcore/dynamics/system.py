"""Equations of motion: Newton-Euler in absolute coordinates with Lagrange multipliers and Baumgarte, Eq. (8).

    [ M  D^T ] [ v'     ]   [ g                               ]
    [ D   0  ] [ lambda ] = [ gamma - 2 alpha Phi' - beta^2 Phi ]

with v = (r', w) per body in track axes. M is block diagonal (mass, inertia in track axes), so the multipliers follow
from the small system (D M^-1 D^T) lambda = D M^-1 g - gamma*, and the full matrix of Eq. (8) is never formed. A scene
without joints does not run any of this.
"""

import math
from typing import NamedTuple

import numpy as np
from numba.typed import List

from wrcore._jit import jit
from wrcore.contact.reduction import MAX_PATCHES, PATCH_COLUMNS
from wrcore.dynamics.body import STATE_SIZE, euler_rates, rotation_matrix
from wrcore.dynamics.joint import Joints, constraint_equations
from wrcore.dynamics.marker import FRAME
from wrcore.dynamics.suspension import SpringDampers, spring_damper_forces
from wrcore.dynamics.track import TrackModel, add_rail_wrenches
from wrcore.dynamics.wheel import ContactModel, wheel_wrench


class Bodies(NamedTuple):
    """Rigid bodies, for kernels."""

    mass: np.ndarray
    """(n,), kg."""
    inertia: np.ndarray
    """(n, 3): principal moments about the body's x, y, z axes, kg m^2."""
    spins: np.ndarray
    """(n,) int: 1 for a body of revolution about its y axis whose frame does not spin along."""
    wheelsets: np.ndarray
    """(k,) int: bodies with wheels."""


class Model(NamedTuple):
    """A compiled scene, for kernels."""

    bodies: Bodies
    contact: ContactModel
    springs: SpringDampers
    joints: Joints
    track: TrackModel
    speed: float
    """Speed of the moving frame, m/s."""
    gravity: float
    """m/s^2, downwards."""
    alpha: float
    beta: float
    """Baumgarte's parameters, 1/s."""


class Workspace(NamedTuple):
    """Scratch arrays of one evaluation, and what it leaves for output."""

    rotations: np.ndarray
    """(n + 1, 3, 3): of the bodies, and of the moving frame on a curved track."""
    arc_lengths: np.ndarray
    """(k,): last arc length of each wheelset, m; where the search for the next one starts."""
    wrenches: np.ndarray
    patches: np.ndarray
    """(k, 2, MAX_PATCHES, PATCH_COLUMNS): patches of each wheelset, left and right."""
    counts: np.ndarray
    """(k, 2) int: patches in contact."""
    bounds: np.ndarray
    """(k, 2): bound of planar detection's error (detection ``auto`` only), m."""
    counters: np.ndarray
    """(2,) int: evaluations, creep look-ups out of range."""
    phi: np.ndarray
    phi_rate: np.ndarray
    gamma: np.ndarray
    jacobian: np.ndarray
    owner: np.ndarray
    solved: np.ndarray
    multipliers: np.ndarray
    """(m,): Lagrange multipliers of the last evaluation."""
    matrix: np.ndarray
    frames: np.ndarray
    irregularity: np.ndarray


def workspace(model):
    """Allocate the scratch arrays for a model.

    Parameters
    ----------
    model : Model

    Returns
    -------
    Workspace
    """
    n, k, m = len(model.bodies.mass), len(model.bodies.wheelsets), model.joints.equations
    return Workspace(
        np.zeros((n + 1, 3, 3)), np.full(k, np.nan), np.zeros((n, 6)),
        np.zeros((k, 2, MAX_PATCHES, PATCH_COLUMNS)),
        np.zeros((k, 2), np.int64), np.full((k, 2), np.nan), np.zeros(2, np.int64),
        np.zeros(m), np.zeros(m), np.zeros(m), np.zeros((m, 2, 6)), np.zeros((m, 2), np.int64),
        np.zeros((m, 2, 6)), np.zeros(m), np.zeros((m, m)), np.zeros((2, 3, 3)), np.zeros((3, 4)),
    )  # fmt: skip


@jit(allocates=False)
def _apply_inverse_inertia(inertia, matrix, wrench, out):
    """out = J^-1 n for the moment part of a wrench (6,), J = A diag(inertia) A^T."""
    for i in range(3):
        out[i] = 0.0
    for k in range(3):
        local = matrix[0, k] * wrench[3] + matrix[1, k] * wrench[4] + matrix[2, k] * wrench[5]
        local /= inertia[k]
        for i in range(3):
            out[i] += matrix[i, k] * local


@jit(allocates=False)
def _subtract_gyroscopic(inertia, matrix, state, at, wrench):
    """Subtract w x J w from the moment part of a wrench (6,)."""
    wx, wy, wz = state[at + 10], state[at + 11], state[at + 12]
    hx = hy = hz = 0.0
    for k in range(3):
        h = inertia[k] * (matrix[0, k] * wx + matrix[1, k] * wy + matrix[2, k] * wz)
        hx += matrix[0, k] * h
        hy += matrix[1, k] * h
        hz += matrix[2, k] * h
    wrench[3] -= wy * hz - wz * hy
    wrench[4] -= wz * hx - wx * hz
    wrench[5] -= wx * hy - wy * hx


@jit(allocates=False)
def _solve_in_place(matrix, right):
    """Solve a symmetric positive definite system by Cholesky's factorisation; both arguments are overwritten."""
    n = right.shape[0]
    for i in range(n):
        for j in range(i + 1):
            total = matrix[i, j]
            for k in range(j):
                total -= matrix[i, k] * matrix[j, k]
            matrix[i, j] = math.sqrt(total) if i == j else total / matrix[j, j]
    for i in range(n):
        for k in range(i):
            right[i] -= matrix[i, k] * right[k]
        right[i] /= matrix[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            right[i] -= matrix[k, i] * right[k]
        right[i] /= matrix[i, i]


@jit(allocates=False)
def _add_reactions(model, t, state, work):
    """Solve Eq. (8) for the multipliers and add the joint reactions -D^T lambda to the wrenches."""
    m = model.joints.equations
    mass, inertia = model.bodies.mass, model.bodies.inertia
    owner, jacobian, solved, multipliers = work.owner, work.jacobian, work.solved, work.multipliers
    constraint_equations(
        model.joints, model.track, t, model.speed, state, work.rotations, work.phi, work.phi_rate, jacobian,
        work.gamma, owner,
    )  # fmt: skip
    for row in range(m):
        feedback = 2.0 * model.alpha * work.phi_rate[row] + model.beta * model.beta * work.phi[row]
        multipliers[row] = feedback - work.gamma[row]
        for end in range(2):
            body = owner[row, end]
            if body == FRAME:
                continue
            block = solved[row, end]  # M^-1 D^T, block by block
            _apply_inverse_inertia(inertia[body], work.rotations[body], jacobian[row, end], block[3:])
            for i in range(6):
                if i < 3:
                    block[i] = jacobian[row, end, i] / mass[body]
                multipliers[row] += block[i] * work.wrenches[body, i]
    for row in range(m):
        for column in range(m):
            entry = 0.0
            for end in range(2):
                for other in range(2):
                    if owner[row, end] != FRAME and owner[row, end] == owner[column, other]:
                        for i in range(6):
                            entry += jacobian[row, end, i] * solved[column, other, i]
            work.matrix[row, column] = entry
    _solve_in_place(work.matrix, multipliers)
    for row in range(m):
        for end in range(2):
            body = owner[row, end]
            if body != FRAME:
                for i in range(6):
                    work.wrenches[body, i] -= multipliers[row] * jacobian[row, end, i]


@jit(allocates=False)
def fill_derivatives(t, state, model, work, rate):
    """Right-hand side of the equations of motion.

    Parameters
    ----------
    t : float
        Time, s.
    state : numpy.ndarray, shape (13 n,)
        Per body: position (m), Euler parameters, velocity (m/s), angular velocity (rad/s), track axes.
    model : Model
    work : Workspace
        Overwritten; patches and counts belong to this evaluation afterwards.
    rate : numpy.ndarray, shape (13 n,)
        Filled: time derivative of the state.
    """
    bodies = model.bodies
    n = bodies.mass.shape[0]
    work.counters[0] += 1
    for b in range(n):
        rotation_matrix(state, STATE_SIZE * b, work.rotations[b])
        wrench = work.wrenches[b]
        wrench[:] = 0.0
        wrench[2] = -model.gravity * bodies.mass[b]
    for k in range(bodies.wheelsets.shape[0]):
        b = bodies.wheelsets[k]
        at = STATE_SIZE * b
        axle = work.rotations[b]
        wrench = work.wrenches[b]
        if not model.track.tangent:
            s, outside = add_rail_wrenches(
                model.contact, model.track, state, at, axle, work.arc_lengths[k], work.frames, work.irregularity,
                work.patches[k], work.counts[k], work.bounds[k], wrench,
            )  # fmt: skip
            work.arc_lengths[k] = s
            work.counters[1] += outside
            continue
        for wheel in range(2):
            fx, fy, fz, mx, my, mz, count, outside, bound = wheel_wrench(
                model.contact, 1.0 - 2.0 * wheel, state[at + 1], state[at + 2], axle[0, 1], axle[1, 1], axle[2, 1],
                state[at + 7], state[at + 8], state[at + 9], state[at + 10], state[at + 11], state[at + 12],
                0.0, 0.0, work.patches[k, wheel],
            )  # fmt: skip
            work.counts[k, wheel], work.bounds[k, wheel] = count, bound
            work.counters[1] += outside
            wrench[0] += fx
            wrench[1] += fy
            wrench[2] += fz
            wrench[3] += mx
            wrench[4] += my
            wrench[5] += mz
    spring_damper_forces(model.springs, model.track, t, model.speed, state, work.rotations, work.wrenches)
    for b in range(n):
        _subtract_gyroscopic(bodies.inertia[b], work.rotations[b], state, STATE_SIZE * b, work.wrenches[b])
    if model.joints.equations > 0:
        _add_reactions(model, t, state, work)
    for b in range(n):
        at = STATE_SIZE * b
        wx, wy, wz = state[at + 10], state[at + 11], state[at + 12]
        if bodies.spins[b] == 1:
            axle = work.rotations[b]
            spin = wx * axle[0, 1] + wy * axle[1, 1] + wz * axle[2, 1]
            wx, wy, wz = wx - spin * axle[0, 1], wy - spin * axle[1, 1], wz - spin * axle[2, 1]
        euler_rates(state, at, wx, wy, wz, model.alpha, rate)
        for i in range(3):
            rate[at + i] = state[at + 7 + i]
            rate[at + 7 + i] = work.wrenches[b, i] / bodies.mass[b]
        _apply_inverse_inertia(bodies.inertia[b], work.rotations[b], work.wrenches[b], rate[at + 10 : at + 13])


@jit
def derivatives(t, state, model, work):
    """Right-hand side in a new array (13 n,); arguments as for :func:`fill_derivatives`."""
    rate = np.empty_like(state)
    fill_derivatives(t, state, model, work, rate)
    return rate


@jit
def _derivatives_of_boxed(t, state, box):
    model, work = box[0]
    return derivatives(t, state, model, work)


def right_hand_side(model, work):
    """The equations of motion as ``function(t, state)`` for a solver that is written in Python.

    A model holds some sixty arrays; handing them across the border between Python and compiled code at each call
    costs more than the equations themselves. A compiled list crosses it as one pointer.

    Parameters
    ----------
    model : Model
    work : Workspace

    Returns
    -------
    callable
    """
    box = List()
    box.append((model, work))
    return lambda t, state: _derivatives_of_boxed(t, state, box)
