"""Cubic splines for tables and tracks.

They are equal to scipy's ``CubicSpline``, whose import takes a fifth of the time of a short run.
"""

import numpy as np

from wrcore.kernels.jit import jit


def spline_slopes(step, values):
    """Return the slopes (n, m) at n >= 4 nodes, ``step`` apart, of the cubic splines through ``values`` (n, m).

    The end condition is ``not a knot`` at the second and the last but one node.
    """
    # m[i-1] + 4 m[i] + m[i+1] = right[i]; the third derivative is equal on both sides of the second node
    slopes = np.empty(values.shape)
    slopes[1:-1] = 3.0 * (values[2:] - values[:-2]) / step
    slopes[0] = 0.5 * slopes[1] + (2.0 * values[1] - values[0] - values[2]) / step
    slopes[-1] = 0.5 * slopes[-2] - (2.0 * values[-2] - values[-1] - values[-3]) / step
    above = np.full(len(values), 2.0)
    for i in range(1, len(values) - 1):
        above[i] = 1.0 / (4.0 - above[i - 1])
        slopes[i] = (slopes[i] - slopes[i - 1]) * above[i]
    slopes[-1] = (slopes[-1] - 2.0 * slopes[-2]) / (1.0 - 2.0 * above[-2])
    for i in range(len(values) - 2, -1, -1):
        slopes[i] -= above[i] * slopes[i + 1]
    return slopes


def spline_cubics(step, values):
    """Return the coefficients (n - 1, 4, m) of the splines of `spline_slopes`.

    They are in ascending powers of the distance from a cell's first node.
    """
    slopes, rise = spline_slopes(step, values), np.diff(values, axis=0)
    first, last = step * slopes[:-1], step * slopes[1:]
    powers = [values[:-1], first, 3.0 * rise - 2.0 * first - last, first + last - 2.0 * rise]
    return np.stack([part / step**k for k, part in enumerate(powers)], axis=1)


def clamped_cubics(x, values):
    """Return the coefficients (n - 1, 4, m) of the cubic splines through ``values`` (n, m) with zero end slopes.

    The nodes ``x`` (n,), n >= 2, increase. The coefficients are in ascending powers of the distance from a cell's first
    node and bitwise identical to those of ``CubicSpline(x, values, bc_type="clamped")``.
    """
    steps = np.diff(x)
    wide = steps[:, None]
    rises = np.diff(values, axis=0) / wide
    diagonal, slopes = np.ones(len(x)), np.zeros(values.shape)
    below, above = np.zeros(len(steps)), np.zeros(len(steps))
    diagonal[1:-1], below[:-1], above[1:] = 2.0 * (steps[:-1] + steps[1:]), steps[1:], steps[:-1]
    slopes[1:-1] = 3.0 * (wide[1:] * rises[:-1] + wide[:-1] * rises[1:])
    _solve_tridiagonal(below, diagonal, above, slopes)
    bend = (slopes[:-1] + slopes[1:] - 2.0 * rises) / wide
    powers = [values[:-1], slopes[:-1], (rises - slopes[:-1]) / wide - bend, bend / wide]
    return np.stack(powers, axis=1)


@jit
def _solve_tridiagonal(below, diagonal, above, right):
    """Solve a diagonally dominant tridiagonal system for all columns of ``right`` (n, m), in place.

    ``right`` becomes the solution; ``diagonal`` (n,) is overwritten.
    """
    last = len(diagonal) - 1
    for i in range(last):
        factor = below[i] / diagonal[i]
        diagonal[i + 1] -= factor * above[i]
        for j in range(right.shape[1]):
            right[i + 1, j] -= factor * right[i, j]
    for j in range(right.shape[1]):
        right[last, j] /= diagonal[last]
        for i in range(last - 1, -1, -1):
            right[i, j] = (right[i, j] - above[i] * right[i + 1, j]) / diagonal[i]
