"""Order in which the nodes of a Rosenbrock step's linear system are eliminated, see `block_elimination`.

The order is that of minimum degree: the node with the fewest remaining neighbours is next.
"""

from typing import NamedTuple

import numpy as np

from wrcore.jacobian.links import (
    internal_state_bodies,
    internal_state_groups,
    packed,
    reached_bodies,
    track_displacements,
)


class Pattern(NamedTuple):
    """Blocks of the matrix, and the order in which nodes are eliminated. A node is a body or up to six internal states;
    bodies have the first numbers. Unknowns are numbered as in the Jacobian's ``by_velocity``."""

    first: np.ndarray  # (m,) int: first unknown of each node
    width: np.ndarray  # (m,) int: number of its unknowns
    displaced: np.ndarray  # (m,) int: first internal state that is the displacement of these velocities; < 0: none
    order: np.ndarray  # (m,) int: nodes in the order of elimination
    place: np.ndarray
    """(m, m) int: number of the block in row i and column j, also for blocks that the elimination creates; -1: none."""
    later_starts: np.ndarray  # (m + 1,) int
    later: np.ndarray  # (p,) int: nodes linked to the k-th node of the order and eliminated later, later_starts[k] <= p
    pairs: np.ndarray  # (q, 2) int: rows and columns of the blocks of the Jacobian
    states: np.ndarray  # (s,) int: internal states that act only on bodies
    state_starts: np.ndarray  # (s + 1,) int
    state_bodies: np.ndarray  # (r,) int: bodies of the k-th of these states, state_starts[k] <= r


def plan_elimination(model):
    """Plan an elimination by minimum degree and return its `Pattern`. The node with the fewest remaining neighbours is
    eliminated next, which links these neighbours."""
    n, reached, linked = len(model.bodies.mass), reached_bodies(model), internal_state_bodies(model)
    displaced = track_displacements(model)
    pairs, nodes = {(i, j) for j in range(n) for i in reached[j]}, [range(6 * b, 6 * b + 6) for b in range(n)]
    together = internal_state_groups(model)
    for states in together:
        packs: list[list[int]] = []
        for state in sorted({*states} - {*displaced.values()}):
            alike = packs and (state in displaced) == (packs[-1][0] in displaced)
            if alike and len(packs[-1]) < 6 and state == packs[-1][-1] + 1:  # consecutive in the state vector
                packs[-1].append(state)
            else:
                packs.append([state])
        ends = [*linked[states[0]], *range(len(nodes), len(nodes) + len(packs))]
        pairs |= {pair for pack in ends[-len(packs) :] for k in ends for pair in ((pack, k), (k, pack))}
        nodes += [[6 * n + state for state in pack] for pack in packs]
    alone = [state for state in range(len(linked)) if not any(state in states for states in together)]
    m, order, later = len(nodes), [], []
    left = {node: set() for node in range(m)}
    for ends in [*pairs, *(linked[state] for state in alone)]:
        for node in ends:
            left[node] |= {*ends} - {node}
    place = np.full((m, m), -1)
    while left:
        node = min(left, key=lambda k: (len(left[k]), k < n, k))
        rest = left.pop(node)
        order.append(node)
        later.append(sorted(rest))
        for other in rest:
            left[other] = (left[other] | rest) - {other, node}
    number = 0
    for node, rest in zip(order, later, strict=True):
        for i, j in [(node, node), *((node, k) for k in rest), *((k, node) for k in rest)]:
            place[i, j] = number
            number += 1

    return Pattern(
        *(np.array(items) for items in zip(*((node[0], len(node)) for node in nodes), strict=True)),
        np.array([6 * n + displaced.get(node[0] - 6 * n, -1 - 6 * n) for node in nodes]), np.array(order), place,
        *packed(later), np.array(sorted(pairs)),
        6 * n + np.array(alone, np.int64), *packed([sorted(linked[state]) for state in alone]),
    )  # fmt: skip
