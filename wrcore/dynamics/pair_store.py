"""Pair tables in memory and on disk: nodes are solved where a run first needs them, and kept.

What a table's numbers depend on (both surfaces and their places, material, friction, strips, creep table, modes, and
the sources of all kernels) is in its file's name. A node depends on its place alone, and whether a cell may be looked
up on its nodes and on an exact solution in its middle: a run gives the same numbers on a full table and on an empty
one.
"""

import atexit
import ctypes
import hashlib
import itertools
import math
import os
import time
from functools import cache
from pathlib import Path
from threading import Lock
from typing import NamedTuple
from weakref import WeakValueDictionary

import numpy as np

from wrcore.contact.patch.model import MODES, NUMBERS, PairTable, strip_work
from wrcore.dynamics import pair_table as columns
from wrcore.dynamics.pair_node import SLIPS, lobe_of, solve_place
from wrcore.dynamics.pair_table import FIELD, FINER, FIRST, HARD, LEVELS, NODES, PART, STEPS, YAW, corner_of
from wrcore.errors import InputError
from wrcore.errors.checked_hdf5 import checked_hdf5, new_hdf5
from wrcore.kernels.cache import drop_unused, source_digest, table_folder, warn
from wrcore.kernels.handles import Handle

SHIPPED = Path(__file__).parent / "tables"
"""Folder of what comes with the package: the modes, made by ``python -m study.patch.creep_modes``."""

WRONG = 3e-3, 0.01
"""Errors in the middle of a cell, of N and over mu N, from which on it is left to the next lattice, and in the end to
the solver."""

CELLS, SLOTS = 20_000, 100_003
"""Room for cells that can be looked up, and for all."""

_PATIENCE = 3.0
"""Solving takes this long before it says so, and files are written this often, s."""

_YAWS = 0.0, YAW, -YAW


class Modes(NamedTuple):
    """Modes of the creep force's remainder, and how their coefficients are found."""

    values: np.ndarray
    """As in `PairTable`."""
    points: np.ndarray
    """(n, 2): creepages over those of saturation at which a node is solved."""
    inverse: np.ndarray
    """(MODES, 3 n): coefficients from the remainder there."""
    weights: np.ndarray
    """(n,): of the modes there."""


@cache
def creep_modes():
    """The package's `Modes`."""
    with checked_hdf5(SHIPPED / "creep_modes.h5", "modes of the creep force") as file:
        return Modes(*(np.ascontiguousarray(file[name][...]) for name in Modes._fields))


