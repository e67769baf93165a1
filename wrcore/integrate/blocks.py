"""The linear system of a Rosenbrock step: 1/(h gamma) - J, body by body.

With sigma = 1/(h gamma), the unknowns of a body are its displacement q and its velocity v, those of a force element
its own state x. The displacements change at the rate of the velocities, q' = Q q + R v with a block of each per body,
and go first: q = (sigma - Q)^-1 (g + R v). The own states go next, one number each. What is left has a block of 6 x 6
for each pair of bodies that elements or joints link; the blocks are eliminated in an order that creates few others
(wheelsets, bogies, car body). All loops are written out, without a linear algebra library: a step is the same to the
bit on every run.
"""

from typing import NamedTuple

import numpy as np

from wrcore.dynamics.body import STATE_SIZE
from wrcore.integrate.groups import FACTORISE, REDUCE, RESTORE, Groups, new_groups
from wrcore.integrate.links import own_state_bodies, own_state_groups, reached_bodies
from wrcore.integrate.moving_axes import RATE
from wrcore.kernels.handles import call_address
from wrcore.kernels.jit import jit


class Pattern(NamedTuple):
    """Which blocks there are, and the order in which bodies are eliminated."""

    order: np.ndarray
    """(n,) int: bodies."""
    place: np.ndarray
    """(n, n) int: number of the block of row i and column j, with those that the elimination creates; -1: none."""
    later_starts: np.ndarray
    """(n + 1,) int."""
    later: np.ndarray
    """(p,) int: bodies linked to the k-th one of the order and eliminated later, later_starts[k] <= p."""
    pairs: np.ndarray
    """(q, 2) int: rows and columns of the Jacobian's own blocks."""
    state_starts: np.ndarray
    """(s + 1,) int."""
    state_bodies: np.ndarray
    """(r,) int: bodies of the k-th element with a state of its own, state_starts[k] <= r."""


class System(NamedTuple):
    """The factorised system."""

    pattern: Pattern
    inverse: np.ndarray
    """(n, 3, 3): (sigma - Q)^-1 of the rotations."""
    carried: np.ndarray
    """(n, 3, 3): (sigma - Q)^-1 R of the rotations."""
    blocks: np.ndarray
    """(b, 6, 6): on the diagonal the inverse, below it L, above it U."""
    pivot: np.ndarray
    """(s,): diagonal entries of the own states."""
    force: np.ndarray
    """(r, 6): column of an own state in the rows of its bodies."""
    drive: np.ndarray
    """(r, 6): row of an own state in the columns of its bodies."""
    right: np.ndarray
    """(n, 6): right-hand side, then velocities."""
    shift: np.ndarray
    """(n, 6): displacements that do not depend on the velocities sought."""
    scratch: np.ndarray
    """(6, 6)."""
    slide: np.ndarray
    """(3,): (sigma - Q)^-1 of the positions in axes that turn: along x and y, across them, along z."""
    groups: Groups
    """Own states that go together, where there are any."""


def plan_elimination(model):
    """Pattern of an elimination by minimum degree: the body with the fewest neighbours left goes next and links
    them."""
    n, reached, own = len(model.bodies.mass), reached_bodies(model), own_state_bodies(model)
    pairs = {(i, j) for j in range(n) for i in reached[j]}
    links = {b: {b} | {k for i, j in pairs if b in (i, j) for k in (i, j)} for b in range(n)}
    for ends in own:
        for body in ends:
            links[body] |= ends
    for state in (state for states in own_state_groups(model) for state in states):
        own[state] = set()
    place, order, later = np.full((n, n), -1), [], []
    left = {b: neighbours - {b} for b, neighbours in links.items()}
    while left:
        body = min(left, key=lambda b: (len(left[b]), b))
        rest = left.pop(body)
        order.append(body)
        later.append(sorted(rest))
        for other in rest:
            left[other] = (left[other] | rest) - {other, body}
    number = 0
    for body, rest in zip(order, later, strict=True):
        for i, j in [(body, body), *((body, k) for k in rest), *((k, body) for k in rest)]:
            place[i, j] = number
            number += 1

    def packed(lists):
        starts = np.cumsum([0] + [len(items) for items in lists])
        return starts, np.array([item for items in lists for item in sorted(items)], np.int64)

    return Pattern(np.array(order, np.int64), place, *packed(later), np.array(sorted(pairs), np.int64), *packed(own))


