"""Creep forces of a list of cases in SI units, for ``wrcore creep``."""

from __future__ import annotations

from os import PathLike
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike

from wrcore.contact.rolling.ellipse import DEFAULT_LEVEL, RollingContact
from wrcore.creep.laws import LAWS, creep_data, creep_forces
from wrcore.creep.table import DEFAULT_TOLERANCE, CreepTable, ensure_table, load_table
from wrcore.errors import InputError, one_of
from wrcore.errors.checked_calls import ABOVE_ZERO, OneOf, Within, checked, same_shape
from wrcore.errors.column_files import read_table

MODELS = (*LAWS, "exact")
POSITIVE = ("a_m", "b_neg_m", "b_pos_m", "N_N", "mu", "G_Pa")
NUMBERS = (*POSITIVE, "nu", "xi", "eta", "phi_per_m")
OTHER_NAMES = {"ux": "xi", "uy": "eta"}
"""Alternative names of columns, used if the usual columns are missing."""

FORCES = ("Fx_N", "Fy_N", "Mz_Nm")

_OPEN: dict[tuple[float, str], CreepTable] = {}
_SAME_NU = 1e-9
_LARGEST = 1e100
"""Maximum nondimensional creepage; the squares of larger ones could overflow."""


def read_cases(path):
    """Read a case list (pandas.DataFrame) from a CSV file; `solve_cases` then names the file in its messages."""
    frame = read_table(path, "case_id", NUMBERS)
    if frame.empty:
        raise InputError(path, "", "expected at least one case, got none")
    frame.attrs["source"] = str(path)
    return frame


def check_cases(frame, source="cases"):
    """Check a case list and return its columns as arrays of floats by name.

    Columns: case_id, a_m, b_neg_m, b_pos_m, N_N, mu, G_Pa, nu, xi, eta (or ux, uy), phi_per_m; case_id is not returned.
    InputError names ``source`` and the wrong column and row (from 1)."""
    frame = frame.rename(columns={other: name for other, name in OTHER_NAMES.items() if name not in frame})
    missing = [name for name in ("case_id", *NUMBERS) if name not in frame.columns]
    if missing:
        raise InputError(source, ", ".join(missing), f"expected columns case_id, {', '.join(NUMBERS)}; not found")
    columns = {name: _numbers(frame[name], name, source) for name in NUMBERS}
    for name in POSITIVE:
        _refuse(columns[name] <= 0, columns[name], name, source, "a number above 0")
    _refuse((columns["nu"] < 0) | (columns["nu"] > 0.5), columns["nu"], "nu", source, "0 to 0.5")
    return columns


def _numbers(series, name, source):
    import pandas as pd

    values = pd.to_numeric(series, errors="coerce").to_numpy(dtype=float)
    _refuse(~np.isfinite(values), series.to_numpy(), name, source, "a finite number")
    return values


def _refuse(bad, values, name, source, expected):
    if bad.any():
        row = int(np.argmax(bad))
        raise InputError(source, f"{name}, row {row + 1}", f"expected {expected}, got {values[row]}")


def nondimensional(columns):
    """Return g, psi (n,), nondimensional creepages xi', eta', phi' (n, 3), and c = sqrt(a b) (n,), m.

    ``columns`` come from `check_cases`; b is the mean of b_neg and b_pos."""
    b = (columns["b_neg_m"] + columns["b_pos_m"]) / 2
    psi = (columns["b_pos_m"] - columns["b_neg_m"]) / (2 * b)
    c = np.sqrt(columns["a_m"] * b)
    factor = columns["G_Pa"] * c**2 / (columns["mu"] * columns["N_N"])
    creepages = np.stack([columns["xi"], columns["eta"], columns["phi_per_m"] * c], axis=1) * factor[:, None]
    return columns["a_m"] / b, psi, creepages, c


def solve_cases(frame, model, table=None, level=DEFAULT_LEVEL, progress=None, source=None):
    """Return a table case_id, Fx_N, Fy_N, Mz_Nm of the cases of a list (see `check_cases`) by ``model`` (of MODELS).

    For an SDEC patch (b_neg != b_pos) creepages and moment refer to the middle of its bounding box. ``table``
    (CreepTable or path): for the model "table"; by default the cached table for each nu, built if missing. ``level``:
    refinement of the model "exact". ``progress`` wraps the iterable of patches, ``source`` is named in messages.
    ``attrs`` has the numbers of cases ``out_of_range`` of the law's data and of solutions ``not_converged``."""
    import pandas as pd

    source = source or frame.attrs.get("source", "cases")
    if model not in MODELS:
        raise InputError(source, "model", one_of(MODELS, model))
    forces, counts = _solved(check_cases(frame, source), model, table, level, progress, source)
    out = pd.DataFrame({"case_id": frame["case_id"].to_numpy(), **dict(zip(FORCES, forces.T, strict=True))})
    out.attrs.update(counts)
    return out


def _solved(columns, model, table, level, progress, source):
    """Return forces and moment (n, 3), N and N m, for checked columns, and the counts of `solve_cases`."""
    with np.errstate(all="ignore"):  # overflows are refused below
        g, psi, creepages, c = nondimensional(columns)
    size = np.abs(creepages).max(axis=1, initial=0.0)
    expected = f"creepages times G a b/(mu N) of at most {_LARGEST:g}"
    _refuse(~(size <= _LARGEST), size, "xi, eta, phi_per_m", source, expected)
    if model == "exact":
        forces, counts = _exact(g, psi, columns["nu"], creepages, level, progress)
    else:
        forces, counts = _by_law(model, g, psi, columns["nu"], creepages, table, progress, source)
    size = columns["mu"] * columns["N_N"]
    return np.stack([size * forces[:, 0], size * forces[:, 1], size * c * forces[:, 2]], axis=1), counts


