"""Numbers of a pair table, solved: those of nodes, the rows that a cell is looked up from, and what these miss."""

import itertools
import math
import os
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from functools import cached_property
from queue import LifoQueue

import numpy as np

from wrcore.contact.patch.model import NODES, NUMBERS, strip_work, with_tables
from wrcore.kernels.handles import Handle
from wrcore.wheels.table import lookup as columns
from wrcore.wheels.table.cells import (
    BESIDE,
    FIELD,
    FIRST,
    LEVELS,
    PART,
    PART_CODE,
    YAW,
    YAWS,
    Place,
    corner_of,
    node_codes,
    node_of,
    steps_of,
)
from wrcore.wheels.table.creep_modes import creep_modes
from wrcore.wheels.table.lookup import NARROW, WIDE
from wrcore.wheels.table.node import AT_REST, SLIPS, lobe_of, solve_place, unlike

LIGHT = 2e-5
"""Errors of a lobe of less depth are beside the load of this one, m: some 6 kN."""

THREADS = min(len(os.sched_getaffinity(0)), 8)
"""Nodes that are solved side by side."""


class PairSolver:
    """Solves what a table of a `ContactModel` with exact patches and one pair of profiles needs, each node once."""

    def __init__(self, contact):
        self.contact, self.modes, self._works = contact, creep_modes(contact.strips.looked_up), LifoQueue()
        self._solved_at, self._parts, self._new = {}, {}, 0

    @cached_property
    def _solvable(self):
        """Handle of the contact with all that a solution takes; there are scratch arrays then, too."""
        for _ in range(THREADS):
            self._works.put([Handle(strip_work(self.contact.strips, 1, SLIPS)) for _ in range(2)])
        return Handle(self.contact._replace(strips=with_tables(self.contact.strips)))

    def _numbers(self, nodes):
        """Numbers (n, NUMBERS) of nodes (n, 6) of one part, see `wrcore.wheels.table.cells.node_codes`, solved side by
        side where they are new; NaN where there is no solution.

        A node is solved under the part of the profile in which its lobe then lies, once for all parts."""
        codes, first = node_codes(nodes), nodes[0, 1]
        keys = (codes + (np.array(self._parts_of(codes.tolist())) - first) * PART_CODE).tolist()
        self._new += self._learn(self._solved_at, self._at, keys)
        return np.array(list(map(self._solved_at.__getitem__, keys)))

    def _parts_of(self, codes):
        """Parts of the profile in which the lobes of nodes lie."""
        self._learn(self._parts, self._part, codes)
        return list(map(self._parts.__getitem__, codes))

    def _learn(self, known, solve, places):
        """Solve for the places that are not ``known`` yet; returns how many these were."""
        new = list(dict.fromkeys(place for place in places if place not in known))
        if new:
            with self._told():
                known |= zip(new, side_by_side(solve, new), strict=True)
        return len(new)

    def _told(self):
        """A context in which it is said that what is done takes long."""
        return nullcontext()

    def _part(self, code):
        """Part of the wheel's profile in which a node's lobe lies, and `BESIDE`."""
        _, works, place = self._solvable, self._works.get(), node_of(code)
        try:
            found = lobe_of(self.contact.geometry, place_of(*place), works[0].value)
        finally:
            self._works.put(works)
        if found is None:
            return place[1]
        return int((found[1] - FIELD) / PART + 0.5) + (BESIDE if found[2] and place[1] >= BESIDE else 0)

    def _rows_of(self, key):
        """Rows (NODES, NUMBERS) that a cell is looked up from, those of yaw still empty; None where one of its corners
        has no solution. In the finest lattice up to four corners without take the mean of the others. Where a node
        beyond has none, a straight line goes on."""
        level, part, turn, *first = corner_of(key)
        where = level % LEVELS, part, 2 * turn + 1
        rows, own = np.zeros((NODES, NUMBERS), np.float32), self._numbers(nodes_at(*where, CORNERS + first))
        lost = np.isnan(own[:, 0])
        if lost.sum() > (4 if level + 1 == LEVELS else 0):
            return None
        if lost.any():
            own[lost] = own[~lost].mean(axis=0)
        beyond = self._numbers(nodes_at(*where, _BEYOND + first))
        alone = np.isnan(beyond[:, 0])
        beyond[alone] = 2.0 * own[_NEAR[alone]] - own[_ACROSS[alone]]
        rows[_OWN_ROWS], rows[_BEYOND_ROWS] = own, beyond
        return rows

    def _add_yaw(self, key, rows):
        """Fill a cell's rows of yaw; those of up to four corners that are not known are the mean of the others. False
        where more are not."""
        level, part, turn, *first = corner_of(key)
        corners = _YAWED + 2 * (np.array(first) // 2)
        found = self._numbers(nodes_at(level % LEVELS, part, 2 * turn + _TURNS, corners))
        left, middle, right = found.reshape(8, 3, NUMBERS).swapaxes(0, 1)
        yawed = rows[32:].reshape(8, 2, NUMBERS)
        yawed[:, 0], yawed[:, 1] = right - left, left + right - 2.0 * middle
        lost = np.isnan(yawed[..., 0]).any(axis=1)
        if 0 < lost.sum() <= 4:
            yawed[lost] = yawed[~lost].mean(axis=0)
        return not np.isnan(rows[:, 0]).any()

    def _at(self, code):
        """Numbers of a node; NaN where there is no solution."""
        return self._at_place(place_of(*node_of(code)))[0]

    def _at_place(self, place):
        """Numbers of contact at a place, NaN where there is no solution, and what modes leave of its creep force."""
        found = self.solve(place, self.modes.points)
        if found is None:
            return np.full(NUMBERS, np.nan, np.float32), math.nan
        numbers, remainder = found
        numbers[columns.MODE :], left = self.modes.fit(numbers, remainder)
        return numbers.astype(np.float32), left

    def solve(self, place, points):
        """`solve_place` with the pair's own scratch arrays."""
        handle, works = self._solvable, self._works.get()
        try:
            return solve_place(self.contact, handle, works, place, points)
        finally:
            self._works.put(works)

    def _middle(self, key, turn=0.0):
        """`_at_place` in the middle of a cell, ``turn`` off in yaw."""
        return self._at_place(_middle_of(key, turn))

    def _miss(self, key, rows, middle, turn=0.0):
        """Errors in the ``middle`` of a cell, ``turn`` off in yaw: of N, over mu N of the creep force and of its slopes
        at rest, and of p_max, see `LIGHT`; and what modes leave of the creep force there, over mu N. Where the middle
        has no solution the finest lattice's is held against a corner."""
        level, _, _, *first = corner_of(key)
        place, found, weights = _middle_of(key, turn), np.zeros(NUMBERS), np.empty(NODES)
        exact, left = middle
        if np.isnan(exact[0]):
            if level + 1 < LEVELS:
                return UNKNOWN
            exact, left = rows[0], 0.0
        exact = exact.astype(float)
        columns.weigh(Place(1, 0.5, 0.5, 0.5, *(0.5 * (0.5 + n % 2) for n in first), turn, 1.0, 1.0, 1.0), weights)
        columns.look_up(rows, weights, found)
        columns.look_modes_up(rows, weights, found)
        light, modes = min(place[2] / LIGHT, 1.0) ** 1.5, self.modes
        points = np.vstack([modes.points, AT_REST])
        creep = unlike(self._solvable, modes.values, exact, found, place[2], place[1], place[3], points)
        slopes = exact[columns.LINEAR] * np.abs(exact - found)[columns.SLOPE_XI : columns.SLOPE_ETA + 1].max()
        normal, peak = (abs(math.expm1(found[k] - exact[k])) for k in (columns.LOG_NORMAL, columns.LOG_PEAK))
        return light * normal, light * max(creep, slopes), light * peak, light * left


UNKNOWN = 4 * (math.nan,)


def _middle_of(key, turn):
    """Place of the middle of a cell, ``turn`` off in yaw."""
    level, part, at, *first = corner_of(key)
    return place_of(level, part, 2 * at + 1 + turn, *(n + 0.5 for n in first))


def _ends():
    """Of the 12 edges of a cell both ends: a row, a place beyond, the near corner and the one across."""
    for n, (a, b) in zip(range(0, 16, 4), itertools.product((0, 1), repeat=2), strict=True):
        for row, axis in ((n + 2, 2), (n + 16, 0), (n + 18, 1)):
            for end in range(2):
                corner = [a, b]
                corner.insert(axis, end)
                beyond = [*corner[:axis], 3 * end - 1, *corner[axis + 1 :]]
                near = 4 * corner[0] + 2 * corner[1] + corner[2]
                yield row + end, beyond, near, near + (1 - 2 * end) * (4, 2, 1)[axis]


CORNERS = np.array(list(itertools.product((0, 1), repeat=3)))
_YAWED, _TURNS = np.repeat(2 * CORNERS, 3, axis=0), np.tile(np.arange(3), 8)
_OWN_ROWS = np.array([4 * (corner // 2) + corner % 2 for corner in range(8)])
_BEYOND_ROWS, _BEYOND, _NEAR, _ACROSS = map(np.array, zip(*_ends(), strict=True))


def nodes_at(level, part, turn, corners):
    """Nodes (n, 6) of corners (n, 3)."""
    nodes = np.empty((len(corners), 6), np.int64)
    nodes[:, 0], nodes[:, 1], nodes[:, 2], nodes[:, 3:] = level, part, turn, corners
    return nodes


def place_of(level, part, turn, i, j, k):
    """Place, as `solve_place` has it, of a node."""
    offset, slope, log_depth = np.array(FIRST) + steps_of(level) * (i, j, k)
    yaw, (beside, part) = YAW * (turn / 3.0**level - YAWS), divmod(part, BESIDE)
    return offset, slope, math.exp(log_depth), yaw, FIELD + part * PART, NARROW if beside else WIDE


def side_by_side(solve, places):
    """What ``solve`` finds at places."""
    if len(places) < 2 or THREADS < 2:
        return [solve(place) for place in places]
    with ThreadPoolExecutor(THREADS) as pool:
        return list(pool.map(solve, places))
