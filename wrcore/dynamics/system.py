"""Equations of motion: Newton-Euler in absolute coordinates with Lagrange multipliers and Baumgarte, Eq. (8).

    [ M  D^T ] [ v'     ]   [ g                               ]
    [ D   0  ] [ lambda ] = [ gamma - 2 alpha Phi' - beta^2 Phi ]

with v = (r', w) per body in track axes. M is block diagonal (mass, inertia in track axes), so the multipliers follow
from the small system (D M^-1 D^T) lambda = D M^-1 g - gamma*, and the full matrix of Eq. (8) is never formed. A scene
without joints does not run any of this.
"""

from typing import NamedTuple

import numpy as np
from numba.typed import List

from wrcore._jit import jit
from wrcore.contact.reduction import MAX_PATCHES, PATCH_COLUMNS
from wrcore.dynamics.body import STATE_SIZE, euler_rates, rotation_matrix
from wrcore.dynamics.constraints import ConstraintWork, add_reactions, apply_inverse_inertia, constraint_workspace
from wrcore.dynamics.joint import Joints
from wrcore.dynamics.suspension import Elements, element_forces
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
    elements: Elements
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
    turns: np.ndarray
    """(n, 3): angular velocities of the bodies' frames, rad/s; a wheelset's frame does not spin."""
    wrenches: np.ndarray
    """(n, 6): force and moment about the centre of mass of each body."""
    patches: np.ndarray
    """(k, 2, MAX_PATCHES, PATCH_COLUMNS): patches of each wheelset, left and right."""
    counts: np.ndarray
    """(k, 2) int: patches in contact."""
    bounds: np.ndarray
    """(k, 2): bound of planar detection's error (detection ``auto`` only), m."""
    counters: np.ndarray
    """(2,) int: evaluations, creep look-ups out of range."""
    constraints: ConstraintWork
    frames: np.ndarray
    irregularity: np.ndarray


def state_size(model):
    """Length of the state vector: 13 numbers per body and the force elements' own states."""
    return STATE_SIZE * len(model.bodies.mass) + model.elements.states


def workspace(model):
    """Allocate the scratch arrays for a model.

    Parameters
    ----------
    model : Model

    Returns
    -------
    Workspace
    """
    n, k = len(model.bodies.mass), len(model.bodies.wheelsets)
    return Workspace(
        np.tile(np.eye(3), (n + 1, 1, 1)), np.full(k, np.nan), np.zeros((n, 3)), np.zeros((n, 6)),
        np.zeros((k, 2, MAX_PATCHES, PATCH_COLUMNS)),
        np.zeros((k, 2), np.int64), np.full((k, 2), np.nan), np.zeros(2, np.int64),
        constraint_workspace(model.joints), np.zeros((2, 3, 3)), np.zeros((3, 4)),
    )  # fmt: skip


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


@jit(allocates=False, forceinline=True)
def fill_derivatives(t, state, model, work, rate):
    """Right-hand side of the equations of motion.

    Parameters
    ----------
    t : float
        Time, s.
    state : numpy.ndarray, shape (state_size(model),)
        Per body: position (m), Euler parameters, velocity (m/s), angular velocity (rad/s), track axes; then the force
        elements' own states (m).
    model : Model
    work : Workspace
        Overwritten; patches and counts belong to this evaluation afterwards.
    rate : numpy.ndarray
        Filled: time derivative of the state.
    """
    bodies = model.bodies
    n = bodies.mass.shape[0]
    work.counters[0] += 1
    for b in range(n):
        at = STATE_SIZE * b
        matrix, turn, wrench = work.rotations[b], work.turns[b], work.wrenches[b]
        rotation_matrix(state, at, matrix)
        wx, wy, wz = state[at + 10], state[at + 11], state[at + 12]
        spin = 0.0
        if bodies.spins[b] == 1:
            spin = wx * matrix[0, 1] + wy * matrix[1, 1] + wz * matrix[2, 1]
        turn[0], turn[1], turn[2] = wx - spin * matrix[0, 1], wy - spin * matrix[1, 1], wz - spin * matrix[2, 1]
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
    element_forces(model.elements, model.track, t, model.speed, state, work.rotations, work.turns, work.wrenches, rate)
    for b in range(n):
        _subtract_gyroscopic(bodies.inertia[b], work.rotations[b], state, STATE_SIZE * b, work.wrenches[b])
    if model.joints.equations > 0:
        add_reactions(model, t, state, work)
    for b in range(n):
        at = STATE_SIZE * b
        euler_rates(state, at, work.turns[b, 0], work.turns[b, 1], work.turns[b, 2], model.alpha, rate)
        for i in range(3):
            rate[at + i] = state[at + 7 + i]
            rate[at + 7 + i] = work.wrenches[b, i] / bodies.mass[b]
        apply_inverse_inertia(bodies.inertia[b], work.rotations[b], work.wrenches[b], rate[at + 10 : at + 13])


@jit
def derivatives(t, state, model, work):
    """Right-hand side in a new array; arguments as for :func:`fill_derivatives`."""
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
