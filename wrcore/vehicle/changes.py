"""Changes of vehicle values in a scene by key path, such as ``vehicle.elements.spring_1l.stiffness``.

``bodies``, ``elements`` and ``joints`` are addressed by name or by a pattern (``spring_*``). A pattern addresses all
parts whose name matches and that have the key. A change is another value, a factor on the present numbers
(``{factor: 1.2}``), or one of three numbers by its axis or index: ``{z: 4.0e+5}``, ``{yaw: ...}`` or ``{2: ...}``.
Patterns are applied before names, both in alphabetical order.
"""

import copy
from fnmatch import fnmatchcase

from wrcore.errors import InputError, check_number, one_of, short

GROUPS = ("bodies", "elements", "joints")
AXES = ("x", "y", "z"), ("roll", "pitch", "yaw"), ("0", "1", "2")
"""Names that a change may use for the three numbers of a list."""

MOST_FACTOR = 1e6
"""Largest accepted magnitude of a factor."""


def changed(data, changes, source):
    """Return the content of a checked vehicle file with a scene's changes, and the set of changed fields.

    ``changes`` are those of the scene's key ``vehicle``. Fields are named as in ``elements.NAME``. An InputError names
    ``source`` and the key path.
    """
    data, reached = copy.deepcopy(data), set()
    for group in GROUPS:
        items = data[group] if group == "bodies" else {item["name"]: item for item in data[group]}
        for name in sorted(changes.get(group, {}), key=lambda name: (name in items, name)):
            for key, change in changes[group][name].items():
                field = f"vehicle.{group}.{name}"
                for one in _meant(items, name, key, field, source):
                    items[one][key] = _put(items[one].get(key), change, f"{field}.{key}", source)
                    reached.add(f"{group}.{one}")
    return data, reached


def _meant(items, name, key, field, source):
    """Return the names of the parts that a name or a pattern addresses."""
    if name in items:
        return [name]
    matching = [one for one in items if fnmatchcase(one, name)]
    if not matching:
        raise InputError(source, field, one_of(items, name))
    found = [one for one in matching if key in items[one]]
    if not found:
        known = sorted({known for one in matching for known in items[one]})
        raise InputError(source, f"{field}.{key}", one_of(known, key))
    return found


def _put(value, change, field, source):
    """Return a value after a change: another value, a factor, or changes of single numbers or keys."""
    if not isinstance(change, dict):
        return change
    if set(change) == {"factor"}:
        factor = check_number(change["factor"], -MOST_FACTOR, MOST_FACTOR, source, f"{field}.factor")
        numbers = value if isinstance(value, list) else [value]
        if not all(isinstance(number, int | float) and not isinstance(number, bool) for number in numbers):
            raise InputError(source, f"{field}.factor", f"expected numbers to multiply in the file, got {short(value)}")
        return [factor * number for number in value] if isinstance(value, list) else factor * value
    if isinstance(value, list):
        value = list(value)
        for place, inner in change.items():
            at = next((axes.index(place) for axes in AXES if place in axes), len(value))
            if len(value) != 3 or at == len(value):
                raise InputError(source, f"{field}.{place}", f"expected one of x, y, z of three numbers, got {value}")
            value[at] = _put(value[at], inner, f"{field}.{place}", source)
        return value
    if isinstance(value, dict):
        return value | {key: _put(value.get(key), inner, f"{field}.{key}", source) for key, inner in change.items()}
    return change
