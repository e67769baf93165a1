"""Files of changing rails and out-of-round wheels: CONTACT's ``.slcs`` and ``.slcw``, and CSV tables of slices.

``.slcs``: counters, a line ``s 'profile'`` per slice, and positions of feature lines (chord length from the
section's first point, mm; -1: the slice has no such line); ``%`` begins a comment. Profiles in columns have the unit of
s and heights positive downwards, unless stated otherwise. ``.slcw`` has the wheel's angle in radians in place of s.

CSV: a table with the columns s_m, profile (a point file, see `wrcore.geometry.profiles.files`) and, if a rail has
several heads, head: a name. A head exists from the first to the last of successive slices that have it. Columns
cut_1_m, cut_2_m, ... may state feature lines of a head: chord lengths from its inner end. A table of a wheel has
angle_rad in place of s_m.

Paths are relative to the file. Source: CONTACT's user guide and its test bank.
"""

import csv
import io
import itertools
import re
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

from wrcore.errors import InputError, check_number, one_of
from wrcore.errors.column_files import header_of, named_columns, read_column_file, split_unit
from wrcore.errors.input_files import check_regular
from wrcore.errors.messages import warn
from wrcore.geometry.changing_rails.slices import TURN, RailSlices, Slice, WheelSlices, sheets_of
from wrcore.geometry.profiles.files import read_points

SLICE_FILES = {"rail": ".slcs", "wheel": ".slcw"}
PLACES = {"rail": "s_m", "wheel": "angle_rad"}
"""Endings of files of slices of a rail and of a wheel, and the column of a table with a slice's position."""
MOST_SLICES = 100_000
BEYOND = 8
"""Number of slices repeated beyond either end of a whole turn of a wheel, so that the spline's end conditions have no
effect on the turn."""
WIDEST = 0.5
"""Largest accepted width and height of a section, m; it detects wrong units."""

_QUOTED = r"'([^']+)'|\"([^\"]+)\""
_CLOSE = 1e-7  # m; as for profiles
_MM = 1e-3
_KEYS = {"slices", "unit", "mirrored", "downwards", "wavelength"}


def is_slices(path, kind="rail"):
    """Whether a file lists slices of a ``kind``, by its ending or by the columns of a CSV's header.

    The columns are s_m (of wheels angle_rad) and profile.
    """
    path = Path(path)
    if path.suffix.lower() == SLICE_FILES[kind]:
        return True
    if path.suffix.lower() != ".csv" or not path.is_file():
        return False
    return {PLACES[kind], "profile"} <= set(_names(header_of(path), kind))


def read_slices(spec, kind="rail", described_by=None):
    """Read `RailSlices`, or `WheelSlices` of a wheel, from a file of slices.

    ``spec`` is the path or a dict. Keys: ``slices`` (the path); ``unit``, ``mirrored``, ``downwards`` for profiles in
    columns, as in `read_profile`; ``wavelength`` (m): measured sections are smoothed, waves of this length to half of
    their amplitude. An InputError names file and line, or the source of the dict (``described_by``).
    """
    spec = spec if isinstance(spec, dict) else {"slices": spec}
    try:
        return _read(spec, kind)
    except InputError as error:
        if described_by is None or error.source != kind:
            raise
        raise InputError(described_by, error.field, error.expected) from None


def _read(spec, kind):
    for key in set(spec) - _KEYS:
        raise InputError(kind, str(key), one_of(sorted(_KEYS), key))
    path = Path(spec["slices"])
    how = {key: value for key, value in spec.items() if key != "slices"}
    if "wavelength" in how:
        check_number(how["wavelength"], 0.0, 0.1, kind, "wavelength", "m")
    return (_read_slcs if path.suffix.lower() in SLICE_FILES.values() else _read_table)(path, how, kind)


def with_profiles(path, renamed):
    """Return the text of a file of slices with ``renamed(name)`` in place of each profile's name.

    Other files are returned unchanged. OSError or ValueError if the file cannot be read.
    """
    check_regular(path)
    text = Path(path).read_text(errors="replace")
    if Path(path).suffix.lower() in SLICE_FILES.values():
        return re.sub(_QUOTED, lambda name: f"'{renamed(name[1] or name[2])}'", text)
    file = read_column_file(path) if "profile" in _names(header_of(path), "rail") else None
    if file is None:
        return text
    column, out = _names(file, "rail").index("profile"), io.StringIO()
    for cells in file.cells:
        if len(cells) > column:
            cells[column] = renamed(cells[column])
    csv.writer(out, lineterminator="\n").writerows([file.names, *file.cells])
    return out.getvalue()


