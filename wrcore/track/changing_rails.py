"""Rails that change along the track, and wheels out of round: the rail section under each wheel during a run.

The kernels of search and patches use one rail profile per wheel. On a changing rail this profile is the section at the
wheel's arc length, interpolated in a table (`wrcore.contact.changing_rails.section_table`). It is written to the
arrays of the wheel before contact is searched, but only the blocks that the search may use. Unchanged sections are not
written again.

A wheel out of round is modelled as a round wheel on a rail whose sections repeat with each revolution, as those of a
corrugated rail repeat with each wave. Its angle is that of rolling without slip, s over the mean of the wheelset's
radii, and so follows from the state. A run begins with round wheels; the out-of-roundness is blended in over the first
half revolution.
"""

import math
from typing import NamedTuple

import numpy as np

from wrcore.bodies.body import STATE_SIZE, VELOCITY
from wrcore.bodies.vector import copy_into
from wrcore.contact.changing_rails.section_table import (
    AHEAD,
    BEND,
    HEIGHT,
    PAD,
    PER_CELL,
    ROWS,
    SECOND,
    SLOPE,
    STRETCH,
    U_STEP,
)
from wrcore.contact.search.detection import SPATIAL
from wrcore.contact.search.geometry import MARGIN, PARTS, RAIL_COSINE, RAIL_RESERVE, SAFETY, SCAN_STEP
from wrcore.contact.search.reduction import MAXIMUM
from wrcore.contact.search.scan import first_zone, leaves_cells, make_window, near_blocks
from wrcore.contact.search.strip import CHANGED, LIFT, make_pose
from wrcore.contact.search.strip import LEAN as LEAN_AHEAD
from wrcore.kernels.jit import FUSED, jit
from wrcore.track.flexible_track import displacement
from wrcore.track.track import arc_length_at
from wrcore.wheels.contact_model import contact_of
from wrcore.wheels.motion import MOTION, motion_of

TRAVEL = 0.02
"""Maximum step of a run while a wheelset is on a changing rail, m."""

BEGIN, STEP, LAST, PERIOD, LEAD, LEAN, START, END, FADE, STRIDE = range(10)
"""Columns of the layout of a table under a wheel. BEGIN: arc length of the first section (m). STEP: distance of the
sections (m). LAST: index of the last section. PERIOD: distance after which sections repeat (in steps; 0: never).
LEAD: distance by which yaw moves the wheel's section ahead (m/rad). LEAN: 1 if patches are inclined along the track as
the rail, 0 if the rail is level. START, END: arc lengths between which repeating sections exist (m). FADE: length over
which these are blended in and out (m). STRIDE: maximum step of a run there (m)."""
N_LAYOUT = 10
"""Number of columns of a layout."""

NEIGHBOUR_CELLS = 2
"""Margin in cells: nodes are also written for this many cells on either side of the written range."""

BOUNDS = 2 * PARTS
"""Number of rows of bounds of gaps per node of the wheel."""

TABLE, PLACE, YAW, IN_STRETCH, BOUNDS_FROM = range(5)
"""Columns that identify the section in a wheel's arrays: its table, its position in the table (in steps), the yaw for
which it was interpolated, the stretch whose bounds of gaps are written, and the first row of these."""
KNOWN = 5
"""Number of these columns."""


class Crossing(NamedTuple):
    """Sections of changing rails, and of rails under wheels out of round, for kernels; all arrays are empty without
    these."""

    sections: np.ndarray
    """(tables, n, 2, ROWS, m): see `wrcore.contact.changing_rails.section_table.SectionTable`."""
    strips: np.ndarray
    """(tables, 2, m): data of the wheel's strips over the sections, see `SectionTable`."""
    bounds: np.ndarray  # (tables, 1 + stretches, rows, blocks)
    tables: np.ndarray
    """(k, 2, n) int: tables that each wheel passes, in this order, filled up with -1; all -1 for a round wheel on a
    rail that does not change."""
    laid: np.ndarray  # (k, 2, n, N_LAYOUT): layout of each table, `BEGIN` to `STRIDE`


