"""Force elements of a vehicle file: preloaded and sorted for the kernels.

========================  ==============================================================================================
kind                      acts
========================  ==============================================================================================
spring_damper             along the three axes of the second body, and against relative rotation about them
shear_spring              like spring_damper at mid-height between its two ends, with a bending stiffness: the elastic
                          beam of shear force Q and end moments Q h/2 +- k_bend (relative rotation)
air_spring                a shear_spring whose vertical stiffness is that of the air, on request with a reservoir behind
                          an orifice, see `wrcore.vehicle.air_spring`
damper                    along one direction (or linear along all three): linear or by a characteristic (force over
                          speed), on request in series with a spring (Maxwell), with the damper's displacement as own
                          state
bushing                   like spring_damper, with cubic parts along and about all three axes
friction                  along one direction: a slider that gives way at a force, in series with a spring, or an
                          exponential approach to that force; it may grow with the force in another element
bump_stop                 along one direction: force over displacement, by a characteristic or by gap and stiffness
traction_rod              along the line between its two ends: a spring-damper
anti_roll_bar             against relative roll
========================  ==============================================================================================
"""

import numpy as np

from wrcore.dynamics import suspension
from wrcore.dynamics.marker import FRAME
from wrcore.errors import InputError
from wrcore.vehicle.air_spring import inflated
from wrcore.vehicle.element_data import end_points, rotational, single_elements

SPRINGS = ("spring_damper", "shear_spring")
"""Kinds that act along three axes."""

PRESSING = (*SPRINGS, "bump_stop")
"""Kinds whose force may be the normal force of friction: that along z, or in a bump stop's own direction."""

DIRECTIONS = {"x": 0, "y": 1, "z": 2, "line": suspension.LINE}

STEEPEST_INVERSE = 1000.0
"""A damper in series with a spring needs its speed as a function of its force: where its characteristic is flat, the
speed rises this many times faster than at its steepest part."""


def compile_elements(items, layout, joints, gravity):
    """Checked elements sorted into what kernels need; joints carry weight, too, and ``gravity`` (m/s^2) makes the
    preloads of elements that state none."""
    springs, directed, turning, waiting = [], [], [], []
    places: dict[str, tuple[int, int]] = {}
    items, found = inflated(items, single_elements, layout, joints, gravity)
    for item in items:
        field = f"elements.{item['name']}"
        first, second = layout.ends(item, field)
        here, there = end_points(item)
        ahead = 0.0
        if second == FRAME:
            ahead, there = there[0], there - [there[0], 0.0, 0.0]
        pair = (first, second, float(ahead))
        rows = rotational(item, layout)
        if np.any(rows):
            turning.append((pair, *rows))
        if item["kind"] == "anti_roll_bar":
            continue
        if item["kind"] in PRESSING:
            places[item["name"]] = (0, len(springs)) if item["kind"] in SPRINGS else (1, len(directed))
        marker, other = layout.marker(here, first, field), layout.marker(there, second, field)
        rest = layout.rest(marker, first, second, ahead)
        if item["kind"] in SPRINGS:
            zero = [0.0, 0.0, 0.0]
            preload = item.get("preload", [0.0, 0.0, found.get(item["name"], 0.0)])
            springs.append((pair, [*marker, *rest, *item.get("stiffness", zero), *item.get("damping", zero), *preload]))
        else:
            directed.append((pair, *_directed(item, marker, rest, other, layout.source), None))
            if "normal" in item:
                waiting.append((len(directed) - 1, item))
    for k, item in waiting:
        directed[k] = _pressed(directed[k], item, places, springs, directed, layout.source)
    return suspension.pack_elements(springs, directed, turning)


def _pressed(friction, item, places, springs, directed, source):
    """Friction with the element that presses, and with what that does to its limit."""
    pair, row, direction, law, points, _ = friction
    place = places.get(item["normal"])
    group = (springs, directed)[place[0]] if place else ()
    if place is None or group[place[1]][0] != pair:
        expected = f"expected the name of a {', '.join(PRESSING[:-1])} or {PRESSING[-1]} between the same two bodies"
        raise InputError(
            source, f"elements.{item['name']}.normal", f"{expected}, in the same order, got {item['normal']!r}"
        )
    if place[0] == 0:
        press = group[place[1]][1][14]
    else:
        curve = group[place[1]][4]
        press = -float(np.interp(0.0, curve[:, 0], curve[:, 1]))
    points = [
        [points[0][0], points[0][0] + item["mu"] * abs(press)],
        [item["mu"] * (press >= 0.0), item["mu"] * (press <= 0.0)],
    ]
    return pair, row, direction, law, points, place


def _directed(item, marker, rest, other, source):
    """Row, direction, law and characteristic of an element along one direction."""
    direction, length = DIRECTIONS[item.get("direction", "line")], 0.0
    if direction == suspension.LINE:
        length = float(np.linalg.norm(rest - other))
        if length < 1e-3:
            expected = "expected two points at least 1 mm apart for an element on a line"
            raise InputError(source, f"elements.{item['name']}.at", expected)
        rest = other
    law, points, stiffness, damping = _law(item)
    return [*marker, *rest, length, stiffness, damping, item.get("preload", 0.0)], direction, law, points


def _law(item):
    """Law, characteristic, stiffness and damping of an element along one direction."""
    stiffness, damping, points = item.get("stiffness", 0.0), item.get("damping", 0.0), item["points"]
    if item["kind"] == "bushing":
        return suspension.CUBIC, [[item["cubic_stiffness"], 0.0]], 0.0, 0.0
    if item["kind"] == "friction":
        own, series = item.get("force", 0.0), item.get("series_stiffness", 0.0)
        if "approach" in item:
            hanging = 1.0 / (item["mu"] * item["pendulum"]) if "pendulum" in item else 0.0
            return suspension.APPROACH, [[own, own], [0.0, 0.0]], hanging, item["approach"]
        return suspension.SLIDER, [[own, own], [0.0, 0.0]], series, 0.0
    if "series_stiffness" in item:
        if points is None:
            return suspension.SERIES, None, item["series_stiffness"], damping
        return suspension.SERIES_VELOCITY, _inverse(points), item["series_stiffness"], 0.0
    if item["kind"] == "bump_stop":
        return suspension.DISPLACEMENT, points, 0.0, 0.0
    law = suspension.LINEAR if points is None else suspension.VELOCITY
    return law, points, stiffness, damping


def _inverse(points):
    """The same points with force as abscissa; flat parts get a small slope."""
    least = np.max(np.diff(points[:, 1]) / np.diff(points[:, 0])) / STEEPEST_INVERSE
    zero = int(np.argmin(np.abs(points[:, 0])))
    rises = np.maximum(np.diff(points[:, 1]), least * np.diff(points[:, 0]))
    force = np.concatenate([[0.0], np.cumsum(rises)])
    return np.column_stack([force - force[zero] + points[zero, 1], points[:, 0]])
