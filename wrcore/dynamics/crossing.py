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
            _interpolate(
                crossing.sections[table], crossing.strips[table], place, yaw / crossing.step, geometry.rail,
                geometry.along, model.contact.reduction == MAXIMUM,
            )  # fmt: skip
            _lay_cells(geometry.rail, geometry.scan_rail)


@jit(allocates=False, fastmath=FUSED)
def _interpolate(sections, strips, place, yaw, rail, along, curved):
    """Write the section at a place, for a wheel that yaws by so many steps per metre, into the nodes of a rail; with
    second derivatives if it is ``curved``."""
    last = sections.shape[0] - 1.0
    for j in range(rail.shape[0]):
        here = min(max(place + yaw * strips[1, j], 0.0), last)
        i = min(int(here), sections.shape[0] - 2)
        t = here - i
        b, e = t * t * (3.0 - 2.0 * t), t * (1.0 - t)
        a, d, e = 1.0 - b, e * (1.0 - t), -e * t
        low, high = sections[i, 0], sections[i + 1, 0]
        low_rate, high_rate = sections[i, 1], sections[i + 1, 1]
        rail[j, 0] = a * low[HEIGHT, j] + b * high[HEIGHT, j] + d * low_rate[HEIGHT, j] + e * high_rate[HEIGHT, j]
        rail[j, 1] = a * low[SLOPE, j] + b * high[SLOPE, j] + d * low_rate[SLOPE, j] + e * high_rate[SLOPE, j]
        if curved:
            rail[j, 2] = a * low[SECOND, j] + b * high[SECOND, j] + d * low_rate[SECOND, j] + e * high_rate[SECOND, j]
        x = a * low[AHEAD, j] + b * high[AHEAD, j] + d * low_rate[AHEAD, j] + e * high_rate[AHEAD, j]
        along[j, 0] = x
        along[j, 1] = a * low[BEND, j] + b * high[BEND, j] + d * low_rate[BEND, j] + e * high_rate[BEND, j]
        curvature = strips[0, j]  # R - sqrt(R^2 - x^2)
        square = (curvature * x) * (curvature * x)
        along[j, 2] = 0.5 * curvature * x * x * (1.0 + square * (0.25 + square * (0.125 + square * 0.078125)))


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
