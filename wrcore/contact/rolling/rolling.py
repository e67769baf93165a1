"""Steady rolling of a contact patch of any shape that is given as strips along the rolling direction.

Coulomb friction, equal materials, half-space; pressure given, in each strip p = peak sqrt(1 - ((x - middle)/a)^2). In
each panel of a strip (see `influence`) either the slip is 0 and the traction is below its bound, or the traction is at
the bound and opposes the slip. With panel forces F, their bounds and the rigid slip w this is the variational
inequality of `wrcore.contact.rolling.ellipse`. It is also solved by Douglas-Rachford splitting,

    F = P(z),   bracket = 2 F - z - (w + delta)/h,   y = (I + B)^-1 bracket,   z <- z + rho (y - F),   B = H^-1 A,

where delta is the change of slip from a sliding panel's slip point to its load point. In a simulation each patch has a
new shape, and inverting I + B would be slow. M is the inverse for a similar shape: an ellipse from a library (see
`library`), one for each of two sub-patches; or I + B without distant strips. The difference lags one iteration behind,

    r <- bracket - B y + (r - y),   y = M r,

where r - y = (M^-1 - I) y. The fixed point depends on B, not on M. The number of iterations is fixed, so that the
result is a smooth function of the inputs; it does not depend on earlier calls.

References
----------
Kalker, Three-Dimensional Elastic Bodies in Rolling Contact (1990), sections 3.2, 4.3.
Lions and Mercier, SIAM J. Numer. Anal. 16 (1979) 964, algorithm II (Douglas-Rachford splitting).
"""

from typing import NamedTuple

import numpy as np

from wrcore.contact.rolling.influence import StripLayout, assemble, lay_out, second_window
from wrcore.contact.rolling.resolvent import factorise, multiply, substitute, take_from_library
from wrcore.kernels.jit import FUSED, jit

AUTO, LIBRARY, BAND, DIRECT = range(4)
FASTEST = 100.0
"""Maximum rigid slip in the iteration, over mu N/(G c^2); larger slips are scaled down."""

LIMIT = 0.03
"""Residual, over the traction, above which the solution is repeated with the factors of the full matrix."""

DIRECT_ITERATIONS = 40

_ZERO, _ONE, _TWO = np.float32(0), np.float32(1), np.float32(2)
_RHO = np.float32(1.6)
_RAMP = np.float32(10)
_TINY = np.float32(1e-30)

LENGTH, LOAD, BOUND, TO_UNIT, USED = range(5)


class Level(NamedTuple):
    """Resolution of the tangential problem."""

    strips: int
    """Number of strips of a window, across."""
    panels: int
    """Number of panels of a strip, in the rolling direction; even."""
    iterations: int
    """Fixed number of iterations with the resolvent of a similar shape."""
    reach: int
    """Half bandwidth of B in strips, |i - j| <= reach, used if no ellipse is similar."""


LEVELS = {
    "coarse": Level(8, 8, 10, 3),
    "middle": Level(12, 10, 12, 4),
    "fine": Level(16, 12, 16, 5),
    "slender": Level(8, 20, 24, 4),
}
"""Resolutions by name. Force errors over mu N on ellipses and SDEC patches, 95 % of random cases: 0.8, 0.6, 0.5 % for
a/b from 0.2 to 3, and 1 % for ``slender`` (a/b from 4 to 20). Slender patches need more panels along x, because spin
turns the slip along x. At small creepages the result is within 0.3 % of that for full adhesion; the spin moment of
slender patches converges last."""


