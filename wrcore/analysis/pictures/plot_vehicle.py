"""Plot of a vehicle from its file: side and plan view with all bodies, force elements and joints.

A body is drawn as the homogeneous box of its mass and moments of inertia; a file says no more about its shape. In an
SVG every part is a group named ``body:NAME``, ``element:NAME`` or ``joint:NAME`` with ``:side`` or ``:plan`` behind.
"""

import math
from typing import NamedTuple

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Rectangle

from wrcore.analysis.pictures.style import ACCENT, plain, styled
from wrcore.forces.kind import ends_of
from wrcore.forces.kinds import KINDS
from wrcore.vehicle.layout import FRAME_NAME

MARKS = {name: kind.mark for name, kind in KINDS.items()} | {
    "joint": {"marker": "o", "color": ACCENT, "markerfacecolor": "white"}
}
"""Look of each kind of force element, and of joints."""

VIEWS = (("side", 2), ("plan", 1))  # name, and which coordinate stands upright
WIDTH = 10.0  # of the figure, inches
WHEEL_WIDTH = 0.135  # of a wheel in plan view, m
ROW = 0.125  # height of a line of the list of names, inches

COLUMNS = 4

SMALLEST_SCALE = 0.33  # inches per m: longer vehicles make wider figures
LETTER = (4.1, 8.5)  # width and height that a letter of a label takes up, points
MARK = 4.0  # size of a mark, points; of several at one place those below are larger


class Part(NamedTuple):
    """A force element or joint in a drawing."""

    number: int
    name: str
    kind: str
    bodies: list
    ends: np.ndarray
    """Positions of both ends, shape (2, 3), m."""
    along: np.ndarray = np.zeros(3)
    """Direction in which it acts, if not along its line."""


def box_of(body):
    """Return length, width and height (m) of the homogeneous box with a body's mass and moments of inertia (dict of a
    vehicle file); 0 in directions in which no box has such moments.
    """
    roll, pitch, yaw = (body["inertia"][name] for name in ("roll", "pitch", "yaw"))
    squares = np.array([pitch + yaw - roll, roll + yaw - pitch, roll + pitch - yaw])
    return np.sqrt(np.maximum(6.0 * squares / body["mass"], 0.0))


