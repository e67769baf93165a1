"""Lagrange multipliers of Eq. (8): the joints' reactions.

The blocks of D for the two bodies of a joint are [S, R_i] and -[S, R_j] (see bodies/joint.py). With M = diag(m, J)
per body, two joints p and q that hold the same body couple by

    +- (S_p S_q^T / m + R_p J^-1 R_q^T),

minus where it is the first body of the one and the second body of the other. These tiles make up D M^-1 D^T. Its
factors L diag(d) L^T are found cluster by cluster inside the envelope that bodies/joint_order.py describes, so that
the cost of a chain grows with its length, not with its cube. All tiles of a cluster have the size of its largest joint,
a constant to the compiler; a joint with fewer equations has ones on the rest of the diagonal.

A redundant equation shows as a pivot d that vanishes against the diagonal entry it started from. Its multiplier is set
to zero: the accelerations are those of the other equations, which imply the redundant one, and which of the possible
reactions carries the load is a choice. ``ConstraintWork.redundant`` counts such equations.
"""

from typing import NamedTuple

import numpy as np

from wrcore.bodies.inertia import inertia_axes
from wrcore.bodies.joint import MOST_EQUATIONS, NO_TURN, JointState, evaluate_joints, joint_state
from wrcore.bodies.marker import FRAME
from wrcore.bodies.vector import cross, dot, load, minus, store
from wrcore.kernels.jit import FUSED, jit

VANISHED = 1e-10
"""A pivot below this part of its diagonal entry belongs to a redundant equation. Rounding leaves some 1e-16 of it."""


class ConstraintWork(NamedTuple):
    """Scratch arrays for n joints; the last row of arrays over bodies belongs to the moving frame and stays zero."""

    joints: JointState
    multipliers: np.ndarray
    """(n, 5): Lagrange multipliers of the last evaluation, N or N m; the first body feels -[S, R]^T lambda."""
    redundant: np.ndarray  # (1,) int: redundant equations in the last evaluation
    inverse_mass: np.ndarray  # (bodies + 1,), 1/kg
    inverse_inertia: np.ndarray  # (bodies + 1, 3, 3): in track axes, 1/(kg m^2)
    accelerations: np.ndarray  # (bodies + 1, 6): without reactions, m/s^2 and rad/s^2
    mobile: np.ndarray  # (n, 2, 5, 3): R J^-1 of the first and the second body
    tiles: np.ndarray  # (tiles, 5, 5): lower envelope of D M^-1 D^T, then of L
    pivots: np.ndarray  # (n, 5): diagonal of D M^-1 D^T, then 1/d


def constraint_workspace(joints):
    """Allocate the scratch arrays for some joints."""
    n, bodies = len(joints.kind), int(joints.bodies.max(initial=-1)) + 1
    return ConstraintWork(
        joint_state(joints), np.zeros((n, MOST_EQUATIONS)), np.zeros(1, np.int64),
        np.zeros(bodies + 1), np.zeros((bodies + 1, 3, 3)), np.zeros((bodies + 1, 6)),
        np.zeros((n, 2, MOST_EQUATIONS, 3)), np.zeros((joints.order.tiles, MOST_EQUATIONS, MOST_EQUATIONS)),
        np.zeros((n, MOST_EQUATIONS)),
    )  # fmt: skip


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def add_reactions(model, t, state, work):
    """Solve Eq. (8) for the multipliers and add the joint reactions -D^T lambda to the wrenches, which hold all other
    forces; ``work.constraints`` is overwritten."""
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
    """M^-1 of the bodies that joints hold, from the principal axes of all (n, 3, 3)."""
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
    """accelerations = M^-1 wrenches, of the bodies that joints hold."""
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
    """Subtract D^T lambda from the wrenches."""
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
    """Fill one joint's row of tiles of D M^-1 D^T."""
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
    """Lower half of R J^-1 R^T, summed over the two bodies of a joint; R J^-1 is kept in ``mobile``."""
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
    """Add +-(S S^T/m + R J^-1 R^T) of two joints at points. S is the unit matrix there, and R starts with -s~, so that
    g R^T = g x s."""
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
    """Add +-(S S^T/m + R J^-1 R^T) of any two joints."""
    for i in range(size):
        for j in range(size):
            tile[i, j] += push * dot(along[i], other_along[j]) + sign * dot(mobile[i], about[j])


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _factor(order, scratch, p, size):
    """Row of tiles p of L, and its part of 1/d; the rows above are known."""
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
    """Forward and backward substitution in ``multipliers``."""
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
