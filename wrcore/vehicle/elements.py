"""Force elements of a vehicle file: checked, preloaded and sorted for the kernels.

========================  ==============================================================================================
kind                      acts
========================  ==============================================================================================
spring_damper             along the three axes of the second body, and against relative rotation about them
shear_spring              like spring_damper at mid-height between its two ends, with a bending stiffness: the elastic
                          beam of shear force Q and end moments Q h/2 +- k_bend (relative rotation)
damper                    along one direction: linear or by a characteristic (force over speed), on request in series
                          with a spring (Maxwell), with the damper's displacement as own state
bump_stop                 along one direction by a characteristic: force over displacement
traction_rod              along the line between its two ends: a spring-damper
anti_roll_bar             against relative roll
========================  ==============================================================================================
"""

import numpy as np

from wrcore.dynamics import suspension
from wrcore.dynamics.marker import FRAME
from wrcore.errors import InputError

KEYS = {
    "spring_damper": ((), ("stiffness", "damping", "rotation_stiffness", "rotation_damping", "preload")),
    "shear_spring": (("stiffness",), ("damping", "bending_stiffness", "preload")),
    "damper": (("direction",), ("damping", "characteristic", "series_stiffness")),
    "bump_stop": (("direction", "characteristic"), ("damping",)),
    "traction_rod": (("stiffness",), ("damping", "preload")),
    "anti_roll_bar": (("stiffness",), ("damping",)),
}
"""Keys of each kind beside name, kind, bodies and at: those it needs and those it may have."""

VECTORS = {"spring_damper": ("stiffness", "damping", "preload"), "shear_spring": ("stiffness", "damping", "preload")}
"""Keys with a value per axis; elsewhere the same key holds one number."""

DIRECTIONS = {"x": 0, "y": 1, "z": 2, "line": suspension.LINE}

STEEPEST_INVERSE = 1000.0
"""A damper in series with a spring needs its speed as a function of its force: where its characteristic is flat, the
speed rises this many times faster than at its steepest part."""


def check_element(item, source):
    """Raise an InputError that names the element if keys are missing, unknown for its kind, or of the wrong shape."""
    field = f"elements.{item['name']}"
    needed, optional = KEYS[item["kind"]]
    common = ("name", "kind", "bodies", "at")
    for key in needed + (("at",) if item["kind"] != "anti_roll_bar" else ()):
        if key not in item:
            raise InputError(source, f"{field}.{key}", f"expected a value, as kind {item['kind']} needs one")
    for key in item:
        if key not in common + needed + optional:
            raise InputError(
                source,
                f"{field}.{key}",
                f"unknown for kind {item['kind']}; expected one of {_listed(needed, optional)}",
            )
    for key in ("stiffness", "damping", "preload"):
        if key in item:
            vector = key in VECTORS.get(item["kind"], ())
            if isinstance(item[key], list) != vector:
                expected = "three numbers [x, y, z]" if vector else "one number"
                raise InputError(source, f"{field}.{key}", f"expected {expected} for kind {item['kind']}")
            lowest = 0.0 if key == "preload" else np.min(item[key])
            if lowest < 0.0:
                raise InputError(source, f"{field}.{key}", f"expected no negative value, got {lowest:g}")
    if item["kind"] == "damper" and ("damping" in item) == ("characteristic" in item):
        raise InputError(source, field, "expected either damping or characteristic")
    if item["kind"] in ("damper", "bump_stop"):
        _check_characteristic(item, field, source)


def _listed(needed, optional):
    return ", ".join(needed + optional)


def _check_characteristic(item, field, source):
    if "characteristic" not in item:
        return
    field = f"{field}.characteristic"
    abscissa = "velocity" if item["kind"] == "damper" else "displacement"
    curve = item["characteristic"]
    if set(curve) != {abscissa, "force"}:
        raise InputError(source, field, f"expected the lists {abscissa} and force")
    x, force = np.array(curve[abscissa], float), np.array(curve["force"], float)
    if x.size != force.size or x.size < 2:
        raise InputError(source, field, f"expected as many forces as values of {abscissa}, two at least")
    if np.any(np.diff(x) <= 0.0):
        raise InputError(source, f"{field}.{abscissa}", "expected strictly rising values")
    if np.any(np.diff(force) < 0.0):
        raise InputError(source, f"{field}.force", "expected forces that do not fall")
    if "series_stiffness" in item and not np.any(np.diff(force) > 0.0):
        raise InputError(source, f"{field}.force", "expected forces that rise somewhere")


def _polygon(curve, abscissa):
    """Points of a characteristic; one that starts at (0, 0) is continued as an odd function."""
    points = np.column_stack([curve[abscissa], curve["force"]]).astype(float)
    if points[0, 0] == 0.0 and points[0, 1] == 0.0:
        points = np.vstack([-points[:0:-1], points])
    return points


