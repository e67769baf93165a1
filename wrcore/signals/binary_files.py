"""MATLAB files (version 4 and 5; 7.3 is HDF5) and HDF5 files of measured signals. No code of a file is executed."""

from __future__ import annotations

from contextlib import suppress

import h5py
import numpy as np

from wrcore.errors import InputError
from wrcore.errors.input_files import check_regular
from wrcore.errors.messages import warn
from wrcore.signals.hdf5_file import UNIT_NAMES, read_hdf5
from wrcore.signals.mat_file import read_mat5
from wrcore.signals.table import MeasuredTable

RATES = {"fs": 1, "samplerate": 1, "samplingrate": 1, "samplefrequency": 1, "samplingfrequency": 1, "rate": 1} | {
    "dt": -1, "sampletime": -1, "sampleinterval": -1, "samplinginterval": -1, "ts": -1,
}  # fmt: skip
"""Names of scalars that state the sampling rate in Hz (exponent 1) or the sampling interval in s (exponent -1)."""

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
    try:
        content = read_mat5(path) if _is_version_5(path) else _read_mat4(path)
    except Exception as error:  # a damaged file fails in as many ways as the readers have
        raise InputError(path, "", f"expected a MATLAB file, got: {str(error)[:200] or type(error).__name__}") from None
    return _table(path, [part for name, value in content.items() for part in _flat(name, value)])


def _is_version_5(path):
    """Whether a file begins with the header of MATLAB 5; files of version 4 have none."""
    with open(path, "rb") as file:
        head = file.read(128)
    return head.startswith(b"MATLAB") or head[126:128] in (b"IM", b"MI")


def _read_mat4(path):
    """Return the arrays of a file of version 4 by name."""
    from scipy.io import loadmat

    with np.errstate(all="ignore"):
        content = loadmat(path)
    return {name: value for name, value in content.items() if not name.startswith("__")}


def read_hdf5_table(path) -> MeasuredTable:
    """Read the datasets of an HDF5 file as columns; attributes state units and the sampling rate."""
    try:
        found = read_hdf5(path)
    except (ValueError, OSError) as error:
        raise InputError(path, "", f"expected an HDF5 file of a measured signal, got {error}") from None
    return _table(path, found)


def _flat(name, value):
    """Return name, unit and array of each array of numbers in a value of a MATLAB file.

    A text in a field such as ``unit`` of a structure is the unit of the structure's other fields."""
    if isinstance(value, dict):
        unit = next((value[key] for key in UNIT_NAMES if isinstance(value.get(key), str)), "")
        inner = [part for key, field in value.items() for part in _flat(f"{name}.{key}", field)]
        return [(key, unit or said, values) for key, said, values in inner]
    is_numbers = isinstance(value, np.ndarray) and value.dtype.kind in "fiub"
    return [(name, "", value)] if is_numbers else []


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