@styled
@rc_context({"text.parse_math": False})  # names are the user's
def plot_vehicle(scene):
    """Draw side view and plan view (m) of a scene's (first) vehicle in its nominal position.

    Numbers in the plan view refer to the force elements and joints in the list below.
    """
    vehicle = scene.vehicle.unit or scene.vehicle
    bodies = vehicle.data["bodies"]
    parts = [*_elements(vehicle), *_joints(vehicle)]
    low, high = _limits(bodies, parts)
    scale = max(WIDTH / max(1.12 * (high[0] - low[0]), 8.0), SMALLEST_SCALE)  # inches per m
    heights = [scale * (high[axis] - low[axis]) + 0.5 for _, axis in VIEWS]
    rows = -(-len(parts) // COLUMNS)
    width = max(WIDTH, 1.12 * scale * (high[0] - low[0]))
    figure = Figure(figsize=(width, sum(heights) + 1.9 + ROW * rows), layout="constrained")
    side, plan, words = figure.subplots(3, 1, height_ratios=[*heights, ROW * max(rows, 1)])
    for axes, (view, upright) in zip((side, plan), VIEWS, strict=True):
        for name, body in bodies.items():
            _draw_body(axes, name, body, view, upright)
        spots = _draw_parts(axes, parts, view, upright)
        _label(axes, _names(bodies) if view == "side" else _numbers(parts), spots, scale)
        axes.set(xlabel="x, forward / m", ylabel=("y, to the left / m", "z, up / m")[upright - 1])
        axes.set(xlim=(low[0] - 0.3, high[0] + 0.3), aspect="equal")
        axes.set_ylim(low[upright] - 0.25 / scale, high[upright] + 0.15 / scale)
    _rails(side, plan, bodies, low, high)
    _list(words, parts)
    _legend(figure, parts, bodies)
    count = scene.data["vehicle"]["count"]
    side.set_title(plain(vehicle.name) + (f", one of {count}" if count > 1 else ""), loc="left")
    return figure


def draw_view(axes, vehicle, view):
    """Draw a vehicle's nominal position in one view, ``"side"`` or ``"plan"``, into axes, without texts."""
    upright, bodies = dict(VIEWS)[view], vehicle.data["bodies"]
    parts = [*_elements(vehicle), *_joints(vehicle)]
    low, high = _limits(bodies, parts)
    for name, body in bodies.items():
        _draw_body(axes, name, body, view, upright)
    _draw_parts(axes, parts, view, upright)
    _rails(axes if view == "side" else None, axes if view == "plan" else None, bodies, low, high)
    axes.set(xlabel="x, forward / m", ylabel=("y, to the left / m", "z, up / m")[upright - 1], aspect="equal")
    axes.set(xlim=(low[0] - 0.3, high[0] + 0.3), ylim=(low[upright] - 0.15, high[upright] + 0.15))


def _elements(vehicle):
    """Return the force elements of a vehicle as `Part`."""
    bodies = vehicle.data["bodies"]
    parts = []
    for item in vehicle.data["elements"]:
        if "at" in item:
            ends = ends_of(item)
        else:  # it acts between bodies as wholes
            ends = np.array([bodies[name]["position"] for name in item["bodies"] if name in bodies])[[-1, -1]]
        along = np.zeros(3)
        if item.get("direction", "line") != "line":
            along["xyz".index(item["direction"])] = 1.0
        parts.append(Part(len(parts) + 1, item["name"], item["kind"], item["bodies"], ends, along))
    return parts


def _joints(vehicle):
    """Joints, those of axle boxes included; a coordinate that follows the frame is at its body."""
    data = vehicle.data
    first = len(data["elements"]) + 1
    items = [(item["name"], item["bodies"], item.get("at")) for item in data["joints"]]
    items += [
        (name, [body["wheelset"], name], body["position"])
        for name, body in data["bodies"].items()
        if body["kind"] == "axle_box"
    ]
    parts = []
    for name, pair, at in items:
        ends = np.array(data["bodies"][pair[0]]["position"] if at is None else at, float).reshape(-1, 3)[[0, -1]]
        parts.append(Part(first + len(parts), name, "joint", pair, ends))
    return parts


def _limits(bodies, parts):
    """Return the smallest and largest x, y, z of all bodies and parts, m."""
    corners = [part.ends for part in parts]
    for body in bodies.values():
        half = _half(body)
        corners.append(np.array(body["position"]) + [-half, half])
    corners = np.concatenate(corners)
    return corners.min(axis=0), corners.max(axis=0)


def _half(body):
    """Return half of the dimensions of a body along x, y and z, m."""
    if body["kind"] == "wheelset":
        radius = body["rolling_radius"]
        return np.array([radius, body["tape_circle_half_distance"] + 0.5 * WHEEL_WIDTH, radius])
    return 0.5 * box_of(body)


def _draw_body(axes, name, body, view, upright):
    x, *rest = body["position"]
    across, half = rest[upright - 1], _half(body)
    look = {"facecolor": "0.94", "edgecolor": "0.45", "linewidth": 0.8, "zorder": 1, "gid": f"body:{name}:{view}"}
    if body["kind"] == "wheelset":
        look |= {"facecolor": "0.82", "edgecolor": "0.2", "zorder": 2}
        if view == "side":
            axes.add_patch(Circle((x, across), body["rolling_radius"], **look))
        else:
            reach, radius = body["tape_circle_half_distance"], body["rolling_radius"]
            for centre in (-reach, reach):
                axes.add_patch(Rectangle((x - radius, centre - 0.5 * WHEEL_WIDTH), 2 * radius, WHEEL_WIDTH, **look))
            axes.plot([x, x], [-reach - 0.25, reach + 0.25], color="0.2", linewidth=1.5, zorder=2)
    else:
        if body["kind"] != "body":  # an axle box, on its own or part of its wheelset
            look |= {"zorder": 3, "linestyle": "-" if body["kind"] == "axle_box" else ":", "facecolor": "none"}
        corner = (x - half[0], across - half[upright])
        axes.add_patch(Rectangle(corner, 2 * half[0], 2 * half[upright], **look))


def _draw_parts(axes, parts, view, upright):
    """Draw a mark for each part, the line between its ends, and a stroke along the direction in which it acts.

    Return the marks' positions (m) with the size of the largest mark (points).
    """
    places = _by_position(parts, upright)
    for (x, across), here in places.items():
        for k, (_, name, kind, _, ends, along) in enumerate(here):
            color = MARKS[kind]["color"]
            if math.hypot(*(ends[1] - ends[0])[[0, upright]]) > 1e-9:
                axes.plot(ends[:, 0], ends[:, upright], color=color, linewidth=1.2, zorder=4)
            if along[0] or along[upright]:
                stroke = ends.mean(axis=0) + 0.2 * np.array([-along, along])
                axes.plot(stroke[:, 0], stroke[:, upright], color=color, linewidth=1.2, zorder=4)
            size = _size(len(here) - 1 - k)
            gid = f"{'joint' if kind == 'joint' else 'element'}:{name}:{view}"
            axes.plot(x, across, linestyle="", markersize=size, markeredgewidth=0.9, zorder=5, gid=gid, **MARKS[kind])
    return {place: _size(len(here) - 1) for place, here in places.items()}


def _by_position(parts, upright):
    """Return the parts by the position (m) of their middle in a view."""
    places = {}
    for part in parts:
        middle = part.ends.mean(axis=0)
        places.setdefault((round(middle[0], 2), round(middle[upright], 2)), []).append(part)
    return places


def _size(below):
    """Return the size of a mark, points, below which other marks are drawn at the same position."""
    return MARK + min(1.8 * below, 8.0)


def _names(bodies):
    """Texts and the places that they belong to in the side view: names of bodies, but for axle boxes."""
    texts = []
    for name, body in bodies.items():
        x, _, z = body["position"]
        if body["kind"] in ("body", "wheelset"):
            texts.append((name.replace("_", " "), (x, z + _half(body)[2] if body["kind"] == "body" else 0.0)))
    return texts


def _numbers(parts):
    """Numbers and their places in the plan view; those of parts at one place stand together."""
    return [(",".join(str(part.number) for part in here), place) for place, here in _by_position(parts, 1).items()]


def _label(axes, texts, spots, scale):
    """Write each text near its position (m), if possible without covering marks (m) or other texts."""
    points = 72.0 * scale
    taken = [(points * x, points * y, size, size) for (x, y), size in spots.items()]
    for text, place in texts:
        x, y = points * np.array(place)
        width, height, size = LETTER[0] * len(text), LETTER[1], spots.get(place, MARK)
        aside, over = 0.5 * (width + size) + 2.0, 0.5 * (height + size) - 1.0
        tries = [(aside, 0.0), (-aside, 0.0), (0.0, -over), (0.0, over), (aside, over), (aside, -over), (-aside, over),
                 (-aside, -over), (0.0, 2 * over), (0.0, -2 * over)]  # fmt: skip
        if not text[0].isdigit():
            tries = [(0.0, turn * (0.5 + k) * height + turn * 2.0) for k in range(4) for turn in (-1, 1)]
        hits = [sum(_meet((x + dx, y + dy, width, height), other) for other in taken) for dx, dy in tries]
        dx, dy = tries[int(np.argmin(hits))]
        taken.append((x + dx, y + dy, width, height))
        look = {"textcoords": "offset points", "ha": "center", "va": "center", "fontsize": 6.5, "zorder": 6}
        axes.annotate(text, place, (dx, dy), annotation_clip=False, **look)


def _meet(one, other):
    """Whether two boxes (centre, width and height) overlap."""
    return abs(one[0] - other[0]) < 0.5 * (one[2] + other[2]) and abs(one[1] - other[1]) < 0.5 * (one[3] + other[3])


def _rails(side, plan, bodies, low, high):
    """Draw the rails at the height of their highest points, if a vehicle has wheelsets, in the views that are given."""
    reach = {b["tape_circle_half_distance"] for b in bodies.values() if b["kind"] == "wheelset"}
    ends = [low[0] - 0.5, high[0] + 0.5]
    look = {"color": "0.6", "linewidth": 1.6, "zorder": 0}
    if reach and side is not None:
        side.plot(ends, [0.0, 0.0], **look)
    if reach and plan is not None:
        for y in (-max(reach), max(reach)):
            plan.plot(ends, [y, y], **look)


def _list(words, parts):
    """Write the list of numbers and names of parts, column by column."""
    words.set_axis_off()
    rows = -(-len(parts) // COLUMNS)
    for k, part in enumerate(parts):
        column, row = divmod(k, rows)
        to_frame = ", to the moving frame" if FRAME_NAME in part.bodies else ""
        at = (column / COLUMNS, 1.0 - (row + 0.5) / rows)
        words.text(*at, f"{part.number} {part.name}{to_frame}", transform=words.transAxes, fontsize=6.5, va="center")


def _legend(figure, parts, bodies):
    """Draw the legend of marks, with the number of parts of each kind, and of boxes."""
    kinds = [part.kind for part in parts]
    handles = [
        Line2D([], [], linestyle="", markersize=4.5, label=f"{kind.replace('_', ' ')} ({kinds.count(kind)})", **look)
        for kind, look in MARKS.items()
        if kind in kinds
    ]
    if any(body["kind"] != "wheelset" for body in bodies.values()):
        look = {"facecolor": "0.94", "edgecolor": "0.45", "label": "body: box of its mass and moments of inertia"}
        handles.append(Rectangle((0, 0), 1, 1, **look))
    if handles:
        figure.legend(handles=handles, loc="outside upper right", ncols=5, fontsize=7)
