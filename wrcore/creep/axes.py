"""Axes and interpolation of the creep table: quadratic B-splines in up to five inputs.

Creepages w = (xi', eta', phi') are converted to a direction and a distance from zero creepage,

    X = xi' C11/3,   Y = eta' C22/3,   P = phi' l C11/3,   l = LEVER (sqrt(g) + 1/sqrt(g))
    alpha = atan2(Y, X),   beta = atan2(P, hypot(X, Y)),
    r^2 = X^2 + Y^2 + phi'^2 ((C23/1.5)^2 + SPIN_FLOOR^2),   t = k r/(1 + k r),   k = RATE sqrt(1 + WIDE b/a),

and the further axes are ln(a/b) and abs(psi). Nodes are equally spaced on all axes except t (see `_stretch`). In a
given direction t increases from zero creepage (0) to full slip (1), and the force is a smooth function of t. Polar axes
are needed because the force has a term r abs(r) at zero creepage. The table stores the remainder R of the force,

    F = (1 - t)^2 F_lin(w) + t R(g, psi, t, alpha, beta),      F_lin from `kalker`,

so that the derivatives at zero creepage are exactly Kalker's: R = 0 at t = 0 for the ellipse. Symmetries hold exactly:
F(-w) = -F(w) restricts the table to beta >= 0; mirroring y restricts it to psi >= 0 and, for the ellipse, xi >= 0. R is
a tensor product of quadratic B-splines that interpolates the nodes (approximately near the spin axis, see
`build.spline_coefficients`). It is once continuously differentiable and uses three coefficients per axis.
"""

from typing import NamedTuple

import numpy as np

from wrcore.creep.kalker import KalkerData, coefficients_at
from wrcore.kernels.jit import FUSED, jit
from wrcore.kernels.lanes import lane, load4

LEVER = 0.25
SPIN_FLOOR = 0.8
RATE = 1.1
WIDE = 0.1
PEAK, PEAK_WIDTH = 0.43, 0.1
_PEAK_LOW = -PEAK / np.hypot(PEAK, PEAK_WIDTH)
_PEAK_HIGH = (1 - PEAK) / np.hypot(1 - PEAK, PEAK_WIDTH)
_STRETCH = 1 / (1 + PEAK_WIDTH * (_PEAK_HIGH - _PEAK_LOW))
_LARGE = 1e12
_HALF_PI = 0.5 * np.pi
_PER_TURN = 0.5 / np.pi


class TableAxes(NamedTuple):
    """Extent and node counts of the axes; a kernel argument."""

    log_g_min: float
    log_g_max: float
    psi_max: float
    """Range of ln(a/b) and of abs(psi); psi_max = 0 for the plane of ellipses."""
    n_g: int
    n_psi: int
    n_t: int
    n_alpha: int
    n_beta: int
    """Numbers of nodes; alpha: on the full circle (even), beta: from 0 to pi/2 with both ends."""


class CreepTableData(NamedTuple):
    """Creep table for kernels."""

    axes: TableAxes
    kalker: KalkerData
    """Coefficients for the table's Poisson's ratio."""
    coefficients: np.ndarray
    """(n,) float32: B-spline coefficients in the order g, psi, t, alpha, beta, output; one extra coefficient on either
    side of each axis (none for psi in a table of ellipses, whose alpha covers -pi/2..pi/2); outputs fx, fy, mz, 0."""


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _atan(z):
    """Return atan z for 0 <= z <= 1 with an error of 1e-8; value and slope are exact at 1, so that `_atan2` is C1."""
    s = z * z
    s2 = s * s
    low = -0.33332972964484753 + 0.19990074492491161 * s + s2 * (-0.14183326803556859 + 0.10563281351540649 * s)
    high = -0.073433958870568999 + 0.040838569517279953 * s + s2 * (-0.014952970057209986 + 0.00257596204804535 * s)
    p = low + s2 * s2 * high
    return z + z * s * p


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _atan2(y, x):
    """Angle of (x, y) in -pi..pi with an error of 1e-7; 0 at the origin."""
    ax, ay = abs(x), abs(y)
    large, small = max(ax, ay), min(ax, ay)
    angle = _atan(small / (large + 1e-300))
    angle = _HALF_PI - angle if ay > ax else angle
    angle = np.pi - angle if x < 0 else angle
    return -angle if y < 0 else angle


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def scales(g, c11, c22, c23):
    """Return the factors of xi', eta', phi' in the direction, of phi' in the distance, and k (formulas: see above)."""
    root = np.sqrt(g)
    inverse = 1 / root
    lever = LEVER * (root + inverse)
    rate = RATE * np.sqrt(1 + WIDE * inverse * inverse)
    sx = c11 * (1 / 3)
    return sx, c22 * (1 / 3), lever * sx, np.sqrt((c23 * (1 / 1.5)) ** 2 + SPIN_FLOOR**2), rate


