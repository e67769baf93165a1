"""Small motions about steady running: the equations of motion, linearised in independent coordinates.

Coordinates of a body are the displacement of its centre (track axes) and the small rotation of its frame about its own
axes. The velocities are that of its centre (track axes) and its angular velocity (body axes). Displacements q and
velocities u are then related by q' = u, and only accelerations and the rates of the elements' internal states need
difference quotients. The frame of a wheelset does not spin (see wrcore.bodies.body): a wheelset has no rotation about
its axle, and its spin rate is a velocity without a displacement.

Joints are eliminated: the columns of N are a basis of the null space of their Jacobian D. Then q = N a and u = N b
satisfy all joints to first order, for any spin of the wheelsets.
"""

from dataclasses import dataclass

import numpy as np

from wrcore.balance.equilibrium import RESIDUAL
from wrcore.bodies.body import EULER, OMEGA, STATE_SIZE, VELOCITY
from wrcore.bodies.joint import joint_jacobian
from wrcore.equations.equations_of_motion import Equations
from wrcore.equations.model import internal_states

DIRECTIONS = ("x", "y", "z", "roll", "pitch", "yaw")
"""Coordinates of a body; pitch of a wheelset is its spin."""

STEP = 1e-7
"""Step of the difference quotients in displacements (m) and rotations (rad)."""

VELOCITY_STEP = 1e-5
"""Step of the difference quotients in velocities (m/s) and angular velocities (rad/s)."""

RANK = 1e-9
"""Singular values below this fraction of the largest one are taken as zero."""


@dataclass(frozen=True)
class Linearisation:
    """Linear equations x' = A x for small motions about a steady state."""

    matrix: np.ndarray
    """(m, m): A, in independent coordinates: displacements, velocities, then the force elements' internal states."""
    basis: np.ndarray
    """(12 n + states, m): matrix from independent coordinates to the moves of the n bodies, see :func:`moved_states`.
    """
    state: np.ndarray
    speed: float
    """Speed of the vehicle, m/s."""
    places: int
    """Number of independent displacements."""
    residual: np.ndarray
    """(m,): x' at ``state`` without the velocities, zero at a steady state (m/s^2, rad/s^2, m/s)."""
    steps: np.ndarray
    """(m,): steps of difference quotients in the independent coordinates."""


def linearise(model, state):
    """Linearise the equations of motion about a steady state on a tangent track.

    In that state all bodies move ahead without rotation (wheelsets spin) and without acceleration, as in
    :func:`steady_running`. Derivatives are central differences in all independent coordinates; all right-hand sides are
    evaluated in one compiled call.
    """
    size = 6 * len(model.bodies.mass)
    equations = Equations(model)
    equations(0.0, state)  # fills the joints' Jacobian
    places, speeds = _independent_motions(model, state, equations.work)
    basis = _block_diagonal(places, speeds, np.eye(internal_states(model)))
    steps = np.full(basis.shape[1], STEP)
    steps[places.shape[1] : places.shape[1] + speeds.shape[1]] = VELOCITY_STEP
    moves = steps[:, None] * basis.T
    states = moved_states(model, state, np.vstack([moves, -moves, np.zeros((1, len(basis)))]))
    changes = accelerations(model, states, equations.at(0.0, states))
    slopes = (changes[: len(moves)] - changes[len(moves) : -1]).T / (2.0 * steps)
    kinematic = np.zeros((places.shape[1], len(moves)))
    kinematic[:, places.shape[1] : places.shape[1] + speeds.shape[1]] = places.T @ speeds
    matrix = np.vstack([kinematic, speeds.T @ slopes[:size], slopes[size:]])
    rest = np.concatenate([np.zeros(places.shape[1]), changes[-1, :size] @ speeds, changes[-1, size:]])
    return Linearisation(matrix, basis, state, float(model.speed), places.shape[1], rest, steps)


def _block_diagonal(*blocks):
    """Return the block-diagonal matrix of the given matrices.

    It replaces ``scipy.linalg.block_diag``, whose import would add 0.05 s to each run.
    """
    ends = np.cumsum([block.shape for block in blocks], axis=0)
    whole = np.zeros(ends[-1])
    for block, (row, column) in zip(blocks, ends, strict=True):
        whole[row - block.shape[0] : row, column - block.shape[1] : column] = block
    return whole


def steady_running(model, state, iterations=10):
    """Solve for the steady state near a given state and linearise about it, on a tangent track.

    Newton's method solves for the displacements and the wheelsets' spins. In the given state all bodies move ahead at
    the model's speed, wheels pressed onto the rails.

    Check ``residual``: the residual of a free wheelset is not zero, because spin creepage decelerates it. Displacements
    without stiffness, such as those along the track, are not changed.
    """
    best = linearise(model, cleared(model, state))
    places, size = best.places, len(best.matrix)
    columns = np.r_[:places, size - internal_states(model) - np.count_nonzero(model.bodies.spins) : size]
    last = np.inf
    for _ in range(iterations):
        left = np.max(np.abs(best.residual))
        if left < RESIDUAL and not left < 0.1 * last:
            break
        last = left
        slopes = best.matrix[places:, columns]
        largest = np.max(np.abs(slopes), axis=1)
        weights = 1.0 / np.maximum(largest, 1e-9 * np.max(largest))  # rows of zeros have no force
        step = np.linalg.lstsq(weights[:, None] * slopes, -weights * best.residual[places:], rcond=RANK)[0]
        moved = moved_states(model, best.state, (best.basis[:, columns] @ step)[None, :])[0]
        new = linearise(model, cleared(model, moved))
        before, after = (np.max(np.abs(linear.residual)) for linear in (best, new))
        # also compared with weights: an increasing spin residual may hide decreasing residuals of the rails
        weighted, less = (np.max(weights * np.abs(linear.residual[places:])) for linear in (best, new))
        if not (after < before or less < 0.5 * weighted):
            break
        best = new
    return best


