"""Influence of tangential loads between strips in the rolling direction: slip by unit panel forces.

A strip has a given width and reaches from X - a to X + a along x; its n panels have edges X + a cos(k pi/n). Loads are
constant over a panel. Displacements are evaluated on one line per strip (y), at points X + a cos((k - 1/2) pi/n) and
one point ahead of the leading edge. With u = 1/(pi G) int K tau dA (two equal half-spaces),

    Kxx = 1/R - nu y^2/R^3,   Kyy = 1/R - nu x^2/R^3,   Kxy = nu x y/R^3,

the integral along x at lateral distance d is, L = asinh(x/|d|),

    Jxx = L - nu x/R,   Jyy = (1 - nu) L + nu x/R,   Jxy = -nu d/R.

Across the width the strip's own load is integrated in closed form, others by the midpoint rule with its second-order
term, J + w^2/24 d^2J/dd^2 (neighbours: two halves), which costs one logarithm per pair of points. Slip is the
difference of displacements between successive points (Kalker's upwind form of -du/dx). Lengths are over c, forces
over mu N, slip over mu N/(G c^2).

References
----------
Kalker, Three-Dimensional Elastic Bodies in Rolling Contact (1990), chapters 1 and 4.
Love, Phil. Trans. R. Soc. A 228 (1929) 377 (a loaded rectangle on the half-space).
"""

from typing import NamedTuple

import numpy as np
from llvmlite import ir
from numba.core import types
from numba.extending import intrinsic

from wrcore.kernels.jit import FUSED, jit

_STEP_SCALE, _UNIT, _ZERO = np.float32(2), np.float32(1), np.float32(0)
_ROOT_HALF = 0x3F3504F3
"""Binary representation of sqrt(1/2) as float32."""

_SERIES = tuple(np.float32(2 / k) for k in (1, 3, 5, 7))
"""Coefficients of ln((1 + s)/(1 - s)) over odd powers of s; error 1e-8 for mantissas from sqrt(1/2) to sqrt(2)."""

_LN2, _LEAST = np.float32(np.log(2.0)), np.float32(1e-30)


class StripLayout(NamedTuple):
    """Strips of a patch and forces on them, (M,) each; lengths over c."""

    half: np.ndarray
    middle: np.ndarray
    line: np.ndarray
    centre: np.ndarray
    width: np.ndarray
    """Half length and middle along x; lateral position of the load, centre and width across."""
    share: np.ndarray
    density: np.ndarray
    """Fraction of the patch's load; peak pressure times half length."""
    force_x: np.ndarray
    force_s: np.ndarray
    turn: np.ndarray
    """Forces along x and s over mu N, and the moment of the second about the strip's middle over mu N c."""


@intrinsic
def _exponent(_, x):
    """Exponent e of x = m 2^e, with m from sqrt(1/2) to sqrt(2), of a positive normal number."""

    def generate(_, builder, __, arguments):
        return builder.sitofp(_shifted(builder, arguments[0])[1], ir.FloatType())

    return types.float32(types.float32), generate


@intrinsic
def _mantissa(_, x):
    """Mantissa m of x = m 2^e, see `_exponent`."""

    def generate(_, builder, __, arguments):
        bits, exponent = _shifted(builder, arguments[0])
        return builder.bitcast(builder.sub(bits, builder.shl(exponent, ir.IntType(32)(23))), ir.FloatType())

    return types.float32(types.float32), generate


def _shifted(builder, x):
    """Return the binary representation of a number and its exponent e, both as integers."""
    word = ir.IntType(32)
    bits = builder.bitcast(x, word)
    return bits, builder.ashr(builder.sub(bits, word(_ROOT_HALF)), word(23))


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _log(x):
    """Logarithm of a positive normal float32 to its precision, without branches, so that loops are vectorised."""
    m = _mantissa(x)
    s = (m - _UNIT) / (m + _UNIT)
    q = s * s
    return _exponent(x) * _LN2 + s * (_SERIES[0] + q * (_SERIES[1] + q * (_SERIES[2] + q * _SERIES[3])))


@jit(allocates=False, fastmath=FUSED)
def _add_strip(dx, d, width, weight, nu, gxx, gyy, gxy):
    """Add to (gxx, gyy, gxy) the integrals along x up to each dx of a strip at distance d, averaged over its width."""
    scale, square, bend = np.float32(1.0 / abs(d)), np.float32(d * d), np.float32(width * width / 24)
    share, across, bend_here = np.float32(weight), np.float32(weight * nu * d), np.float32(bend / (d * d))
    rest, nu_, three_squares = np.float32(1.0 - nu), np.float32(nu), np.float32(3.0 * d * d)
    three_bends = np.float32(3.0 * bend)
    for i in range(dx.size):
        x = dx[i]
        radius = np.sqrt(x * x + square)
        inverse = _UNIT / radius
        inverse2 = inverse * inverse
        log = _log((abs(x) + radius) * scale)
        t = x * inverse
        bent = bend * t * inverse2
        log = (log if x > _ZERO else -log) + bend_here * t + bent
        t2 = nu_ * (t + bent * (three_squares * inverse2 - _UNIT))
        gxx[i] += share * (log - t2)
        gyy[i] += share * (rest * log + t2)
        gxy[i] -= across * inverse * (_UNIT - three_bends * t * t * inverse2)


