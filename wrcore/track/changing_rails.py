"""Rails that change along the track, and wheels out of round, under way: each wheel has a section of its own, laid anew
as it goes.

The kernels of search and patches know one rail profile per wheel. On such a rail it is the section that the wheel sees
(`wrcore.contact.changing_rails.section_table`), interpolated for the arc length at which it is, written into the
wheel's own arrays before its contact is looked for: those blocks of it that the search may look at. Where nothing
changes nothing is written.

A wheel out of round is a round one on a rail whose sections come again with each turn, as a corrugated rail's do with
each wave. Its angle is that of rolling
without slip, s over the mean of the wheelset's radii: it follows from the state. A run begins with round wheels; they
take their shape over the first half turn.
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
"""Longest step of a run while a wheelset is on such a rail, m."""

BEGIN, STEP, LAST, PERIOD, LEAD, LEAN, START, END, FADE, STRIDE = range(10)
"""Of a wheel's table: arc length of its first section, distance of the sections (m), number of the last one, distance
after which they come again (in steps; 0: never), how far ahead a yaw moves what the wheel sees (m/rad), whether
patches lean with the rail (1) or it is level (0), arc lengths between which sections that come again are there, length
over which these come and go (m), and longest step on all (m)."""
N_LAYOUT = 10

NEIGHBOUR_CELLS = 2
"""Cells on either side of those that are laid whose nodes are."""

BOUNDS = 2 * PARTS
"""Rows of bounds of gaps per node of the wheel."""

TABLE, PLACE, YAW, IN_STRETCH, BOUNDS_FROM = range(5)
"""What is known of the section that a wheel's arrays hold: its table and place there, in steps, the yaw it is seen in,
the stretch whose bounds of gaps are there, and from which row on."""
KNOWN = 5


class Crossing(NamedTuple):
    """Sections of the rails that change, and under wheels out of round, for kernels; all arrays are empty where there
    is none."""

    sections: np.ndarray
    """(tables, n, 2, ROWS, m): see `wrcore.contact.changing_rails.section_table.SectionTable`."""
    strips: np.ndarray
    """(tables, 2, m): of the strips over it, see `SeenTable`."""
    bounds: np.ndarray  # (tables, 1 + stretches, rows, blocks)
    tables: np.ndarray
    """(k, 2, n) int: of each wheel the tables that it passes one after the other, -1 where there are less; all -1 for a
    round one on a rail that is the same everywhere."""
    laid: np.ndarray  # (k, 2, n, LAID): `BEGIN` to `STRIDE` of each


def no_crossing():
    """A `Crossing` where no rail changes."""
    sizes = (0, 0, 2, ROWS, 0), (0, 2, 0), (0, 0, 0, 0)
    return Crossing(*map(np.zeros, sizes), np.zeros((0, 2, 1), np.int64), np.zeros((0, 2, 1, N_LAYOUT)))


def crossing_of(tables, of_wheels):
    """`Crossing` of a list of `SeenTable` and of what each wheel (2 k) passes one after the other: pairs of a table's
    number and how it is laid (LAID,)."""
    parts = (_stacked([getattr(one, name) for one in tables]) for name in ("sections", "strips", "bounds"))
    shape = len(of_wheels), max(map(len, of_wheels))
    numbers, laid = np.full(shape, -1), np.zeros((*shape, N_LAYOUT))
    for wheel, passed in enumerate(of_wheels):
        for i, (table, row) in enumerate(passed):
            numbers[wheel, i], laid[wheel, i] = table, row
    return Crossing(*parts, numbers.reshape(-1, 2, shape[1]), laid.reshape(-1, 2, shape[1], N_LAYOUT))


def layout_of_rail(table, begin, lead):
    """How the `SeenTable` of a rail is laid under a wheel whose tape circle is ``lead`` (m) from the middle."""
    return [begin, table.step, len(table.sections) - 1, 0.0, lead, 1.0, -math.inf, math.inf, 1.0, TRAVEL]


def layout_of_wheel(table, start, angle, radius, shortest):
    """How the `SeenTable` of a wheel out of round is laid: at the arc length ``start`` (m) the ``angle`` (rad) of a
    wheelset with a mean ``radius`` (m) touches; what is not round is no shorter than ``shortest`` (m)."""
    begin, step = start + (table.begin - angle) * radius, table.step * radius
    turn, stride = 2.0 * math.pi, max(min(TRAVEL, 0.25 * shortest), 1e-3)
    last, fade = len(table.sections) - 1, 0.5 * turn * radius
    return [begin, step, last, turn / table.step, 0.0, 0.0, start, math.inf, fade, stride]  # without end, either way


def layout_of_corrugation(table, corrugation, lead):
    """As `layout_of_rail`, of a `Corrugation`."""
    begin, last, wave = corrugation.begin, len(table.sections) - 1, corrugation.wavelength
    stride, end = min(TRAVEL, 0.25 * wave), begin + corrugation.length
    return [
        begin + table.begin, table.step, last, wave / table.step, lead, 1.0, begin, end, corrugation.fade, stride
    ]  # fmt: skip


def _stacked(arrays):
    """Arrays of one dimension but of different sizes in one, with zeros behind the smaller ones."""
    sizes = np.max([array.shape for array in arrays], axis=0)
    return np.array([np.pad(array, [(0, more) for more in sizes - array.shape]) for array in arrays])


def with_copied_arrays(geometry):
    """A `ContactGeometry` with arrays of its own where sections are written."""
    names = "rail", "scan_rail", "along", "zone_gaps"
    return geometry._replace(**{name: getattr(geometry, name).copy() for name in names})


@jit(allocates=False)
def lay_sections(model, state, work):
    """Write the sections that the wheels see, whose motions are in ``work``, into their arrays: what may touch them."""
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
            if not place > 0.0:  # a stage that is not finite, too
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
    """Blocks of the scan that the search may look at, a bit for each, where the ``bounds`` of a stretch tell: those
    near the wheel, and their neighbours; else all. Has these bounds written where the search looks them up."""
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
    """Which of its tables a wheel is on, or was on last."""
    at = 0
    for i in range(1, crossing.tables.shape[2]):
        laid = crossing.laid[k, wheel, i]
        if crossing.tables[k, wheel, i] >= 0 and s + laid[LEAD] * yaw >= laid[BEGIN]:
            at = i
    return at


@jit(allocates=False, forceinline=True)
def _section_index(laid, s):
    """Place of an arc length (m) among the sections, in steps; of a wheel's from `PAD` to a turn beyond it."""
    place = (s - laid[BEGIN]) / laid[STEP]
    return PAD + (place - PAD) % laid[PERIOD] if laid[PERIOD] > 0.0 else place