def cleared(model, state):
    """Return the state; for patches on strips, values below 1e-13 (rounding) are set to zero.

    Otherwise single precision in rolling contact would turn them into force differences of millinewtons between wheels
    that are mirror images.
    """
    return np.where(np.abs(state) < 1e-13, 0.0, state) if model.contact.strips.strips else state


def moved_states(model, state, moves):
    """Return states (k, size) with displaced bodies and changed velocities.

    A row of ``moves`` (k, 12 n + states): displacement (m, track axes) and rotation vector (rad, body axes) of body
    after body; change of velocity (m/s, track axes) and of angular velocity (rad/s, body axes) of body after body;
    changes of the elements' internal states.
    """
    n = len(model.bodies.mass)
    states = np.tile(state, (len(moves), 1))
    parts = states[:, : STATE_SIZE * n].reshape(-1, n, STATE_SIZE)
    place, speed = moves[:, : 12 * n].reshape(-1, 2, n, 6).swapaxes(0, 1)
    turning = _into_body(parts[..., EULER:VELOCITY], parts[..., OMEGA:])
    parts[..., :3] += place[..., :3]
    parts[..., EULER:VELOCITY] = _turned(parts[..., EULER:VELOCITY], place[..., 3:])
    parts[..., VELOCITY:OMEGA] += speed[..., :3]
    parts[..., OMEGA:] = _out_of_body(parts[..., EULER:VELOCITY], turning + speed[..., 3:])
    states[:, STATE_SIZE * n :] += moves[:, 12 * n :]
    return states


def _turned(p, turn):
    """Return Euler parameters (..., 4) after a further rotation by a rotation vector in body axes (..., 3)."""
    angle = np.linalg.norm(turn, axis=-1, keepdims=True)
    c, s = np.cos(0.5 * angle), 0.5 * np.sinc(0.5 * angle / np.pi) * turn
    e0, e = p[..., :1], p[..., 1:]
    return np.concatenate([e0 * c - np.sum(e * s, -1, keepdims=True), e0 * s + c * e + _cross(e, s)], axis=-1)


def _cross(a, b):
    """Return cross products of vectors (..., 3), bitwise identical to NumPy's and faster for few vectors."""
    return a[..., [1, 2, 0]] * b[..., [2, 0, 1]] - a[..., [2, 0, 1]] * b[..., [1, 2, 0]]


def _out_of_body(p, vector):
    """Transform vectors (..., 3) from body axes to track axes with Euler parameters (..., 4)."""
    e0, e = p[..., :1], p[..., 1:]
    return vector + 2.0 * _cross(e, _cross(e, vector) + e0 * vector)


def _into_body(p, vector):
    """Transform vectors (..., 3) from track axes to body axes with Euler parameters (..., 4)."""
    return _out_of_body(p * np.array([1.0, -1.0, -1.0, -1.0]), vector)


def accelerations(model, states, rates):
    """Return the rates (k, 6 n + states) of velocities, of angular velocities in body axes, and of internal states."""
    n = len(model.bodies.mass)
    parts, slopes = (rows[:, : STATE_SIZE * n].reshape(-1, n, STATE_SIZE) for rows in (states, rates))
    turning, change = (_into_body(parts[..., EULER:VELOCITY], rows[..., OMEGA:]) for rows in (parts, slopes))
    frame = turning.copy()
    frame[:, model.bodies.spins == 1, 1] = 0.0
    both = np.concatenate([slopes[..., VELOCITY:OMEGA], change - _cross(frame, turning)], axis=-1)
    return np.hstack([both.reshape(-1, 6 * n), rates[:, STATE_SIZE * n :]])


def _independent_motions(model, state, work):
    """Return bases of the displacements (6 n, a) and velocities (6 n, b) that satisfy the joints to first order."""
    n = len(model.bodies.mass)
    spins = 6 * np.flatnonzero(model.bodies.spins) + 4
    turning = np.delete(np.arange(6 * n), spins)
    jacobian = joint_jacobian(model.joints, work.constraints.joints, n)
    jacobian[..., 3:] = _into_body(state[: STATE_SIZE * n].reshape(n, STATE_SIZE)[:, EULER:VELOCITY], jacobian[..., 3:])
    places = np.eye(6 * n)[:, turning]
    if len(jacobian):
        _, values, vectors = np.linalg.svd(jacobian.reshape(-1, 6 * n)[:, turning])
        places = places @ vectors[np.count_nonzero(values > RANK * values[0]) :].T
    return places, np.hstack([places, np.eye(6 * n)[:, spins]])