class RollingWork(NamedTuple):
    """Work arrays of one solution at a time (one set per thread), float32 except ``strip`` and ``scale``.

    Sizes are for up to M strips of n panels, m = 2 n M unknowns."""

    matrix: np.ndarray
    factors: np.ndarray
    """(m m,): B by rows is ``matrix``; ``factors`` is the resolvent or the factors of I + B."""
    corner: np.ndarray
    """(4, (n+1)^2): distances of points and edges, and the three integrals at them."""
    slip: np.ndarray
    """(3, n (n + 1)): slip of one strip by forces on another, components xx, ss, xs."""
    strip: StripLayout
    scale: np.ndarray
    """(5,): LENGTH c (m), LOAD N (N), BOUND mu N (N), TO_UNIT G c^2/(mu N), USED: the method of the last solution."""
    bound: np.ndarray
    step: np.ndarray
    z: np.ndarray
    force: np.ndarray
    y: np.ndarray
    r: np.ndarray
    product: np.ndarray
    rigid: np.ndarray
    shift: np.ndarray
    delta: np.ndarray
    ramp: np.ndarray
    """Vectors of the iteration: the first two (m,), the others (K, m) for K slips at once. For each strip, component x
    of its panels, then component s."""
    elastic: np.ndarray
    """(n + 2,): elastic slip on a strip, with a 0 at either end."""
    slowed: np.ndarray
    residual: np.ndarray
    """(K,): divisors of the slips are ``slowed``; residuals."""


def rolling_work(strips, n, slips=1):
    """Return a `RollingWork` for up to ``strips`` strips (of all windows together) of ``n`` panels, and for ``slips``
    slips at once."""
    m = 2 * n * strips
    vectors = [np.zeros(m, np.float32) for _ in range(2)] + [np.zeros((slips, m), np.float32) for _ in range(9)]
    return RollingWork(
        np.empty(m * m, np.float32), np.empty(m * m, np.float32), np.zeros((4, (n + 1) ** 2), np.float32),
        np.zeros((3, n * (n + 1)), np.float32), StripLayout(*np.zeros((10, strips))), np.zeros(5),
        *vectors, np.zeros(n + 2, np.float32), np.zeros(slips), np.zeros(slips),
    )  # fmt: skip


@jit(allocates=False, fastmath=FUSED)
def _project(size, n, z, bound, force, ramp):
    """Fill F = P(z), with vectors scaled back to their bounds, and ``ramp``: 0 adhesion, 1 full sliding."""
    for start in range(0, size, 2 * n):
        for i in range(start, start + n):
            ratio = np.sqrt(z[i] * z[i] + z[i + n] * z[i + n]) / bound[i]
            scale = _ONE / max(_ONE, ratio)
            force[i] = scale * z[i]
            force[i + n] = scale * z[i + n]
            ramp[i] = min(_ONE, max(_ZERO, (ratio - _ONE) * _RAMP))
            ramp[i + n] = ramp[i]


@jit(allocates=False, fastmath=FUSED)
def _shift_slip(panels, start, relaxation, work, q):
    """Relax delta of the q-th slip towards the change of slip from slip point to load point, in one strip's sliding
    panels. The elastic part of the slip is h (F - z) - delta - w."""
    n, elastic, force, z, delta, rigid = panels.n, work.elastic, work.force[q], work.z[q], work.delta[q], work.rigid[q]
    ramp, shift = work.ramp[q], work.shift[q]
    for i in range(n):
        j = start + i
        elastic[i + 1] = work.step[j] * (force[j] - z[j]) - delta[j] - rigid[j]
    for i in range(n):
        j = start + i
        gain = panels.ahead[i] * (elastic[i + 1] - elastic[i]) + panels.behind[i] * (elastic[i + 2] - elastic[i + 1])
        delta[j] += relaxation * (ramp[j] * (gain + shift[j]) - delta[j])


@jit(allocates=False, fastmath=FUSED)
def _begin(size, work, q):
    """Set the start of the iteration for the q-th slip."""
    y, r, old, delta, z, rigid = work.y[q], work.r[q], work.product[q], work.delta[q], work.z[q], work.rigid[q]
    for i in range(size):
        y[i] = r[i] = old[i] = delta[i] = _ZERO
        z[i] = -rigid[i] / work.step[i]


@jit(allocates=False, fastmath=FUSED)
def _bracket(size, lags, work, q):
    """Fill ``work.r``, to which the resolvent is applied; with ``lags``, ``work.product`` holds B y."""
    y, r, old, delta, z = work.y[q], work.r[q], work.product[q], work.delta[q], work.z[q]
    rigid, force = work.rigid[q], work.force[q]
    if lags:
        for i in range(size):
            old[i] -= r[i] - y[i]
    for i in range(size):
        r[i] = _TWO * force[i] - z[i] - (rigid[i] + delta[i]) / work.step[i] - old[i]


