"""Equivalent section of a rail that changes along the track, for one position and attitude of the wheel.

At each lateral coordinate the gap between the wheel of revolution and the rail's surface z(x, y) has a minimum at some
x, ahead of the axle where the rail rises. A prismatic rail with the equivalent section has the same minimum gap,

    f(y) = max_x (z_rail(x, y) - z_wheel(x, y)) + min_x z_wheel(x, y),

which does not depend on the wheelset's height. `ContactGeometry.along` has three corrections relative to a prismatic
rail at the section's nodes: of the position x of the minimum gap, of half the gap's second derivative over x, and of
the height of the wheel's point. Gap, position and curvature are those of the parabola that fits the gap best over the
length of a patch, because strips assume parabolas. If the overlap has another length, its area is used. Over a rail
with a constant section, the equivalent section is this section and all three corrections are 0.

A wheel out of round is treated in the same way, see `wrcore.contact.changing_rails.out_of_round`.

Where a head begins or ends under the wheel, its edge may be nearest to the wheel; then the area of the overlap is used.
If the wheel touches one line along the track at two points, only the nearer point is considered.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from wrcore.contact.changing_rails.out_of_round import reach_beyond
from wrcore.contact.search.detection import axle_direction
from wrcore.contact.search.geometry import contact_geometry
from wrcore.contact.search.strip import make_pose, strip_point
from wrcore.contact.search.surfaces import ContactPlane, wheel_height
from wrcore.geometry.changing_rails.slices import RailSlices, WheelSlices
from wrcore.geometry.profiles.profile import SPACING, ProfileCurve, averaged_second_derivative
from wrcore.geometry.track import SIDES
from wrcore.kernels.jit import jit

REACH, STEP, COARSE = 0.1, 1e-3, 4
"""Half length along the track that is evaluated, m, enough for ramps up to 1:4.6 under a wheel of 460 mm; spacing of
the stations, m; ratio of the coarse spacing of the first search to it."""

WINDOW = 5.5e-3
"""Half length over which a parabola is fitted to the gap, m. The effect of a cubic gap is w^2/3 in the fit, and
3 a^2/7 under a pressure sqrt(1 - (x/a)^2): equal for patches of 9.7 mm."""

USUAL_DEPTH, OTHER, ANOTHER = 6e-5, math.log(1.25), math.log(1.65)
"""Depth (m) of the overlap under a usual wheel load; logarithms of the ratio of this overlap's length to that of the
fitted parabola from which the overlap's area is blended in, and from which only the area is used (as on the chord of a
fresh flat)."""

BELOW = 0.03
"""Depth below the section's lowest point of the level between its heads, m."""

HEIGHT, AHEAD, BEND, LIFT = range(4)

_CLOSE = 1e-9  # m


