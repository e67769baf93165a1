"""Discretisation of one contact patch on the half-space: panels, influence matrix, inverted resolvent.

All lengths are divided by c = sqrt(a b), tractions multiplied by c^2/(mu N), so that only the axis ratio g = a/b, the
shape number psi and Poisson's ratio nu remain. The patch (simple double ellipse, SDEC) spans -1/sqrt(g) < y < 1/sqrt(g)
and, with t = y - y0, y0 = -psi/sqrt(g), |x| < xl(y) = sqrt(g) sqrt(1 - g t^2/(1 +- psi)^2) for +-t > 0. psi = 0 is the
ellipse. The bound of the traction is ``3/(2 pi sqrt(g)) sqrt(xl^2 - x^2)``.

Discretisation: ``ny`` equal strips across, each with ``n`` panels along x with cosine spacing over the strip's length.
The unknown is the force of a panel, whose bound is known exactly. A strip carries its load on three sub-strips in
proportion to their normal load. The slip of a panel is the mean over their lines with the same weights.

References
----------
Kalker, Three-Dimensional Elastic Bodies in Rolling Contact (1990), chapters 1 and 4 (half-space, surface mechanics).
Love, Phil. Trans. R. Soc. A 228 (1929) 377 (a loaded rectangle on the half-space).
Vollebregt, User guide for CONTACT, section on the SDEC patch.
"""

from typing import NamedTuple

import numpy as np

from wrcore.contact.rolling.panels import Panels, make_panels
from wrcore.kernels.jit import jit

SUB_STRIPS = 3
STEP_SCALE = 2.5

_LEAD = 0.5
"""Distance of the first slip point from the leading edge over that of the second. With 0.5, C23 has an error of 0.3 %
at level 22; with 1 or 0, of 0.5 %."""


class PatchPanels(NamedTuple):
    """Geometry of the N = ny n panels of one patch, strip by strip; lengths over c, forces over mu N."""

    n: int
    ny: int
    """Numbers of panels per strip (from the leading edge backwards) and of strips (towards +y)."""
    y_edge: np.ndarray
    """(3 ny + 1,): edges of the sub-strips."""
    half_length: np.ndarray
    y_line: np.ndarray
    share: np.ndarray
    """(3 ny,): half length, load centroid and fraction of the strip's load of each sub-strip."""
    bound: np.ndarray
    """(N,): maximum force of a panel; the sum is 1."""
    x_slip: np.ndarray
    x_force: np.ndarray
    y: np.ndarray
    """(N,): x of the slip point, x of the centroid of the bound, lateral position."""
    along: Panels
    """Panels of one strip, over its half length."""


class Operator(NamedTuple):
    """Data of the iteration in `wrcore.contact.rolling.ellipse`, in float32; a kernel argument.

    ``resolvent`` and ``resolvent_odd`` hold transposed blocks of ``M = (H + A)^-1 H``. For psi = 0 the mirror
    symmetry y -> -y splits M: ``resolvent`` acts on (Fx even, Fy odd) and ``resolvent_odd`` on (Fx odd, Fy even) in y.
    Otherwise ``resolvent`` is all of M and ``resolvent_odd`` is empty. ``stuck``: see `stuck_forces`."""

    n: int
    ny: int
    symmetric: bool
    resolvent: np.ndarray
    resolvent_odd: np.ndarray
    stuck: np.ndarray
    step: np.ndarray
    inverse_step: np.ndarray
    bound: np.ndarray
    x_slip: np.ndarray
    x_force: np.ndarray
    y: np.ndarray
    ahead: np.ndarray
    behind: np.ndarray
    rigid: np.ndarray


def panel_counts(g, level):
    """Numbers of panels per strip and of strips (even) for the axis ratio ``g``, about ``level**2`` panels in all.

    The ratio of the two numbers was chosen for the minimum force error at a given total."""
    ratio = np.exp(np.interp(np.log(g), np.log([0.18, 0.5, 1.0, 2.5, 7.0]), np.log([2.0, 1.15, 0.8, 0.65, 0.7])))
    ny = max(4, 2 * round(level * np.sqrt(ratio) / 2))
    return max(4, round(level**2 / ny)), ny


def _moments_of_squared_length(y0, y1, g, psi):
    """Integrals of xl^2 and of y xl^2 from y0 to y1, on one half ellipse or on both sides of y = -psi/sqrt(g)."""
    b = 1 / np.sqrt(g)
    middle = -psi * b
    zeroth = first = 0.0
    for low, high, width in ((y0, min(y1, middle), b * (1 - psi)), (max(y0, middle), y1, b * (1 + psi))):
        if high > low:
            p, q = low - middle, high - middle
            part = g * ((q - p) - (q**3 - p**3) / (3 * width**2))
            zeroth += part
            first += g * ((q**2 - p**2) / 2 - (q**4 - p**4) / (4 * width**2)) + middle * part
    return zeroth, first


