"""Displacement of the half-space under a strip with semi-elliptic pressure along x: one table and its far field.

A strip of width w, half length a and middle X carries p = pi E* Q sqrt(a^2 - (x - X)^2), uniform across. Two equal
bodies then approach each other by (Boussinesq; Johnson, Contact Mechanics, Eq. (3.19))

    u = Q a^2 (U(xi, eta+) - U(xi, eta-)),   U(xi, eta) = int_-1^1 sqrt(1 - t^2) asinh(eta/|xi - t|) dt,

with xi = (x - X)/a and eta+- = (s - s_j +- w/2)/a. U is even in xi and odd in eta. U/eta is tabulated as a bicubic
B-spline over ln eta and tau, a function of xi with a high resolution around the strip's end, xi = 1.
"""

import math
from functools import lru_cache

import numpy as np
from llvmlite import ir
from numba.core import types
from numba.extending import intrinsic

from wrcore.kernels.jit import FUSED, jit

_BLUR = 0.01
_TAU_START, _TAU_STEP, _TAU_NODES = -1.01, 0.025, 120
_LOG_START, _LOG_STEP, _LOG_NODES = -7.6, 0.125, 92
_LOG_END = _LOG_START + _LOG_STEP * (_LOG_NODES - 5)
_FAR = 16.0
"""Square of the distance, over the half length, beyond which the far-field expansion is used."""

_HALF_PI = 0.5 * math.pi


def exact_influence(xi, eta):
    """Return U(xi, eta > 0) by Gauss-Legendre quadrature with nodes graded towards the singular points."""
    xi, eta = np.broadcast_arrays(np.abs(np.asarray(xi, float))[..., None], np.asarray(eta, float)[..., None])
    node, weight = np.polynomial.legendre.leggauss(160)
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
    """Return the B-spline coefficients of U/eta over (tau, ln eta), for kernels."""
    from scipy.ndimage import spline_filter  # imported here, so that only scenes with exact contact wait for it

    extra = 14  # nodes beyond either end, so that the spline's boundary condition has no effect in the table
    tau = _TAU_START + _TAU_STEP * (np.arange(_TAU_NODES + 2 * extra) - 1 - extra)
    square = 0.5 * (tau**4 + np.sqrt(tau**8 + 4.0 * tau**4 * _BLUR**2))
    xi = 1.0 + np.sign(tau) * np.sqrt(square)
    eta = np.exp(_LOG_START + _LOG_STEP * (np.arange(_LOG_NODES + 2 * extra) - 1 - extra))
    values = np.array([exact_influence(one, eta) / eta for one in xi])
    coefficients = spline_filter(values, order=3, mode="mirror")
    return np.ascontiguousarray(coefficients[extra:-extra, extra:-extra])


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def spline_weights(t):
    """Values and derivatives of the four cubic B-splines at the position ``t`` in a cell, 0 to 1."""
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
def cell_along(xi):
    """Return the table's cell for |xi|, the position in it (0 to 1), and (d tau/d xi) / (table step)."""
    r = xi - 1.0
    square = r * r + _BLUR * _BLUR
    q = math.sqrt(square)
    inverse = 1.0 / math.sqrt(q)
    position = (r * inverse - _TAU_START) * (1.0 / _TAU_STEP)
    cell = min(max(int(position), 0), _TAU_NODES - 4)
    rate = (0.5 * r * r + _BLUR * _BLUR) * inverse / square * (1.0 / _TAU_STEP)
    return cell, position - cell, rate


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def cell_across(log_eta):
    """Return the table's cell for ln eta, the position in it (0 to 1), and the excess of ln eta over the table's
    end."""
    inside = min(max(log_eta, _LOG_START), _LOG_END)
    position = (inside - _LOG_START) * (1.0 / _LOG_STEP)
    cell = min(int(position), _LOG_NODES - 4)
    return cell, position - cell, max(log_eta - _LOG_END, 0.0)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _edge(eta, log_eta, sign):
    """Interpolation data for one edge of a strip: a column of the table and weights of its values.

    Returns the column, weights for sign times U, weights for sign times dU/d(ln eta), and additions to both beyond the
    table's end, where U increases as pi/2 ln eta."""
    cell, part, beyond = cell_across(log_eta)
    v0, v1, v2, v3, d0, d1, d2, d3 = spline_weights(part)
    factor, over, rest = sign * eta, sign * eta, 0.0
    if beyond > 0.0:
        factor, over, rest = factor * math.exp(-beyond), 0.0, sign * _HALF_PI
    slope = over * (1.0 / _LOG_STEP)
    values = factor * v0, factor * v1, factor * v2, factor * v3
    slopes = over * v0 + slope * d0, over * v1 + slope * d1, over * v2 + slope * d2, over * v3 + slope * d3
    return cell, values, slopes, rest * beyond, rest


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def edges_of(low, high, log_low, log_high):
    """Interpolation data (`_edge`) of both edges of a strip at eta = ``low`` and ``high``, for `influence_of`.

    ``log_low`` and ``log_high`` are the logarithms. A negative ``low`` denotes the strip that contains the line of the
    point, -high to high."""
    if low < 0.0:
        return _edge(high, log_high, 0.0), _edge(high, log_high, 2.0)
    return _edge(low, log_low, -1.0), _edge(high, log_high, 1.0)


