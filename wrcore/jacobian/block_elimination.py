"""Linear system of a Rosenbrock step, 1/(h gamma) - J, solved by elimination of blocks, body by body.

With sigma = 1/(h gamma), the unknowns of a body are its displacement q and its velocity v; internal states belong to no
body. Displacements follow q' = Q q + R v with one block of Q and R per body. They are eliminated first:
q = (sigma - Q)^-1 (g + R v). Internal states that act only on bodies are eliminated next, as scalars. The remaining
matrix has a 6 x 6 block for each pair of bodies that elements or joints link. Internal states that act on one another,
as those of the track under a wheelset, are nodes like bodies, with up to six unknowns each; displacements of the track,
q' = v, are eliminated first as well. The order of elimination creates few new blocks (track, wheelsets, bogies, car
body). All loops are explicit, without a linear algebra library, so that results are bitwise identical in every run.
"""

from typing import NamedTuple

import numpy as np

from wrcore.bodies.body import EULER, STATE_SIZE, VELOCITY
from wrcore.bodies.vector import dot
from wrcore.jacobian.elimination_order import Pattern, plan_elimination
from wrcore.jacobian.moving_axes import RATE
from wrcore.kernels.jit import jit


class System(NamedTuple):
    """Factorised linear system of a step, with its right-hand side."""

    pattern: Pattern
    inverse: np.ndarray  # (n, 2, 3, 3): (sigma - Q)^-1 of positions and of rotations
    carried: np.ndarray  # (n, 2, 3, 3): (sigma - Q)^-1 R of positions and of rotations
    blocks: np.ndarray  # (b, 6, 6): inverse blocks on the diagonal, L below it, U above it
    pivot: np.ndarray  # (s,): diagonal entries of internal states that act only on bodies
    force: np.ndarray  # (r, 6): column of such a state in the rows of its bodies
    drive: np.ndarray  # (r, 6): row of such a state in the columns of its bodies
    right: np.ndarray  # (m, 6): right-hand side, then velocities and internal states
    shift: np.ndarray  # (n, 6): part of the displacements that is independent of the unknown velocities
    scratch: np.ndarray  # (6, 6)


def new_system(equations):
    """Plan the elimination and allocate the `System` of a model's equations."""
    pattern, n = equations.planned(plan_elimination), len(equations.arguments[1].value.bodies.mass)
    m, entries = len(pattern.order), len(pattern.state_bodies)
    return System(
        pattern, np.zeros((n, 2, 3, 3)), np.zeros((n, 2, 3, 3)), np.zeros((pattern.place.max() + 1, 6, 6)),
        np.zeros(len(pattern.states)), np.zeros((entries, 6)), np.zeros((entries, 6)), np.zeros((m, 6)),
        np.zeros((n, 6)), np.zeros((6, 6)),
    )  # fmt: skip


@jit(allocates=False)
def _invert_rotation(a, out):
    """Write the inverse of a matrix (3, 3), computed by cofactors, to ``out``."""
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        for column in range(3):
            p, q = (column + 1) % 3, (column + 2) % 3
            out[column, i] = a[j, p] * a[k, q] - a[j, q] * a[k, p]
    scale = 1.0 / (a[0, 0] * out[0, 0] + a[0, 1] * out[1, 0] + a[0, 2] * out[2, 0])
    for i in range(3):
        for j in range(3):
            out[i, j] *= scale


@jit(allocates=False)
def _invert_block(block, scratch):
    """Replace a block by its inverse (Gauss-Jordan with row pivoting); return False if it is singular or not finite."""
    for i in range(6):
        for j in range(6):
            scratch[i, j] = block[i, j]
            block[i, j] = 1.0 if i == j else 0.0
    for k in range(6):
        pivot = k
        for i in range(k + 1, 6):
            if abs(scratch[i, k]) > abs(scratch[pivot, k]):
                pivot = i
        if not 0.0 < abs(scratch[pivot, k]) < np.inf:
            return False
        scale = 1.0 / scratch[pivot, k]
        for j in range(6):
            scratch[k, j], scratch[pivot, j] = scratch[pivot, j], scratch[k, j]
            block[k, j], block[pivot, j] = block[pivot, j], block[k, j]
        for j in range(6):
            scratch[k, j] *= scale
            block[k, j] *= scale
        for i in range(6):
            factor = scratch[i, k]
            if i != k:
                for j in range(6):
                    scratch[i, j] -= factor * scratch[k, j]
                    block[i, j] -= factor * block[k, j]
    return True


