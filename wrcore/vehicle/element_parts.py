"""Parts of a vehicle's force elements: checked and assigned to bodies."""

from typing import Any, NamedTuple

from wrcore.bodies.marker import FRAME
from wrcore.errors import InputError, one_of
from wrcore.errors.checked_yaml import check
from wrcore.forces.kind import Along, Turning
from wrcore.forces.kinds import KINDS, kind_named
from wrcore.forces.kinds.own_law import try_law


def check_element(item, source):
    """Raise an InputError that names the element if its kind, its keys or their values are wrong."""
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
    """Test-call each user-defined law of checked ``elements``; an InputError names the element."""
    for item in elements:
        try:
            if item["kind"] == "own_law":
                try_law(item)
        except InputError as error:
            raise InputError(source, f"elements.{item['name']}.law", error.expected) from None


class Part(NamedTuple):
    """A part of a force element between two bodies."""

    name: str  # name of the element
    bodies: tuple[int, int]
    does: Any  # `wrcore.forces.kind.Spring`, `Turning` or `Along`, which acts on the first body


def parts_of(item, layout, load=None):
    """Return the parts of a checked element; a wheelset is a part's first body if the force must act on its axle.

    ``load`` (N) is the load on the element, for kinds whose parts depend on it.
    """
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
    """Whether the part's forces may act at any point of a wheelset, also off its axle.

    Wheelset frames do not spin. Forces on a line between the ends pass through both ends in any case.
    """
    return does.axis is None if isinstance(does, Along) else isinstance(does, Turning) and does.anywhere


def _turned(does):
    """Return a part with its two bodies exchanged; preload and law change sign accordingly."""
    does = does._replace(ends=does.ends[::-1])
    if isinstance(does, Along):
        points = does.points if does.points is None else -does.points[::-1]
        return does._replace(points=points, axis=does.axis if does.odd else -does.axis)
    if isinstance(does, Turning) or does.preload is None:
        return does
    return does._replace(preload=[-force for force in does.preload])


def _on_an_axle(turning, item, layout):
    """Return a rotational part without pitch stiffness and damping if it acts on a wheelset or a lumped axle box.

    An InputError is raised if the element states a pitch value other than 0 at a wheelset, which turns in pitch.
    """
    turns = [name in layout.names and layout.spins[layout.names.index(name)] for name in item["bodies"]]
    if not any(turns) and not any(name in layout.aliases for name in item["bodies"]):
        return turning
    for key in turning.keys:
        if any(turns) and key in item and item[key][1] != 0.0:
            expected = "expected 0 as the second value (pitch), in which the wheelset turns"
            raise InputError(layout.source, f"elements.{item['name']}.{key}", expected)
    rows = ([roll, 0.0, yaw] for roll, _, yaw in turning[1:4])
    return turning._replace(**dict(zip(("stiffness", "damping", "cubic"), rows, strict=True)))
