"""The kernel that eliminates own states in groups, see :mod:`wrcore.integrate.groups`."""

import numpy as np

from wrcore.dynamics.body import STATE_SIZE
from wrcore.integrate.blocks import derivative
from wrcore.integrate.groups import FACTORISE, REDUCE
from wrcore.kernels.jit import jit


@jit(allocates=False)
def eliminate_groups(jacobian, system, sigma, increment, task):
    """Do one of the tasks of `wrcore.integrate.groups` for all groups: FACTORISE changes the blocks of ``system``,
    REDUCE its right-hand side by that of a stage, ``increment`` (size,), into which RESTORE writes the groups'
    states."""
    for k in range(system.groups.starts.shape[0] - 1):
        if task == FACTORISE:
            _invert_corner(jacobian, system.groups, sigma, k)
            _change_blocks(jacobian, system, k)
        elif task == REDUCE:
            _reduce(jacobian, system, increment, k)
        else:
            _restore(system, increment, k)


@jit(allocates=False)
def _invert_corner(jacobian, groups, sigma, k):
    """Write P^-1 of the k-th group (Gauss and Jordan, pivots by rows); not finite where it is singular."""
    first, n = groups.starts[k], 6 * jacobian.axes.shape[0]
    size, inverse, matrix = groups.starts[k + 1] - first, groups.corner[k], groups.scratch
    for i in range(size):
        for j in range(size):
            column, row = n + groups.members[first + j], n + groups.members[first + i]
            inverse[i, j] = 1.0 if i == j else 0.0
            matrix[i, j] = sigma * inverse[i, j] - jacobian.by_velocity[column, row]
    for i in range(size):
        pivot = i
        for row in range(i + 1, size):
            if abs(matrix[row, i]) > abs(matrix[pivot, i]):
                pivot = row
        scale = 1.0 / matrix[pivot, i] if matrix[pivot, i] != 0.0 else np.nan
        for j in range(size):
            matrix[i, j], matrix[pivot, j] = matrix[pivot, j], matrix[i, j]
            inverse[i, j], inverse[pivot, j] = inverse[pivot, j], inverse[i, j]
        for j in range(size):
            matrix[i, j] *= scale
            inverse[i, j] *= scale
        for row in range(size):
            factor = matrix[row, i]
            if row != i:
                for j in range(size):
                    matrix[row, j] -= factor * matrix[i, j]
                    inverse[row, j] -= factor * inverse[i, j]


@jit(allocates=False)
def _change_blocks(jacobian, system, k):
    """Write F P^-1 and D of the k-th group and subtract their product from the bodies' blocks."""
    groups, n = system.groups, 6 * jacobian.axes.shape[0]
    first, size = groups.starts[k], groups.starts[k + 1] - groups.starts[k]
    begin, end = groups.body_starts[k], groups.body_starts[k + 1]
    for q in range(begin, end):
        body = groups.bodies[q]
        for i in range(6):
            for j in range(size):
                groups.force[q, i, j] = 0.0
                groups.drive[q, j, i] = -derivative(jacobian, system, n + groups.members[first + j], body, i)
            for m in range(size):
                column = -jacobian.by_velocity[n + groups.members[first + m], 6 * body + i]
                for j in range(size):
                    groups.force[q, i, j] += column * groups.corner[k, m, j]
    for q in range(begin, end):
        for p in range(begin, end):
            block = system.blocks[system.pattern.place[groups.bodies[q], groups.bodies[p]]]
            for i in range(6):
                for m in range(size):
                    factor = groups.force[q, i, m]
                    for j in range(6):
                        block[i, j] -= factor * groups.drive[p, m, j]


@jit(allocates=False)
def _reduce(jacobian, system, increment, k):
    """Write g of the k-th group, with what the displacements known so far add, and subtract F P^-1 g from r."""
    groups, bodies = system.groups, jacobian.axes.shape[0]
    first, size, g = groups.starts[k], groups.starts[k + 1] - groups.starts[k], groups.right[k]
    begin, end = groups.body_starts[k], groups.body_starts[k + 1]
    for m in range(size):
        state = groups.members[first + m]
        g[m] = increment[STATE_SIZE * bodies + state]
        for q in range(begin, end):
            body = groups.bodies[q]
            for i in range(6):
                g[m] += jacobian.by_position[6 * body + i, 6 * bodies + state] * system.shift[body, i]
    for q in range(begin, end):
        to = system.right[groups.bodies[q]]
        for i in range(6):
            for m in range(size):
                to[i] -= groups.force[q, i, m] * g[m]


@jit(allocates=False)
def _restore(system, increment, k):
    """Write the states of the k-th group, from the bodies' velocities."""
    groups, own = system.groups, STATE_SIZE * system.pattern.order.shape[0]
    first, size, g = groups.starts[k], groups.starts[k + 1] - groups.starts[k], groups.right[k]
    for q in range(groups.body_starts[k], groups.body_starts[k + 1]):
        velocity = system.right[groups.bodies[q]]
        for m in range(size):
            for i in range(6):
                g[m] -= groups.drive[q, m, i] * velocity[i]
    for m in range(size):
        total = 0.0
        for j in range(size):
            total += groups.corner[k, m, j] * g[j]
        increment[own + groups.members[first + m]] = total
