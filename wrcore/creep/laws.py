"""Creep-force laws behind one signature.

Every law maps the patch (g = a/b, shape number psi) and the nondimensional creepages

    xi' = xi G c^2/(mu N),   eta' = eta G c^2/(mu N),   phi' = phi G c^3/(mu N),   c = sqrt(a b)

to (fx, fy, mz) = (Fx/(mu N), Fy/(mu N), Mz/(mu N c)), forces on the body whose creepage it is (the wheel). Only the
table and FASTSIM depend on the shape number; the other laws use the mean ellipse.
"""

from typing import NamedTuple

import numpy as np

from wrcore.creep.axes import CreepTableData, TableAxes, table_lookup
from wrcore.creep.fastsim import FastsimData, fastsim
from wrcore.creep.kalker import kalker_coefficients, kalker_data
from wrcore.errors import InputError, one_of
from wrcore.kernels import own
from wrcore.kernels.handles import FOUR, four_at
from wrcore.kernels.jit import FUSED, jit, rarely_called

LAWS = {"table": 0, "linear": 1, "she": 2, "polach": 3, "fastsim": 4}
_TABLE, _LINEAR, _SHE, _POLACH = 0, 1, 2, 3
USER_LAW = 5
"""Number of a creep law that the user has written, see `user_law`."""

GROUP = "wrcore.creep_laws"
"""Group of entry points by which installed packages provide creep laws."""

TRIED = (0.0, 0.0, 0.0), (0.1, -0.2, 0.1), (5.0, 3.0, -2.0)
"""Nondimensional creepages of the test calls of a user's law."""

FASTSIM_GRID = 40


class PolachFactors(NamedTuple):
    """Reduction factors of Polach's law, both 1 for clean, dry rails."""

    adhesion: float
    """Factor k_A of the slope at small creepages and in the area of adhesion."""
    slip: float
    """Factor k_S in the area of slip; k_S <= k_A <= 1."""


class CreepData(NamedTuple):
    """Data of the creep laws; a kernel argument."""

    table: CreepTableData
    """Creep table, without nodes for other laws; all laws use its ``kalker``."""
    fastsim: FastsimData
    polach: PolachFactors
    source: np.ndarray = np.zeros(0, np.int64)  # digest of a law of the user's own, see `wrcore.kernels.own`
    own_kernel: int = 0  # address of the kernel of this law


def named_law(name, laws):
    """Find the user's law that a scene names, in ``laws`` or among entry points; InputError if there is none."""
    try:
        return laws.find(name, GROUP)
    except InputError as error:
        known = "" if ":" in name else f"{one_of(LAWS, name)}; or "
        raise InputError("", error.field, f"{known}{error.expected}") from None


def user_law(name, laws):
    """Find the user's law that a scene names (`named_law`) and check it by test calls.

    It is called as ``law(ratio, psi, kalker, xi, eta, phi)`` with kalker = (C11, C22, C23, C33); it returns (fx, fy,
    mz)."""
    found = named_law(name, laws)
    laws.allow()
    if not hasattr(found.function, "py_func"):
        raise InputError("", "", f"expected a function compiled by numba.njit, got {name!r}, which is plain Python")
    for creepages in TRIED:
        forces, _ = own.tried(found, (), 1.3, 0.0, (4.0, 3.7, 1.5, 1.2), *creepages)
        if not isinstance(forces, tuple) or len(forces) != 3 or not all(map(own.is_number, forces)):
            raise InputError("", "", f"expected a tuple of three numbers fx, fy, mz from a test call, got {forces!r}")
        own.finite(*forces)
    return found


def _wrapped(function, note):
    """Return the function of a user's law for kernels; ``note`` checks its results."""

    def call(g, psi, kalker, xi, eta, phi):
        fx, fy, mz = function(g, psi, kalker, xi, eta, phi)
        note(g + xi + eta + phi, float(fx + fy + mz))
        return float(fx), float(fy), float(mz), 0.0

    return call


def creep_data(nu, table=None, grid=FASTSIM_GRID, elliptic=False, factors=(1.0, 1.0), law=None):
    """Return the `CreepData` for `creep_force` at Poisson's ratio ``nu``.

    ``table``: ``CreepTable.kernel_data()``, for the law "table" only; ``grid``: FASTSIM's number of steps along x and
    of strips across; ``elliptic``: FASTSIM's bound is Hertzian instead of parabolic; ``factors``: k_A and k_S of
    Polach's law; ``law``: a user's law."""
    if table is None:
        table = CreepTableData(TableAxes(0.0, 0.0, 0.0, 0, 0, 0, 0, 0), kalker_data(nu), np.zeros(0, np.float32))
    fastsim_data = FastsimData(int(grid), int(grid), int(elliptic))
    data = CreepData(table, fastsim_data, PolachFactors(float(factors[0]), float(factors[1])))
    if law is None:
        return data
    return with_user_law(data._replace(source=np.array(law.digest, np.int64)))


def with_user_law(data):
    """Return the `CreepData` with the address of its user's law."""
    example = tuple(map(own.Example, (1.0, 0.0, (1.0,) * 4, 0.0, 0.0, 0.0)))
    kernel = own.addressed(_wrapped, tuple(map(int, data.source)), 0, 0, example, FOUR)
    return data._replace(own_kernel=kernel.address)


@jit(allocates=False, fastmath=FUSED)
def linear(kalker, g, xi, eta, phi):
    """Creep force by Kalker's linear theory: fx = -C11 xi', fy = -C22 eta' - C23 phi', mz = C23 eta' - C33 phi'.

    It has no friction bound."""
    c11, c22, c23, c33 = kalker_coefficients(g, kalker)
    return -c11 * xi, -c22 * eta - c23 * phi, c23 * eta - c33 * phi