@intrinsic
def _contract(_, values, start, columns, weights, of_values, of_slopes):
    """Sum over a 4 x 4 block of the table at each of two columns.

    Returns U and dU/d tau summed over both columns, and dU/d(ln eta) of each column."""

    def generate(context, builder, signature, arguments):
        four = ir.VectorType(ir.DoubleType(), 4)
        table = context.make_array(signature.args[0])(context, builder, arguments[0])
        stride = builder.extract_value(table.shape, 1)
        fuse = ("contract",)

        def vector(aggregate, first):
            out = ir.Constant(four, ir.Undefined)
            for k in range(4):
                lane = builder.extract_value(aggregate, first + k)
                out = builder.insert_element(out, lane, ir.Constant(ir.IntType(32), k))
            return out

        def splat(number):
            one = builder.insert_element(ir.Constant(four, ir.Undefined), number, ir.Constant(ir.IntType(32), 0))
            mask = ir.Constant(ir.VectorType(ir.IntType(32), 4), [0] * 4)
            return builder.shuffle_vector(one, ir.Constant(four, ir.Undefined), mask)

        def added(total, one, other):
            product = builder.fmul(one, other, flags=fuse)
            return product if total is None else builder.fadd(total, product, flags=fuse)

        def paired(one, other, first, second):
            mask = ir.VectorType(ir.IntType(32), 4)
            return builder.fadd(*(builder.shuffle_vector(one, other, ir.Constant(mask, m)) for m in (first, second)))

        rows = [[splat(builder.extract_value(arguments[3], 4 * part + i)) for i in range(4)] for part in range(2)]
        value = along = None
        over = []
        for side in range(2):
            here = there = None
            column = builder.extract_value(arguments[2], side)
            for i in range(4):
                row = builder.add(arguments[1], ir.Constant(arguments[1].type, i))
                at = builder.gep(table.data, [builder.add(builder.mul(row, stride), column)])
                block = builder.load(builder.bitcast(at, four.as_pointer()), align=8)
                here, there = added(here, rows[0][i], block), added(there, rows[1][i], block)
            weight = vector(arguments[4], 4 * side)
            value, along = added(value, here, weight), added(along, there, weight)
            over.append(builder.fmul(here, vector(arguments[5], 4 * side)))
        # sums over the lanes of all four at once
        sums = [paired(*pair, [0, 4, 2, 6], [1, 5, 3, 7]) for pair in ((value, along), over)]
        total = paired(*sums, [0, 1, 4, 5], [2, 3, 6, 7])
        results = [builder.extract_element(total, ir.Constant(ir.IntType(32), k)) for k in range(4)]
        return context.make_tuple(builder, signature.return_type, results)

    index = types.int64
    eight = types.UniTuple(types.float64, 8)
    return types.UniTuple(types.float64, 4)(values, index, types.UniTuple(index, 2), eight, eight, eight), generate


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _expanded(xi, low, high):
    """Difference of U between eta = high and low far from the strip, and its derivatives, as in `influence_of`."""
    square = xi * xi
    near, far = math.sqrt(square + low * low), math.sqrt(square + high * high)
    if low < 0.0:
        # the strip contains the line of the point: eta = +-high
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
def influence_of(values, xi, low, high, edges):
    """Difference of U between eta = high and low >= 0, or 2 U(high) for low < 0, and its derivatives.

    Derivatives are with respect to xi, ln eta (of both edges together), and a common displacement of both edges in eta.
    ``edges``: see `edges_of`."""
    if xi * xi + max(low, 0.0) ** 2 > _FAR:
        return _expanded(xi, low, high)
    cell, part, rate = cell_along(xi)
    near, far = edges
    columns, weights = (near[0], far[0]), spline_weights(part)
    value, along, over_low, over_high = _contract(values, cell, columns, weights, near[1] + far[1], near[2] + far[2])
    over_low, over_high = over_low + near[4], over_high + far[4]
    shear = over_high / high + over_low / max(low, 1e-9) if low >= 0.0 else 0.0
    return value + near[3] + far[3], along * rate, over_low + over_high, shear