def new_system(model):
    """Allocate the system of a model."""
    pattern = plan_elimination(model)
    n, entries = len(pattern.order), len(pattern.state_bodies)
    return System(
        pattern, np.zeros((n, 3, 3)), np.zeros((n, 3, 3)), np.zeros((pattern.place.max() + 1, 6, 6)),
        np.zeros(len(pattern.state_starts) - 1), np.zeros((entries, 6)), np.zeros((entries, 6)), np.zeros((n, 6)),
        np.zeros((n, 6)), np.zeros((6, 6)), np.zeros(3), new_groups(model),
    )  # fmt: skip


@jit(allocates=False)
def _invert_rotation(a, out):
    """Inverse of a matrix (3, 3) by its cofactors."""
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
    """Replace a block by its inverse (Gauss and Jordan, pivots by rows); False if it is singular or not finite."""
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
    """block = block @ other."""
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
    """target -= left @ right."""
    for i in range(6):
        for k in range(6):
            factor = left[i, k]
            for j in range(6):
                target[i, j] -= factor * right[k, j]


@jit(allocates=False)
def _carry_rotations(jacobian, system, sigma):
    """Eliminate the lengths of p, then the rotations."""
    for b in range(system.carried.shape[0]):
        turning, inverse, carried = jacobian.turning[b], system.inverse[b], system.carried[b]
        by_length = jacobian.spin[b]
        share = 1.0 / (sigma - jacobian.length[0])
        for i in range(3):
            for j in range(3):
                carried[i, j] = (sigma if i == j else 0.0) - turning[i, j] - share * by_length[i] * turning[3, j]
        _invert_rotation(carried, inverse)
        for i in range(3):
            for j in range(3):
                carried[i, j] = 0.0
                for k in range(3):
                    carried[i, j] += inverse[i, k] * (turning[k, 3 + j] + share * by_length[k] * turning[3, 3 + j])


@jit(allocates=False, inline="always")
def _slid(slide, x, y, z):
    """(sigma - Q)^-1 times a vector, for positions: u' = v - omega x u."""
    return slide[0] * x + slide[1] * y, slide[0] * y - slide[1] * x, slide[2] * z


@jit(allocates=False, inline="always")
def derivative(jacobian, system, row, body, direction):
    """Derivative of a row with respect to a velocity, with what the displacement that it brings about adds."""
    columns, first = jacobian.by_position, 6 * body
    value = jacobian.by_velocity[first + direction, row]
    if direction == 0:
        return value + system.slide[0] * columns[first, row] - system.slide[1] * columns[first + 1, row]
    if direction == 1:
        return value + system.slide[1] * columns[first, row] + system.slide[0] * columns[first + 1, row]
    if direction == 2:
        return value + system.slide[2] * columns[first + 2, row]
    for k in range(3):
        value += columns[first + 3 + k, row] * system.carried[body, k, direction - 3]
    return value


@jit(allocates=False)
def factorise(jacobian, system, sigma):
    """Assemble and factorise the system for sigma = 1/(h gamma); False if it is singular."""
    pattern, blocks = system.pattern, system.blocks
    n = pattern.order.shape[0]
    rate = jacobian.turn[RATE]
    system.slide[0], system.slide[1] = sigma / (sigma * sigma + rate * rate), rate / (sigma * sigma + rate * rate)
    system.slide[2] = 1.0 / sigma
    _carry_rotations(jacobian, system, sigma)
    blocks[:] = 0.0
    for q in range(pattern.pairs.shape[0]):
        i, j = pattern.pairs[q, 0], pattern.pairs[q, 1]
        block = blocks[pattern.place[i, j]]
        for column in range(6):
            for row in range(6):
                block[row, column] = -derivative(jacobian, system, 6 * i + row, j, column)
    for b in range(n):
        block = blocks[pattern.place[b, b]]
        for k in range(6):
            block[k, k] += sigma
    for s in range(system.pivot.shape[0]):
        system.pivot[s] = sigma - jacobian.by_velocity[6 * n + s, 6 * n + s]
        first, last = pattern.state_starts[s], pattern.state_starts[s + 1]
        for q in range(first, last):
            body = pattern.state_bodies[q]
            for k in range(6):
                system.force[q, k] = -jacobian.by_velocity[6 * n + s, 6 * body + k]
                system.drive[q, k] = -derivative(jacobian, system, 6 * n + s, body, k)
        for q in range(first, last):
            for p in range(first, last):
                block = blocks[pattern.place[pattern.state_bodies[q], pattern.state_bodies[p]]]
                for i in range(6):
                    factor = system.force[q, i] / system.pivot[s]
                    for j in range(6):
                        block[i, j] -= factor * system.drive[p, j]
    if system.groups.address[0] != 0:
        call_address(system.groups.address[0], jacobian, system, sigma, system.pivot, FACTORISE)
    return _eliminate(pattern, blocks, system.scratch)


