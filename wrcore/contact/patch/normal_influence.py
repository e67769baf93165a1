"""Displacement of the half-space under a strip with semi-elliptic pressure along x: one table and its far field.

A strip of width w, half length a and middle X carries p = pi E* Q sqrt(a^2 - (x - X)^2), uniform across. Two equal
bodies then approach each other by (Boussinesq; Johnson, Contact Mechanics, Eq. (3.19))

    u = Q a^2 (U(xi, eta+) - U(xi, eta-)),   U(xi, eta) = int_-1^1 sqrt(1 - t^2) asinh(eta/|xi - t|) dt,

with xi = (x - X)/a and eta+- = (s - s_j +- w/2)/a. U is even in xi and odd in eta. U/eta is tabulated as a bicubic
B-spline over ln eta and tau, which is xi stretched around the strip's end, xi = 1.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.ndimage import spline_filter

from wrcore.kernels.jit import FUSED, jit

_BLUR = 0.01
_TAU_START, _TAU_STEP, _TAU_NODES = -1.01, 0.025, 120
_LOG_START, _LOG_STEP, _LOG_NODES = -7.6, 0.125, 92
_LOG_END = _LOG_START + _LOG_STEP * (_LOG_NODES - 5)
_FAR = 16.0
"""Square of the distance (over the half length) from which the field's expansion is used."""

_HALF_PI = 0.5 * math.pi


class InfluenceTable(NamedTuple):
    """B-spline coefficients of U/eta (tau, ln eta), for kernels."""

    values: np.ndarray


def exact_influence(xi, eta, points=160):
    """U(xi, eta) by Gauss-Legendre quadrature graded towards the singular points.

    Parameters
    ----------
    xi, eta : array_like
        Broadcast together; eta > 0.
    points : int
        Per side of the singular point.
    """
    xi, eta = np.broadcast_arrays(np.abs(np.asarray(xi, float))[..., None], np.asarray(eta, float)[..., None])
    node, weight = np.polynomial.legendre.leggauss(points)
    v, weight = 0.5 * (node + 1.0), 0.5 * weight
    graded, rate = v**4 * (35.0 - 84.0 * v + 70.0 * v**2 - 20.0 * v**3), 140.0 * (v * (1.0 - v)) ** 3
    pole = np.minimum(xi, 1.0)
    total = 0.0
    for end in (-1.0, 1.0):
        span = end - pole  # t = pole + span graded
        away = np.abs(xi - pole - span * graded)
        root = np.sqrt(np.maximum((1.0 - pole - span * graded) * (1.0 + pole + span * graded), 0.0))
        away = np.maximum(away, 1e-300)
        total = total + np.sum(weight * rate * np.abs(span) * root * np.arcsinh(eta / away), axis=-1)
    return total


