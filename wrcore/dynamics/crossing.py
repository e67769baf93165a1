"""Rails that change along the track, and wheels out of round, under way: each wheel has a section of its own, laid anew
as it goes.

The kernels of search and patches know one rail profile per wheel. On such a rail it is the section that the wheel sees
(`wrcore.contact.seen_table`), interpolated for the arc length at which it is, written into the wheel's own arrays
before its contact is looked for. Where nothing changes nothing is written.

A wheel out of round is a round one on a rail whose sections come again with each turn, as a corrugated rail's do with
each wave. Its angle is that of rolling
without slip, s over the mean of the wheelset's radii: it follows from the state. A run begins with round wheels; they
take their shape over the first half turn.
"""

import math
from typing import NamedTuple

import numpy as np

from wrcore.contact.geometry import MARGIN, RAIL_COSINE, RAIL_RESERVE, SAFETY, SCAN_STEP
from wrcore.contact.reduction import MAXIMUM
from wrcore.contact.seen_table import AHEAD, BEND, HEIGHT, PAD, PER_CELL, ROWS, S_STEP, SECOND, SLOPE, STRETCH, U_STEP
from wrcore.contact.strip import CHANGED, LIFT
from wrcore.contact.strip import LEAN as LEAN_AHEAD
from wrcore.dynamics.body import STATE_SIZE, VELOCITY
from wrcore.dynamics.motion import MOTION
from wrcore.dynamics.track import arc_length_at
from wrcore.dynamics.vector import copy_into
from wrcore.dynamics.wheel import contact_of
from wrcore.kernels.jit import FUSED, jit

TRAVEL = 0.02
"""Longest step of a run while a wheelset is on such a rail, m."""

BEGIN, STEP, LAST, PERIOD, LEAD, LEAN, START, END, FADE, STRIDE = range(10)
"""Of a wheel's table: arc length of its first section, distance of the sections (m), number of the last one, distance
after which they come again (in steps; 0: never), how far ahead a yaw moves what the wheel sees (m/rad), whether
patches lean with the rail (1) or it is level (0), arc lengths between which sections that come again are there, length
over which these come and go (m), and longest step on all (m)."""
LAID = 10

PLACE, YAW, IN_STRETCH = range(3)
"""What is known of the section that a wheel's arrays hold: its place in the table, in steps, the yaw it is seen in,
and its stretch."""


class Crossing(NamedTuple):
    """Sections of the rails that change, and under wheels out of round, for kernels; all arrays are empty where there
    is none."""

    sections: np.ndarray
    """(tables, n, 2, ROWS, m): see `wrcore.contact.seen_table.SeenTable`."""
    strips: np.ndarray
    """(tables, 2, m): of the strips over it, see `SeenTable`."""
    bounds: np.ndarray  # (tables, 1 + stretches, rows, blocks)
    tables: np.ndarray
    """(k, 2) int: the table of each wheel, -1 for a round one on a rail that is the same everywhere."""
    laid: np.ndarray  # (k, 2, LAID): `BEGIN` to `STRIDE` of each wheel


def no_crossing():
    """A `Crossing` where no rail changes."""
    sizes = (0, 0, 2, ROWS, 0), (0, 2, 0), (0, 0, 0, 0)
    return Crossing(*map(np.zeros, sizes), np.zeros((0, 2), np.int64), np.zeros((0, 2, LAID)))


def crossing_of(tables, of_wheels, laid):
    """`Crossing` of a list of `SeenTable`, the table of each wheel (2 k,), -1: none, and how it is laid (2 k, LAID)."""
    parts = (_stacked([getattr(one, name) for one in tables]) for name in ("sections", "strips", "bounds"))
    return Crossing(*parts, np.reshape(of_wheels, (-1, 2)).astype(np.int64), np.reshape(laid, (-1, 2, LAID)))


def laid_at(table, begin, lead):
    """How the `SeenTable` of a rail is laid under a wheel whose tape circle is ``lead`` (m) from the middle."""
    return [begin, S_STEP, len(table.sections) - 1, 0.0, lead, 1.0, -math.inf, math.inf, 1.0, TRAVEL]


