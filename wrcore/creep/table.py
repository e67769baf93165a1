"""Creep tables on disk: built to a given error when first needed, cached, loaded in milliseconds.

The default table is part of the package (``tables/``); other tables are built when a scene needs them. File names
contain `FORM`, so that tables of another form are not used.

A table contains Fx, Fy, Mz of steady rolling for one Poisson's ratio, either for ellipses (four inputs) or for SDEC
patches (five inputs). Its error is measured relative to the half-space solver at random patches and creepages. Finer
tables are built until the 99 % quantile of the force error is below the tolerance. The errors are stored in the file.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike

import wrcore
from wrcore import __version__
from wrcore.creep.axes import CreepTableData, TableAxes
from wrcore.creep.build import RESOLUTIONS, Resolution, build_data, count_cases, random_errors
from wrcore.creep.kalker import kalker_data
from wrcore.errors import InputError, one_of
from wrcore.errors.checked_calls import OneOf, Within, checked
from wrcore.errors.checked_hdf5 import checked_hdf5, new_hdf5
from wrcore.errors.messages import warn
from wrcore.kernels.cache import table_folder

DEFAULT_TOLERANCE = 0.005
"""Default error of a table, over mu N. Critical speeds depend more on it than on the detection: that of the trailer
vehicle is 74.95 m/s at 0.015, 74.92 at 0.007 and 74.94 at 0.005; planar detection changes it by 0.0015 m/s."""

SHIPPED = Path(__file__).parent / "tables"
"""Folder of the tables in the package, written by `wrcore table build --out` with the file name of `table_path`."""

CHECK_LEVEL = 20
QUANTILES = ("median", "95 %", "99 %", "max")
FORM = 2
"""Number of the form of tables. Increase it with every change of the numbers in a table or of its file format: cached
files of another form are not used. A test compares entries of the default table with the solver."""

SCHEMA = f"wrcore creep table {FORM}"


@dataclass(frozen=True)
class CreepTable:
    """Creep table with its properties and errors; a call returns forces in physical units.

    Attributes
    ----------
    data : CreepTableData
        Data for kernels (`axes.table_lookup`).
    planes : str
        "ellipse" or "sdec".
    tolerance : float
        Requested 99 % quantile of abs(dF)/(mu N).
    resolution : Resolution
    cases : int
        Number of solved cases in the table.
    force_error, moment_error : tuple of float
        Median, 95 %, 99 % and maximum of the error in the random check, over mu N and mu N c.

    Examples
    --------
    >>> import wrcore as wr
    >>> table = wr.ensure_table(0.28)
    >>> Fx, Fy, Mz = table(6e-3, 4e-3, 5e4, xi=1e-3, eta=0.0, phi=0.0)
    >>> round(float(Fx), -2)
    -7600.0
    """

    data: CreepTableData
    planes: str
    tolerance: float
    resolution: Resolution
    cases: int
    force_error: tuple
    moment_error: tuple

    @property
    def nu(self) -> float:
        """Poisson's ratio."""
        return self.data.kalker.nu

    def __call__(
        self,
        a: ArrayLike,
        b: ArrayLike,
        normal_force: ArrayLike,
        xi: ArrayLike,
        eta: ArrayLike,
        phi: ArrayLike,
        mu: ArrayLike = 0.3,
        shear_modulus: ArrayLike = 8.2e10,
        psi: ArrayLike = 0.0,
    ) -> tuple[Any, Any, Any]:
        """Return Fx, Fy (N) and Mz (N m) by this table; arguments as for :func:`wrcore.creep_force`."""
        return wrcore.creep_force(
            "table", a, b, normal_force, xi, eta, phi, mu, shear_modulus, self.nu, table=self, psi=psi
        )

    def kernel_data(self) -> CreepTableData:
        """Return the `CreepTableData` for kernels, including your functions compiled with ``numba.njit``.

        Arguments of `wrcore.creep.axes.table_lookup` are these data, ln(a/b), a/b, psi and the creepages xi', eta',
        phi', which are xi, eta and phi c times G a b/(mu N), c^2 = a b. It returns Fx and Fy over mu N, Mz over mu N c,
        and 1 if a/b or psi is outside the table.

        Examples
        --------
        >>> import numba, numpy as np, wrcore as wr
        >>> from wrcore.creep.axes import table_lookup
        >>> @numba.njit
        ... def work(table, a, b, load, xi, eta, phi, mu, shear_modulus):  # of a patch per metre, over n creepages
        ...     c, limit, total = np.sqrt(a * b), mu * load, 0.0
        ...     scale = shear_modulus * a * b / limit
        ...     for k in range(len(xi)):
        ...         scaled = scale * xi[k], scale * eta[k], scale * c * phi[k]
        ...         fx, fy, mz, _ = table_lookup(table, np.log(a / b), a / b, 0.0, *scaled)
        ...         total -= limit * (fx * xi[k] + fy * eta[k] + c * mz * phi[k])
        ...     return total
        >>> table, xi = wr.ensure_table(), np.linspace(-2e-3, 2e-3, 100)
        >>> round(work(table.kernel_data(), 6e-3, 4e-3, 5e4, xi, 0.0 * xi, 0.0 * xi, 0.3, 8.2e10), -1)
        930.0
        """
        return self.data