def no_crossing():
    """Return an empty `Crossing`, for rails that do not change."""
    sizes = (0, 0, 2, ROWS, 0), (0, 2, 0), (0, 0, 0, 0)
    return Crossing(*map(np.zeros, sizes), np.zeros((0, 2, 1), np.int64), np.zeros((0, 2, 1, N_LAYOUT)))


def crossing_of(tables, of_wheels):
    """Build the `Crossing` of a list of `SectionTable` and the tables that each wheel passes.

    ``of_wheels`` (2 k wheels) contains for each wheel, in order, pairs of a table's number and its layout (N_LAYOUT,).
    """
    parts = (_stacked([getattr(one, name) for one in tables]) for name in ("sections", "strips", "bounds"))
    shape = len(of_wheels), max(map(len, of_wheels))
    numbers, laid = np.full(shape, -1), np.zeros((*shape, N_LAYOUT))
    for wheel, passed in enumerate(of_wheels):
        for i, (table, row) in enumerate(passed):
            numbers[wheel, i], laid[wheel, i] = table, row
    return Crossing(*parts, numbers.reshape(-1, 2, shape[1]), laid.reshape(-1, 2, shape[1], N_LAYOUT))


def layout_of_rail(table, begin, lead):
    """Return the layout of a rail's `SectionTable` under a wheel whose tape circle is ``lead`` (m) from the middle."""
    return [begin, table.step, len(table.sections) - 1, 0.0, lead, 1.0, -math.inf, math.inf, 1.0, TRAVEL]


def layout_of_wheel(table, start, angle, radius, shortest):
    """Return the layout of the `SectionTable` of a wheel out of round.

    At arc length ``start`` (m) the wheel's ``angle`` (rad) is in contact; ``radius`` (m) is the mean of the wheelset's
    radii. ``shortest`` (m) is the minimum wavelength of the out-of-roundness, which limits the step."""
    begin, step = start + (table.begin - angle) * radius, table.step * radius
    turn, stride = 2.0 * math.pi, max(min(TRAVEL, 0.25 * shortest), 1e-3)
    last, fade = len(table.sections) - 1, 0.5 * turn * radius
    return [begin, step, last, turn / table.step, 0.0, 0.0, start, math.inf, fade, stride]  # unlimited both ways


def layout_of_corrugation(table, corrugation, lead):
    """Return the layout of the `SectionTable` of a `Corrugation`; ``lead`` as for `layout_of_rail`."""
    begin, last, wave = corrugation.begin, len(table.sections) - 1, corrugation.wavelength
    stride, end = min(TRAVEL, 0.25 * wave), begin + corrugation.length
    return [
        begin + table.begin, table.step, last, wave / table.step, lead, 1.0, begin, end, corrugation.fade, stride
    ]  # fmt: skip


def _stacked(arrays):
    """Stack arrays of equal dimension but different shapes; smaller ones are padded with zeros at the end."""
    sizes = np.max([array.shape for array in arrays], axis=0)
    return np.array([np.pad(array, [(0, more) for more in sizes - array.shape]) for array in arrays])


def with_copied_arrays(geometry):
    """Return a `ContactGeometry` with copies of the arrays to which sections are written."""
    names = "rail", "scan_rail", "along", "zone_gaps"
    return geometry._replace(**{name: getattr(geometry, name).copy() for name in names})


