"""Runs in HDF5 files: every dataset says its unit and its meaning, every file how it came about."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from os import PathLike
from pathlib import Path

import h5py
import numpy as np

from wrcore import __version__
from wrcore.channels import DESCRIPTIONS, unit_of
from wrcore.errors import InputError
from wrcore.run import Run

FORMAT = "wrcore run"
FORMAT_VERSION = 1


def write_run(path: str | PathLike[str], run: Run) -> None:
    """Write a run; the file appears under its name only when it is complete.

    The same run gives the same bytes: no date, host or path is stored.

    Parameters
    ----------
    path : path-like
        File to write (HDF5); its folder is created if needed.
    run : Run
        What to write.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with h5py.File(part, "w") as file:
            _write_attributes(file, run)
            _write_channels(file, run)
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)


def _write_attributes(file, run):
    file.attrs["format"] = FORMAT
    file.attrs["format_version"] = FORMAT_VERSION
    file.attrs["wrcore_version"] = __version__
    file.attrs["status"] = run.status
    file.attrs["reason"] = run.reason
    for name in ("scene", "settings", "counters"):
        file.attrs[name] = json.dumps(getattr(run, name), sort_keys=True, default=_plain)


def _plain(value):
    """What JSON does not know: numpy's numbers and arrays."""
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} cannot be written to a run file")


def _write_channels(file, run):
    time = _write_dataset(file, "t", run.t)
    time.make_scale("t")
    for group in sorted(run.groups):
        for name in sorted(run.groups[group]):
            dataset = _write_dataset(file.require_group(group), name, run.groups[group][name])
            dataset.dims[0].attach_scale(time)


def _write_dataset(group, name, values):
    dataset = group.create_dataset(name, data=np.asarray(values), compression="gzip", shuffle=True)
    dataset.attrs["units"] = unit_of(name)
    dataset.attrs["description"] = DESCRIPTIONS.get(name, name.replace("_", " "))
    return dataset


def load_run(path: str | PathLike[str]) -> Run:
    """Read a run that `write_run` wrote.

    Parameters
    ----------
    path : path-like
        HDF5 file.

    Returns
    -------
    Run

    Raises
    ------
    InputError
        If the file is absent, truncated, not HDF5, or HDF5 of another kind or version.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> run = Run({"name": "still"}, "completed", "", np.array([0.0, 0.5]), {"wheelset": {"y_m": np.zeros(2)}})
    >>> with TemporaryDirectory() as folder:
    ...     run.save(f"{folder}/run.h5")
    ...     load_run(f"{folder}/run.h5")["wheelset"].y_m
    array([0., 0.])
    """
    try:
        with h5py.File(path, "r") as file:
            _check_format(path, file)
            return _read(file)
    except FileNotFoundError:
        raise InputError(path, "", "expected a run file (HDF5), got no such file") from None
    except (OSError, RuntimeError, KeyError, json.JSONDecodeError) as error:
        raise InputError(path, "", f"expected a complete run file (HDF5), got: {error}") from None


def load_runs(paths: Iterable[str | PathLike[str]]) -> dict[str, dict[str, Run]]:
    """Read several runs that lie as ``<case>/<name>.h5``.

    Parameters
    ----------
    paths : iterable of path-like

    Returns
    -------
    dict of str to dict of str to Run
        Runs by folder name and by file name without its ending, in the order of the paths.

    Raises
    ------
    InputError
        As `load_run`.
    """
    cases: dict[str, dict[str, Run]] = {}
    for path in map(Path, paths):
        cases.setdefault(path.parent.name, {})[path.stem] = load_run(path)
    return cases


def _check_format(path, file):
    found = file.attrs.get("format", "none")
    if found != FORMAT:
        raise InputError(path, "attribute format", f"expected {FORMAT!r}, got {found!r}")
    version = int(file.attrs["format_version"])
    if version != FORMAT_VERSION:
        raise InputError(path, "attribute format_version", f"expected {FORMAT_VERSION}, got {version}")


def _read(file):
    groups: dict[str, dict[str, np.ndarray]] = {}

    def _collect(name, item):
        if isinstance(item, h5py.Dataset) and "/" in name:
            group, channel = name.rsplit("/", 1)
            groups.setdefault(group, {})[channel] = item[()]

    file.visititems(_collect)
    records = {name: json.loads(file.attrs[name]) for name in ("scene", "settings", "counters")}
    return Run(status=file.attrs["status"], reason=file.attrs["reason"], t=file["t"][()], groups=groups, **records)
