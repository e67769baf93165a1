"""A rail that changes along the track, as a wheel in a pose sees it: one section, ready for every search and patch.

At each lateral coordinate the gap between the wheel of revolution and the rail's surface z(x, y) is least at some x,
ahead of the axle where the rail rises. The seen section has the height that gives a prismatic rail the same least gap,

    f(y) = max_x (z_rail(x, y) - z_wheel(x, y)) + min_x z_wheel(x, y),

which does not depend on the wheelset's height. What strips want beside it is kept at the section's nodes
(`ContactGeometry.along`): how much further ahead the gap is least than over a prismatic rail, half of what the gap's
second derivative over x has more, and how much higher the wheel's point there lies. Gap, place and curvature are those
of the parabola that fits the gap best over the length of a patch: strips know parabolas only. Over a rail that is the
same everywhere the section is the rail's own and all three vanish.

Where a head begins or ends under the wheel, its edge may be what is nearest; it then counts with the wheel's curvature
alone. Of two places along one line of the track that the wheel touches at once only the nearer one is seen.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from wrcore.contact.detection import axle_direction
from wrcore.contact.geometry import contact_geometry
from wrcore.contact.patch.surfaces import ContactPlane, wheel_height
from wrcore.contact.strip import make_pose, strip_point
from wrcore.geometry.profile import SPACING, ProfileCurve, averaged_second_derivative
from wrcore.geometry.slices import RailSlices
from wrcore.geometry.track import SIDES
from wrcore.kernels.jit import jit

REACH, STEP = 0.1, 2e-3
"""Half of the length along the track that is looked at, and the distance of the sections there, m: ramps up to 1:4.6 of
a wheel of 460 mm, and a window of four steps, a patch's length, for the curvature."""

BELOW = 0.03
"""Depth below the section's lowest point at which what lies between its heads is put, m."""

HEIGHT, AHEAD, BEND, LIFT = range(4)


@dataclass(frozen=True)
class WheelOnSlices:
    """A wheel on a rail of slices.

    Parameters
    ----------
    wheel : ProfileCurve
    rail : RailSlices
        In the coordinates of the track: u from ``rail_distance``, f from the plane from which the wheelset's height
        counts.
    rolling_radius, half_distance, rail_distance : float
        As for `WheelOnRail`, m.
    """

    wheel: ProfileCurve
    rail: RailSlices
    rolling_radius: float = 0.46
    half_distance: float = 0.75
    rail_distance: float = 0.75

    @cached_property
    def _wheel_geometry(self):
        """Geometry of the wheel over a level rail: what the search for the seen section takes of it."""
        u = SPACING * np.arange(-400, 401)
        level = ProfileCurve("level", "rail", u, *np.zeros((3, u.size)))
        sizes = self.rolling_radius, self.half_distance, self.rail_distance
        return contact_geometry(self.wheel, level, *sizes)

    def under(self, side, s, y, roll=0.0, yaw=0.0):
        """`ContactGeometry` of the section that the wheel of a ``side`` sees with the wheelset's centre at s, y (m), in
        a roll and yaw (rad), and the height (m) of the centre at which it first touches; None and NaN where there is no
        rail under the wheel."""
        sign, wheel = SIDES[side], self._wheel_geometry
        pose = make_pose(1.0, sign * y, 0.0, *axle_direction(sign * roll, sign * yaw), True)
        low, high = (strip_point(wheel, pose, u)[0] for u in self.wheel.u[[0, -1]])
        u = SPACING * np.arange(math.ceil(low / SPACING), math.floor(high / SPACING) + 1)
        x = self._stations(s)
        rail = self.rail.heights(s + x, u)[0]
        seen = np.zeros((4, u.size))
        touch = _see(wheel, pose, x, rail, u, seen)
        there = np.isfinite(seen[HEIGHT])
        if there.sum() < 10:
            return None, math.nan
        f, slope = _filled(seen[HEIGHT], there)
        curve = ProfileCurve(f"{self.rail.name} at s = {s:g} m", "rail", u, f, slope,
                             averaged_second_derivative(u, f, slope))  # fmt: skip
        geometry = contact_geometry(self.wheel, curve, self.rolling_radius, self.half_distance, self.rail_distance)
        return geometry._replace(along=np.ascontiguousarray(seen[AHEAD:].T)), touch

    def _stations(self, s):
        """Where sections are taken, from the wheelset's cross-section, m: where a part begins there is one."""
        count = round(REACH / STEP)
        begins = self.rail.begins() - s
        begins = begins[np.abs(begins) < REACH]
        shift = math.remainder(begins[np.argmin(np.abs(begins))], STEP) if begins.size else 0.0
        return STEP * np.arange(-count, count + 1) + shift