@jit(allocates=False, fastmath=FUSED)
def _move(size, work, q):
    """Do one step of the iteration for the q-th slip; return the residual."""
    y, z, force, change, total = work.y[q], work.z[q], work.force[q], _ZERO, _TINY
    for i in range(size):
        move = y[i] - force[i]
        z[i] += _RHO * move
        change += abs(move)
        total += abs(force[i])
    return change / total


@jit(allocates=False, fastmath=FUSED)
def _iterate(panels, size, method, reach, windows, iterations, slips, work):
    """Do a fixed number of iterations for ``slips`` slips at once.

    Fills ``work.force``, and ``work.residual`` with the last sum of abs(y - F) over that of abs(F)."""
    n = panels.n
    block = size // windows
    matrix = work.matrix[: size * size].reshape((size, size))
    factors = work.factors[: size * size].reshape((size, size))
    for q in range(slips):
        _begin(size, work, q)
    for count in range(iterations):
        relaxation = np.float32(0.6) if count < 10 else np.float32(0.3)
        for q in range(slips):
            _project(size, n, work.z[q], work.bound, work.force[q], work.ramp[q])
            if count < 32:
                for start in range(0, size, n):
                    _shift_slip(panels, start, relaxation, work, q)
        lags = method != DIRECT and count > 0
        if lags:
            multiply(matrix, work.y, work.product, slips, 0)
        for q in range(slips):
            _bracket(size, lags, work, q)
        if method == LIBRARY:
            for window in range(windows):
                first, last = window * block, (window + 1) * block
                resolvent = work.factors[first * block : last * block].reshape((block, block))
                multiply(resolvent, work.r, work.y, slips, first)
        else:
            for q in range(slips):
                substitute(factors, 2 * n, reach, work.r[q][:size], work.y[q][:size])
        for q in range(slips):
            work.residual[q] = _move(size, work, q)
    for q in range(slips):
        _project(size, n, work.z[q], work.bound, work.force[q], work.ramp[q])


@jit(allocates=False, fastmath=FUSED)
def _load_case(panels, slip_x, slip_x_dx, slip_s, slip_s_dx, work, q):
    """Fill bounds (over mu N) and q-th rigid slip (over mu N/(G c^2)) of the panels, and the divisor of the slip."""
    rigid, shift = work.rigid[q], work.shift[q]
    n, strip, scale = panels.n, work.strip, work.scale[TO_UNIT]
    scale_dx = scale * work.scale[LENGTH]
    largest = 0.0
    for j in range(slip_x.size):
        largest = max(largest, scale * max(abs(slip_x[j]), abs(slip_s[j])))
        largest = max(largest, scale_dx * strip.half[j] * max(abs(slip_x_dx[j]), abs(slip_s_dx[j])))
    slow = max(1.0, largest / FASTEST)
    for j in range(slip_x.size):
        here_x, here_s = slip_x[j] * scale / slow, slip_s[j] * scale / slow
        change_x, change_s = slip_x_dx[j] * scale_dx / slow, slip_s_dx[j] * scale_dx / slow
        for k in range(n):
            i = 2 * n * j + k
            work.bound[i] = np.float32(strip.share[j] * panels.share[k]) + _TINY
            x, apart = strip.half[j] * panels.slip[k], strip.half[j] * (panels.load[k] - panels.slip[k])
            rigid[i], rigid[i + n] = here_x + change_x * x, here_s + change_s * x
            shift[i], shift[i + n] = change_x * apart, change_s * apart
    work.slowed[q] = slow


