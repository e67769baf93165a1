"""Exact steady rolling contact on the half-space: the creep force of an elliptic or SDEC patch.

Coulomb friction with a constant coefficient and a given normal pressure: in each panel either the slip s vanishes and
the traction is below its bound, or the traction is at the bound and opposes the slip (Kalker's conditions, the ones
that CONTACT solves). With panel forces F and bounds G this is the variational inequality

    find |F| <= G :   (A F + w) . (F' - F) >= 0   for all |F'| <= G,

A from `operator`, w the rigid slip. It is solved by Douglas-Rachford splitting between the projection P on the disks and
the resolvent of A, factorised once per patch:

    F = P(z),   y = M (2 F - z - (w + delta)/h),   z <- z + rho (y - F),   M = (H + A)^-1 H,

which converges for every rho in (0, 2) because the symmetric part of A is positive definite. A panel's slip holds half a
panel ahead of its load. That is second-order accurate where the panel sticks, but in sliding panels the direction of
the traction must follow the slip at the load: delta carries the slip there (rigid part exactly, elastic part by
differences along the strip) and lags one iteration behind.

References
----------
Kalker, Three-Dimensional Elastic Bodies in Rolling Contact (1990), sections 3.2, 4.3.
Lions and Mercier, SIAM J. Numer. Anal. 16 (1979) 964, algorithm II (Douglas-Rachford splitting).
Eckstein and Bertsekas, Math. Programming 55 (1992) 293 (relaxation rho).
"""

from dataclasses import dataclass

import numpy as np

from wrcore._jit import jit
from wrcore.creep.operator import make_operator, panel_counts

DEFAULT_LEVEL = 20
TOLERANCE = 1e-3
MAX_ITERATIONS = 200
BATCH = 64
REFILL_EVERY = 4

_ONE = np.float32(1)
_RHO = np.float32(1.8)
_RAMP = np.float32(10)
_TINY = np.float32(1e-30)


@jit
def _project(z, bound, force):
    """F = P(z): scale each two-vector (z_i, z_{i+N}) back to its disk of radius bound_i."""
    size = bound.size
    for i in range(size):
        norm = np.sqrt(z[i] * z[i] + z[i + size] * z[i + size]) + _TINY
        scale = min(_ONE, bound[i] / norm)
        force[i] = scale * z[i]
        force[i + size] = scale * z[i + size]


@jit
def _rigid_slip(op, creepage, x, slip):
    """w = (ux - phi y, uy + phi x) at the panels' points x."""
    ux, uy, phi = np.float32(creepage[0]), np.float32(creepage[1]), np.float32(creepage[2])
    size = op.bound.size
    for i in range(size):
        slip[i] = ux - phi * op.y[i]
        slip[i + size] = uy + phi * x[i]


@jit
def _shift_slip(op, phi, z, force, slip, delta, elastic, relaxation):
    """Move delta towards the change of slip between x_slip and x_force in the sliding panels."""
    size, n = op.bound.size, op.n
    for component in range(2):
        start = component * size
        for i in range(size):
            j = start + i
            elastic[i] = op.step[i] * (force[j] - z[j]) - delta[j] - slip[j]
        for strip in range(op.ny):
            for k in range(n):
                i = strip * n + k
                gain = np.float32(0)
                if k > 0:
                    gain += op.ahead[k] * (elastic[i] - elastic[i - 1])
                if k < n - 1:
                    gain += op.behind[k] * (elastic[i + 1] - elastic[i])
                if component == 1:
                    gain += phi * (op.x_force[i] - op.x_slip[i])
                over = np.sqrt(z[i] * z[i] + z[i + size] * z[i + size]) / op.bound[i] - _ONE
                gain *= min(_ONE, max(np.float32(0), over * _RAMP))
                delta[start + i] += relaxation * (gain - delta[start + i])


@jit
def _apply_resolvent(op, rows, half_rows, out_rows, out):
    """out = M rows for each row (a case); by mirror halves where the operator is symmetric."""
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
    """(fx, fy, mz) of panel forces, moment about the origin."""
    size = op.bound.size
    fx = fy = mz = 0.0
    for i in range(size):
        fx += force[i]
        fy += force[i + size]
        mz += op.x_force[i] * force[i + size] - op.y[i] * force[i]
    result[0], result[1], result[2] = fx, fy, mz


