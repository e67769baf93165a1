"""Noise of measured points evened out: the curve follows the points as closely as their noise says.

It is the most probable curve where the change of curvature along the profile is random and as large as it is nearby:
arcs are smoothed over long distances, transitions between them over short ones. All steps are smooth in the noise that
is stated, so that a little more or less of it makes little difference.
"""

import numpy as np

CHANGE, LEAST_CHANGE = 3000.0, 200.0
"""Change of curvature along a profile, 1/m^2, where nothing is known: from 0 to that of a flange root (13 mm) within
some 25 mm; and the least that is believed, 1/m within 5 mm."""

LENGTH = 5e-4
"""Length along the profile, m, beyond which changes of curvature are independent of each other."""

NEARBY, ROUNDS = 1e-3, 6
"""How far changes of curvature are compared along the profile, m, to each side, and how often."""


def even_out(at, points, noise):
    """``points`` (n, 2), m, at the lengths ``at`` (n,), m, without their noise, whose standard deviation in each
    direction is ``noise`` (m); LinAlgError where points lie too close together for so much of it."""
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
        for _ in range(2):  # points close together: the first solution has lost digits
            bent = stiffness[:, None] * _derive(weights, even)
            missing = points - even
            for k in range(4):
                missing[k : count + k] -= weights[k][:, None] * bent
            even = even + cho_solve_banded(factor, missing)
        summed = np.append(0.0, np.cumsum(steps * (_derive(weights, even) ** 2).sum(axis=1)))
        change = (summed[ends] - summed[begins]) / (total[ends] - total[begins])
    return even


def _derive(weights, points):
    count = weights.shape[1]
    return sum(weights[k][:, None] * points[k : count + k] for k in range(4))


def _third_derivative(at):
    """Weights (4, n - 3) of four points in a row in the third derivative between them."""
    count = at.size - 3
    parts = [at[k : count + k] for k in range(4)]
    return 6.0 / np.stack([np.prod([parts[k] - parts[j] for j in range(4) if j != k], axis=0) for k in range(4)])
