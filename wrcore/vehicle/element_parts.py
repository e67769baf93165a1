"""What the force elements of a vehicle are made of: checked, and on its bodies."""

from typing import Any, NamedTuple

from wrcore.bodies.marker import FRAME
from wrcore.errors import InputError, one_of
from wrcore.errors.checked_yaml import check
from wrcore.forces.kind import Along, Turning
from wrcore.forces.kinds import KINDS, kind_named
from wrcore.forces.kinds.own_law import try_law


def check_element(item, source):
    """Raise an InputError that names the element if its kind, its keys or their values are not what they should be."""
    field = f"elements.{item['name']}"
    try:
        known = kind_named(item["kind"])
    except InputError as error:
        raise InputError(source, f"{field}.kind", error.expected) from None
    if known is None:
        raise InputError(source, f"{field}.kind", one_of(KINDS, item["kind"]))
    kind, given = KINDS[item["kind"]], {key: item[key] for key in item if key not in ("name", "kind", "bodies")}
    for key in kind.needed:
        if key not in given:
            raise InputError(source, f"{field}.{key}", f"expected a value, as kind {item['kind']} needs one")
    for key in given:
        if key not in kind.keys:
            raise InputError(source, f"{field}.{key}", f"unknown for kind {item['kind']}; {one_of(kind.keys, key)}")
    check(given, kind.schema, source, field)
    for key, expected in kind.check(item):
        raise InputError(source, f"{field}.{key}".rstrip("."), expected)


def try_laws(elements, source):
    """Call each law of the user of checked ``elements`` for a test; an InputError names the element."""
    for item in elements:
        try:
            if item["kind"] == "own_law":
                try_law(item)
        except InputError as error:
            raise InputError(source, f"elements.{item['name']}.law", error.expected) from None


class Part(NamedTuple):
    """A part of a force element on two bodies."""

    name: str  # of the element
    bodies: tuple[int, int]
    does: Any  # `wrcore.forces.kind.Spring`, `Turning` or `Along`, seen from the first body


def parts_of(item, layout, load=None):
    """Parts of a checked element, wheelsets first; ``load`` (N) for kinds whose parts depend on it."""
    field, kind = f"elements.{item['name']}", KINDS[item["kind"]]
    first, second = layout.ends(item, field)
    found = []
    for does in kind.parts(item, load) if kind.first_load else kind.parts(item):
        bodies = first, second
        if second != FRAME and layout.spins[second] and not _anywhere(does):
            if layout.spins[first]:
                expected = "expected a traction_rod or direction: line between two wheelsets"
                raise InputError(layout.source, field, expected)
            bodies, does = (second, first), _turned(does)
        if isinstance(does, Turning):
            does = _on_an_axle(does, item, layout)
        found.append(Part(item["name"], bodies, does))
    return found


def _anywhere(does):
    """Whether forces need not act at a point of an axle, which does not spin: on a line they go through both ends."""
    return does.axis is None if isinstance(does, Along) else isinstance(does, Turning) and does.anywhere


def _turned(does):
    """A part seen from the other body, with the other one's axes: preload and law belong to the opposite motion."""
    does = does._replace(ends=does.ends[::-1])
    if isinstance(does, Along):
        points = does.points if does.points is None else -does.points[::-1]
        return does._replace(points=points, axis=does.axis if does.odd else -does.axis)
    if isinstance(does, Turning) or does.preload is None:
        return does
    return does._replace(preload=[-force for force in does.preload])


def _on_an_axle(turning, item, layout):
    """Nothing bends in pitch of a wheelset, nor of an axle box that is part of one."""
    turns = [name in layout.names and layout.spins[layout.names.index(name)] for name in item["bodies"]]
    if not any(turns) and not any(name in layout.aliases for name in item["bodies"]):
        return turning
    for key in turning.keys:
        if any(turns) and key in item and item[key][1] != 0.0:
            expected = "expected 0 as the second value (pitch), in which the wheelset turns"
            raise InputError(layout.source, f"elements.{item['name']}.{key}", expected)
    rows = ([roll, 0.0, yaw] for roll, _, yaw in turning[1:4])
    return turning._replace(**dict(zip(("stiffness", "damping", "cubic"), rows, strict=True)))