@dataclass(frozen=True)
class WheelOnSlices:
    """A wheel on a rail of slices, or a wheel out of round.

    Parameters
    ----------
    wheel : ProfileCurve
        Profile of the wheel; for a wheel out of round, that of a similar wheel of revolution.
    rail : RailSlices
        In the coordinates of the track: u from ``rail_distance``, f from the reference plane of the wheelset's height.
    rolling_radius, half_distance, rail_distance : float
        As for `WheelOnRail`, m.
    out_of_round : WheelSlices, optional
        Shape of both wheels.
    """

    wheel: ProfileCurve
    rail: RailSlices
    rolling_radius: float = 0.46
    half_distance: float = 0.75
    rail_distance: float = 0.75
    out_of_round: WheelSlices | None = None

    @cached_property
    def geometry_of_wheel(self):
        """Geometry of the wheel over a level rail, for the search for the equivalent section."""
        u = SPACING * np.arange(-400, 401)
        level = ProfileCurve("level", "rail", u, *np.zeros((3, u.size)))
        sizes = self.rolling_radius, self.half_distance, self.rail_distance
        return contact_geometry(self.wheel, level, *sizes)

    def under(self, side, s, y, roll=0.0, yaw=0.0, turned=0.0):
        """Return the `ContactGeometry` of the equivalent section under one wheel, and the height (m) of first touch.

        The wheelset's centre is at s, y (m), with ``roll`` and ``yaw`` (rad), its wheels turned forward by ``turned``
        (rad). The height is that of the wheelset's centre. None and NaN if there is no rail under the wheel."""
        sign, wheel = SIDES[side], self.geometry_of_wheel
        pose = make_pose(1.0, sign * y, 0.0, *axle_direction(sign * roll, sign * yaw), True)
        low, high = (strip_point(wheel, pose, u)[0] for u in self._ends)
        u = SPACING * np.arange(math.ceil(low / SPACING), math.floor(high / SPACING) + 1)
        seen, touch, x, rail = self._seen(pose, s, u, turned)
        there = np.isfinite(seen[HEIGHT])
        if there.sum() < 10:
            return None, math.nan
        f, slope = filled(seen[HEIGHT], SPACING, np.min(seen[HEIGHT], where=there, initial=np.inf) - BELOW)
        curve = ProfileCurve(f"{self.rail.name} at s = {s:g} m", "rail", u, f, slope,
                             averaged_second_derivative(u, f, slope))  # fmt: skip
        geometry = contact_geometry(self.wheel, curve, self.rolling_radius, self.half_distance, self.rail_distance)
        over = np.where(np.isfinite(rail), rail - f, -BELOW)
        level = self.out_of_round is not None and self.rail.s.size == 1
        along = np.column_stack([*seen[AHEAD:], np.zeros(u.size) if level else seen[AHEAD], np.ones(u.size)])
        return geometry._replace(along=along, over=np.column_stack([x, over])), touch

    def straight(self, s, u):
        """Equivalent sections (n, 4, m) of the rail for a centred wheelset at arc lengths ``s`` (n,), m.

        ``u`` (m,) are equally spaced rail coordinates, m; steps of ``s`` are multiples of `STEP`. Rows are `HEIGHT`,
        NaN without rail, to `LIFT`."""
        pose, seen = make_pose(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, True), np.zeros((s.size, 4, u.size))
        count = 2 * round(REACH / STEP) + 1
        every = self._where_parts_begin(s[0] - REACH + STEP * np.arange(round((s[-1] - s[0]) / STEP) + count))
        rail = self.rail.heights(every, u)[0]
        for at, section in zip(s, seen, strict=True):
            x, first = self._stations(at), round((at - s[0]) / STEP)
            heights = rail[first : first + count]
            if abs(at + x[0] - every[first]) > _CLOSE:  # another part begins nearby
                heights = self.rail.heights(self._where_parts_begin(at + x), u)[0]
            _see(self.geometry_of_wheel, pose, x, heights, np.zeros((0, 0)), u, section)
        return seen

    def turned(self, places, u, beyond):
        """Equivalent sections (n, 4, m) of a level rail for a centred wheelset, at ``places`` (n,) of an irregularity.

        ``u`` (m,) are rail coordinates, m. ``beyond(place, x, strips)`` returns by how much the wheel reaches further
        down than the wheel of revolution, or the rail is higher, (stations, m), m, at stations ``x`` and wheel
        coordinates ``strips``, m."""
        geometry, pose, x = self.geometry_of_wheel, make_pose(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, True), self._stations(0.0)
        strips, seen = _strips_over(geometry, pose, u), np.zeros((places.size, 4, u.size))
        for place, section in zip(places, seen, strict=True):
            reach = beyond(place, x, strips)
            _see(geometry, pose, x, reach, reach, u, section)
        return seen

    def strips(self, u):
        """Return 1/R (1/m) of a centred wheelset's strips over rail coordinates ``u``, and their shift by yaw, (2, m).

        The second row is the longitudinal displacement of the contact point per yaw (m/rad), minus half the distance of
        the tape circles."""
        at = u + self.rail_distance - self.half_distance
        inside = np.clip(at, *self._ends)
        radius = self.rolling_radius - self.wheel(inside)
        return np.stack([1.0 / radius, at - radius * self.wheel(inside, 1)])

    @property
    def _ends(self):
        return self.wheel.u[0], self.wheel.u[-1]

    def _seen(self, pose, s, u, turned):
        """Return the equivalent section (4, m) and the height of first touch for a left wheel, turned forward (rad).

        Further results: stations (n,), and heights of the rail (n, m), to which the irregularity of the wheel is
        added."""
        x, beyond, seen = self._stations(s), np.zeros((0, 0)), np.zeros((4, u.size))
        rail = self.rail.heights(self._where_parts_begin(s + x), u)[0]
        if self.out_of_round is not None:
            wheel = self.geometry_of_wheel
            beyond = reach_beyond(self.out_of_round, wheel, pose, turned, x, _strips_over(wheel, pose, u))
            rail = rail + beyond
        return seen, _see(self.geometry_of_wheel, pose, x, rail, beyond, u, seen), x, rail

    def _where_parts_begin(self, s):
        """Return the arc lengths (n,), m, with those within rounding of the beginning of a part moved to it."""
        for begin in self.rail.begins():
            s = np.where(np.abs(s - begin) < _CLOSE, begin, s)
        return s

    def _stations(self, s):
        """Positions of the stations from the wheelset's cross-section, m; one is at the beginning of a part."""
        count = round(REACH / STEP)
        begins = self.rail.begins() - s
        begins = begins[np.abs(begins) < REACH]
        shift = math.remainder(begins[np.argmin(np.abs(begins))], STEP) if begins.size else 0.0
        return STEP * np.arange(-count, count + 1) + shift