@jit(allocates=False, fastmath=FUSED)
def _resultant(panels, count, work, q):
    """Return (fx, fs, mn) of the q-th panel forces over mu N and mu N c; fill the strips' forces in ``work.strip``.

    If the slip was divided by ``slow``, the difference of the force to that of pure rigid slip is 1/slow of the
    difference at the reduced slip."""
    n, strip, slow = panels.n, work.strip, work.slowed[q]
    force, rigid, shift = work.force[q], work.rigid[q], work.shift[q]
    fx = fs = mn = 0.0
    for j in range(count):
        strip.force_x[j] = strip.force_s[j] = strip.turn[j] = 0.0
        for k in range(n):
            i = 2 * n * j + k
            if slow > 1:
                sx, ss = rigid[i] + shift[i], rigid[i + n] + shift[i + n]
                traction = work.bound[i] / np.sqrt(sx * sx + ss * ss + _TINY)
                force[i] = -traction * sx + (force[i] + traction * sx) / slow
                force[i + n] = -traction * ss + (force[i + n] + traction * ss) / slow
            strip.force_x[j] += force[i]
            strip.force_s[j] += force[i + n]
            strip.turn[j] += strip.half[j] * panels.load[k] * force[i + n]
        fx, fs = fx + strip.force_x[j], fs + strip.force_s[j]
        mn += strip.turn[j] + strip.middle[j] * strip.force_s[j] - strip.line[j] * strip.force_x[j]
    return fx, fs, mn


@jit(allocates=False, fastmath=FUSED)
def rolling_force(
    centre, width, half_length, middle, peak, slip_x, slip_x_dx, slip_s, slip_s_dx, shear_modulus, mu,
    library, work, method,
):  # fmt: skip
    """Creep force on the wheel for a patch given as strips: Fx, Fs (N), Mn (N m) about the normal at the origin.

    Further results: the residual, sum of the last changes of the panel forces over that of the forces (0.01 corresponds
    to a force error of 1e-4), and the method used. Strips (M,): lateral middles (ascending; a gap separates two
    windows) and widths, half length and middle, m, of the pressure ``peak sqrt(1 - ((x - middle)/half_length)^2)``, Pa
    (0: no contact). Slips (M,): rigid slip of the wheel relative to the rail over V along x and s at ``x = middle``,
    each followed by its derivative along x (1/m). For creepages xi, eta, phi at the origin the slips are
    xi - phi centre, 0, eta + phi middle, phi.

    ``method``: AUTO is LIBRARY if each window has ``library.level.strips`` strips and is similar to an ellipse, else
    BAND; then DIRECT with more iterations if the residual exceeds LIMIT. LIBRARY (falls back on BAND), BAND and DIRECT
    can be chosen. `read_field` and `roll_again` use the contents of ``work`` afterwards."""
    panels, scale, count = library.panels, work.scale, centre.size
    split = second_window(centre, width)
    windows = 1 if split == count else 2
    scale[LENGTH], scale[LOAD] = lay_out(centre, width, half_length, middle, peak, split, work.strip)
    c, bound = scale[LENGTH], mu * scale[LOAD]
    scale[BOUND] = bound
    if not bound > 0:
        return 0.0 * bound, 0.0 * bound, 0.0 * bound, 0.0 * bound, DIRECT
    assemble(panels, count, library.nu, work)
    scale[USED] = _prepare(panels, library, count, windows, split, method, work)
    scale[TO_UNIT] = shear_modulus * c * c / bound
    _load_case(panels, slip_x, slip_x_dx, slip_s, slip_s_dx, work, 0)
    residual = _solve(panels, library.level, count, windows, 1, method == AUTO, work)
    fx, fs, mn = _resultant(panels, count, work, 0)
    return bound * fx, bound * fs, bound * c * mn, residual, int(scale[USED])


@jit(allocates=False, fastmath=FUSED)
def roll_again(slips, library, work, forces):
    """Fill ``forces`` (K, 3, M; see `read_forces`) for other ``slips`` (K, 4, M), with strips and friction as last."""
    panels, strip, (many, _, count) = library.panels, work.strip, slips.shape
    split = second_window(strip.centre[:count], strip.width[:count])
    for q in range(many):
        _load_case(panels, slips[q, 0], slips[q, 1], slips[q, 2], slips[q, 3], work, q)
    _solve(panels, library.level, count, 1 if split == count else 2, many, True, work)
    for q in range(many):
        _resultant(panels, count, work, q)
        read_forces(count, work, forces[q])


@jit(allocates=False, fastmath=FUSED)
def _prepare(panels, library, count, windows, split, method, work):
    """Take factors from the library, or compute them; return the method to use."""
    if (method == AUTO or method == LIBRARY) and take_from_library(library, count, windows, split, work):
        return LIBRARY
    _factorise(panels, count, count if method == DIRECT else library.level.reach, work)
    return DIRECT if method == DIRECT else BAND