@jit
def solve_rows(op, creepages, tolerance, max_iterations, batch, results, iterations, traction, slip_out):
    """Solve all rows of ``creepages``; kernel behind `RollingContact`.

    Up to ``batch`` cases are iterated together so that the resolvent is a matrix product; a case that has converged
    makes room for the next one.

    Parameters
    ----------
    op : Operator
    creepages : (K, 3) ux', uy', phi'.
    tolerance : float
        Stop when the sum over panels of abs(y - F), in units of mu N, is below.
    max_iterations, batch : int
    results : (K, 3), written: fx, fy, mz.
    iterations : (K,) int, written; negative where the tolerance was not met.
    traction, slip_out : (K or 0, 2 N) float32, written where not empty: panel forces and slip.
    """
    cases, size = creepages.shape[0], op.bound.size
    width = min(batch, cases)
    shape, half_shape = (width, 2 * size), (width, size)
    z, force, delta = np.zeros(shape, np.float32), np.zeros(shape, np.float32), np.zeros(shape, np.float32)
    rhs, y, slip = np.zeros(shape, np.float32), np.zeros(shape, np.float32), np.zeros(shape, np.float32)
    half_rows, out_rows = np.zeros(half_shape, np.float32), np.zeros(half_shape, np.float32)
    elastic = np.empty(size, np.float32)
    case, count = np.empty(width, np.int64), np.zeros(width, np.int64)
    waiting, active = width, width
    for row in range(width):
        case[row] = row
        _rigid_slip(op, creepages[row], op.x_slip, slip[row])
    while active > 0:
        for _ in range(1 if width == 1 else REFILL_EVERY):
            for row in range(active):
                _project(z[row], op.bound, force[row])
                for i in range(size):
                    inverse = _ONE / op.step[i]
                    for j in (i, i + size):
                        rhs[row, j] = 2 * force[row, j] - z[row, j] - (slip[row, j] + delta[row, j]) * inverse
            _apply_resolvent(op, rhs[:active], half_rows[:active], out_rows[:active], y[:active])
            for row in range(active):
                count[row] += 1
                for j in range(2 * size):
                    z[row, j] += _RHO * (y[row, j] - force[row, j])
                if count[row] < 32:
                    relaxation = np.float32(0.6) if count[row] < 20 else np.float32(0.15)
                    phi = np.float32(creepages[case[row], 2])
                    _shift_slip(op, phi, z[row], force[row], slip[row], delta[row], elastic, relaxation)
        row = 0
        while row < active:
            change = np.float32(0)
            for j in range(2 * size):
                change += abs(y[row, j] - force[row, j])
            if change > tolerance and count[row] < max_iterations:
                row += 1
                continue
            done = case[row]
            _resultant(op, force[row], results[done])
            iterations[done] = count[row] if change <= tolerance else -count[row]
            if traction.shape[0] > 0:
                traction[done] = force[row]
                for j in range(2 * size):
                    slip_out[done, j] = op.step[j % size] * (force[row, j] - z[row, j])
            if waiting < cases:
                case[row], count[row] = waiting, 0
                z[row], delta[row] = np.float32(0), np.float32(0)
                _rigid_slip(op, creepages[waiting], op.x_slip, slip[row])
                waiting += 1
                row += 1
            else:
                active -= 1
                z[row], delta[row], slip[row], y[row] = z[active], delta[active], slip[active], y[active]
                force[row] = force[active]
                case[row], count[row] = case[active], count[active]


@dataclass(frozen=True)
class ContactField:
    """Traction, slip and adhesion over the panels of one case, for plots (nondimensional, see `RollingContact`).

    Attributes
    ----------
    x, y : (N,) ndarray
        Load points of the panels over c.
    x_edges : (ny, n + 1) ndarray, y_edges : (ny + 1,) ndarray
        Outlines of the panels over c.
    px, py, bound : (N,) ndarray
        Mean traction of a panel and its bound, times c^2/(mu N).
    sx, sy : (N,) ndarray
        Slip (wheel minus rail), times G c^2/(mu N); zero where ``stick``.
    stick : (N,) ndarray of bool
    fx, fy, mz : float
        Resultants over mu N and mu N c.
    """

    x: np.ndarray
    y: np.ndarray
    x_edges: np.ndarray
    y_edges: np.ndarray
    px: np.ndarray
    py: np.ndarray
    bound: np.ndarray
    sx: np.ndarray
    sy: np.ndarray
    stick: np.ndarray
    fx: float
    fy: float
    mz: float


