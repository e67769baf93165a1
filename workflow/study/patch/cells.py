"""The table of exact contact that is looked up, as a run fills it: its cells, what they err by, and what is left over.

Units change where it is drawn and nowhere before: m to mm and µm, rad to mrad.
"""

import math
from contextlib import contextmanager, nullcontext
from typing import NamedTuple

import numpy as np
import pandas as pd
from matplotlib.collections import PatchCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from wrcore.analysis.pictures.style import MM, styled
from wrcore.contact.hertz import damping_factor
from wrcore.contact.normal.gap import group_end
from wrcore.contact.search.approach import LEVEL, pressed_together
from wrcore.contact.search.detection import axle_direction, find_patches
from wrcore.contact.search.reduction import MAX_PATCHES, MOMENT, PATCH_COLUMNS
from wrcore.contact.search.strip import make_pose
from wrcore.run.simulate import output_times
from wrcore.run.simulation import Simulation
from wrcore.scene.description import load_scene
from wrcore.wheels.table.cells import FINER, FIRST, HARD, LEVELS, YAW, YAWS, corner_of, steps_of
from wrcore.wheels.table.lookup import APART, FAR, SADDLE, lobe_end, log_depth_of
from wrcore.wheels.table.store import _PAIRS, WRONG, Pair, pair_of

LOOKED_UP, REFINED, SOLVED = "looked up", "refined", "solved"
"""What becomes of a cell."""

COLORS = "#B3DCF2", "#4FA3DB", "#00558C", "#0B2545", "#E69F00"
"""Of the lattices, coarsest first: blues that darken, and orange for the finest."""

SOLVED_COLOR = "#CC3311"

DOTS = {"marker": ".", "markersize": 1.6, "color": "k", "markeredgewidth": 0.0, "linestyle": ""}

LINES = "-", (0, (4, 1.5)), (0, (1, 1)), (0, (6, 1, 1, 1)), (0, (8, 2))
"""Of the lattices."""


class Across(NamedTuple):
    """A coordinate of a panel."""

    ends: tuple
    """Columns of the cells' ends."""
    lobe: str
    """Column of the lobes."""
    unit: float
    """What is drawn over SI."""


ALONG = Across(("offset_low_m", "offset_high_m"), "offset_m", MM)
DEPTH = Across(("D_low_m", "D_high_m"), "D_m", 1e6)
SLOPE = Across(("slope_low", "slope_high"), "slope", 1e3)


class OwnPair(Pair):
    """A pair's table that takes nothing from what other runs solved, and leaves nothing to them; it has the nodes that
    come with the package, which are those that it would solve."""

    def _read(self):
        """Nothing is known before."""

    def _told(self):
        """Nothing is to be said of a file."""
        return nullcontext()

    def write(self):
        """Nothing is kept."""


@contextmanager
def own_pair(contact):
    """An empty table in place of the one that all runs with a contact share."""
    shared = pair_of(contact)
    name = shared.path.stem.removeprefix("pair_")
    _PAIRS[name] = own = OwnPair(shared.contact, name)
    try:
        yield own
    finally:
        _PAIRS[name] = shared


def filled_by_run(source, overrides):
    """Cells that a run fills an empty table with (`cells_of`), and where its lobes lie (`lobes_of`)."""
    scene = load_scene(source, overrides)
    simulation, settings = Simulation(scene), scene.data["integration"]
    contact = simulation.model.contact
    with own_pair(contact) as pair:
        run = simulation.advance(output_times(0.0, settings["duration"], scene.data["output"]["rate"]))
    name = scene.vehicle.body_names[int(simulation.model.bodies.wheelsets[0])]
    poses = np.column_stack([getattr(run[name], key) for key in ("y_m", "z_m", "roll_rad", "yaw_rad")])
    return cells_of(pair), lobes_of(contact, poses)


