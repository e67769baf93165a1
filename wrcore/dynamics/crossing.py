"""Rails that change along the track, under wheels that run: each wheel has a section of its own, laid anew as it goes.

The kernels of search and patches know one rail profile per wheel. On such a rail it is the section that the wheel sees
(`wrcore.contact.seen_table`), interpolated for the arc length at which it is, written into the wheel's own arrays
before its contact is looked for. Where nothing changes nothing is written.
"""

import math
from typing import NamedTuple

import numpy as np

from wrcore.contact.geometry import MARGIN, RAIL_COSINE, RAIL_RESERVE, SAFETY, SCAN_STEP
from wrcore.contact.reduction import MAXIMUM
from wrcore.contact.seen_table import AHEAD, BEND, HEIGHT, PER_CELL, ROWS, S_STEP, SECOND, SLOPE, STRETCH, U_STEP
from wrcore.dynamics.body import STATE_SIZE, VELOCITY
from wrcore.dynamics.motion import MOTION
from wrcore.dynamics.track import arc_length_at
from wrcore.dynamics.vector import copy_into
from wrcore.dynamics.wheel import contact_of
from wrcore.kernels.jit import FUSED, jit

TRAVEL = 0.02
"""Longest step of a run while a wheelset is on such a rail, m."""

PLACE, YAW, IN_STRETCH = range(3)
"""What is known of the section that a wheel's arrays hold: its place in the table, in steps, the yaw it is seen in,
and its stretch."""


class Crossing(NamedTuple):
    """Sections of the rails that change, for kernels; all arrays are empty where none does."""

    sections: np.ndarray
    """(tables, n, 2, ROWS, m): see `wrcore.contact.seen_table.SeenTable`."""
    strips: np.ndarray
    """(tables, 2, m): of the strips over it, see `SeenTable`."""
    bounds: np.ndarray  # (tables, stretches + 1, rows, blocks)
    tables: np.ndarray
    """(k, 2) int: the table of each wheel, -1 for one on a rail that is the same everywhere."""
    begin: float  # arc length of the first section, m
    step: float  # distance of the sections, m


def no_crossing():
    """A `Crossing` where no rail changes."""
    sizes = (0, 0, 2, ROWS, 0), (0, 2, 0), (0, 0, 0, 0)
    return Crossing(*map(np.zeros, sizes), np.zeros((0, 2), np.int64), 0.0, 1.0)


def crossing_of(tables, of_wheels):
    """`Crossing` of a list of `SeenTable` with one beginning, and the table of each wheel (k, 2), -1: none."""
    parts = (_stacked([getattr(one, name) for one in tables]) for name in ("sections", "strips", "bounds"))
    return Crossing(*parts, np.array(of_wheels, np.int64), tables[0].begin, S_STEP)


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
    last = crossing.sections.shape[1] - 1.0
    for k in range(crossing.tables.shape[0]):
        s = arc_length_at(model, state, work, k)
        for wheel in range(2):
            table = crossing.tables[k, wheel]
            if table < 0:
                continue
            geometry = contact_of(model.contact, k, wheel).geometry
            row, known = work.motions[k, wheel], work.seen[k, wheel]
            yaw = row[MOTION.side] * row[MOTION.ex]
            place = (s + geometry.half_distance * yaw - crossing.begin) / crossing.step
            if not place > 0.0:  # a stage that is not finite, too
                place = 0.0
            place = min(place, last)
            if not 0.0 < place < last:
                yaw = 0.0
            if place == known[PLACE] and yaw == known[YAW]:
                continue
            known[PLACE], known[YAW] = place, yaw
            stretch = crossing.bounds.shape[1] - 1
            if 0.0 < place < last:
                stretch = int(place) // STRETCH
            if stretch != known[IN_STRETCH]:
                known[IN_STRETCH], gaps = stretch, geometry.zone_gaps
                for i in range(gaps.shape[0]):
                    copy_into(gaps[i], crossing.bounds[table, stretch, i])
            interpolate(
                crossing.sections[table], crossing.strips[table], place, yaw / crossing.step, work.section,
                geometry.rail, geometry.along, model.contact.reduction == MAXIMUM,
            )  # fmt: skip
            _lay_cells(geometry.rail, geometry.scan_rail)


@jit(allocates=False)
def interpolate(sections, strips, place, yaw, scratch, rail, along, curved):
    """Write the section at a place, for a wheel that yaws by so many steps per metre, into the nodes of a rail; with
    second derivatives if it is ``curved``. ``scratch`` is (ROWS + 4, m)."""
    last, begin, size = sections.shape[0] - 2, 0, rail.shape[0]
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
    _lay_nodes(strips[0], scratch, rail, along, curved)


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


@jit(allocates=False, fastmath=FUSED)
def _lay_nodes(curvatures, section, rail, along, curved):
    """Write a section into the nodes of a rail."""
    for j in range(np.uint64(rail.shape[0])):
        rail[j, 0], rail[j, 1] = section[HEIGHT, j], section[SLOPE, j]
        x, curvature = section[AHEAD, j], curvatures[j]
        square = (curvature * x) * (curvature * x)
        lift = 0.5 * curvature * x * x * (1.0 + square * (0.25 + square * (0.125 + square * 0.078125)))
        along[j, 0], along[j, 1], along[j, 2] = x, section[BEND, j], lift  # R - sqrt(R^2 - x^2)
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
    """Shorten the next step, the entry of ``clock`` (s), so that it neither begins before a wheelset's rail changes and
    ends beyond that nor is longer than `TRAVEL` there."""
    crossing = model.crossing
    end = crossing.begin + crossing.step * (crossing.sections.shape[1] - 1)
    for k in range(crossing.tables.shape[0]):
        first = STATE_SIZE * model.bodies.wheelsets[k] + VELOCITY
        speed, s = math.hypot(state[first], state[first + 1]), arc_length_at(model, state, work, k)
        left = max(crossing.begin - s, s - end, TRAVEL)
        if speed * clock[at] > left:
            clock[at] = left / speed
