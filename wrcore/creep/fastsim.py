"""FASTSIM: Kalker's simplified theory, in which the elastic displacement of a point depends only on its traction.

References
----------
Kalker, A fast algorithm for the simplified theory of rolling contact, Vehicle System Dynamics 11 (1982) 1-13.
"""

from typing import NamedTuple

import numpy as np

from wrcore.creep.kalker import kalker_coefficients
from wrcore.kernels.jit import jit


class FastsimData(NamedTuple):
    """Settings of FASTSIM; a kernel argument."""

    n_x: int
    n_y: int
    """Number of steps along a strip, and number of strips."""
    elliptic: int
    """0: bound of the traction parabolic in x and y (Kalker's choice); 1: Hertzian."""


@jit(allocates=False)
def fastsim(settings, kalker, g, psi, xi, eta, phi):
    """Creep force fx, fy, mz, over mu N and mu N c, by FASTSIM with three flexibilities; arguments as for `laws`.

    Slip s = w - L dtau/dx with L1 = 8 a/(3 G C11), L2 = 8 a/(3 G C22), L3 = pi a sqrt(a/b)/(4 G C23) for longitudinal,
    lateral and spin creepage. The traction is 0 at the leading edge, follows from s = 0, and is reduced to its bound
    where it exceeds it. An SDEC patch has the flexibilities of its mean ellipse. The bound is scaled to a sum of mu N
    over the cells (the midpoint rule gives about 1e-4 more), so that no force is larger."""
    c11, c22, c23, _ = kalker_coefficients(g, kalker)
    a, b = np.sqrt(g), 1 / np.sqrt(g)
    rate_x, rate_y = xi * 3 * c11 / (8 * a), eta * 3 * c22 / (8 * a)
    rate_spin = phi * 4 * c23 / (np.pi * a * a)
    fx = fy = mz = borne = 0.0
    width = 2 * b / settings.n_y
    for strip in range(settings.n_y):
        y = -b + (strip + 0.5) * width
        offset = (y + psi * b) / (b * (1 + psi) if y + psi * b > 0 else b * (1 - psi))
        length = a * np.sqrt(1 - offset * offset)
        step = 2 * length / settings.n_x
        px = py = 0.0
        for k in range(settings.n_x):
            x = length - (k + 0.5) * step
            dx = step if k > 0 else 0.5 * step
            px -= (rate_x - rate_spin * y) * dx
            py -= (rate_y + rate_spin * (x + 0.5 * dx)) * dx
            height = max(length * length - x * x, 0.0) / (a * a)
            bound = 1.5 / np.pi * np.sqrt(height) if settings.elliptic else 2 / np.pi * height
            size = np.sqrt(px * px + py * py)
            if size > bound:
                px, py = px * bound / size, py * bound / size
            fx += px * step * width
            fy += py * step * width
            mz += (x * py - y * px) * step * width
            borne += bound * step * width
    return fx / borne, fy / borne, mz / borne