def cells_of(pair):
    """Cells of a `Pair`, one a row: lattice (0 is the coarsest), ends in offset (m), slope (1), D (m) and yaw (rad),
    what becomes of it, and its errors in the middle, of N, of the creep force over mu N, of p_max, and what modes leave
    of the creep force."""
    rows = []
    for key, state in pair.cells.items():
        level, _, turn, *first = corner_of(key)
        if level >= LEVELS:  # what a cell gives that is left to the next lattice
            continue
        (offset, slope, depth), width = ends_of(level, first), 2.0 * YAW / 3.0**level
        yaw = width * turn - YAWS * YAW
        normal, force, pressure, left = pair.misses[key]
        rows.append({
            "level": level, "offset_low_m": offset[0], "offset_high_m": offset[1], "slope_low": slope[0],
            "slope_high": slope[1],
            "D_low_m": math.exp(depth[0]), "D_high_m": math.exp(depth[1]), "yaw_low_rad": yaw,
            "yaw_high_rad": yaw + width, "state": {FINER: REFINED, HARD: SOLVED}.get(state, LOOKED_UP),
            "normal_error": normal, "force_error": force, "pressure_error": pressure, "modes_left": left,
        })  # fmt: skip
    return pd.DataFrame(rows)


def ends_of(level, first):
    """Ends of a cell in offset, slope and ln D from its first corner."""
    low = np.array(FIRST) + steps_of(level) * first
    return np.column_stack([low, low + steps_of(level)])


def lobes_of(contact, poses):
    """Where the lobes of both wheels lie in the table, one a row, for poses (n, 4): y, z (m), roll, yaw (rad) of a
    wheelset whose wheels neither come down nor rise. A right wheel is the mirror image of a left one; what lobes press
    each other down by is left out."""
    rows, geometry, overlaps = [], contact.geometry, np.zeros((MAX_PATCHES, PATCH_COLUMNS))
    for y, z, roll, yaw in poses:
        ex, ey, ez = axle_direction(roll, yaw)
        for side in (1.0, -1.0):
            left = side * y, z, side * ex, ey, side * ez
            t = left[0] + geometry.half_distance * ey - geometry.rail_distance
            for depth, u in depths_of(contact, left, overlaps):
                rows.append({"offset_m": t - u, "slope": left[4], "yaw_rad": left[2], "D_m": depth})
    return pd.DataFrame(rows, columns=["offset_m", "slope", "yaw_rad", "D_m"])


def depths_of(contact, left, overlaps):
    """D (m) of each lobe of a left wheel, as damping at rest leaves it, and its place on the wheel's profile (m);
    ``overlaps`` is scratch."""
    geometry, first, found = contact.geometry, 0, []
    left_over = damping_factor(0.0, contact.damping, contact.damping_speed) ** (2.0 / 3.0)
    count = find_patches(geometry, 1.0, *left, True, MOMENT, overlaps)
    pose, sums = make_pose(1.0, *left, True), np.zeros((3, 5))
    while first < count:
        group = group_end(geometry, overlaps, count, first)
        last = lobe_end(geometry, pose, overlaps, first, group, (APART, FAR, SADDLE))
        log_depth, u = log_depth_of(pressed_together(geometry, pose, True, LEVEL, overlaps, first, last, sums))
        found.append((left_over * math.exp(log_depth), u))
        first = last
    return found


