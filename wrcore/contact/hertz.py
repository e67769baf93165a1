"""Normal contact by Hertz's ellipse with exact elliptic integrals, and the normal force of Eq. (7) with damping.

For the gap A x^2 + B y^2 (x rolling, y lateral) and an approach delta, Hertz's solution is written as

    N = (4/3) E* k(l) (A + B)^(-1/2) delta^(3/2),    a = p(l) sqrt(delta / (A + B)),    b = p(-l) sqrt(delta / (A + B))

with l = ln(B/A). The shape functions k (even) and p are tabulated once from the elliptic integrals and interpolated,
so that no iteration is needed in a contact.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from wrcore.geometry.spline import spline_slopes
from wrcore.kernels.jit import FUSED, jit

LOG_RATIO_MAX = 14.0
_NODES = 561


class HertzTable(NamedTuple):
    """Shape functions of Hertz's ellipse over l = ln(B/A), for kernels."""

    step: float
    values: np.ndarray
    """(n, 8): p(l), p(-l), k and ln(a/b) at l = -LOG_RATIO_MAX + i * step, then their derivatives times the step."""


@jit(allocates=False, forceinline=True)
def contact_modulus(shear_modulus, poisson_ratio):
    """Contact modulus E* of two equal bodies, Pa: 1/E* = 2 (1 - nu^2)/E, E = 2 G (1 + nu), so E* = G/(1 - nu)."""
    return shear_modulus / (1.0 - poisson_ratio)


def _elliptic(flat):
    """Return the elliptic integrals K, E/flat - K and K - E of the ellipse with (b/a)^2 = ``flat``.

    The method is the arithmetic-geometric mean. With c_n the half differences of the means and S the sum of
    2^(n-1) c_n^2, K - E = K S. This avoids the difference of two nearly equal numbers for an ellipse close to a
    circle."""
    mean, other, total, weight = np.ones_like(flat), np.sqrt(flat), np.zeros_like(flat), 1.0
    for _ in range(9):  # sufficient for a/b up to 1e13; six are exact up to 1e3
        mean, other, difference = 0.5 * (mean + other), np.sqrt(mean * other), 0.5 * (mean - other)
        total += weight * difference * difference
        weight *= 2.0
    half = 0.5 * (1.0 - flat)
    big_k = math.pi / (2.0 * mean)
    return big_k, big_k * (half - total) / flat, big_k * (half + total)


def hertz_shape(ratio):
    """Return the factors of larger and smaller semi-axis and of the stiffness in the module's formulas, exactly.

    ``ratio`` is the larger over the smaller relative curvature (array_like, 1 to 1e20). The larger semi-axis is in the
    direction of the smaller curvature. Johnson, Contact Mechanics (1985), Eqs. (4.28)-(4.32), with Abramowitz and
    Stegun (1964), 17.6."""
    ratio = np.asarray(ratio, float)
    low, high = np.zeros_like(ratio), np.full_like(ratio, 30.0)
    for _ in range(60):  # halves the range of ln(a/b)
        middle = 0.5 * (low + high)
        _, along, across = _elliptic(np.exp(-2.0 * middle))
        less = along < ratio * across
        low, high = np.where(less, middle, low), np.where(less, high, middle)
    flat = np.exp(-2.0 * low)
    big_k, along, _ = _elliptic(flat)
    # With c^3 = 3 F / (4 E* (A + B)): a^3 = (2 E / (pi flat)) c^3, and delta = (p0 / E*) b K, p0 = 3 F / (2 pi a b).
    a = np.cbrt(2.0 * (along + big_k) / math.pi)
    b = a * np.sqrt(flat)
    r = 2.0 * big_k / (math.pi * a)
    return a / np.sqrt(r), b / np.sqrt(r), r**-1.5


