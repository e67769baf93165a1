"""Keys of a scene that have no effect because of the value of another key (void keys).

A scene or a change that states such a key raises an InputError. If a change makes a key of the scene void, the key is
left out and a line on stderr names it. A key with its default value is treated as left out.
"""

from collections.abc import Callable, Iterable, Mapping
from functools import cache
from typing import Any, NamedTuple

from wrcore.contact.patch.model import STRIPS
from wrcore.contact.search.reduction import REDUCTIONS
from wrcore.creep.table import DEFAULT_TOLERANCE
from wrcore.errors import InputError, short
from wrcore.errors.messages import tell
from wrcore.errors.schema_keys import keys_of


class VoidKey(NamedTuple):
    """A key and the condition on another key that makes it void."""

    key: str
    by: str
    """Path of the other key."""
    is_void: Callable[[Any], bool]
    """Whether a value of the other key (None: left out) makes the key void."""
    why: str


REFERENCES = ("scipy_", "cvode")
"""Prefixes of the names of integration methods from other packages."""

_STRIPS = "contact.patch", lambda patch: patch not in STRIPS, "which has no strips, unlike exact and tabulated"
_ELLIPSES = "contact.patch", lambda patch: patch not in REDUCTIONS, "which has creep forces of its own"
_FIXED = "integration.step", lambda step: step > 0.0, "which fixes the length of all steps"
_LAW = "contact.creep.model", lambda model: model != "table", "which has no table"
_TABLE = "contact.creep.table", lambda table: table is not None, "which has its own planes and tolerance"
_ONE_FRICTION = "contact.patch", lambda patch: patch == "tabulated", "whose tables have one coefficient of friction"
_LEVEL = "at which friction does not fall"
_POLACH = "contact.creep.model", lambda model: model != "polach", "unlike polach"


def _lacks(*keys):
    """Return a function that tests whether no segment of a track's path has any of the keys."""
    return lambda path: (
        not any(
            isinstance(one, dict) and any(one.get(key) for key in keys)
            for one in (path if isinstance(path, list) else [])
        )
    )


VOID_KEYS: tuple[VoidKey, ...] = (
    VoidKey("track.rounding", "track.path", _lacks("cant", "widening"), "which has no cant and no widening"),
    *(
        VoidKey(f"track.{key}", "track.path", _lacks("cant"), "which has no cant")
        for key in ("cant_about", "rail_climb")
    ),
    VoidKey("track.widened", "track.path", _lacks("widening"), "which has no widening"),
    VoidKey("vehicle.spacing", "vehicle.count", lambda count: count == 1, "as spacing is between vehicles"),
    VoidKey("contact.resolution", *_STRIPS),
    VoidKey("contact.slip", *_STRIPS),
    VoidKey("contact.detection_tolerance", "contact.detection", lambda name: name != "auto", "unlike auto"),
    VoidKey("contact.normal.damping.v0", "contact.normal.damping.c_e", lambda c_e: c_e == 1.0, "which damps nothing"),
    VoidKey("contact.friction.falling.decay", "contact.friction.falling.ratio", lambda ratio: ratio == 1.0, _LEVEL),
    VoidKey("contact.friction.falling.ratio", "contact.friction.falling.decay", lambda decay: decay == 0.0, _LEVEL),
    VoidKey("contact.friction.across", *_ONE_FRICTION),
    *(VoidKey(f"contact.creep.{key}", *_POLACH) for key in ("k_A", "k_S")),
    VoidKey("contact.creep.planes", "contact.patch", lambda patch: patch != "moment", "unlike moment"),
    *(VoidKey(f"contact.creep.{key}", *_ELLIPSES) for key in ("table", "tolerance")),
    *(VoidKey(f"contact.creep.{key}", *_LAW) for key in ("table", "planes", "tolerance")),
    *(VoidKey(f"contact.creep.{key}", *_TABLE) for key in ("planes", "tolerance")),
    VoidKey(
        "integration.step", "integration.method", lambda name: name.startswith(REFERENCES), "which finds its steps"
    ),
    *(VoidKey(f"integration.{key}", *_FIXED) for key in ("rtol", "atol", "longest_step")),
)

ALL_OTHERS = frozenset(rule.by for rule in VOID_KEYS)
"""Keys whose values can make other keys void."""


def leave_out_void_keys(
    data: dict[str, Any], source: str, changes: Mapping[str, Any] | None = None, undecided: Iterable[str] = ()
) -> None:
    """Set each key that a change makes void to its default; InputError if the scene or a change states a void key.

    ``data`` is a checked scene with defaults, ``changes`` are values by key path that it already holds. Keys that are
    ``undecided``, such as those that a sweep varies, make no key void.
    """
    changes = {key: value for key, value in (changes or {}).items() if value is not None}
    for key, by, is_void, why in VOID_KEYS:
        value, other, default = _at(data, key), _at(data, by), _defaults().get(key)
        if value is None or value == default or not is_void(other) or by in undecided:
            continue
        beside = by if other is None else f"{by} {short(other)}"
        if not _is_changed(by, changes) or _is_changed(key, changes):
            raise InputError(source, key, f"expected no such key beside {beside}, {why}: leave it out")
        tell(f"{source}: {key} {short(value)} is left out: it has no effect beside {beside}")
        above, _, last = key.rpartition(".")
        inside = _at(data, above)
        del inside[last]
        if default is not None:
            inside[last] = default


def _is_changed(key, changes: Iterable[str]):
    """Whether the key itself, a key above it or one below it is among the changes."""
    return any(f"{key}.".startswith(f"{changed}.") or changed.startswith(f"{key}.") for changed in changes)


def _at(data, key):
    for part in key.split("."):
        data = data.get(part) if isinstance(data, dict) else None
    return data


@cache
def _defaults():
    """Return the default values of the scene's keys by key path."""
    tables = (("", "scene"), ("track.", "track"))
    found = {above + key: default for above, name in tables for key, _, _, default, _ in keys_of(name)}
    return found | {"contact.creep.tolerance": DEFAULT_TOLERANCE}
