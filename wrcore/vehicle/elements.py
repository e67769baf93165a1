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
friction                  along one direction: a slider that gives way at a force, in series with a spring
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

DIRECTIONS = {"x": 0, "y": 1, "z": 2, "line": suspension.LINE}

STEEPEST_INVERSE = 1000.0
"""A damper in series with a spring needs its speed as a function of its force: where its characteristic is flat, the
speed rises this many times faster than at its steepest part."""

GIVING_WAY = 1e-3
"""Time in which friction gives way to a force above its own, s: sliding at v, it exceeds it by stiffness * time * v."""


def compile_elements(items, layout, joints, gravity):
    """Sort checked elements into what kernels need.

    Parameters
    ----------
    items : list of dict
        Elements of a vehicle file.
    layout : Layout
    joints : list of dict
        Joints of the vehicle: they carry weight, too.
    gravity : float
        For the preloads of the elements that state none, m/s^2.

    Returns
    -------
    Elements
    """
    springs, directed, turning = [], [], []
    items, found = inflated(items, single_elements, layout, joints, gravity)
    for item in items:
        field = f"elements.{item['name']}"
        first, second = layout.ends(item, field)
        here, there = end_points(item)
        ahead = 0.0
        if second == FRAME:
            ahead, there = there[0], there - [there[0], 0.0, 0.0]
        pair = (first, second, float(ahead))
        stiffness, damping = rotational(item, layout)
        if np.any(stiffness) or np.any(damping):
            turning.append((pair, stiffness, damping))
        if item["kind"] == "anti_roll_bar":
            continue
        marker, other = layout.marker(here, first, field), layout.marker(there, second, field)
        rest = layout.rest(marker, first, second, ahead)
        if item["kind"] in ("spring_damper", "shear_spring"):
            zero = [0.0, 0.0, 0.0]
            preload = item.get("preload", [0.0, 0.0, found.get(item["name"], 0.0)])
            springs.append((pair, [*marker, *rest, *item.get("stiffness", zero), *item.get("damping", zero), *preload]))
        else:
            directed.append((pair, *_directed(item, marker, rest, other, layout.source)))
    return suspension.pack_elements(springs, directed, turning)


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
    if item["kind"] == "friction":
        force, excess = item["force"], GIVING_WAY * item["series_stiffness"]  # at a speed of 1 m/s
        slider = np.array([[-force - excess, -1.0], [-force, 0.0], [force, 0.0], [force + excess, 1.0]])
        return suspension.SERIES_VELOCITY, slider, item["series_stiffness"], 0.0
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