@jit(forceinline=True, fastmath=FUSED)
def _bend(far, whole):
    """Nonlinear part of the stretched axis at t = far/whole; a fraction, so that root and division run in parallel."""
    d, width = far - PEAK * whole, PEAK_WIDTH * whole
    return PEAK_WIDTH * (d / np.sqrt(d * d + width * width) - _PEAK_LOW)


@jit(forceinline=True, fastmath=FUSED)
def _stretch(t):
    """Position of t on the axis, 0 to 1, with up to twice as many nodes around PEAK, where spin saturates sharply."""
    return (t + _bend(t, 1.0)) * _STRETCH


def node_distances(n_t):
    """Values of t at ``n_t`` equally spaced positions on the stretched axis."""
    t = np.linspace(0, 1, 20001)
    return np.interp(np.linspace(0, 1, n_t), _stretch(t), t)


def creepages_at(g, t, alpha, beta, kalker):
    """Return the creepages xi', eta', phi' (..., 3) at nodes t < 1, alpha, beta of equal shape for g = a/b."""
    c11, c22, c23, _ = coefficients_at(np.log(g), kalker)
    sx, sy, sp, spin, rate = scales(g, c11, c22, c23)
    direction = np.stack([np.cos(beta) * np.cos(alpha) / sx, np.cos(beta) * np.sin(alpha) / sy, np.sin(beta) / sp], -1)
    length = np.sqrt(np.cos(beta) ** 2 + (direction[..., 2] * spin) ** 2)
    return direction * (t / ((1 - t) * rate * length))[..., None]


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _taps(position, last):
    """Return the nearest node and three quadratic B-spline weights at a position in node spacings, limited to
    0..last."""
    position = min(position, float(last)) if position > 0 else 0.0
    node = int(position + 0.5)
    f = position - node
    return node, (0.5 * (0.5 - f) * (0.5 - f), 0.75 - f * f, 0.5 * (0.5 + f) * (0.5 + f))


@jit(allocates=False, forceinline=True)
def _line(c, start, wb):
    """Weighted sum over three neighbours in beta, of all four outputs."""
    return wb[0] * load4(c, start) + wb[1] * load4(c, start + np.uint64(4)) + wb[2] * load4(c, start + np.uint64(8))


@jit(allocates=False, forceinline=True)
def _plane(c, start, row, wa, wb):
    """Weighted sum over 3 x 3 neighbours in alpha (stride ``row``) and beta."""
    one, two, three = _line(c, start, wb), _line(c, start + row, wb), _line(c, start + row + row, wb)
    return wa[0] * one + wa[1] * two + wa[2] * three