class Pair:
    """The table of a `ContactModel` with exact patches and one pair of profiles."""

    def __init__(self, contact, digest):
        self.path, self.contact, self._lock = table_folder() / f"pair_{digest}.h5", contact, Lock()
        self._contact, self._works = Handle(contact), [Handle(strip_work(contact.strips, 1, SLIPS)) for _ in range(2)]
        self._keys, self._states = np.zeros(SLOTS, np.int64), np.zeros(SLOTS, np.int32)
        self._cells = np.zeros((CELLS, NODES, NUMBERS), np.float32)
        self._solved_at, self._parts, self.cells, self._ready, self.misses = {}, {}, {}, 0, {}
        self._told, self._new, self._spent, self._written = False, 0, 0.0, time.monotonic()
        self._call = ctypes.CFUNCTYPE(None, ctypes.c_int64)(self._fill)
        drop_unused(self.path.parent, "pair_*.h5")
        self._read()

    @property
    def __array_interface__(self):
        """The keys: who holds an array of them holds the pair."""
        return self._keys.__array_interface__

    def table(self):
        """`PairTable` for kernels, which keeps the pair alive."""
        address = ctypes.cast(self._call, ctypes.c_void_p).value
        return PairTable(np.asarray(self), self._states, self._cells, creep_modes().values, address)

    def _fill(self, key):
        """Solve what a cell needs; kernels call this."""
        with self._lock:
            if key in self.cells:
                return
            begin = time.monotonic()
            try:
                self._keep(key, *self._solved(key))
            except BaseException as error:  # a kernel cannot hand it on; the cell stays as if never met
                _hand_on(error)
            self._spent += time.monotonic() - begin
            if self._spent > _PATIENCE and not self._told:
                self._told = True
                warn(f"exact contact is solved for its table, once ({self.path})")
            if time.monotonic() - self._written > _PATIENCE:
                self.write()

    def _solved(self, key):
        """State of a cell, 1 where its nodes have solutions and its middle is right, and its rows."""
        rows = self._rows_of(key)
        self.misses[key] = miss = (math.nan, math.nan) if rows is None else self._miss(key, rows)
        if rows is None or not np.less(miss, WRONG).all():
            return HARD if rows is None or corner_of(key)[0] + 1 == LEVELS else FINER, rows
        return 1, rows

    def _keep(self, key, state, rows):
        """Let kernels see a cell; where it has a state above 0, this becomes its number."""
        if 10 * len(self.cells) > 9 * SLOTS or self._ready + 1 == CELLS:
            raise MemoryError(f"no room for more than {len(self.cells)} cells of {self.path.name}")
        if state > 0:
            self._ready += 1
            self._cells[self._ready], state = rows, self._ready
        slot = key % SLOTS
        while self._keys[slot]:
            slot = (slot + 1) % SLOTS
        self._states[slot] = state
        self._keys[slot], self.cells[key] = key, state

    def _numbers(self, node):
        """Numbers (NUMBERS,) of a node: solved under the part of the profile in which its lobe then lies, once for all
        parts; NaN where there is no solution."""
        level, part, *corner = node
        if node not in self._parts:
            found = lobe_of(self.contact.geometry, _place(*node[:-1], _YAWS[node[-1]]), self._works[0].value.rows)
            self._parts[node] = part if found is None else int((found[1] - FIELD) / PART + 0.5)
        key = level, self._parts[node], *corner
        if key not in self._solved_at:
            self._solved_at[key] = self._at(*key[:-1], _YAWS[key[-1]]).astype(np.float32)
            self._new += 1
        return self._solved_at[key]

    def _rows_of(self, key):
        """Rows (NODES, NUMBERS) that a cell is looked up from; None where too few of its nodes have a solution.

        All corners must have one; where one beyond has none, a straight line goes on; what yaw adds where it is not
        known is the mean of the others."""
        level, part, i, j, k = corner_of(key)

        def numbers(a, b, c, yaw=0):
            return self._numbers((level, part, i + a, j + b, k + c, yaw))

        own = np.array([numbers(*corner) for corner in _CORNERS])
        if np.isnan(own[:, 0]).any():
            return None
        own, rows = own.reshape(2, 2, 2, NUMBERS), np.empty((NODES, NUMBERS), np.float32)

        def beyond(near, axis):
            far, out = list(near), list(near)
            far[axis], out[axis] = 1 - near[axis], 3 * near[axis] - 1
            found = numbers(*out)
            return 2.0 * own[near] - own[tuple(far)] if np.isnan(found[0]) else found

        for n, (a, b) in zip(range(0, 16, 4), itertools.product((0, 1), repeat=2), strict=True):
            rows[n : n + 4] = *own[a, b], beyond((a, b, 0), 2), beyond((a, b, 1), 2)
            rows[n + 16 : n + 20] = [beyond((c, a, b), 0) for c in (0, 1)] + [beyond((a, c, b), 1) for c in (0, 1)]
        yawed = rows[32:].reshape(8, 2, NUMBERS)
        for pair, corner in zip(yawed, 2 * np.array(_CORNERS) - (i % 2, j % 2, k % 2), strict=True):
            middle, left, right = (numbers(*map(int, corner), yaw) for yaw in range(3))
            pair[:] = left - right, left + right - 2.0 * middle
        lost = np.isnan(yawed[..., 0]).any(axis=1)
        if lost.sum() <= 4:
            yawed[lost] = yawed[~lost].mean(axis=0)
        return None if np.isnan(rows[:, 0]).any() else rows

    def _at(self, level, part, i, j, k, yaw):
        """Numbers of a place in steps of a lattice; NaN where there is no solution."""
        modes = creep_modes()
        found = self.solve(_place(level, part, i, j, k, yaw), modes.points)
        if found is None:
            return np.full(NUMBERS, np.nan)
        numbers, remainder = found
        remainder -= (1.0 - modes.weights)[:, None] * numbers[columns.FORCE : columns.MODE]
        numbers[columns.MODE : columns.MODE + MODES] = modes.inverse @ remainder.ravel()
        return numbers

    def solve(self, place, points):
        """`solve_place` with the pair's own scratch arrays."""
        return solve_place(self.contact, self._contact, self._works, place, points)

    def _miss(self, key, rows):
        """Errors in the middle of a cell: of N, and of the creep force over mu N at rest and where modes are found."""
        level, part, i, j, k = corner_of(key)
        exact, found, modes = self._at(level, part, i + 0.5, j + 0.5, k + 0.5, 0.0), np.empty(NUMBERS), creep_modes()
        columns.look_up(rows, 0.5, 0.5, 0.5, 0.0, 0.0, 0.0, 0.0, found)
        both = np.stack([exact, found])
        mode, force = both[:, columns.MODE : columns.MODE + MODES], both[:, columns.FORCE : columns.MODE]
        forces = mode @ np.linalg.pinv(modes.inverse).T
        forces = forces.reshape(2, -1, 3) + (1.0 - modes.weights)[:, None] * force[:, None]
        slopes = both[:, columns.SLOPE_XI : columns.SLOPE_ETA + 1]
        creep = np.abs(forces[0] - forces[1])[:, :2].max()
        return abs(math.expm1(found[0] - exact[0])), max(creep, np.abs(slopes[0] - slopes[1]).max())

    def _read(self):
        """Take what the file knows."""
        if self.path.exists():
            try:
                os.utime(self.path)
                with checked_hdf5(self.path, "a pair's table") as file:
                    places, numbers, parts, cells, misses, rows = (file[name][...] for name in _PARTS)
                self._solved_at = dict(zip(map(tuple, places.tolist()), numbers, strict=True)) | self._solved_at
                self._parts = {tuple(node): part for *node, part in parts.tolist()} | self._parts
                for (key, state), miss in zip(cells.tolist(), misses.tolist(), strict=True):
                    if key not in self.cells:
                        self._keep(key, state, rows[state - 1] if state > 0 else None)
                        self.misses[key] = miss
            except (InputError, KeyError, ValueError, IndexError, OSError) as error:
                warn(f"{error}; it is solved anew")

    def __del__(self):
        self.write()

    def write(self):
        """Keep what was solved since it was last kept, beside what others have."""
        if self._new:
            try:
                self._read()
                data = (
                    list(self._solved_at), list(self._solved_at.values()),
                    [(*node, part) for node, part in self._parts.items()], list(self.cells.items()),
                    [self.misses[key] for key in self.cells], self._cells[1 : self._ready + 1],
                )  # fmt: skip
                with new_hdf5(self.path) as file:
                    for name, part in zip(_PARTS, data, strict=True):
                        file[name] = part
                self._new, self._written = 0, time.monotonic()
            except OSError as error:
                warn(f"{self.path}: {error.strerror}; what was solved is not kept")
                self._new = 0


