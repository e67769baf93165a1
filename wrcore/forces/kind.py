"""What a kind of force element says of itself: its keys, what it is made of, its laws, and how it is drawn."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

ZERO = (0.0, 0.0, 0.0)
MOST = 1e15
"""Largest number of a key: far beyond anything that rolls."""


@dataclass(frozen=True)
class Kind:
    """A kind of force element; the first line of its module says what it does."""

    keys: Mapping[str, dict]
    """JSON schema of each key beside name, kind and bodies, with its unit as "in UNIT" in the description."""
    needed: tuple[str, ...]
    """Keys that it cannot do without."""
    mark: Mapping[str, str]
    """Its look in pictures, as matplotlib has it; markers tell kinds apart in grey."""
    parts: Callable[..., list]
    """The `Spring`, `Turning` and `Along` that an element (dict) is made of; with ``first_load`` also of the load."""
    check: Callable[[dict], Iterator[tuple[str, str]]] = lambda item: iter(())
    """Keys and what was expected of them, for what its schema cannot say; an empty key stands for the element."""
    laws: tuple = ()
    """Kernels of its parts along one direction, see `wrcore.forces.law`."""
    first_load: Callable[[dict], float] | None = None
    """Vertical load (N) with which the search for the one begins that it carries, if its parts depend on it."""

    @cached_property
    def schema(self) -> dict:
        """JSON schema of its keys."""
        return {"properties": self.keys}


class Spring(NamedTuple):
    """Spring and damper along the three axes of the second body, at the first of its ``ends`` (2, 3); a ``preload`` (N)
    of None is found, along z."""

    ends: np.ndarray
    stiffness: Any = ZERO
    damping: Any = ZERO
    preload: Any = None


class Turning(NamedTuple):
    """Spring and damper against relative rotation about the three axes of the second body. At a wheelset, values of the
    element's ``keys`` for pitch are errors, and its place is on the axle, but for what may be ``anywhere``."""

    ends: np.ndarray
    stiffness: Any = ZERO
    damping: Any = ZERO
    cubic: Any = ZERO
    keys: tuple[str, ...] = ()
    anywhere: bool = False


class Along(NamedTuple):
    """What acts along one direction by a law: a unit vector in the second body's axes, or the line between the ends."""

    ends: np.ndarray
    law: Any
    """A kernel, or an `wrcore.kernels.own.Own` function."""
    axis: np.ndarray | None
    numbers: Any = ()
    """At most six for the law (any number for one of the user's own), or a function that returns them, of the force
    that presses in nominal position (N)."""
    points: np.ndarray | None = None
    """(q, 2): polygon of force over displacement or speed, or the inverse of it."""
    inner: int = 0
    """Number of internal states: at most one, but for a law of the user's own."""
    slope: float = 0.0
    """Stiffness with which it may carry weight, N/m."""
    preload: float = 0.0
    """Force on the first body along the axis in nominal position, N, for statics; the law has it among its numbers."""
    presses: float | None = None
    """The same of what may press friction, which has no internal state."""
    normal: str | None = None
    """Name of the element that presses on it."""
    odd: bool = True
    """Whether its law, but for ``points``, is the same seen from either body."""


def ends_of(item):
    """Points (2, 3) at which an element acts on its first and its second body, m."""
    at = np.array(item.get("at", ZERO), float).reshape(-1, 3)
    return at[[0, -1]]


def middle_of(item):
    """The point half-way between the ends of an element, twice."""
    here, there = ends_of(item)
    return np.array([0.5 * (here + there)] * 2)


def axis_of(item):
    """Unit vector of an element's ``direction``; None for a line."""
    return None if item["direction"] == "line" else np.eye(3)["xyz".index(item["direction"])]


def polygon(x, force):
    """Points (q, 2) of a characteristic; from (0, 0) on it is continued as an odd function."""
    points = np.column_stack([x, force]).astype(float)
    return points if np.any(points[0]) else np.vstack([-points[:0:-1], points])


def number(description, least=0.0, most=MOST, **more):
    """Schema of a key that holds one number; ``description`` names other bounds than 0 and `MOST`."""
    said = f"{description}, not negative" if (least, most) == (0.0, MOST) else description
    return {"type": "number", "minimum": least, "maximum": most, "description": said, **more}


def three(description, least=0.0, axes="[x, y, z]"):
    """Schema of a key that holds a number for each axis of the second body."""
    inner = {"type": "number", "minimum": least, "maximum": MOST}
    return {"type": "array", "minItems": 3, "maxItems": 3, "items": inner,
            "description": f"three numbers {axes}{'' if least else ', none negative'}: {description}"}  # fmt: skip


def about(description):
    """Schema of a key that holds a number for each rotation."""
    return three(description, axes="[roll, pitch, yaw]")


_POINT = {"type": "array", "minItems": 3, "maxItems": 3, "items": {"type": "number", "minimum": -1e5, "maximum": 1e5}}

AT = {
    "description": "a point [x, y, z] in m, or two: the element's ends at its first and its second body",
    "anyOf": [_POINT, {"type": "array", "minItems": 2, "maxItems": 2, "items": _POINT}],
}
DIRECTION = {
    "enum": ["x", "y", "z", "line"],
    "description": "'x', 'y' or 'z' of the second body, or 'line' between the two ends",
}


PARAMETERS = {
    "type": "array", "maxItems": 1000, "items": {"type": "number", "minimum": -MOST, "maximum": MOST},
    "description": "a list of numbers that the law gets", "x-unit": "that of the law",
}  # fmt: skip


def curve(abscissa, unit):
    """Schema of a key that holds a characteristic."""
    numbers = {"type": "array", "minItems": 2, "maxItems": 1000,
               "items": {"type": "number", "minimum": -MOST, "maximum": MOST}}  # fmt: skip
    return {
        "type": "object", "additionalProperties": False, "required": [abscissa, "force"],
        "description": f"the lists {abscissa} (in {unit}) and force (in N), rising; from (0, 0) on continued as an odd "
        "function, beyond the last point with the last slope",
        "properties": {abscissa: {**numbers, "description": f"values in {unit}, rising"},
                       "force": {**numbers, "description": "forces in N, not falling"}},
    }  # fmt: skip


def faults_of(item, abscissa):
    """What is wrong with an element's characteristic."""
    if "characteristic" not in item:
        return
    x, force = (np.array(item["characteristic"][key], float) for key in (abscissa, "force"))
    if x.size != force.size:
        yield "characteristic", f"expected as many forces as values of {abscissa}, got {force.size} and {x.size}"
    if np.any(np.diff(x) <= 0.0):
        yield f"characteristic.{abscissa}", "expected strictly rising values"
    if np.any(np.diff(force) < 0.0):
        yield "characteristic.force", "expected forces that do not fall"
    if "series_stiffness" in item and not np.any(np.diff(force) > 0.0):
        yield "characteristic.force", "expected forces that rise somewhere"
