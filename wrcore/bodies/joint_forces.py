"""Reaction forces of joints: solution of Eq. (8) for the Lagrange multipliers.

The blocks of D for the two bodies of a joint are [S, R_i] and -[S, R_j] (see bodies/joint.py). With M = diag(m, J)
per body, two joints p and q that hold the same body couple by

    +- (S_p S_q^T / m + R_p J^-1 R_q^T),

with the minus sign if the body is the first one of p and the second one of q, or the reverse. These tiles are the
blocks of D M^-1 D^T. This matrix is factored as L diag(d) L^T, cluster by cluster, inside the envelope that
bodies/joint_order.py describes. The cost of a chain is proportional to its length. All tiles of a cluster have the size
of its largest joint, a constant to the compiler; unused rows of smaller joints have ones on the diagonal.

An equation is redundant if its pivot d vanishes relative to the initial diagonal entry. Its multiplier is set to zero.
The accelerations are still unique, because the other equations imply the redundant one; the distribution of the load
over the reactions is not. ``ConstraintWork.redundant`` counts such equations.
"""

from typing import NamedTuple

import numpy as np

from wrcore.bodies.inertia import inertia_axes
from wrcore.bodies.joint import MOST_EQUATIONS, NO_TURN, JointState, evaluate_joints, joint_state
from wrcore.bodies.marker import FRAME
from wrcore.bodies.vector import cross, dot, load, minus, store
from wrcore.kernels.jit import FUSED, jit

VANISHED = 1e-10
"""Ratio of pivot to diagonal entry below which an equation is redundant; rounding leaves about 1e-16."""


class ConstraintWork(NamedTuple):
    """Work arrays for n joints. In arrays over bodies the last row is for the moving frame and is always zero."""

    joints: JointState
    multipliers: np.ndarray
    """(n, 5): Lagrange multipliers of the last evaluation, N or N m; -[S, R]^T lambda acts on the first body."""
    redundant: np.ndarray  # (1,) int: number of redundant equations in the last evaluation
    inverse_mass: np.ndarray  # (bodies + 1,), 1/kg
    inverse_inertia: np.ndarray  # (bodies + 1, 3, 3): in track axes, 1/(kg m^2)
    accelerations: np.ndarray  # (bodies + 1, 6): without reactions, m/s^2 and rad/s^2
    mobile: np.ndarray  # (n, 2, 5, 3): R J^-1 of the first and the second body
    tiles: np.ndarray  # (tiles, 5, 5): lower envelope of D M^-1 D^T, then of L
    pivots: np.ndarray  # (n, 5): diagonal of D M^-1 D^T, then 1/d


