"""Library of resolvents, ellipses over ln(a/b), for similar patches (see `rolling`); one patch with its fields."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from wrcore.contact.patch.resolvent import SLENDER, factorise, substitute
from wrcore.contact.patch.rolling import AUTO, LEVELS, Level, make_workspace, read_field, read_forces, rolling_force
from wrcore.contact.patch.rolling_influence import Panels, assemble, lay_out, make_panels
from wrcore.errors import InputError
from wrcore.kernels.jit import FUSED, jit

LOG_MIN, LOG_STEP = -2.4, 0.4


class Library(NamedTuple):
    """Resolution, Poisson's ratio, and resolvents of ellipses; a kernel argument, never written to.

    Fields
    ------
    level : Level
    panels : Panels
    nu : float
    log_min, log_step : float
        First value of ln(a/b), and distance of the values.
    resolvents : (K, m m) ndarray of float32
        ``(I + B)^-1`` row by row, m = 2 n strips; unknowns in the order of `rolling.Workspace`.
    """

    level: Level
    panels: Panels
    nu: float
    log_min: float
    log_step: float
    resolvents: np.ndarray


def ellipse_strips(a, b, count):
    """Equal strips on an ellipse under Hertz's pressure of peak 1.

    The half lengths are the root mean squares over a strip's width; with peaks in proportion the load is exact.

    Parameters
    ----------
    a, b : float
        Semi-axes along and across the rolling direction, m.
    count : int

    Returns
    -------
    centre, width, half_length, middle, peak : (count,) ndarray
        As `rolling.rolling_force` takes them.
    """
    edge = np.linspace(-1, 1, count + 1)
    root = np.sqrt(1 - np.diff(edge**3) / (3 * np.diff(edge)))
    return (edge[1:] + edge[:-1]) / 2 * b, np.diff(edge) * b, a * root, np.zeros(count), root


@jit(allocates=False, fastmath=FUSED)
def _invert(block, work, resolvent):
    """(I + B)^-1 of the matrix in the workspace."""
    size = resolvent.shape[0]
    factors = work.factors.reshape((size, size))
    factorise(work.matrix.reshape((size, size)), block, size // block, factors)
    for k in range(size):
        for i in range(size):
            work.r[i] = 0.0
        work.r[k] = 1.0
        substitute(factors, block, size // block, work.r, work.y)
        for i in range(size):
            resolvent[i, k] = work.y[i]


@lru_cache(maxsize=16)
def make_library(level="middle", nu=0.28):
    """Library of a level; built in 10 to 100 ms and kept.

    Parameters
    ----------
    level : str or Level
        A key of `rolling.LEVELS`, or a resolution of one's own.
    nu : float
        Poisson's ratio of both bodies, 0 to 0.5.

    Returns
    -------
    Library

    Raises
    ------
    InputError
        If the number of panels is odd or too small.
    """
    level = LEVELS[level] if isinstance(level, str) else level
    if level.panels < 4 or level.panels % 2 or level.strips < 2:
        raise InputError("rolling contact", "level", f"expected an even number of panels above 2, got {level}")
    panels = make_panels(level.panels)
    work = make_workspace(level.strips, level.panels)
    size = 2 * level.panels * level.strips
    steps = max(1, int(np.ceil((np.log(SLENDER * level.panels / level.strips) - LOG_MIN) / LOG_STEP)))
    resolvents = np.empty((steps + 1, size * size), np.float32)
    for k, resolvent in enumerate(resolvents):
        ratio = np.exp(LOG_MIN + k * LOG_STEP)
        lay_out(*ellipse_strips(np.sqrt(ratio), 1 / np.sqrt(ratio), level.strips), level.strips, work.strip)
        assemble(panels, level.strips, float(nu), work)
        _invert(2 * level.panels, work, resolvent.reshape(size, size))
    return Library(level, panels, float(nu), LOG_MIN, LOG_STEP, resolvents)


class RollingField(NamedTuple):
    """Creep force of a patch and fields over its panels, (strips, panels) from the leading edge backwards.

    Fields
    ------
    Fx, Fs, Mn, residual, method
        As `rolling.rolling_force` returns them; N, N m, on the wheel.
    x, s : ndarray
        Centroid of the panel's normal load, m.
    traction_x, traction_s, pressure : ndarray
        Means over the panel, Pa; tractions on the wheel.
    slip_x, slip_s : ndarray
        Slip of the wheel relative to the rail over V.
    slides : ndarray of bool
    power : ndarray
        Dissipated power over area and V, Pa.
    force : ndarray, shape (3, strips)
        Of each strip along x and s, N, and the moment of the latter about the strip's middle, N m.
    """

    Fx: float
    Fs: float
    Mn: float
    residual: float
    method: int
    x: np.ndarray
    s: np.ndarray
    traction_x: np.ndarray
    traction_s: np.ndarray
    pressure: np.ndarray
    slip_x: np.ndarray
    slip_s: np.ndarray
    slides: np.ndarray
    power: np.ndarray
    force: np.ndarray


def solve_patch(strips, slip, shear_modulus, mu, level="middle", nu=0.28, method=AUTO):
    """Creep force and fields of one patch; see `rolling.rolling_force` for the arguments' meaning.

    Parameters
    ----------
    strips : sequence of (M,) array_like
        centre, width, half_length, middle, peak.
    slip : sequence of (M,) array_like
        slip_x, slip_x_dx, slip_s, slip_s_dx.
    shear_modulus, mu : float
    level : str or Level
    nu : float
    method : int

    Returns
    -------
    RollingField
    """
    library = make_library(level, nu)
    arrays = [np.array(part, dtype=float) for part in (*strips, *slip)]
    count, n = arrays[0].size, library.panels.n
    work = make_workspace(count, n)
    result = rolling_force(*arrays, float(shear_modulus), float(mu), library, work, method)
    field = np.empty((9, count * n))
    read_field(library.panels, count, work, field)
    rows, force = field.reshape(9, count, n), np.empty((3, count))
    read_forces(count, work, force)
    return RollingField(*result, *rows[:7], rows[7] > 0, rows[8], force)