@jit(allocates=False)
def _multiply_right(block, other, scratch):
    """Replace a block by its product with another one: block = block @ other."""
    for i in range(6):
        for j in range(6):
            scratch[i, j] = 0.0
        for k in range(6):
            factor = block[i, k]
            for j in range(6):
                scratch[i, j] += factor * other[k, j]
    for i in range(6):
        for j in range(6):
            block[i, j] = scratch[i, j]


@jit(allocates=False)
def _subtract_product(target, left, right):
    """Subtract a product of blocks from another block: target -= left @ right."""
    for i in range(6):
        for k in range(6):
            factor = left[i, k]
            for j in range(6):
                target[i, j] -= factor * right[k, j]


@jit(allocates=False)
def _carry(jacobian, system, sigma):
    """Eliminate the positions (u' = v - omega x u), the lengths of p, and then the rotations of all bodies."""
    rate, share = jacobian.turn[RATE], 1.0 / (sigma - jacobian.length[0])
    along, across = sigma / (sigma * sigma + rate * rate), rate / (sigma * sigma + rate * rate)
    for b in range(system.carried.shape[0]):
        for slide in (system.inverse[b, 0], system.carried[b, 0]):
            slide[0, 0] = slide[1, 1] = along
            slide[0, 1], slide[1, 0], slide[2, 2] = across, -across, 1.0 / sigma
        turning, by_length = jacobian.turning[b], jacobian.spin[b]
        inverse, carried = system.inverse[b, 1], system.carried[b, 1]
        for i in range(3):
            for j in range(3):
                carried[i, j] = (sigma if i == j else 0.0) - turning[i, j] - share * by_length[i] * turning[3, j]
        _invert_rotation(carried, inverse)
        for i in range(3):
            for j in range(3):
                carried[i, j] = 0.0
                for k in range(3):
                    carried[i, j] += inverse[i, k] * (turning[k, 3 + j] + share * by_length[k] * turning[3, 3 + j])


@jit(allocates=False, forceinline=True)
def _fill(jacobian, system, first, count, j, block):
    """Write the negative derivatives of some rows with respect to the velocities of body j to ``block``. They include
    the effect of the displacements that follow from these velocities."""
    for part in range(2):
        at, carried = 6 * j + 3 * part, system.carried[j, part]
        x, y, z = jacobian.by_position[at], jacobian.by_position[at + 1], jacobian.by_position[at + 2]
        for k in range(3):
            known, by_x, by_y, by_z = jacobian.by_velocity[at + k], carried[0, k], carried[1, k], carried[2, k]
            for row in range(count):
                i = first + row
                block[row, 3 * part + k] = -(known[i] + x[i] * by_x + y[i] * by_y + z[i] * by_z)


@jit(allocates=False, forceinline=True)
def _add_shift(jacobian, shift, first, count, j, to):
    """Add the effect of ``shift``, the displacements of body j independent of its velocities, to some rows."""
    for k in range(6):
        column, share = jacobian.by_position[6 * j + k], shift[j, k]
        for row in range(count):
            to[row] += share * column[first + row]


