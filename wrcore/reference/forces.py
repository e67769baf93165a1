"""Normal force by Hertz and Eq. (7), creep forces by formula or from the creep table."""

import math

import numpy as np
from scipy.optimize import brentq
from scipy.special import ellipe, ellipkm1

from wrcore.creep.axes import LEVER, PEAK, PEAK_WIDTH, RATE, SPIN_FLOOR, WIDE
from wrcore.errors import InputError


def hertz(penetration, curvature_x, curvature_y, modulus):
    """Hertz's force and ellipse for the gap A x^2 + B y^2.

    Parameters
    ----------
    penetration : float
        m.
    curvature_x, curvature_y : float
        A and B, 1/m.
    modulus : float
        Contact modulus E*, Pa.

    Returns
    -------
    force, a, b : float
        N; semi-axes along x and y, m.

    References
    ----------
    Johnson, Contact Mechanics (1985), section 4.2: with k the ratio of the small to the large semi-axis l,
    curvature ratio (E/k^2 - K)/(K - E), l^3 = 3 N E/(2 pi k^2 E* (A + B)), delta = 3 N K/(2 pi E* l).
    """
    low, high = sorted((curvature_x, curvature_y))

    def mismatch(k):
        first, second = ellipkm1(k * k), ellipe(1.0 - k * k)
        return (second / k**2 - first) * low - (first - second) * high

    k = 1.0 if high < (1.0 + 1e-6) * low else brentq(mismatch, 1e-6, 1.0 - 1e-7, xtol=1e-15, rtol=1e-14)
    first, second = ellipkm1(k * k), ellipe(1.0 - k * k)
    length = (3.0 * second / (2.0 * math.pi * k * k * modulus * (low + high))) ** (1 / 3)  # l of a unit force
    force = (penetration * 2.0 * math.pi * modulus * length / (3.0 * first)) ** 1.5
    large = length * force ** (1 / 3)
    return (force, large, k * large) if curvature_x <= curvature_y else (force, k * large, large)


def damping_factor(speed, c_e, v0):
    """c_d of Eq. (7): c_e when separating, 1 when approaching faster than v0 (m/s), a cubic between.

    References
    ----------
    Ambrosio and Pombo, Multibody System Dynamics 42 (2018) 317-345.
    """
    r = np.clip(0.5 * (speed + v0) / v0, 0.0, 1.0)
    return c_e + (1.0 - c_e) * r**2 * (3.0 - 2.0 * r)


def kalker_coefficients(kalker, log_g):
    """C11, C22, C23, C33 at ln(a/b): cubic polynomials between nodes, the outer ones beyond.

    Parameters
    ----------
    kalker : wrcore.creep.kalker.KalkerData
    log_g : float

    Returns
    -------
    numpy.ndarray, shape (4,)
    """
    cells = len(kalker.cubic)
    position = np.clip((log_g - kalker.start) / kalker.spacing, 0.0, cells)
    cell = min(int(position), cells - 1)
    return ((position - cell) * kalker.spacing) ** np.arange(4) @ kalker.cubic[cell]


def linear(kalker, log_g, creepages):
    """Kalker's linear theory in the nondimensional form of :mod:`wrcore.creep.laws`, shape (3,)."""
    c11, c22, c23, c33 = kalker_coefficients(kalker, log_g)
    xi, eta, phi = creepages
    return np.array([-c11 * xi, -c22 * eta - c23 * phi, c23 * eta - c33 * phi])


def shen_hedrick_elkins(kalker, log_g, creepages):
    """The linear force, reduced to u - u^2/3 + u^3/27 of its size u over mu N, at most 1; shape (3,)."""
    force = linear(kalker, log_g, creepages)
    u = np.hypot(force[0], force[1])
    return force * (1.0 - u / 3.0 + u**2 / 27.0 if u < 3.0 else 1.0 / u)


