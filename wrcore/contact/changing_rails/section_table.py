"""Table of the equivalent sections of a rail that changes along the track, over arc length, for runs.

The sections of `wrcore.contact.changing_rails.sections`, for a centred wheelset without roll and yaw, are computed at a
spacing of `S_STEP`, or more for widely spaced slices. Between them, a cubic Hermite polynomial interpolates along the
track. Before the first and after the last slice, the rail is blended over the length `BLEND` into a plain rail.

The table of a wheel out of round is over the angle of the wheel, that of a corrugated rail over a wave; both are
periodic. Their sections are the plain rail's plus the irregularity of wheel or rail, at strips of some radii, with
splines between these. For a wheel that is partly round, the table ends in the plain rail there.

A wheelset with a lateral displacement touches the section with strips of a radius larger by dR: the section is
x^2 dR/(2 R^2) higher for a wheel that touches x ahead of its axle. Under yaw the section is that at the wheel's arc
length.
"""

from dataclasses import dataclass, replace

import numpy as np

from wrcore.contact.changing_rails.out_of_round import SlicedWheel
from wrcore.contact.changing_rails.sections import AHEAD as SEEN_AHEAD
from wrcore.contact.changing_rails.sections import BELOW, REACH, STEP, WheelOnSlices, filled
from wrcore.contact.changing_rails.sections import BEND as SEEN_BEND
from wrcore.contact.changing_rails.sections import HEIGHT as SEEN_HEIGHT
from wrcore.contact.search.geometry import (
    MARGIN,
    RAIL_RESERVE,
    SAFETY,
    SCAN_STEP,
    ContactGeometry,
    contact_geometry,
    zone_gaps,
    zone_planar_errors,
)
from wrcore.errors import InputError
from wrcore.geometry.changing_rails.slices import RailSlices
from wrcore.geometry.profiles.profile import ProfileCurve, averaged_second_derivative

S_STEP, U_STEP = 2e-3, 3e-4
"""Node spacings along and across the track, m."""

LARGEST_STEP, PER_SLICE = 1e-2, 10
"""Maximum node spacing along the track (m), and number of nodes between two slices, of a rail with continuous heads."""

PER_CELL = round(SCAN_STEP / U_STEP)
"""Number of nodes across per cell of the scan."""

BLEND, PLAY = 0.1, 0.012
"""Length over which a rail is blended into a plain rail, and maximum lateral displacement of a wheel beyond the ends of
its profile, m."""

COLUMNS = 9
"""Number of radii of strips for which the sections of a wheel out of round are computed."""

SECTION_ROWS = [SEEN_HEIGHT, SEEN_AHEAD, SEEN_BEND]

PAD = 16
"""Number of extra nodes at the ends of a table of a wheel out of round: under yaw, strips have different angles."""

STRETCH = 64
"""Number of steps along the track with common bounds of gaps."""

HEIGHT, SLOPE, SECOND, AHEAD, BEND = range(5)
"""Rows of a section: height (m), its slope over u, second derivative for Hertz (1/m), and the first two columns of
`ContactGeometry.along`."""
ROWS = 5


@dataclass(frozen=True)
class SectionTable:
    """Equivalent sections over arc length, or over the angle of a wheel."""

    begin: float
    """Arc length (m) or angle (rad) of the first node."""
    step: float
    """Node spacing, m or rad."""
    sections: np.ndarray
    """(n, 2, ROWS, m): rows, and their derivatives times the step; the first and last section are the plain rail."""
    strips: np.ndarray
    """(2, m): 1/R (1/m) of the wheel's strips over the nodes, and the displacement of their contact points per yaw,
    relative to that of the tape circle's plane, m/rad."""
    geometry: ContactGeometry
    """Geometry of the wheel on the plain rail."""
    bounds: np.ndarray
    """(1 + stretches, ...): `ContactGeometry.zone_gaps` of the plain rail, then of each stretch of `STRETCH` steps."""


def section_table(pair, plain, backwards=False, lateral=None):
    """Return the `SectionTable` of a `WheelOnSlices` that is blended into a ``plain`` rail at both ends.

    ``backwards``: the rail is reversed; arc lengths are from the same origin, opposite to those of its slices.
    ``lateral``: the two lateral coordinates (m) between which all rails lie that the wheel passes; by default those of
    this rail."""
    wide = _widened(pair)
    first, last = (pair.rail.s[k] + sign * (REACH + BLEND) for k, sign in ((0, -1.0), (-1, 1.0)))
    begins, step = pair.rail.begins(), _step_along(pair.rail)
    if begins.size:  # at a node
        first = begins[0] - step * np.ceil((begins[0] - first) / step)
    s = first + step * np.arange(int(np.ceil((last - first) / step)) + 1)
    u = _lateral(wide, plain, lateral or pair.rail.lateral)
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
    geometry = _plain_geometry(pair, plain, u, everywhere)
    return _with_bounds(SectionTable(float(s[0]), step, sections, wide.strips(u), geometry, np.zeros(0)))


