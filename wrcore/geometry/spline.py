"""Cubic splines through equally spaced values, for small tables that every run wants.

The same as scipy's ``CubicSpline``, whose import takes a third of the time in which a short run starts and ends.
"""

import numpy as np


def spline_slopes(step, values):
    """Slopes (n, m) at n >= 4 nodes, ``step`` apart, of the cubic splines through ``values`` (n, m) that are ``not a
    knot`` at their last nodes but one."""
    # m[i-1] + 4 m[i] + m[i+1] = right[i]; the third derivative is the same on both sides of the second node
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
    """Coefficients (n - 1, 4, m) of those splines, in ascending powers of the distance from a cell's first node."""
    slopes, rise = spline_slopes(step, values), np.diff(values, axis=0)
    first, last = step * slopes[:-1], step * slopes[1:]
    powers = [values[:-1], first, 3.0 * rise - 2.0 * first - last, first + last - 2.0 * rise]
    return np.stack([part / step**k for k, part in enumerate(powers)], axis=1)
