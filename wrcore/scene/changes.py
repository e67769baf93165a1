"""Changes to a scene's data: values by key path, from the command line or from keywords."""

import json
from collections.abc import Iterable, Mapping
from itertools import pairwise

import numpy as np

from wrcore.errors import InputError, short
from wrcore.errors.checked_calls import UNMASKED, is_masked
from wrcore.errors.checked_yaml import name_of_function, parse_value

WHOLE = (".profile", ".slices", ".friction", ".controller.speed", "vehicle.parameters")
"""Ends of the key paths at which a mapping is one value; its keys are not merged one by one."""


def changes_of(overrides, changes):
    """Return (option, key path, value) of each change in the arguments of `load_scene`."""
    texts, changes = ((), {**overrides, **changes}) if isinstance(overrides, Mapping) else (overrides, changes)
    try:
        flat = list(_flat(changes))
    except RecursionError:
        raise InputError("changes", "", "expected mappings that do not contain themselves") from None
    check_disjoint({key for key, _ in flat}, "changes")  # of equal keys the last one is used
    return [("--set", *_pair(text)) for text in texts] + [("changes", *pair) for pair in flat]


PLACES = ({"x": "0", "y": "1", "z": "2"}, {"roll": "0", "pitch": "1", "yaw": "2"})
"""Names that a change of a vehicle may use for the three numbers of a list, each with its index."""


def check_disjoint(keys: Iterable[str], source, above=""):
    """Raise an InputError if one of several keys contains another one or is a second name of it.

    The result of such changes would depend on their order. ``above`` is the field that contains the keys.
    """
    for (path, key), (inner, other) in pairwise(sorted((_places_of(key), key) for key in keys)):
        if inner[: len(path)] == path:
            what = "is" if len(inner) == len(path) else "is a part of"
            expected = f"expected keys of which none holds another one, but {other} {what} {key}"
            raise InputError(source, ".".join(filter(None, [above, other])), f"{expected}: write one of them")


def _places_of(key):
    """Split a key path into parts; list indices and axis names of a vehicle's points get one common spelling."""
    first, *parts = key.split(".")
    last = next((places[parts[-1]] for places in PLACES if parts and parts[-1] in places), None)
    if first == "vehicle" and len(parts) > 3 and parts[0] in ("elements", "joints") and last:
        parts[-1] = last
    return [first, *(str(int(part)) if part.isdecimal() else part for part in parts)]


def with_value(data, key, value):
    """Return a scene's data with another value at a path of keys; only the changed branches are copied."""
    return _with(data, key.split("."), value)


def _with(inner, path, value):
    if not path:
        return value
    first, *following = path
    if isinstance(inner, list):
        k = int(first)
        return [*inner[:k], _with(inner[k], following, value), *inner[k + 1 :]]
    return {**inner, first: _with(inner.get(first, {}), following, value)}


def of_a_change(error, source, asked):
    """Return an error that names the change which caused it, or the given error if no change did.

    ``asked`` are the changes from `changes_of`. A change causes an error if its key path contains the error's key path,
    or the reverse.
    """
    for option, key, _ in reversed(asked):
        near = f"{error.field}.".startswith(f"{key}.") or f"{key}.".startswith(f"{error.field}.")
        if error.source == source and near:
            return InputError(option, error.field, error.expected)
    return error


def _pair(text):
    """Split ``key.path=value`` into key path and value."""
    key, equals, value = text.partition("=") if isinstance(text, str) else ("", "", "")
    if not equals or not key.strip():
        raise InputError("--set", text if isinstance(text, str) else short(text), "expected key.path=value")
    return key.strip(), parse_value(value)


def _flat(changes, prefix=""):
    """Yield pairs of key path and plain value from nested mappings; mappings at paths in `WHOLE` are one value."""
    for key, value in changes.items():
        path = prefix + str(key).replace("__", ".")
        if isinstance(value, Mapping) and not path.endswith(WHOLE):
            yield from _flat(value, f"{path}.")
        else:
            if is_masked(value):
                raise InputError("changes", path, UNMASKED)
            try:
                yield path, json.loads(json.dumps(value, default=_plain))
            except (ValueError, RecursionError):  # a value that contains itself, or a number of thousands of digits
                raise InputError("changes", path, f"expected a value as YAML holds it, got {short(value)}") from None


def _plain(value):
    """Convert numpy numbers and arrays, paths and functions to values that YAML can hold."""
    if callable(value):
        return name_of_function(value) or repr(value)
    return value.tolist() if isinstance(value, np.generic | np.ndarray) else str(value)


def set_at(data, key, value, source):
    """Set the value at a path of keys, or remove the key if the value is None; a number in the path is a list index."""
    *path, last = key.split(".")
    for part in path:
        data = data[_list_index(data, part, key, source)] if isinstance(data, list) else data.setdefault(part, {})
        if not isinstance(data, dict | list):
            raise InputError(source, key, f"expected a key below a mapping, but {part!r} holds a value")
    if value is None and isinstance(data, dict):
        if last not in data:
            raise InputError(source, key, "expected a key that the scene has, to take it out")
        del data[last]
        return
    data[_list_index(data, last, key, source) if isinstance(data, list) else last] = value


def _list_index(items, part, key, source):
    """Return the list index that a part of a key path names."""
    if not part.isdecimal() or int(part) >= len(items):
        raise InputError(source, key, f"expected the number of one of {len(items)} in the list, from 0, got {part!r}")
    return int(part)
