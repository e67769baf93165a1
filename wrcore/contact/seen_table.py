"""A rail that changes along the track, over arc length as a wheel sees it: what runs look its section up in.

The sections of `wrcore.contact.seen_rail`, for a wheelset in the middle and without roll and yaw, at arc lengths
`S_STEP` apart; between these runs a cubic Hermite polynomial along the track. Before the first and behind the last
slice the rail goes over, along `BLEND`, into one that is the same everywhere, and stays that.

A wheelset that is moved sideways sees the section through strips of a radius dR larger or smaller: it lies
x^2 dR/(2 R^2) higher for a wheel that touches x ahead of its axle. One that yaws sees it as far ahead as its wheel is.
"""

from dataclasses import dataclass, replace

import numpy as np

from wrcore.contact.geometry import (
    MARGIN,
    RAIL_RESERVE,
    SAFETY,
    SCAN_STEP,
    ContactGeometry,
    contact_geometry,
    zone_gaps,
    zone_planar_errors,
)
from wrcore.contact.seen_rail import AHEAD as SEEN_AHEAD
from wrcore.contact.seen_rail import BELOW, REACH, WheelOnSlices, filled
from wrcore.contact.seen_rail import BEND as SEEN_BEND
from wrcore.contact.seen_rail import HEIGHT as SEEN_HEIGHT
from wrcore.geometry.profile import ProfileCurve, averaged_second_derivative

S_STEP, U_STEP = 2e-3, 3e-4
"""Distances of the nodes along and across, m."""

PER_CELL = round(SCAN_STEP / U_STEP)
"""Nodes across per cell of the scan."""

BLEND, PLAY = 0.1, 0.012
"""Length over which a rail goes over into one that is the same everywhere, and how far a wheel may be off its place
beyond the ends of its profile, m."""

STRETCH = 64
"""Steps along the track for which bounds of gaps are taken together."""

HEIGHT, SLOPE, SECOND, AHEAD, BEND = range(5)
"""Rows of a section: height (m), its slope over u, second derivative for Hertz (1/m), and the first two columns of
`ContactGeometry.along`."""
ROWS = 5


@dataclass(frozen=True)
class SeenTable:
    """Sections over arc length."""

    begin: float
    """Arc length of the first node, m."""
    sections: np.ndarray
    """(n, 2, ROWS, m): rows, and their rates over s times `S_STEP`; the first and the last one are the plain rail."""
    strips: np.ndarray
    """(2, m): of the wheel's strips over them 1/R (1/m), and how far a yaw moves their points that touch, over what it
    moves that of the tape circle's plane, m/rad."""
    geometry: ContactGeometry
    """On the plain rail."""
    bounds: np.ndarray
    """(stretches + 1, ...): `ContactGeometry.zone_gaps` over each stretch, and at last of the plain rail."""


def seen_table(pair, plain, backwards=False):
    """`SeenTable` of a `WheelOnSlices` that goes over into a ``plain`` rail at both ends; ``backwards``: of one that is
    laid the other way round, whose arc lengths then count from the same origin against those of its slices."""
    wide = _widened(pair)
    first, last = (pair.rail.s[k] + sign * (REACH + BLEND) for k, sign in ((0, -1.0), (-1, 1.0)))
    begins = pair.rail.begins()
    if begins.size:  # at a node
        first = begins[0] - S_STEP * np.ceil((begins[0] - first) / S_STEP)
    s = first + S_STEP * np.arange(int(np.ceil((last - first) / S_STEP)) + 1)
    u = _lateral(wide, plain)
    seen = wide.straight(s, u)
    floor = min(np.nanmin(seen[:, SEEN_HEIGHT]), plain.f.min()) - BELOW
    sections = np.zeros((s.size, 2, ROWS, u.size))
    for k, (there, one) in enumerate(zip(seen[:, SEEN_HEIGHT], sections[:, 0], strict=True)):
        one[HEIGHT], one[SLOPE] = filled(there, U_STEP, floor)
        one[SECOND] = averaged_second_derivative(u, one[HEIGHT], one[SLOPE])
        one[[AHEAD, BEND]] = seen[k][[SEEN_AHEAD, SEEN_BEND]]
    everywhere = _plain_section(plain, u, floor)
    part = np.clip(np.minimum(s - s[0], s[-1] - s) / BLEND, 0.0, 1.0)
    part = (part**2 * (3.0 - 2.0 * part))[:, None, None]
    exists = (sections[:, 0, HEIGHT] > floor) | (part[:, 0] < 1.0)
    sections[:, 0] = everywhere + part * (sections[:, 0] - everywhere)
    _add_rates(sections, exists)
    if backwards:
        s, sections = -s[::-1], sections[::-1].copy()
        sections[:, 1] *= -1.0
        sections[:, :, AHEAD] *= -1.0
    curve = ProfileCurve(plain.name, "rail", u, *everywhere[: SECOND + 1].copy())
    geometry = contact_geometry(pair.wheel, curve, pair.rolling_radius, pair.half_distance, pair.rail_distance)
    geometry = geometry._replace(along=np.zeros((u.size, 3)))
    return _with_bounds(SeenTable(float(s[0]), sections, wide.strips(u), geometry, np.zeros(0)))