@lru_cache(maxsize=1)
def influence_table():
    """Tabulate U/eta.

    Returns
    -------
    InfluenceTable
    """
    extra = 14  # nodes beyond either end, so that what the spline assumes there does not matter
    tau = _TAU_START + _TAU_STEP * (np.arange(_TAU_NODES + 2 * extra) - 1 - extra)
    square = 0.5 * (tau**4 + np.sqrt(tau**8 + 4.0 * tau**4 * _BLUR**2))
    xi = 1.0 + np.sign(tau) * np.sqrt(square)
    eta = np.exp(_LOG_START + _LOG_STEP * (np.arange(_LOG_NODES + 2 * extra) - 1 - extra))
    values = np.array([exact_influence(one, eta) / eta for one in xi])
    coefficients = spline_filter(values, order=3, mode="mirror")
    return InfluenceTable(np.ascontiguousarray(coefficients[extra:-extra, extra:-extra]))


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def spline_weights(t):
    """Values and slopes of the four cubic B-splines at the part t of a cell."""
    s, half = 1.0 - t, 0.5
    t2, s2 = t * t, s * s
    sixth = 1.0 / 6.0
    w0, w3 = s2 * s * sixth, t2 * t * sixth
    w1 = 2.0 / 3.0 - half * t2 * (2.0 - t)
    w2 = 2.0 / 3.0 - half * s2 * (2.0 - s)
    d0, d3 = -half * s2, half * t2
    d1, d2 = t * (1.5 * t - 2.0), -s * (1.5 * s - 2.0)
    return w0, w1, w2, w3, d0, d1, d2, d3


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def place_along(xi):
    """Cell, part of it, and d tau/d xi / step of the table for |xi|."""
    r = xi - 1.0
    square = r * r + _BLUR * _BLUR
    q = math.sqrt(square)
    inverse = 1.0 / math.sqrt(q)
    position = (r * inverse - _TAU_START) * (1.0 / _TAU_STEP)
    cell = min(max(int(position), 0), _TAU_NODES - 4)
    rate = (0.5 * r * r + _BLUR * _BLUR) * inverse / square * (1.0 / _TAU_STEP)
    return cell, position - cell, rate


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def place_across(log_eta):
    """Cell, part of it, and ln eta beyond the table's end."""
    inside = min(max(log_eta, _LOG_START), _LOG_END)
    position = (inside - _LOG_START) * (1.0 / _LOG_STEP)
    cell = min(int(position), _LOG_NODES - 4)
    return cell, position - cell, max(log_eta - _LOG_END, 0.0)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def across(log_eta):
    """Column, B-spline weights, and ln eta beyond the table's end."""
    cell, part, beyond = place_across(log_eta)
    return cell, spline_weights(part), beyond


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _tabulated(values, cell, weights, rate, eta, column):
    """U, its slope over xi, and eta times its slope over eta."""
    start, (v0, v1, v2, v3, d0, d1, d2, d3), beyond = column
    value = along = over = 0.0
    for i in range(4):
        row, at = np.uint64(cell + i), np.uint64(start)
        t0, t1, t2, t3 = values[row, at], values[row, at + 1], values[row, at + 2], values[row, at + 3]
        g = v0 * t0 + v1 * t1 + v2 * t2 + v3 * t3
        value += weights[i] * g
        along += weights[4 + i] * g
        over += weights[i] * (d0 * t0 + d1 * t1 + d2 * t2 + d3 * t3)
    if beyond > 0.0:
        eta *= math.exp(-beyond)
        return eta * value + _HALF_PI * beyond, eta * along * rate, _HALF_PI
    return eta * value, eta * along * rate, eta * (value + over * (1.0 / _LOG_STEP))


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _expanded(xi, low, high):
    """Difference of U between eta = high and low (and its slopes, as `_tabulated`) far from the strip."""
    square = xi * xi
    near, far = math.sqrt(square + low * low), math.sqrt(square + high * high)
    if low < 0.0:
        # the strip's own line: eta = +-high
        log = 2.0 * math.log((high + far) / xi)
        slope, over, shear = -2.0 * high / (xi * far), 2.0 * high / far, 0.0
    else:
        log = math.log((high + far) / (low + near))
        slope = xi / (far * (high + far)) - xi / (near * (low + near))
        over, shear = high / far - low / near, 1.0 / far - 1.0 / near
    eta, span = 0.5 * (low + high), high - low
    y = eta * eta
    r2 = square + y
    r4 = r2 * r2
    root = 1.0 / math.sqrt(r2)
    second = (2.0 * square - y) * root / r4
    fourth = (24.0 * square * square - 72.0 * square * y + 9.0 * y * y) * root / (r4 * r4)
    value = _HALF_PI * (log + span * (0.125 * second + fourth / 192.0))
    return value, _HALF_PI * slope, _HALF_PI * over, _HALF_PI * shear


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def influence_of(values, xi, low, high, across_low, across_high):
    """Difference of U between eta = high and low >= 0, or twice U(high) where low < 0.

    Returns
    -------
    value, along, over, shear : float
        U, its slope over xi, over ln eta, and over eta (the difference of the two slopes).
    """
    if xi * xi + max(low, 0.0) ** 2 > _FAR:
        return _expanded(xi, low, high)
    cell, part, rate = place_along(xi)
    weights = spline_weights(part)
    value, along, over = _tabulated(values, cell, weights, rate, high, across_high)
    if low < 0.0:
        return 2.0 * value, 2.0 * along, 2.0 * over, 0.0
    value_low, along_low, over_low = _tabulated(values, cell, weights, rate, low, across_low)
    return value - value_low, along - along_low, over - over_low, over / high - over_low / max(low, 1e-9)
