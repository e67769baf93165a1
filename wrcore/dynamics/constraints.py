"""Lagrange multipliers of Eq. (8): the joints' reactions."""

import math
from typing import NamedTuple

import numpy as np

from wrcore._jit import jit
from wrcore.dynamics.joint import constraint_equations
from wrcore.dynamics.marker import FRAME


class ConstraintWork(NamedTuple):
    """Scratch arrays of the m constraint equations."""

    phi: np.ndarray
    phi_rate: np.ndarray
    gamma: np.ndarray
    jacobian: np.ndarray
    owner: np.ndarray
    solved: np.ndarray
    multipliers: np.ndarray
    """(m,): Lagrange multipliers of the last evaluation."""
    matrix: np.ndarray


def constraint_workspace(joints):
    """Allocate the scratch arrays for some joints."""
    m = joints.equations
    return ConstraintWork(
        np.zeros(m), np.zeros(m), np.zeros(m), np.zeros((m, 2, 6)), np.zeros((m, 2), np.int64), np.zeros((m, 2, 6)),
        np.zeros(m), np.zeros((m, m)),
    )  # fmt: skip


@jit(allocates=False)
def apply_inverse_inertia(inertia, matrix, wrench, out):
    """out = J^-1 n for the moment part of a wrench (6,), J = A diag(inertia) A^T."""
    for i in range(3):
        out[i] = 0.0
    for k in range(3):
        local = matrix[0, k] * wrench[3] + matrix[1, k] * wrench[4] + matrix[2, k] * wrench[5]
        local /= inertia[k]
        for i in range(3):
            out[i] += matrix[i, k] * local


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
def add_reactions(model, t, state, work):
    """Solve Eq. (8) for the multipliers and add the joint reactions -D^T lambda to the wrenches."""
    m = model.joints.equations
    mass, inertia = model.bodies.mass, model.bodies.inertia
    scratch = work.constraints
    owner, jacobian, solved, multipliers = scratch.owner, scratch.jacobian, scratch.solved, scratch.multipliers
    constraint_equations(
        model.joints, model.track, t, model.speed, state, work.rotations, scratch.phi, scratch.phi_rate, jacobian,
        scratch.gamma, owner,
    )  # fmt: skip
    for row in range(m):
        feedback = 2.0 * model.alpha * scratch.phi_rate[row] + model.beta * model.beta * scratch.phi[row]
        multipliers[row] = feedback - scratch.gamma[row]
        for end in range(2):
            body = owner[row, end]
            if body == FRAME:
                continue
            block = solved[row, end]  # M^-1 D^T, block by block
            apply_inverse_inertia(inertia[body], work.rotations[body], jacobian[row, end], block[3:])
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
            scratch.matrix[row, column] = entry
    _solve_in_place(scratch.matrix, multipliers)
    for row in range(m):
        for end in range(2):
            body = owner[row, end]
            if body != FRAME:
                for i in range(6):
                    work.wrenches[body, i] -= multipliers[row] * jacobian[row, end, i]
