"""Library of resolvents of ellipses over ln(a/b), for patches of similar shape (see `rolling`)."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from wrcore.contact.rolling.influence import assemble, lay_out
from wrcore.contact.rolling.panels import Panels, make_panels
from wrcore.contact.rolling.resolvent import LONGEST_PANEL, factorise, substitute
from wrcore.contact.rolling.rolling import LEVELS, Level, rolling_work
from wrcore.errors import InputError
from wrcore.kernels.jit import FUSED, jit

LOG_MIN, LOG_STEP = -2.4, 0.4


class Library(NamedTuple):
    """Resolution, Poisson's ratio, and resolvents of ellipses; a read-only kernel argument."""

    level: Level
    panels: Panels
    nu: float
    log_min: float
    log_step: float
    """Step of the values of ln(a/b); ``log_min`` is the first value."""
    resolvents: np.ndarray
    """(K, m m) float32: ``(I + B)^-1`` row by row, m = 2 n strips; unknowns in the order of `rolling.RollingWork`."""


def ellipse_strips(a, b, count):
    """Return ``count`` equal strips for `rolling.rolling_force` on an ellipse under Hertz's pressure with maximum 1.

    ``a`` and ``b`` are the semi-axes in the rolling direction and across, m. Half lengths are root mean squares over a
    strip's width; peak pressures are in proportion, so that the load is exact."""
    edge = np.linspace(-1, 1, count + 1)
    root = np.sqrt(1 - np.diff(edge**3) / (3 * np.diff(edge)))
    return (edge[1:] + edge[:-1]) / 2 * b, np.diff(edge) * b, a * root, np.zeros(count), root


@jit(allocates=False, fastmath=FUSED)
def _invert(block, work, resolvent):
    """Fill ``resolvent`` with (I + B)^-1, for the matrix B in ``work``."""
    size = resolvent.shape[0]
    factors = work.factors.reshape((size, size))
    factorise(work.matrix.reshape((size, size)), block, size // block, factors)
    for k in range(size):
        for i in range(size):
            work.r[0, i] = 0.0
        work.r[0, k] = 1.0
        substitute(factors, block, size // block, work.r[0], work.y[0])
        for i in range(size):
            resolvent[i, k] = work.y[0, i]


@lru_cache(maxsize=16)
def make_library(level="middle", nu=0.28):
    """Return the `Library` of a level, given by its name in `rolling.LEVELS` or as `Level`.

    It is built in 10 to 100 ms and cached. InputError if the number of panels is odd or too small."""
    level = LEVELS[level] if isinstance(level, str) else level
    if level.panels < 4 or level.panels % 2 or level.strips < 2:
        raise InputError("rolling contact", "level", f"expected an even number of panels above 2, got {level}")
    panels = make_panels(level.panels)
    work = rolling_work(level.strips, level.panels)
    size = 2 * level.panels * level.strips
    steps = max(1, int(np.ceil((np.log(LONGEST_PANEL * level.panels / level.strips) - LOG_MIN) / LOG_STEP)))
    resolvents = np.empty((steps + 1, size * size), np.float32)
    for k, resolvent in enumerate(resolvents):
        ratio = np.exp(LOG_MIN + k * LOG_STEP)
        lay_out(*ellipse_strips(np.sqrt(ratio), 1 / np.sqrt(ratio), level.strips), level.strips, work.strip)
        assemble(panels, level.strips, float(nu), work)
        _invert(2 * level.panels, work, resolvent.reshape(size, size))
    return Library(level, panels, float(nu), LOG_MIN, LOG_STEP, resolvents)