@jit(allocates=False)
def lay_sections(model, state, work):
    """Write the rail sections under all wheels to the wheels' arrays, for the motions in ``work``.

    Only blocks near the wheel, which may come into contact, are written."""
    crossing = model.crossing
    for k in range(crossing.tables.shape[0]):
        s = arc_length_at(model, state, work, k)
        for wheel in range(2):
            yaw = work.motions[k, wheel, MOTION.side] * work.motions[k, wheel, MOTION.ex]
            at = _passed(crossing, k, wheel, s, yaw)
            table, laid = crossing.tables[k, wheel, at], crossing.laid[k, wheel, at]
            if table < 0:
                continue
            contact, known, last = contact_of(model.contact, k, wheel), work.seen[k, wheel], laid[LAST]
            geometry = contact.geometry
            if table != known[TABLE]:
                known[:] = math.nan
                known[TABLE] = table
            place, share = _section_index(laid, s + laid[LEAD] * yaw), 1.0
            if laid[PERIOD] > 0.0:
                share = abs(s - laid[START]) / laid[FADE]
                if laid[END] < math.inf:
                    share = min(s - laid[START], laid[END] - s) / laid[FADE]
                if share <= 0.0:
                    place = last
            if not place > 0.0:  # also for NaN, in a non-finite stage
                place = 0.0
            place = min(place, last)
            changed = 0.0 < place < last
            if not changed:
                yaw = 0.0
            if not (place == known[PLACE] and yaw == known[YAW]):
                known[PLACE], known[YAW] = place, yaw
                work.blocks[k, wheel], geometry.along[0, CHANGED] = 0, 1.0 if changed else 0.0
            stretch = 1 + int(place) // STRETCH if changed else 0
            blocks = _blocks_at_hand(model, crossing.bounds[table, stretch], stretch, state, k, wheel, work)
            blocks &= ~work.blocks[k, wheel] & (~np.uint64(0) >> np.uint64(64 - geometry.zone_gaps.shape[1]))
            work.blocks[k, wheel] |= blocks
            while blocks > 0:
                begin, end, blocks = first_zone(blocks, geometry.block)
                interpolate(
                    crossing.sections[table], crossing.strips[table], laid, place, yaw / laid[STEP], share,
                    work.section, geometry, contact.reduction == MAXIMUM, begin, end,
                )  # fmt: skip


@jit(allocates=False, fastmath=FUSED)
def _blocks_at_hand(model, bounds, stretch, state, k, wheel, work):
    """Return the blocks of the scan that the search may use, one bit each.

    If the ``bounds`` of a stretch are applicable, these are the blocks near the wheel and their neighbours, else all.
    The bounds are written to the search's array ``zone_gaps``."""
    contact, known = contact_of(model.contact, k, wheel), work.seen[k, wheel]
    geometry, m = contact.geometry, motion_of(work.motions[k, wheel])
    y, z = displacement(model, state, k, wheel)
    pose = make_pose(m.side, m.y - y, m.z - z, m.side * m.ex, m.side * m.ey, m.side * m.ez, True)
    window, cells = make_window(geometry, pose), geometry.scan_rail.shape[1]
    node, tell = window.grid.node, stretch > 0 and contact.detection == SPATIAL and not contact.strips.strips
    tell = tell and not leaves_cells(pose) and 2 <= node < geometry.scan_wheel.shape[1] - cells
    first, end = (BOUNDS * (node - 1), BOUNDS * (node + 2)) if tell else (0, len(geometry.zone_gaps))
    if stretch != known[IN_STRETCH] or first != known[BOUNDS_FROM]:
        known[IN_STRETCH], known[BOUNDS_FROM] = stretch, first
        for i in range(first, end):
            copy_into(geometry.zone_gaps[i], bounds[i])
    if not tell:
        return ~np.uint64(0)
    near = near_blocks(geometry, window)
    return near | near << np.uint64(1) | near >> np.uint64(1)


@jit(allocates=False, forceinline=True)
def _passed(crossing, k, wheel, s, yaw):
    """Return the index of the table on which a wheel is, or was last."""
    at = 0
    for i in range(1, crossing.tables.shape[2]):
        laid = crossing.laid[k, wheel, i]
        if crossing.tables[k, wheel, i] >= 0 and s + laid[LEAD] * yaw >= laid[BEGIN]:
            at = i
    return at


