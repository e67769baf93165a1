"""Gap between one strip of the wheel and the rail below it.

The wheel is cut into strips, each a circle of radius R(u) about the axle. With the side's outward axle direction e,
a strip's point is P = C + R d with d normal to e, and the wheel's outward normal there is N ~ d - R' e.

* spatial: at the strip's extreme point against an extruded rail the normal has no longitudinal component, N_x = 0.
  The solution in closed form is d_x = R' e_x, so that no iteration along the rail is needed.
* planar: the strip's lowest point; the wheel's lowest generator is placed in the cross-section at the wheelset's arc
  length.

A :class:`Pose` holds the coefficients that all strips of one wheel share, so that a strip costs a few multiplications.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import types
from numba.extending import overload

from wrcore.contact.search.geometry import CURVATURE, SLOPE, VALUE
from wrcore.kernels.jit import jit

AHEAD, BEND, LIFT, LEAN, CHANGED = range(5)
"""Columns of `ContactGeometry.along`: corrections of a strip where the rail changes along the track.

AHEAD: x of the minimum gap (m). BEND: half of the gap's second derivative along x (1/m). LIFT: height of the wheel's
point at the minimum (m). LEAN: the part of AHEAD that the rail's slope causes (m), 0 for a wheel out of round on a
level rail. CHANGED, first row only: 0 where the rail has its plain section."""


class Pose(NamedTuple):
    """Position and attitude of a wheel and the coefficients of its strips, for kernels.

    With ``along = tilt R'`` and ``down = sqrt(1 - along^2)`` a strip at distance c along the axle has
    y = y0 + c ey + R (down y_down + along y_along), and z likewise."""

    side: float
    y: float
    z: float
    ex: float
    ey: float
    ez: float
    q: float
    """sqrt(1 - ex^2)."""
    tilt: float
    """ex / q for spatial, 0 for planar detection."""
    y_down: float
    y_along: float
    z_down: float
    z_along: float


@jit(allocates=False, forceinline=True)
def make_pose(side, y, z, ex, ey, ez, spatial):
    """Return the `Pose` of a wheel from the wheelset's centre (m) and the wheel's outward axle direction."""
    q = math.sqrt(1.0 - ex * ex)
    r = 1.0 / q
    tilt = ex * r if spatial else 0.0
    return Pose(side, y, z, ex, ey, ez, q, tilt, side * ez * r, -ex * ey * r, -side * ey * r, -ex * ez * r)


@jit(allocates=False, forceinline=True)
def cubic_at(nodes, start, step, u):
    """Value, slope and second derivative of the cubic Hermite interpolant at ``u``; end cells are extrapolated."""
    inverse = 1.0 / step
    position = (u - start) * inverse
    cell = min(max(int(position), 0), nodes.shape[0] - 2)
    t = position - cell
    low, high = np.uint64(cell), np.uint64(cell + 1)  # unsigned: numba leaves out the treatment of negative indices
    y0, y1 = nodes[low, VALUE], nodes[high, VALUE]
    d0, d1 = nodes[low, SLOPE] * step, nodes[high, SLOPE] * step
    c2 = 3.0 * (y1 - y0) - 2.0 * d0 - d1
    c3 = d0 + d1 - 2.0 * (y1 - y0)
    value = y0 + t * (d0 + t * (c2 + t * c3))
    slope = (d0 + t * (2.0 * c2 + 3.0 * t * c3)) * inverse
    return value, slope, (2.0 * c2 + 6.0 * t * c3) * (inverse * inverse)


AS_KERNELS = {"_nrt": False, "error_model": "numpy"}


def _with_rail_along(along, start, step, column, ur, factor, value):
    return _added(along, start, step, column, ur, factor, value) if len(along) else value


def _added(along, start, step, column, ur, factor, value):
    position = (ur - start) / step
    i = min(max(int(position), 0), along.shape[0] - 2)
    t = min(max(position - i, 0.0), 1.0)
    return value + factor * (along[i, column] * (1.0 - t) + along[i + 1, column] * t)


@overload(_with_rail_along, inline="always", jit_options=AS_KERNELS)
def _of_its_type(along, start, step, column, ur, factor, value):
    """Select the kernel of `_with_rail_along`: for a rail with a constant section it returns ``value`` unchanged."""
    if isinstance(along, types.BaseTuple):
        return lambda along, start, step, column, ur, factor, value: value
    return _added


@jit(allocates=False, forceinline=True)
def with_rail_along(geometry, column, ur, factor, value):
    """Return ``value`` plus ``factor`` times a correction for a rail that changes along the track.

    The correction is the ``column`` (`AHEAD`, `BEND`, `LIFT` or `LEAN`) at the rail coordinate ``ur`` (m)."""
    return _with_rail_along(geometry.along, geometry.rail_start, geometry.rail_step, column, ur, factor, value)


def _changes(along):
    return len(along) > 0


@overload(_changes, inline="always", jit_options=AS_KERNELS)
def _changes_by_type(along):
    if isinstance(along, types.BaseTuple):
        return lambda along: False
    return lambda along: True


@jit(allocates=False, forceinline=True)
def changes_along(geometry):
    """Whether the rail changes along the track; a constant of each compiled kernel."""
    return _changes(geometry.along)


def _changed(along):
    return len(along) > 0 and along[0, CHANGED] != 0.0


@overload(_changed, inline="always", jit_options=AS_KERNELS)
def _changed_by_type(along):
    if isinstance(along, types.BaseTuple):
        return lambda along: False
    return lambda along: along[0, CHANGED] != 0.0


@jit(allocates=False, forceinline=True)
def changed_here(geometry):
    """Whether the rail at the wheel's present position differs from its plain section."""
    return _changed(geometry.along)


