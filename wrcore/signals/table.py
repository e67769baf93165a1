"""Columns of a measured file as they stand in the file, and their conversion to channels in SI units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from wrcore.errors import InputError, one_of
from wrcore.run.output.channels import unit_of
from wrcore.signals.units import channel_of_title, is_of_channel, plain_unit, split_title, suffix_and_factor

LOGGER_EMPTY = "", "-", "--", "---", "NA", "N/A", "n/a", "nan", "NaN", "NAN", "null", "NULL", "None", "#N/A", "#NV",\
    "#DIV/0!", "#VALUE!", "#WERT!", "#REF!", "Over", "OVER", "Inf", "inf", "-inf", "-Inf"  # fmt: skip
"""Texts of cells without a value, as spreadsheets and loggers write them; infinite values are among them."""


@dataclass
class MeasuredTable:
    """Columns of a file, as numbers, or as text where the file holds neither numbers nor empty cells."""

    path: str
    titles: list[str]
    """Titles of the columns as in the file."""
    units: list[str]
    """Units that the file states in a line or attribute of their own; empty texts where it states none."""
    columns: list[np.ndarray]
    """Values of each column; all have the same length."""
    rate: float = 0.0
    """Sampling rate that the file states, Hz, or 0."""
    lines: list[int] = field(default_factory=list)
    """Line number of each row in a text file; empty for other files."""

    def __post_init__(self):
        for k, title in enumerate(self.titles):
            same = self.titles[:k].count(title)
            if same:
                self.titles[k] = f"{title} ({same + 1})"

    def name_and_unit(self, k: int) -> tuple[str, str]:
        """Return the name of a column without its unit, and the unit."""
        if self.units[k].strip("[]() "):
            return self.titles[k], self.units[k].strip("[]() ")
        return split_title(self.titles[k])

    def index(self, title: str, argument: str) -> int:
        """Return the index of the column with a title, or with a name without its unit, whatever its case."""
        names = [self.name_and_unit(k)[0] for k in range(len(self.titles))]
        for known in (self.titles, names):
            compared = [_compared(text) for text in known]
            if _compared(title) in compared:
                return compared.index(_compared(title))
        raise InputError(self.path, f"{argument} {title}", one_of(self.titles, title))

    def where(self, row: int) -> str:
        """Return the text for messages that names a row."""
        return f"line {self.lines[row]}" if self.lines else f"row {row + 1}"

    def numbers(self, k: int) -> np.ndarray:
        """Return the values (n,) of a column as numbers, NaN where the file has none; InputError for other text."""
        column = self.columns[k]
        if column.dtype.kind in "fiub":
            values = column.astype(float)
            return np.where(np.isfinite(values), values, np.nan)
        for row, cell in enumerate(column):
            text = "" if cell is None or cell != cell else str(cell).strip()
            if text not in LOGGER_EMPTY and not _is_number(text):
                expected = f"expected a number in column {self.titles[k]!r}, got {text[:40]!r}"
                raise InputError(self.path, self.where(row), f"{expected}; one decimal mark in all rows")
        return np.array([float(cell) if _is_number(str(cell)) else np.nan for cell in column])

    def channels(
        self, wanted: Mapping[str, str] | None, units: Mapping[str, str], axis_column: int | None
    ) -> tuple[dict[str, np.ndarray], dict[str, str]]:
        """Return channels in SI units and their units, both by name.

        ``wanted`` maps titles to channels, a minus before the channel reverses the sign; None: all columns of numbers
        but the ``axis_column``, under names made of their titles. ``units`` are units by title that replace
        those of the file. An InputError names a column whose unit is missing or cannot be that of its channel."""
        given = {self.index(title, "units"): unit for title, unit in units.items()}
        for title, unit in units.items():
            if not plain_unit(unit):
                expected = f"expected a unit such as mm, kN, g or m/s2, got {unit!r}"
                raise InputError(self.path, f"units {title}", expected)
        if wanted is None:
            return self._all_channels(given, axis_column)
        values, si = {}, {}
        for title, channel in wanted.items():
            k, sign, channel = self.index(title, "channels"), -1.0 if channel[:1] == "-" else 1.0, channel.lstrip("-")
            name, unit = self.name_and_unit(k)
            unit = given.get(k, unit) or ("1" if is_of_channel("1", channel) else "")
            if not is_of_channel(unit, channel):
                got = f"a unit of {channel}, got {unit!r}" if unit else f"its unit, for {channel}"
                raise InputError(self.path, self.titles[k], f"expected {got}; units={{{name!r}: 'mm'}} states one")
            if channel in values:
                raise InputError(self.path, f"channels {title}", f"expected each channel once, got {channel} twice")
            values[channel] = sign * suffix_and_factor(unit)[1] * self.numbers(k)
            si[channel] = _si(unit)
        return values, si

    def _all_channels(self, given, axis_column):
        values, si = {}, {}
        for k, column in enumerate(self.columns):
            if k == axis_column or column.dtype.kind not in "fiub" or not np.isfinite(column.astype(float)).any():
                continue
            name, unit = self.name_and_unit(k)
            unit = given.get(k, unit)
            known = suffix_and_factor(unit)
            channel = channel_of_title(name, unit)
            channel = channel if channel not in values else f"{channel}_{k + 1}"
            values[channel] = (known[1] if known else 1.0) * self.numbers(k)
            si[channel] = _si(unit) if known else unit
        return values, si


def _compared(text):
    """Return a title as titles are compared: in lower case, with blanks for underscores."""
    return text.strip().lower().replace("_", " ")


def _si(unit):
    """Return the SI unit of a unit's quantity, as channels of a run state it."""
    return unit_of(f"x{suffix_and_factor(unit)[0]}")


def _is_number(text):
    try:
        return np.isfinite(float(text))
    except ValueError:
        return False