@jit(allocates=False, forceinline=True)
def _section_index(laid, s):
    """Return the position of an arc length (m) among the sections, in steps.

    With repeating sections it is at least `PAD` and less than one period larger."""
    place = (s - laid[BEGIN]) / laid[STEP]
    return PAD + (place - PAD) % laid[PERIOD] if laid[PERIOD] > 0.0 else place


@jit(allocates=False)
def interpolate(sections, strips, laid, place, yaw, share, scratch, geometry, curved, low, high):
    """Write the section at ``place`` (in steps) to the cells of the scan and to their nodes.

    Cells are those from ``low`` to before ``high``. ``yaw`` is the wheel's yaw in steps per metre. Second derivatives
    are written if ``curved``. A ``share`` below 1 blends the section with the plain rail. ``scratch`` is
    (ROWS + 4, m)."""
    rail, along, cells = geometry.rail, geometry.along, (geometry.rail.shape[0] - 1) // PER_CELL
    low, high = max(int(low) - MARGIN, 0), min(int(high) - MARGIN, cells)
    first, size = PER_CELL * max(low - NEIGHBOUR_CELLS, 0), min(PER_CELL * (high + NEIGHBOUR_CELLS) + 2, rail.shape[0])
    last, begin = int(laid[LAST]) - 1, first
    while begin < size:  # runs of nodes between the same two sections
        i, end = _step_of(place + yaw * strips[1, begin], last), begin + 1
        while end < size and _step_of(place + yaw * strips[1, end], last) == i:
            end += 1
        _fill_weights(strips[1], place - i, yaw, begin, end, scratch[ROWS:])
        for row in range(ROWS):
            if row != SECOND or curved:
                _mix(sections[i, 0, row], sections[i + 1, 0, row], sections[i, 1, row], sections[i + 1, 1, row],
                     scratch[ROWS:], begin, end, scratch[row])  # fmt: skip
        begin = end
    if 0.0 < share < 1.0:
        _fade(sections[0, 0], share * share * (3.0 - 2.0 * share), first, size, scratch)
    _lay_nodes(strips[0], scratch, rail, along, curved, first, size)
    if laid[LEAN] == 0.0:
        _keep_level(sections[0, 0, HEIGHT], rail, along, first, size)
    _lay_cells(rail, geometry.scan_rail, low, high)


@jit(allocates=False, forceinline=True)
def _step_of(place, last):
    return min(max(int(place), 0), last)


@jit(allocates=False, fastmath=FUSED)
def _fill_weights(leads, place, yaw, begin, end, weights):
    """Fill ``weights`` (4, m) with those of cubic Hermite polynomials at the nodes from ``begin`` to before ``end``."""
    for j in range(np.uint64(begin), np.uint64(end)):
        t = place + yaw * leads[j]
        s = 1.0 - t
        weights[0, j], weights[1, j] = s * s * (1.0 + 2.0 * t), t * t * (1.0 + 2.0 * s)
        weights[2, j], weights[3, j] = t * s * s, -s * t * t


@jit(allocates=False, fastmath=FUSED)
def _mix(low, high, low_rate, high_rate, weights, begin, end, out):
    a, b, c, d = weights[0], weights[1], weights[2], weights[3]
    for j in range(np.uint64(begin), np.uint64(end)):
        out[j] = a[j] * low[j] + b[j] * high[j] + c[j] * low_rate[j] + d[j] * high_rate[j]


@jit(allocates=False)
def _fade(plain, share, first, end, section):
    """Reduce the difference of a section from the plain rail's to a ``share``, in place."""
    for row in range(ROWS):
        for j in range(first, end):
            section[row, j] = plain[row, j] + share * (section[row, j] - plain[row, j])


@jit(allocates=False)
def _keep_level(plain, rail, along, first, end):
    """Keep the rail under a wheel out of round level: store the height difference in ``along`` and no inclination."""
    for j in range(first, end):
        along[j, LIFT], along[j, LEAN_AHEAD] = plain[j] - rail[j, 0], 0.0


