"""Order in which the multipliers of the joints are solved for, computed once per model.

Two joints couple in D M^-1 D^T if they hold the same moving body. Joints that are connected by such couplings form a
cluster; clusters are independent of each other. Within a cluster the joints are in reverse Cuthill-McKee order, so that
the matrix of a chain is block tridiagonal. The matrix is stored as an envelope: the row of tiles of each joint goes
from its first coupled joint to its diagonal. Factorisation creates no entries outside the envelope.

References
----------
Cuthill, McKee, Proc. 24th ACM National Conference (1969) 157-172; George, Liu, Computer Solution of Large Sparse
Positive Definite Systems (1981), chapter 4 (envelope, reverse order).
"""

from typing import NamedTuple

import numpy as np

from wrcore.bodies.marker import FRAME


class JointOrder(NamedTuple):
    """Structure of the matrix D M^-1 D^T; joints are numbered in the order of the solver."""

    clusters: np.ndarray  # (c, 3) int: first joint, last joint + 1, number of equations of the largest joint
    first: np.ndarray  # (n,) int: first joint q in the row of each joint p of the envelope
    base: np.ndarray  # (n,) int: tile (p, q) of the envelope has the index base[p] + q
    tiles: int  # total number of tiles
    first_pair: np.ndarray  # (n + 1,) int: index of the first row of ``pairs`` of each joint
    pairs: np.ndarray
    """(k, 4) int: couplings of joint p to earlier joints q: q, the shared body, its index (0 or 1) in p and in q."""
    moving: np.ndarray  # bodies that are held by joints


def order_joints(bodies, size):
    """Return the `JointOrder` of joints and, for each joint of this order, its index in the lists given.

    ``bodies`` are the two bodies of each joint (FRAME for the moving frame), ``size`` its number of equations."""
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
    """Return the moving bodies that both joints hold."""
    return [body for body in ends if body != FRAME and body in other]


def _clusters(coupled):
    """Return clusters, lists of joints in reverse Cuthill-McKee order, from the set of joints coupled to each joint."""
    left, clusters = list(range(len(coupled))), []
    while left:
        start = min(_reached(left[0], coupled), key=lambda k: len(coupled[k]))
        cluster = _reached(_reached(start, coupled)[-1], coupled)  # from one end of the cluster to the other
        clusters.append(cluster[::-1])
        left = [joint for joint in left if joint not in cluster]
    return clusters


def _reached(start, coupled):
    """Return the joints of a cluster in breadth-first order from ``start``, neighbours with few couplings first."""
    found = [start]
    for joint in found:
        found += sorted((k for k in coupled[joint] if k not in found), key=lambda k: (len(coupled[k]), k))
    return found
