"""Friction, irregularity and creep as a user writes them."""

import numpy as np
from numba import njit

TABLE = {"arc_length": [0.0, 10.0, 20.0], "left": [0.3, 0.1, 0.3], "right": [0.3, 0.4, 0.2]}


def friction(s):
    return np.stack([np.interp(s, TABLE["arc_length"], TABLE[side]) for side in ("left", "right")])


def falling(w):
    return 0.4 + 0.6 * np.exp(-0.6 * w)


def waves(s):
    return np.stack([0.001 * np.sin(0.5 * s), 0.0 * s, 0.001 * np.sin(0.5 * s), 0.0 * s])


def of_one_size(s):
    return np.zeros(3)


def too_large(s):
    return 2.0 + 0.0 * s


def holed(s):
    return np.where(s > 3.0, np.nan, 0.3)


@njit
def as_she(ratio, psi, kalker, xi, eta, phi):
    """Shen, Hedrick and Elkins, as `wrcore.creep.laws.she`."""
    c11, c22, c23, c33 = kalker
    fx, fy, mz = -c11 * xi, -c22 * eta - c23 * phi, c23 * eta - c33 * phi
    u = np.sqrt(fx * fx + fy * fy)
    factor = 1 - u / 3 + u * u / 27 if u < 3 else 1 / u
    return factor * fx, factor * fy, factor * mz


def plain(ratio, psi, kalker, xi, eta, phi):
    return 0.0, 0.0, 0.0


@njit
def of_two(ratio, psi, kalker, xi, eta, phi):
    return 0.0, 0.0