@jit(allocates=False, fastmath=FUSED)
def _add_strip_exactly(dx, far, near, nu, gxx, gyy, gxy):
    """Add the integrals of `_add_strip` in closed form, for a strip from ``near`` to ``far`` (> ``near``).

    The strip may contain the line of the points, at 0.

    Ixx = (1-nu) x asinh(y/|x|) + y asinh(x/|y|), Iyy = x asinh(y/|x|) + (1-nu) y asinh(x/|y|), Ixy = -nu R."""
    y_far, y_near, share = np.float32(far), np.float32(near), np.float32(1.0 / (far - near))
    scale_far, scale_near = np.float32(1.0 / abs(far)), np.float32(1.0 / abs(near))
    sign_far, sign_near = np.float32(1.0 if far > 0 else -1.0), np.float32(1.0 if near > 0 else -1.0)
    rest, across = np.float32(1.0 - nu), np.float32(nu) * share
    for i in range(dx.size):
        x = dx[i]
        square = x * x + _LEAST
        size = np.sqrt(square)
        r_far, r_near = np.sqrt(square + y_far * y_far), np.sqrt(square + y_near * y_near)
        inverse = _UNIT / size
        log_far = sign_far * _log((abs(y_far) + r_far) * inverse)
        log_near = sign_near * _log((abs(y_near) + r_near) * inverse)
        in_x = x * (log_far - log_near)
        in_y = y_far * _log((size + r_far) * scale_far) - y_near * _log((size + r_near) * scale_near)
        in_y = in_y if x > _ZERO else -in_y
        gxx[i] += share * (rest * in_x + in_y)
        gyy[i] += share * (in_x + rest * in_y)
        gxy[i] -= across * (r_far - r_near)


@jit(allocates=False, fastmath=FUSED)
def _difference(g, scale, factor, out):
    """Fill ``out`` with the second differences of ``g`` over points and edges, by rows of points.

    ``out`` has the row length of ``g``; its last column is unused."""
    size, factor = scale.size, np.float32(factor)
    after, below, beyond = g[1 : size + 1], g[g.size - size - 1 :], g[g.size - size :]
    for i in range(size):
        out[i] = factor * scale[i] * (after[i] - g[i] + below[i] - beyond[i])


@jit(allocates=False, fastmath=FUSED)
def _copy_scaled(source, factor, out):
    """Fill ``out`` with ``factor`` times ``source``."""
    for i in range(out.size):
        out[i] = factor * source[i]


@jit(allocates=False, fastmath=FUSED)
def second_window(centre, width):
    """Return the index of the first strip after a lateral gap, or the number of strips."""
    for j in range(1, centre.size):
        if centre[j] - centre[j - 1] > 0.500001 * (width[j] + width[j - 1]):
            return j
    return centre.size


@jit(allocates=False, fastmath=FUSED)
def _shift_at_tip(here, inner, ratio):
    """Distance of the load's centroid inwards from the middle of the strip at a tip, over its width.

    The load per width is a parabola through this strip and the next, ``ratio`` times as wide, that is 0 at the tip.
    This is exact for ellipses."""
    bend = 3.0 * (inner - (2.0 + ratio) * here) / (1.0 + ratio) ** 2
    slope = 2.0 * here - bend * (2 / 3)
    return (slope / 3 + bend / 4) / here - 0.5


@jit(allocates=False, fastmath=FUSED)
def _centroid_shift(strip, j, first, last):
    """Distance of the load's centroid from the strip's centre, over its width, from a parabola through the loads per
    width of three strips."""
    if first and last:
        return 0.0
    here = max(strip.density[j], 1e-30)
    if first:
        shift = _shift_at_tip(here, strip.density[j + 1], strip.width[j + 1] / strip.width[j])
    elif last:
        shift = -_shift_at_tip(here, strip.density[j - 1], strip.width[j - 1] / strip.width[j])
    else:
        change = strip.density[j + 1] - strip.density[j - 1]
        shift = change * strip.width[j] / (12.0 * here * (strip.centre[j + 1] - strip.centre[j - 1]))
    return min(max(shift, -0.2), 0.2)


