"""Pair tables in memory and on disk: nodes are solved where a run first needs them, and kept.

What a table's numbers depend on (both surfaces and their places, material, friction, strips, creep table, modes, and
the sources of all kernels) is in its file's name. A node depends on its place alone, and whether a cell may be looked
up on its nodes and on an exact solution in its middle: a run gives the same numbers on a full table and on an empty
one.
"""

import atexit
import ctypes
import hashlib
import math
import time
from functools import cache
from pathlib import Path
from threading import Lock
from typing import NamedTuple
from weakref import WeakValueDictionary

import numpy as np

from wrcore.contact.patch.model import MODES, NUMBERS, PairTable, strip_work
from wrcore.dynamics import pair_table as columns
from wrcore.dynamics.pair_table import COUNTS, EMPTY, FIRST, HARD, READY, STEPS, YAW
from wrcore.errors import InputError
from wrcore.errors.checked_hdf5 import checked_hdf5, new_hdf5
from wrcore.kernels.cache import source_digest, table_folder, warn
from wrcore.kernels.handles import Handle

SHIPPED = Path(__file__).parent / "tables"
"""Folder of what comes with the package: the modes, made by ``python -m study.patch.creep_modes``."""

WRONG_NORMAL, WRONG_FORCE = 3e-3, 0.01
"""Errors in the middle of a cell, of N and over mu N, from which on its patches are solved instead of looked up."""

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
        self.path, self.contact, self._lock, self._tools = table_folder() / f"pair_{digest}.h5", contact, Lock(), None
        self._cells, self._nodes = np.zeros((2, *COUNTS), np.uint8), np.zeros((2, *COUNTS, 3, NUMBERS), np.float32)
        self._known = np.zeros((2, *COUNTS, 3), np.uint8)
        self._told, self._new, self._spent, self._written, self.misses = False, 0, 0.0, time.monotonic(), {}
        self._call = ctypes.CFUNCTYPE(None, *[ctypes.c_int64] * 4)(self._fill)
        self._read()

    @property
    def __array_interface__(self):
        """The cells: who holds an array of them holds the pair."""
        return self._cells.__array_interface__

    def table(self):
        """`PairTable` for kernels, which keeps the pair alive."""
        address = ctypes.cast(self._call, ctypes.c_void_p).value
        return PairTable(np.asarray(self), self._nodes, creep_modes().values, address)

    def _fill(self, *cell):
        """Solve what a cell needs; kernels call this."""
        with self._lock:
            if self._cells[cell] != EMPTY:
                return
            begin = time.monotonic()
            try:
                found = READY if all([self._solve(node) for node in _nodes_of(*cell)]) else HARD
                if found == READY:
                    self.misses[cell] = miss = self._miss(*cell)
                    found = READY if miss[0] < WRONG_NORMAL and miss[1] < WRONG_FORCE else HARD
                self._cells[cell] = found
            except BaseException as error:  # a kernel cannot hand it on; the cell stays EMPTY, as if never met
                _hand_on(error)
            self._spent += time.monotonic() - begin
            if self._spent > _PATIENCE and not self._told:
                self._told = True
                warn(f"exact contact is solved for its table, once ({self.path})")
            if time.monotonic() - self._written > _PATIENCE:
                self.write()

    def _solve(self, node):
        """Solve a node unless that was done; whether it has a solution."""
        if not self._known[node]:
            branch, i, j, k, yaw = node
            numbers = self._at(branch, i, j, k, _YAWS[yaw])
            self._nodes[node], self._known[node], self._new = numbers, 1 + math.isnan(numbers[0]), self._new + 1
        return self._known[node] == 1

    def _at(self, branch, i, j, k, yaw):
        """Numbers of a place in steps of the lattice; NaN where there is no solution."""
        modes, (t, slope, log_depth) = creep_modes(), np.array(FIRST) + np.array(STEPS) * (i, j, k)
        found = self.solve((t, slope, math.exp(log_depth), yaw, bool(branch)), modes.points)
        if found is None:
            return np.full(NUMBERS, np.nan)
        numbers, remainder = found
        remainder -= (1.0 - modes.weights)[:, None] * numbers[columns.FORCE : columns.MODE]
        numbers[columns.MODE : columns.MODE + MODES] = modes.inverse @ remainder.ravel()
        return numbers

    def solve(self, place, points):
        """`solve_place` with the pair's own scratch arrays."""
        from wrcore.dynamics.pair_node import solve_place

        if self._tools is None:
            self._tools = Handle(self.contact), Handle(strip_work(self.contact.strips, 1))
        return solve_place(self.contact, *self._tools, place, points)

    def _miss(self, branch, i, j, k):
        """Errors in the middle of a cell: of N, and of the creep force over mu N at rest and where modes are found."""
        exact, found, modes = self._at(branch, i + 0.5, j + 0.5, k + 0.5, 0.0), np.empty(NUMBERS), creep_modes()
        columns.look_up(self._nodes[branch], i, j, k, 0.5, 0.5, 0.5, 0.0, found)
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
                with checked_hdf5(self.path, "a pair's table") as file:
                    places, cells = file["places"][...], file["cells"][...]
                    numbers, misses = file["numbers"][...], file["misses"][...]
                self._nodes[tuple(places[:, :5].T)], self._known[tuple(places[:, :5].T)] = numbers, places[:, 5]
                self._cells[tuple(cells[:, :4].T)] = cells[:, 4]
                self.misses |= {
                    tuple(map(int, cell[:4])): tuple(miss) for cell, miss in zip(cells, misses, strict=True)
                }
            except (InputError, IndexError) as error:
                warn(f"{error}; it is solved anew")

    def __del__(self):
        self.write()

    def write(self):
        """Keep what was solved since it was last kept, beside what others have."""
        if self._new:
            try:
                self._read()
                places, cells = np.argwhere(self._known), np.argwhere(self._cells)
                with new_hdf5(self.path) as file:
                    file["places"] = np.column_stack([places, self._known[tuple(places.T)]]).astype(np.int16)
                    file["numbers"] = self._nodes[tuple(places.T)]
                    file["cells"] = np.column_stack([cells, self._cells[tuple(cells.T)]]).astype(np.int16)
                    file["misses"] = np.array([self.misses.get(tuple(map(int, c)), (np.nan, np.nan)) for c in cells])
                self._new, self._written = 0, time.monotonic()
            except OSError as error:
                warn(f"{self.path}: {error.strerror}; what was solved is not kept")
                self._new = 0


def _nodes_of(branch, i, j, k):
    """Nodes that a cell is looked up from."""
    for a in range(-1, 3):
        for b in range(-1, 3):
            for c in range(-1, 3):
                yield branch, i + a, j + b, k + c, 0
    for a in (0, 1):
        for b in (0, 1):
            for c in (0, 1):
                for yaw in (1, 2):
                    yield branch, i + a, j + b, k + c, yaw


def _hand_on(error):
    """Say later what went wrong in a call from a kernel: Ctrl-C once more, all else in a line."""
    if isinstance(error, KeyboardInterrupt):
        import _thread

        _thread.interrupt_main()
    else:
        _warn_once(f"exact contact: {error!r}; patches are solved without a table")


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
