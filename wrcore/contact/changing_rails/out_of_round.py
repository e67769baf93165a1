"""Gap between a wheel out of round and its rail, by an equivalent change of the rail's height.

A wheel out of round has radii R(u) + dR(angle, u), a wheel of revolution about the same axle has radii R(u). At each
point of the track the difference of their heights can be added to the rail's height: the gap is the same. A wheel out
of round is therefore treated as a wheel of revolution on a rail that changes along the track
(`wrcore.contact.changing_rails.sections`).
"""

import math
from dataclasses import dataclass

import numpy as np

from wrcore.geometry.changing_rails.slices import TURN, WheelSlices
from wrcore.geometry.out_of_round import whole_turn
from wrcore.geometry.profiles.profile import SPACING
from wrcore.kernels.jit import jit

STEP = 1e-3
"""Step of the angles at which the wheel's sections are evaluated, rad; they are interpolated by cubics."""


def reach_beyond(slices, wheel, pose, turned, x, strips):
    """Depth by which a wheel of slices reaches further down than the wheel of revolution, (n, m), m; NaN outside its
    profile.

    Parameters
    ----------
    slices : WheelSlices
    wheel : ContactGeometry
        Geometry of the wheel of revolution.
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
    _reach(wheel, pose.ex, turned, x, strips, angles[0], f, rate, across[0], SPACING, found)
    return found


@dataclass(frozen=True, eq=False)
class SlicedWheel:
    """Shape of a wheel of slices, relative to a wheel of revolution with a ``radius`` (m) at the tape circle."""

    slices: WheelSlices
    radius: float
    level = True
    """Whether patches stay level under it."""

    @property
    def shortest(self):
        """Length (m) of the shortest wave that its slices resolve well."""
        return 8.0 * self.radius * np.diff(self.slices.angles).min(initial=TURN)

    def nodes(self, step, pad):
        """Return first node, step and number of nodes over one turn, as `OutOfRound.nodes`."""
        return whole_turn(step / self.radius, pad)

    def within(self, strips):
        """Return the first and last index of the strips around the tape circle that exist in all slices.

        ``strips`` (m,) are equally spaced wheel coordinates, m."""
        angles = np.concatenate([self.slices.angles, np.arange(0.0, TURN, 1e-2)])
        there = np.isfinite(self.slices.heights(angles, strips)[0]).all(axis=0)
        middle = int(np.argmin(np.abs(strips)))
        if not there[middle]:
            return middle, middle - 1
        missing = np.flatnonzero(~there)
        low, high = missing[missing < middle], missing[missing > middle]
        return int(low[-1]) + 1 if low.size else 0, int(high[0]) - 1 if high.size else strips.size - 1

    def reach_over(self, wheel, strips):
        """Return a function of the angle turned and the stations that computes `reach_beyond` for a centred wheelset.

        The wheelset has no roll and yaw. The function is fast for repeated calls with equally spaced ``strips``."""
        count = math.ceil((0.5 * TURN + 0.5) / STEP)
        angles = STEP * np.arange(-count, count + 1)
        f, _, rate = self.slices.heights(angles, strips)
        spacing = (strips[-1] - strips[0]) / (strips.size - 1)

        def reach(turned, x):
            found, turned = np.empty((x.size, strips.size)), math.remainder(turned, TURN)
            _reach(wheel, 0.0, turned, x, strips, angles[0], f, rate, strips[0], spacing, found)
            return found

        return reach


@jit
def _reach(wheel, ex, turned, x, strips, first, f, rate, start, spacing, found):
    """Fill ``found`` (see `reach_beyond`) from heights of the wheel's sections with a lateral ``spacing`` (m), and
    their derivatives over the angle."""
    for k in range(strips.size):
        w = strips[k]
        at = (w - start) / spacing
        j = min(max(int(at), 0), f.shape[1] - 2)
        t = at - j
        node = (w - wheel.wheel_start) / wheel.wheel_step
        i = min(max(int(node), 0), wheel.wheel.shape[0] - 2)
        own = wheel.wheel[i, 0] + (node - i) * (wheel.wheel[i + 1, 0] - wheel.wheel[i, 0])
        round_radius, centre = wheel.rolling_radius + own, (wheel.half_distance + w) * ex
        for n in range(x.size):
            d, radius, part = x[n] - centre, round_radius, 0.0
            for _ in range(4):  # each step reduces the error by the factor d dR/dangle / R^2, about 0.001
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
    """Height interpolated by a cubic between two angles."""
    rise, m0, m1 = f[q + 1, j] - f[q, j], rate[q, j] * STEP, rate[q + 1, j] * STEP
    return f[q, j] + part * (m0 + part * (3.0 * rise - 2.0 * m0 - m1 + part * (m0 + m1 - 2.0 * rise)))