def _exact(g, psi, nu, creepages, level, progress):
    """Return nondimensional forces by the half-space solver, and counts; cases on the same patch share its operator."""
    forces, failed = np.empty_like(creepages), 0
    patches, member = np.unique(np.round(np.stack([g, psi, nu], axis=1), 12), axis=0, return_inverse=True)
    for index in progress(range(len(patches))) if progress else range(len(patches)):
        rows = np.flatnonzero(member.ravel() == index)
        ratio, shape, poisson = patches[index]
        forces[rows], iterations = RollingContact(ratio, shape, poisson, level=level).solve_many(creepages[rows])
        failed += int((iterations < 0).sum())
    return forces, {"not_converged": failed, "out_of_range": 0}


def _by_law(model, g, psi, nu, creepages, table, progress, source):
    """Return nondimensional forces by a law of `laws`, and counts; cases with equal nu are solved together."""
    forces, outside = np.empty_like(creepages), 0
    given = table if table is None or isinstance(table, CreepTable) else load_table(table)
    planes = "sdec" if np.any(psi != 0) else "ellipse"
    for value in np.unique(nu):
        rows = np.flatnonzero(nu == value)
        kernel_table = None
        if model == "table":
            if given is not None and abs(given.nu - value) > _SAME_NU:
                raise InputError(source, f"nu, row {rows[0] + 1}", f"expected the table's {given.nu}, got {value}")
            kernel_table = (given or _open_table(float(value), planes, progress)).kernel_data()
        data, part = creep_data(value, kernel_table), np.empty((len(rows), 3))
        outside += creep_forces(LAWS[model], data, g[rows], psi[rows], creepages[rows], part)
        forces[rows] = part
    return forces, {"not_converged": 0, "out_of_range": int(outside)}


def _open_table(nu, planes, progress):
    """Return the default table for a Poisson's ratio, read once and cached."""
    if (nu, planes) not in _OPEN:
        _OPEN[nu, planes] = ensure_table(nu, planes, DEFAULT_TOLERANCE, progress)
    return _OPEN[nu, planes]


@checked
def creep_force(
    model: Annotated[str, OneOf(MODELS)],
    a: Annotated[ArrayLike, ABOVE_ZERO],
    b: Annotated[ArrayLike, ABOVE_ZERO],
    normal_force: Annotated[ArrayLike, ABOVE_ZERO],
    xi: ArrayLike,
    eta: ArrayLike,
    phi: ArrayLike,
    mu: Annotated[ArrayLike, ABOVE_ZERO] = 0.3,
    shear_modulus: Annotated[ArrayLike, ABOVE_ZERO] = 8.2e10,
    nu: Annotated[ArrayLike, Within(0.0, 0.5)] = 0.28,
    table: CreepTable | str | PathLike[str] | None = None,
    psi: Annotated[ArrayLike, Within(-1.0 + 1e-6, 1.0 - 1e-6)] = 0.0,
) -> tuple[Any, Any, Any]:
    """Compute the creep force by any law in physical units; scalars and arrays broadcast.

    Parameters
    ----------
    model : {"table", "linear", "she", "polach", "fastsim", "exact"}
    a, b : float or array_like
        Semi-axes in the rolling direction and across, m.
    normal_force : float or array_like
        Normal force, N.
    xi, eta, phi : float or array_like
        Longitudinal and lateral creepage (1) and spin (1/m), of the wheel relative to the rail.
    mu, shear_modulus, nu : float or array_like
        Friction coefficient, shear modulus (Pa), Poisson's ratio.
    table : CreepTable or path, optional
        For the model "table"; by default the cached table for nu, which is built if missing, and read once.
    psi : float or array_like
        Shape number of a double ellipse, which spans ``b (1 + psi)`` to the left and ``b (1 - psi)`` to the right; 0
        for an ellipse. Only "table", "exact" and "fastsim" depend on it.

    Returns
    -------
    Fx, Fy, Mz : numpy.ndarray or float
        Force on the wheel, N, and moment about the contact normal, N m.

    Raises
    ------
    InputError
        For an unknown model or an invalid value.

    Examples
    --------
    >>> Fx, Fy, Mz = creep_force("polach", 6e-3, 4e-3, 5e4, xi=[0.0, 1e-3], eta=0.0, phi=0.0)
    >>> Fx.round(-2).tolist()
    [0.0, -8100.0]
    """
    given = {"a": a, "b": b, "normal_force": normal_force, "mu": mu, "shear_modulus": shear_modulus, "nu": nu}
    along, across, *others, shape = same_shape("creep_force", **given, xi=xi, eta=eta, phi=phi, psi=psi)
    values = along, across * (1.0 - shape), across * (1.0 + shape), *others
    columns = {name: np.ravel(value).astype(float) for name, value in zip(NUMBERS, values, strict=True)}
    forces, _ = _solved(columns, model, table, DEFAULT_LEVEL, None, "creep_force")
    return tuple(forces[:, k].reshape(along.shape)[()] for k in range(3))
