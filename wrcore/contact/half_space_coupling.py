"""Elastic displacement and slip of a contact patch by the load and the friction of another one on the same half-space.

The pressure of one patch displaces the surface under the other (Boussinesq's formula), and tilts it, because the
displacement is larger on the near side. Friction causes a rigid slip (Cerruti's formula): the slope of the surface
displacement along x (K. L. Johnson, Contact Mechanics, 3.2 and 3.6). A displacement changes the load of a patch by its
mean weighted with the pressure under a flat punch (Betti's theorem). The displacement of patch i by patch j is

    N_j / (pi E*) times the mean of 1/r

over Hertz's pressure on j and a punch's pressure on i. Means along x are Gauss sums of three points; means across the
patch are of second order.
"""

import math
from typing import NamedTuple

import numpy as np

from wrcore.kernels.jit import FUSED, jit

_HERTZ_PLACES, _HERTZ_PARTS = np.array([-1.0, 0.0, 1.0]) * math.sqrt(3.0 / 7.0), np.array([7.0, 16.0, 7.0]) / 30.0
_PUNCH_PLACES, _PUNCH_PARTS = np.array([-1.0, 0.0, 1.0]) * math.sqrt(0.6), np.array([5.0, 8.0, 5.0]) / 18.0
"""Gauss points along x over the half length, and weights, for Hertz's pressure and for a punch's pressure."""


class Ellipse(NamedTuple):
    """Position, size and contact angle of a patch, which determine its influence on other patches."""

    x: float
    y: float
    z: float
    """Centre, m, in axes shared by all patches of a wheel."""
    a: float
    b: float
    """Semi-axes in the rolling direction and across, m."""
    cosine: float
    sine: float
    """Cosine and sine of the contact angle."""


@jit(allocates=False, forceinline=True)
def ellipse_of(values):
    """Return the `Ellipse` whose fields are in an array (7,)."""
    return Ellipse(values[0], values[1], values[2], values[3], values[4], values[5], values[6])


@jit(allocates=False, forceinline=True)
def write_ellipse(values, x, y, z, a, b, cosine, sine):
    """Write the fields of an `Ellipse` into an array (7,)."""
    values[0], values[1], values[2], values[3], values[4], values[5], values[6] = x, y, z, a, b, cosine, sine


@jit(allocates=False, fastmath=FUSED)
def rise_by_pressure(one, other):
    """Mean of 1/r between two patches (1/m), and its derivative across the first one (1/m^2)."""
    dx, dy, dz = one.x - other.x, one.y - other.y, one.z - other.z
    square, value, slope, width = dy * dy + dz * dz, 0.0, 0.0, one.b * one.b
    spread = 0.5 * (0.2 * other.b * other.b + width / 3.0)
    for m in range(3):
        for n in range(3):
            x = dx + _PUNCH_PLACES[m] * one.a - _HERTZ_PLACES[n] * other.a
            inverse = 1.0 / (square + x * x)
            part = _PUNCH_PARTS[m] * _HERTZ_PARTS[n] * math.sqrt(inverse)
            value += part * (1.0 + spread * inverse * (3.0 * square * inverse - 1.0))
            slope += part * inverse * (1.0 + 0.6 * width * inverse)
    return value, -slope * (dy * one.cosine + dz * one.sine)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _moment_share(other):
    """Fraction of the friction moment of a patch that is due to lateral forces: 1 in a slender patch."""
    ratio = other.b * other.b / (other.a * other.a)
    return max(1.0 - ratio, 0.0) / (1.0 + ratio)


@jit(allocates=False, fastmath=FUSED)
def slip_by_friction(poisson_ratio, one, other, fx, fy, mz):
    """Longitudinal and lateral creepage of the first patch by friction on the other one, times pi G (N/m^2).

    Friction on the other patch: ``fx``, ``fy`` (N) along and across, moment ``mz`` (N m)."""
    dx, dy, dz = one.x - other.x, one.y - other.y, one.z - other.z
    square = dy * dy + dz * dz
    spread = 0.2 * (one.b * one.b + other.b * other.b)
    direct_x = direct_y = turned = oblique = 0.0
    for m in range(3):
        for n in range(3):
            x = dx + _HERTZ_PLACES[m] * one.a - _HERTZ_PLACES[n] * other.a
            inverse = 1.0 / (square + x * x)
            part = _HERTZ_PARTS[m] * _HERTZ_PARTS[n] * inverse * math.sqrt(inverse)
            ahead = x * x * inverse
            direct_x += part * x * ((1.0 - poisson_ratio) - poisson_ratio * (2.0 - 3.0 * ahead))
            direct_y += part * x * ((1.0 - poisson_ratio) + 3.0 * poisson_ratio * (1.0 - ahead))
            turned -= part * ((1.0 - poisson_ratio) + 3.0 * poisson_ratio * (1.0 - ahead))
            oblique -= part * poisson_ratio * (1.0 - 3.0 * ahead)
    oblique *= math.copysign(math.sqrt(square), dy) * (1.0 + 3.0 * spread / square)
    return direct_x * fx + oblique * fy, direct_y * fy + turned * _moment_share(other) * mz + oblique * fx