@jit(allocates=False, fastmath=FUSED)
def _lay_nodes(curvatures, section, rail, along, curved, first, end):
    """Write a section to the nodes of a rail from ``first`` to before ``end``."""
    for j in range(np.uint64(first), np.uint64(end)):
        rail[j, 0], rail[j, 1] = section[HEIGHT, j], section[SLOPE, j]
        x, curvature = section[AHEAD, j], curvatures[j]
        square = (curvature * x) * (curvature * x)
        lift = 0.5 * curvature * x * x * (1.0 + square * (0.25 + square * (0.125 + square * 0.078125)))
        along[j, 0], along[j, 1], along[j, 2] = x, section[BEND, j], lift  # R - sqrt(R^2 - x^2)
        along[j, 3] = x
        if curved:
            rail[j, 2] = section[SECOND, j]


@jit(allocates=False, fastmath=FUSED)
def _lay_cells(rail, scan_rail, low, high):
    """Write the cells of the scan from ``low`` to before ``high``: cubics through the nodes at their ends, reserves and
    inclinations."""
    cells = (rail.shape[0] - 1) // PER_CELL
    inverse = 1.0 / SCAN_STEP
    before = here = 0.0
    for k in range(max(low - 1, 0), min(high, cells) + 1):
        beyond, at = 0.0, MARGIN + k
        if k < cells:
            for j in range(PER_CELL):
                beyond = max(beyond, abs(rail[PER_CELL * k + j + 1, 1] - rail[PER_CELL * k + j, 1]))
        if low <= k < high:
            start, end = rail[PER_CELL * k], rail[PER_CELL * (k + 1)]
            rise = (end[0] - start[0]) * inverse
            scan_rail[0, at], scan_rail[1, at] = start[0], start[1]
            scan_rail[2, at] = (3.0 * rise - 2.0 * start[1] - end[1]) * inverse
            scan_rail[3, at] = (start[1] + end[1] - 2.0 * rise) * inverse * inverse
            mean = 0.5 * (start[1] + end[1])
            scan_rail[RAIL_COSINE, at] = 1.0 / math.sqrt(1.0 + mean * mean)
        if k > low:
            largest = max(before, here, beyond) / U_STEP
            scan_rail[RAIL_RESERVE, at - 1] = SAFETY * 0.125 * SCAN_STEP * SCAN_STEP * largest
        before, here = here, beyond


@jit(allocates=False)
def shorten_step(model, state, work, clock, at):
    """Shorten the next step, ``clock[at]`` (s), on changing rails and with wheels out of round.

    The step ends at the latest where a changing range begins; within such a range its maximum is the STRIDE (m)."""
    crossing = model.crossing
    for k in range(crossing.tables.shape[0]):
        first = STATE_SIZE * model.bodies.wheelsets[k] + VELOCITY
        speed, s = math.hypot(state[first], state[first + 1]), arc_length_at(model, state, work, k)
        for wheel in range(2):
            for i in range(crossing.tables.shape[2]):
                if crossing.tables[k, wheel, i] >= 0:
                    left = _unchanged(crossing.laid[k, wheel, i], s)
                    if speed * clock[at] > left:
                        clock[at] = left / speed


@jit(allocates=False, forceinline=True)
def _unchanged(laid, s):
    """Maximum distance of a wheel in one step, m: up to the next change of its section, at least the STRIDE."""
    end = laid[BEGIN] + laid[STEP] * laid[LAST]
    left = max(laid[BEGIN] - s, s - end, laid[STRIDE])
    if laid[PERIOD] > 0.0:
        place, left = _section_index(laid, s), laid[STRIDE]
        if place > laid[LAST]:
            left = max((PAD + laid[PERIOD] - place) * laid[STEP], left)
        if laid[END] < math.inf:
            left = max(left, laid[START] - s, s - laid[END])
    return left
