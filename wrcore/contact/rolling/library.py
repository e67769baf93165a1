"""Library of resolvents, ellipses over ln(a/b), for similar patches (see `rolling`)."""

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
    """Resolution, Poisson's ratio, and resolvents of ellipses; a kernel argument, never written to."""

    level: Level
    panels: Panels
    nu: float
    log_min: float
    log_step: float
    """First value of ln(a/b), and distance of the values."""
    resolvents: np.ndarray
    """(K, m m) float32: ``(I + B)^-1`` row by row, m = 2 n strips; unknowns in the order of `rolling.RollingWork`."""


def ellipse_strips(a, b, count):
    """Equal strips, as `rolling.rolling_force` takes them, on an ellipse (semi-axes a along rolling, b across, m) under
    Hertz's pressure of peak 1: half lengths are root mean squares over a strip's width; with peaks in proportion the
    load is exact."""
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
            work.r[0, i] = 0.0
        work.r[0, k] = 1.0
        substitute(factors, block, size // block, work.r[0], work.y[0])
        for i in range(size):
            resolvent[i, k] = work.y[0, i]


@lru_cache(maxsize=16)
def make_library(level="middle", nu=0.28):
    """`Library` of a level, by its name in `rolling.LEVELS` or as `Level`; built in 10 to 100 ms and kept. InputError
    for panels that are odd or too few."""
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
