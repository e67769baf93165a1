"""Time or distance of the samples of a measured file."""

from __future__ import annotations

import re
from typing import Literal

import numpy as np
import pandas as pd

from wrcore.errors import InputError
from wrcore.errors.messages import warn
from wrcore.signals.table import MeasuredTable
from wrcore.signals.units import suffix_and_factor

TIME_NAMES = {
    "t", "time", "times", "timestamp", "time stamp", "elapsed", "elapsed time", "rel time", "zeit", "messzeit",
    "zeitstempel", "uhrzeit", "sec", "seconds", "clock", "date", "datetime", "date time", "datum", "temps", "tempo",
}  # fmt: skip
DISTANCE_NAMES = {
    "s", "x", "distance", "dist", "chainage", "station", "position", "km", "kp", "pk", "kilometre", "kilometer",
    "milepost", "mileage", "location", "weg", "laufweg", "strecke", "track position", "abstand",
}  # fmt: skip
"""Names of columns with time and with distance, in lower case; several languages of loggers."""

AXES: dict[str, Literal["t_s", "s_m"]] = {"_s": "t_s", "_m": "s_m"}
"""Name of the axis of a signal by the suffix of its unit: time in s, or distance in m."""

LARGEST_ROUNDING = 1.01
"""Largest error of a clock that is replaced by even steps, in units of the clock's resolution. Clocks that cut digits
off have errors up to 1."""

_CHAINAGE = re.compile(r"([+-]?\d+)\s?\+\s?(\d+(?:[.,]\d+)?)")


def axis_of(
    table: MeasuredTable, wanted: str | None, rate: float | None, units: dict[str, str]
) -> tuple[Literal["t_s", "s_m"], np.ndarray, np.ndarray, int | None]:
    """Return the axis of a file: its name (``t_s`` or ``s_m``), its values, the rows to keep and its column.

    ``wanted`` is the title of its column, ``rate`` the sampling rate (Hz) that replaces one; None: both are found in
    the file. Values increase, in s or m; the column is None for an axis made of the sampling rate."""
    count = len(table.columns[0])
    k = table.index(wanted, "axis") if wanted else None
    if k is None and rate is None:
        k = _find(table)
    if k is None:
        rate = rate or table.rate
        if not rate:
            expected = "expected a column of time or distance, or a sampling rate; axis= names a column, rate= is in Hz"
            raise InputError(table.path, "", f"{expected}; columns: {', '.join(table.titles)}")
        values, rows = np.arange(count) / rate, np.arange(count)
        return "t_s", values, _check_count(rows, table.path), None
    given = {table.index(title, "units"): unit for title, unit in units.items()}
    suffix, values = _values(table, k, given.get(k))
    rows = np.flatnonzero(np.isfinite(values))
    if len(rows) < count:
        warn(f"{table.path}: {count - len(rows)} rows without {table.titles[k]!r} are left out")
    _check_count(rows, table.path)
    name = AXES[suffix]
    values, chosen = (_even_times if name == "t_s" else _forward_distances)(values[rows], rows, table)
    return name, values, rows[chosen], k


def _find(table):
    """Return the index of the first column with time, else with distance, else None."""
    for names, suffix in ((TIME_NAMES, "_s"), (DISTANCE_NAMES, "_m")):
        for k in range(len(table.titles)):
            name, unit = table.name_and_unit(k)
            words = re.sub(r"[_\s\-]+", " ", name.rpartition(".")[2].lower()).strip()
            known = suffix_and_factor(unit)
            if words in names and (not unit or (known and known[0] == suffix)) and not (words == "x" and not unit):
                return k
    return None


