"""Requests to a session: times on a grid, channel values by name and end conditions."""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from wrcore.errors import InputError, short
from wrcore.run.output.run import Run

COMPARED: dict[str, Callable[[float, float], bool]] = {"<": operator.lt, ">": operator.gt}


def on_grid(t: float, dt: float) -> float:
    """Return the integer multiple of ``dt`` that equals a time up to rounding errors, else the time itself."""
    rate = 1.0 / dt
    whole = round(rate)
    rate = whole if whole and abs(rate - whole) <= 1e-9 * whole else rate
    near = round(t * rate) / rate
    return near if abs(near - t) <= 1e-9 * dt else t


class Named(dict[str, float]):
    """Channels by name, passed to a function of the user; derived channels are computed on access."""

    def __init__(self, values: Mapping[str, float], find: Callable[[str], Mapping[str, float]]) -> None:
        super().__init__(values)
        self._find = find

    def __missing__(self, name: str) -> float:
        return self._find(name)[name]

    def get(self, name: str, default: Any = None) -> Any:
        """Return the value of a stored or derived channel, or ``default`` if there is no such channel."""
        try:
            return self[name]
        except InputError:
            return default

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and self.get(name) is not None


def told_by(
    function: Callable[[Mapping[str, float]], bool],
    values: Mapping[str, float],
    find: Callable[[str], Mapping[str, float]],
) -> bool:
    """Whether the condition holds: call the user's function with the channels (:class:`Named`)."""
    found = function(Named(values, find))
    if not isinstance(found, bool | np.bool_):
        raise InputError(
            "session", "end", f"expected a function that returns True or False, it returned {short(found)}"
        )
    return bool(found)


def condition_of(text: str) -> tuple[tuple[str], Callable[[Mapping[str, float]], bool]]:
    """Parse a condition such as ``wheelset.y_m > 0.004``: return names of its channels and the test function."""
    parts = re.fullmatch(r"\s*(\S+)\s*([<>])\s*(\S+)\s*", text)
    try:
        name, sign, bound = parts[1], parts[2], float(parts[3])  # type: ignore[index]
    except (TypeError, ValueError):
        bound = math.nan
    if not math.isfinite(bound):
        expected = f"expected a time, a function, or a channel, < or >, and a finite number, got {short(text)}"
        raise InputError("session", "end", expected)
    return (name,), lambda values: COMPARED[sign](values[name], bound)


def value_of(run: Run, name: str) -> float:
    """Return one number from a run with a single output time, by its column name in a table of a run."""
    group, _, channel = name.partition(".")
    channel, _, patch = channel.partition(".")
    values = run[group][channel][0]
    if np.ndim(values) != bool(patch) or (patch and not patch.isdecimal()) or (patch and int(patch) >= len(values)):
        number = f" with the number of a patch, {group}.{channel}.0 to .{len(values) - 1}" if np.ndim(values) else ""
        raise InputError("session", name, f"expected the name of one number{number}")
    return float(values[int(patch)] if patch else values)