def _inverse(points):
    """The same points with force as abscissa; flat parts get a small slope."""
    least = np.max(np.diff(points[:, 1]) / np.diff(points[:, 0])) / STEEPEST_INVERSE
    zero = int(np.argmin(np.abs(points[:, 0])))
    rises = np.maximum(np.diff(points[:, 1]), least * np.diff(points[:, 0]))
    force = np.concatenate([[0.0], np.cumsum(rises)])
    return np.column_stack([force - force[zero] + points[zero, 1], points[:, 0]])


def _ends(item):
    """Points at which the element is fixed to its first and second body, m."""
    at = np.array(item.get("at", [0.0, 0.0, 0.0]), float)
    return (at, at) if at.ndim == 1 else (at[0], at[1])


def compile_elements(items, layout, gravity):
    """Sort checked elements into what kernels need.

    Parameters
    ----------
    items : list of dict
        Elements of a vehicle file.
    layout : Layout
    gravity : float
        For the preloads of the elements that state none, m/s^2.

    Returns
    -------
    Elements
    """
    springs, directed, turning = [], [], []
    preloads = layout.preloads(items, gravity)
    for item in items:
        field = f"elements.{item['name']}"
        first, second = layout.ends(item, field)
        here, there = _ends(item)
        if item["kind"] == "shear_spring":
            here = there = 0.5 * (here + there)
        ahead = 0.0
        if second == FRAME:
            ahead, there = there[0], there - [there[0], 0.0, 0.0]
        pair = (first, second, float(ahead))
        if item["kind"] == "anti_roll_bar":
            turning.append((pair, [item["stiffness"], 0.0, 0.0], [item.get("damping", 0.0), 0.0, 0.0]))
            continue
        marker, other = layout.marker(here, first, field), layout.marker(there, second, field)
        if item["kind"] in VECTORS:
            rest = layout.rest(marker, first, second, ahead)
            preload = item.get("preload", [0.0, 0.0, preloads.get(item["name"], 0.0)])
            zero = [0.0, 0.0, 0.0]
            springs.append((pair, [*marker, *rest, *item.get("stiffness", zero), *item.get("damping", zero), *preload]))
            bend = item.get("bending_stiffness", 0.0)
            stiffness = np.array(item.get("rotation_stiffness", [bend, bend, 0.0]), float)
            damping = np.array(item.get("rotation_damping", zero), float)
            if any(name in layout.aliases for name in item["bodies"]):  # nothing turns against a box that is not there
                stiffness[1] = damping[1] = 0.0
            if stiffness.any() or damping.any():
                turning.append((pair, stiffness, damping))
        else:
            directed.append((pair, *_directed(item, marker, other, layout, first, second, ahead, field)))
    _refuse_spin(layout, turning)
    return suspension.pack_elements(springs, directed, turning)


def _directed(item, marker, other, layout, first, second, ahead, field):
    """Row, direction, law and characteristic of an element along one direction."""
    direction = DIRECTIONS[item.get("direction", "line")]
    nominal = layout.rest(marker, first, second, ahead)
    length = 0.0
    if direction == suspension.LINE:
        length = float(np.linalg.norm(nominal - other))
        if length < 1e-3:
            raise InputError(
                layout.source, f"{field}.at", "expected two points at least 1 mm apart for an element on a line"
            )
        nominal = other
    stiffness, damping = item.get("stiffness", 0.0), item.get("damping", 0.0)
    law, points = suspension.LINEAR, None
    if "characteristic" in item:
        law = suspension.VELOCITY if item["kind"] == "damper" else suspension.DISPLACEMENT
        points = _polygon(item["characteristic"], "velocity" if item["kind"] == "damper" else "displacement")
    if "series_stiffness" in item:
        stiffness = item["series_stiffness"]
        if law == suspension.VELOCITY:
            law, points = suspension.SERIES_VELOCITY, _inverse(points)
        elif damping > 0.0:
            law = suspension.SERIES
        else:
            raise InputError(layout.source, f"{field}.damping", "expected a value above 0 in series with a spring")
    row = [*marker, *nominal, length, stiffness, damping, item.get("preload", 0.0)]
    return row, direction, law, points


def _refuse_spin(layout, turning):
    """Stiffness against pitch of a wheelset would have to follow its spin."""
    for (first, second, _), stiffness, damping in turning:
        if (stiffness[1] or damping[1]) and (layout.spins[first] or (second != FRAME and layout.spins[second])):
            raise InputError(
                layout.source, "elements", "expected no rotational stiffness about y between a wheelset and a body"
            )