@jit(allocates=False)
def factorise(jacobian, system, sigma):
    """Assemble and factorise the system for sigma = 1/(h gamma); return False if it is singular."""
    pattern, blocks, bodies = system.pattern, system.blocks, system.carried.shape[0]
    _carry(jacobian, system, sigma)
    blocks[:] = 0.0
    for q in range(pattern.pairs.shape[0]):
        i, j = pattern.pairs[q, 0], pattern.pairs[q, 1]
        block = blocks[pattern.place[i, j]]
        if j >= bodies:
            for column in range(pattern.width[j]):
                for row in range(pattern.width[i]):
                    block[row, column] = -jacobian.by_velocity[pattern.first[j] + column, pattern.first[i] + row]
                    if pattern.displaced[j] >= 0:
                        known = jacobian.by_velocity[pattern.displaced[j] + column, pattern.first[i] + row]
                        block[row, column] -= known / sigma
        elif i < bodies:
            _fill(jacobian, system, 6 * i, 6, j, block)
        else:
            _fill(jacobian, system, pattern.first[i], pattern.width[i], j, block)
    for node in range(pattern.order.shape[0]):
        block = blocks[pattern.place[node, node]]
        for k in range(6):
            block[k, k] += sigma
    for s in range(system.pivot.shape[0]):
        state = pattern.states[s]
        system.pivot[s] = sigma - jacobian.by_velocity[state, state]
        first, last = pattern.state_starts[s], pattern.state_starts[s + 1]
        for q in range(first, last):
            body = pattern.state_bodies[q]
            _fill(jacobian, system, state, 1, body, system.drive[q : q + 1])
            for k in range(6):
                system.force[q, k] = -jacobian.by_velocity[state, 6 * body + k]
        for q in range(first, last):
            for p in range(first, last):
                block = blocks[pattern.place[pattern.state_bodies[q], pattern.state_bodies[p]]]
                for i in range(6):
                    factor = system.force[q, i] / system.pivot[s]
                    for j in range(6):
                        block[i, j] -= factor * system.drive[p, j]
    return _eliminate(pattern, blocks, system.scratch)


@jit(allocates=False)
def _eliminate(pattern, blocks, scratch):
    for k in range(pattern.order.shape[0]):
        body = pattern.order[k]
        pivot = blocks[pattern.place[body, body]]
        if not _invert_block(pivot, scratch):
            return False
        first, last = pattern.later_starts[k], pattern.later_starts[k + 1]
        for p in range(first, last):
            i = pattern.later[p]
            left = blocks[pattern.place[i, body]]
            _multiply_right(left, pivot, scratch)
            for q in range(first, last):
                j = pattern.later[q]
                _subtract_product(blocks[pattern.place[i, j]], left, blocks[pattern.place[body, j]])
    return True


@jit(allocates=False)
def _substitute(system, unknowns):
    """Solve for velocities and internal states, in place in ``system.right`` and ``unknowns``."""
    pattern, blocks, right = system.pattern, system.blocks, system.right
    n = pattern.order.shape[0]
    for s in range(system.pivot.shape[0]):
        for q in range(pattern.state_starts[s], pattern.state_starts[s + 1]):
            to, share = right[pattern.state_bodies[q]], unknowns[pattern.states[s]] / system.pivot[s]
            for k in range(6):
                to[k] -= system.force[q, k] * share
    for k in range(n):
        body = pattern.order[k]
        for p in range(pattern.later_starts[k], pattern.later_starts[k + 1]):
            block, to = blocks[pattern.place[pattern.later[p], body]], right[pattern.later[p]]
            for i in range(6):
                for j in range(6):
                    to[i] -= block[i, j] * right[body, j]
    result = system.scratch[0]
    for k in range(n - 1, -1, -1):
        body = pattern.order[k]
        at = right[body]
        for p in range(pattern.later_starts[k], pattern.later_starts[k + 1]):
            block, known = blocks[pattern.place[body, pattern.later[p]]], right[pattern.later[p]]
            for i in range(6):
                for j in range(6):
                    at[i] -= block[i, j] * known[j]
        block = blocks[pattern.place[body, body]]
        for i in range(6):
            total = 0.0
            for j in range(6):
                total += block[i, j] * at[j]
            result[i] = total
        for i in range(6):
            at[i] = result[i]
    for s in range(system.pivot.shape[0]):
        total = unknowns[pattern.states[s]]
        for q in range(pattern.state_starts[s], pattern.state_starts[s + 1]):
            for k in range(6):
                total -= system.drive[q, k] * right[pattern.state_bodies[q], k]
        unknowns[pattern.states[s]] = total / system.pivot[s]


