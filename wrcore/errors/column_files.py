"""Reader of text files with columns, for profiles, irregularity, positions, creep cases, shapes of wheels and slices.

Commas, semicolons, tabs or blanks separate columns; the separator is found from the header, else from all lines. A
comma is a decimal mark if another character separates: with semicolons, tabs or blanks, and in quotes. A header names
columns with their units: ``y_mm``, ``y [mm]``, ``y (mm)``, ``y/mm``, ``y in mm``, or names in one line and units in the
next one. ``#`` starts a comment, as do ``%`` and ``!`` after a blank or at the beginning of a line. Files are UTF-8,
UTF-16 with a byte order mark, or Latin-1.
"""

import math
import re
from typing import NamedTuple

import numpy as np

from wrcore.errors import InputError
from wrcore.errors.input_files import check_regular

NO_NUMBER = "", "NA", "N/A", "n/a", "NaN", "nan", "NAN", "null", "NULL", "None"
"""Texts of cells without a number."""

_PREFIXED = {"mm": 1e-3, "cm": 1e-2, "km": 1e3, "um": 1e-6, "µm": 1e-6, "μm": 1e-6, "inch": 0.0254, "in": 0.0254}
UNITS = {
    "m": {"m": 1.0, **_PREFIXED},
    "rad": {"rad": 1.0, "mrad": 1e-3, "deg": math.pi / 180, "°": math.pi / 180},
    "m_per_s": {"m_per_s": 1.0, "m/s": 1.0, "mm_per_s": 1e-3, "mm/s": 1e-3, "km_per_h": 1 / 3.6, "km/h": 1 / 3.6},
    "rad_per_s": {"rad_per_s": 1.0, "rad/s": 1.0, "mrad_per_s": 1e-3, "mrad/s": 1e-3},
    "per_m": {"per_m": 1.0, "1/m": 1.0, "per_mm": 1e3, "1/mm": 1e3},
    "N": {"n": 1.0, "kn": 1e3},
    "Pa": {"pa": 1.0, "kpa": 1e3, "mpa": 1e6, "gpa": 1e9},
}
"""Factors to the SI unit of each quantity, by units in lower case."""

_ALL_UNITS = sorted({unit for units in UNITS.values() for unit in units}, key=len, reverse=True)
_NO_UNIT = "", "-", "1"
_COMMENT = re.compile(r"#|(?:^|(?<=[\s,;]))[%!]")
_QUOTED = re.compile(r'"[^"]*"')
_SINGLE = re.compile(r"""(?:(?<=[\s,;])|^)'([^'"]*)'(?=[\s,;]|$)""")
_WORD = re.compile(r'"[^"]*"|[^\s\[("]+(?:\s*[\[(][^\])]*[\])])?')  # with a unit in brackets
_COMMA_NUMBER = re.compile(r"[+-]?(\d+,?\d*|,\d+)([eEdD][+-]?\d+)?")
_DECIMAL_COMMAS = "; decimal commas are read beside semicolons, tabs or blanks, and in quotes"


class ColumnFile(NamedTuple):
    """Cells of a file with columns, as text."""

    path: str
    names: tuple[str, ...]
    """Names of columns as in the header; empty without a header."""
    header: tuple
    """Line number and text of the header."""
    cells: list
    """List of cells for each row."""
    lines: list
    """Line number of each row."""
    texts: list
    """Text of each row as in the file."""

    def numbers(self, columns, factors=None, empty=False, expected=""):
        """Return the numbers (rows, len(columns)) of columns, times ``factors``.

        An InputError names the line of a cell that is not a number. If ``empty``, cells without a number are NaN."""
        table = np.empty((len(self.cells), len(columns)))
        commas = points = None
        for row, cells in enumerate(self.cells):
            for k, column in enumerate(columns):
                cell = cells[column] if column < len(cells) else ""
                try:
                    table[row, k] = number(cell)
                except ValueError:
                    if not empty or cell not in NO_NUMBER:
                        raise self.fault(row, len(columns), expected) from None
                    table[row, k] = math.nan
                commas = (cell, row) if "," in cell else commas
                points = cell if "." in cell and cell in self.texts[row] else points  # a point of the file itself
        if commas and points:
            expected = f"expected one decimal mark in a file, got {commas[0]} and {points}"
            raise InputError(self.path, f"line {self.lines[commas[1]]}", expected)
        return table if factors is None else table * np.asarray(factors)

    def fault(self, row, count, expected=""):
        """Return an InputError for a row that does not hold ``count`` numbers, or the content ``expected``."""
        text = self.texts[row]
        count = max(count, len(self.names))
        many = expected or {1: "a number", 2: "two numbers"}.get(count, f"{count} numbers")
        hint = _DECIMAL_COMMAS if "," in text else ""
        return InputError(self.path, f"line {self.lines[row]}", f"expected {many}, got {text[:40]!r}{hint}")


