"""Compilation of a vehicle's force elements, with preloads, for kernels. Kinds: `wrcore.forces.kinds`."""

import numpy as np

from wrcore.bodies.marker import FRAME
from wrcore.errors import InputError
from wrcore.forces.kind import Spring, Turning
from wrcore.forces.kinds import KINDS
from wrcore.forces.suspension import pack_elements
from wrcore.vehicle.element_parts import parts_of
from wrcore.vehicle.statics import preloads

PASSES = 8
"""Largest number of iterations for the loads on elements whose stiffness depends on their load. The stiffnesses
determine how springs share the weight, and so the loads."""


def compile_elements(items, layout, joints, gravity):
    """Return checked elements as `Elements` for kernels, and the names of those along one direction, in their order.

    Preloads that elements do not state follow from the weight with ``gravity`` (m/s^2); joints carry weight, too.
    """
    springs, directed, turning, waiting = [], [], [], []
    pressing: dict[str, tuple] = {}
    parts, found = _loaded(items, layout, joints, gravity)
    for name, bodies, does in parts:
        field = f"elements.{name}"
        (here, there), offset, (first, second) = does.ends, 0.0, bodies
        if second == FRAME:
            offset, there = float(there[0]), there - [there[0], 0.0, 0.0]
        pair = first, second, offset
        if isinstance(does, Turning):
            rows = does.stiffness, does.damping, does.cubic
            turning += [(pair, *rows)] if np.any(rows) else []
            continue
        marker, other = layout.marker(here, first, field), layout.marker(there, second, field)
        rest = layout.rest(marker, *pair)
        if isinstance(does, Spring):
            preload = [0.0, 0.0, found[name]] if does.preload is None else does.preload
            pressing[name] = pair, (0, len(springs)), preload[2]
            springs.append((pair, [*marker, *rest, *does.stiffness, *does.damping, *preload]))
            continue
        origin, length, axis = other, float(np.linalg.norm(rest - other)), [0.0, 0.0, 0.0]
        if does.axis is not None:
            origin, length, axis = rest, 0.0, does.axis
        elif length < 1e-3:
            expected = "expected two points at least 1 mm apart for an element on a line"
            raise InputError(layout.source, f"{field}.at", expected)
        if does.presses is not None:
            pressing[name] = pair, (1, len(directed)), does.presses
        waiting.append((name, pair, does, [*marker, *origin, length, *axis]))
        directed.append(None)
    for k, (name, pair, does, row) in enumerate(waiting):
        by, numbers = _pressed(name, pair, does, pressing, layout.source)
        directed[k] = pair, row, does.law, numbers, does.points, does.inner, by
    names = [waiting[k][0] for k in sorted(range(len(waiting)), key=lambda k: waiting[k][1])]
    return pack_elements(springs, directed, turning), tuple(names)


def _loaded(items, layout, joints, gravity):
    """Return the parts of all elements and the springs' preloads (N) by name.

    Parts that depend on their load are those at the load they carry. An InputError names such an element without load.
    """
    loads = {item["name"]: first(item) for item in items if (first := KINDS[item["kind"]].first_load)}
    for _ in range(PASSES):
        parts = [part for item in items for part in parts_of(item, layout, loads.get(item["name"]))]
        found = preloads(parts, layout, joints, gravity)
        before = loads
        stated = {item["name"]: item["preload"][2] for item in items if item["name"] in loads and "preload" in item}
        loads = {name: abs(stated.get(name, found.get(name))) for name in loads}
        if all(abs(loads[name] - before[name]) <= 1e-9 * before[name] for name in loads):
            break
    for name, load in loads.items():
        if not load > 0.0:
            raise InputError(layout.source, f"elements.{name}", "expected part of the weight on it")
    return parts, found


def _pressed(name, pair, does, pressing, source):
    """Return the position of the element whose force presses a friction element, and the numbers of the friction law.

    The position is None for an element without ``normal``.
    """
    if does.normal is None:
        return None, does.numbers(0.0) if callable(does.numbers) else does.numbers
    its_pair, place, press = pressing.get(does.normal, (None, None, None))
    if its_pair != pair:
        expected = "expected the name of a spring or bump stop between the same two bodies, in the same order"
        raise InputError(source, f"elements.{name}.normal", f"{expected}, got {does.normal!r}")
    return place, does.numbers(press)