def profiles_in(path):
    """Return the paths of the profiles that a file of slices lists, each once; empty for other files."""
    found = {}
    with suppress(OSError, ValueError):
        with_profiles(path, lambda name: found.setdefault(name, name))
    return [Path(path).parent / name for name in found]


def _lines(path):
    """Return the lines that are not empty after removal of comments, with their numbers."""
    try:
        check_regular(path)
        text = path.read_text(errors="replace")
    except (OSError, ValueError) as error:
        fault = getattr(error, "strerror", None) or error
        raise InputError(path, "", f"expected a readable file of slices: {fault}") from None
    stripped = ((k, line.split("%")[0].strip()) for k, line in enumerate(text.splitlines(), 1))
    return [(k, line) for k, line in stripped if line]


class _Lines:
    """Reader of the lines of a ``.slcs`` file, one after the other."""

    def __init__(self, path):
        self.path, self._rest = path, iter(_lines(path))

    def take(self, count, what):
        """Return the next line's number, its first ``count`` values, and the line; ``what`` names them in errors."""
        number, line = next(self._rest, (0, None))
        if line is None:
            raise InputError(self.path, what, "expected this, got the end of the file (truncated?)")
        words = re.split(r"[\s,]+", line)[:count]
        try:
            values = [float(word) for word in words]
        except ValueError:
            values = []
        if len(values) < count or not np.isfinite(values).all():
            numbers = "a number" if count == 1 else f"{count} numbers"
            raise InputError(self.path, f"line {number}", f"expected {what}: {numbers}, got {line[:60]!r}")
        return number, values, line

    def rest(self):
        return list(self._rest)


def _read_slcs(path, how, kind):
    lines = _Lines(path)
    number, (offset, scale), _ = lines.take(2, "offset and scale of s")
    if kind == "wheel" and scale != 1.0:
        raise InputError(path, f"line {number}", f"expected a scale of 1, angles in radians, got {scale:g}")
    if not 1e-6 <= scale <= 1e6:
        raise InputError(path, f"line {number}", f"expected a scale in mm per unit, got {scale:g}")
    number, (count,), _ = lines.take(1, "the number of slices")
    if not 1 <= count <= MOST_SLICES or count != int(count):
        raise InputError(path, f"line {number}", f"expected 1 to {MOST_SLICES} slices, got {count:g}")
    number, (features, kinks, steps), _ = lines.take(3, "numbers of features, kinks and accelerations")
    if features != int(features) or not (features == 0 or 2 <= features <= 1000):
        raise InputError(path, f"line {number}", f"expected 0 or at least 2 feature lines, got {features:g}")
    number, (method,), _ = lines.take(1, "the method of interpolation")
    if method != 1 and not (kind == "wheel" and method == 2):
        expected = "expected 1, surfaces through the slices" + ", or 2, slices as control points" * (kind == "wheel")
        raise InputError(path, f"line {number}", f"{expected}, got {method:g}")
    listed = [_listed(lines) for _ in range(int(count))]
    for what in ("kinks",) * (kinks > 0) + ("accelerations",) * (steps > 0):
        lines.take(0, what)
    places = [_places(lines, path, int(features), value) for _, value, _ in listed] if features else []
    rest = lines.rest()
    if rest:
        raise InputError(path, f"line {rest[0][0]}", f"expected the end of the file, got {rest[0][1][:60]!r}")
    unit = {1.0: "mm", 1000.0: "m"}.get(scale, "mm")
    rows, unit_of_place = [], scale * _MM if kind == "rail" else 1.0
    for k, (number, value, name) in enumerate(listed):
        stated = name.lower().endswith((".prr", ".prw"))
        columns = {**({} if stated else {"unit": unit, "downwards": True}), **how}
        rows.append((number, (value + offset) * unit_of_place, name, columns, places[k] if features else None))
    lost = [f"{int(number)} {what}" for number, what in ((kinks, "kinks"), (steps, "accelerations")) if number]
    if lost:
        warn(f"{path}: {' and '.join(lost)} not kept: the surface stays smooth along the {kind}")
    return _assembled(path, [("", rows)], kind, method == 1)