def filled(f, spacing, floor):
    """Return heights over equally spaced lateral coordinates without gaps, and slopes by differences of fourth order.

    The height is ``floor`` where there is no rail (NaN) or a piece of fewer than five nodes."""
    heights, slope = np.full(f.size, floor), np.zeros(f.size)
    ends = np.flatnonzero(np.diff(np.isfinite(f).astype(int), prepend=0, append=0)).reshape(-1, 2)
    for first, last in ends:
        part = f[first:last]
        if part.size < 5:
            continue
        d = np.gradient(part, spacing, edge_order=2)
        d[2:-2] = (part[:-4] - 8.0 * part[1:-3] + 8.0 * part[3:-1] - part[4:]) / (12.0 * spacing)
        heights[first:last], slope[first:last] = part, d
    return heights, slope


@jit
def _strip_over(wheel, pose, u):
    """Wheel coordinate of the strip whose extreme point lies over the rail coordinate ``u``, and that point's x and
    height (m)."""
    w = u
    for _ in range(12):
        ur, z, radius, _, _, along = strip_point(wheel, pose, w)
        if abs(u - ur) < 1e-12:
            break
        w += u - ur
    return w, radius * along * pose.q + (wheel.half_distance + w) * pose.ex, z


@jit
def _strips_over(wheel, pose, u):
    """Wheel coordinates of the strips over the rail coordinates ``u``, m."""
    found = np.empty(u.size)
    for k in range(u.size):
        found[k] = _strip_over(wheel, pose, u[k])[0]
    return found


@jit(allocates=False)
def _parabola(x, g, best):
    """Return vertex, height and second derivative of the parabola that fits ``g`` best around the vertex.

    The weight (1 - (d/WINDOW)^2)^2 at a distance d makes the result a smooth function of ``g``. The iteration starts
    at the highest station ``best``; NaN at an end."""
    n, h = x.size, x[1] - x[0]
    centre, top, second = x[best], np.nan, np.nan
    if best < 1 or best > n - 2 or not g[best - 1] + g[best + 1] == g[best - 1] + g[best + 1]:
        return centre, top, second
    reach = int(WINDOW / h) + 1
    for _ in range(12):
        s0 = s1 = s2 = s3 = s4 = t0 = t1 = t2 = 0.0
        middle = int(round((centre - x[0]) / h))
        for direction in (-1, 1):
            i = middle if direction > 0 else middle - 1
            while 0 <= i < n and abs(i - middle) <= reach and g[i] == g[i]:
                d = (x[i] - centre) / WINDOW
                if abs(d) < 1.0:
                    w = (1.0 - d * d) ** 2
                    s0, s1, s2, s3, s4 = s0 + w, s1 + w * d, s2 + w * d**2, s3 + w * d**3, s4 + w * d**4
                    v = w * (g[i] - g[best])
                    t0, t1, t2 = t0 + v, t1 + v * d, t2 + v * d * d
                i += direction
        m00, m01, m02 = s2 * s4 - s3 * s3, s3 * s2 - s1 * s4, s1 * s3 - s2 * s2
        whole = s0 * m00 + s1 * m01 + s2 * m02
        c1 = (t0 * m01 + t1 * (s0 * s4 - s2 * s2) + t2 * (s1 * s2 - s0 * s3)) / whole
        c2 = (t0 * m02 + t1 * (s1 * s2 - s0 * s3) + t2 * (s0 * s2 - s1 * s1)) / whole
        if not c2 < 0.0:
            return x[best], np.nan, np.nan
        c0 = (t0 - s1 * c1 - s2 * c2) / s0
        step = -0.5 * c1 / c2
        centre, top, second = centre + WINDOW * step, g[best] + c0 - 0.25 * c1 * c1 / c2, 2.0 * c2 / WINDOW**2
        if not abs(centre - x[best]) < WINDOW:  # an edge, or noise
            return x[best], np.nan, np.nan
        if abs(step) < 1e-10:
            break
    return centre, top, second


