"""Smoothing of measured profile points with a stated standard deviation of their noise.

The result is the most probable curve if the change of curvature along the profile is random, with a standard deviation
estimated nearby. So arcs are smoothed over long distances and transitions between them over short distances. The result
depends smoothly on the stated noise, so that a small error of it has a small effect.
"""

import numpy as np

CHANGE, LEAST_CHANGE = 3000.0, 200.0
"""Initial and smallest change of curvature along a profile, 1/m^2. Initial: from 0 to that of a flange root (radius
13 mm) within some 25 mm; smallest: 1/m within 5 mm."""

LENGTH = 5e-4
"""Correlation length of the changes of curvature along the profile, m."""

NEARBY, ROUNDS = 1e-3, 6
"""Distance along the profile, m, to each side over which the change of curvature is averaged, and number of iterations.
"""


def even_out(at, points, noise):
    """Return smoothed ``points`` (n, 2), m, at the lengths ``at`` (n,), m, along the profile.

    ``noise`` (m) is the standard deviation of the points' noise in each direction. A LinAlgError is raised if points
    are too close together for this noise.
    """
    from scipy.linalg import cho_solve_banded, cholesky_banded

    count = at.size - 3
    weights, steps = _third_derivative(at), (at[3:] - at[:-3]) / 3.0
    middles = 0.25 * (at[3:] + at[2:-1] + at[1:-2] + at[:-3])
    begins = np.searchsorted(middles, middles - NEARBY)
    ends = np.searchsorted(middles, middles + NEARBY, side="right")
    total = np.append(0.0, np.cumsum(steps))
    change, even = np.full(count, CHANGE**2), points
    for _ in range(ROUNDS):
        stiffness = noise**2 / LENGTH * steps / (change + LEAST_CHANGE**2)
        bands = np.zeros((4, at.size))
        bands[0] = 1.0
        for k in range(4):
            for j in range(k, 4):
                bands[j - k, k : count + k] += stiffness * weights[k] * weights[j]
        factor = cholesky_banded(bands, lower=True), True
        even = cho_solve_banded(factor, points)
        for _ in range(2):  # iterative refinement: for points close together the first solution is inaccurate
            bent = stiffness[:, None] * _derive(weights, even)
            missing = points - even
            for k in range(4):
                missing[k : count + k] -= weights[k][:, None] * bent
            even = even + cho_solve_banded(factor, missing)
        summed = np.append(0.0, np.cumsum(steps * (_derive(weights, even) ** 2).sum(axis=1)))
        change = (summed[ends] - summed[begins]) / (total[ends] - total[begins])
    return even


def _derive(weights, points):
    """Return the third derivative (n - 3, 2) of points along the profile with the weights of `_third_derivative`."""
    count = weights.shape[1]
    return sum(weights[k][:, None] * points[k : count + k] for k in range(4))


def _third_derivative(at):
    """Return the weights (4, n - 3) of four successive points in the third derivative between them."""
    count = at.size - 3
    parts = [at[k : count + k] for k in range(4)]
    return 6.0 / np.stack([np.prod([parts[k] - parts[j] for j in range(4) if j != k], axis=0) for k in range(4)])