@jit(allocates=False)
def _eliminate(pattern, blocks, scratch):
    for k in range(pattern.order.shape[0]):
        body = pattern.order[k]
        own = blocks[pattern.place[body, body]]
        if not _invert_block(own, scratch):
            return False
        first, last = pattern.later_starts[k], pattern.later_starts[k + 1]
        for p in range(first, last):
            i = pattern.later[p]
            left = blocks[pattern.place[i, body]]
            _multiply_right(left, own, scratch)
            for q in range(first, last):
                j = pattern.later[q]
                _subtract_product(blocks[pattern.place[i, j]], left, blocks[pattern.place[body, j]])
    return True


@jit(allocates=False)
def _solve_velocities(system, own):
    """Solve for velocities (system.right) and the elements' own states (``own``), in place."""
    pattern, blocks, right = system.pattern, system.blocks, system.right
    n = pattern.order.shape[0]
    for s in range(system.pivot.shape[0]):
        for q in range(pattern.state_starts[s], pattern.state_starts[s + 1]):
            to, share = right[pattern.state_bodies[q]], own[s] / system.pivot[s]
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
        total = own[s]
        for q in range(pattern.state_starts[s], pattern.state_starts[s + 1]):
            for k in range(6):
                total -= system.drive[q, k] * right[pattern.state_bodies[q], k]
        own[s] = total / system.pivot[s]


@jit(allocates=False)
def solve_stage(jacobian, system, sigma, increment):
    """Turn the right-hand side of a stage, in the shape of a state, into the stage's increment, in place. Euler
    parameters go as rotation vector 2 E dp and length p . dp, and come back as 1/2 E^T theta + length p."""
    pattern, right, shift = system.pattern, system.right, system.shift
    n = pattern.order.shape[0]
    own = increment[STATE_SIZE * n :]
    for b in range(n):
        at, axes, inverse, to = STATE_SIZE * b, jacobian.axes[b], system.inverse[b], shift[b]
        to[0], to[1], to[2] = _slid(system.slide, increment[at], increment[at + 1], increment[at + 2])
        for i in range(3):
            to[3 + i] = 0.0
            right[b, i], right[b, 3 + i] = increment[at + 7 + i], increment[at + 10 + i]
        length = 0.0
        for j in range(4):
            length += axes[3, j] * increment[at + 3 + j]
        length /= sigma - jacobian.length[0]
        for k in range(3):
            turn = length * jacobian.spin[b, k]
            for j in range(4):
                turn += 2.0 * axes[k, j] * increment[at + 3 + j]
            for i in range(3):
                to[3 + i] += inverse[i, k] * turn
    for q in range(pattern.pairs.shape[0]):
        i, j = pattern.pairs[q, 0], pattern.pairs[q, 1]
        for k in range(6):
            column, share = jacobian.by_position[6 * j + k], shift[j, k]
            for row in range(6):
                right[i, row] += share * column[6 * i + row]
    for s in range(own.shape[0]):
        for q in range(pattern.state_starts[s], pattern.state_starts[s + 1]):
            body = pattern.state_bodies[q]
            for k in range(6):
                own[s] += jacobian.by_position[6 * body + k, 6 * n + s] * shift[body, k]
    groups = system.groups.address[0]
    if groups != 0:
        call_address(groups, jacobian, system, sigma, increment, REDUCE)
    _solve_velocities(system, own)
    if groups != 0:
        call_address(groups, jacobian, system, sigma, increment, RESTORE)
    for b in range(n):
        at, axes, turning = STATE_SIZE * b, jacobian.axes[b], jacobian.turning[b]
        carried, to, velocity = system.carried[b], shift[b], right[b]
        length = 0.0
        for j in range(4):
            length += axes[3, j] * increment[at + 3 + j]
        x, y, z = _slid(system.slide, velocity[0], velocity[1], velocity[2])
        increment[at], increment[at + 1], increment[at + 2] = to[0] + x, to[1] + y, to[2] + z
        for i in range(3):
            increment[at + 7 + i], increment[at + 10 + i] = velocity[i], velocity[3 + i]
            for j in range(3):
                to[3 + i] += carried[i, j] * velocity[3 + j]
        for j in range(3):
            length += turning[3, j] * to[3 + j] + turning[3, 3 + j] * velocity[3 + j]
        for j in range(4):
            increment[at + 3 + j] = axes[3, j] * length / (sigma - jacobian.length[0])
            for i in range(3):
                increment[at + 3 + j] += 0.5 * axes[i, j] * to[3 + i]
