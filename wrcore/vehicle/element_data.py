"""What a checked force element says, in the terms that statics and kernels need."""

import numpy as np

from wrcore.dynamics.marker import FRAME
from wrcore.errors import InputError


def single_elements(items, layout):
    """The elements as the kernels take them: wheelsets first, dampers along one direction each; a further key
    ``points`` (q, 2) is the whole characteristic, where an element has one."""
    items = [{**item, "points": _polygon(item)} for item in items]
    return [single for item in items for single in _along_axes(_wheelset_first(item, layout))]


def _along_axes(item):
    """A damper with a value per axis is one along each of them, a bushing a spring and what is cubic along each."""
    if item["kind"] == "bushing":
        cubic = zip("xyz", item.get("cubic_stiffness", [0.0, 0.0, 0.0]), strict=True)
        ends = {key: item[key] for key in ("name", "kind", "bodies", "at", "points")}
        parts = [{**ends, "direction": axis, "cubic_stiffness": value} for axis, value in cubic if value > 0.0]
        return [{**item, "kind": "spring_damper"}, *parts]
    if item["kind"] != "damper" or "direction" in item:
        return [item]
    singles = []
    for k, axis in enumerate("xyz"):
        if item["damping"][k] > 0.0:
            singles.append({**item, "direction": axis, "damping": item["damping"][k]})
            if "series_stiffness" in item:
                singles[-1]["series_stiffness"] = item["series_stiffness"][k]
    return singles


def _wheelset_first(item, layout):
    """The element with a wheelset as its first body: forces must act at a point of the axle, which does not spin. The
    axes are then those of the other body; preload and characteristic belong to the opposite motion. An element on a
    line may stay as it is: its line goes through both ends."""
    field = f"elements.{item['name']}"
    first, second = layout.ends(item, field)
    if on_line(item) or item["kind"] == "anti_roll_bar" or second == FRAME or not layout.spins[second]:
        return item
    if layout.spins[first]:
        raise InputError(layout.source, field, "expected a traction_rod or direction: line between two wheelsets")
    turned = {**item, "bodies": item["bodies"][::-1]}
    if isinstance(item["at"][0], list):
        turned["at"] = item["at"][::-1]
    if "preload" in item:
        turned["preload"] = [-force for force in item["preload"]]
    if item["points"] is not None:
        turned["points"] = -item["points"][::-1]
    return turned


def on_line(item):
    """Whether an element acts along the line between its two ends."""
    return item["kind"] == "traction_rod" or item.get("direction") == "line"


def end_points(item):
    """Points at which an element acts on its first and its second body, m."""
    at = np.array(item.get("at", [0.0, 0.0, 0.0]), float)
    here, there = (at, at) if at.ndim == 1 else (at[0], at[1])
    if item["kind"] == "shear_spring":
        here = there = 0.5 * (here + there)
    return here, there


def rotational(item, layout):
    """Stiffness (N m/rad), damping (N m s/rad) and cubic stiffness (N m/rad^3) against relative rotation, shape (3, 3).
    A spring that bends does not bend in pitch of a wheelset, nor of an axle box that is part of one."""
    zero = [0.0, 0.0, 0.0]
    if item["kind"] == "anti_roll_bar":
        return np.array([[item["stiffness"], 0.0, 0.0], [item.get("damping", 0.0), 0.0, 0.0], zero])
    bend = item.get("bending_stiffness", 0.0)
    keys = {"rotation_stiffness": [bend, bend, 0.0], "rotation_damping": zero, "rotation_cubic_stiffness": zero}
    rows = np.array([item.get(key, left_out) for key, left_out in keys.items()], float)
    turns = [name in layout.names and layout.spins[layout.names.index(name)] for name in item["bodies"]]
    for key, values in zip(keys, rows, strict=True):
        if any(turns) and key in item and values[1] != 0.0:
            expected = "expected 0 as the second value (pitch), in which the wheelset turns"
            raise InputError(layout.source, f"elements.{item['name']}.{key}", expected)
        if any(turns) or any(name in layout.aliases for name in item["bodies"]):
            values[1] = 0.0
    return rows


def _polygon(item):
    """Points (q, 2) of an element's characteristic, or None; from (0, 0) on it is continued as an odd function."""
    if "characteristic" in item:
        abscissa = "displacement" if item["kind"] == "bump_stop" else "velocity"
        points = np.column_stack([item["characteristic"][abscissa], item["characteristic"]["force"]]).astype(float)
    elif "gap" in item:
        gap, stiffness = item["gap"], item["stiffness"]
        points = np.array([[0.0, 0.0], [gap, 0.0], [gap + 1.0, stiffness]])[int(gap == 0.0) :]
    else:
        return None
    if points[0, 0] == 0.0 and points[0, 1] == 0.0:
        points = np.vstack([-points[:0:-1], points])
    return points