@jit(allocates=False, fastmath=FUSED)
def _factorise(panels, count, reach, work):
    """Compute the factors of I + B without pairs of strips farther apart than ``reach``."""
    size = 2 * panels.n * count
    matrix = work.matrix[: size * size].reshape((size, size))
    factorise(matrix, 2 * panels.n, reach, work.factors[: size * size].reshape((size, size)))


@jit(allocates=False, fastmath=FUSED)
def _solve(panels, level, count, windows, slips, retry, work):
    """Iterate by the method of the present factors; return the maximum residual.

    With ``retry``, repeat with DIRECT if the residual exceeds LIMIT."""
    residual = LIMIT
    for _ in range(2):
        used = int(work.scale[USED])
        reach = count if used == DIRECT else level.reach
        whole = used != LIBRARY and reach + 1 >= count
        iterations = DIRECT_ITERATIONS if used == DIRECT else level.iterations
        method, parts = (DIRECT if whole else used), (windows if used == LIBRARY else 1)
        _iterate(panels, 2 * panels.n * count, method, reach, parts, iterations, slips, work)
        residual = 0.0
        for q in range(slips):
            residual = max(residual, work.residual[q])
        if not retry or used == DIRECT or residual <= LIMIT:
            break
        work.scale[USED] = DIRECT
        _factorise(panels, count, count, work)
    return residual


@jit(allocates=False, fastmath=FUSED)
def read_forces(count, work, force):
    """Fill ``force`` (3, M) with the forces on the strips: along x and s, N, and moment about the middle, N m."""
    strip, bound = work.strip, work.scale[BOUND]
    for j in range(count):
        force[0, j] = force[1, j] = force[2, j] = 0.0
        if bound > 0.0:
            force[0, j], force[1, j] = bound * strip.force_x[j], bound * strip.force_s[j]
            force[2, j] = bound * strip.turn[j] * work.scale[LENGTH]


@jit(allocates=False, fastmath=FUSED)
def read_field(panels, count, work, field):
    """Fill ``field`` (9, M n) with the fields over the panels of the last solution of `rolling_force` in ``work``.

    Panels are in order strip by strip, from the leading edge backwards. Rows: x, s (m), traction on the wheel along x
    and s (Pa), pressure (Pa), slip over V along x and s, 1 where the panel slides, dissipated power over V (Pa). The
    power of traction and slip is scaled by one factor to the total power of the force on the rigid slip; the upwind
    slip misses 10 to 40 % of it at the coarser levels."""
    n, strip, scale, force, z = panels.n, work.strip, work.scale, work.force[0], work.z[0]
    rigid, shift = work.rigid[0], work.shift[0]
    c = scale[LENGTH]
    to_slip = work.slowed[0] / scale[TO_UNIT]
    work_done = power = 0.0
    for j in range(count):
        for k in range(n):
            i, out = 2 * n * j + k, n * j + k
            area = c * c * strip.width[j] * strip.half[j] * (panels.edges[k] - panels.edges[k + 1])
            tx, ts = scale[BOUND] * force[i] / area, scale[BOUND] * force[i + n] / area
            sx = to_slip * work.step[i] * (force[i] - z[i])
            ss = to_slip * work.step[i] * (force[i + n] - z[i + n])
            slides = np.sqrt(z[i] ** 2 + z[i + n] ** 2) > work.bound[i]
            field[0, out] = c * (strip.middle[j] + strip.half[j] * panels.load[k])
            field[1, out] = c * strip.line[j]
            field[2, out], field[3, out] = tx, ts
            field[4, out] = scale[LOAD] * strip.share[j] * panels.share[k] / area
            field[5, out], field[6, out] = sx, ss
            field[7, out] = 1.0 if slides else 0.0
            field[8, out] = -(tx * sx + ts * ss)
            power += area * field[8, out]
            rigid_x, rigid_s = rigid[i] + shift[i], rigid[i + n] + shift[i + n]
            work_done -= area * to_slip * (tx * rigid_x + ts * rigid_s)
    if power > 0:
        for out in range(count * n):
            field[8, out] *= work_done / power