def constraint_workspace(joints):
    """Allocate the work arrays of the solver for these joints."""
    n, bodies = len(joints.kind), int(joints.bodies.max(initial=-1)) + 1
    return ConstraintWork(
        joint_state(joints), np.zeros((n, MOST_EQUATIONS)), np.zeros(1, np.int64),
        np.zeros(bodies + 1), np.zeros((bodies + 1, 3, 3)), np.zeros((bodies + 1, 6)),
        np.zeros((n, 2, MOST_EQUATIONS, 3)), np.zeros((joints.order.tiles, MOST_EQUATIONS, MOST_EQUATIONS)),
        np.zeros((n, MOST_EQUATIONS)),
    )  # fmt: skip


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def add_reactions(model, t, state, work):
    """Solve Eq. (8) for the multipliers and add the joint reactions -D^T lambda to ``work.wrenches``.

    The wrenches must already contain all other forces; ``work.constraints`` is overwritten."""
    joints, scratch = model.joints, work.constraints
    values, accelerations, right = scratch.joints, scratch.accelerations, scratch.multipliers
    evaluate_joints(joints, t, model.speed, state, work.rotations, values)
    invert_masses(model.bodies, joints, inertia_axes(model.bodies, work), scratch)
    apply_inverse_masses(joints, scratch, work.wrenches)
    damping, stiffness = 2.0 * model.alpha, model.beta * model.beta
    for p in range(joints.kind.shape[0]):
        a, b = accelerations[joints.bodies[p, 0]], accelerations[joints.bodies[p, 1]]
        between, first, second = minus(load(a, 0), load(b, 0)), load(a, 3), load(b, 3)
        along, about, other = values.along[p], values.about[p, 0], values.about[p, 1]
        for row in range(MOST_EQUATIONS):
            feedback = damping * values.rate[p, row] + stiffness * values.phi[p, row]
            free = dot(along[row], between) + dot(about[row], first) - dot(other[row], second)
            right[p, row] = free + feedback - values.gamma[p, row]
    solve_multipliers(joints, scratch)
    subtract_reactions(joints, scratch, work.wrenches)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def invert_masses(bodies, joints, axes, scratch):
    """Fill inverse masses and inverse inertia tensors of the jointed bodies, from the principal ``axes`` (n, 3, 3)."""
    for b in joints.order.moving:
        scratch.inverse_mass[b] = 1.0 / bodies.mass[b]
        a, out = axes[b], scratch.inverse_inertia[b]
        x, y, z = 1.0 / bodies.inertia[b, 0], 1.0 / bodies.inertia[b, 1], 1.0 / bodies.inertia[b, 2]
        for i in range(3):
            for j in range(i + 1):
                out[i, j] = x * a[i, 0] * a[j, 0] + y * a[i, 1] * a[j, 1] + z * a[i, 2] * a[j, 2]
                out[j, i] = out[i, j]


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def apply_inverse_masses(joints, scratch, wrenches):
    """Fill the accelerations M^-1 ``wrenches`` of the jointed bodies without reactions."""
    for b in joints.order.moving:
        out, moment = scratch.accelerations[b], load(wrenches[b], 3)
        for i in range(3):
            out[i] = scratch.inverse_mass[b] * wrenches[b, i]
            out[3 + i] = dot(scratch.inverse_inertia[b, i], moment)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def solve_multipliers(joints, scratch):
    """Replace the right-hand side in ``multipliers`` by the solution of (D M^-1 D^T) lambda = right-hand side."""
    scratch.redundant[0] = 0
    clusters = joints.order.clusters
    for c in range(clusters.shape[0]):
        start, stop, size = clusters[c, 0], clusters[c, 1], clusters[c, 2]
        if size == 1:
            _solve_cluster(joints, scratch, start, stop, 1)
        elif size == 3:
            _solve_cluster(joints, scratch, start, stop, 3)
        else:
            _solve_cluster(joints, scratch, start, stop, 5)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def subtract_reactions(joints, scratch, wrenches):
    """Subtract the generalised forces D^T lambda of the joints from the wrenches."""
    values, multipliers = scratch.joints, scratch.multipliers
    for p in range(joints.kind.shape[0]):
        i, j = joints.bodies[p, 0], joints.bodies[p, 1]
        for k in range(3):
            force = first = second = 0.0
            for row in range(MOST_EQUATIONS):
                force += multipliers[p, row] * values.along[p, row, k]
                first += multipliers[p, row] * values.about[p, 0, row, k]
                second += multipliers[p, row] * values.about[p, 1, row, k]
            wrenches[i, k] -= force
            wrenches[i, 3 + k] -= first
            if j != FRAME:
                wrenches[j, k] += force
                wrenches[j, 3 + k] += second