def patch_panels(g, psi, n, ny):
    """Return `PatchPanels`: ``ny`` strips of ``n`` panels on the patch of g = a/b, shape number psi, abs(psi) < 1."""
    edges = np.linspace(-1, 1, SUB_STRIPS * ny + 1) / np.sqrt(g)
    moments = np.array([_moments_of_squared_length(*pair, g, psi) for pair in zip(edges[:-1], edges[1:], strict=True)])
    load = 0.75 / np.sqrt(g) * moments[:, 0]
    strip_load = load.reshape(ny, SUB_STRIPS).sum(axis=1)
    share = load / np.repeat(strip_load, SUB_STRIPS)
    half_length = np.sqrt(moments[:, 0] / np.diff(edges))
    y_line = moments[:, 1] / moments[:, 0]

    along = make_panels(n, _LEAD)
    mean_length = (share * half_length).reshape(ny, SUB_STRIPS).sum(axis=1)
    y_strip = (share * y_line).reshape(ny, SUB_STRIPS).sum(axis=1)
    return PatchPanels(
        n, ny, edges, half_length, y_line, share, np.outer(strip_load, along.share).ravel(),
        np.outer(mean_length, along.slip).ravel(), np.outer(mean_length, along.load).ravel(), np.repeat(y_strip, n),
        along,
    )  # fmt: skip


@jit
def _displacement_row(dx0, half_length, cosines, y_far, y_near, nu, out):
    """Fill ``out`` with displacements (uxx, uyy, uxy) at one point by unit forces on each panel of one sub-strip.

    The panel has x edges ``half_length cosines`` and lies between y_far and y_near (both relative to the point, the
    first one larger); dx0 is the point's x. With u = 1/pi int K tau and
    Kxx = 1/R - nu y^2/R^3, Kyy = 1/R - nu x^2/R^3, Kxy = nu x y/R^3 the indefinite integrals over a rectangle are
    Ixx = (1-nu) x asinh(y/|x|) + y asinh(x/|y|), Iyy = x asinh(y/|x|) + (1-nu) y asinh(x/|y|), Ixy = -nu R."""
    log_far, log_near = np.log(abs(y_far)), np.log(abs(y_near))
    before_x = before_y = before_r = 0.0
    for k in range(cosines.size):
        x = half_length * cosines[k] - dx0
        r_far = np.sqrt(x * x + y_far * y_far)
        r_near = np.sqrt(x * x + y_near * y_near)
        if y_near > 0:
            ratio = (y_far + r_far) / (y_near + r_near)
        elif y_far < 0:
            ratio = (r_near - y_near) / (r_far - y_far)
        else:
            ratio = (y_far + r_far) * (r_near - y_near) / (x * x + 1e-300)
        in_x = x * np.log(ratio)
        in_y = y_far * (np.log(abs(x) + r_far) - log_far) - y_near * (np.log(abs(x) + r_near) - log_near)
        in_y = in_y if x > 0 else -in_y
        in_r = r_far - r_near
        if k > 0:
            scale = 1 / (np.pi * half_length * (cosines[k - 1] - cosines[k]) * (y_far - y_near))
            dx, dy = (before_x - in_x) * scale, (before_y - in_y) * scale
            out[k - 1, 0] = (1 - nu) * dx + dy
            out[k - 1, 1] = dx + (1 - nu) * dy
            out[k - 1, 2] = -nu * (before_r - in_r) * scale
        before_x, before_y, before_r = in_x, in_y, in_r


