"""Kalker's linear theory of rolling contact: the coefficients C11, C22, C23, C33 and the law.

    fx = -C11 xi',   fy = -C22 eta' - C23 phi',   mz = +C23 eta' - C33 phi'

in the nondimensional form of `wrcore.contact.rolling.ellipse.RollingContact`, i.e. Fx = -G a b C11 xi and so on. The
coefficients were computed by wrcore's half-space solver with full adhesion, extrapolated in the panel size, on a grid
of a/b and nu. They are in ``kalker_coefficients.csv`` in this folder, written by ``tests/creep/kalker_grid.py``.

References
----------
Kalker, On the rolling contact of two elastic bodies in the presence of dry friction (thesis, Delft 1967).
Kalker, Three-Dimensional Elastic Bodies in Rolling Contact (1990), table E.3.
"""

from importlib.resources import files
from typing import NamedTuple

import numpy as np

from wrcore.geometry.spline import spline_cubics
from wrcore.kernels.jit import FUSED, jit

COEFFICIENTS_FILE = "kalker_coefficients.csv"
GRID_A_OVER_B = 2.0 ** np.arange(-5, 5.25, 0.5)
GRID_NU = np.array([0.0, 0.1, 0.2, 0.3, 0.4, 0.5])


class KalkerData(NamedTuple):
    """Coefficients for one nu as cubic polynomials on equal cells of ln(a/b); a kernel argument."""

    nu: float
    start: float
    spacing: float
    """Poisson's ratio; first node and spacing of ln(a/b)."""
    cubic: np.ndarray
    """(cells, 4, 4): per cell and power 0..3 of the distance from its lower node: C11, C22, C23, C33."""


def kalker_data(nu):
    """Return the `KalkerData` for one Poisson's ratio, 0 to 0.5, by polynomial interpolation of the stored values."""
    if not 0 <= nu <= 0.5:
        raise ValueError(f"Poisson's ratio: expected 0 to 0.5, got {nu}")
    text = files("wrcore.creep").joinpath(COEFFICIENTS_FILE).read_text(encoding="utf-8")
    rows = np.loadtxt(text.splitlines(), delimiter=",", skiprows=2)
    values = rows[:, 2:].reshape(len(GRID_NU), len(GRID_A_OVER_B), 4)
    log_g = np.log(GRID_A_OVER_B)
    step = float(log_g[1] - log_g[0])
    others = [[other for other in GRID_NU if other != one] for one in GRID_NU]
    weights = [np.prod([(nu - o) / (one - o) for o in other]) for one, other in zip(GRID_NU, others, strict=True)]
    cubic = spline_cubics(step, np.tensordot(weights, values, axes=1))
    return KalkerData(float(nu), float(log_g[0]), step, cubic)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def coefficients_at(log_g, data):
    """Return C11, C22, C23, C33 at ln(a/b); outside the stored range, the values at its end."""
    cells = data.cubic.shape[0]
    position = (log_g - data.start) / data.spacing
    position = min(position, float(cells)) if position > 0 else 0.0
    cell = min(int(position), cells - 1)
    d = (position - cell) * data.spacing
    p = data.cubic[cell]
    c11 = p[0, 0] + d * (p[1, 0] + d * (p[2, 0] + d * p[3, 0]))
    c22 = p[0, 1] + d * (p[1, 1] + d * (p[2, 1] + d * p[3, 1]))
    c23 = p[0, 2] + d * (p[1, 2] + d * (p[2, 2] + d * p[3, 2]))
    c33 = p[0, 3] + d * (p[1, 3] + d * (p[2, 3] + d * p[3, 3]))
    return c11, c22, c23, c33


@jit(allocates=False, forceinline=True)
def kalker_coefficients(g, data):
    """Return C11, C22, C23, C33 at a/b = g; outside 1/32..32, the values at the end of the range."""
    return coefficients_at(np.log(g), data)