def _listed(lines):
    """Return line number, arc length (in the file's unit) and profile name of a slice."""
    number, (value,), line = lines.take(1, "arc length and profile of a slice")
    name = re.search(_QUOTED, line)
    if name is None:
        raise InputError(lines.path, f"line {number}", f"expected s and a profile in quotes, got {line[:60]!r}")
    return number, value, name[1] or name[2]


def _places(lines, path, features, value):
    """Return the line number and the positions of a slice's feature lines, m; NaN for lines it does not have."""
    number, (at, *places), _ = lines.take(features + 1, f"s and {features} positions of feature lines")
    if abs(at - value) > 1e-6 * max(1.0, abs(value)):
        raise InputError(path, f"line {number}", f"expected the feature lines of the slice at {value:g}, got {at:g}")
    places = np.array(places)
    places = np.where(places < 0.0, np.nan, _MM * places)
    if np.any(np.diff(places[np.isfinite(places)]) <= 0.0):
        raise InputError(path, f"line {number}", "expected positions of feature lines that increase (they cross here)")
    return number, places


def _read_table(path, how, kind):
    """Read the slices of a CSV table."""
    file, place = read_column_file(path), PLACES[kind]
    names = _names(file, kind)
    for wanted in (place, "profile"):
        if wanted not in names:
            raise InputError(path, wanted, f"expected this column; found {', '.join(filter(None, names)) or 'none'}")
    cuts = [k for k, name in enumerate(names) if re.fullmatch(r"cut_\d+_m", name)]
    for k, name in enumerate(names):
        if name not in (place, "profile") and k not in cuts and not (name == "head" and kind == "rail"):
            expected = f"unknown column; expected {place}, profile, {'head, ' * (kind == 'rail')}cut_1_m, ..."
            raise InputError(path, name, expected)
    found = _known(file, kind)
    s = file.numbers([names.index(place)], [found[names.index(place)][1]])[:, 0]
    given = file.numbers(cuts, [found[k][1] for k in cuts], empty=True)
    heads = {}
    for number, cells, at, places in zip(file.lines, file.cells, s, given, strict=True):
        row = dict(itertools.zip_longest(names, cells, fillvalue=""))
        if not row["profile"]:
            raise InputError(path, f"profile, line {number}", "expected the name of a file, got none")
        if not np.isfinite(at) or np.isinf(places).any():
            raise InputError(path, f"line {number}", "expected finite numbers")
        places = places[np.isfinite(places)]
        if np.any(np.diff(places, prepend=0.0) <= 0.0):
            raise InputError(path, f"line {number}", "expected cuts above 0 that increase")
        heads.setdefault(row.get("head", ""), []).append((number, float(at), row["profile"], how, (number, places)))
    if not heads:
        raise InputError(path, "", "expected at least one slice, got none")
    if "" in heads and len(heads) > 1:
        raise InputError(
            path, f"head, line {heads[''][0][0]}", "expected the name of a head, as in other lines; got none"
        )
    return _assembled(path, list(heads.items()), kind)


def _known(file, kind):
    """Return known names of a table's columns with factors to SI units, by column index."""
    cuts = [f"{base}_m" for base, _ in map(split_unit, file.names) if re.fullmatch(r"cut_\d+", base)]
    return named_columns(file, (PLACES[kind], "profile", "head", *cuts))


def _names(file, kind):
    """Return the names of a table's columns, known names with SI units."""
    found = _known(file, kind)
    return [found[k][0] if k in found else name for k, name in enumerate(file.names)]