def number(text):
    """Return the number of a cell; raise a ValueError if it is not a number."""
    try:
        if "_" not in text:
            return float(text)
    except ValueError:
        text = text.replace("\u2212", "-")
        if _COMMA_NUMBER.fullmatch(text) or re.fullmatch(r"[+-]?[\d.]+[dD][+-]?\d+", text):
            return float(text.replace(",", ".").lower().replace("d", "e"))
        return float(text)
    raise ValueError(text)


def read_text(path, what="a CSV file with a header line"):
    """Return the text of a regular file without its byte order mark; raise an InputError if it cannot be read."""
    try:
        check_regular(path)
        with open(path, "rb") as file:
            data = file.read()
    except (OSError, ValueError) as error:
        fault = getattr(error, "strerror", None) or error
        raise InputError(path, "", f"expected {what}: {fault}") from None
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return data.decode("utf-16", errors="replace")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def read_column_file(path, rows=None, header=True):
    """Return the `ColumnFile` of a file, or of its ``rows`` (line number, text) without comments.

    ``header`` True: the first line is the header. False: the first line is the header if it holds a word that is not a
    number; lines ``Name=value`` before it are skipped. None: there is no header, and rows may end with remarks."""
    comments = ()
    if rows is None:
        rows, comments = _rows(read_text(path))
    elif isinstance(rows, str):
        rows, comments = _rows(rows)
    while header is False and rows and re.match(r"[A-Za-z]\w*\s*=", rows[0][1]):
        del rows[0]
    head = _take_header(rows, comments, header)
    lines, texts = [row[0] for row in rows], [row[1] for row in rows]
    for line, text in (head, *zip(lines, texts, strict=True)):
        if text.count('"') % 2:
            raise InputError(path, f"line {line}", f"expected quotes that end in their line, got {text[:40]!r}")
    separator = _separator(texts, head[1])
    names = _split(head[1], _separator([head[1]], head[1], separator)) if head[1] else []
    names = names[: len(names) - _n_empty(names)]
    twice = next((name for k, name in enumerate(names) if name and name in names[:k]), None)
    if twice and _is_header(head[1]):  # numbers in place of a header may be equal
        raise InputError(path, f"line {head[0]}", f"expected each column once, got {twice} twice")
    cells = _evened([_split(text, separator) for text in texts], len(names), separator)
    if names and cells and _are_units(cells[0], len(names)):
        units = [cell.strip("[]() ") for cell in cells[0]]
        names = [name if unit in _NO_UNIT else f"{name} [{unit}]" for name, unit in zip(names, units, strict=True)]
        del cells[0], lines[0], texts[0]
    file = ColumnFile(str(path), tuple(names), head, cells, lines, texts)
    if separator == "," and not names and cells and len(cells[0]) > 2 and not any(re.search('[."]', x) for x in texts):
        raise InputError(path, f"line {lines[0]}", f"expected numbers with decimal points{_DECIMAL_COMMAS}")
    if header is not None:
        _check_counts(file, header)
    return file


def _take_header(rows, comments, header):
    """Return line number and text of the header and remove it from the rows; 0 and empty text without a header."""
    if rows and header is not None and _is_header(rows[0][1]):
        return rows.pop(0)
    above = [row for row in comments if rows and row[0] < rows[0][0]]
    if above and _units_in(above[-1][1]) and _fits(above[-1][1], rows):  # NumPy and MATLAB write it as a comment
        return above[-1]
    return rows.pop(0) if rows and header else (0, "")


