"""Accurate ends of a contact along x, from pressures that are constant in elements.

The end of a row of elements has an error of up to half an element, and creep forces depend on the position of the
leading edge. The gap of a wheel on a rail is a parabola along x, so that the pressure of a row is close to a
semi-ellipse. A fit to the row's inner elements gives its ends with errors of a few hundredths of an element.
"""

import math

from wrcore.kernels.jit import jit

FARTHEST = 1.5
"""Maximum distance, in elements, of a fitted end or middle from that of the row; otherwise the row is not changed."""

_REPLACED = 2
"""Number of elements at either end of a row whose pressure is replaced."""


@jit(allocates=False)
def _semi_ellipse(pressure, j, first, last, x, dx):
    """Fit p^2 = q (c - (x - m)^2) to a row's inner elements, weighted with p^2; return q, c, m, or q = 0 on failure."""
    m0 = m1 = m2 = m3 = m4 = r0 = r1 = r2 = 0.0
    middle, half = 0.5 * (x[first] + x[last]), 0.5 * (last - first + 1) * dx
    for i in range(first + 1, last):
        t, square = (x[i] - middle) / half, pressure[i, j] ** 2
        m0 += square
        m1 += square * t
        m2 += square * t * t
        m3 += square * t**3
        m4 += square * t**4
        r0 += square * square
        r1 += square * square * t
        r2 += square * square * t * t
    det = m0 * (m2 * m4 - m3 * m3) - m1 * (m1 * m4 - m3 * m2) + m2 * (m1 * m3 - m2 * m2)
    if not det > 1e-9 * m0 * m0 * m0:
        return 0.0, 0.0, 0.0
    a = r0 * (m2 * m4 - m3 * m3) - m1 * (r1 * m4 - m3 * r2) + m2 * (r1 * m3 - m2 * r2)
    b = m0 * (r1 * m4 - r2 * m3) - r0 * (m1 * m4 - m3 * m2) + m2 * (m1 * r2 - r1 * m2)
    c = m0 * (m2 * r2 - m3 * r1) - m1 * (m1 * r2 - m2 * r1) + r0 * (m1 * m3 - m2 * m2)
    a, b, c = a / det, b / det, c / det
    if not c < 0.0:
        return 0.0, 0.0, 0.0
    centre = -0.5 * b / c
    return -c / half**2, (a / -c + centre * centre) * half**2, middle + centre * half


@jit(allocates=False)
def _area_below(c, t):
    """Integral of sqrt(c - t^2) from 0 to t, clipped to the half circle."""
    root = math.sqrt(c)
    t = min(max(t, -root), root)
    return 0.5 * (t * math.sqrt(max(c - t * t, 0.0)) + c * math.asin(t / root))


@jit
def with_sharp_edges(pressure, x, dx):
    """Return the pressures (nx, ns) of `solve_pressure` with the outermost elements from a semi-ellipse in each row.

    A row has a fixed s and elements of length ``dx`` about ``x``, m. Its load does not change."""
    nx, ns = pressure.shape
    out = pressure.copy()
    for j in range(ns):
        first, last, load = nx, -1, 0.0
        for i in range(nx):
            if pressure[i, j] > 0.0:
                first, last, load = min(first, i), i, load + pressure[i, j]
        if last - first < 4:
            continue
        q, c, middle = _semi_ellipse(pressure, j, first, last, x, dx)
        half = 0.5 * (last - first + 1) * dx
        off = abs(middle - 0.5 * (x[first] + x[last]))
        if not (q > 0.0 and c > 0.0 and max(abs(math.sqrt(c) - half), off) < FARTHEST * dx):
            continue
        total = 0.0
        for i in range(nx):
            if i < first + _REPLACED or i > last - _REPLACED:
                t = x[i] - middle
                out[i, j] = math.sqrt(q) / dx * (_area_below(c, t + 0.5 * dx) - _area_below(c, t - 0.5 * dx))
                if out[i, j] < 1e-6 * load:
                    out[i, j] = 0.0
            total += out[i, j]
        for i in range(nx):
            out[i, j] *= load / total
    return out
