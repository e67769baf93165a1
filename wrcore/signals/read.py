"""Reader of measured signals: text files, MATLAB files and HDF5 files."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from typing import Annotated

from wrcore.errors import InputError
from wrcore.errors.checked_calls import ABOVE_ZERO, checked
from wrcore.signals.axis import axis_of
from wrcore.signals.binary_files import kind_of, read_hdf5_table, read_mat_table
from wrcore.signals.signal import Signal
from wrcore.signals.text_file import read_text_table

READERS = {"hdf5": read_hdf5_table, "mat": read_mat_table, "text": read_text_table}


@checked
def read_signal(
    path: str | PathLike[str],
    channels: Mapping[str, str] | None = None,
    axis: str | None = None,
    rate: Annotated[float, ABOVE_ZERO] | None = None,
    units: Mapping[str, str] | None = None,
) -> Signal:
    """Read a measured signal: CSV of spreadsheets, loggers and recording cars, MATLAB files, HDF5.

    Separators, decimal commas, header lines, units and the sampling rate are found in the file. No code of a file is
    executed.

    Parameters
    ----------
    path : str or Path
    channels : mapping of str to str, optional
        Channel of a run by title of a column, with or without its unit: ``{"Acc Y": "car_body.ay_m_per_s2"}``. A minus
        before the channel reverses the sign. By default all columns are read, under their titles with the SI unit.
    axis : str, optional
        Title of the column with the time or the distance. By default it is found by its name; time comes first.
    rate : float, optional
        Sampling rate, Hz, of a file without a column of time; replaces what the file states.
    units : mapping of str to str, optional
        Unit by title of a column, such as ``{"Acc Y": "g"}``; replaces what the file states.

    Returns
    -------
    Signal
        In SI units. Cells without a number are NaN.

    Raises
    ------
    InputError
        One line that names the file, the line or column, and the expected content. A channel with a unit needs a column
        with a unit.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "car.csv"
    ...     lines = ["Zeit [s];Acc Y [g];Q [kN]", "0,00;0,1;50", "0,01;-0,1;51", "0,02;0,0;49,5"]
    ...     _ = path.write_text(chr(10).join(lines))
    ...     signal = read_signal(path, {"Acc Y": "car_body.ay_m_per_s2", "Q": "wheelset/left.Q_N"})
    >>> signal["wheelset/left.Q_N"].tolist(), signal["car_body.ay_m_per_s2"].round(3).tolist()
    ([50000.0, 51000.0, 49500.0], [0.981, -0.981, 0.0])
    """
    table = READERS[kind_of(path)](path)
    units = dict(units or {})
    name, x, rows, column = axis_of(table, axis, rate, units)
    values, si = table.channels(channels, units, column)
    if not values:
        raise InputError(path, "", f"expected a column of numbers beside {table.titles[column or 0]!r}")
    return Signal(name, x, {key: part[rows] for key, part in values.items()}, si, str(path))
