"""Gap and rigid slip of the true surfaces over a contact plane: a wheel of revolution above a swept rail.

A contact plane has the axes (1) x forward, (2) s to the left in the plane, (3) n from rail into wheel. Lines along n
through its points are intersected with wheel and rail, without an expansion along x or s. A rail that changes along
the track is higher than its section by `ContactGeometry.over`.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import types
from numba.extending import overload

from wrcore.contact.search.strip import AS_KERNELS, cubic_at
from wrcore.kernels.jit import jit

NO_RAIL = 1.0
"""Gap beyond the end of one of the two profiles, m."""

_TOLERANCE = 1e-12
_ON_PROFILE = 1e-9
_MOST_STEPS = 60


class ContactPlane(NamedTuple):
    """Origin (track frame, x from the wheelset's cross-section, m) and contact angle of a contact plane."""

    x: float
    y: float
    z: float
    cosine: float
    sine: float


class Motion(NamedTuple):
    """Velocity of the wheelset's centre (m/s), its angular velocity (rad/s), both in the track frame, and speed (m/s).

    The angular velocity contains the rolling rate: about the axle, positive forward."""

    vx: float
    vy: float
    vz: float
    wx: float
    wy: float
    wz: float
    speed: float


def contact_plane(x, y, z, angle):
    """Return the `ContactPlane` through (x, y, z), m, with a contact angle (rad, about x)."""
    return ContactPlane(float(x), float(y), float(z), math.cos(angle), math.sin(angle))


@jit(allocates=False)
def rail_height(geometry, pose, plane, s, u):
    """Height n (m) of the rail over a contact plane at ``s``, and the profile coordinate of this point (m).

    ``u`` is a guess of the profile coordinate. The height is NaN where the line along n misses the rail's profile."""
    side, sine = pose.side, pose.side * plane.sine
    origin = side * plane.y - geometry.rail_distance
    low, high = geometry.rail_start, geometry.rail_start + (geometry.rail.shape[0] - 1) * geometry.rail_step
    u = min(max(u, low), high)
    for _ in range(_MOST_STEPS):
        f, slope, _ = cubic_at(geometry.rail, geometry.rail_start, geometry.rail_step, u)
        # positive outwards on either side: side s = (u - origin) cos + (f - z) side sin
        miss = (u - origin) * plane.cosine + (f - plane.z) * sine - side * s
        rate = plane.cosine + slope * sine
        if miss > 0.0:
            high = u
        else:
            low = u
        step = miss / rate if rate > 0.0 else math.copysign(high - low, miss)
        new = u - step
        if not low <= new <= high:
            new = 0.5 * (low + high)
        if abs(new - u) < _TOLERANCE:  # beyond an end of the profile the bisection stops with a residual ``miss``
            height = -(u - origin) * sine + (f - plane.z) * plane.cosine
            return (height if abs(miss) < _ON_PROFILE else np.nan), u
        u = new
    return np.nan, u


@jit(allocates=False)
def wheel_height(geometry, pose, plane, x, s, n):
    """Height n (m) of the wheel over a contact plane at (x, s), from the guess ``n``; NaN beyond the profile's ends."""
    # relative to the wheelset's centre; the plane's axes are (1, 0, 0), (0, cos, sin), (0, -sin, cos)
    rx, ry = plane.x + x, plane.y + s * plane.cosine - pose.y
    rz = plane.z + s * plane.sine - pose.z
    across = rx * pose.ex + ry * pose.ey + rz * pose.ez
    lift = -plane.sine * pose.ey + plane.cosine * pose.ez
    square, linear = rx * rx + ry * ry + rz * rz, -ry * plane.sine + rz * plane.cosine
    last = geometry.wheel_start + (geometry.wheel.shape[0] - 1) * geometry.wheel_step
    for _ in range(_MOST_STEPS):
        along = across + n * lift
        u = along - geometry.half_distance
        extra, slope, _ = cubic_at(geometry.wheel, geometry.wheel_start, geometry.wheel_step, u)
        radius = math.sqrt(max(square + n * (2.0 * linear + n) - along * along, 1e-12))
        miss = radius - geometry.rolling_radius - extra
        step = miss / ((linear + n - along * lift) / radius - slope * lift)
        n -= step
        if abs(step) < _TOLERANCE:
            return n if geometry.wheel_start < u < last else np.nan
        if not abs(n) < 0.1:
            break
    return np.nan


def _over(over, rail_start, rail_step, x, u):
    return _height_over(over, rail_start, rail_step, x, u) if len(over) else 0.0


def _height_over(over, rail_start, rail_step, x, u):
    """Interpolate the height of the rail over its section (m): cubic along the track, linear across."""
    at, across = (x - over[0, 0]) / (over[1, 0] - over[0, 0]), (u - rail_start) / rail_step
    i, j = min(max(int(at), 1), over.shape[0] - 3), min(max(int(across), 0), over.shape[1] - 3)
    f, g = min(max(at - i, -1.0), 2.0), min(max(across - j, 0.0), 1.0)
    a, b, c, d = over[i - 1], over[i], over[i + 1], over[i + 2]
    found = 0.0
    for k, w in ((j + 1, 1.0 - g), (j + 2, g)):
        rise, back = c[k] - b[k], 0.5 * (c[k] - a[k])
        ahead = 0.5 * (d[k] - b[k])
        found += w * (b[k] + f * (back + f * (3.0 * rise - 2.0 * back - ahead + f * (back + ahead - 2.0 * rise))))
    return found


@overload(_over, inline="always", jit_options=AS_KERNELS)
def _over_by_type(over, rail_start, rail_step, x, u):
    """Select the kernel of `_over`: for a rail with a constant section it returns 0."""
    if isinstance(over, types.BaseTuple):
        return lambda over, rail_start, rail_step, x, u: 0.0
    return _height_over


@jit(allocates=False, forceinline=True)
def rail_over(geometry, x, u):
    """Height of the rail over its section at ``x`` from the wheelset's cross-section and profile coordinate ``u``,
    m."""
    return _over(geometry.over, geometry.rail_start, geometry.rail_step, x, u)


def _station(over, i):
    return over[i, 0] if len(over) else 0.0


@overload(_station, inline="always", jit_options=AS_KERNELS)
def _station_by_type(over, i):
    if isinstance(over, types.BaseTuple):
        return lambda over, i: 0.0
    return lambda over, i: over[i, 0]


@jit(allocates=False, forceinline=True)
def station_of(geometry, i):
    """Position of the i-th station of a rail that changes along the track, from the wheelset's cross-section, m."""
    return _station(geometry.over, i)


@jit(allocates=False)
def surface_gap(geometry, pose, plane, x, s, gap, height):
    """Fill ``gap`` and ``height`` with the gap of the true surfaces of wheel and rail over a contact plane.

    The points ``x`` (nx,), ``s`` (ns,) are relative to the plane's origin (m, increasing). ``gap`` (nx, ns) is the
    distance from rail to wheel along n (m), negative in overlap, `NO_RAIL` beyond the end of a profile. ``height``
    (nx, ns) is the wheel's height n over the plane (m), 0 beyond the end of a profile. A pose may be spatial or
    planar."""
    u = pose.side * plane.y - geometry.rail_distance + pose.side * plane.cosine * s[0]
    for j in range(s.size):
        rail, u = rail_height(geometry, pose, plane, s[j], u)
        n = rail if rail == rail else 0.0
        for i in range(x.size):
            wheel = wheel_height(geometry, pose, plane, x[i], s[j], n)
            if wheel == wheel and rail == rail:
                over = plane.cosine * rail_over(geometry, plane.x + x[i], u)
                gap[i, j], height[i, j], n = wheel - rail - over, wheel, wheel
            else:
                gap[i, j], height[i, j] = NO_RAIL, 0.0


@jit
def strip_planes(s, gap, height):
    """Return for each strip along x the wheel's minimum height (m), and the slope of the mean surface over s.

    The mean surface lies midway between wheel and rail. ``gap`` and ``height`` come from `surface_gap`. Both results
    (ns,) are 0 beyond the end of a profile."""
    low, tilt = np.zeros(s.size), np.zeros(s.size)
    for j in range(s.size):
        here, middle = _lowest(gap, height, j)
        if here != here:
            continue
        before, after = max(j - 1, 0), min(j + 1, s.size - 1)
        left, right = _lowest(gap, height, before)[1], _lowest(gap, height, after)[1]
        if left != left:
            before, left = j, middle
        if right != right:
            after, right = j, middle
        low[j], tilt[j] = here, (right - left) / (s[after] - s[before]) if after > before else 0.0
    return low, tilt


@jit(allocates=False)
def _lowest(gap, height, j):
    """Minimum height of the wheel in a strip, and the height midway between wheel and rail at this point (m).

    NaN beyond the end of a profile."""
    low = mid = np.nan
    for i in range(gap.shape[0]):
        if gap[i, j] < NO_RAIL and not low <= height[i, j]:
            low, mid = height[i, j], height[i, j] - 0.5 * gap[i, j]
    return low, mid


@jit(allocates=False)
def surface_slip(pose, plane, motion, x, s, low, tilt, wx, ws):
    """Fill ``wx`` and ``ws`` (nx, ns) with the rigid slip of the wheel over the rail at rest, divided by the speed.

    ``wx`` is forward, ``ws`` to the left in the plane of each strip along x. ``low`` and ``tilt`` come from
    `strip_planes`. Each strip has the radius of its point nearest to the rail. Away from this point the undeformed
    wheel moves more slowly along x; the flattened wheel does not, as its surface passes over the same length."""
    slowness = 1.0 / motion.speed
    for j in range(s.size):
        secant = 1.0 / math.sqrt(1.0 + tilt[j] * tilt[j])
        cosine, sine = secant * (plane.cosine - plane.sine * tilt[j]), secant * (plane.sine + plane.cosine * tilt[j])
        py = plane.y + s[j] * plane.cosine - low[j] * plane.sine - pose.y
        pz = plane.z + s[j] * plane.sine + low[j] * plane.cosine - pose.z
        for i in range(x.size):
            px = plane.x + x[i]
            vy = motion.vy + motion.wz * px - motion.wx * pz
            vz = motion.vz + motion.wx * py - motion.wy * px
            wx[i, j] = (motion.vx + motion.wy * pz - motion.wz * py) * slowness
            ws[i, j] = (vy * cosine + vz * sine) * slowness


@jit(allocates=False)
def plane_slip(xi, eta, phi, x, s, wx, ws):
    """Fill ``wx`` and ``ws`` (nx, ns) with the rigid slip of the creepages xi, eta and phi (1/m) at the plane's origin.

    wx = xi - phi s, ws = eta + phi x."""
    for i in range(x.size):
        for j in range(s.size):
            wx[i, j], ws[i, j] = xi - phi * s[j], eta + phi * x[i]