def _check_counts(file, header):
    """Raise an InputError for rows with too many cells, or, unless the file must have a header, with too few cells."""
    count = len(file.names) or len(file.cells[0] if file.cells else ())
    for row, cells in enumerate(file.cells):
        if len(cells) > count or (len(cells) < count and not header):
            if not header:
                raise file.fault(row, count)
            expected = f"expected {count} cells in each row, as in the header, got {len(cells)}"
            raise InputError(
                file.path, f"line {file.lines[row]}", expected + _DECIMAL_COMMAS * ("," in file.texts[row])
            )


def header_of(path):
    """Return a `ColumnFile` with only the names in the header of a file; without names if it cannot be read."""
    try:
        rows, _ = _rows(read_text(path))
    except InputError:
        return ColumnFile(str(path), (), (0, ""), [], [], [])
    text = rows[0][1] if rows else ""
    return ColumnFile(str(path), tuple(_split(text, _separator([text], text))), (0, text), [], [], [])


def read_table(path, text="", known=()):
    """Read a file of columns with a header line into a table (pandas.DataFrame).

    Columns whose SI names are ``known`` may have other units; they are converted to SI units. The column ``text`` is
    not converted to numbers. Columns with a cell that is neither a number nor empty also remain text."""
    import pandas as pd

    file = read_column_file(path)
    if not file.names:
        raise InputError(path, "", "expected a CSV file with a header line, got an empty file")
    found = named_columns(file, known)
    columns = {}
    for k, name in enumerate(file.names):
        name, factor = found.get(k, (name, 1.0))
        if name in columns:
            raise InputError(path, f"line {file.header[0]}", f"expected each column once, got {name} twice")
        cells = [row[k] if k < len(row) else "" for row in file.cells]
        columns[name] = cells if name == text else _column(file, k, factor, cells)
    return pd.DataFrame(columns)


def _column(file, k, factor, cells):
    """Return the numbers of a column, or its cells as text if a cell is not a number."""
    try:
        return file.numbers([k], [factor], empty=True)[:, 0]
    except InputError as error:
        if "decimal mark" in error.expected:
            raise
        return np.array([math.nan if cell in NO_NUMBER else cell for cell in cells], dtype=object)


def named_columns(file, known, aliases=None):
    """Return the known name of each column and the factor to its SI unit, (name, factor) by index of the column.

    ``known`` are names with SI units, such as ``level_m``; ``aliases`` maps other names to them, both without units.
    Columns with other names are left out. An InputError names a known column without a unit, or with a unit of another
    quantity."""
    bases = {split_unit(name)[0]: (name, split_unit(name)[1]) for name in known}
    found = {}
    for k, name in enumerate(file.names):
        if name in known:
            found[k] = (name, 1.0)
            continue
        base, unit = split_unit(name)
        base = (aliases or {}).get(base, base)
        if base not in bases or bases[base][0] in file.names:
            continue
        canonical, quantity = bases[base]
        units = UNITS.get(quantity, {"": 1.0})
        if unit.lower() not in units:
            example = " or ".join(f"{base}_{unit}" for unit in (*units, *units)[:2]) if quantity else base
            got = f"got {name!r}" + " without a unit" * (not unit)
            raise InputError(file.path, name, f"expected a column such as {example}, {got}")
        found[k] = (canonical, units[unit.lower()])
    return found


def split_unit(name):
    """Return the name of a column, in lower case with underscores, and its unit, empty without a unit."""
    name = name.strip().strip('"').strip()
    bracket = re.fullmatch(r"(.*?)[\s,_]*[\[(]\s*([^\])]*?)\s*[\])]", name)
    match = bracket
    if not match:
        ending = next((unit for unit in _ALL_UNITS if re.search(rf"[_\s]{re.escape(unit)}$", name.lower())), None)
        if ending:
            base, unit = name[: -len(ending) - 1], name[-len(ending) :]
            base = re.sub(r"\s+in$", "", base.rstrip())
            return _plain(base), _si_case(unit)
        match = re.fullmatch(r"(.+?)\s*/\s*(.+)", name)
    return (_plain(match[1]), _si_case(match[2])) if match else (_plain(name), "")


def _plain(name):
    return re.sub(r"[\s\-]+", "_", name.strip()).lower()


def _si_case(unit):
    """Return a unit as `UNITS` writes SI units, or unchanged if it is not one of them."""
    return next((quantity for quantity in UNITS if quantity.lower() == unit.lower()), unit)


