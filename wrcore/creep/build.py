"""Computation of creep tables: solutions of rolling contact at the nodes, and their B-spline coefficients."""

import math
from typing import NamedTuple

import numpy as np

from wrcore.contact.rolling.ellipse import RollingContact
from wrcore.creep.axes import CreepTableData, TableAxes, creepages_at, node_distances, table_lookup
from wrcore.creep.kalker import coefficients_at, kalker_data

A_OVER_B = (0.05, 20.0)
PSI_MAX = 0.95
NEARLY_FULL_SLIP = 1 - 1e-9
ROUNDED = 9


class Resolution(NamedTuple):
    """Numbers of nodes of the axes and level of the half-space solver; ``n_psi`` is not used in a table of ellipses."""

    n_g: int
    n_psi: int
    n_t: int
    n_alpha: int
    n_beta: int
    level: int


RESOLUTIONS = {
    "ellipse": (
        (0.015, Resolution(9, 1, 12, 20, 9, 12)),
        (0.006, Resolution(13, 1, 16, 24, 12, 16)),
        (0.003, Resolution(17, 1, 20, 28, 14, 20)),
        (0.0015, Resolution(21, 1, 28, 36, 18, 24)),
    ),
    "sdec": (
        (0.015, Resolution(8, 4, 12, 16, 9, 12)),
        (0.009, Resolution(9, 4, 14, 20, 10, 14)),
        (0.006, Resolution(10, 4, 16, 20, 13, 16)),
        (0.0035, Resolution(10, 4, 20, 20, 16, 20)),
    ),
}
"""Resolutions from coarse to fine, each after an upper bound of the measured 99 % quantile of its force error over
mu N."""


def table_axes(planes, resolution):
    """Return the axes of a table of ``planes`` "ellipse" or "sdec" with the numbers of nodes of ``resolution``."""
    n_psi, psi_max = (1, 0.0) if planes == "ellipse" else (resolution.n_psi, PSI_MAX)
    low, high = np.log(A_OVER_B)
    return TableAxes(
        float(low), float(high), psi_max,
        resolution.n_g, n_psi, resolution.n_t, resolution.n_alpha, resolution.n_beta,
    )  # fmt: skip


def count_cases(axes):
    """Number of rolling problems solved for a table, without t = 0 and without directions known by symmetry."""
    half = axes.n_alpha // 2 + 1
    ellipse = (axes.n_t - 1) * (half * (axes.n_beta - 1) + 1)
    skewed = (axes.n_t - 1) * (axes.n_alpha * (axes.n_beta - 1) + 1)
    return axes.n_g * (ellipse + (axes.n_psi - 1) * skewed)


def axis_values(axes):
    """Return the nodes of the axes ln(a/b), psi, t, alpha, beta; alpha on the full circle from -pi."""
    return (
        np.linspace(axes.log_g_min, axes.log_g_max, axes.n_g), np.linspace(0, axes.psi_max, axes.n_psi),
        node_distances(axes.n_t), 2 * np.pi * np.arange(axes.n_alpha) / axes.n_alpha - np.pi,
        np.linspace(0, np.pi / 2, axes.n_beta),
    )  # fmt: skip