def _values(table, k, given):
    """Return the suffix of the unit (``_s`` or ``_m``) and the values, in s or m, of the column of an axis."""
    name, unit = table.name_and_unit(k)
    unit, column = given or unit, table.columns[k]
    is_text = column.dtype.kind not in "fiub"
    if is_text and _CHAINAGE.fullmatch(str(column[0]).strip()):
        return "_m", np.array([_metres(cell, table, row) for row, cell in enumerate(column)])
    if is_text and ":" in str(column[0]):
        return "_s", _seconds(column, table, k)
    words = name.rpartition(".")[2].lower()
    unit = unit or ("km" if words in ("km", "kp", "pk") else "s" if words in TIME_NAMES else "")
    known = suffix_and_factor(unit)
    if known is None or known[0] not in AXES:
        expected = f"expected the unit of a time or a distance, such as s or km, got {unit!r}"
        raise InputError(table.path, table.titles[k], f"{expected}; units={{{name!r}: 's'}} states one")
    return known[0], known[1] * table.numbers(k)


def _metres(cell, table, row):
    """Return the distance (m) of a chainage such as 12+450, NaN for an empty cell."""
    if cell is None or cell != cell:
        return np.nan
    parts = _CHAINAGE.fullmatch(str(cell).strip())
    if not parts:
        raise InputError(table.path, table.where(row), f"expected a chainage such as 12+450, got {str(cell)[:40]!r}")
    return 1e3 * float(parts[1]) + float(parts[2].replace(",", "."))


def _seconds(column, table, k):
    """Return seconds since the first row of a column of clock times, or of dates with times."""
    texts = pd.Series(column).astype(str).str.strip().str.replace(",", ".")
    if texts.iloc[0].count(":") == 1:
        texts = "00:" + texts
    if re.match(r"\d{1,3}:", texts.iloc[0]):
        times = pd.to_timedelta(texts, errors="coerce").dt.total_seconds().to_numpy()
        times = times + 86400.0 * np.concatenate([[0], np.cumsum(np.diff(np.nan_to_num(times)) < -43200.0)])
    else:
        is_day_first = bool(re.match(r"\d{1,2}\.", texts.iloc[0]))
        dated = pd.to_datetime(texts, errors="coerce", format="mixed", utc=True, dayfirst=is_day_first)
        times = (dated - dated.iloc[0]).dt.total_seconds().to_numpy()
    if not np.isfinite(times).any():
        raise InputError(table.path, table.titles[k], f"expected times such as 12:34:56.789, got {texts.iloc[0]!r}")
    return times - times[np.isfinite(times)][0]


def _check_count(rows, path):
    if len(rows) < 2:
        raise InputError(path, "", f"expected two samples or more, got {len(rows)}")
    return rows


def _even_times(times, rows, table):
    """Return increasing times; those of a clock that repeats values become evenly spaced, with a warning."""
    steps = np.diff(times)
    if (steps > 0.0).all():
        return times, np.arange(len(times))
    wrong = int(np.argmax(steps < 0.0)) if (steps < 0.0).any() else -1
    even = np.linspace(times[0], times[-1], len(times))
    positive = steps[steps > 0.0]
    if wrong < 0 and len(positive) and np.abs(times - even).max() <= LARGEST_ROUNDING * positive.min():
        warn(f"{table.path}: times that repeat are replaced by even steps of {even[1] - even[0]:.6g} s")
        return even, np.arange(len(times))
    row = rows[(wrong if wrong >= 0 else int(np.argmax(steps <= 0.0))) + 1]
    raise InputError(table.path, table.where(row), "expected times that increase; rate= replaces the column of times")


def _forward_distances(distances, rows, table):
    """Return increasing distances: of decreasing chainages the distance travelled; samples at standstill are left
    out."""
    if distances[-1] < distances[0]:
        warn(f"{table.path}: the chainage decreases; distances are those travelled from {distances[0]:g} m on")
        distances = distances[0] - distances
    steps = np.diff(distances)
    if (steps < 0.0).any():
        row = rows[int(np.argmax(steps < 0.0)) + 1]
        raise InputError(table.path, table.where(row), "expected distances that all increase or all decrease")
    chosen = np.concatenate([[True], steps > 0.0])
    if not chosen.all():
        warn(f"{table.path}: {np.count_nonzero(~chosen)} samples at the distance of the sample before are left out")
    _check_count(np.flatnonzero(chosen), table.path)
    return distances[chosen], np.flatnonzero(chosen)