def _turn(along):
    for i in range(len(along)):
        along[i, AHEAD], along[i, LEAN] = -along[i, AHEAD], -along[i, LEAN]


@overload(_turn, jit_options=AS_KERNELS)
def _turn_by_type(along):
    if isinstance(along, types.BaseTuple):
        return lambda along: None
    return _turn


@jit(allocates=False, forceinline=True)
def turn_along(geometry):
    """Reverse the x direction of the corrections for a rail that changes along the track, in place.

    The result is the rail under the mirror image, along x, of the wheel for which it was written. A second call
    restores it."""
    _turn(geometry.along)


@jit(allocates=False, forceinline=True)
def lean_at(geometry, ur, pz):
    """Cosine and sine of the angle about the axle from the point of the rail below the axle to the contact point.

    The angle is not 0 where the rail's height changes along the track. The contact point is at the rail coordinate
    ``ur`` and ``pz`` (m) over the axle. The normal of a body of revolution passes through its axle; under a wheel out
    of round the rail stays level."""
    if not changes_along(geometry):
        return 1.0, 0.0
    ahead = with_rail_along(geometry, LEAN, ur, 1.0, 0.0)
    inverse = 1.0 / math.sqrt(ahead * ahead + pz * pz)
    return -pz * inverse, ahead * inverse


@jit(allocates=False, forceinline=True)
def leaning(geometry, lean, x, z):
    """Components of a vector (x, z) in axes rotated by the angle of `lean_at`: along and normal to the contact
    plane."""
    if changes_along(geometry):
        return lean[0] * x + lean[1] * z, lean[0] * z - lean[1] * x
    return x, z


@jit(allocates=False, forceinline=True)
def upright(geometry, lean, x, z):
    """Components in the rail's frame of a vector (x, z) given in the axes of `leaning`."""
    return leaning(geometry, (lean[0], -lean[1]), x, z)