_PARTS = "places", "numbers", "parts", "cells", "misses", "rows"


_CORNERS = list(itertools.product((0, 1), repeat=3))


def _place(level, part, i, j, k, yaw):
    """Place, as `solve_place` has it, of a node."""
    t, slope, log_depth = np.array(FIRST) + 0.5**level * np.array(STEPS) * (i, j, k)
    return t, slope, math.exp(log_depth), yaw, FIELD + part * PART


def _hand_on(error):
    """Say later what went wrong in a call from a kernel: Ctrl-C once more, all else in a line."""
    if isinstance(error, KeyboardInterrupt):
        import _thread

        _thread.interrupt_main()
    else:
        first = str(error).strip().partition("\n")[0]
        _warn_once(f"exact contact: {type(error).__name__}: {first}; patches are solved without a table")


@cache
def _warn_once(text):
    warn(text)


def with_pair(contact):
    """A contact model of one pair of profiles with the pair's table."""
    return contact._replace(strips=contact.strips._replace(table=pair_of(contact).table()))


_PAIRS = WeakValueDictionary()


@atexit.register
def _write_all():
    for pair in list(_PAIRS.values()):
        pair.write()


def pair_of(contact):
    """The `Pair` of a `ContactModel` without geometries of its wheels' own."""
    digest = hashlib.sha256(source_digest().encode())
    parts = contact.geometry, contact.creep.table, creep_modes(), contact.strips.values
    for array in _flat(parts):
        digest.update(np.ascontiguousarray(array).tobytes())
    settings = contact.strips
    digest.update(repr((contact.shear_modulus, contact.poisson_ratio, settings.looked_up, settings.strips,
                        settings.surfaces)).encode())  # fmt: skip
    name = digest.hexdigest()[:16]
    pair = _PAIRS.get(name)
    if pair is None:
        bare = contact._replace(geometries=(), wheels=(), damping=1.0, friction=settings.looked_up)
        pair = _PAIRS[name] = Pair(bare, name)
    return pair


def _flat(parts):
    for part in parts:
        if isinstance(part, tuple):
            yield from _flat(part)
        else:
            yield part
