"""Readers of profile meter files (MiniProf) and Vampire files: unchanged points, with their directions and origin.

MiniProf, ``.whl`` (wheels), ``.ban`` (rails), ``.mpt`` (parts): mm; a header of lines ``Key=value``, or a header that
begins with MINIPROF and ends at a blank line; ``"``, ``%``, ``!`` and ``#`` begin comments. Abscissae of wheels are
measured from the flange back, the flange points upwards; the tape circle is at ``WheelDiameterTaperline``, else at
`TAPE_CIRCLE`. Rails have the gauge side at positive abscissae. The vertical direction is detected from the points.
Parts are sections ``[Profile1Info]``, ``[Profile1Points]``. Source: files in CONTACT's test bank, its user guide
(mirroring) and ``read_miniprof.m``.

Vampire, ``.whe`` (wheels), ``.rai`` (rails): four lines of header, then y and z of the left and of the right side in
mm, z up for rails, flange up for wheels. Source: ``read_vampire.m`` of CONTACT.
"""

import re
from typing import NamedTuple

import numpy as np

from wrcore.errors import InputError
from wrcore.errors.column_files import read_column_file
from wrcore.geometry.profiles.checks import Mends

METER_FILES = (".whl", ".ban", ".mpt")
VAMPIRE_FILES = (".whe", ".rai")

TAPE_CIRCLE = 0.070
"""Default distance of the tape circle from the flange back, m (EN 15302)."""

_INCH = 0.0254
_DATUMS = {"EUROPEAN": 0.070, "US1": (2 + 27 / 32) * _INCH, "US2": (3 + 1 / 16) * _INCH}
_GAUGE_POINTS = {"EUROPEAN": 0.014, "US": 5 / 8 * _INCH}
_FOUR = "y and z of the left and of the right side, four numbers"
_END = 0.05  # fraction of the points at either end in which an extremum belongs to a side face


class Stated(NamedTuple):
    """Directions and origin of a file's points, as the file states or its type implies."""

    about: str
    mirrored: bool | None = False
    downwards: bool | None = False
    """Whether u is positive towards the track's centre, and f downwards; if None, `seen` detects both from the points.
    """
    tape_circle: float = 0.0
    """Abscissa (m, to the field side) of a wheel's tape circle from the file's origin."""
    assumed: tuple[str, ...] = ()
    """Names of the fields that are assumed, not stated."""
    offset: tuple[float, float] = (0.0, 0.0)
    """Offset to be added to the file's two coordinates, m."""
    odd: str = ""
    """Irregularity of the file, for a warning."""
    trimmed: bool = True
    """Whether side faces are left out; else they are an error."""
    mends: Mends = Mends()
    """Advice for messages."""


def is_meter_file(path, text):
    """Whether a file has a profile meter's format, by its ending or its first line."""
    return path.suffix.lower() in METER_FILES or bool(re.match(r"\ufeff?\s*(#\s*MINI|MINIPROF\b|\[FileInfo\])", text))


def read_meter(path, text, kind, unit, part=None):
    """Read points x, y (n,) in m from a MiniProf file, the line number of each, and `Stated`.

    ``unit`` is the length of the file's unit, m; ``part`` is the number of a section, for files with several."""
    rows = _rows(text)
    rows, about = _part(path, rows, part)
    keys, rows = _meter_header(path, rows)
    file = read_column_file(path, rows, header=None)
    x, y = file.numbers(_columns(path, keys)).T * unit
    lines = file.lines
    count = keys.get("xypoints", "")
    odd = f", {count} by its header" if count.isdecimal() and int(count) != len(lines) else ""
    offset = tuple(_key(path, keys, name) * unit for name in ("xoffset", "yoffset"))
    if kind == "rail":
        return x, y, lines, Stated(about, None, None, 0.0, ("mirrored",), offset, odd)
    tape = _key(path, keys, "wheeldiametertaperline") * unit
    assumed = () if tape else ("tape_circle",)
    return x, y, lines, Stated(about, None, None, tape or TAPE_CIRCLE, assumed, offset, odd)


def _rows(text):
    """Return the lines without comments, with their numbers; lines with only a comment are left out."""
    lines = ((number, re.split('["%!#]', line)[0].strip(), line) for number, line in enumerate(text.splitlines(), 1))
    return [(number, line) for number, line, whole in lines if line or not whole.strip()]


def _part(path, rows, part):
    """Return the rows of one part of a file, header first, and a description; files without parts are one part."""
    heads = [(k, re.fullmatch(r"\[Profile(\d+)(Info|Points)\]", line)) for k, (_, line) in enumerate(rows)]
    starts = {(int(m[1]), m[2]): k for k, m in heads if m}
    parts = sorted({number for number, what in starts if what == "Points"})
    if part is None and len(parts) < 2:
        part = parts[0] if parts else None
    if part not in (parts or [None]):
        got = "none" if part is None else part
        one = " or ".join(map(str, parts)) if parts else "none, as the file has no sections [Profile1Points]"
        raise InputError(path, "part", f"expected {one}, got {got}")
    if not parts:
        return rows, "MiniProf"
    ends = sorted(k for k, (_, line) in enumerate(rows) if line.startswith("["))
    picked = []
    for what in ("Info", "Points"):
        if (begin := starts.get((part, what))) is not None:
            picked += rows[begin + 1 : min((k for k in ends if k > begin), default=len(rows))]
    return picked, f"MiniProf, part {part} of {', '.join(map(str, parts))}"