def _directions(axes, ellipse):
    """Return the node indices (alpha, beta) of directions to be solved: xi >= 0 for the ellipse, the pole once."""
    a, b = np.meshgrid(np.arange(axes.n_alpha), np.arange(axes.n_beta), indexing="ij")
    quarter = axes.n_alpha // 4
    wanted = (b < axes.n_beta - 1) | (a == axes.n_alpha // 2)
    if ellipse:
        wanted &= abs(a - axes.n_alpha // 2) <= quarter
    return a[wanted], b[wanted]


def _kalker_matrix(c11, c22, c23, c33):
    return np.array([[-c11, 0, 0], [0, -c22, -c23], [0, c23, -c33]])


def _fill(axes, ellipse, alpha_index, beta_index, values):
    """Return values at all nodes (n_t, n_alpha, n_beta, 3) from solved directions (n_t, m, 3) by symmetry."""
    full = np.empty((values.shape[0], axes.n_alpha, axes.n_beta, 3))
    full[:, alpha_index, beta_index] = values
    if ellipse:
        mirrored = (axes.n_alpha // 2 - alpha_index) % axes.n_alpha
        inside = beta_index < axes.n_beta - 1
        full[:, mirrored[inside], beta_index[inside]] = values[:, inside] * [-1, 1, 1]
    full[:, :, -1] = full[:, axes.n_alpha // 2, -1][:, None]
    # without spin the reversed direction is a node too; its separate solution agrees only within the tolerance
    full[:, :, 0] = (full[:, :, 0] - np.roll(full[:, :, 0], axes.n_alpha // 2, axis=1)) / 2
    return full


def patch_remainder(axes, log_g, psi, kalker, level):
    """Remainder R (n_t, n_alpha, n_beta, 3; see `axes`) at all nodes of a patch: force minus linear part, over t."""
    g, ellipse = np.exp(log_g), psi == 0
    contact = RollingContact(g, psi, kalker.nu, level)
    alpha_index, beta_index = _directions(axes, ellipse)
    _, _, t_nodes, alphas, betas = axis_values(axes)
    alpha, beta = alphas[alpha_index], betas[beta_index]
    kalker_law = _kalker_matrix(*coefficients_at(log_g, kalker))
    t = np.minimum(t_nodes[1:], NEARLY_FULL_SLIP)[:, None] + 0 * alpha
    creepages = creepages_at(g, t, alpha + 0 * t, beta + 0 * t, kalker)
    force = contact.solve_many(creepages.reshape(-1, 3))[0].reshape(creepages.shape)
    values = np.zeros((axes.n_t, len(alpha), 3))
    values[1:] = (force - (1 - t[..., None]) ** 2 * (creepages @ kalker_law.T)) / t[..., None]
    if not ellipse:
        small = 1e-6
        slope = creepages_at(g, small + 0 * alpha, alpha, beta, kalker) / small
        ellipse_law = RollingContact(g, 0.0, kalker.nu, level).linear_response()
        values[0] = slope @ (contact.linear_response() - ellipse_law).T
    return _fill(axes, ellipse, alpha_index, beta_index, values)


def _interpolation(n, periodic):
    """Return the matrix from node values to quadratic B-spline coefficients, which are (1/8, 6/8, 1/8) at each node.

    Its shape is (n, n) if periodic, else (n + 2, n), with a third difference of the coefficients of 0 at either end."""
    if periodic:
        rows = 0.75 * np.eye(n) + 0.125 * (np.roll(np.eye(n), 1, 0) + np.roll(np.eye(n), -1, 0))
        return np.linalg.inv(rows)
    matrix = np.zeros((n + 2, n + 2))
    for node in range(n):
        matrix[node, node : node + 3] = 0.125, 0.75, 0.125
    matrix[n, :4] = matrix[n + 1, -4:] = 1, -3, 3, -1
    return np.linalg.inv(matrix)[:, :n]


def _along(matrix, values, axis):
    return np.moveaxis(np.tensordot(matrix, values, (1, axis)), 0, axis)


def _overtones(n):
    """Return the matrix (n, n) for the third and higher odd harmonics of values equally spaced on a circle."""
    step = np.arange(n) - np.arange(n)[:, None]
    odd = (np.eye(n) - np.roll(np.eye(n), n // 2, axis=1)) / 2
    return odd - 2 / n * np.cos(2 * np.pi * step / n)


def _flat_at_pole(n):
    """Return the matrix (n + 2, n) from values of odd harmonics over beta to coefficients with value and slope 0 at
    the pole.

    The coefficients are even about beta = 0. The values at the two nodes nearest to the pole are not used."""
    inner = n - 2
    rows = 0.75 * np.eye(inner) + 0.125 * (np.eye(inner, k=1) + np.eye(inner, k=-1))
    rows[0, 1] *= 2
    matrix = np.zeros((n + 2, n))
    matrix[1 : inner + 1, :inner] = np.linalg.inv(rows)
    matrix[0] = matrix[2]
    return matrix


def _meridians(values):
    """Return the coefficients over beta, with extra ones at the ends by symmetry about the pole and beta = 0."""
    n_alpha, n_beta = values.shape[3:5]
    opposite = np.roll(values, -n_alpha // 2, axis=3)[..., -2:0:-1, :]
    circle = np.concatenate([values, opposite, -values, -opposite], axis=4)
    c = _along(_interpolation(4 * (n_beta - 1), True), circle, 4)
    return np.concatenate([c[..., -1:, :], c[..., : n_beta + 1, :]], axis=4)


def _mirror_psi(values):
    """Return R at -psi: mirrored in y and reversed, (fx, fy, mz)(alpha) -> (-fx, fy, mz)(pi - alpha)."""
    n_alpha = values.shape[3]
    index = (n_alpha // 2 - np.arange(n_alpha)) % n_alpha
    return values[:, :, :, index] * [-1, 1, 1]


def spline_coefficients(values):
    """Return the B-spline coefficients of R, given at the nodes (n_g, n_psi, n_t, n_alpha, n_beta, 3).

    They are flattened for `CreepTableData`, with extra ones at the ends of axes. They are rounded to 1e-9, so that
    rounding in matrix products does not break a symmetry and two builds have equal coefficients.

    At the spin axis, the pole of (alpha, beta), the slope of a smooth force varies as cos(alpha) and sin(alpha).
    Interpolation adds higher harmonics, whose slopes change direction within any small distance of the axis. Their
    value and slope are set to 0 there, which causes errors of up to 0.2 % of mu N at nodes near the pole."""
    n_g, n_psi, n_t, n_alpha, n_beta, _ = values.shape
    c = _along(_interpolation(n_g, False), values, 0)
    c = _along(_interpolation(n_t, False), c, 2)
    c = _along(_interpolation(n_alpha, True), c, 3)
    overtones = _along(_overtones(n_alpha), c, 3)
    c = _meridians(c - overtones) + _along(_flat_at_pole(n_beta), overtones, 4)
    if n_psi == 1:
        quarter = n_alpha // 4
        c = c[:, :, :, quarter - 1 : 3 * quarter + 2]
    else:
        both = np.concatenate([_mirror_psi(c[:, :0:-1]), c], axis=1)
        c = _along(_interpolation(2 * n_psi - 1, False), both, 1)[:, n_psi - 1 :]
        c = np.concatenate([c[:, :, :, -1:], c, c[:, :, :, :2]], axis=3)
    padded = np.zeros((*c.shape[:-1], 4), np.float32)
    padded[..., :3] = np.round(c, ROUNDED) + 0.0
    return padded.ravel()


def build_data(nu, planes, resolution, progress=None):
    """Solve all nodes of a table and return its `CreepTableData`.

    ``nu`` is Poisson's ratio, ``planes`` "ellipse" or "sdec"; ``progress`` wraps the list of patches."""
    axes, kalker = table_axes(planes, resolution), kalker_data(nu)
    log_g, psi, *_ = axis_values(axes)
    values = np.empty((axes.n_g, axes.n_psi, axes.n_t, axes.n_alpha, axes.n_beta, 3))
    patches = [(i, j) for i in range(axes.n_g) for j in range(axes.n_psi)]
    for i, j in progress(patches) if progress else patches:
        values[i, j] = patch_remainder(axes, log_g[i], psi[j], kalker, resolution.level)
    return CreepTableData(axes, kalker, spline_coefficients(values))


def random_creepages(g, count, kalker, rng):
    """Random creepages from small ones to beyond saturation: one third each without spin, with pure spin, and mixed.

    With X = xi' C11/3, Y = eta' C22/3, spin phi' C23: abs(X, Y) log-uniform 0.03..3, spin log-uniform 0.03..5."""
    c11, c22, c23, _ = coefficients_at(np.log(g), kalker)
    kind, turn = rng.integers(0, 3, count), rng.uniform(0, 2 * np.pi, count)
    radius = np.exp(rng.uniform(np.log(0.03), np.log(3), count)) * (kind != 1)
    spin = np.exp(rng.uniform(np.log(0.03), np.log(5), count)) * rng.choice([-1.0, 1.0], count) * (kind != 0)
    return np.stack([radius * np.cos(turn) * 3 / c11, radius * np.sin(turn) * 3 / c22, spin / c23], axis=1)


def random_errors(data, level, patches=48, per_patch=40, seed=0):
    """Return errors of the table relative to the half-space solver at random cases, (patches per_patch,) each.

    They are the length of the error vector of (fx, fy), and the error of mz. Patches are drawn uniformly over the range
    of ln(a/b) and psi, with random creepages on each."""
    rng, axes = np.random.default_rng(seed), data.axes
    force, moment = [], []
    for _ in range(patches):
        g = np.exp(rng.uniform(axes.log_g_min, axes.log_g_max))
        psi = rng.uniform(-axes.psi_max, axes.psi_max)
        creepages = random_creepages(g, per_patch, data.kalker, rng)
        exact, _ = RollingContact(g, psi, data.kalker.nu, level).solve_many(creepages)
        error = np.array([table_lookup(data, math.log(g), g, psi, *row)[:3] for row in creepages]) - exact
        force.append(np.hypot(error[:, 0], error[:, 1]))
        moment.append(abs(error[:, 2]))
    return np.concatenate(force), np.concatenate(moment)
