"""Description of a kind of force element: its keys, parts, force laws, and marker in pictures."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

ZERO = (0.0, 0.0, 0.0)
MOST = 1e15
"""Largest number that a key accepts; larger than any value of a real vehicle."""


@dataclass(frozen=True)
class Kind:
    """Description of one kind of force element; the first line of the module of a kind describes it for users."""

    keys: Mapping[str, dict]
    """JSON schema of each key except name, kind and bodies; its description states the unit as "in UNIT"."""
    needed: tuple[str, ...]
    """Names of the required keys."""
    mark: Mapping[str, str]
    """Marker and color in pictures, as keywords of matplotlib; the marker identifies the kind in grey pictures."""
    parts: Callable[..., list]
    """Function that returns the parts (`Spring`, `Turning`, `Along`) of an element (dict). If ``first_load`` is given,
    its second argument is the load (N)."""
    check: Callable[[dict], Iterator[tuple[str, str]]] = lambda item: iter(())
    """Function that yields faults that the schema cannot express: key (empty: the element) and expectation."""
    laws: tuple = ()
    """Kernels of the laws of its `Along` parts, see `wrcore.forces.law`."""
    first_load: Callable[[dict], float] | None = None
    """Function that returns the vertical load (N) at which the search for the static load of the element starts. None
    if the parts do not depend on the load."""

    @cached_property
    def schema(self) -> dict:
        """JSON schema of the keys of this kind."""
        return {"properties": self.keys}


class Spring(NamedTuple):
    """Spring and damper along the three axes of the second body, at the first of its ``ends`` (2, 3).

    If ``preload`` (N) is None, wrcore computes the preload along z."""

    ends: np.ndarray
    stiffness: Any = ZERO
    damping: Any = ZERO
    preload: Any = None


class Turning(NamedTuple):
    """Spring and damper against relative rotation about the three axes of the second body.

    At a wheelset, pitch values in the element's ``keys`` are errors, and the element must be on the axle unless it may
    be ``anywhere``."""

    ends: np.ndarray
    stiffness: Any = ZERO
    damping: Any = ZERO
    cubic: Any = ZERO
    keys: tuple[str, ...] = ()
    anywhere: bool = False


class Along(NamedTuple):
    """Force element along one direction: unit vector in the axes of the second body, or the line between the ends."""

    ends: np.ndarray
    law: Any
    """Force law: a kernel, or a function of the user (`wrcore.kernels.named_laws.UserFunction`)."""
    axis: np.ndarray | None
    numbers: Any = ()
    """Parameters of the law: at most six, or any number for a law of the user; or a function that returns them from
    the normal force (N) in nominal position."""
    points: np.ndarray | None = None
    """(q, 2): polygon of force over displacement or speed, or its inverse."""
    inner: int = 0
    """Number of internal states; at most one, except for a law of the user."""
    slope: float = 0.0
    """Stiffness along the direction with which the element may carry weight, N/m."""
    preload: float = 0.0
    """Force on the first body along the axis in nominal position, N, for statics; it is also one of ``numbers``."""
    presses: float | None = None
    """Force on the first body along the axis in nominal position, N, of an element that may act as the normal force of
    a friction element. Such an element has no internal state."""
    normal: str | None = None
    """Name of the element whose force is the normal force of this friction element."""
    odd: bool = True
    """Whether the law without ``points`` is an odd function, unchanged when first and second body are exchanged."""


def ends_of(item):
    """Return the points (2, 3) at which an element acts on its first and its second body, m."""
    at = np.array(item.get("at", ZERO), float).reshape(-1, 3)
    return at[[0, -1]]


def middle_of(item):
    """Return the midpoint of the ends of an element twice, (2, 3), m."""
    here, there = ends_of(item)
    return np.array([0.5 * (here + there)] * 2)


def axis_of(item):
    """Return the unit vector of an element's ``direction``; None for a line."""
    return None if item["direction"] == "line" else np.eye(3)["xyz".index(item["direction"])]


def polygon(x, force):
    """Return the points (q, 2) of a characteristic; if it starts at (0, 0), it is continued as an odd function."""
    points = np.column_stack([x, force]).astype(float)
    return points if np.any(points[0]) else np.vstack([-points[:0:-1], points])


def number(description, least=0.0, most=MOST, **more):
    """Return the schema of a key that holds one number; ``description`` must name bounds other than 0 and `MOST`."""
    said = f"{description}, not negative" if (least, most) == (0.0, MOST) else description
    return {"type": "number", "minimum": least, "maximum": most, "description": said, **more}


def three(description, least=0.0, axes="[x, y, z]"):
    """Return the schema of a key that holds one number for each axis of the second body."""
    inner = {"type": "number", "minimum": least, "maximum": MOST}
    return {"type": "array", "minItems": 3, "maxItems": 3, "items": inner,
            "description": f"three numbers {axes}{'' if least else ', none negative'}: {description}"}  # fmt: skip


def about(description):
    """Return the schema of a key that holds one number for each of roll, pitch and yaw."""
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
    """Return the schema of a key that holds a characteristic: force over ``abscissa``, in ``unit``."""
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
    """Yield the faults of an element's characteristic: key and expectation."""
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