def _quantiles(errors):
    return tuple(float(value) for value in (*np.percentile(errors, [50, 95, 99]), errors.max()))


def build_table(nu=0.28, planes="ellipse", tolerance=DEFAULT_TOLERANCE, progress=None):
    """Build a `CreepTable` at Poisson's ratio ``nu`` with four inputs (``planes`` "ellipse", psi = 0) or five ("sdec").

    Its 99 % quantile of abs(dF)/(mu N) over random cases is below ``tolerance``, if one of the known resolutions is
    sufficient; else the finest is used. ``progress`` wraps the list of patches to solve, e.g. ``tqdm.tqdm``."""
    _check_arguments(nu, planes, tolerance)
    for resolution in _promising(planes, tolerance):
        data = build_data(nu, planes, resolution, progress)
        force, moment = (_quantiles(errors) for errors in random_errors(data, max(CHECK_LEVEL, resolution.level)))
        if force[2] <= tolerance:
            break
    return CreepTable(data, planes, float(tolerance), resolution, count_cases(data.axes), force, moment)


def _promising(planes, tolerance):
    """Return the first resolution that is expected to meet the tolerance, and all finer ones."""
    known = RESOLUTIONS[planes]
    first = next((i for i, (expected, _) in enumerate(known) if expected <= tolerance), len(known) - 1)
    return [resolution for _, resolution in known[first:]]


def _check_arguments(nu, planes, tolerance):
    if planes not in RESOLUTIONS:
        raise InputError("creep table", "planes", one_of(RESOLUTIONS, planes))
    if not 0 <= nu <= 0.5:
        raise InputError("creep table", "nu", f"expected 0 to 0.5, got {nu}")
    if not 0 < tolerance < 1:
        raise InputError("creep table", "tolerance", f"expected a fraction of mu N between 0 and 1, got {tolerance}")


def write_table(path, table):
    """Write a `CreepTable` as HDF5, with a digest of all its bytes."""
    axes = table.data.axes
    inputs = (axes.n_g + 2, axes.n_psi + 2 * (axes.n_psi > 1), axes.n_t + 2, -1, axes.n_beta + 2, 4)
    errors = f"{', '.join(QUANTILES)} of the error at random cases, over mu N (c)"
    splines = "quadratic B-spline coefficients over ln(a/b), abs(psi), t, alpha, beta; outputs fx, fy, mz and one zero"
    with new_hdf5(path) as file:
        for name, data, description in (
            ("coefficients", table.data.coefficients.reshape(inputs), splines),
            ("force_error", table.force_error, errors), ("moment_error", table.moment_error, errors),
        ):  # fmt: skip
            file.create_dataset(name, data=data).attrs.update(units="1", description=description)
        file.attrs.update(schema=SCHEMA, wrcore_version=__version__, planes=table.planes, nu=table.nu)
        file.attrs.update(tolerance=table.tolerance, cases=table.cases, resolution=table.resolution)
        file.attrs.update({f"axes.{name}": value for name, value in axes._asdict().items()})


def load_table(path):
    """Read a `CreepTable`; InputError if the file is missing, is not a creep table, or has been changed."""
    stamp = None
    with suppress(OSError):  # `_read_table` reports the error
        status = os.stat(path)
        stamp = status.st_ino, status.st_size, status.st_mtime_ns, status.st_ctime_ns
    table = _read_table(path, stamp)
    kalker = table.data.kalker._replace(cubic=table.data.kalker.cubic.copy())  # callers do not share arrays
    return replace(table, data=table.data._replace(kalker=kalker, coefficients=table.data.coefficients.copy()))


@lru_cache(maxsize=4)
def _read_table(path, _):
    """Read a `CreepTable`, cached for a file of the same size and time."""
    with checked_hdf5(path, "a creep table in HDF5") as file:
        found = file.attrs.get("schema")
        if found != SCHEMA:
            expected = f"expected {SCHEMA!r}, got {found!r}"
            raise InputError(path, "schema", f"{expected}; 'wrcore table build' makes a new one")
        return _read_datasets(path, file)