@jit
def _slip_matrix(panels, nu, rows):
    """Slip in the first ``rows`` strips by unit panel forces: (rows n, N, 3) with components xx, yy, xy."""
    n, ny, points = panels.n, panels.ny, panels.along.points
    matrix = np.zeros((rows * n, ny * n, 3))
    now, last = np.empty((n, 3)), np.empty((n, 3))
    for line in range(SUB_STRIPS * rows):
        y, length = panels.y_line[line], panels.half_length[line]
        row = (line // SUB_STRIPS) * n
        for sub in range(SUB_STRIPS * ny):
            weight = panels.share[line] * panels.share[sub]
            column = (sub // SUB_STRIPS) * n
            y_far, y_near = panels.y_edge[sub + 1] - y, panels.y_edge[sub] - y
            for k in range(n + 1):
                x = length * points[k]
                _displacement_row(x, panels.half_length[sub], panels.along.edges, y_far, y_near, nu, now)
                if k > 0:
                    factor = weight / (length * (points[k - 1] - points[k]))
                    for m in range(n):
                        for part in range(3):
                            matrix[row + k - 1, column + m, part] += factor * (now[m, part] - last[m, part])
                now, last = last, now
    return matrix


def slip_matrix(panels, nu, rows=None):
    """Slip at the panels of the first ``rows`` strips by unit forces, s = w - du/dx with w = 0.

    Returns axx, ayy and axy, each (rows n, N). axy is both the x slip by forces in y and the y slip by forces in x."""
    return tuple(np.moveaxis(_slip_matrix(panels, float(nu), rows or panels.ny), 2, 0))


def _resolvent(block, step):
    """Return the transpose of ``(H + A)^-1 H = (I + H^-1 A)^-1`` in float32."""
    from scipy.linalg import get_lapack_funcs  # takes 0.1 s; imported here, as a table on disk does not need it

    matrix = block / np.concatenate([step, step])[:, None]
    matrix[np.diag_indices_from(matrix)] += 1
    matrix = np.asfortranarray(matrix, dtype=np.float32)
    getrf, getri = get_lapack_funcs(("getrf", "getri"), (matrix,))
    factors, pivots, _ = getrf(matrix, overwrite_a=True)
    inverse, _ = getri(factors, pivots, lwork=64 * len(matrix), overwrite_lu=True)
    return np.ascontiguousarray(inverse.T)


def _mirrored(block, n):
    """Split columns into those of y < 0, and those of y > 0 with their strips in mirrored order."""
    half = block.shape[1] // 2
    other = block[:, half:].reshape(block.shape[0], -1, n)[:, ::-1].reshape(block.shape[0], -1)
    return block[:, :half], other


def stuck_forces(panels, nu, symmetric, precision=np.float64):
    """Return the influence matrix A in blocks, and the panel forces (3, 2 N) by unit xi', eta', phi' in full adhesion.

    For psi = 0 (``symmetric``) there are two blocks, on (Fx even, Fy odd) and (Fx odd, Fy even) in y. Otherwise there
    is one. In full adhesion A F = -w."""
    n, rows = panels.n, panels.ny // 2 if symmetric else panels.ny
    size = rows * n
    zero, one, spin = np.zeros(size), np.ones(size), (-panels.y[:size], panels.x_slip[:size])
    rigid = np.block([[one, zero], [zero, one], [*spin]])
    axx, ayy, axy = slip_matrix(panels, nu, rows)
    if not symmetric:
        blocks, rights = [np.block([[axx, axy], [axy, ayy]])], [rigid]
    else:
        (xx, xx_m), (yy, yy_m), (xy, xy_m) = (_mirrored(block, n) for block in (axx, ayy, axy))
        even = np.block([[xx + xx_m, xy - xy_m], [xy + xy_m, yy - yy_m]])
        blocks, rights = [even, np.block([[xx - xx_m, xy + xy_m], [xy - xy_m, yy + yy_m]])], [rigid[:1], rigid[1:]]
    pairs = zip(blocks, rights, strict=True)
    parts = [np.linalg.solve(block.astype(precision), -right.T.astype(precision)).T for block, right in pairs]
    stuck = np.concatenate(parts).reshape(3, 2, rows, n)
    if symmetric:
        sign = np.array([[1, -1], [-1, 1], [-1, 1]], precision)[:, :, None, None]
        stuck = np.concatenate([stuck, sign * stuck[:, :, ::-1]], axis=2)
    return blocks, stuck.reshape(3, -1)


def resultants(panels, force):
    """Resultants fx, fy, mz (last axis) of panel forces (..., 2 N); ``panels`` may be an `Operator`."""
    fx, fy = np.split(force, 2, axis=-1)
    return np.stack([fx.sum(axis=-1), fy.sum(axis=-1), fy @ panels.x_force - fx @ panels.y], axis=-1)


def make_operator(g, psi, nu, n, ny):
    """Return the `Operator` of the patch of g = a/b, shape number psi and Poisson's ratio nu.

    The patch has an even number ``ny`` of strips with ``n`` panels each."""
    panels = patch_panels(g, psi, n, ny)
    symmetric = psi == 0
    blocks, stuck = stuck_forces(panels, nu, symmetric, np.float32)
    axx, ayy = np.split(np.mean([np.diagonal(block) for block in blocks], axis=0), 2)
    step = STEP_SCALE * np.sqrt(axx * ayy)
    resolvents = [_resolvent(block, step) for block in blocks]
    if symmetric:
        step = np.concatenate([step, step.reshape(-1, n)[::-1].ravel()])
    else:
        resolvents.append(np.empty((0, 0), np.float32))
    rigid = panels.x_force - panels.x_slip
    weights = np.tile(panels.along.ahead, ny), np.tile(panels.along.behind, ny)
    vectors = (stuck, step, 1 / step, panels.bound, panels.x_slip, panels.x_force, panels.y, *weights, rigid)
    return Operator(n, ny, symmetric, *resolvents, *(np.float32(v) for v in vectors))
