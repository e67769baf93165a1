"""Reader of HDF5 files of other programs, in a process of its own.

The HDF5 library crashes or never returns on some damaged files. `read_hdf5` therefore starts a second process, waits
for a limited time and takes the arrays from a temporary file.
"""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from wrcore.errors.checked_hdf5 import dataset_fault

UNIT_NAMES = "unit", "units", "Unit", "Units", "UNITS", "UNIT"
"""Attributes of a dataset, or fields of a structure, that state the unit."""

PATIENCE, SPEED = 60.0, 5e6
"""Time (s) after which reading is given up, and the rate (bytes/s) with which large files have more."""


def read_hdf5(path):
    """Return (name, unit, array) of each dataset of numbers, and of each attribute that is a number.

    A ValueError says what is wrong with a file."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([*sys.path, str(Path(__file__).parents[2])])}
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "arrays.npz"
        command = [sys.executable, "-m", "wrcore.signals.hdf5_file", os.fspath(path), str(copy)]
        limit = PATIENCE + os.path.getsize(path) / SPEED
        try:
            done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=limit)
        except subprocess.TimeoutExpired:
            raise ValueError("a damaged file, on which the HDF5 library does not return") from None
        if done.returncode:
            raise ValueError(done.stdout.strip() or "a damaged file, on which the HDF5 library crashes")
        with np.load(copy, allow_pickle=False) as arrays:
            titles = json.loads(str(arrays["titles"]))
            return [(name, unit, arrays[str(k)]) for k, (name, unit) in enumerate(titles)]


def _contents(path) -> Iterator[tuple[str, str, np.ndarray]]:
    with h5py.File(path, "r") as file:
        if str(file.attrs.get("format", "")).startswith("wrcore"):
            raise ValueError("a file of wrcore: wr.load_run reads runs")
        for name, dataset in _datasets(file):
            unit = next((_text(dataset.attrs[key]) for key in UNIT_NAMES if key in dataset.attrs), "")
            yield name, unit, dataset[()]
        for item in (file, *(group for group in file.values() if isinstance(group, h5py.Group))):
            for key, value in item.attrs.items():
                if np.asarray(value).dtype.kind in "fiu" and np.size(value) == 1:
                    yield key, "", np.asarray(value)


def _datasets(file) -> Iterator[tuple[str, h5py.Dataset]]:
    """Yield name and dataset of all datasets of numbers that are stored in the file itself."""
    names: list[str] = []
    file.visititems_links(lambda name, link: names.append(name) if isinstance(link, h5py.HardLink) else None)
    for name in names:
        item = file.get(name) if "#" not in name else None  # references of MATLAB are in #refs#
        if isinstance(item, h5py.Dataset) and item.dtype.kind in "fiub":
            fault = dataset_fault(item.id)
            if fault:
                raise ValueError(f"{fault}: {name}")
            yield name.replace("/", "."), item


def _text(value) -> str:
    value = value.decode("utf-8", "replace") if isinstance(value, bytes) else value
    if isinstance(value, str):
        return value
    value = np.asarray(value)
    return _text(value.flat[0]) if value.size == 1 and value.dtype.kind in "SO" else ""


def _main(path, copy):
    """Write the arrays of an HDF5 file into a file of NumPy; print the reason and return 1 if it is damaged."""
    try:
        found = list(_contents(path))
        titles = json.dumps([(name, unit) for name, unit, _ in found])
        arrays: dict[str, Any] = {str(k): values for k, (_, _, values) in enumerate(found)}
        np.savez(copy, titles=titles, **arrays)
    except Exception as error:  # a damaged file fails in as many ways as h5py has
        print(" ".join(str(error).split())[:200] or type(error).__name__)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(_main(*sys.argv[1:]))