def _read_datasets(path, file):
    attributes = file.attrs
    kinds = TableAxes.__annotations__
    axes = TableAxes(*(kinds[name](attributes[f"axes.{name}"]) for name in TableAxes._fields))
    coefficients = np.ascontiguousarray(file["coefficients"][...], dtype=np.float32)
    _check_axes(path, axes, attributes["planes"], coefficients)
    coefficients = coefficients.ravel()
    data = CreepTableData(axes, kalker_data(float(attributes["nu"])), coefficients)
    resolution = Resolution(*(int(value) for value in attributes["resolution"]))
    errors = tuple(tuple(float(value) for value in file[name][...]) for name in ("force_error", "moment_error"))
    if not all(len(part) == len(QUANTILES) for part in errors):
        raise InputError(path, "force_error", f"expected {', '.join(QUANTILES)}")
    planes, tolerance = str(attributes["planes"]), float(attributes["tolerance"])
    return CreepTable(data, planes, tolerance, resolution, int(attributes["cases"]), *errors)


def _check_axes(path, axes, planes, coefficients):
    """Raise InputError if axes and coefficients do not agree; kernels do not check indices."""
    ellipse = axes.n_psi == 1
    angles = (axes.n_alpha // 2 if ellipse else axes.n_alpha) + 3
    shape = (axes.n_g + 2, axes.n_psi + 2 * (not ellipse), axes.n_t + 2, angles, axes.n_beta + 2, 4)
    if planes not in RESOLUTIONS or ellipse != (planes == "ellipse") or min(axes[3:]) < 1 or axes.n_g < 2:
        raise InputError(path, "axes", f"expected the axes of a table, got {planes!r} with {axes}")
    sizes = -20.0 < axes.log_g_min < axes.log_g_max < 20.0
    if not (sizes and 0.0 <= axes.psi_max < 1.0 and ellipse == (not axes.psi_max)):
        raise InputError(path, "axes", f"expected ranges of ln(a/b) and psi, got {axes}")
    if coefficients.shape != shape or not np.isfinite(coefficients).all():
        expected = f"expected finite numbers in the shape {shape}, got {coefficients.shape}"
        raise InputError(path, "coefficients", expected)


def show_progress(patches):
    """Show a progress bar with the remaining time in a terminal; for the argument ``progress`` in this module."""
    from tqdm import tqdm

    return tqdm(patches, desc="creep table", unit="patch", disable=None, leave=False)


def table_path(nu, planes, tolerance):
    """Path of the table with these properties in the cache."""
    return table_folder() / f"{planes}_nu{nu:.6g}_tol{tolerance:.6g}_form{FORM}.h5"


def kept_tables(nu, planes, tolerance):
    """Return the existing files of the table with these properties, in the package and in the cache."""
    path = table_path(nu, planes, tolerance)
    return [place for place in (SHIPPED / path.name, path) if place.exists()]


@checked
def ensure_table(
    nu: Annotated[float, Within(0.0, 0.5)] = 0.28,
    planes: Annotated[str, OneOf(RESOLUTIONS)] = "ellipse",
    tolerance: float = DEFAULT_TOLERANCE,
    progress: Callable | None = None,
) -> CreepTable:
    """Return the table from the package or the cache; build and cache it if it is missing or damaged.

    Two processes that need the same table at once both build it; the file of the later one remains, with equal content.

    Parameters
    ----------
    nu, planes, tolerance, progress
        As for `build_table`.

    Returns
    -------
    CreepTable

    Examples
    --------
    >>> import wrcore as wr
    >>> table = wr.ensure_table(0.28)
    >>> table.planes, table.tolerance, table.force_error[2] < table.tolerance
    ('ellipse', 0.005, True)
    """
    _check_arguments(nu, planes, tolerance)
    for place in kept_tables(nu, planes, tolerance):
        try:
            table = load_table(place)
            if (table.nu, table.planes, table.tolerance) == (nu, planes, tolerance):
                return table
            warn(f"{place}: another table than its name says; it is built anew")
        except InputError as error:
            warn(f"{error}; it is built anew")
    path, table = table_path(nu, planes, tolerance), build_table(nu, planes, tolerance, progress)
    try:
        write_table(path, table)
    except OSError as error:
        warn(f"{path}: {error.strerror}; the table is not kept")
    return table


def table_info(table):
    """Return the properties of a `CreepTable`, or of one in a file, as a flat dict."""
    table = table if isinstance(table, CreepTable) else load_table(table)
    info = {"planes": table.planes, "nu": table.nu, "tolerance": table.tolerance, "cases": table.cases}
    info |= {f"nodes_{name[2:]}": value for name, value in table.data.axes._asdict().items() if name.startswith("n_")}
    info |= {"level": table.resolution.level, "a_over_b_min": float(np.exp(table.data.axes.log_g_min))}
    info |= {"a_over_b_max": float(np.exp(table.data.axes.log_g_max)), "psi_max": table.data.axes.psi_max}
    info["memory_MB"] = table.data.coefficients.nbytes / 1e6
    for name, errors in (("force_error", table.force_error), ("moment_error", table.moment_error)):
        info |= {f"{name}_{quantile}": value for quantile, value in zip(QUANTILES, errors, strict=True)}
    return info