def table_force(table, log_g, creepages):
    """Creep force from the table of the ellipse, by the formulas of :mod:`wrcore.creep.axes`.

    Parameters
    ----------
    table : wrcore.creep.axes.CreepTableData
    log_g : float
        ln(a/b).
    creepages : array_like, shape (3,)
        Nondimensional.

    Returns
    -------
    numpy.ndarray, shape (3,)
        Fx, Fy over mu N, Mz over mu N c.

    Raises
    ------
    InputError
        For a table with the patch's shape as fifth input.
    """
    axes = table.axes
    if axes.n_psi != 1:
        raise InputError("creep table", "planes", "expected 'ellipse' for the plain equations")
    log_g = min(max(log_g, axes.log_g_min), axes.log_g_max)
    w = np.array(creepages, float)
    turned = -1.0 if w[2] < 0.0 else 1.0  # F(-w) = -F(w)
    w *= turned
    mirrored = np.array([-1.0 if w[0] < 0.0 else 1.0, 1.0, 1.0])  # and Fx odd, Fy and Mz even in xi
    w *= mirrored
    c11, c22, c23, _ = kalker_coefficients(table.kalker, log_g)
    root = math.exp(0.5 * log_g)
    x, y, p = w * np.array([c11, c22, LEVER * (root + 1.0 / root) * c11]) / 3.0
    far = math.sqrt(x**2 + y**2 + w[2] ** 2 * ((c23 / 1.5) ** 2 + SPIN_FLOOR**2))
    far *= RATE * math.sqrt(1.0 + WIDE / root**2)
    t = far / (1.0 + far)
    alpha, beta = math.atan2(y, x), math.atan2(p, math.hypot(x, y))
    positions = (
        (log_g - axes.log_g_min) / (axes.log_g_max - axes.log_g_min) * (axes.n_g - 1),
        _stretched(t) * (axes.n_t - 1),
        (alpha + 0.5 * math.pi) / (2.0 * math.pi) * axes.n_alpha,
        beta / (0.5 * math.pi) * (axes.n_beta - 1),
    )
    nodes = (axes.n_g, axes.n_t, axes.n_alpha // 2 + 1, axes.n_beta)
    taps = [_spline_taps(position, n) for position, n in zip(positions, nodes, strict=True)]
    rest = table.coefficients.reshape(*(n + 2 for n in nodes), 4)[*(around for around, _ in taps), :3]
    for _, weights in taps:
        rest = np.tensordot(weights, rest, 1)
    force = (1.0 - t) ** 2 * linear(table.kalker, log_g, w) + t * rest
    return turned * mirrored * force


def _stretched(t):
    """Position of a distance along the table's axis, 0 to 1: nodes lie closer around its peak."""

    def bend(t):
        return (t - PEAK) / math.hypot(t - PEAK, PEAK_WIDTH)

    return (t + PEAK_WIDTH * (bend(t) - bend(0.0))) / (1.0 + PEAK_WIDTH * (bend(1.0) - bend(0.0)))


def _spline_taps(position, n):
    """The three coefficients (one ghost in front) around a position, and the weights of their quadratic B-splines."""
    position = min(max(position, 0.0), n - 1.0)
    node = int(position + 0.5)
    f = position - node
    return slice(node, node + 3), np.array([0.5 * (0.5 - f) ** 2, 0.75 - f**2, 0.5 * (0.5 + f) ** 2])


def creep_force(law, data, log_g, creepages):
    """Creep force by the name of the law: table, linear or she; arguments as for :func:`table_force`.

    Raises
    ------
    InputError
        For another law.
    """
    if law == "table":
        return table_force(data, log_g, creepages)
    formulas = {"linear": linear, "she": shen_hedrick_elkins}
    if law not in formulas:
        raise InputError("contact.creep", "model", f"expected table, {' or '.join(formulas)} when plain, got {law}")
    return formulas[law](data.kalker, log_g, creepages)