def _assembled(path, heads, kind, through=True):
    """Build `RailSlices` or `WheelSlices` from heads.

    A head is a name and rows (line, s, profile, keys for reading it, (line, feature lines)). ``through`` is as in
    `sheets_of`.
    """
    stations, known = np.unique([row[1] for _, rows in heads for row in rows]), {}
    sheets, alike = [], len(heads) == 1 and "wavelength" not in heads[0][1][0][3]
    for head, rows in heads:
        s = [row[1] for row in rows]
        if np.any(np.diff(s) <= 0.0):
            k = int(np.argmax(np.diff(s) <= 0.0)) + 1
            expected = f"expected {PLACES[kind]} that increases, got {s[k]:g} after {s[k - 1]:g}"
            raise InputError(path, f"line {rows[k][0]}", expected)
        slices = {row[1]: _slice(path, row, kind, known) for row in rows}
        counts = sorted({one.cuts.size for one in slices.values()})
        if len(counts) > 1:
            raise InputError(path, "cut_1_m", f"expected as many cuts in all slices of head {head!r}, got {counts}")
        listed = [slices.get(at) for at in stations]
        if kind == "wheel":
            return _wheel(path, stations, listed, through)
        sheets += sheets_of(stations, listed)
        distinct = {(id(one.curve), one.cuts.tobytes()): one for one in slices.values()}.values()
        alike = alike and len({(one.curve.c.tobytes(), one.cuts.tobytes()) for one in distinct}) == 1
    if not sheets:
        raise InputError(path, "features", "expected a part of the rail between two feature lines, got none")
    profiles = len({row[2] for _, rows in heads for row in rows})
    source = f"{stations.size} slices from s = {stations[0]:g} to {stations[-1]:g} m, {profiles} profiles, "
    source += f"{len(sheets)} parts"
    _, _, name, how, _ = heads[0][1][0]
    first = {"points": str(path.parent / name), **how}
    rail = RailSlices(str(path), stations, tuple(sheets), source, alike, first)
    ends = ", ".join(f"{end:g}" for end in rail.begins())
    return replace(rail, source=f"{source}, parts begin or end at s = {ends} m") if ends else rail


def _wheel(path, angles, slices, through):
    """Build `WheelSlices` from slices at angles (rad); a whole turn is extended periodically."""
    turn = angles[-1] - angles[0]
    if turn > TURN + 1e-9:
        raise InputError(path, PLACES["wheel"], f"expected angles within one turn, got {turn:g} rad")
    gap = TURN - turn
    if angles.size > 3 and gap < 1.5 * np.diff(angles).max():  # a whole turn: it is periodic
        count = min(BEYOND, angles.size - 1)
        more = slice(int(gap < 1e-9), count), slice(-count, -1 if gap < 1e-9 else None)
        slices = [*slices[more[1]], *slices, *slices[more[0]]]
        angles = np.concatenate([angles[more[1]] - TURN, angles, angles[more[0]] + TURN])
    return WheelSlices(str(path), angles, tuple(sheets_of(angles, slices, through)))


def _slice(path, row, kind, known):
    """Return the `Slice` of a row; profiles are read once and stored in ``known``.

    In a CSV table the profile's ends are feature lines, too.
    """
    _, s, name, _, cuts = row
    if name not in known:
        known[name] = _profile(path, row, kind)
    one = replace(known[name], s=s)
    if cuts is None:
        return one
    (at, given), ends = cuts, one.cuts
    places = np.minimum(given, ends[1])
    if path.suffix.lower() not in SLICE_FILES.values():
        places = np.concatenate((ends[:1], given, ends[1:]))
    if np.any(np.diff(places[np.isfinite(places)]) <= 0.0):
        raise InputError(path, f"line {at}", f"expected feature lines within {1e3 * ends[1]:.3f} mm of {name}")
    return replace(one, cuts=places)


def _profile(path, row, kind):
    """Return the profile of a row as a `Slice` whose only feature lines are its ends."""
    number, s, name, how, _ = row
    how, wavelength = {key: how[key] for key in how if key != "wavelength"}, how.get("wavelength", 0.0)
    u, f, *_ = read_points({"points": str(path.parent / name), **how}, kind)
    if not np.isfinite([u, f]).all():
        raise InputError(path.parent / name, "", f"expected finite numbers (line {number} of {path})")
    if u.size and max(np.ptp(u), np.ptp(f)) > WIDEST:
        expected = f"expected a profile within {WIDEST:g} m, got {max(np.ptp(u), np.ptp(f)):.3g} m (unit: mm?)"
        raise InputError(path.parent / name, "", f"{expected} (line {number} of {path})")
    if u.size and u[-1] < u[0]:
        u, f = u[::-1], f[::-1]
    step = np.hypot(np.diff(u), np.diff(f))
    kept = np.append(True, step > _CLOSE)
    u, f = u[kept], f[kept]
    if u.size < 4:
        raise InputError(path.parent / name, "", f"expected at least 4 points, got {u.size} (line {number} of {path})")
    return Slice.through(s, u, f, wavelength)
