"""Pair tables in memory and on disk: nodes are solved where a run first needs them, and kept.

What a table's numbers depend on (both surfaces, material, friction, strips, creep table, modes, and the sources of all
kernels) is in its file's name; gauge and vehicle are not. A node depends on its place alone, and whether a cell may be
looked up on its nodes and on an exact solution in its middle: a run gives the same numbers on a full table and on an
empty one. Nodes and cells that the examples meet come with the package, for the pair of profiles of most of them.
"""

import atexit
import ctypes
import hashlib
import itertools
import math
import os
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from functools import cached_property
from queue import LifoQueue
from threading import Lock
from weakref import WeakValueDictionary

import numpy as np

from wrcore.contact.patch.model import NODES, NUMBERS, PairTable, strip_work, with_tables
from wrcore.dynamics import pair_table as columns
from wrcore.dynamics.creep_modes import SHIPPED, creep_modes
from wrcore.dynamics.pair_cells import (
    BESIDE,
    FIELD,
    FINER,
    FIRST,
    HALVED,
    HARD,
    LEVELS,
    PART,
    PART_CODE,
    THIRDS,
    YAW,
    YAWS,
    Place,
    coarsest,
    corner_of,
    key_of,
    node_code,
    node_of,
    steps_of,
)
from wrcore.dynamics.pair_node import AT_REST, SLIPS, lobe_of, solve_place, unlike
from wrcore.dynamics.pair_table import NARROW, WIDE
from wrcore.dynamics.wheel import alone
from wrcore.errors import InputError
from wrcore.errors.checked_hdf5 import checked_hdf5, new_hdf5
from wrcore.kernels.cache import drop_unused, source_digest, table_folder, warn
from wrcore.kernels.handles import Handle
from wrcore.kernels.told import PATIENCE, handed_on, told_if_long, warn_once

WRONG = (3e-3, 7e-3, 0.03), (3e-3, 7e-3, 0.03), (3e-3, 0.01, 0.03), (2e-3, 0.015, 0.03), (0.1, 0.3, 0.3)
"""Errors in the middle of a cell of each lattice, of N, of the creep force over mu N and of p_max, from which on it is
left to the next lattice, and in the end to the solver. The finest lattice is where a lobe is born: forces bend there,
and steps through solutions would be as small as they can. Only nonsense is refused in it."""

SEAMED = 0.1, 0.2, 0.3
"""The same of what a cell that is left to the next lattice may miss to have a share near its neighbours."""

LIGHT = 2e-5
"""Errors of a lobe of less depth are beside the load of this one, m: some 6 kN."""

WRITINGS = 20.0
"""A table is kept again after so many times what that took, and not before `PATIENCE`."""

THREADS = min(len(os.sched_getaffinity(0)), 8)
"""Nodes that are solved side by side."""

CELLS, SLOTS = 50_000, 200_003
"""Room for cells that can be looked up, and for all."""

HALF_DISTANCE, RAIL_DISTANCE = 0.75, 0.7605385362746407
"""Distances of tape circle and rail from the middle with which nodes are solved, m: any would do, as a node's numbers
are relative to its rail; these are those of S1002 on UIC60 1:40, gauge 1.435 m."""

WITHOUT = "contact.patch: moment does without"