@jit(allocates=False)
def interpolate(sections, strips, laid, place, yaw, share, scratch, geometry, curved, low, high):
    """Write the section at a place, for a wheel that yaws by so many steps per metre, into the cells of the scan from
    ``low`` to before ``high`` and into the nodes there; with second derivatives if it is ``curved``. Below a ``share``
    of 1 it goes over into the plain rail. ``scratch`` is (ROWS + 4, m)."""
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
    """Write the four weights of cubic Hermite polynomials at nodes."""
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
    """Leave a ``share`` of what a section has more than the plain rail's."""
    for row in range(ROWS):
        for j in range(first, end):
            section[row, j] = plain[row, j] + share * (section[row, j] - plain[row, j])


@jit(allocates=False)
def _keep_level(plain, rail, along, first, end):
    """Have the wheel out of round touch a rail that is no higher than it is, and level."""
    for j in range(first, end):
        along[j, LIFT], along[j, LEAN_AHEAD] = plain[j] - rail[j, 0], 0.0


@jit(allocates=False, fastmath=FUSED)
def _lay_nodes(curvatures, section, rail, along, curved, first, end):
    """Write a section into the nodes of a rail."""
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
    """Write cells of the scan, from ``low`` to before ``high``: cubics through the nodes at their ends, reserves and
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
    """Shorten the next step, the entry of ``clock`` (s), so that it neither begins before what a wheel sees changes and
    ends beyond that nor is longer than the stride there."""
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
    """How far a wheel may go in a step, m: to where what it sees of a table changes, or the stride."""
    end = laid[BEGIN] + laid[STEP] * laid[LAST]
    left = max(laid[BEGIN] - s, s - end, laid[STRIDE])
    if laid[PERIOD] > 0.0:
        place, left = _section_index(laid, s), laid[STRIDE]
        if place > laid[LAST]:
            left = max((PAD + laid[PERIOD] - place) * laid[STEP], left)
        if laid[END] < math.inf:
            left = max(left, laid[START] - s, s - laid[END])
    return left
