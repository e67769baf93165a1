"""Keys of the schemas of input files: paths, descriptions, defaults and units."""

import re
from functools import cache
from importlib import import_module

from wrcore.errors.checked_yaml import schema_of


def keys_of(schema_name):
    """Yield the keys of a schema for help pages: path, description, whether required, default and unit.

    In a path ``*`` stands for any name, ``[]`` for the items of a list. The default is None if there is none. The unit
    is ``1`` for a number without unit, empty for other values.
    """
    return _keys(schema_of(schema_name), "")


def unit_of_key(path):
    """Return the unit of a key of a scene, such as ``initial.bodies.car.y``; empty if it is unknown or no number."""
    inside, group, _, *keys = [*path.split("."), "", ""]
    if inside == "vehicle" and keys[2:]:  # a change of bodies, elements or joints of the vehicle
        ends = ".".join(keys[:-2]), keys[0]
        names = {f"{group}{one}.{end}" for one in (".*", "[]") for end in ends}
        known = {unit for name, *_, unit in keys_of("vehicle") if unit and name in names}
        return "1" if keys[-3] == "factor" else known.pop() if len(known) == 1 else ""
    name, inner = ("track", path.removeprefix("track.")) if path.startswith("track.") else ("scene", path)
    return next((unit for known, unit in _units(name) if known.fullmatch(inner)), "")


@cache
def _units(schema_name):
    return [(re.compile(re.escape(path).replace(r"\*", r"[^.]+")), unit) for path, *_, unit in keys_of(schema_name)]


_UNIT = r"(?:kg|rad|Pa|N|m|s)(?:\^\d)?"
_IN_UNIT = re.compile(rf"\bin ((?:1/)?{_UNIT}(?:[ /]{_UNIT})*)(?![\w^])")


def _unit(part):
    """Return the unit that a schema states: ``x-unit``, or the first "in UNIT" of the description."""
    found = _IN_UNIT.search(part.get("description", ""))
    return str(part.get("x-unit") or found and found[1] or "") if _holds_numbers(part) else ""


def _holds_numbers(part):
    kinds = part.get("type", ())
    inner = [one for one in (*part.get("anyOf", ()), part.get("items")) if one]
    return any(kind in kinds for kind in ("number", "integer")) or any(map(_holds_numbers, inner))


def _keys(part, path):
    inner = part.get("additionalProperties")
    entries = dict(part.get("properties", {}))
    entries |= {"*": inner} if isinstance(inner, dict) else {}
    for name, item in entries.items():
        key = f"{path}.{name}" if path else name
        if "description" in item:
            yield key, item["description"], name in part.get("required", ()), item.get("default"), _unit(item)
        yield from _keys(item, key)
    for one in (*part.get("anyOf", ()), *kinds_in(part)):
        yield from _keys(one, path)
    items = part.get("items")
    if isinstance(items, dict) and not ("properties" in part and items["properties"] is part["properties"]):
        yield from _keys(items, f"{path}[]")


def kinds_in(part):
    """Return the schemas of all kinds of a schema's part, from the module named by ``x-kinds``; empty without it."""
    return import_module(part["x-kinds"]).SCHEMAS if "x-kinds" in part else ()
