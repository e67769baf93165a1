"""Cells of the lattices of a `PairTable`: which one a lobe lies in, and where one lattice goes over to the next.

A cell is looked up, or left to the next lattice (`FINER`), or to the solver (`HARD`). One that is left to the next goes
over to its neighbours that are not, near to them: what it would give itself has a share there, which falls from 1 to 0
within a `SEAM` with its first derivative. Cells beside each other in yaw go over into each other alike, from both
sides. So no number of a lobe has a step where it passes.
"""

import math
from typing import NamedTuple

import numpy as np

from wrcore.kernels.handles import call_c
from wrcore.kernels.jit import jit

STEPS = 8e-4, 1e-3, 0.25
"""Of the coarsest lattice in the offset (m), slope of the axle and ln D."""

LEVELS = 5
"""Lattices, each with half the steps in offset and slope of the one before, and a third of the yaw. All have one step
in ln D."""

FIRST = -0.1, -0.1, math.log(4e-6)
"""Their first places."""

COUNTS = 250, 200, 19
"""Steps of the coarsest lattice."""

YAW, YAWS = 4e-3, 7
"""Half of a cell of the coarsest lattice in yaw (rad), and how many there are."""

AXES = 4
"""Of a lattice: offset, slope, ln D and yaw."""

BESIDE = 64
"""Added to the part of the wheel's profile in places of lobes with others beside them."""

PART, FIELD = 4e-3, -0.1
"""Width of the parts of the wheel's profile, and where they begin, m."""

EMPTY, FINER, HARD = 0, -1, -2
"""States of a cell that has no corners: not met yet, left to the next lattice, left to the exact solver."""

SEAM = 0.1
"""Share of a cell in which it goes over to a neighbour."""

LEFT = 2 * LEVELS
"""Row of shares with what is left to the finest cell; the next one has what neighbours have."""


@jit(allocates=False, forceinline=True)
def key_of(level, part, turn, i, j, k):
    """One number, not 0, for the cell with this place in yaw and first corner; `corner_of` reads it. With `LEVELS` more
    it means what a cell gives that is left to the next lattice."""
    return (((((level + 1) * 128 + part) * 1024 + turn) * 8192 + i) * 8192 + j) * 32 + k


def corner_of(key):
    """Level, part of the profile, place in yaw and first corner of a cell."""
    found = []
    for count in (32, 8192, 8192, 1024, 128):
        key, rest = divmod(key, count)
        found.append(rest)
    return key - 1, *reversed(found)


def steps_of(level):
    """Steps of a lattice in the offset (m), slope and ln D."""
    return np.array(STEPS) / (2.0**level, 2.0**level, 1.0)


PART_CODE = 2048 * 8192 * 8192 * 32
"""What one part of the profile more adds to one of `node_codes`."""


@jit
def node_codes(nodes):
    """One number for each node (n, 6): level, part of the profile, place in yaw, where it lies in the middle of a cell
    (odd) or at its end, and in the lattice. `node_of` reads it. A node counts as one of the coarsest lattice that has
    it."""
    codes = np.empty(len(nodes), np.int64)
    for n in range(len(nodes)):
        level, part, turn, i, j, k = nodes[n]
        while level > 0 and turn % 3 == i % 2 == j % 2 == 0:
            level, turn, i, j = level - 1, turn // 3, i // 2, j // 2
        codes[n] = (level * 128 + part) * PART_CODE + ((turn * 8192 + i) * 8192 + j) * 32 + k
    return codes


def node_of(code):
    """Level, part of the profile, place in yaw and in the lattice of a node."""
    found = []
    for count in (32, 8192, 8192, 2048, 128):
        code, rest = divmod(code, count)
        found.append(rest)
    return code, *reversed(found)


@jit(allocates=False)
def state_of(keys, states, key):
    """State of a cell, or number of its corners."""
    slot = key % len(keys)
    while keys[slot] != key:
        if keys[slot] == 0:
            return EMPTY
        slot = (slot + 1) % len(keys)
    return states[slot]


@jit(allocates=False)
def _filled(table, key):
    """State of a cell, which is solved if it was not met yet."""
    state = state_of(table.keys, table.states, key)
    if state == EMPTY:
        call_c(table.fill, key)
        state = state_of(table.keys, table.states, key)
    return state