@jit(allocates=False, forceinline=True)
def curvature_at(nodes, start, step, u):
    """Second derivative of a profile for Hertz (1/m): its mean over a window, interpolated linearly between nodes."""
    position = (u - start) / step
    i = min(max(int(position), 0), nodes.shape[0] - 2)
    t = position - i
    return nodes[i, CURVATURE] * (1.0 - t) + nodes[i + 1, CURVATURE] * t


@jit(allocates=False, forceinline=True)
def strip_point(geometry, pose, u):
    """Extreme point of the strip at wheel coordinate ``u``.

    Returns the rail coordinate below it and its height (m), R, R' and R'' of the interpolated profile, and the
    longitudinal component of the strip's radius direction, divided by q."""
    extra, slope, second = cubic_at(geometry.wheel, geometry.wheel_start, geometry.wheel_step, u)
    radius = geometry.rolling_radius + extra
    along = slope * pose.tilt
    dy, dz = radius_direction(pose, along)
    reach = geometry.half_distance + u
    y, z = pose.y + reach * pose.ey + radius * dy, pose.z + reach * pose.ez + radius * dz
    return pose.side * y - geometry.rail_distance, z, radius, slope, second, along


@jit(allocates=False, forceinline=True)
def radius_direction(pose, along):
    """Components y and z of the direction d of a strip's radius."""
    down = math.sqrt(max(1.0 - along * along, 0.0))
    return down * pose.y_down + along * pose.y_along, down * pose.z_down + along * pose.z_along


@jit(allocates=False, forceinline=True)
def on_rail(geometry, ur):
    """Whether a rail coordinate lies inside the rail's profile."""
    return geometry.rail_start <= ur <= geometry.rail_start + (geometry.rail.shape[0] - 1) * geometry.rail_step


@jit(allocates=False, forceinline=True)
def gap_at(geometry, pose, u):
    """Vertical gap (m) of the strip at ``u``, and the rail's slope; negative in overlap, 1 m beyond the rail's
    profile."""
    ur, z, _, _, _, _ = strip_point(geometry, pose, u)
    if not on_rail(geometry, ur):
        return 1.0, 0.0
    f, slope, _ = cubic_at(geometry.rail, geometry.rail_start, geometry.rail_step, ur)
    return z - f, slope


@jit(allocates=False, forceinline=True)
def wheel_slope(pose, slope, along):
    """Slope of the wheel in the cross-section over the rail's lateral coordinate.

    Spatial: the normal d - R' e has no x component, so its y, z part is normal to the tangent in the cross-section.
    Planar: the tangent of the generator, projected."""
    if pose.tilt != 0.0:
        dy, dz = radius_direction(pose, along)
        return -pose.side * (dy - slope * pose.ey) / (dz - slope * pose.ez)
    return pose.side * (pose.ez + slope * pose.z_down) / (pose.ey + slope * pose.y_down)


@jit(allocates=False, forceinline=True)
def gap_and_slope(geometry, pose, u):
    """Vertical gap (m) of the strip at ``u`` and its slope over ``u``, without the small rotation by roll and yaw."""
    ur, z, _, slope, _, along = strip_point(geometry, pose, u)
    f, rail_slope, _ = cubic_at(geometry.rail, geometry.rail_start, geometry.rail_step, ur)
    return z - f, wheel_slope(pose, slope, along) - rail_slope


@jit(allocates=False, forceinline=True)
def slope_difference(geometry, pose, u):
    """Slope of the wheel minus slope of the rail below it, and the derivative of this difference over ``u`` (1/m).

    Both slopes are over the rail's lateral coordinate. The difference is negative at smaller and positive at larger
    ``u`` than a point of maximum penetration. The derivative neglects the small rotation of the wheel's slope by roll
    and yaw, which is accurate enough for Newton steps."""
    ur, _, _, slope, second, along = strip_point(geometry, pose, u)
    _, rail_slope, rail_second = cubic_at(geometry.rail, geometry.rail_start, geometry.rail_step, ur)
    return wheel_slope(pose, slope, along) - rail_slope, -second - rail_second