def _step_along(rail):
    """Node spacing along a rail of slices, m, a multiple of `STEP`."""
    if rail.begins().size or rail.s.size < 2:
        return S_STEP
    even = STEP * np.floor(np.diff(rail.s).min() / PER_SLICE / STEP + 1e-9)
    return float(np.clip(even, S_STEP, LARGEST_STEP))


def shape_table(pair, shape):
    """Return the `SectionTable` of a `WheelOnRail` with the ``shape`` of an `OutOfRound` or a `SlicedWheel` (wheel), or
    a `Corrugation` (rail)."""
    plain, sizes = pair.rail, (pair.rolling_radius, pair.half_distance, pair.rail_distance)
    wide = _widened(WheelOnSlices(pair.wheel, RailSlices.of(plain), *sizes))
    u = _lateral(wide, plain, wide.rail.lateral)
    first, step, count = shape.nodes(S_STEP, PAD)
    curvatures, leads = wide.strips(u)
    at = u + pair.rail_distance - pair.half_distance
    own = np.flatnonzero((at >= pair.wheel.u[0]) & (at <= pair.wheel.u[-1]))
    places = first + step * np.arange(count)
    if isinstance(shape, SlicedWheel):
        seen = _section_of_slices(wide, shape, places, u, at, own)
    else:
        seen = _section_of_radii(wide, shape, places, u, 1.0 / curvatures, own)
    sections = np.zeros((count, 2, ROWS, u.size))
    everywhere = _plain_section(plain, u, plain.f.min() - BELOW)
    sections[:, 0] = everywhere
    sections[:, 0, HEIGHT] += seen[:, 0]
    slope = np.gradient(seen[:, 0], U_STEP, axis=1)
    sections[:, 0, SLOPE] += slope
    sections[:, 0, SECOND] += np.gradient(slope, U_STEP, axis=1)
    sections[:, 0, AHEAD:] = seen[:, 1:]
    _add_rates(sections, np.ones((count, u.size), bool))
    for k in (0, 1, -2, -1):  # two of them, so that strips far ahead of or behind a yawed axle find the plain rail
        sections[k] = 0.0
        sections[k, 0] = everywhere
    strips = np.stack([curvatures, leads - at * shape.level])
    geometry = _plain_geometry(pair, plain, u, everywhere)
    return _with_bounds(SectionTable(first, step, sections, strips, geometry, np.zeros(0)), faded=True)


def _section_of_radii(wide, shape, places, u, radii, own):
    """Return height, AHEAD and BEND (n, 3, m) for a shape that is equal for all strips of the same radius."""
    from scipy.interpolate import make_interp_spline

    known, some = np.unique(np.round(radii[own], 6), return_index=True)
    some = own[some[np.unique(np.searchsorted(known, np.linspace(known[0], known[-1], COLUMNS)))]]
    at = radii[some]
    seen = wide.turned(places, u[some], lambda place, x, strips: shape.reach(at, place, x))[:, SECTION_ROWS]
    return make_interp_spline(at, seen, k=min(3, at.size - 1), axis=2)(np.clip(radii, at[0], at[-1]))


def _section_of_slices(wide, shape, places, u, at, own):
    """Return height, AHEAD and BEND (n, 3, m) for a wheel of slices, for each strip; constant beyond its ends.

    ``at``: wheel coordinates over ``u``; ``own``: indices of those on the wheel's profile."""
    first, last = shape.within(at[own])
    some = own[first : last + 1]
    if some.size < 4:
        raise InputError(shape.slices.name, "", "expected profiles around the tape circle, u = 0, at all angles")
    reach = shape.reach_over(wide.geometry_of_wheel, at[some])
    seen = wide.turned(places, u[some], lambda place, x, strips: reach(place, x))[:, SECTION_ROWS]
    return seen[:, :, np.clip(np.arange(u.size), some[0], some[-1]) - some[0]]


def _plain_geometry(pair, plain, u, section):
    """Return the `ContactGeometry` on the plain rail, of the type for rails that change along the track."""
    curve = ProfileCurve(plain.name, "rail", u, *section[: SECOND + 1].copy())
    geometry = contact_geometry(pair.wheel, curve, pair.rolling_radius, pair.half_distance, pair.rail_distance)
    return geometry._replace(along=np.zeros((u.size, 5)))


