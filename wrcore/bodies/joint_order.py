"""Order in which the joints' multipliers are solved for: found once per model, so that kernels only loop.

Two joints couple in D M^-1 D^T if they hold the same moving body. Joints that are connected by such couplings form a
cluster; clusters do not know of each other. Within a cluster the joints stand in reverse Cuthill-McKee order, which
makes a chain's matrix block tridiagonal, and the matrix is kept as an envelope: each joint's row of tiles from its
first coupled joint to itself. Factorisation creates no entries outside of it.

References
----------
Cuthill, McKee, Proc. 24th ACM National Conference (1969) 157-172; George, Liu, Computer Solution of Large Sparse
Positive Definite Systems (1981), chapter 4 (envelope, reverse order).
"""

from typing import NamedTuple

import numpy as np

from wrcore.bodies.marker import FRAME


class JointOrder(NamedTuple):
    """Structure of D M^-1 D^T, for kernels; joints are counted in the order of the solver."""

    clusters: np.ndarray  # (c, 3) int: first joint, one past the last, equations of its largest joint
    first: np.ndarray  # (n,) int: first joint in each joint's row of the envelope
    base: np.ndarray  # (n,) int: tile (p, q) of the envelope is number base[p] + q
    tiles: int  # number of tiles in all
    first_pair: np.ndarray  # (n + 1,) int: pairs of joint p start here
    pairs: np.ndarray
    """(k, 4) int: for each coupling of p to an earlier joint: that joint, the shared body, its end of p and of q."""
    moving: np.ndarray  # bodies that joints hold


def order_joints(bodies, size):
    """JointOrder of joints, by the two bodies of each (FRAME for the moving frame) and its equations, which describes
    their matrix, and the place of each joint of that order in the lists given."""
    clusters = _clusters([{k for k, other in enumerate(bodies) if _shared(ends, other)} for ends in bodies])
    listed = [joint for cluster in clusters for joint in cluster]
    ends = [bodies[k] for k in listed]
    pairs, first_pair, first = [], [0], []
    for p, mine in enumerate(ends):
        coupled = [
            (q, body, mine.index(body), other.index(body))
            for q, other in enumerate(ends[:p]) for body in _shared(mine, other)
        ]  # fmt: skip
        pairs += coupled
        first_pair.append(len(pairs))
        first.append(min((pair[0] for pair in coupled), default=p))
    first = np.array(first, np.int64)
    lengths = np.arange(len(ends)) - first + 1
    stops = np.cumsum([len(cluster) for cluster in clusters])
    rows = [
        (stop - len(cluster), stop, max(size[k] for k in cluster))
        for cluster, stop in zip(clusters, stops, strict=True)
    ]
    order = JointOrder(
        np.array(rows, np.int64).reshape(-1, 3), first, np.cumsum(lengths) - lengths - first, int(lengths.sum()),
        np.array(first_pair, np.int64), np.array(pairs, np.int64).reshape(-1, 4),
        np.array(sorted({body for pair in bodies for body in pair} - {FRAME}), np.int64),
    )  # fmt: skip
    return order, np.array(listed, np.int64)


def _shared(ends, other):
    """Moving bodies that both joints hold."""
    return [body for body in ends if body != FRAME and body in other]


def _clusters(coupled):
    """Lists of joints, each in reverse Cuthill-McKee order, from the set of joints that each one couples to."""
    left, clusters = list(range(len(coupled))), []
    while left:
        start = min(_reached(left[0], coupled), key=lambda k: len(coupled[k]))
        cluster = _reached(_reached(start, coupled)[-1], coupled)  # from one end of the cluster to the other
        clusters.append(cluster[::-1])
        left = [joint for joint in left if joint not in cluster]
    return clusters


def _reached(start, coupled):
    """Joints in the order in which they are reached from ``start``, those with few couplings first."""
    found = [start]
    for joint in found:
        found += sorted((k for k in coupled[joint] if k not in found), key=lambda k: (len(coupled[k]), k))
    return found
