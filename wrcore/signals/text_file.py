"""Text files of measured signals, as spreadsheets, loggers and recording cars write them.

Semicolons, tabs, commas or blanks separate columns. The decimal mark is a point or a comma. Lines above the first row
of values are the header: the last one with as many cells as the rows has the titles, or the units below the titles.
Other header lines are searched for the sampling rate.
"""

from __future__ import annotations

import io
import re
from collections import Counter

import numpy as np
import pandas as pd

from wrcore.errors import InputError
from wrcore.errors.column_files import read_text
from wrcore.errors.messages import warn
from wrcore.signals.table import LOGGER_EMPTY, MeasuredTable
from wrcore.signals.units import plain_unit

EXPECTED = "a CSV file, a MATLAB file (.mat) or an HDF5 file of a measured signal"

SAMPLED_ROWS = 60
"""Number of rows from which separator and decimal mark are found."""

SEPARATORS = (";", "\t", ",", " ")
"""Separators in the order in which they are tried; of equal results the first is taken."""

_NUMBER = re.compile(r"[+-]?(\d[\d.,]*|[.,]\d+)([eEdD][+-]?\d+)?")
_TIME = re.compile(r"(\d{1,4}[-./]\d{1,2}[-./]\d{1,4}[ T]?)?(\d{1,3}:\d{2}(:\d{2}([.,:]\d+)?)?)?Z?")
_CHAINAGE = re.compile(r"[+-]?\d+\s?\+\s?\d+([.,]\d+)?")
_THOUSANDS = {",": re.compile(r"[+-]?\d{1,3}(\.\d{3})+,\d+"), ".": re.compile(r"[+-]?\d{1,3}(,\d{3})+\.\d+")}

_VALUE = r"[^\d+-]{0,30}?([\d]+(?:[.,]\d+)?(?:[eE][+-]?\d+)?)\s*\"?[;,\t ]*\"?\s*\(?\[?"
_RATE = re.compile(
    rf"(?:sampl\w*[ _-]*(?:rate|freq\w*)|abtastrate|abtastfrequenz|messrate|\bfs\b){_VALUE}(k?hz|1/s)?", re.I
)
_STEP = re.compile(
    rf"(?:(?:sampl\w*|abtast\w*)[ _-]*(?:interval\w*|period|time|zeit)|abtastintervall|\bdt\b|\bdelta ?t\b){_VALUE}"
    r"(ms|us|µs|s)?\b", re.I,
)  # fmt: skip
"""Sampling rate or sampling interval in a header line: its name, value and unit."""


def read_text_table(path) -> MeasuredTable:
    """Read a text file with columns; an InputError of one line says what a damaged file lacks."""
    text = read_text(path, EXPECTED)
    if "\0" in text[:10000]:
        raise InputError(path, "", f"expected {EXPECTED}, got another kind of file")
    rows = [(k, line) for k, line in enumerate(text.splitlines(), 1) if line.strip()]
    if rows and (said := re.fullmatch(r'"?sep=(.)"?\s*', rows[0][1], re.I)):
        separator = said[1]
        rows = rows[1:]
    else:
        separator = _find_separator([line for _, line in rows], path)
    begin, count = _first_row(rows, separator, path)
    titles, units, others = _header(rows[:begin], separator, count)
    body = [(k, line) for k, line in rows[begin:] if not line.lstrip().startswith(("#", "%", "//"))]
    body = _without_cut_line(body, separator, count, text, path)
    columns = _columns(body, separator, count, path)
    titles = titles[: len(columns)] + [f"column {k + 1}" for k in range(len(titles), len(columns))]
    units = (units + [""] * len(columns))[: len(columns)]
    return MeasuredTable(str(path), titles, units, columns, _rate(others), [k for k, _ in body])


