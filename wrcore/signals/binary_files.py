"""MATLAB files (version 4 and 5; 7.3 is HDF5) and HDF5 files of measured signals. No code of a file is executed."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress

import h5py
import numpy as np

from wrcore.errors import InputError
from wrcore.errors.checked_hdf5 import dataset_fault
from wrcore.errors.input_files import check_regular
from wrcore.errors.messages import warn
from wrcore.signals.table import MeasuredTable

RATES = {"fs": 1, "samplerate": 1, "samplingrate": 1, "samplefrequency": 1, "samplingfrequency": 1, "rate": 1} | {
    "dt": -1, "sampletime": -1, "sampleinterval": -1, "samplinginterval": -1, "ts": -1,
}  # fmt: skip
"""Names of scalars that state the sampling rate in Hz (exponent 1) or the sampling interval in s (exponent -1)."""

UNIT_NAMES = "unit", "units", "Unit", "Units", "UNITS", "UNIT"
"""Attributes of a dataset, or fields of a structure, that state the unit."""

MOST_COLUMNS = 10_000
"""Largest number of columns that are read from a matrix; more columns than this are a picture or a mistake."""


def kind_of(path) -> str:
    """Return ``hdf5``, ``mat`` or ``text`` by the first bytes and the ending of a file."""
    try:
        check_regular(path)
        with open(path, "rb") as file:
            head = file.read(128)
    except OSError as error:
        raise InputError(path, "", f"expected a file of a measured signal: {error.strerror or error}") from None
    if h5py.is_hdf5(path):
        return "hdf5"
    if head.startswith(b"MATLAB") or str(path).lower().endswith(".mat"):
        return "mat"
    if head.startswith(b"PK") or head.startswith(b"\xd0\xcf\x11\xe0"):
        raise InputError(path, "", "expected a CSV file; save the sheet of this workbook as CSV")
    if head.startswith(b"\x89HDF"):
        raise InputError(path, "", "expected an HDF5 file, got a damaged one")
    return "text"


def read_mat_table(path) -> MeasuredTable:
    """Read the arrays of a MATLAB file of version 4 or 5, also those in structures, as columns."""
    from scipy.io import loadmat

    try:
        with np.errstate(all="ignore"):
            content = loadmat(path, squeeze_me=True, struct_as_record=True)
    except Exception as error:  # a damaged file fails in as many ways as the reader has
        raise InputError(path, "", f"expected a MATLAB file, got: {str(error)[:200] or type(error).__name__}") from None
    found = []
    for name, value in content.items():
        if not name.startswith("__"):
            found += _flat(name, value)
    return _table(path, found)


def read_hdf5_table(path) -> MeasuredTable:
    """Read the datasets of an HDF5 file as columns; attributes state units and the sampling rate."""
    found = []
    try:
        with h5py.File(path, "r") as file:
            if str(file.attrs.get("format", "")).startswith("wrcore"):
                raise InputError(path, "", "expected a measured signal, got a file of wrcore: wr.load_run reads runs")
            for name, dataset in _datasets(file):
                unit = next((_text(dataset.attrs[key]) for key in UNIT_NAMES if key in dataset.attrs), "")
                found.append((name, unit, dataset[()]))
            for item in (file, *(group for group in file.values() if isinstance(group, h5py.Group))):
                found += [(key, "", np.asarray(value)) for key, value in item.attrs.items() if _exponent(key)]
    except InputError:
        raise
    except Exception as error:  # a damaged file fails in as many ways as h5py has
        raise InputError(path, "", f"expected an HDF5 file, got: {str(error)[:200]}") from None
    return _table(path, found)


def _datasets(file) -> Iterator[tuple[str, h5py.Dataset]]:
    """Yield name and dataset of all datasets of numbers that are stored in the file itself."""
    names: list[str] = []
    file.visititems_links(lambda name, link: names.append(name) if isinstance(link, h5py.HardLink) else None)
    for name in names:
        if "#" in name:  # references of MATLAB
            continue
        item = file.get(name)
        if isinstance(item, h5py.Dataset) and item.dtype.kind in "fiub":
            fault = dataset_fault(item.id)
            if fault:
                raise InputError(file.filename, name, f"expected numbers in the file, got {fault}")
            yield name.replace("/", "."), item


def _flat(name, value, depth=4):
    """Return name, unit and array of each array of numbers in a value of a MATLAB file."""
    array = np.asarray(value)
    if array.dtype.names and depth and array.ndim == 0:
        unit = next((_text(array[key][()]) for key in UNIT_NAMES if key in array.dtype.names), "")
        inner = [part for key in array.dtype.names for part in _flat(f"{name}.{key}", array[key][()], depth - 1)]
        return [(key, unit or said, values) for key, said, values in inner]
    return [(name, "", array)] if array.dtype.kind in "fiub" else []


def _table(path, found) -> MeasuredTable:
    """Return the table of arrays (name, unit, values): the columns of the usual length, and the sampling rate."""
    rate, columns = 0.0, []
    for name, unit, values in found:
        values = np.squeeze(values)
        exponent = _exponent(name.rpartition(".")[2])
        if values.ndim == 0 and exponent:
            with suppress(ZeroDivisionError, OverflowError):
                rate = float(values) ** exponent
        elif values.ndim == 1 and values.size > 1:
            columns.append((name, unit, values))
        elif values.ndim == 2 and min(values.shape) <= MOST_COLUMNS:
            tall = values if values.shape[0] >= values.shape[1] else values.T
            columns += [(f"{name}.{k + 1}", unit, column) for k, column in enumerate(tall.T)]
    if not columns:
        raise InputError(path, "", "expected arrays of numbers with two samples or more, got none")
    lengths = [len(values) for _, _, values in columns]
    usual = max(dict.fromkeys(lengths), key=lengths.count)
    others = [name for name, _, values in columns if len(values) != usual]
    if others:
        warn(f"{path}: {', '.join(others[:6])} have not {usual} values as the other columns and are left out")
    columns = [column for column in columns if len(column[2]) == usual]
    names, units, arrays = (list(part) for part in zip(*columns, strict=True))
    return MeasuredTable(str(path), names, units, arrays, rate if np.isfinite(rate) else 0.0)


def _exponent(name):
    return RATES.get(name.lower().replace("_", "").replace(" ", ""))


def _text(value):
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    value = np.asarray(value)
    return (
        _text(value.flat[0]) if value.size == 1 and value.dtype.kind in "SO" else str(value) if value.size == 1 else ""
    )
