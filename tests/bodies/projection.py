"""Projection of a state onto the constraints, for use after an integrator's step.

Positions move by M^-1 D^T mu, the displacement that is shortest in the metric of M, with (D M^-1 D^T) mu = -Phi:
a Gauss-Newton step, repeated until Phi is small. Velocities change by M^-1 D^T nu with (D M^-1 D^T) nu = -Phi', once,
because Phi' is linear in them. Both use the matrix of Eq. (8) and its solver. A wheelset's frame needs no special
treatment: no joint has a moment about the axle.

References
----------
Eich, Convergence results for a coordinate projection method applied to mechanical systems with algebraic constraints,
SIAM J. Numer. Anal. 30 (1993) 1467-1482.
"""

import math

from wrcore.bodies.body import EULER, OMEGA, STATE_SIZE, VELOCITY, rotation_matrix
from wrcore.bodies.joint import MOST_EQUATIONS, evaluate_joints
from wrcore.bodies.joint_forces import apply_inverse_masses, invert_masses, solve_multipliers, subtract_reactions
from wrcore.kernels.jit import jit


@jit(allocates=False)
def project_positions(t, state, model, work, tolerance, most):
    """Move bodies until all joints close, and normalise the Euler parameters of all bodies.

    Parameters
    ----------
    t : float
        Time, s.
    state : numpy.ndarray
        Positions and Euler parameters are overwritten.
    model : Model
    work : Workspace
        Rotations, wrenches and ``constraints`` are overwritten.
    tolerance : float
        Largest |Phi| to accept, m or rad.
    most : int
        Largest number of Gauss-Newton steps.

    Returns
    -------
    float
        Largest |Phi| that is left.
    """
    joints, scratch = model.joints, work.constraints
    values = scratch.joints
    for b in range(model.bodies.mass.shape[0]):
        _normalise(state, STATE_SIZE * b + EULER)
    steps = 0
    while True:
        for b in joints.order.moving:
            rotation_matrix(state, STATE_SIZE * b, work.rotations[b])
        evaluate_joints(joints, t, model.speed, state, work.rotations, values)
        worst = 0.0
        for p in range(joints.kind.shape[0]):
            for row in range(MOST_EQUATIONS):
                worst = max(worst, abs(values.phi[p, row]))
        if not worst > tolerance or steps == most:
            return worst
        steps += 1
        _respond(values.phi, model, work)
        for b in joints.order.moving:
            at, move = STATE_SIZE * b, scratch.accelerations[b]
            for i in range(3):
                state[at + i] += move[i]
            _turn(state, at + EULER, move[3], move[4], move[5])


@jit(allocates=False)
def project_velocities(t, state, model, work):
    """Change velocities so that Phi' = 0 at the state's positions.

    Parameters
    ----------
    t : float
        Time, s.
    state : numpy.ndarray
        Velocities and angular velocities are overwritten.
    model : Model
    work : Workspace
        Rotations, wrenches and ``constraints`` are overwritten.
    """
    joints, scratch = model.joints, work.constraints
    for b in joints.order.moving:
        rotation_matrix(state, STATE_SIZE * b, work.rotations[b])
    evaluate_joints(joints, t, model.speed, state, work.rotations, scratch.joints)
    _respond(scratch.joints.rate, model, work)
    for b in joints.order.moving:
        at, change = STATE_SIZE * b, scratch.accelerations[b]
        for i in range(3):
            state[at + VELOCITY + i] += change[i]
            state[at + OMEGA + i] += change[3 + i]


@jit(allocates=False)
def _respond(violation, model, work):
    """accelerations = -M^-1 D^T mu with (D M^-1 D^T) mu = violation (n, 5)."""
    joints, scratch = model.joints, work.constraints
    for p in range(joints.kind.shape[0]):
        for row in range(MOST_EQUATIONS):
            scratch.multipliers[p, row] = violation[p, row]
    invert_masses(model.bodies, joints, work.rotations, scratch)
    solve_multipliers(joints, scratch)
    for b in joints.order.moving:
        work.wrenches[b, :] = 0.0
    subtract_reactions(joints, scratch, work.wrenches)
    apply_inverse_masses(joints, scratch, work.wrenches)


@jit(allocates=False, inline="always")
def _normalise(state, at):
    e0, e1, e2, e3 = state[at], state[at + 1], state[at + 2], state[at + 3]
    scale = 1.0 / math.sqrt(e0 * e0 + e1 * e1 + e2 * e2 + e3 * e3)
    state[at], state[at + 1], state[at + 2], state[at + 3] = scale * e0, scale * e1, scale * e2, scale * e3


@jit(allocates=False, inline="always")
def _turn(state, at, x, y, z):
    """Euler parameters after a small rotation about (x, y, z) in track axes, p + 1/2 E^T (x, y, z), normalised."""
    e0, e1, e2, e3 = state[at], state[at + 1], state[at + 2], state[at + 3]
    state[at] = e0 + 0.5 * (-e1 * x - e2 * y - e3 * z)
    state[at + 1] = e1 + 0.5 * (e0 * x - e2 * z + e3 * y)
    state[at + 2] = e2 + 0.5 * (e0 * y + e1 * z - e3 * x)
    state[at + 3] = e3 + 0.5 * (e0 * z - e1 * y + e2 * x)
    _normalise(state, at)