def laid_under(table, start, angle, radius, shortest):
    """How the `SeenTable` of a wheel out of round is laid: at the arc length ``start`` (m) the ``angle`` (rad) of a
    wheelset with a mean ``radius`` (m) touches; what is not round is no shorter than ``shortest`` (m)."""
    begin, step = start + (table.begin - angle) * radius, table.step * radius
    turn, stride = 2.0 * math.pi, max(min(TRAVEL, 0.25 * shortest), 1e-3)
    last, fade = len(table.sections) - 1, 0.5 * turn * radius
    return [begin, step, last, turn / table.step, 0.0, 0.0, start, math.inf, fade, stride]  # without end, either way


def laid_along(table, corrugation, lead):
    """As `laid_at`, of a `Corrugation`."""
    begin, last, wave = corrugation.begin, len(table.sections) - 1, corrugation.wavelength
    stride, end = min(TRAVEL, 0.25 * wave), begin + corrugation.length
    return [
        begin + table.begin, table.step, last, wave / table.step, lead, 1.0, begin, end, corrugation.fade, stride
    ]  # fmt: skip


def _stacked(arrays):
    """Arrays of one dimension but of different sizes in one, with zeros behind the smaller ones."""
    sizes = np.max([array.shape for array in arrays], axis=0)
    return np.array([np.pad(array, [(0, more) for more in sizes - array.shape]) for array in arrays])


def with_own_arrays(geometry):
    """A `ContactGeometry` with arrays of its own where sections are written."""
    names = "rail", "scan_rail", "along", "zone_gaps"
    return geometry._replace(**{name: getattr(geometry, name).copy() for name in names})


@jit(allocates=False)
def lay_sections(model, state, work):
    """Write the sections that the wheels see, whose motions are in ``work``, into their arrays."""
    crossing = model.crossing
    for k in range(crossing.tables.shape[0]):
        s = arc_length_at(model, state, work, k)
        for wheel in range(2):
            table = crossing.tables[k, wheel]
            if table < 0:
                continue
            geometry, laid = contact_of(model.contact, k, wheel).geometry, crossing.laid[k, wheel]
            row, known, last = work.motions[k, wheel], work.seen[k, wheel], laid[LAST]
            yaw = row[MOTION.side] * row[MOTION.ex]
            place, share = _place_of(laid, s + laid[LEAD] * yaw), 1.0
            if laid[PERIOD] > 0.0:
                share = abs(s - laid[START]) / laid[FADE]
                if laid[END] < math.inf:
                    share = min(s - laid[START], laid[END] - s) / laid[FADE]
                if share <= 0.0:
                    place = last
            if not place > 0.0:  # a stage that is not finite, too
                place = 0.0
            place = min(place, last)
            if not 0.0 < place < last:
                yaw = 0.0
            if place == known[PLACE] and yaw == known[YAW]:
                continue
            known[PLACE], known[YAW] = place, yaw
            stretch, geometry.along[0, CHANGED] = 0, 0.0
            if 0.0 < place < last:
                stretch, geometry.along[0, CHANGED] = 1 + int(place) // STRETCH, 1.0
            if stretch != known[IN_STRETCH]:
                known[IN_STRETCH], gaps = stretch, geometry.zone_gaps
                for i in range(gaps.shape[0]):
                    copy_into(gaps[i], crossing.bounds[table, stretch, i])
            interpolate(
                crossing.sections[table], crossing.strips[table], laid, place, yaw / laid[STEP], share, work.section,
                geometry.rail, geometry.along, model.contact.reduction == MAXIMUM,
            )  # fmt: skip
            _lay_cells(geometry.rail, geometry.scan_rail)


@jit(allocates=False, forceinline=True)
def _place_of(laid, s):
    """Place of an arc length (m) among the sections, in steps; of a wheel's from `PAD` to a turn beyond it."""
    place = (s - laid[BEGIN]) / laid[STEP]
    return PAD + (place - PAD) % laid[PERIOD] if laid[PERIOD] > 0.0 else place


