"""Pair tables in memory and on disk: nodes are solved where a run first needs them, and kept.

What a table's numbers depend on (both surfaces, material, friction, strips, creep table, modes, and the sources of all
kernels) is in its file's name; gauge and vehicle are not. A node depends on its place alone, and whether a cell may be
looked up on its nodes and on an exact solution in its middle: a run gives the same numbers on a full table and on an
empty one. Nodes and cells that the examples meet come with the package, for the pair of profiles of most of them.
"""

import atexit
import ctypes
import hashlib
import os
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from threading import Lock, RLock
from weakref import WeakValueDictionary

import numpy as np

from wrcore.contact.patch.model import NODES, NUMBERS, PairTable
from wrcore.contact.rolling.rolling import LEVELS as RESOLUTIONS
from wrcore.errors import InputError
from wrcore.errors.checked_hdf5 import checked_hdf5, new_hdf5
from wrcore.errors.messages import PATIENCE, reached_so_far, say_if_long, tell, warn
from wrcore.kernels.cache import drop_unused, source_digest, table_folder
from wrcore.kernels.interrupts import handed_on, interrupted
from wrcore.wheels.contact_model import without_wheels
from wrcore.wheels.table.cells import (
    BESIDE,
    FINER,
    HARD,
    LEVELS,
    YAW,
    corner_of,
    key_of,
    node_codes,
    steps_of,
)
from wrcore.wheels.table.creep_modes import SHIPPED, creep_modes
from wrcore.wheels.table.solver import CORNERS, UNKNOWN, PairSolver, nodes_at

NONSENSE = 0.1, 0.3, 0.3
WRONG = (3e-3, 7e-3, 0.03), (3e-3, 7e-3, 0.03), (3e-3, 0.01, 0.1), (2e-3, 0.015, 0.2), NONSENSE
COARSE = (0.01, 0.03, 0.2), (0.01, 0.03, 0.2), (0.02, 0.05, 0.3), (0.02, 0.05, 0.3), NONSENSE
"""Errors in the middle of a cell of each lattice, of N, of the creep force over mu N and of p_max, from which on it is
left to the next lattice, and in the end to the solver; and those at the coarse resolution. In flange roots p_max steps
by 5 to 15 % with the number of strips, which no lattice mends. The finest lattice is where a lobe is born: forces bend
there, and steps through solutions would be as small as they can. Only nonsense is refused in it."""

SEAMED = 0.1, 0.2, 0.3
"""The same of what a cell that is left to the next lattice may miss to have a share near its neighbours."""

OFTEN = 30.0
"""How far solving has come is told after so long, s, and whenever that has doubled."""

WRITINGS = 20.0
"""A table is kept again after so many times what that took, and not before `PATIENCE`."""

CELLS, SLOTS = 50_000, 200_003
"""Room for cells that can be looked up, and for all."""

HALF_DISTANCE, RAIL_DISTANCE = 0.75, 0.7605385362746407
"""Distances of tape circle and rail from the middle with which nodes are solved, m: any would do, as a node's numbers
are relative to its rail; these are those of S1002 on UIC60 1:40, gauge 1.435 m."""

WITHOUT = "contact.patch: moment does without"


class Pair(PairSolver):
    """The table of a `ContactModel` with exact patches and one pair of profiles."""

    def __init__(self, contact, digest):
        super().__init__(contact)
        self.path, self._lock = table_folder() / f"pair_{digest}.h5", Lock()
        self._keys, self._states = np.zeros(SLOTS, np.int64), np.zeros(SLOTS, np.int32)
        self._cells, self._misses = np.zeros((CELLS, NODES, NUMBERS), np.float32), np.zeros((CELLS, 4), np.float32)
        self.cells, self.misses, self._known, self._others, self._ready = {}, {}, {}, set(), 0
        self._wrong = COARSE if contact.strips.strips == RESOLUTIONS["coarse"].strips else WRONG
        self._spent, self._next_told, self._next_written = 0.0, OFTEN, time.monotonic() + PATIENCE
        self._reached = str
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

    def _fill(self, key):
        """Solve what a cell needs; kernels call this."""
        with self._lock:
            if key in self.cells or key in self._others or interrupted():
                return
            self._reached = reached_so_far()
            if self._full():
                warn(f"{self.path}: no room for more cells; patches in others are solved")
                return
            with handed_on("patches are solved without a table"):  # or the cell stays as if never met
                own = self._own(key)
                if own not in self.cells:
                    self._keep(own, *self._solved(own))
                if own != key and own in self.cells:
                    self._others.add(key)
                    self._list(key, self.cells[own])
            if time.monotonic() > self._next_written:
                self.write()

    @contextmanager
    def _told(self):
        mu, begin = self.contact.strips.looked_up, time.monotonic()
        text = f"exact contact at a friction of {mu:g} is solved for its table, once ({self.path}); {WITHOUT}"
        with say_if_long(text, self._spent):
            yield
        self._spent += time.monotonic() - begin
        if self._spent > self._next_told:
            self._next_told *= 2.0
            nodes, cells = len(self._solved_at), len(self.cells)
            solved = f"{self.path.name} has {nodes} nodes and {cells} cells after {self._spent:.0f} s of solving"
            tell("; ".join(filter(None, (solved, self._reached()))))

    def _own(self, key):
        """The cell for which a cell stands, whichever of those that stand for each other is asked first: cells of
        neighbouring parts are one."""
        met = [key]
        while (other := self._nearer(met[-1])) not in met:
            met.append(other)
        return min(met[met.index(other) :])

    def _nearer(self, key):
        """The cell of the part of the profile in which a cell's lobe lies, at most of its corners; that part's own
        search may end in a third one."""
        level, part, turn, *first = corner_of(key)
        corners = nodes_at(level % LEVELS, part, 2 * turn + 1, CORNERS + first)
        own = sorted(one % BESIDE for one in self._parts_of(node_codes(corners).tolist()))[4]
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
        wrong = self._wrong[level]
        with ThreadPoolExecutor(1) as beside:  # its middle, while its nodes are solved
            middle, rows = beside.submit(self._middle, key), self._rows_of(key)
            self.misses[key] = miss = UNKNOWN if rows is None else self._miss(key, rows, middle.result())
            if np.less(miss[:3], wrong).all():
                middle = beside.submit(self._middle, key, 0.5)
                if self._add_yaw(key, rows):
                    miss = tuple(np.maximum(miss, self._miss(key, rows, middle.result(), 0.5)))
                    self.misses[key] = miss
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
        self._parts = dict(zip(*parts.T.tolist(), strict=True)) | self._parts

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
        if getattr(self, "_new", 0) and not sys.is_finalizing():  # at exit `_write_all` has written it
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


_PARTS = "nodes", "numbers", "parts", "cells", "misses", "rows"


def with_pair(contact):
    """A contact model of one pair of profiles with the pair's table."""
    return contact._replace(strips=contact.strips._replace(table=pair_of(contact).table()))


_PAIRS, _MAKING = WeakValueDictionary(), RLock()


@atexit.register
def _write_all():
    for pair in list(_PAIRS.values()):
        with pair._lock:
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
    with _MAKING:  # threads share one
        pair = _PAIRS.get(name)
        if pair is None:
            bare = without_wheels(contact, damping=1.0, friction=settings.looked_up)
            pair = _PAIRS[name] = Pair(bare, name)
    return pair


def fingerprint(contact):
    """Numbers that two contact models share, but for rounding, if their nodes are the same."""
    settings = contact.strips
    numbers = [
        *steps_of(LEVELS - 1),
        YAW,
        LEVELS,
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
