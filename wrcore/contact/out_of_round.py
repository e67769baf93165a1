"""A wheel out of round, as the rail below it feels it.

Of a wheel of revolution with radii R(u) and one with radii R(u) + dR(angle, u) about the same axle the second reaches
less or further down. At each point along the track and across, that difference of depths may as well be added to the
rail's height: the gap is the same. So a wheel out of round is a wheel of revolution on a rail that changes along the
track (`wrcore.contact.seen_rail`).
"""

import math

import numpy as np

from wrcore.geometry.profile import SPACING
from wrcore.kernels.jit import jit

STEP = 1e-3
"""Angles at which the wheel's sections are taken, rad; a cubic runs between them."""


def reach_beyond(slices, wheel, pose, turned, x, strips):
    """How much further down a wheel of slices reaches than the wheel of revolution, (n, m), m; NaN beside its profile.

    Parameters
    ----------
    slices : WheelSlices
    wheel : ContactGeometry
        Of the wheel of revolution.
    pose : Pose
    turned : float
        Angle by which the wheel has rolled forward, rad.
    x : numpy.ndarray
        (n,) stations along the track from the wheelset's centre, m.
    strips : numpy.ndarray
        (m,) wheel coordinates, m.
    """
    across = SPACING * np.arange(math.floor(strips.min() / SPACING), math.ceil(strips.max() / SPACING) + 2)
    reach = math.asin(min((np.abs(x).max() + abs(pose.ex)) / (0.9 * wheel.rolling_radius), 0.9)) + 2.0 * STEP
    angles = turned + STEP * np.arange(-math.ceil(reach / STEP), math.ceil(reach / STEP) + 1)
    f, _, rate = slices.heights(angles, across)
    found = np.empty((x.size, strips.size))
    _reach(wheel, pose.ex, turned, x, strips, angles[0], f, rate, across[0], found)
    return found


@jit
def _reach(wheel, ex, turned, x, strips, first, f, rate, start, found):
    """Fill ``found`` from heights of the wheel's sections and their rates over the angle."""
    for k in range(strips.size):
        w = strips[k]
        at = (w - start) / SPACING
        j = min(max(int(at), 0), f.shape[1] - 2)
        t = at - j
        node = (w - wheel.wheel_start) / wheel.wheel_step
        i = min(max(int(node), 0), wheel.wheel.shape[0] - 2)
        own = wheel.wheel[i, 0] + (node - i) * (wheel.wheel[i + 1, 0] - wheel.wheel[i, 0])
        round_radius, centre = wheel.rolling_radius + own, (wheel.half_distance + w) * ex
        for n in range(x.size):
            d, radius, part = x[n] - centre, round_radius, 0.0
            for _ in range(4):  # each step leaves d dR/dangle / R^2 of the one before: a thousandth
                place = (turned + math.asin(d / radius) - first) / STEP
                q = min(max(int(place), 0), f.shape[0] - 2)
                part = place - q
                left = _cubic(f, rate, q, j, part)
                radius = wheel.rolling_radius - (left + t * (_cubic(f, rate, q, j + 1, part) - left))
                if not radius == radius:
                    break
            found[n, k] = math.sqrt(radius * radius - d * d) - math.sqrt(round_radius * round_radius - d * d)


@jit(allocates=False, forceinline=True)
def _cubic(f, rate, q, j, part):
    """Height between two angles."""
    rise, m0, m1 = f[q + 1, j] - f[q, j], rate[q, j] * STEP, rate[q + 1, j] * STEP
    return f[q, j] + part * (m0 + part * (3.0 * rise - 2.0 * m0 - m1 + part * (m0 + m1 - 2.0 * rise)))