def _filled(f, there):
    """Heights, with something far below where there is no rail, and slopes by differences of the fourth order."""
    filled, slope = np.where(there, f, np.min(f, where=there, initial=np.inf) - BELOW), np.zeros(f.size)
    ends = np.flatnonzero(np.diff(there.astype(int), prepend=0, append=0)).reshape(-1, 2)
    for first, last in ends:
        part = f[first:last]
        if part.size < 5:
            filled[first:last] = filled.min()
            continue
        d = np.gradient(part, SPACING, edge_order=2)
        d[2:-2] = (part[:-4] - 8.0 * part[1:-3] + 8.0 * part[3:-1] - part[4:]) / (12.0 * SPACING)
        slope[first:last] = d
    return filled, slope


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


@jit(allocates=False)
def _parabola(a, b, c, d, e):
    """Coefficients of the parabola through five even values that fits them best, those in the middle most: as a patch
    that reaches a little beyond them weights what it feels, (1 - (t/2.5)^2)."""
    # normal equations in t = -2..2: moments of the weights 1, 0.84, 0.36
    even0, even2 = c + 0.84 * (b + d) + 0.36 * (a + e), 0.84 * (b + d) + 1.44 * (a + e)
    c1 = (0.84 * (d - b) + 0.72 * (e - a)) / 4.56
    c2 = (3.4 * even2 - 4.56 * even0) / (3.4 * 13.2 - 4.56 * 4.56)
    return (even0 - 4.56 * c2) / 3.4, c1, c2


@jit
def _see(wheel, pose, x, rail, u, seen):
    """Fill ``seen`` (4, m) over rail coordinates ``u`` (m,) from heights of the rail (n, m) at ``x`` (n,); returns the
    height of the wheelset's centre at the first touch. Stations are evenly apart."""
    n, h, touch = x.size, x[1] - x[0], np.nan
    g, nominal = np.empty(n), -wheel.rolling_radius
    for k in range(u.size):
        seen[HEIGHT, k] = np.nan
        _, crest, lowest = _strip_over(wheel, pose, u[k])
        plane = ContactPlane(0.0, u[k] + wheel.rail_distance, nominal, 1.0, 0.0)
        best, guess = -1, lowest - nominal
        for i in range(n):
            g[i] = np.nan
            if rail[i, k] == rail[i, k]:
                guess = wheel_height(wheel, pose, plane, x[i], 0.0, guess)
                if not guess == guess:
                    guess = lowest - nominal
                    continue
                g[i] = rail[i, k] - guess - nominal
                if best < 0 or g[i] > g[best]:
                    best = i
        if best < 0:
            continue
        ahead = behind = wheel_height(wheel, pose, plane, crest, 0.0, lowest - nominal)
        ahead = wheel_height(wheel, pose, plane, crest + 2.0 * h, 0.0, ahead)
        behind = wheel_height(wheel, pose, plane, crest - 2.0 * h, 0.0, behind)
        own = 0.125 * (ahead + behind - 2.0 * (lowest - nominal)) / (h * h)
        top, height, t, second = g[best], g[best], 0.0, -2.0 * own
        if 1 < best < n - 2 and g[best - 2] + g[best + 2] == g[best - 2] + g[best + 2]:
            a, b, c, d, e = g[best - 2], g[best - 1], g[best], g[best + 1], g[best + 2]
            if b == b and d == d:
                d1, d2 = (a - 8.0 * b + 8.0 * d - e) / 12.0, (16.0 * (b + d) - a - e - 30.0 * c) / 12.0
                top = c - 0.5 * d1 * d1 / d2 if d2 < 0.0 and abs(d1) < -d2 else c
                c0, c1, c2 = _parabola(a, b, c, d, e)
                if c2 < 0.0:
                    t = min(max(-0.5 * c1 / c2, -1.0), 1.0)
                    height, second = c0 + t * (c1 + t * c2), 2.0 * c2 / (h * h)
        place = x[best] + t * h
        wheel_there = wheel_height(wheel, pose, plane, place, 0.0, guess)
        seen[HEIGHT, k], seen[AHEAD, k] = height + lowest, place - crest
        seen[BEND, k], seen[LIFT, k] = -0.5 * second - own, wheel_there + nominal - lowest
        if not touch >= top:
            touch = top
    return touch