def _rows(text):
    """Return the lines with cells, and the comment lines, each with line number and text."""
    rows, comments = [], []
    for k, line in enumerate(text.splitlines(), 1):
        line = _SINGLE.sub(r'"\1"', line) if "'" in line else line
        bare = _QUOTED.sub(lambda quoted: "_" * len(quoted[0]), line) if '"' in line else line
        mark = _COMMENT.search(bare)
        cells = (line[: mark.start()] if mark else line).strip()
        if cells:
            rows.append((k, cells))
        elif mark:
            comments.append((k, line.strip().lstrip("#%! \t")))
    return rows, comments


def _is_header(line):
    """Whether a line has words that are not numbers."""
    words = [word for word in re.split(r'[\s,;"]+', line) if word]
    return any(re.search(r"[^\W\d_]", word) and not _is_number(word) for word in words)


def _is_number(word):
    try:
        number(word)
    except ValueError:
        return False
    return True


def _units_in(line):
    """Whether all words of a line are names with a unit."""
    words = _split(line, _separator([line], line))
    return len(words) > 1 and all(split_unit(word)[1] for word in words)


def _fits(head, rows):
    return len(_split(head, _separator([head], head))) == len(_split(rows[0][1], _separator([rows[0][1]])))


def _are_units(cells, count):
    """Whether a row holds only units."""
    units = {cell.strip("[]() ").lower() for cell in cells} - set(_NO_UNIT)
    return len(cells) == count and bool(units) and units <= set(_ALL_UNITS)


def _bare(lines):
    return [_QUOTED.sub("_", line) if '"' in line else line for line in lines]


def _separator(lines, header="", default=None):
    """Return the separator of cells in lines: ",", ";", tab, " " or ", " (commas and blanks)."""
    lines, header = _bare(lines), _bare([header])[0]
    joined = "\n".join(lines)
    if default and default.strip(" ") and default in header:
        return default
    for separator in (";", "\t", ","):  # the separator of the header, if rows use it
        if separator in header.replace(",\t", ",") and separator in joined.replace(",\t", ","):
            return separator
    if ";" in joined:
        return ";"
    if lines and all("\t" in line.replace(",\t", ",") for line in lines):
        return "\t"
    if "," not in joined or (header and not re.search("[;\t,]", header)) or all(map(_decimal_commas, lines)):
        return " "
    return ", " if re.search(r"[^\s,][ ]+[^\s,]", joined) else ","


def _decimal_commas(line):
    """Whether a line consists of two or more numbers separated by blanks, with or without decimal commas."""
    words = line.split()
    return len(words) > 1 and all(map(_COMMA_NUMBER.fullmatch, words))


def _split(line, separator):
    """Return the cells of a line, without quotes and surrounding blanks."""
    if separator == " ":
        return [word.strip('"').strip() for word in _WORD.findall(line.strip(" ,"))]
    if separator == ", ":
        cells = re.split(r"\s*,\s*|\s+", line.strip(" ,"))
        return cells if all(re.search("[.eE]", cell) for cell in cells) else [line]
    if '"' not in line:
        return [cell.strip() for cell in line.split(separator)]
    cells = re.findall(rf'((?:"[^"]*"|[^"{separator}])*)(?:{separator}|$)', line)
    return [cell.strip().strip('"').strip() for cell in (cells[:-1] if not line.endswith(separator) else cells)]


def _evened(rows, count, separator):
    """Return rows without cells that are empty at the beginning or end of all rows, and with repeated tabs merged."""
    if separator == "\t" and len({len(row) for row in rows} | ({count} if count else set())) > 1:
        joined = [[cell for k, cell in enumerate(row) if cell or k == len(row) - 1] for row in rows]
        if len({len(row) for row in joined} | ({count} if count else set())) == 1:
            return joined
    if rows and not count and all(not row[0] for row in rows):
        rows = [row[1:] for row in rows]
    ends = 0
    while rows and not count and all(len(row) > ends and not row[-1 - ends] for row in rows):
        ends += 1
    rows = [row[: len(row) - ends] for row in rows]
    return [row[: max(count, len(row) - _n_empty(row))] for row in rows] if count else rows


def _n_empty(row):
    """Return the number of empty cells at the end of a row."""
    return next((k for k, cell in enumerate(reversed(row)) if cell), len(row))