class Place(NamedTuple):
    """Where a lobe lies in a cell."""

    cell: int
    """Number of the cell; 0 if the lobe is to be solved."""
    fx: float
    fy: float
    fz: float
    """Parts of a step of offset, slope and ln D beyond the first corner."""
    gx: float
    gy: float
    gz: float
    """Parts of two steps beyond the first corner of the cell with twice the steps."""
    turn: float
    """Yaw from the cell's middle over half of the cell."""
    scale: float
    """Steps of the coarsest lattice over those of this one, in offset and slope."""
    half: float
    """Half of the cell in yaw, rad."""
    own: float
    """Share that the cell has; coarser ones, near a seam, have the rest."""


NOWHERE = Place(0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, YAW, 1.0)


@jit(allocates=False)
def locate(table, u, beside, t, slope, log_depth, yaw, shares):
    """`Place` of a lobe at u on the wheel's profile with ln D. One that only just touches is looked up at the least
    depth.

    Where its ``own`` share is below 1, other cells are in the first 2 LEVELS rows of ``shares`` (`SHARES`), each with
    its share, what this changes by along the axes, and its `Place`; row `LEFT` has the first of these of the cell."""
    part, scale, own = int((u - FIELD) / PART + 0.5) + (BESIDE if beside else 0), 1.0, 1.0
    for level in range(LEVELS):
        half = YAW / 3.0**level
        x, y = scale * (t - u - FIRST[0]) / STEPS[0], scale * (slope - FIRST[1]) / STEPS[1]
        z, w = max((log_depth - FIRST[2]) / STEPS[2], 1.0), (yaw + YAWS * YAW) / (2.0 * half)
        if not (1.0 <= x < scale * COUNTS[0] and 1.0 <= y < scale * COUNTS[1] and z < COUNTS[2]):
            break
        if not 0.0 <= w < YAWS * YAW / half:
            break
        i, j, k, turn = int(x), int(y), int(z), int(w)
        state = _filled(table, key_of(level, part, turn, i, j, k))
        gx, gy, gz = 0.5 * (x - i + i % 2), 0.5 * (y - j + j % 2), 0.5 * (z - k + k % 2)
        at = Place(state, x - i, y - j, z - k, gx, gy, gz, 2.0 * (w - turn) - 1.0, scale, half, own)
        in_seam = _in_seam(w - turn)
        if state > 0:
            if in_seam:
                own = _share_turned(table, level, part, (turn, i, j, k), at, shares)
            return Place(state, at.fx, at.fy, at.fz, gx, gy, gz, at.turn, scale, half, own)
        if state != FINER:
            break
        if in_seam or _in_seam(at.fx) or _in_seam(at.fy) or _in_seam(at.fz):
            own = _share_coarse(table, level, part, (turn, i, j, k), at, shares)
        scale *= 2.0
    return NOWHERE


@jit(allocates=False, forceinline=True)
def _in_seam(f):
    """Whether a part of a cell is in its `SEAM` with the next one."""
    return f < SEAM or f > 1.0 - SEAM