@jit(allocates=False, fastmath=FUSED)
def lay_out(centre, width, half_length, middle, peak, split, strip):
    """Fill ``strip`` with the strips over c, c^2 = sum of half length times width/2, and the positions of their loads.

    Returns c (m) and the load (N)."""
    count = centre.size
    area = load = longest = 0.0
    for j in range(count):
        area += 0.5 * half_length[j] * width[j]
        load += 0.5 * np.pi * peak[j] * half_length[j] * width[j]
        longest = max(longest, half_length[j])
    c = np.sqrt(area)
    for j in range(count):
        strip.half[j] = max(half_length[j], 1e-3 * longest) / c
        strip.middle[j], strip.centre[j], strip.width[j] = middle[j] / c, centre[j] / c, width[j] / c
        strip.share[j] = 0.5 * np.pi * peak[j] * half_length[j] * width[j] / load
        strip.density[j] = peak[j] * half_length[j]
    for j in range(count):
        first, last = j == 0 or j == split, j == count - 1 or j == split - 1
        strip.line[j] = strip.centre[j] + _centroid_shift(strip, j, first, last) * strip.width[j]
    return c, load


@jit(allocates=False, fastmath=FUSED)
def _distances(panels, point_strip, load_strip, strip, dx):
    """Fill ``dx`` with x of all edges of one strip relative to all points of another."""
    n = panels.n
    for m in range(n + 1):
        x = strip.middle[point_strip] + strip.half[point_strip] * panels.points[m]
        for k in range(n + 1):
            dx[m * (n + 1) + k] = strip.middle[load_strip] + strip.half[load_strip] * panels.edges[k] - x


@jit(allocates=False, fastmath=FUSED)
def _corners(panels, i, j, nu, work):
    """Fill ``work.corner`` with the three integrals at all pairs of points of strip i and edges of strip j."""
    strip = work.strip
    dx, gxx, gyy, gxy = work.corner[0], work.corner[1], work.corner[2], work.corner[3]
    _distances(panels, i, j, strip, dx)
    for part in range(dx.size):
        gxx[part] = 0.0
        gyy[part] = 0.0
        gxy[part] = 0.0
    d, width = strip.centre[j] - strip.line[i], strip.width[j]
    if abs(d) < 0.8 * width:
        _add_strip_exactly(dx, d + 0.5 * width, d - 0.5 * width, nu, gxx, gyy, gxy)
    elif abs(d) < 1.6 * width:
        _add_strip(dx, d - 0.25 * width, 0.5 * width, 0.5, nu, gxx, gyy, gxy)
        _add_strip(dx, d + 0.25 * width, 0.5 * width, 0.5, nu, gxx, gyy, gxy)
    else:
        _add_strip(dx, d, width, 1.0, nu, gxx, gyy, gxy)


@jit(allocates=False, fastmath=FUSED)
def _block(panels, i, j, work, matrix):
    """Write the slip of strip i by unit forces on strip j, divided by the step h, into ``matrix``."""
    n = panels.n
    row, column = 2 * n * i, 2 * n * j
    factor = 1.0 / (np.pi * work.strip.half[i] * work.strip.half[j])
    for part in range(3):
        _difference(work.corner[part + 1], panels.scale, factor, work.slip[part])
    for m in range(n):
        first, last = m * (n + 1), m * (n + 1) + n
        inverse = _UNIT / work.step[row + m]
        x, s = matrix[row + m, column : column + 2 * n], matrix[row + n + m, column : column + 2 * n]
        _copy_scaled(work.slip[0, first:last], inverse, x[:n])
        _copy_scaled(work.slip[2, first:last], inverse, x[n:])
        _copy_scaled(work.slip[2, first:last], inverse, s[:n])
        _copy_scaled(work.slip[1, first:last], inverse, s[n:])


@jit(allocates=False, fastmath=FUSED)
def assemble(panels, count, nu, work):
    """Fill ``work.matrix`` with B = H^-1 A of ``count`` strips; h = 2 sqrt(Axx Ayy) from the diagonals."""
    n = panels.n
    size = 2 * n * count
    matrix = work.matrix[: size * size].reshape((size, size))
    for i in range(count):
        row = 2 * n * i
        for m in range(2 * n):
            work.step[row + m] = _UNIT
        _corners(panels, i, i, nu, work)
        _block(panels, i, i, work, matrix)
        for m in range(n):
            xx, yy = matrix[row + m, row + m], matrix[row + n + m, row + n + m]
            step = _STEP_SCALE * np.sqrt(xx * yy)
            work.step[row + m] = step
            work.step[row + n + m] = step
            for k in range(2 * n):
                matrix[row + m, row + k] /= step
                matrix[row + n + m, row + k] /= step
        for j in range(count):
            if j != i:
                _corners(panels, i, j, nu, work)
                _block(panels, i, j, work, matrix)