class RollingContact:
    """A patch discretised and factorised once, ready for any number of creepages.

    Creepages and forces are nondimensional: ux' = ux G c^2/(mu N), uy' the same, phi' = phi G c^3/(mu N) with
    c = sqrt(a b); fx = Fx/(mu N), fy, mz = Mz/(mu N c).

    Parameters
    ----------
    g : float
        a/b > 0.
    psi : float
        Shape number of the SDEC patch, abs(psi) < 1; 0 is the ellipse.
    nu : float
        Poisson's ratio of both bodies, 0 to 0.5.
    level : int
        About ``level**2`` panels.

    Examples
    --------
    >>> patch = RollingContact(g=1.0, psi=0.0, nu=0.28, level=12)
    >>> fx, fy, mz = patch.solve(0.1, 0.0, 0.0)
    >>> bool(-0.36 < fx < -0.33 and abs(fy) < 1e-3)
    True
    """

    def __init__(self, g, psi=0.0, nu=0.28, level=DEFAULT_LEVEL):
        self.g, self.psi, self.nu, self.level = float(g), float(psi), float(nu), level
        self.n, self.ny = panel_counts(self.g, level)
        self.operator = make_operator(self.g, self.psi, self.nu, self.n, self.ny)

    def solve(self, ux, uy, phi, tolerance=TOLERANCE):
        """Creep forces of one case or of arrays of cases.

        Parameters
        ----------
        ux, uy, phi : float or (K,) array_like
            Nondimensional creepages.
        tolerance : float
            Remaining change of the traction, in units of mu N.

        Returns
        -------
        fx, fy, mz : float or (K,) ndarray
        """
        creepages = _rows(ux, uy, phi)
        results, _ = self.solve_many(creepages, tolerance)
        shape = np.broadcast_shapes(np.shape(ux), np.shape(uy), np.shape(phi))
        return tuple(column.reshape(shape)[()] for column in results.T)

    def solve_many(self, creepages, tolerance=TOLERANCE):
        """Creep forces (K, 3) and iteration counts (K,) for creepages (K, 3); a negative count did not converge."""
        results, iterations, empty = np.empty((len(creepages), 3)), np.empty(len(creepages), np.int64), _no_rows()
        solve_rows(self.operator, creepages, tolerance, MAX_ITERATIONS, BATCH, results, iterations, empty, empty)
        return results, iterations

    def field(self, ux, uy, phi, tolerance=TOLERANCE / 10):
        """Traction and slip over the patch for one case.

        Returns
        -------
        ContactField
        """
        size = self.n * self.ny
        force, slip = np.empty((2, 1, 2 * size), np.float32)
        result, count = np.empty((1, 3)), np.empty(1, np.int64)
        solve_rows(self.operator, _rows(ux, uy, phi), tolerance, MAX_ITERATIONS, 1, result, count, force, slip)
        return _field(self, force[0].astype(float), slip[0].astype(float), result[0])


def _rows(ux, uy, phi):
    return np.ascontiguousarray(np.stack(np.broadcast_arrays(ux, uy, phi), axis=-1).reshape(-1, 3), dtype=float)


def _no_rows():
    return np.empty((0, 0), np.float32)


def _field(contact, force, slip, result):
    """Divide panel forces by panel areas and lay out the outlines."""
    op, n, ny = contact.operator, contact.n, contact.ny
    size = n * ny
    y_edges = np.linspace(-1, 1, ny + 1) / np.sqrt(contact.g)
    slip_point = 0.75 - np.cos(np.pi / (2 * n)) / 2 + np.cos(np.pi / (2 * n)) / 2
    half_length = op.x_slip.astype(float).reshape(ny, n)[:, 0]
    first = (2 - np.cos(np.pi / (2 * n)) + np.cos(np.pi / (2 * n))) / 2
    del slip_point
    x_edges = np.outer(half_length / first, np.cos(np.pi * np.arange(n + 1) / n))
    area = (-np.diff(x_edges, axis=1) * np.diff(y_edges)[:, None]).ravel()
    bound = op.bound.astype(float)
    magnitude = np.hypot(force[:size], force[size:])
    return ContactField(
        op.x_force.astype(float), op.y.astype(float), x_edges, y_edges,
        force[:size] / area, force[size:] / area, bound / area, slip[:size], slip[size:],
        magnitude < 0.9999 * bound, *result,
    )  # fmt: skip


def solve_field(g, psi, nu, ux, uy, phi, level=DEFAULT_LEVEL):
    """Traction, slip and adhesion of one case from scratch: ``RollingContact(...).field(...)``."""
    return RollingContact(g, psi, nu, level).field(ux, uy, phi)
