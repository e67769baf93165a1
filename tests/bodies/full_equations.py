"""Eq. (8) written out: the full matrix of masses and constraints, for reading and for checking the solver."""

from typing import NamedTuple

import numpy as np

from wrcore.bodies.body import STATE_SIZE, VELOCITY
from wrcore.bodies.inertia import inertia_tensors
from wrcore.bodies.joint import build_joints, joint_jacobian
from wrcore.equations.equations_of_motion import Equations


class FullEquations(NamedTuple):
    """The parts of Eq. (8) for n bodies and m constraint equations, and its solution."""

    mass: np.ndarray
    """M, (6 n, 6 n): per body, its mass and its inertia tensor in track axes."""
    jacobian: np.ndarray
    """D, (m, 6 n): rows joint by joint in the order of ``model.joints``."""
    forces: np.ndarray
    """g, (6 n,): forces and moments, gyroscopic moments included, N and N m."""
    right: np.ndarray
    """gamma - 2 alpha Phi' - beta^2 Phi, (m,)."""
    accelerations: np.ndarray
    """v', (n, 6), m/s^2 and rad/s^2."""
    multipliers: np.ndarray
    """lambda, (m,), N or N m."""


def full_equations(model, state, t=0.0):
    """Assemble Eq. (8) and solve it as one linear system.

    Parameters
    ----------
    model : Model
        Without redundant joints.
    state : numpy.ndarray
    t : float
        Time, s.

    Returns
    -------
    FullEquations

    Examples
    --------
    >>> full = full_equations(model, state)
    >>> residual = full.jacobian @ full.accelerations.ravel() - full.right
    """
    n, m = len(model.bodies.mass), model.joints.equations
    equations = Equations(model)
    equations(t, state)
    values, rotations = equations.work.constraints.joints, equations.work.rotations
    mass = np.zeros((6 * n, 6 * n))
    for b in range(n):
        A, at = rotations[b], 6 * b
        mass[at : at + 3, at : at + 3] = model.bodies.mass[b] * np.eye(3)
        mass[at + 3 : at + 6, at + 3 : at + 6] = A @ inertia_tensors(model.bodies)[b] @ A.T
    D = joint_jacobian(model.joints, values, n).reshape(m, 6 * n)
    unjointed = model._replace(joints=build_joints([], model.bodies.spins))
    forces = mass @ _accelerations(Equations(unjointed)(t, state), n)
    used = np.arange(values.phi.shape[1]) < model.joints.size[:, None]
    right = (values.gamma - 2.0 * model.alpha * values.rate - model.beta**2 * values.phi)[used]
    matrix = np.block([[mass, D.T], [D, np.zeros((m, m))]])
    solution = np.linalg.solve(matrix, np.concatenate([forces, right]))
    return FullEquations(mass, D, forces, right, solution[: 6 * n].reshape(n, 6), solution[6 * n :])


def _accelerations(rate, n):
    return rate[: STATE_SIZE * n].reshape(n, STATE_SIZE)[:, VELOCITY:].ravel()
