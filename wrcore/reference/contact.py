"""Contact search over profile nodes: strips of the wheel, overlaps with the rail, Hertz patches (Eqs. 1-6).

The wheel is cut into strips, each a circle of radius R(u) = r0 - f(u) about the axle. With the unit vectors ``outward``
along the axle, ``forward`` and ``down`` normal to it, a strip's points are

    P(u, s) = centre + (h + u) outward + R(u) (sin s forward + cos s down),

and the wheel's normal there is N = sin s forward + cos s down - R'(u) outward. A rail along x can only touch where
N_x = 0, which gives sin s (spatial detection); planar detection takes s = 0, the lowest generator.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from wrcore.geometry.profiles.profile import ProfileCurve

CURVATURE_FLOOR = 0.5
"""Smallest relative curvature that the reduction ``maximum`` hands to Hertz, 1/m."""


@dataclass(frozen=True)
class Pair:
    """A wheel and a straight rail.

    Attributes
    ----------
    wheel, rail : ProfileCurve
    rolling_radius, half_distance, rail_distance : float
        Radius at the tape circle, distance of the tape circle from the wheelset's centre, distance of the rail's origin
        from the track's centre line, m.
    """

    wheel: ProfileCurve
    rail: ProfileCurve
    rolling_radius: float
    half_distance: float
    rail_distance: float


@dataclass(frozen=True)
class Strips:
    """Points of some strips of a wheel above the rail; arrays over the strips.

    Attributes
    ----------
    u, radius, radius_slope : numpy.ndarray, shape (n,)
        Wheel coordinate, R (m) and R'.
    point : numpy.ndarray, shape (n, 3)
        The strip's point that can touch the rail, m.
    slope : numpy.ndarray, shape (n,)
        The wheel's slope in the cross-section over the rail's coordinate.
    u_rail, gap, rail_slope : numpy.ndarray, shape (n,)
        Rail coordinate below the point, vertical gap (m, negative in overlap), slope of the rail there; NaN beside it.
    around : numpy.ndarray, shape (n, 3)
        Unit tangent of the strip's circle.
    """

    u: np.ndarray
    radius: np.ndarray
    radius_slope: np.ndarray
    point: np.ndarray
    slope: np.ndarray
    u_rail: np.ndarray
    gap: np.ndarray
    rail_slope: np.ndarray
    around: np.ndarray


@dataclass(frozen=True)
class Patch:
    """A Hertz patch: its middle relative to the track (m), contact angle (rad), penetration (m), curvatures (1/m)."""

    point: np.ndarray
    angle: float
    penetration: float
    curvature_x: float
    curvature_y: float


def cut_strips(pair, side, centre, axle, u, spatial):
    """Strips of a wheel at lateral coordinates.

    Parameters
    ----------
    pair : Pair
    side : float
        +1 left, -1 right.
    centre : numpy.ndarray, shape (3,)
        Wheelset's centre, m.
    axle : numpy.ndarray, shape (3,)
        Unit vector along the axle, pointing left.
    u : numpy.ndarray, shape (n,)
        m.
    spatial : bool
        Spatial instead of planar detection.

    Returns
    -------
    Strips
    """
    u = np.atleast_1d(u)
    outward = side * axle
    forward = np.array([1.0, 0.0, 0.0]) - outward[0] * outward
    forward /= np.linalg.norm(forward)
    down = np.cross(axle, forward)
    radius, radius_slope = pair.rolling_radius - pair.wheel(u), -pair.wheel(u, 1)
    sine = radius_slope * outward[0] / forward[0] if spatial else np.zeros_like(u)
    cosine = np.sqrt(1.0 - sine**2)
    radial = np.outer(sine, forward) + np.outer(cosine, down)
    point = centre + np.outer(pair.half_distance + u, outward) + radius[:, None] * radial
    if spatial:
        normal = radial - np.outer(radius_slope, outward)
        slope = -side * normal[:, 1] / normal[:, 2]
    else:
        generator = outward + np.outer(radius_slope, down)
        slope = side * generator[:, 2] / generator[:, 1]
    u_rail = side * point[:, 1] - pair.rail_distance
    gap, rail_slope = point[:, 2] - pair.rail(u_rail), pair.rail(u_rail, 1)
    around = np.outer(cosine, forward) - np.outer(sine, down)
    return Strips(u, radius, radius_slope, point, slope, u_rail, gap, rail_slope, around)


def find_patches(pair, side, centre, axle, spatial, reduction, step):
    """All patches of a wheel: every interval of strips with negative gap, reduced to a Hertz patch.

    Parameters
    ----------
    pair, side, centre, axle, spatial
        As for :func:`cut_strips`.
    reduction : {"maximum", "moment"}
        The point of greatest penetration, or the parabolic overlap with the same moments of the squared gap.
    step : float
        Distance of the strips, m.

    Returns
    -------
    list of Patch
        From the flange to the field side.
    """
    u = np.arange(pair.wheel.u[0], pair.wheel.u[-1], step)
    strips = cut_strips(pair, side, centre, axle, u, spatial)
    inside = np.flatnonzero(strips.gap < 0.0)
    overlaps = np.split(inside, np.flatnonzero(np.diff(inside) > 1) + 1) if inside.size else []
    place = (pair, side, centre, axle, spatial)
    if reduction == "moment":
        patches = [patch_of_moments(place, strips.u[nodes], strips.gap[nodes], step) for nodes in overlaps]
    else:
        patches = [patch_at_maximum(place, strips, nodes) for nodes in overlaps]
    return [patch for patch in patches if patch is not None]


def patch_of_moments(place, u, gap, step):
    """Patch whose parabola g = -(d - B e^2) has the moments of g^2 that the overlap has.

    Parameters
    ----------
    place : tuple
        First five arguments of :func:`find_patches`.
    u, gap : numpy.ndarray, shape (n,)
        Strips of the overlap, m.
    step : float
        m.

    Returns
    -------
    Patch or None
        None for an overlap of a single strip, which has no width.
    """
    pair, side, *_ = place
    if len(u) == 1:
        return None
    square = gap**2
    m0 = step * np.sum(square)
    middle = step * np.sum(square * u) / m0
    width_2 = 7.0 * step * np.sum(square * (u - middle) ** 2) / m0
    depth = np.sqrt(15.0 / 16.0 * m0 / np.sqrt(width_2))
    strip = cut_strips(*place[:4], middle, place[4])
    slope = 0.5 * (strip.slope[0] + strip.rail_slope[0])
    cosine = 1.0 / np.sqrt(1.0 + slope**2)
    around = 1.0 / (strip.radius[0] * np.sqrt(1.0 + strip.radius_slope[0] ** 2))
    curvatures = 0.5 * around, depth / width_2 * cosine**3
    return _patch(pair, side, strip, slope, depth * cosine, *curvatures)


def patch_at_maximum(place, strips, nodes):
    """Patch at the point of greatest penetration, where the slopes agree, with the curvatures there.

    Parameters
    ----------
    place : tuple
        First five arguments of :func:`find_patches`.
    strips : Strips
    nodes : numpy.ndarray of int
        Strips in overlap.

    Returns
    -------
    Patch or None
        None where the overlap ends at the edge of a profile before the slopes agree.
    """
    pair, side, *_ = place

    def difference(u):
        strip = cut_strips(*place[:4], u, place[4])
        return strip.slope[0] - strip.rail_slope[0]

    deepest = nodes[np.argmin(strips.gap[nodes] / np.sqrt(1.0 + strips.rail_slope[nodes] ** 2))]
    low = high = deepest
    while low > 0 and not strips.slope[low] - strips.rail_slope[low] < 0.0:
        low -= 1
    while high < len(strips.u) - 1 and not strips.slope[high] - strips.rail_slope[high] > 0.0:
        high += 1
    if not difference(strips.u[low]) < 0.0 < difference(strips.u[high]):
        return None
    u = brentq(difference, strips.u[low], strips.u[high], xtol=1e-15, rtol=1e-14)
    strip = cut_strips(*place[:4], u, place[4])
    slope = strip.rail_slope[0]
    cosine = 1.0 / np.sqrt(1.0 + slope**2)
    # curvatures in the contact plane: the wheel's two principal ones, turned into the rolling direction, and the rail's
    wheel_cosine = 1.0 / np.sqrt(1.0 + strip.radius_slope[0] ** 2)
    sine = strip.around[0] @ [0.0, cosine, side * slope * cosine] if place[4] else 0.0
    turn = np.array([[np.sqrt(1.0 - sine**2), -sine], [sine, np.sqrt(1.0 - sine**2)]])
    principal = np.diag([wheel_cosine / strip.radius[0], pair.wheel(u, 2) * wheel_cosine**3])
    relative = turn @ principal @ turn.T
    relative[1, 1] -= pair.rail(strip.u_rail[0], 2) * cosine**3
    smaller, larger = 0.5 * np.maximum(np.linalg.eigvalsh(relative), CURVATURE_FLOOR)
    along, across = (smaller, larger) if relative[0, 0] < relative[1, 1] else (larger, smaller)
    penetration = -strip.gap[0] * cosine
    return _patch(pair, side, strip, slope, penetration, along, across) if penetration > 0.0 else None


def _patch(pair, side, strip, slope, penetration, curvature_x, curvature_y):
    """Patch in the contact plane: half the penetration above the wheel's undeformed point, along the normal."""
    angle = side * np.arctan(slope)
    normal = np.array([0.0, -np.sin(angle), np.cos(angle)])
    point = strip.point[0].copy()
    point[2] = pair.rail(strip.u_rail[0]) - penetration / np.cos(angle)
    return Patch(point + 0.5 * penetration * normal, float(angle), float(penetration), curvature_x, curvature_y)