class Pair:
    """The table of a `ContactModel` with exact patches and one pair of profiles."""

    def __init__(self, contact, digest):
        self.path, self.contact, self._lock = table_folder() / f"pair_{digest}.h5", contact, Lock()
        self.modes, self._works = creep_modes(contact.strips.looked_up), LifoQueue()
        self._keys, self._states = np.zeros(SLOTS, np.int64), np.zeros(SLOTS, np.int32)
        self._cells, self._misses = np.zeros((CELLS, NODES, NUMBERS), np.float32), np.zeros((CELLS, 4), np.float32)
        self._solved_at, self._parts, self._known, self.cells, self._ready, self.misses = {}, {}, {}, {}, 0, {}
        self._others = set()
        self._new, self._spent, self._next_written = 0, 0.0, time.monotonic() + PATIENCE
        self._call = ctypes.CFUNCTYPE(None, ctypes.c_int64)(self._fill)
        drop_unused(self.path.parent, "pair_*.h5")
        self._take_shipped()
        self._read()

    @property
    def __array_interface__(self):
        """The keys: who holds an array of them holds the pair."""
        return self._keys.__array_interface__

    def table(self):
        """`PairTable` for kernels, which keeps the pair alive."""
        address = ctypes.cast(self._call, ctypes.c_void_p).value
        return PairTable(np.asarray(self), self._states, self._cells, self._misses, self.modes.values, address)

    @cached_property
    def _solvable(self):
        """Handle of the contact with all that a solution takes; there are scratch arrays then, too."""
        for _ in range(THREADS):
            self._works.put([Handle(strip_work(self.contact.strips, 1, SLIPS)) for _ in range(2)])
        return Handle(self.contact._replace(strips=with_tables(self.contact.strips)))

    def _fill(self, key):
        """Solve what a cell needs; kernels call this."""
        with self._lock:
            if key in self.cells or key in self._others:
                return
            if self._full():
                warn_once(f"{self.path}: no room for more cells; patches in others are solved")
                return
            mu, begin = self.contact.strips.looked_up, time.monotonic()
            text = f"exact contact at a friction of {mu:g} is solved for its table, once ({self.path}); {WITHOUT}"
            told = nullcontext() if key in self._known else told_if_long(text, self._spent)
            with handed_on("patches are solved without a table"), told:  # or the cell stays as if never met
                own = self._own(key)
                if own not in self.cells:
                    self._keep(own, *self._solved(own))
                if own != key and own in self.cells:
                    self._others.add(key)
                    self._list(key, self.cells[own])
            self._spent += time.monotonic() - begin
            if time.monotonic() > self._next_written:
                self.write()

    def _own(self, key):
        """The cell for which a cell stands: that of the part of the profile in which its lobe lies, at most of its
        corners. So cells of neighbouring parts are one."""
        level, part, turn, *first = corner_of(key)
        corners = _nodes(level % LEVELS, part, 2 * turn + 1, _CORNERS + first)
        own = sorted(one % BESIDE for one in self._parts_of(node_code(*coarsest(corners).T).tolist()))[4]
        return key_of(level, own + part // BESIDE * BESIDE, turn, *first)

    def _solved(self, key):
        """State of a cell, 1 where its nodes have solutions and its middle is right, and its rows."""
        if key in self._known:
            self.misses[key], state = self._known[key]
            rows = self._rows_of(key) if state > 0 else None
            if rows is not None:
                self._add_yaw(key, rows)
            return state, rows
        level = corner_of(key)[0]
        if level >= LEVELS:
            return self._left(key)
        rows, wrong = self._rows_of(key), WRONG[level]
        self.misses[key] = miss = _UNKNOWN if rows is None else self._miss(key, rows)
        if np.less(miss[:3], wrong).all() and self._add_yaw(key, rows):
            self.misses[key] = miss = tuple(np.maximum(miss, self._miss(key, rows, 0.5)))
            if np.less(miss[:3], wrong).all():
                return 1, rows
        return HARD if level + 1 == LEVELS else FINER, None

    def _left(self, key):
        """State and rows of what a cell gives that was left to the next lattice, for where it goes over to others."""
        level, *cell = corner_of(key)
        self.misses[key] = miss = self.misses[key_of(level - LEVELS, *cell)]
        rows = self._rows_of(key) if np.less(miss[:3], SEAMED).all() else None
        return (1, rows) if rows is not None and self._add_yaw(key, rows) else (HARD, None)

    def _keep(self, key, state, rows):
        """Let kernels see a cell; where it has a state above 0, this becomes its number."""
        if self._full():  # of a file
            return
        if state > 0:
            self._ready += 1
            self._cells[self._ready], self._misses[self._ready], state = rows, self.misses[key], self._ready
        self.cells[key] = state
        self._list(key, state)

    def _list(self, key, state):
        """Write a cell's state, or number, where kernels look for it."""
        slot = key % SLOTS
        while self._keys[slot]:
            slot = (slot + 1) % SLOTS
        self._states[slot] = state
        self._keys[slot] = key

    def _full(self):
        """Whether no more cells can be kept."""
        return 10 * (len(self.cells) + len(self._others)) > 9 * SLOTS or self._ready + 1 == CELLS

    def _numbers(self, nodes):
        """Numbers (n, NUMBERS) of nodes (n, 6) of one part, see `wrcore.dynamics.pair_cells.node_code`, solved side by
        side where they are new; NaN where there is no solution.

        A node is solved under the part of the profile in which its lobe then lies, once for all parts."""
        first, codes = nodes[0, 1].item(), node_code(*coarsest(nodes).T).tolist()
        parts = self._parts_of(codes)
        keys = [code + (part - first) * PART_CODE for code, part in zip(codes, parts, strict=True)]
        new = [key for key in dict.fromkeys(keys) if key not in self._solved_at]
        self._solved_at |= zip(new, _side_by_side(self._at, new), strict=True)
        self._new += len(new)
        return np.array([self._solved_at[key] for key in keys])

    def _parts_of(self, codes):
        """Parts of the profile in which the lobes of nodes lie."""
        new = [code for code in dict.fromkeys(codes) if code not in self._parts]
        self._parts |= zip(new, _side_by_side(self._part, new), strict=True)
        return [self._parts[code] for code in codes]

    def _part(self, code):
        """Part of the wheel's profile in which a node's lobe lies, and `BESIDE`."""
        _, works, place = self._solvable, self._works.get(), node_of(code)
        try:
            found = lobe_of(self.contact.geometry, _place(*place), works[0].value)
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
        rows, own = np.zeros((NODES, NUMBERS), np.float32), self._numbers(_nodes(*where, _CORNERS + first))
        lost = np.isnan(own[:, 0])
        if lost.sum() > (4 if level + 1 == LEVELS else 0):
            return None
        own[lost] = own[~lost].mean(axis=0)
        beyond = self._numbers(_nodes(*where, _BEYOND + first))
        alone = np.isnan(beyond[:, 0])
        beyond[alone] = 2.0 * own[_NEAR[alone]] - own[_ACROSS[alone]]
        rows[_OWN_ROWS], rows[_BEYOND_ROWS] = own, beyond
        return rows

    def _add_yaw(self, key, rows):
        """Fill a cell's rows of yaw; those of up to four corners that are not known are the mean of the others. False
        where more are not."""
        level, part, turn, *first = corner_of(key)
        corners = np.repeat(2 * (_CORNERS + np.array(first) // 2), 3, axis=0)
        found = self._numbers(_nodes(level % LEVELS, part, 2 * turn + np.tile(np.arange(3), 8), corners))
        left, middle, right = found.reshape(8, 3, NUMBERS).swapaxes(0, 1)
        yawed = rows[32:].reshape(8, 2, NUMBERS)
        yawed[:, 0], yawed[:, 1] = right - left, left + right - 2.0 * middle
        lost = np.isnan(yawed[..., 0]).any(axis=1)
        if lost.sum() <= 4:
            yawed[lost] = yawed[~lost].mean(axis=0)
        return not np.isnan(rows[:, 0]).any()

    def _at(self, code):
        """Numbers of a node; NaN where there is no solution."""
        return self._at_place(_place(*node_of(code)))[0]

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

    def _miss(self, key, rows, turn=0.0):
        """Errors in the middle of a cell, ``turn`` off in yaw: of N, over mu N of the creep force and of its slopes at
        rest, and of p_max, see `LIGHT`; and what modes leave of the creep force there, over mu N. Where the middle has
        no solution the finest lattice's is held against a corner."""
        level, part, at, *first = corner_of(key)
        node = level, part, 2 * at + 1 + turn, *(n + 0.5 for n in first)
        place, found, weights = _place(*node), np.zeros(NUMBERS), np.empty(NODES)
        exact, left = self._at_place(place)
        if np.isnan(exact[0]):
            if level + 1 < LEVELS:
                return _UNKNOWN
            exact, left = rows[0], 0.0
        exact = exact.astype(float)
        columns.weigh(Place(1, 0.5, 0.5, 0.5, *(0.5 * (0.5 + n % 2) for n in first), turn, 1.0, 1.0, 1.0, 1.0), weights)
        columns.look_up(rows, weights, found)
        columns.look_modes_up(rows, weights, found)
        light, modes = min(place[2] / LIGHT, 1.0) ** 1.5, self.modes
        points = np.vstack([modes.points, AT_REST])
        creep = unlike(self._solvable, modes.values, exact, found, place[2], place[1], place[3], points)
        slopes = exact[columns.LINEAR] * np.abs(exact - found)[columns.SLOPE_XI : columns.SLOPE_ETA + 1].max()
        normal, peak = (abs(math.expm1(found[k] - exact[k])) for k in (columns.LOG_NORMAL, columns.LOG_PEAK))
        return light * normal, light * max(creep, slopes), light * peak, light * left

    def _take_shipped(self):
        """Take what comes with the package of this pair, if anything."""
        own = fingerprint(self.contact)
        with checked_hdf5(SHIPPED / "nodes.h5", "nodes that come with the package") as file:
            for known in file.values():
                its = known["fingerprint"][...]
                if own.shape == its.shape and np.allclose(own, its, rtol=1e-9, atol=0.0):
                    *nodes, cells, misses = (known[name][...] for name in _PARTS[:-1])
                    self._take(*nodes)
                    met = zip(cells.tolist(), misses, strict=True)
                    self._known = {key: (miss, state) for (key, state), miss in met}

    def _take(self, codes, numbers, parts):
        """Take nodes."""
        self._solved_at = dict(zip(codes.tolist(), numbers, strict=True)) | self._solved_at
        self._parts = dict(parts.tolist()) | self._parts

    def _read(self):
        """Take what the file knows."""
        if self.path.exists():
            try:
                os.utime(self.path)
                with checked_hdf5(self.path, "a pair's table") as file:
                    *nodes, cells, misses, rows = (file[name][...] for name in _PARTS)
                self._take(*nodes)
                for (key, state), miss in zip(cells.tolist(), misses.tolist(), strict=True):
                    if key not in self.cells:
                        self.misses[key] = miss
                        self._keep(key, state, rows[state - 1] if state > 0 else None)
            except (InputError, KeyError, ValueError, IndexError, OSError) as error:
                warn(f"{error}; it is solved anew")

    def __del__(self):
        self.write()

    def write(self):
        """Keep what was solved since it was last kept, beside what others have."""
        if self._new:
            try:
                begin = time.monotonic()
                self._read()
                data = (
                    list(self._solved_at), list(self._solved_at.values()),
                    list(self._parts.items()), list(self.cells.items()),
                    [self.misses[key] for key in self.cells], self._cells[1 : self._ready + 1],
                )  # fmt: skip
                with new_hdf5(self.path) as file:
                    for name, part in zip(_PARTS, data, strict=True):
                        file[name] = part
                self._new, now = 0, time.monotonic()
                self._next_written = now + max(PATIENCE, WRITINGS * (now - begin))
            except OSError as error:
                warn(f"{self.path}: {error.strerror}; what was solved is not kept")
                self._new = 0


_UNKNOWN = 4 * (math.nan,)

_PARTS = "nodes", "numbers", "parts", "cells", "misses", "rows"


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


_CORNERS = np.array(list(itertools.product((0, 1), repeat=3)))
_OWN_ROWS = np.array([4 * (corner // 2) + corner % 2 for corner in range(8)])
_BEYOND_ROWS, _BEYOND, _NEAR, _ACROSS = map(np.array, zip(*_ends(), strict=True))


def _nodes(level, part, turn, corners):
    """Nodes (n, 6) of corners (n, 3)."""
    nodes = np.empty((len(corners), 6), np.int64)
    nodes[:, 0], nodes[:, 1], nodes[:, 2], nodes[:, 3:] = level, part, turn, corners
    return nodes


def _place(level, part, turn, i, j, k):
    """Place, as `solve_place` has it, of a node."""
    t, slope, log_depth = np.array(FIRST) + steps_of(level) * (i, j, k)
    yaw, (beside, part) = YAW * (turn / 3.0 ** THIRDS[level] - YAWS), divmod(part, BESIDE)
    return t, slope, math.exp(log_depth), yaw, FIELD + part * PART, NARROW if beside else WIDE


def _side_by_side(solve, places):
    """What ``solve`` finds at places."""
    if len(places) < 2 or THREADS < 2:
        return [solve(place) for place in places]
    with ThreadPoolExecutor(THREADS) as pool:
        return list(pool.map(solve, places))


def with_pair(contact):
    """A contact model of one pair of profiles with the pair's table."""
    return contact._replace(strips=contact.strips._replace(table=pair_of(contact).table()))


_PAIRS = WeakValueDictionary()


@atexit.register
def _write_all():
    for pair in list(_PAIRS.values()):
        pair.write()


def pair_of(contact):
    """The `Pair` of a `ContactModel` without geometries of its wheels' own, for any gauge."""
    geometry = contact.geometry._replace(half_distance=HALF_DISTANCE, rail_distance=RAIL_DISTANCE)
    contact = contact._replace(geometry=geometry)
    digest = hashlib.sha256(source_digest().encode())
    parts = contact.geometry, contact.creep.table, creep_modes(contact.strips.looked_up)
    for array in _flat(parts):
        digest.update(np.ascontiguousarray(array).tobytes())
    settings = contact.strips
    digest.update(repr((contact.shear_modulus, contact.poisson_ratio, settings.looked_up, settings.strips,
                        settings.surfaces)).encode())  # fmt: skip
    name = digest.hexdigest()[:16]
    pair = _PAIRS.get(name)
    if pair is None:
        bare = alone(contact, damping=1.0, friction=settings.looked_up)
        pair = _PAIRS[name] = Pair(bare, name)
    return pair


def fingerprint(contact):
    """Numbers that two contact models share, but for rounding, if their nodes are the same."""
    settings = contact.strips
    numbers = [
        *steps_of(LEVELS - 1),
        *HALVED,
        *THIRDS,
        NUMBERS,
        contact.friction,
        contact.shear_modulus,
        contact.poisson_ratio,
        settings.strips,
        settings.surfaces,
    ]
    for part in _flat((contact.geometry, contact.creep.table, creep_modes(contact.strips.looked_up))):
        size = np.abs(np.asarray(part, float)).ravel()
        numbers += [len(size), size.sum(), size @ (2.0 + np.cos(np.arange(len(size))))]
    return np.array(numbers)


def _flat(parts):
    for part in parts:
        if isinstance(part, tuple):
            yield from _flat(part)
        else:
            yield part