@jit(allocates=False)
def solve_stage(jacobian, system, sigma, increment):
    """Solve for the increment of a stage, in place: ``increment`` (size,) contains its right-hand side before. Euler
    parameters are transformed to a rotation vector 2 E dp and a length p . dp, and back by 1/2 E^T theta + length p."""
    pattern, right, shift = system.pattern, system.right, system.shift
    n = shift.shape[0]
    unknowns = increment[(STATE_SIZE - 6) * n :]  # by their number
    for b in range(n):
        at, axes, inverse, to = STATE_SIZE * b, jacobian.axes[b], system.inverse[b], shift[b]
        length = 0.0
        for j in range(4):
            length += axes[3, j] * increment[at + EULER + j]
        length /= sigma - jacobian.length[0]
        for i in range(6):
            to[i], right[b, i] = 0.0, increment[at + VELOCITY + i]
        for k in range(3):
            turn = length * jacobian.spin[b, k]
            for j in range(4):
                turn += 2.0 * axes[k, j] * increment[at + EULER + j]
            for i in range(3):
                to[i] += inverse[0, i, k] * increment[at + k]
                to[3 + i] += inverse[1, i, k] * turn
    for node in range(n, right.shape[0]):
        for k in range(6):  # also beyond its width: an earlier stage may have left NaN there
            right[node, k] = unknowns[pattern.first[node] + k] if k < pattern.width[node] else 0.0
            if k < pattern.width[node] and pattern.displaced[node] >= 0:
                unknowns[pattern.displaced[node] + k] /= sigma
    for q in range(pattern.pairs.shape[0]):
        i, j = pattern.pairs[q, 0], pattern.pairs[q, 1]
        if j < n and i < n:
            _add_shift(jacobian, shift, 6 * i, 6, j, right[i])
        elif j < n:
            _add_shift(jacobian, shift, pattern.first[i], pattern.width[i], j, right[i])
        elif pattern.displaced[j] >= 0:
            for k in range(pattern.width[j]):
                column, share = jacobian.by_velocity[pattern.displaced[j] + k], unknowns[pattern.displaced[j] + k]
                for row in range(pattern.width[i]):
                    right[i, row] += share * column[pattern.first[i] + row]
    for s in range(pattern.states.shape[0]):
        state = pattern.states[s]
        for q in range(pattern.state_starts[s], pattern.state_starts[s + 1]):
            _add_shift(jacobian, shift, state, 1, pattern.state_bodies[q], unknowns[state : state + 1])
    _substitute(system, unknowns)
    for node in range(n, right.shape[0]):
        for k in range(pattern.width[node]):
            unknowns[pattern.first[node] + k] = right[node, k]
            if pattern.displaced[node] >= 0:
                unknowns[pattern.displaced[node] + k] += right[node, k] / sigma
    for b in range(n):
        at, axes, turning = STATE_SIZE * b, jacobian.axes[b], jacobian.turning[b]
        carried, to, velocity = system.carried[b], shift[b], right[b]
        length = 0.0
        for j in range(4):
            length += axes[3, j] * increment[at + EULER + j]
        for i in range(6):
            increment[at + VELOCITY + i] = velocity[i]
        for i in range(3):
            increment[at + i] = to[i] + dot(carried[0, i], velocity)
            for j in range(3):
                to[3 + i] += carried[1, i, j] * velocity[3 + j]
        for j in range(3):
            length += turning[3, j] * to[3 + j] + turning[3, 3 + j] * velocity[3 + j]
        for j in range(4):
            increment[at + EULER + j] = axes[3, j] * length / (sigma - jacobian.length[0])
            for i in range(3):
                increment[at + EULER + j] += 0.5 * axes[i, j] * to[3 + i]