@jit(allocates=False, forceinline=True)
def _solid(c, start, row, layer, wt, wa, wb):
    """Weighted sum over 3 x 3 x 3 neighbours in t (stride ``layer``), alpha and beta."""
    one, two = _plane(c, start, row, wa, wb), _plane(c, start + layer, row, wa, wb)
    return wt[0] * one + wt[1] * two + wt[2] * _plane(c, start + layer + layer, row, wa, wb)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def table_lookup(table, log_g, g, psi, xi, eta, phi):
    """Creep force fx, fy, mz from the table, over mu N and mu N c, and a flag.

    The flag is 1 if a/b or psi is outside the range of the table; the nearest patch inside is then used. For creepages
    that are not finite the forces are NaN and the flag is 1."""
    axes, c = table.axes, table.coefficients
    if not abs(log_g + psi + xi + eta + phi) < np.inf:
        return np.nan, np.nan, np.nan, 1
    outside = 0
    if not axes.log_g_min - 1e-12 <= log_g <= axes.log_g_max + 1e-12:
        outside = 1
        log_g = min(max(log_g, axes.log_g_min), axes.log_g_max)
        g = np.exp(log_g)
    if abs(psi) > axes.psi_max:
        outside = 1
    # mirror y (psi >= 0), then reverse all creepages (phi >= 0), then, for the ellipse, mirror again (xi >= 0)
    flip_y = -1.0 if psi < 0 else 1.0
    flip = -1.0 if flip_y * phi < 0 else 1.0
    xi, eta, phi = flip * xi, flip * flip_y * eta, flip * flip_y * phi
    flip_x = 1.0
    if axes.n_psi == 1 and xi < 0:
        flip_x, xi = -1.0, -xi
    c11, c22, c23, c33 = coefficients_at(log_g, table.kalker)
    sx, sy, sp, spin, rate = scales(g, c11, c22, c23)
    size = max(abs(xi), abs(eta), abs(phi))
    if size > _LARGE:
        xi, eta, phi = xi / size * _LARGE, eta / size * _LARGE, phi / size * _LARGE
    x, y, p, q = xi * sx, eta * sy, phi * sp, phi * spin
    flat = x * x + y * y
    far = rate * np.sqrt(flat + q * q)
    whole = 1 + far
    stick = 1 / whole
    t = far * stick
    angle = _atan2(y, x)
    rise = _atan2(p, np.sqrt(flat))
    # Unsigned: numba then leaves out the treatment of negative indices.
    row = np.uint64(4 * (axes.n_beta + 2))
    last = axes.n_alpha // 2 if axes.n_psi == 1 else axes.n_alpha
    layer = row * np.uint64(last + 3)
    patch = layer * np.uint64(axes.n_t + 2)
    first_angle = _HALF_PI if axes.n_psi == 1 else np.pi
    k, wt = _taps((t + _bend(far, whole)) * (_STRETCH * (axes.n_t - 1)), axes.n_t - 1)
    m, wa = _taps((angle + first_angle) * (axes.n_alpha * _PER_TURN), last)
    n, wb = _taps(rise * ((axes.n_beta - 1) * (4 * _PER_TURN)), axes.n_beta - 1)
    i, wg = _taps((log_g - axes.log_g_min) * ((axes.n_g - 1) / (axes.log_g_max - axes.log_g_min)), axes.n_g - 1)
    start = np.uint64(k) * layer + np.uint64(m) * row + np.uint64(4 * n)
    if axes.n_psi == 1:
        start += np.uint64(i) * patch
        one, two = _solid(c, start, row, layer, wt, wa, wb), _solid(c, start + patch, row, layer, wt, wa, wb)
        force = wg[0] * one + wg[1] * two + wg[2] * _solid(c, start + patch + patch, row, layer, wt, wa, wb)
    else:
        j, wp = _taps(abs(psi) * ((axes.n_psi - 1) / axes.psi_max), axes.n_psi - 1)
        plane = np.uint64(axes.n_psi + 2) * patch
        start += np.uint64(i) * plane + np.uint64(j) * patch
        force = 0.0 * load4(c, start)
        for u in range(3):
            one, two = _solid(c, start, row, layer, wt, wa, wb), _solid(c, start + patch, row, layer, wt, wa, wb)
            three = _solid(c, start + patch + patch, row, layer, wt, wa, wb)
            force = force + wg[u] * (wp[0] * one + wp[1] * two + wp[2] * three)
            start += plane
    linear = stick * stick
    fx = t * lane(force, 0) - linear * c11 * xi
    fy = t * lane(force, 1) - linear * (c22 * eta + c23 * phi)
    mz = t * lane(force, 2) + linear * (c23 * eta - c33 * phi)
    return flip * flip_x * fx, flip * flip_y * fy, flip * flip_y * mz, outside
