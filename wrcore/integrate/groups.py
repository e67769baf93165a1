"""Own states that act on one another, eliminated together: those of the track under a wheelset.

Own states go one by one where each acts on bodies alone. With x the states of a group, v the velocities of the bodies
that it acts on, P the group's own corner of the system, F its columns in the rows of the bodies and D its rows,

    A v + F x = r,   D v + P x = g,   so that   (A - F P^-1 D) v = r - F P^-1 g,   x = P^-1 (g - D v).

:mod:`wrcore.integrate.group_elimination` does so; models without groups do not run it.
"""

from typing import NamedTuple

import numpy as np

from wrcore.integrate.links import own_state_bodies, own_state_groups

FACTORISE, REDUCE, RESTORE = range(3)
"""What the kernel of the elimination is asked for: P^-1, F P^-1 and the blocks A; r; x."""


class Groups(NamedTuple):
    """Groups of own states, for kernels."""

    starts: np.ndarray
    """(g + 1,) int."""
    members: np.ndarray
    """(p,) int: own states of the k-th group, starts[k] <= p."""
    body_starts: np.ndarray
    """(g + 1,) int."""
    bodies: np.ndarray
    """(q,) int: bodies that it acts on, body_starts[k] <= q."""
    corner: np.ndarray
    """(g, m, m): P^-1; m is the size of the largest group."""
    scratch: np.ndarray
    """(m, m)."""
    force: np.ndarray
    """(q, 6, m): F P^-1."""
    drive: np.ndarray
    """(q, m, 6): D."""
    right: np.ndarray
    """(g, m): g."""
    address: np.ndarray
    """(1,) int: of the kernel; 0 without groups."""


def new_groups(model):
    """Plan the groups of a model and allocate their arrays; the kernel's address is left to others."""
    groups, ends = own_state_groups(model), own_state_bodies(model)
    bodies = [sorted(ends[states[0]]) for states in groups]
    largest = max(map(len, groups), default=0)

    def packed(lists):
        starts = np.cumsum([0] + [len(items) for items in lists])
        return starts, np.array([item for items in lists for item in items], np.int64)

    (starts, members), (body_starts, bodies) = packed(groups), packed(bodies)
    g, q, m = len(groups), len(bodies), largest
    return Groups(
        starts, members, body_starts, bodies, np.zeros((g, m, m)), np.zeros((m, m)), np.zeros((q, 6, m)),
        np.zeros((q, m, 6)), np.zeros((g, m)), np.zeros(1, np.int64),
    )  # fmt: skip