def _meter_header(path, rows):
    """Return the header's keys, in lower case, and the rows with points."""
    old = next((k for k, (_, line) in enumerate(rows) if line.upper().startswith("MINIPROF")), None)
    if old is not None:
        blank = next((k for k in range(old, len(rows)) if not rows[k][1]), None)
        if blank is None:
            raise InputError(path, f"line {rows[old][0]}", "expected a blank line between the header and the points")
        return {}, [row for row in rows[blank:] if row[1]]
    keys, rows = {}, [row for row in rows if row[1]]
    for k, (_, line) in enumerate(rows):
        key, equals, value = line.partition("=")
        if not equals:
            return keys, rows[k:]
        keys[key.strip().lower()] = value.strip()
    return keys, []


def _columns(path, keys):
    """Return the indices of the columns X and Y."""
    names = [name.strip().upper() for name in keys.get("columndef", "X,Y").split(",")]
    if "X" not in names or "Y" not in names:
        raise InputError(path, "ColumnDef", f"expected columns X and Y, got {keys['columndef'][:40]!r}")
    return names.index("X"), names.index("Y")


def _key(path, keys, name):
    """Return the number under a key, or 0 without the key."""
    text = keys.get(name) or "0"
    try:
        value = float(text)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise InputError(path, name, f"expected a number, got {text[:40]!r}")
    return value


def seen(kind, x, y):
    """Detect from points whether the abscissa is positive towards the track's centre and the ordinate downwards.

    The side faces of wheels and rails point away from the contact, and a wheel's flange is near its flange back. A
    rail's gauge side cannot be detected; it is taken to be at positive abscissae, as in files of profile meters.
    """
    if y.size < 2:
        return False, False
    lowest, highest = (np.argmin(y) / (y.size - 1), np.argmax(y) / (y.size - 1))
    inside = [_END < place < 1.0 - _END for place in (lowest, highest)]
    if kind == "rail":
        return True, inside == [True, False]
    up = inside != [True, False]  # the flange
    tip = x[np.argmax(y) if up else np.argmin(y)]
    return bool(tip > 0.5 * (x.min() + x.max())), up


def read_vampire(path, text, kind, side="right"):
    """Read points y, z (n,) in m of one ``side`` of a Vampire file, the line number of each, and `Stated`."""
    rows = [(number, line.strip()) for number, line in enumerate(text.splitlines(), 1)]
    first = rows[0][1].upper() if rows else ""
    found = {"WHEELPROFILE": "wheel", "RAILPROFILE": "rail"}.get(first)
    if found is None:
        raise InputError(path, "line 1", f"expected WHEELPROFILE or RAILPROFILE, got {first[:40]!r}")
    if found != kind:
        raise InputError(path, "line 1", f"expected a {kind} profile, got a {found}")
    wheel = kind == "wheel"
    named = ("TREADDATUM", _DATUMS) if wheel else ("GAUGEPOINT", _GAUGE_POINTS)
    datum, point = _vampire_key(path, rows, 3, *named)
    width, _ = _vampire_key(path, rows, 4, "FLANGEBACK" if wheel else "GAUGE", {})
    points = ((number, re.split('["%!]', line)[0].strip()) for number, line in rows[4:])
    file = read_column_file(path, [row for row in points if row[1]], header=None)
    table, lines = 1e-3 * file.numbers([0, 1, 2, 3], expected=_FOUR).T, file.lines
    y, z = table[:2] if side == "left" else table[2:]
    if wheel:
        about = f"Vampire, {side} side, tread datum {point}, {1e3 * datum:.2f} mm from the flange back"
        return y, z, lines, Stated(about, side == "left", True, 0.5 * width + datum)
    about = f"Vampire, {side} side, gauge point {point}, {1e3 * datum:.2f} mm below the top (track.gauge_depth)"
    return y, z, lines, Stated(about, side == "left")


def _vampire_key(path, rows, number, key, named):
    """Return the value (m) of a header line ``key value`` or ``key NAME``, and its name."""
    line = rows[number - 1][1] if len(rows) >= number else ""
    words = line.upper().split()
    if words[:1] == [key] and len(words) > 1:
        if words[1] in named:
            return named[words[1]], words[1]
        try:
            return 1e-3 * float(words[-1]), words[1]
        except ValueError:
            pass
    names = f"one of {', '.join(named)} or CUSTOM and " if named else ""
    raise InputError(path, f"line {number}", f"expected {key} and {names}a number of mm, got {line[:40]!r}")