@jit(allocates=False)
def _reached(table, level, part, turn, i, j, k):
    """Whether a cell is there, and all coarser ones are left to its lattice."""
    if min(i, j) < 2**level or max(i // COUNTS[0], j // COUNTS[1]) >= 2**level or _beyond(level, turn):
        return False
    if not 1 <= k < COUNTS[2]:
        return False
    for coarser in range(level):
        n = level - coarser
        if _filled(table, key_of(coarser, part, turn // 3**n, i >> n, j >> n, k)) != FINER:
            return False
    return True


@jit(allocates=False, forceinline=True)
def _beyond(level, turn):
    """Whether a lattice has no such cell in yaw."""
    return not 0 <= turn < YAWS * 3**level


@jit(allocates=False)
def _begin(at, shares):
    """Nothing has a share yet, if that is so."""
    if at.own == 1.0:
        shares[: LEFT + 1, : 1 + AXES] = 0.0
        shares[LEFT, 0] = 1.0


@jit(allocates=False)
def _put(number, at, turn, share):
    """Write the `Place` in a cell with a ``number`` into its share."""
    share[5], share[6], share[7], share[8], share[9] = number, at.fx, at.fy, at.fz, at.gx
    share[10], share[11], share[12], share[13], share[14] = at.gy, at.gz, turn, at.scale, at.half


@jit(allocates=False, forceinline=True)
def place_of(share):
    """`Place` in a cell that has a share."""
    return Place(
        int(share[5]), share[6], share[7], share[8], share[9], share[10], share[11], share[12], share[13], share[14],
        share[0],
    )  # fmt: skip


@jit(allocates=False)
def _share_turned(table, level, part, cell, at, shares):
    """Near an end in yaw of a ``cell`` (turn, i, j, k) that is looked up: give the one beyond its part of what is left.
    Returns what then is."""
    _begin(at, shares)
    _turn_over(table, level, part, cell, at, shares[LEFT], shares[LEVELS + level])
    return shares[LEFT, 0]


@jit(allocates=False)
def _turn_over(table, level, part, cell, at, own, other):
    """Give the ``other`` cell, beyond an end in yaw, its part of a cell's ``own`` share: a half at the end.

    Both are parabolas in yaw about their own middles and agree there but for what their lattice bends otherwise."""
    turn, i, j, k = cell
    side = -1 if at.turn < 0.0 else 1
    if _beyond(level, turn + side):
        return
    number = _filled(table, key_of(level, part, turn + side, i, j, k))
    if number == FINER:
        number = _filled(table, key_of(LEVELS + level, part, turn + side, i, j, k))
    if number <= 0:
        return
    q = 0.5 - 0.25 * (1.0 - abs(at.turn)) / SEAM
    near, slope = q * q * (3.0 - 2.0 * q), 1.5 * q * (1.0 - q) * side / (at.half * SEAM)
    for axis in range(AXES):
        other[1 + axis] = near * own[1 + axis] + (slope * own[0] if axis == 3 else 0.0)
        own[1 + axis] -= other[1 + axis]
    other[0] = near * own[0]
    own[0] -= other[0]
    _put(number, at, at.turn - 2.0 * side, other)


@jit(allocates=False)
def _share_coarse(table, level, part, cell, at, shares):
    """Near ends of a ``cell`` (turn, i, j, k) that is left to the next lattice: give it its share of what is left.
    Returns what then is.

    A neighbour that is looked up has a function that is 1 on what it has in common with the cell and falls to 0 within
    `SEAM` of it; of several, each takes its part of what the others leave."""
    _begin(at, shares)
    left, ends, share = shares[LEFT], shares[LEFT + 1], shares[level]
    for axis in range(AXES):
        f = at.fx if axis == 0 else at.fy if axis == 1 else at.fz if axis == 2 else 0.5 * (at.turn + 1.0)
        side, q = -1.0 if f < 0.5 else 1.0, 1.0 - min(f, 1.0 - f) / SEAM
        unit = 0.5 / at.half if axis == 3 else (1.0 if axis == 2 else at.scale) / STEPS[axis]
        ends[3 * axis], ends[3 * axis + 1] = side, q * q * (3.0 - 2.0 * q) if q > 0.0 else 0.0
        ends[3 * axis + 2] = 6.0 * q * (1.0 - q) * side * unit / SEAM
    turn, i, j, k = cell
    rest, share[: 1 + AXES] = 1.0, 0.0
    for axes in range(1, 2**AXES):
        near = 1.0
        for axis in range(AXES):
            near *= ends[3 * axis + 1] if axes >> axis & 1 else 1.0
        if near == 0.0:
            continue
        a, b, c = int(ends[0]) * (axes & 1), int(ends[3]) * (axes >> 1 & 1), int(ends[6]) * (axes >> 2 & 1)
        there = turn + int(ends[9]) * (axes >> 3), i + a, j + b, k + c
        if not _reached(table, level, part, *there) or _filled(table, key_of(level, part, *there)) <= 0:
            continue
        for axis in range(AXES):
            more = near / ends[3 * axis + 1] * ends[3 * axis + 2] if axes >> axis & 1 else 0.0
            share[1 + axis] = share[1 + axis] * (1.0 - near) + rest * more
        rest *= 1.0 - near
    number = _filled(table, key_of(LEVELS + level, part, turn, i, j, k)) if rest < 1.0 else 0
    if number <= 0:
        share[: 1 + AXES] = 0.0
        return left[0]
    for axis in range(AXES):
        more = left[0] * share[1 + axis]
        share[1 + axis] = left[1 + axis] * (1.0 - rest) + more
        left[1 + axis] = left[1 + axis] * rest - more
    share[0], left[0] = left[0] * (1.0 - rest), left[0] * rest
    _put(number, at, at.turn, share)
    if _in_seam(0.5 * (at.turn + 1.0)):
        _turn_over(table, level, part, cell, at, share, shares[LEVELS + level])
    return left[0]
