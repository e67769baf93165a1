"""Exact steady rolling contact on the half-space: the creep force of an elliptic or SDEC patch.

Coulomb friction with a constant coefficient and a given normal pressure: in each panel either the slip s vanishes and
the traction is below its bound, or the traction is at the bound and opposes the slip (Kalker's conditions, the ones
that CONTACT solves). With panel forces F and bounds G this is the variational inequality

    find |F| <= G :   (A F + w) . (F' - F) >= 0   for all |F'| <= G,

with A from `wrcore.contact.rolling.ellipse_influence` and the rigid slip w. It is solved by Douglas-Rachford splitting
between the projection P on the disks and the resolvent of A, inverted once per patch:

    F = P(z),   y = M (2 F - z - (w + delta)/h),   z <- z + rho (y - F),   M = (H + A)^-1 H,

which converges for every rho in (0, 2) because the symmetric part of A is positive definite. The start is full
adhesion, A F = -w, which for small creepages is the solution except at the trailing edge. Where it exceeds the bound,
panels start with sliding. The iteration ends on a change relative to the traction. The slip of a panel is evaluated
half a panel ahead of its load, which is second-order accurate in adhesion. In sliding panels the traction must oppose
the slip at the load: delta is the change of slip from slip point to load point (rigid part exact, elastic part by
differences in the strip), and lags one iteration behind.

References
----------
Kalker, Three-Dimensional Elastic Bodies in Rolling Contact (1990), sections 3.2, 4.3.
Lions and Mercier, SIAM J. Numer. Anal. 16 (1979) 964, algorithm II (Douglas-Rachford splitting).
Eckstein and Bertsekas, Math. Programming 55 (1992) 293 (relaxation rho).
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from wrcore.contact.rolling.ellipse_influence import make_operator, panel_counts, resultants
from wrcore.errors import InputError, check_number
from wrcore.errors.checked_calls import ABOVE_ZERO, checked, same_shape
from wrcore.kernels.jit import jit

DEFAULT_LEVEL = 22
TOLERANCE = 1e-3
MAX_ITERATIONS = 200
BATCH = 256
_LARGEST_PSI = 1.0 - 1e-6
FAST = 100.0

_ZERO, _ONE, _TWO = np.float32(0), np.float32(1), np.float32(2)
_RHO = np.float32(1.8)
_RAMP = np.float32(10)
_TINY = np.float32(1e-30)


@jit
def _project(z, bound, force, ramp):
    """Fill F = P(z), with vectors (z_i, z_{i+N}) scaled back to their bounds, and ``ramp``: 0 adhesion, 1 sliding."""
    size = bound.size
    for i in range(size):
        ratio = np.sqrt(z[i] * z[i] + z[i + size] * z[i + size]) / bound[i]
        scale = _ONE / max(_ONE, ratio)
        force[i] = scale * z[i]
        force[i + size] = scale * z[i + size]
        ramp[i] = min(_ONE, max(_ZERO, (ratio - _ONE) * _RAMP))


@jit
def _start(op, creepage, slip, z):
    """Fill the rigid slip w = (xi - phi y, eta + phi x) at the slip points, and the start z from full adhesion. Let r
    be bound over force. If r < 1, z is r times this force minus (1 - r) w/h: the solution for fast sliding."""
    xi, eta, phi = np.float32(creepage[0]), np.float32(creepage[1]), np.float32(creepage[2])
    stuck, size = op.stuck, op.bound.size
    for i in range(size):
        k = i + size
        slip[i], slip[k] = xi - phi * op.y[i], eta + phi * op.x_slip[i]
        fx = xi * stuck[0, i] + eta * stuck[1, i] + phi * stuck[2, i]
        fy = xi * stuck[0, k] + eta * stuck[1, k] + phi * stuck[2, k]
        share = _ONE / max(_ONE, np.sqrt(fx * fx + fy * fy) / op.bound[i])
        beyond = (_ONE - share) * op.inverse_step[i]
        z[i], z[k] = share * fx - beyond * slip[i], share * fy - beyond * slip[k]


@jit
def _slowed(creepage, slow):
    """Fill ``slow`` with a creepage, reduced to at most FAST; return the factor of the reduction."""
    factor = max(1.0, max(abs(creepage[0]), abs(creepage[1]), abs(creepage[2])) / FAST)
    for i in range(3):
        slow[i] = creepage[i] / factor
    return factor


@jit
def _to_faster(op, creepage, factor, result):
    """Convert ``result``, the force at a reduced creepage, to the force at ``factor`` times this creepage. In full
    sliding the difference to the force of pure rigid slip decreases as 1/factor."""
    xi, eta, phi = creepage[0], creepage[1], creepage[2]
    fx = fy = mz = 0.0
    size = op.bound.size
    for i in range(size):
        sx, sy = xi - phi * op.y[i], eta + phi * op.x_force[i]
        traction = op.bound[i] / np.sqrt(sx * sx + sy * sy + 1e-30)
        fx -= traction * sx
        fy -= traction * sy
        mz -= traction * (op.x_force[i] * sy - op.y[i] * sx)
    result[0] = fx + (result[0] - fx) / factor
    result[1] = fy + (result[1] - fy) / factor
    result[2] = mz + (result[2] - mz) / factor


@jit
def _elastic_slip(step, force, z, delta, slip, elastic):
    """Fill the elastic slip, -h (z - F) - delta - w, of one component; ``elastic`` has an extra point at either end."""
    for i in range(step.size):
        elastic[i + 1] = step[i] * (force[i] - z[i]) - delta[i] - slip[i]


@jit
def _shift_slip(ahead, behind, rigid, phi, ramp, relaxation, elastic, delta):
    """Relax delta towards the change of slip between x_slip and x_force, in the sliding panels, of one component."""
    for i in range(ahead.size):
        gain = ahead[i] * (elastic[i + 1] - elastic[i]) + behind[i] * (elastic[i + 2] - elastic[i + 1])
        delta[i] += relaxation * (ramp[i] * (gain + phi * rigid[i]) - delta[i])


@jit
def _right_hand_side(inverse_step, force, z, slip, delta, rhs):
    """Fill ``rhs`` with 2 F - z - (w + delta)/h of one component."""
    for i in range(inverse_step.size):
        rhs[i] = _TWO * force[i] - z[i] - (slip[i] + delta[i]) * inverse_step[i]


@jit
def _before_resolvent(op, phi, count, z, slip, delta, force, rhs, ramp, elastic):
    """Project one case, update its delta, and fill the right-hand side of the resolvent."""
    size = op.bound.size
    _project(z, op.bound, force, ramp)
    relaxation = np.float32(0.6) if count < 20 else np.float32(0.15)
    for start in (0, size):
        part = slice(start, start + size)
        if count < 32:
            _elastic_slip(op.step, force[part], z[part], delta[part], slip[part], elastic)
            spin = phi if start > 0 else _ZERO
            _shift_slip(op.ahead, op.behind, op.rigid, spin, ramp, relaxation, elastic, delta[part])
        _right_hand_side(op.inverse_step, force[part], z[part], slip[part], delta[part], rhs[part])


@jit
def _update(y, force, z):
    """Add rho (y - F) to z; return the sum of abs(y - F) over that of abs(F)."""
    change, total = _ZERO, _TINY
    for j in range(z.size):
        move = y[j] - force[j]
        z[j] += _RHO * move
        change += abs(move)
        total += abs(force[j])
    return change / total


@jit
def _apply_resolvent(op, rows, half_rows, out_rows, out):
    """Fill ``out`` with M times each row (a case); for a symmetric operator, by its even and odd halves."""
    cases, size = rows.shape[0], op.bound.size
    if not op.symmetric:
        np.dot(rows, op.resolvent, out)
        return
    half, n, ny = size // 2, op.n, op.ny
    for parity in range(2):
        sign = np.float32(1 - 2 * parity)
        for c in range(cases):
            for strip in range(ny // 2):
                low, high = strip * n, (ny - 1 - strip) * n
                for k in range(n):
                    half_rows[c, low + k] = rows[c, low + k] + sign * rows[c, high + k]
                    half_rows[c, half + low + k] = rows[c, size + low + k] - sign * rows[c, size + high + k]
        block = op.resolvent if parity == 0 else op.resolvent_odd
        np.dot(half_rows, block, out_rows)
        for c in range(cases):
            for strip in range(ny // 2):
                low, high = strip * n, (ny - 1 - strip) * n
                for k in range(n):
                    fx = np.float32(0.5) * out_rows[c, low + k]
                    fy = np.float32(0.5) * out_rows[c, half + low + k]
                    if parity == 0:
                        out[c, low + k], out[c, high + k] = fx, fx
                        out[c, size + low + k], out[c, size + high + k] = fy, -fy
                    else:
                        out[c, low + k] += fx
                        out[c, high + k] -= fx
                        out[c, size + low + k] += fy
                        out[c, size + high + k] += fy


@jit
def _resultant(op, force, result):
    """Fill ``result`` with fx, fy, mz of panel forces, moment about the origin."""
    size = op.bound.size
    fx = fy = mz = 0.0
    for i in range(size):
        fx += force[i]
        fy += force[i + size]
        mz += op.x_force[i] * force[i + size] - op.y[i] * force[i]
    result[0], result[1], result[2] = fx, fy, mz


@jit
def solve_rows(op, creepages, tolerance, max_iterations, batch, results, iterations, traction, slip_out):
    """Solve for K rows of ``creepages`` (xi', eta', phi'): fill ``results`` (K, 3) with fx, fy, mz, ``iterations``
    (K,), negative where the tolerance was not met, and, unless empty, panel forces and slip (K, 2 N).

    A case ends when the sum over panels of abs(y - F) is at most ``tolerance`` times that of abs(F). Up to ``batch``
    cases are iterated together, so that the resolvent is a matrix product; the next case replaces a converged one."""
    cases, size = creepages.shape[0], op.bound.size
    width = min(batch, cases)
    shape, half_shape = (width, 2 * size), (width, size)
    z, force, delta = np.zeros(shape, np.float32), np.zeros(shape, np.float32), np.zeros(shape, np.float32)
    rhs, y, slip = np.zeros(shape, np.float32), np.zeros(shape, np.float32), np.zeros(shape, np.float32)
    half_rows, out_rows = np.zeros(half_shape, np.float32), np.zeros(half_shape, np.float32)
    elastic, ramp, change = np.zeros(size + 2, np.float32), np.empty(size, np.float32), np.zeros(width, np.float32)
    case, count = np.empty(width, np.int64), np.zeros(width, np.int64)
    slow, factor = np.empty((width, 3)), np.ones(width)
    waiting, active = width, width
    for row in range(width):
        case[row] = row
        factor[row] = _slowed(creepages[row], slow[row])
        _start(op, slow[row], slip[row], z[row])
    while active > 0:
        for row in range(active):
            phi = np.float32(slow[row, 2])
            _before_resolvent(op, phi, count[row], z[row], slip[row], delta[row], force[row], rhs[row], ramp, elastic)
            count[row] += 1
        _apply_resolvent(op, rhs[:active], half_rows[:active], out_rows[:active], y[:active])
        for row in range(active):
            change[row] = _update(y[row], force[row], z[row])
        row = 0
        while row < active:
            if change[row] > tolerance and count[row] < max_iterations:
                row += 1
                continue
            done = case[row]
            _resultant(op, force[row], results[done])
            if factor[row] > 1:
                _to_faster(op, slow[row], factor[row], results[done])
            iterations[done] = count[row] if change[row] <= tolerance else -count[row]
            if traction.shape[0] > 0:
                traction[done] = force[row]
                for j in range(2 * size):
                    slip_out[done, j] = op.step[j % size] * (force[row, j] - z[row, j]) * np.float32(factor[row])
            if waiting < cases:
                case[row], count[row] = waiting, 0
                delta[row] = _ZERO
                factor[row] = _slowed(creepages[waiting], slow[row])
                _start(op, slow[row], slip[row], z[row])
                waiting += 1
                row += 1
            else:
                active -= 1
                z[row], delta[row], slip[row], y[row] = z[active], delta[active], slip[active], y[active]
                force[row], change[row] = force[active], change[active]
                case[row], count[row] = case[active], count[active]
                factor[row], slow[row] = factor[active], slow[active]


@dataclass(frozen=True)
class ContactField:
    """Traction, slip and adhesion over the panels of one case, for plots (nondimensional, see `RollingContact`)."""

    x: np.ndarray
    y: np.ndarray
    """(N,): positions of the load of the panels, over c."""
    x_edges: np.ndarray
    y_edges: np.ndarray
    """(ny, n + 1) and (ny + 1,): outlines of the panels over c."""
    px: np.ndarray
    py: np.ndarray
    bound: np.ndarray
    """(N,): mean traction of a panel and its bound, times c^2/(mu N)."""
    sx: np.ndarray
    sy: np.ndarray
    """(N,): slip (wheel minus rail), times G c^2/(mu N); zero where ``stick``."""
    stick: np.ndarray
    """(N,) bool."""
    fx: float
    fy: float
    mz: float
    """Resultants over mu N and mu N c."""


Tolerance = Annotated[float, ABOVE_ZERO]


class RollingContact:
    """Steady rolling contact of one patch, discretised once for any number of creepages.

    Creepages and forces are nondimensional: xi' = xi G c^2/(mu N), eta' = eta G c^2/(mu N), phi' = phi G c^3/(mu N)
    with c = sqrt(a b); fx = Fx/(mu N), fy = Fy/(mu N), mz = Mz/(mu N c).

    Parameters
    ----------
    g : float
        a/b > 0.
    psi : float
        Shape number of the SDEC patch, abs(psi) < 1; 0 is the ellipse.
    nu : float
        Poisson's ratio of both bodies, 0 to 0.5.
    level : int
        About ``level**2`` panels, 4 to 100.

    Raises
    ------
    InputError
        If one of these, or a creepage of a case, is no such number.

    Examples
    --------
    >>> patch = RollingContact(g=1.0, psi=0.0, nu=0.28, level=12)
    >>> fx, fy, mz = patch.solve(0.1, 0.0, 0.0)
    >>> round(float(fx), 2)
    -0.37
    """

    @checked
    def __init__(self, g: float, psi: float = 0.0, nu: float = 0.28, level: int = DEFAULT_LEVEL):
        self.g = check_number(g, 1e-6, 1e6, "RollingContact", "g")
        self.psi = check_number(psi, -_LARGEST_PSI, _LARGEST_PSI, "RollingContact", "psi")
        self.nu = check_number(nu, 0.0, 0.5, "RollingContact", "nu")
        self.level = int(check_number(level, 4, 100, "RollingContact", "level"))
        self.n, self.ny = panel_counts(self.g, self.level)
        self.operator = make_operator(self.g, self.psi, self.nu, self.n, self.ny)

    @checked
    def solve(self, xi: ArrayLike, eta: ArrayLike, phi: ArrayLike, tolerance: Tolerance = TOLERANCE):
        """Return the creep forces of one case or of arrays of cases.

        Parameters
        ----------
        xi, eta, phi : float or (K,) array_like
            Nondimensional creepages.
        tolerance : float
            Remaining change of the traction, relative to it.

        Returns
        -------
        fx, fy, mz : float or (K,) ndarray
        """
        creepages = _rows(xi, eta, phi)
        results, _ = self.solve_many(creepages, tolerance)
        shape = np.broadcast_shapes(np.shape(xi), np.shape(eta), np.shape(phi))
        return tuple(column.reshape(shape)[()] for column in results.T)

    @checked
    def solve_many(self, creepages: ArrayLike, tolerance: Tolerance = TOLERANCE):
        """Creep forces (K, 3) and iteration counts (K,) for creepages (K, 3); a negative count did not converge."""
        if np.ndim(creepages) != 2 or np.shape(creepages)[1] != 3:
            raise InputError("RollingContact", "creepages", f"expected rows of three, got {np.shape(creepages)}")
        creepages = _rows(*np.transpose(creepages))
        results, iterations = np.empty((len(creepages), 3)), np.empty(len(creepages), np.int64)
        empty = np.empty((0, 0), np.float32)
        solve_rows(self.operator, creepages, tolerance, MAX_ITERATIONS, BATCH, results, iterations, empty, empty)
        return results, iterations

    def linear_response(self):
        """Derivatives of fx, fy, mz with respect to xi', eta', phi' at zero creepage, full adhesion: (3, 3) ndarray.

        Row i belongs to output i. For the ellipse this is Kalker's matrix at this refinement."""
        return resultants(self.operator, self.operator.stuck).T.astype(float)

    @checked
    def field(self, xi: float, eta: float, phi: float, tolerance: Tolerance = TOLERANCE / 10):
        """Compute traction and slip over the patch for one case.

        Returns
        -------
        ContactField
        """
        size = self.n * self.ny
        force, slip = np.empty((2, 1, 2 * size), np.float32)
        result, count = np.empty((1, 3)), np.empty(1, np.int64)
        solve_rows(self.operator, _rows(xi, eta, phi), tolerance, MAX_ITERATIONS, 1, result, count, force, slip)
        return _field(self, force[0].astype(float), slip[0].astype(float), result[0])


def _rows(xi, eta, phi):
    rows = np.stack(same_shape("RollingContact", xi=xi, eta=eta, phi=phi), axis=-1)
    return np.ascontiguousarray(rows.reshape(-1, 3), dtype=float)


def _field(contact, force, slip, result):
    """Return the `ContactField` of panel forces: tractions by panel areas, and outlines of the panels."""
    op, n, ny = contact.operator, contact.n, contact.ny
    size = n * ny
    y_edges = np.linspace(-1, 1, ny + 1) / np.sqrt(contact.g)
    second = np.cos(np.pi / n) * np.cos(np.pi / (2 * n))  # slip point of a panel, over the half length
    half_length = op.x_slip.astype(float).reshape(ny, n)[:, 1:2] / second
    x_edges = half_length * np.cos(np.pi * np.arange(n + 1) / n)
    area = (-np.diff(x_edges, axis=1) * np.diff(y_edges)[:, None]).ravel()
    bound = op.bound.astype(float)
    magnitude = np.hypot(force[:size], force[size:])
    return ContactField(
        op.x_force.astype(float), op.y.astype(float), x_edges, y_edges,
        force[:size] / area, force[size:] / area, bound / area, slip[:size], slip[size:],
        magnitude < 0.9999 * bound, *result,
    )  # fmt: skip