@lru_cache(maxsize=1)
def hertz_table():
    """Return the `HertzTable` of the shape functions: cubic Hermite nodes with derivatives of the interpolating
    spline."""
    log_ratio, step = np.linspace(0.0, LOG_RATIO_MAX, _NODES // 2 + 1, retstep=True)
    p_large, p_small, k = hertz_shape(np.exp(log_ratio))
    p, k = np.concatenate([p_small[:0:-1], p_large]), np.concatenate([k[:0:-1], k])
    values = np.column_stack([p, p[::-1], k, np.log(p / p[::-1])])
    return HertzTable(float(step), np.concatenate([values, spline_slopes(step, values) * step], axis=1))


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def hertz_shape_at(table, A, B):
    """Return the three factors of `hertz_ellipse`, and ln(a/b), for relative curvatures A and B, 1/m."""
    total = A + B
    position = (math.log(B / A) + LOG_RATIO_MAX) * (1.0 / table.step)
    last = table.values.shape[0] - 1
    position = min(position, last - 1e-9) if position > 0.0 else 0.0  # a NaN must not become an index
    i = int(position)
    low, high = table.values[i], table.values[i + 1]
    # Hermite's cubics: weights of the values and of the slopes at the two nodes
    t = position - i
    s = 1.0 - t
    w, d0, d1 = t * t * (3.0 - 2.0 * t), t * s * s, -t * t * s
    p = low[0] + w * (high[0] - low[0]) + d0 * low[4] + d1 * high[4]
    q = low[1] + w * (high[1] - low[1]) + d0 * low[5] + d1 * high[5]
    k = low[2] + w * (high[2] - low[2]) + d0 * low[6] + d1 * high[6]
    log_axis_ratio = low[3] + w * (high[3] - low[3]) + d0 * low[7] + d1 * high[7]
    root = 1.0 / math.sqrt(total)
    return 4.0 / 3.0 * k * root, p * root, q * root, log_axis_ratio


@jit(allocates=False, fastmath=FUSED)
def hertz_ellipse(table, A, B):
    """Return stiffness and semi-axis factors, all in sqrt(m), for relative curvatures A (rolling), B (lateral), 1/m.

    N = E* stiffness delta^1.5, a = a_factor sqrt(delta), b = b_factor sqrt(delta)."""
    return hertz_shape_at(table, A, B)[:3]


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def damping_factor(approach_speed, c_e, v0):
    """Damping factor c_d of Eq. (7) at an approach speed (m/s).

    It is c_e (0 to 1; 1: no damping) in separation, 1 in approach, and a cubic for |speed| < v0 (m/s). It is C1 and
    never negative, so that there is no tensile normal force. At rest it is (1 + c_e)/2: the static penetration is
    larger than Hertz's by the factor (2/(1 + c_e))^(2/3). The restitution of a fast impact is sqrt(c_e). Ambrosio and
    Pombo, Multibody System Dynamics 42 (2018) 317-345, as used by Marques et al. (2020)."""
    if approach_speed >= v0:
        return 1.0
    if approach_speed <= -v0:
        return c_e
    r = 0.5 * (approach_speed + v0) / v0
    return c_e + (1.0 - c_e) * r * r * (3.0 - 2.0 * r)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def inverse_cube_root(x):
    """Return x^(-1/3) for 0 < x <= 1, with an error at the level of rounding.

    From x = 0.2 on, a parabola with an error of 3 %, then two steps of fourth order."""
    if x == 1.0:
        return 1.0
    if x < 0.2:
        return x ** (-1.0 / 3.0)
    y = 2.0125 + x * (-1.9459 + x * 0.9464)
    for _ in range(2):
        rest = 1.0 - x * y * y * y
        y += y * rest * (1.0 / 3.0 + rest * (2.0 / 9.0 + rest * (14.0 / 81.0)))
    return y


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def loaded_ellipse(table, modulus, c_e, v0, penetration, A, B, approach_speed):
    """Return the normal force (N) by Eq. (7), the semi-axes a, b (m) of its ellipse, a/b and ln(a/b).

    ``A`` and ``B`` are relative curvatures (1/m), ``modulus`` is E* (Pa), ``penetration`` is in m, ``approach_speed``
    in m/s; for ``c_e`` and ``v0`` see `damping_factor`."""
    stiffness, a, b, log_axis_ratio = hertz_shape_at(table, A, B)
    factor = damping_factor(approach_speed, c_e, v0)
    root = math.sqrt(penetration)
    force = factor * modulus * stiffness * penetration * root
    # The ellipse is that of the damped force: its elastic approach is c_d^(2/3) delta.
    inverse = inverse_cube_root(factor)
    root *= factor * inverse * inverse
    return force, a * root, b * root, a / b, log_axis_ratio