@jit(allocates=False, fastmath=FUSED)
def she(kalker, g, xi, eta, phi):
    """Creep force by Shen, Hedrick and Elkins (Proc. 8th IAVSD Symposium (1983) 591-605).

    The linear force, u over mu N, is reduced to u - u^2/3 + u^3/27 (1 for u >= 3) with its direction kept. The spin
    moment is reduced by the same factor (not specified in the paper)."""
    fx, fy, mz = linear(kalker, g, xi, eta, phi)
    u = np.sqrt(fx * fx + fy * fy)
    factor = 1 - u / 3 + u * u / 27 if u < 3 else 1 / u
    return factor * fx, factor * fy, factor * mz


@jit(allocates=False, fastmath=FUSED)
def polach(kalker, factors, g, xi, eta, phi):
    """Creep force by Polach, with one saturation curve for the force and a separate one for the force due to spin.

    With the creepages s, s_yc = s_y + phi a where that is larger in size than s_y, s_c = sqrt(s_x^2 + s_yc^2):
    eps = (pi/4) c_jj s_c, F = (2/pi) (k_A eps/(1 + (k_A eps)^2) + atan(k_S eps)), F_x = -F s_x/s_c,
    F_y = -F s_y/s_c + (9/16) a k K phi/s_c, k = 1 + 6.3 (1 - exp(-a/b)), K(eps_s) from eps_s = (8/3) b C23 abs(s_yc)/k
    (lengths over c). The factors k_A and k_S do not change the force due to spin. Polach, Vehicle System Dynamics
    Suppl. 33 (1999) 728-739, and with k_A and k_S Wear 258 (2005) 992-1000.

    The published law has no moment. Its spin force then adds power where lateral creepage opposes spin (with k_A = 1 in
    6 % of random creepages, with k_A = 0.004 in 36 %). The moment M_z = -(9/16) a k K s_y/s_c dissipates exactly this
    power. It depends on the lateral creepage as the spin force depends on spin; for small creepages this is Kalker's
    C23. The dissipated power is F (s_x^2 + s_y^2)/s_c."""
    c11, c22, c23, _ = kalker_coefficients(g, kalker)
    a, b = np.sqrt(g), 1 / np.sqrt(g)
    turned = eta + phi * a
    lateral = turned if abs(turned) > abs(eta) else eta
    total = np.sqrt(xi * xi + lateral * lateral)
    if total < 1e-300:
        return 0.0, 0.0, 0.0
    plain = np.sqrt(xi * xi + eta * eta) + 1e-300
    stiffness = np.sqrt((c11 * xi / plain) ** 2 + (c22 * eta / plain) ** 2)
    eps = 0.25 * np.pi * stiffness * total
    held = factors.adhesion * eps
    force = 2 / np.pi * (held / (1 + held * held) + np.arctan(factors.slip * eps))
    k = 1 + 6.3 * (1 - np.exp(-g))
    eps_spin = 8 / 3 * b * c23 * abs(lateral) / k
    delta = (eps_spin * eps_spin - 1) / (eps_spin * eps_spin + 1)
    spin = eps_spin * (delta**3 / 3 - delta**2 / 2 + 1 / 6) - (1 - delta**2) ** 1.5 / 3
    turning = -0.5625 * a * k * spin  # not negative
    return -force * xi / total, -(force * eta + turning * phi) / total, turning * eta / total


@jit(allocates=False, fastmath=FUSED)
def _other_law(law, data, log_g, g, psi, xi, eta, phi):
    """Creep force by any law except the table, see `creep_force`."""
    rarely_called()
    kalker = data.table.kalker
    end = kalker.start + kalker.cubic.shape[0] * kalker.spacing
    outside = int(not kalker.start <= log_g <= end)
    if law == _LINEAR:
        fx, fy, mz = linear(kalker, g, xi, eta, phi)
    elif law == _SHE:
        fx, fy, mz = she(kalker, g, xi, eta, phi)
    elif law == _POLACH:
        fx, fy, mz = polach(kalker, data.polach, g, xi, eta, phi)
    elif law == USER_LAW:
        fx, fy, mz, _ = four_at(data.own_kernel, g, psi, kalker_coefficients(g, kalker), xi, eta, phi)
    else:
        fx, fy, mz = fastsim(data.fastsim, kalker, g, psi, xi, eta, phi)
    return fx, fy, mz, outside


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def creep_force_at(law, data, log_g, g, psi, xi, eta, phi):
    """Creep force as by `creep_force`, for a given ln(a/b)."""
    if law == _TABLE:
        return table_lookup(data.table, log_g, g, psi, xi, eta, phi)
    return _other_law(law, data, log_g, g, psi, xi, eta, phi)


@jit(allocates=False, fastmath=FUSED)
def creep_force(law, data, g, psi, xi, eta, phi):
    """Creep force fx, fy, mz, over mu N and mu N c, by the law with number ``law`` (see `LAWS`), and a flag.

    The flag is 1 if the patch is outside the range of the law's data; the nearest patch inside is then used."""
    return creep_force_at(law, data, np.log(g), g, psi, xi, eta, phi)


@jit(allocates=False, fastmath=FUSED)
def creep_forces(law, data, g, psi, creepages, forces):
    """Fill ``forces`` (n, 3) with fx, fy, mz of n cases by one law; return the number of cases out of range.

    ``creepages`` (n, 3) are xi', eta', phi'."""
    outside = 0
    for i in range(g.size):
        xi, eta, phi = creepages[i]
        forces[i, 0], forces[i, 1], forces[i, 2], flag = creep_force(law, data, g[i], psi[i], xi, eta, phi)
        outside += flag
    return outside