def _widened(pair):
    """The pair with a wheel that goes on beyond its ends: columns beside it, where it comes when it moves sideways, are
    seen by strips of the radius at its end."""
    wheel, count = pair.wheel, round(PLAY / pair.wheel.spacing)
    more = pair.wheel.spacing * np.arange(1, count + 1)
    u = np.concatenate([wheel.u[0] - more[::-1], wheel.u, wheel.u[-1] + more])
    f = np.pad(wheel.f, count, mode="edge")
    wide = ProfileCurve(wheel.name, "wheel", u, f, np.pad(wheel.df, count), np.pad(wheel.d2f, count))
    return WheelOnSlices(wide, pair.rail, pair.rolling_radius, pair.half_distance, pair.rail_distance)


def _lateral(pair, plain):
    """Lateral coordinates over which there is a rail and may be a wheel, m: whole cells, and a node more."""
    points = [sheet.points[:, 0] for sheet in pair.rail.sheets]
    there = min(p.min() for p in points), max(p.max() for p in points)
    shift = pair.half_distance - pair.rail_distance
    low = max(min(there[0], plain.u[0]), pair.wheel.u[0] + shift)
    high = min(max(there[1], plain.u[-1]), pair.wheel.u[-1] + shift)
    first, cells = int(np.floor(low / U_STEP)), int(np.ceil((high - low) / SCAN_STEP))
    return U_STEP * np.arange(first, first + PER_CELL * cells + 2)


def _plain_section(plain, u, floor):
    """Rows of the plain rail."""
    section = np.zeros((ROWS, u.size))
    on = (u >= plain.u[0]) & (u <= plain.u[-1])
    section[HEIGHT] = floor
    for row, derivative in ((HEIGHT, 0), (SLOPE, 1), (SECOND, 2)):
        section[row, on] = plain(u[on], derivative)
    return section


def _add_rates(sections, exists):
    """Rates by differences between neighbours that exist: to none across the beginning or the end of a head."""
    values, rates = sections[:, 0], sections[:, 1]
    ahead = np.where((exists[1:] & exists[:-1])[:, None], np.diff(values, axis=0), np.nan)
    none = np.full((1, *ahead.shape[1:]), np.nan)
    both = np.stack([np.concatenate([ahead, none]), np.concatenate([none, ahead])])
    count = np.isfinite(both).sum(axis=0)
    rates[:] = np.where(count > 0, np.nansum(both, axis=0) / np.maximum(count, 1), 0.0)


def _with_bounds(table):
    """The table with bounds that hold for all sections of a stretch, and for all poses that are not planar."""
    geometry, cells = table.geometry, (table.sections.shape[3] - 1) // PER_CELL
    values, rates = table.sections[:, 0], np.abs(table.sections[:, 1])
    bend = np.abs(np.diff(values[:, SLOPE], axis=1)) / U_STEP
    reserve = 1.5 * SAFETY * 0.125 * SCAN_STEP**2 * _of_cells(bend, cells, 1)
    top = _of_cells(values[:, HEIGHT] + 0.15 * (rates[:, HEIGHT] + np.roll(rates[:, HEIGHT], -1, 0)), cells, 0)
    wheel, radius = geometry.scan_wheel, geometry.rolling_radius
    bounds = []
    for first in range(0, len(top) - 1, STRETCH):
        here, rail = slice(first, first + STRETCH + 1), geometry.scan_rail.copy()
        middle = slice(MARGIN, MARGIN + cells)
        rail[:4, middle] = 0.0
        rail[0, middle], rail[RAIL_RESERVE, middle] = top[here].max(axis=0), reserve[here].max(axis=0)
        bounds.append(zone_gaps(wheel, rail, geometry.block, radius))
    rail[RAIL_RESERVE, middle] = reserve.max(axis=0)
    geometry = geometry._replace(zone_planar_errors=zone_planar_errors(wheel, rail, geometry.block))
    found = np.array([*bounds, geometry.zone_gaps])
    return replace(table, geometry=geometry, bounds=found)


def _of_cells(values, cells, beside):
    """Largest value of (n, m) over each cell of the scan, its ends and as many cells ``beside`` it, (n, cells)."""
    wide = np.pad(values, ((0, 0), (PER_CELL * beside, PER_CELL * beside + 1)), mode="edge")
    starts, reach = PER_CELL * np.arange(cells), PER_CELL * (1 + 2 * beside) + 1
    return np.max([wide[:, starts + k] for k in range(reach)], axis=0)
