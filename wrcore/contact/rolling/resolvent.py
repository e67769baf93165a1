"""Resolvents of patches on strips: from a library of ellipses, or from triangular factors of a band (see `rolling`)."""

import numpy as np

from wrcore.kernels.jit import FAST, FUSED, jit

LONGEST_PANEL = 5.0
"""Length of panels over the width of a strip above which no ellipse of the library is similar enough for
convergence."""

LEAST_ALIKE = 0.6
"""Product of a/b and the distance from an ellipse (see `_shape`) above which no ellipse of the library is similar
enough."""

_ZERO, _ONE = np.float32(0), np.float32(1)


@jit(allocates=False, fastmath=FAST)
def multiply(matrix, x, y, count, first):
    """Fill y = matrix x for ``count`` rows of x and y, in their columns from ``first`` on.

    Four rows of the matrix and two rows of x are processed at a time."""
    size = matrix.shape[0]
    last = size - size % 4
    for i in range(0, last, 4):
        a, b, c, d = matrix[i], matrix[i + 1], matrix[i + 2], matrix[i + 3]
        for k in range(0, count - 1, 2):
            one, two = x[k][first : first + size], x[k + 1][first : first + size]
            p, q, s, t = _ZERO, _ZERO, _ZERO, _ZERO
            e, f, g, h = _ZERO, _ZERO, _ZERO, _ZERO
            for j in range(size):
                v, w = one[j], two[j]
                p += a[j] * v
                q += b[j] * v
                s += c[j] * v
                t += d[j] * v
                e += a[j] * w
                f += b[j] * w
                g += c[j] * w
                h += d[j] * w
            to = first + i
            y[k, to], y[k, to + 1], y[k, to + 2], y[k, to + 3] = p, q, s, t
            y[k + 1, to], y[k + 1, to + 1], y[k + 1, to + 2], y[k + 1, to + 3] = e, f, g, h
        if count % 2:
            one, out = x[count - 1][first : first + size], y[count - 1][first : first + size]
            p, q, s, t = _ZERO, _ZERO, _ZERO, _ZERO
            for j in range(size):
                v = one[j]
                p += a[j] * v
                q += b[j] * v
                s += c[j] * v
                t += d[j] * v
            out[i], out[i + 1], out[i + 2], out[i + 3] = p, q, s, t
    for k in range(count):
        for i in range(last, size):
            y[k, first + i] = _dot(matrix[i], x[k][first : first + size])


@jit(allocates=False, fastmath=FUSED)
def _subtract(row, factor, pivot):
    """Subtract ``factor`` times ``pivot`` from ``row``."""
    for j in range(row.size):
        row[j] -= factor * pivot[j]


@jit(allocates=False, fastmath=FAST)
def _dot(one, two):
    """Scalar product of two vectors."""
    total = _ZERO
    for j in range(one.size):
        total += one[j] * two[j]
    return total


@jit(allocates=False, fastmath=FUSED)
def _eliminate(row, one, two, three, four):
    """Subtract multiples of four pivot rows from a row; its first four numbers become the factors.

    All rows begin at the column of the first pivot."""
    a = row[0] * one[0]
    b = (row[1] - a * one[1]) * two[1]
    c = (row[2] - a * one[2] - b * two[2]) * three[2]
    d = (row[3] - a * one[3] - b * two[3] - c * three[3]) * four[3]
    for j in range(row.size):
        row[j] -= a * one[j] + b * two[j] + c * three[j] + d * four[j]
    row[0], row[1], row[2], row[3] = a, b, c, d


@jit(allocates=False, fastmath=FUSED)
def factorise(matrix, block, reach, factors):
    """Fill the triangular factors of I + B, without pairs of strips farther apart than ``reach``.

    The diagonal contains the inverses of the pivots.

    ``block`` is the number of unknowns of a strip, a multiple of 4. No pivots: the symmetric part of H + A is
    positive definite."""
    size = matrix.shape[0]
    for i in range(size):
        strip = i // block
        first, last = max(strip - reach, 0) * block, min((strip + reach + 1) * block, size)
        row, source = factors[i], matrix[i]
        for j in range(first, last):
            row[j] = source[j]
        row[i] += _ONE
        begin = i - i % 4
        for p in range(first, begin, 4):
            end = min((p // block + reach + 1) * block, size)
            one, two, three, four = factors[p], factors[p + 1], factors[p + 2], factors[p + 3]
            _eliminate(row[p:end], one[p:end], two[p:end], three[p:end], four[p:end])
        for p in range(begin, i):
            row[p] *= factors[p, p]
            _subtract(row[p + 1 : last], row[p], factors[p, p + 1 : last])
        row[i] = _ONE / row[i]


@jit(allocates=False, fastmath=FAST)
def substitute(factors, block, reach, r, y):
    """Fill y = (L U)^-1 r by forward and back substitution."""
    size = r.size
    for i in range(size):
        first = max(i // block - reach, 0) * block
        y[i] = r[i] - _dot(factors[i, first:i], y[first:i])
    for i in range(size - 1, -1, -1):
        last = min((i // block + reach + 1) * block, size)
        y[i] = (y[i] - _dot(factors[i, i + 1 : last], y[i + 1 : last])) * factors[i, i]


@jit(allocates=False, fastmath=FAST)
def _blend(library, log_ratio, out):
    """Fill ``out`` with a resolvent interpolated linearly in ln(a/b) between two of the library.

    This is accurate enough, because the resolvent must only be similar to that of the patch."""
    place = (log_ratio - library.log_min) / library.log_step
    place = min(max(place, 0.0), library.resolvents.shape[0] - 1.000001)
    k = int(place)
    low, high, t = library.resolvents[k], library.resolvents[k + 1], np.float32(place - k)
    for i in range(out.size):
        out[i] = low[i] + t * (high[i] - low[i])


@jit(allocates=False, fastmath=FUSED)
def _shape(first, last, strip):
    """Return a/b of the ellipse with the width and mean square length of some strips, and their distance from it.

    The distance combines the standard deviation of the middles over a and the eccentricity of the load over b. All
    means are weighted with the load."""
    low = strip.centre[first] - 0.5 * strip.width[first]
    b = 0.5 * (strip.centre[last - 1] + 0.5 * strip.width[last - 1] - low)
    load = square = x = xx = s = 0.0
    for j in range(first, last):
        share = strip.share[j] + 1e-9
        load += share
        square += share * strip.half[j] * strip.half[j]
        x += share * strip.middle[j]
        xx += share * strip.middle[j] * strip.middle[j]
        s += share * (strip.line[j] - low - b)
    square *= 1.25 / load
    skew = max(xx / load - (x / load) ** 2, 0.0) / square
    return np.sqrt(square) / b, np.sqrt(skew + (s / (load * b)) ** 2)


@jit(allocates=False, fastmath=FUSED)
def take_from_library(library, count, windows, split, work):
    """Write the resolvents of similar ellipses to ``work.factors``; return False if a window has none."""
    strips, panels = library.level.strips, library.panels
    if count != windows * strips or (windows == 2 and split != strips):
        return False
    size = (2 * panels.n * strips) ** 2
    for window in range(windows):
        ratio, distance = _shape(window * strips, (window + 1) * strips, work.strip)
        if not (ratio * strips < LONGEST_PANEL * panels.n and ratio * distance < LEAST_ALIKE):
            return False
        _blend(library, np.log(ratio), work.factors[window * size : (window + 1) * size])
    return True