@styled
def fig_cells(cells, lobes):
    """Cells over offset and depth, over offset and slope of the axle, and how many of them err by how much."""
    figure = Figure(figsize=(7.2, 7.0), layout="constrained")
    places, errors = figure.subplots(2, 2, height_ratios=(1.25, 1.0))
    draw_cells(places[0], cells, lobes, DEPTH)
    draw_cells(places[1], cells, lobes, SLOPE)
    places[0].set(yscale="log", ylabel="depth D / µm", title="(a) offset and depth")
    places[1].set(ylabel="slope of the axle / mrad", title="(b) offset and slope")
    for axes in places:
        axes.set_xlabel("offset t − u / mm")
    depths = 1e6 * cells["D_low_m"].min(), 1e6 * cells["D_high_m"].max()
    ticks = [tick for tick in (5, 10, 20, 50, 100, 200, 500) if depths[0] <= tick <= depths[1]]
    places[0].set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    places[0].minorticks_off()
    draw_errors(errors[0], cells, "normal_error", [limits[0] for limits in WRONG])
    draw_errors(errors[1], cells, "force_error", [limits[1] for limits in WRONG])
    errors[0].set(xlabel="error of N / %", ylabel="cells that err by less / %", title="(c) normal force")
    errors[1].set(xlabel="error of the creep force / % of μN", title="(d) creep force")
    figure.legend(handles=legend_entries(cells), loc="outside upper center", ncols=4, fontsize=8)
    return figure


def draw_cells(axes, cells, lobes, across):
    """Cells that are looked up or solved as rectangles over the offset and another coordinate, finer ones above; and
    lobes."""
    drawn = {LOOKED_UP: 2.0, SOLVED: 2.5}
    for (level, state), part in cells[cells["state"].isin(drawn)].groupby(["level", "state"]):
        corners = np.column_stack([ALONG.unit * part[[*ALONG.ends]], across.unit * part[[*across.ends]]]).round(9)
        boxes = [Rectangle((x, y), right - x, top - y) for x, right, y, top in np.unique(corners, axis=0)]
        axes.add_collection(PatchCollection(boxes, zorder=drawn[state] + 0.1 * level, **look_of(level, state)))
    axes.plot(ALONG.unit * lobes[ALONG.lobe], across.unit * lobes[across.lobe], zorder=3, **DOTS)
    axes.autoscale_view()


def look_of(level, state):
    """Face and edge of a cell."""
    color = SOLVED_COLOR if state == SOLVED else COLORS[level]
    return {"facecolor": color, "edgecolor": color if level > 1 else "w", "linewidth": 0.8 if level > 1 else 0.25}


def draw_errors(axes, cells, name, limits):
    """Share of each lattice's cells that err by less than a limit, and the limit that they are held against; a cell
    without a solution errs by more than any."""
    for level, part in cells.groupby("level"):
        look = {"color": COLORS[level], "linestyle": LINES[level], "linewidth": 1.6}
        sure = np.sort(part[name].dropna())
        axes.step(100.0 * sure, 100.0 * np.arange(1, len(sure) + 1) / len(part), where="post", **look)
        axes.axvline(100.0 * limits[level], color=COLORS[level], linestyle=(0, (3, 2)), linewidth=0.9, zorder=1)
    axes.set(xscale="log", xlim=(1e-3, 50.0), ylim=(0.0, 100.0))


def legend_entries(cells):
    """Lattices with their steps in the offset, what is solved, lobes, and limits."""
    entries = []
    for level in range(LEVELS):
        label = f"lattice {level + 1}: {MM * steps_of(level)[0]:g} mm"
        entries.append(Line2D([], [], color=COLORS[level], linestyle=LINES[level], linewidth=2.5, label=label))
    if (cells["state"] == SOLVED).any():
        entries.append(Rectangle((0, 0), 1, 1, facecolor=SOLVED_COLOR, label="left to the solver"))
    entries.append(Line2D([], [], label="lobes of the run", **(DOTS | {"markersize": 4})))
    limit = {"color": "0.4", "linestyle": (0, (3, 2)), "linewidth": 0.9}
    return [*entries, Line2D([], [], label="limit of a lattice", **limit)]


def told(cells):
    """Cells of each lattice: how many there are, what becomes of them, and the largest errors of those looked up."""
    found = cells.groupby("level")["state"].value_counts().unstack(fill_value=0)
    worst = cells[cells["state"] == LOOKED_UP].groupby("level")[["normal_error", "force_error"]].max()
    return found.join(worst)