@jit(allocates=False)
def interpolate(sections, strips, laid, place, yaw, share, scratch, rail, along, curved):
    """Write the section at a place, for a wheel that yaws by so many steps per metre, into the nodes of a rail; with
    second derivatives if it is ``curved``. Below a ``share`` of 1 it goes over into the plain rail. ``scratch`` is
    (ROWS + 4, m)."""
    last, begin, size = int(laid[LAST]) - 1, 0, rail.shape[0]
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
        _fade(sections[0, 0], share * share * (3.0 - 2.0 * share), size, scratch)
    _lay_nodes(strips[0], scratch, rail, along, curved)
    if laid[LEAN] == 0.0:
        _keep_level(sections[0, 0, HEIGHT], rail, along)


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
def _fade(plain, share, size, section):
    """Leave a ``share`` of what a section has more than the plain rail's."""
    for row in range(ROWS):
        for j in range(size):
            section[row, j] = plain[row, j] + share * (section[row, j] - plain[row, j])


@jit(allocates=False)
def _keep_level(plain, rail, along):
    """Have the wheel out of round touch a rail that is no higher than it is, and level."""
    for j in range(rail.shape[0]):
        along[j, LIFT], along[j, LEAN_AHEAD] = plain[j] - rail[j, 0], 0.0


@jit(allocates=False, fastmath=FUSED)
def _lay_nodes(curvatures, section, rail, along, curved):
    """Write a section into the nodes of a rail."""
    for j in range(np.uint64(rail.shape[0])):
        rail[j, 0], rail[j, 1] = section[HEIGHT, j], section[SLOPE, j]
        x, curvature = section[AHEAD, j], curvatures[j]
        square = (curvature * x) * (curvature * x)
        lift = 0.5 * curvature * x * x * (1.0 + square * (0.25 + square * (0.125 + square * 0.078125)))
        along[j, 0], along[j, 1], along[j, 2] = x, section[BEND, j], lift  # R - sqrt(R^2 - x^2)
        along[j, 3] = x
        if curved:
            rail[j, 2] = section[SECOND, j]


@jit(allocates=False, fastmath=FUSED)
def _lay_cells(rail, scan_rail):
    """Write the cells of the scan: cubics through the nodes at their ends, reserves and inclinations."""
    cells = (rail.shape[0] - 1) // PER_CELL
    inverse = 1.0 / SCAN_STEP
    before = here = 0.0
    for k in range(cells + 1):
        beyond, at = 0.0, MARGIN + k
        if k < cells:
            low, high = rail[PER_CELL * k], rail[PER_CELL * (k + 1)]
            rise = (high[0] - low[0]) * inverse
            scan_rail[0, at], scan_rail[1, at] = low[0], low[1]
            scan_rail[2, at] = (3.0 * rise - 2.0 * low[1] - high[1]) * inverse
            scan_rail[3, at] = (low[1] + high[1] - 2.0 * rise) * inverse * inverse
            mean = 0.5 * (low[1] + high[1])
            scan_rail[RAIL_COSINE, at] = 1.0 / math.sqrt(1.0 + mean * mean)
            for j in range(PER_CELL):
                beyond = max(beyond, abs(rail[PER_CELL * k + j + 1, 1] - rail[PER_CELL * k + j, 1]))
        if k > 0:
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
            if crossing.tables[k, wheel] < 0:
                continue
            laid = crossing.laid[k, wheel]
            end = laid[BEGIN] + laid[STEP] * laid[LAST]
            left = max(laid[BEGIN] - s, s - end, laid[STRIDE])
            if laid[PERIOD] > 0.0:
                place, left = _place_of(laid, s), laid[STRIDE]
                if place > laid[LAST]:
                    left = max((PAD + laid[PERIOD] - place) * laid[STEP], left)
                if laid[END] < math.inf:
                    left = max(left, laid[START] - s, s - laid[END])
            if speed * clock[at] > left:
                clock[at] = left / speed