@jit(allocates=False, forceinline=True)
def _solve_cluster(joints, scratch, start, stop, size):
    for p in range(start, stop):
        _assemble(joints, scratch, p, size)
    for p in range(start, stop):
        _factor(joints.order, scratch, p, size)
    _substitute(joints.order, scratch, start, stop, size)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _assemble(joints, scratch, p, size):
    """Fill the row of tiles of D M^-1 D^T that belongs to joint p."""
    order, values, base = joints.order, scratch.joints, joints.order.base[p]
    i, j = joints.bodies[p, 0], joints.bodies[p, 1]
    tile, push = scratch.tiles[base + p], scratch.inverse_mass[i] + scratch.inverse_mass[j]
    _diagonal_tile(
        values.about[p, 0], scratch.inverse_inertia[i], scratch.mobile[p, 0],
        values.about[p, 1], scratch.inverse_inertia[j], scratch.mobile[p, 1], tile, size,
    )  # fmt: skip
    if joints.kind[p] != NO_TURN:
        for i in range(min(joints.size[p], 3)):  # the rows of S are unit vectors, perpendicular to each other
            tile[i, i] += push
    for i in range(joints.size[p], size):
        tile[i, i] = 1.0
    for i in range(size):
        scratch.pivots[p, i] = tile[i, i]
    for q in range(order.first[p], p):
        tile = scratch.tiles[base + q]
        for i in range(size):
            for j in range(size):
                tile[i, j] = 0.0
    for pair in range(order.first_pair[p], order.first_pair[p + 1]):
        row = order.pairs[pair]
        q, body, mine, other = row[0], row[1], row[2], row[3]
        sign = 1.0 if mine == other else -1.0
        tile, mobile, about = scratch.tiles[base + q], scratch.mobile[p, mine], values.about[q, other]
        push = sign * scratch.inverse_mass[body]
        if min(joints.size[p], joints.size[q]) >= 3:
            _couple_points(mobile, about, sign, push, tile, size)
        else:
            _couple(mobile, about, values.along[p], values.along[q], sign, push, tile, size)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _diagonal_tile(about, inertia, mobile, other_about, other_inertia, other_mobile, tile, size):
    """Fill the lower half of R J^-1 R^T, summed over the two bodies of a joint, and store R J^-1 in ``mobile``."""
    x, y, z = load(inertia[0], 0), load(inertia[1], 0), load(inertia[2], 0)
    u, v, w = load(other_inertia[0], 0), load(other_inertia[1], 0), load(other_inertia[2], 0)
    for i in range(size):
        r, s = load(about[i], 0), load(other_about[i], 0)
        g, h = (dot(r, x), dot(r, y), dot(r, z)), (dot(s, u), dot(s, v), dot(s, w))
        store(g, mobile[i])
        store(h, other_mobile[i])
        for j in range(i + 1):
            tile[i, j] = dot(g, about[j]) + dot(h, other_about[j])


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _couple_points(mobile, about, sign, push, tile, size):
    """Add the coupling +-(S S^T/m + R J^-1 R^T) of two spherical or revolute joints to a tile.

    The first three rows of these joints have S = I and R = -s~, so that g R^T = g x s."""
    arm = (about[1, 2], about[2, 0], about[0, 1])
    for i in range(size):
        g = (sign * mobile[i, 0], sign * mobile[i, 1], sign * mobile[i, 2])
        moment = cross(g, arm)
        for j in range(3):
            tile[i, j] += moment[j]
        for j in range(3, size):
            tile[i, j] += dot(g, about[j])
    for i in range(3):
        tile[i, i] += push


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _couple(mobile, about, along, other_along, sign, push, tile, size):
    """Add the coupling +-(S S^T/m + R J^-1 R^T) of any two joints to a tile."""
    for i in range(size):
        for j in range(size):
            tile[i, j] += push * dot(along[i], other_along[j]) + sign * dot(mobile[i], about[j])


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _factor(order, scratch, p, size):
    """Factor the row of tiles p: compute this row of L and its pivots 1/d from the rows above."""
    tiles, pivots = scratch.tiles, scratch.pivots
    base, first = order.base[p], order.first[p]
    corner = tiles[base + p]
    for q in range(first, p):  # L diag(d)
        tile, diagonal = tiles[base + q], tiles[order.base[q] + q]
        for r in range(max(first, order.first[q]), q):
            left, right = tiles[base + r], tiles[order.base[q] + r]
            for i in range(size):
                for j in range(size):
                    total = tile[i, j]
                    for k in range(size):
                        total -= left[i, k] * right[j, k]
                    tile[i, j] = total
        for i in range(size):
            for j in range(size):
                total = tile[i, j]
                for k in range(j):
                    total -= tile[i, k] * diagonal[j, k]
                tile[i, j] = total
    for q in range(first, p):
        tile, inverse = tiles[base + q], pivots[q]
        for i in range(size):
            for j in range(i, size):
                total = corner[j, i]
                for k in range(size):
                    total -= tile[j, k] * (tile[i, k] * inverse[k])
                corner[j, i] = total
            for k in range(size):
                tile[i, k] *= inverse[k]
    for i in range(size):
        for j in range(i):
            total = corner[i, j]
            for k in range(j):
                total -= corner[i, k] * corner[j, k]
            corner[i, j] = total
        pivot = corner[i, i]
        for k in range(i):
            scaled = corner[i, k] * pivots[p, k]
            pivot -= corner[i, k] * scaled
            corner[i, k] = scaled
        if pivot <= VANISHED * pivots[p, i]:
            pivots[p, i] = 0.0
            scratch.redundant[0] += 1
        else:
            pivots[p, i] = 1.0 / pivot


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _substitute(order, scratch, start, stop, size):
    """Solve for the multipliers of a cluster by forward and backward substitution, in place."""
    tiles, x = scratch.tiles, scratch.multipliers
    for p in range(start, stop):
        tile, base = tiles[order.base[p] + p], order.base[p]
        for q in range(order.first[p], p):
            left = tiles[base + q]
            for i in range(size):
                total = x[p, i]
                for k in range(size):
                    total -= left[i, k] * x[q, k]
                x[p, i] = total
        for i in range(size):
            total = x[p, i]
            for k in range(i):
                total -= tile[i, k] * x[p, k]
            x[p, i] = total
    for p in range(start, stop):
        for i in range(size):
            x[p, i] *= scratch.pivots[p, i]
    for p in range(stop - 1, start - 1, -1):
        tile, base = tiles[order.base[p] + p], order.base[p]
        for i in range(size - 1, -1, -1):
            total = x[p, i]
            for k in range(i + 1, size):
                total -= tile[k, i] * x[p, k]
            x[p, i] = total
        for q in range(order.first[p], p):
            left = tiles[base + q]
            for k in range(size):
                total = x[q, k]
                for i in range(size):
                    total -= left[i, k] * x[p, i]
                x[q, k] = total