def split(line, separator):
    """Return the cells of a line without quotes and surrounding blanks."""
    if separator == " ":
        return [cell.strip("\"'") for cell in line.split()]
    if '"' not in line:
        return [cell.strip() for cell in line.split(separator)]
    cells = re.findall(rf'((?:"[^"]*"|[^"{separator}])*)(?:{re.escape(separator)}|$)', line)
    return [cell.strip().strip('"').strip() for cell in (cells[:-1] if not line.endswith(separator) else cells)]


def _is_value(cell):
    """Whether a cell holds a number, a time or date, or a chainage such as 12+450."""
    return bool(cell) and bool(_NUMBER.fullmatch(cell) or _TIME.fullmatch(cell) or _CHAINAGE.fullmatch(cell))


def _sample(lines):
    """Return rows of the second half of a file, in which header lines are unlikely."""
    half = lines[len(lines) // 2 :]
    return half[:: max(len(half) // SAMPLED_ROWS, 1)][:SAMPLED_ROWS]


def _find_separator(lines, path):
    """Return the separator with which most rows have equally many cells that are values."""
    best, found = 0.0, ""
    for separator in SEPARATORS:
        rows = [_values_in(line, separator) for line in _sample(lines)]
        (n_values, n_cells), n_rows = Counter(rows).most_common(1)[0] if rows else ((0, 0), 0)
        share = round(n_rows * n_values / max(len(rows) * n_cells, 1), 1)
        if n_cells > 1 and share > best:
            best, found = share, separator
    if found == "," and _are_decimal_commas(lines):
        return ";"
    if not found and any(_is_value(line.strip().strip('"')) for line in _sample(lines)):
        return ";"  # a single column
    if not found:
        got = "a text without rows of numbers" if lines else "no lines"
        raise InputError(path, "", f"expected {EXPECTED}, got {got}")
    return found


def _values_in(line, separator):
    """Return the number of cells of a line that are values, and the number of cells."""
    cells = split(line, separator)
    return sum(map(_is_value, cells)), len(cells)


def _are_decimal_commas(lines):
    """Whether the commas of a file with one title and no points are decimal marks of a single column."""
    rows = _sample(lines)
    two = all(len(split(line, ",")) == 2 and "." not in line for line in rows)
    titles = [line for line in lines[: len(lines) // 2] if not _is_value("".join(split(line, ",")[:1]))]
    return two and bool(titles) and "," not in titles[-1]


def _first_row(rows, separator, path):
    """Return the index of the first row of values, and the number of cells of the rows."""
    cells = [split(line, separator) for line in _sample([line for _, line in rows])]
    count = Counter(map(len, cells)).most_common(1)[0][0]
    full = [row for row in cells if len(row) == count]
    of_numbers = [k for k in range(count) if 2 * sum(_is_value(row[k]) for row in full) > len(full)]
    partly = [k for k in range(count) if any(_is_value(row[k]) for row in full)]

    def is_row(line):
        row = split(line, separator)
        known = [row[k] for k in of_numbers or partly if k < len(row)]
        fits = len(row) <= count + 1 and any(map(_is_value, known))
        return fits and all(_is_value(cell) or cell in LOGGER_EMPTY for cell in known)

    for k, (_, line) in enumerate(rows):
        if is_row(line) and (k + 1 == len(rows) or is_row(rows[k + 1][1])):
            return k, count
    raise InputError(path, "", f"expected {EXPECTED}, got a text without rows of numbers")


def _header(rows, separator, count):
    """Return titles, units and the other lines of the header."""
    lines = [line.lstrip("#%! /").rstrip() for _, line in rows]
    cells = [_title_cells(line, separator, count) for line in lines]
    at = next((k for k in range(len(lines) - 1, -1, -1) if _may_be_titles(cells[k], count)), None)
    if at is None:
        return [], [], lines
    if at and _are_units(cells[at]) and _may_be_titles(cells[at - 1], count):
        return cells[at - 1], [cell if plain_unit(cell) else "" for cell in cells[at]], lines[: at - 1]
    return cells[at], [], lines[:at] + lines[at + 1 :]


def _title_cells(line, separator, count):
    """Return the cells of a header line; beside columns separated by blanks, tabs or two blanks may separate titles."""
    cells = split(line, separator)
    if separator == " " and len(cells) != count:
        others = [split(line, "\t"), [cell.strip() for cell in re.split(r"\s{2,}", line.strip())], split(line, ",")]
        in_brackets = re.findall(r"[^\s\[(]+(?:\s*[\[(][^\])]*[\])])?", line)
        return next((other for other in (*others, split(line, ";"), in_brackets) if len(other) == count), cells)
    return cells


def _may_be_titles(cells, count):
    """Whether a header line has as many cells as the rows, one more or one less, and a letter."""
    filled = [cell for cell in cells if cell]
    return count <= len(cells) + (len(cells) > 1) and len(cells) <= count + 1 and any(map(_has_letter, filled))


def _has_letter(cell):
    return bool(re.search(r"[^\W\d_]|[%‰°]", cell))


def _are_units(cells):
    """Whether all cells of a line are units or empty."""
    return all(cell.strip("[]() ") in ("", "-") or plain_unit(cell) for cell in cells) and any(map(plain_unit, cells))


def _without_cut_line(body, separator, count, text, path):
    """Return the rows without a last line that the writing program did not finish."""
    if len(body) > 1 and not text.endswith(("\n", "\r")) and len(split(body[-1][1], separator)) < count:
        warn(f"{path}: line {body[-1][0]} is incomplete and is left out")
        return body[:-1]
    return body


def _columns(body, separator, count, path):
    """Return the values of all columns; columns that are not only numbers stay text."""
    cells = [cell for _, line in body[:SAMPLED_ROWS] for cell in split(line, separator)]
    cells += [cell for line in _sample([line for _, line in body]) for cell in split(line, separator)]
    decimal = "," if any("," in cell and _NUMBER.fullmatch(cell) and "." not in cell for cell in cells) else "."
    decimal = "," if any(map(_THOUSANDS[","].fullmatch, cells)) else decimal
    has_thousands = any(map(_THOUSANDS[decimal].fullmatch, cells))
    try:
        frame = pd.read_csv(
            io.StringIO("\n".join(line for _, line in body)), sep=r"\s+" if separator == " " else separator,
            header=None, names=range(count + 1), decimal=decimal, na_values=list(LOGGER_EMPTY), keep_default_na=True,
            skipinitialspace=True, low_memory=False, index_col=False, encoding_errors="replace",
            thousands=({",": ".", ".": ","}[decimal] if has_thousands else None),
        )  # fmt: skip
    except (ValueError, OverflowError, pd.errors.ParserError) as error:
        said = re.search(r"Expected (\d+) fields in line (\d+), saw (\d+)", str(error))
        if said:
            where = f"line {body[int(said[2]) - 1][0]}"
            raise InputError(path, where, f"expected {count} cells, got {said[3]}") from None
        raise InputError(path, "", f"expected {EXPECTED}, got: {error}") from None
    if frame[count].isna().all():
        frame = frame.drop(columns=count)
    else:
        row = int(frame[count].notna().to_numpy().argmax())
        raise InputError(path, f"line {body[row][0]}", f"expected {count} cells, got {count + 1}")
    columns = [frame[k].to_numpy() for k in frame]
    while len(columns) > 1 and columns[-1].dtype.kind == "f" and np.isnan(columns[-1]).all():
        del columns[-1]  # a separator at the end of every line
    return [column if column.dtype.kind in "fiub" else column.astype(object) for column in columns]


def _rate(lines):
    """Return the sampling rate (Hz) that header lines state, or 0."""
    for line in lines:
        text = line.replace('"', "")
        if said := _RATE.search(text):
            return float(said[1].replace(",", ".")) * (1e3 if (said[2] or "").lower() == "khz" else 1.0)
        if said := _STEP.search(text):
            step = float(said[1].replace(",", ".")) * {"ms": 1e-3, "us": 1e-6, "µs": 1e-6}.get(said[2] or "s", 1.0)
            return 1.0 / step if step > 0.0 else 0.0
    return 0.0