@jit(allocates=False)
def _usual_overlap(x, g, best, floor, low, high):
    """Return the area (m^2) of ``g`` above a height ``floor`` around the station ``best``, and its centroid x (m).

    Only stations ``low`` to ``high`` are used. The third result is whether the area ends within them."""
    area, moment, ends = 0.0, 0.0, True
    for way in (-1, 1):
        i = best
        while g[i] > floor:
            if not (low <= i + way <= high and g[i + way] == g[i + way]):
                ends = ends and low <= i + way <= high
                break
            here, there = g[i] - floor, max(g[i + way] - floor, 0.0)
            length = (x[i + way] - x[i]) * (1.0 if there > 0.0 else here / (g[i] - g[i + way]))
            area += 0.5 * abs(length) * (here + there)
            moment += abs(length) * (0.5 * x[i] * (here + there) + length * (here + 2.0 * there) / 6.0)
            i += way
    return area, moment / area, ends


@jit(allocates=False)
def _of_area(place, second, area, middle):
    """Return vertex and second derivative of a parabola, blended with those of a parabola with the ``area`` (m^2).

    The blending begins where the length of the overlap at the usual depth differs from that of the fitted parabola. The
    second parabola has its vertex at ``middle`` (m)."""
    if not area > 0.0:
        return place, second
    half = 0.75 * area / USUAL_DEPTH
    part = (abs(math.log(half * math.sqrt(-0.5 * second / USUAL_DEPTH))) - OTHER) / (ANOTHER - OTHER)
    if not part > 0.0:
        return place, second
    part = min(part, 1.0) ** 2 * (3.0 - 2.0 * min(part, 1.0))
    return place + part * (middle - place), second - part * (second + 2.0 * USUAL_DEPTH / (half * half))


@jit(allocates=False)
def _fill(wheel, pose, plane, x, rail, first, end, step, guess, g):
    """Fill ``g`` with the height of the rail minus that of the wheel at every ``step``-th station.

    NaN where one of them is missing. Returns the station with the maximum, or -1."""
    best = -1
    for i in range(first, end, step):
        g[i] = np.nan
        if rail[i] == rail[i]:
            n = wheel_height(wheel, pose, plane, x[i], 0.0, guess)
            if n == n:
                g[i], guess = rail[i] - n - plane.z, n
                if best < 0 or g[i] > g[best]:
                    best = i
    return best


@jit
def _see(wheel, pose, x, rail, beyond, u, seen):
    """Fill the equivalent section ``seen`` (4, m) over rail coordinates ``u`` (m,); return the height of first touch.

    ``rail`` (n, m) are heights of the rail at equally spaced stations ``x`` (n,). ``beyond`` (n, m; or empty) is the
    part of them that is due to a wheel out of round. The height is that of the wheelset's centre, m."""
    n, h, touch = x.size, x[1] - x[0], np.nan
    g, nominal, near = np.full(n, np.nan), -wheel.rolling_radius, 2 * int(WINDOW / h) + COARSE
    for k in range(u.size):
        seen[HEIGHT, k] = np.nan
        _, crest, lowest = _strip_over(wheel, pose, u[k])
        plane = ContactPlane(0.0, u[k] + wheel.rail_distance, nominal, 1.0, 0.0)
        guess = lowest - nominal
        best = _fill(wheel, pose, plane, x, rail[:, k], 0, n, COARSE, guess, g)
        if best < 0:
            continue
        low, high = max(best - near, 0), min(best + near, n - 1)
        _fill(wheel, pose, plane, x, rail[:, k], low, high + 1, 1, guess, g)
        for i in range(max(best - COARSE, 0), min(best + COARSE + 1, n)):
            if g[i] > g[best]:
                best = i
        ahead = wheel_height(wheel, pose, plane, crest + WINDOW / 3.0, 0.0, guess)
        behind = wheel_height(wheel, pose, plane, crest - WINDOW / 3.0, 0.0, guess)
        own = 4.5 * (ahead + behind - 2.0 * guess) / WINDOW**2
        top = g[best]
        place, height, second = _parabola(x, g, best)
        if not height == height:
            height, second = top, -2.0 * own
        else:
            top = max(top, height)
        area, middle, ends = _usual_overlap(x, g, best, top - USUAL_DEPTH, low, high)
        if not ends:
            _fill(wheel, pose, plane, x, rail[:, k], 0, n, 1, guess, g)
            area, middle, _ = _usual_overlap(x, g, best, top - USUAL_DEPTH, 0, n - 1)
        place, second = _of_area(place, second, area, middle)
        wheel_there = wheel_height(wheel, pose, plane, place, 0.0, guess)
        if len(beyond):
            at = (place - x[0]) / h
            i = min(max(int(at), 0), n - 2)
            wheel_there -= beyond[i, k] + (at - i) * (beyond[i + 1, k] - beyond[i, k])
        seen[HEIGHT, k], seen[AHEAD, k] = height + lowest, place - crest
        seen[BEND, k], seen[LIFT, k] = -0.5 * second - own, wheel_there + nominal - lowest
        if not touch >= top:
            touch = top
    return touch
