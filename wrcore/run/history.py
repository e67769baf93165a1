"""History of a session: its output times, the states there, and the inputs that were applied up to them."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from wrcore.run.asked import on_grid
from wrcore.run.inputs import Values

ROUNDING = 1e-9
"""Tolerance of an output time for rounding errors, relative to the distance between two output times."""


class Entry(NamedTuple):
    """One time (s) of a session, with the state there and the inputs that were applied up to it."""

    t: float
    state: np.ndarray
    values: Values
    is_output: bool
    """Whether this is an output time; another time is kept only as long as it is the last time."""


class History:
    """Entries of a session with an output rate (1/s); unless ``is_kept``, only the last one.

    ``entries`` is a linked list (last `Entry`, earlier entries), or None: to save it, a session keeps a reference.
    """

    def __init__(self, rate: float, is_kept: bool) -> None:
        self.rate, self.is_kept = rate, is_kept
        self.entries: Any = None

    @property
    def last(self) -> Entry:
        """Last entry."""
        return self.entries[0]

    def times_between(self, begin: float, end: float) -> np.ndarray:
        """Return the output times to be kept after a time and before another one, s."""
        first = math.floor(begin * self.rate + ROUNDING) + 1
        count = math.ceil(end * self.rate - ROUNDING) - first
        has_any = self.is_kept and self.entries is not None and count > 0
        return np.arange(first, first + count) / self.rate if has_any else np.empty(0)

    def after(self, begin: float, dt: float) -> float:
        """Return the time one step ``dt`` (s) ahead, rounded to a multiple of ``dt`` or a close output time."""
        t = on_grid(begin + dt, dt)
        near = round(t * self.rate) / self.rate
        return near if abs(near - t) <= ROUNDING * min(dt, 1.0 / self.rate) else t

    def is_output(self, t: float) -> bool:
        """Whether a time (s) is an output time up to rounding errors."""
        return abs(t * self.rate - round(t * self.rate)) <= ROUNDING

    def add(self, entry: Entry) -> None:
        """Add an entry; it replaces the last one if that is not an output time."""
        before = self.entries if self.is_kept else None
        if before is not None and before[1] is not None and not before[0].is_output:
            before = before[1]
        self.entries = entry, before

    def begin_with(self, values: Values) -> None:
        """Apply inputs from the beginning on if the session has made no step."""
        first, before = self.entries
        if before is None:
            self.entries = first._replace(values=values), None

    def in_order(self) -> list[Entry]:
        """Return all entries in order of time."""
        found, entries = [], self.entries
        while entries is not None:
            entry, entries = entries
            found.append(entry)
        return found[::-1]


def times_and_states(entries: list[Entry]) -> tuple[np.ndarray, np.ndarray]:
    """Return times (n,), s, and states (n, size) of entries."""
    return np.array([entry.t for entry in entries]), np.array([entry.state for entry in entries])