def _widened(pair):
    """Return the pair with a wheel profile extended at both ends with a constant radius.

    With a lateral displacement the wheel is then over all columns of the table."""
    wheel, count = pair.wheel, round(PLAY / pair.wheel.spacing)
    more = pair.wheel.spacing * np.arange(1, count + 1)
    u = np.concatenate([wheel.u[0] - more[::-1], wheel.u, wheel.u[-1] + more])
    f = np.pad(wheel.f, count, mode="edge")
    wide = ProfileCurve(wheel.name, "wheel", u, f, np.pad(wheel.df, count), np.pad(wheel.d2f, count))
    return WheelOnSlices(wide, pair.rail, pair.rolling_radius, pair.half_distance, pair.rail_distance)


def _lateral(pair, plain, there):
    """Return lateral coordinates (m) in the range ``there`` of rails that a wheel can reach: whole cells, and one more
    node."""
    shift = pair.half_distance - pair.rail_distance
    low = max(min(there[0], plain.u[0]), pair.wheel.u[0] + shift)
    high = min(max(there[1], plain.u[-1]), pair.wheel.u[-1] + shift)
    first, cells = int(np.floor(low / U_STEP)), int(np.ceil((high - low) / SCAN_STEP))
    return U_STEP * np.arange(first, first + PER_CELL * cells + 2)


def _plain_section(plain, u, floor):
    """Return the rows (ROWS, m) of the plain rail."""
    section = np.zeros((ROWS, u.size))
    on = (u >= plain.u[0]) & (u <= plain.u[-1])
    section[HEIGHT] = floor
    for row, derivative in ((HEIGHT, 0), (SLOPE, 1), (SECOND, 2)):
        section[row, on] = plain(u[on], derivative)
    return section


def _add_rates(sections, exists):
    """Fill the derivatives by differences between sections, but not across the beginning or the end of a head."""
    values, rates = sections[:, 0], sections[:, 1]
    ahead = np.where((exists[1:] & exists[:-1])[:, None], np.diff(values, axis=0), np.nan)
    none = np.full((1, *ahead.shape[1:]), np.nan)
    both = np.stack([np.concatenate([ahead, none]), np.concatenate([none, ahead])])
    count = np.isfinite(both).sum(axis=0)
    rates[:] = np.where(count > 0, np.nansum(both, axis=0) / np.maximum(count, 1), 0.0)


def _with_bounds(table, faded=False):
    """Return the table with bounds of gaps for all sections of each stretch, for spatial detection.

    ``faded``: the bounds also hold for sections blended with the plain rail."""
    geometry, cells = table.geometry, (table.sections.shape[3] - 1) // PER_CELL
    values, rates = table.sections[:, 0], np.abs(table.sections[:, 1])
    bend = np.abs(np.diff(values[:, SLOPE], axis=1)) / U_STEP
    reserve = 1.5 * SAFETY * 0.125 * SCAN_STEP**2 * _of_cells(bend, cells, 1)
    top = _of_cells(values[:, HEIGHT] + 0.15 * (rates[:, HEIGHT] + np.roll(rates[:, HEIGHT], -1, 0)), cells, 0)
    if faded:
        top, reserve = np.maximum(top, top[0]), np.maximum(reserve, reserve[0])
    wheel, radius = geometry.scan_wheel, geometry.rolling_radius
    bounds = [geometry.zone_gaps]
    for first in range(0, len(top) - 1, STRETCH):
        here, rail = slice(first, first + STRETCH + 1), geometry.scan_rail.copy()
        middle = slice(MARGIN, MARGIN + cells)
        rail[:4, middle] = 0.0
        rail[0, middle], rail[RAIL_RESERVE, middle] = top[here].max(axis=0), reserve[here].max(axis=0)
        bounds.append(zone_gaps(wheel, rail, geometry.block, radius))
    rail[RAIL_RESERVE, middle] = reserve.max(axis=0)
    geometry = geometry._replace(zone_planar_errors=zone_planar_errors(wheel, rail, geometry.block))
    return replace(table, geometry=geometry, bounds=np.array(bounds))


def _of_cells(values, cells, beside):
    """Maximum of values (n, m) over each cell of the scan with its ends and ``beside`` cells on either side, (n,
    cells)."""
    wide = np.pad(values, ((0, 0), (PER_CELL * beside, PER_CELL * beside + 1)), mode="edge")
    starts, reach = PER_CELL * np.arange(cells), PER_CELL * (1 + 2 * beside) + 1
    return np.max([wide[:, starts + k] for k in range(reach)], axis=0)
