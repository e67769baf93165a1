"""Profile files: CSV or columns of points, SIMPACK .prw/.prr, profile meters, Vampire; conversion to wrcore's axes.

Point files list u (lateral, positive to the field side) and f (positive up), one point per line; ``#``, ``%`` or ``!``
starts a comment. The unit is in a header line ``u_m,f_m`` or ``u_mm,f_mm``, or is declared with the path. Columns may
be separated by commas, semicolons, tabs or blanks; with semicolons and tabs numbers may have decimal commas. Further
columns are not read; a header names all columns. The UIC 519 / EN 15302 reference profiles (``*.dat``) follow this
convention without a header: declare ``unit: mm``. Lines ``Name=value`` before the points are ignored. Directions and
origin of the columns are declared with the path: ``mirrored``, ``downwards``, ``shift``.

SIMPACK files list y (positive to the field side once ``mirror.y`` is applied) and z (positive down). MiniProf and
Vampire: `wrcore.geometry.profiles.meters`.
"""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from wrcore.errors import InputError, one_of
from wrcore.errors.column_files import read_column_file, read_text, split_unit
from wrcore.errors.messages import warn
from wrcore.geometry.profiles import meters as profile_meters
from wrcore.geometry.profiles.checks import UNITS, Mends, check_extent, likely_unit
from wrcore.geometry.profiles.meters import METER_FILES, VAMPIRE_FILES, Stated
from wrcore.geometry.profiles.profile import SPACING, STEEPEST, WINDOW, ProfileCurve

_SIMPACK = (".prw", ".prr")
POINT_FILES = (".csv", ".dat", ".txt", *_SIMPACK, *METER_FILES, *VAMPIRE_FILES)
"""Endings of files of points."""
_KIND_OF = dict.fromkeys((".prw", ".whl", ".whe"), "wheel") | dict.fromkeys((".prr", ".ban", ".rai"), "rail")
_KEYS = {
    "points", "unit", "inclined", "smoothing", "mirrored", "downwards", "shift", "tape_circle", "flange_back", "within",
    "part", "side",
}  # fmt: skip
_INSTEAD = {"tape_circle": ("shift", "flange_back")}
_FACE, _BACK = 2e-3, 5e-3
"""Points within the first distance (m) of a wheel's innermost point are its flange back, if they rise by the second
distance (m) above the flange's tip."""
_REASONS = "side faces, too deep, stepping back, equal, not within"
_HEADED = "; a header above them is u_m,f_m or u_mm,f_mm: u to the field side, f up"
_UNSUPPORTED = ("rotate", "point.dist.min", "approx.smooth")


def read_profile(spec, kind, inclination=0.0, window=WINDOW, spacing=SPACING):
    """Read the ProfileCurve of a ``kind`` from a point file; its ``source`` lists points read, rotated and left out.

    ``spec`` is the path or a dict. Keys: ``points`` (the path); ``unit`` (m, mm, inch, cm or um); ``inclined`` (default
    True): a rail's points have the inclination in the track, else they are rotated by ``inclination``; ``smoothing``
    (m); ``within`` (m, 2): abscissae in the file between which points are read. Not for SIMPACK files, which state
    them: ``mirrored``: the first column is positive towards the track's centre; ``downwards``: the second column is
    positive downwards; ``shift`` (m, 2): then added to u and f. Position of a wheel's u = 0: ``tape_circle`` (m), its
    distance from the file's origin, or ``flange_back`` (m), its distance from the innermost point. ``part``: number of
    a MiniProf file's part; ``side`` (left or right) of a Vampire file."""
    spec = spec if isinstance(spec, dict) else {"points": spec}
    u, f, lines, inside, stated, told, assumed = read_points(spec, kind)
    path = Path(spec["points"])
    turn = 0.0 if spec.get("inclined", True) or kind == "wheel" else inclination
    curve = ProfileCurve.from_points(
        u, f, kind, str(path), lines=lines[inside], trim=stated.trimmed, inclination=turn,
        smoothing=float(spec.get("smoothing", 0.0)), window=window, spacing=spacing, mends=stated.mends,
    )  # fmt: skip
    left_out = np.setdiff1d(lines, lines[inside][curve.outline.followed(STEEPEST)])
    count = f"{lines.size} points{stated.odd}"
    if left_out.size or assumed or stated.odd:
        kept = f"{left_out.size} of " * bool(left_out.size) + count + " left out" * bool(left_out.size)
        guess = "".join(f", {key} assumed" for key in assumed)
        guess += ", no flange back among the points" * ("tape_circle" in assumed and not _shows_back(u, f))
        warn(f"{path}: {kept}{guess} ('wrcore profiles' shows it)")
    told += f", {count}" + (f", left out ({_REASONS}): lines {_ranges(left_out)}" if left_out.size else "")
    return replace(curve, source=f"{curve.source}: {told}")


def read_points(spec, kind):
    """Read points u (to the field side) and f (up), m, with the keys of `read_profile`, before the rail is inclined.

    Further results: the number of each line with a point, a mask of the points inside ``within``, the `Stated` of the
    file, a text of the conversions, and the names of assumed keys.
    """
    spec = _checked(spec, kind)
    path = Path(spec["points"])
    u, f, lines, stated = _read(path, read_text(path, "a readable profile file"), spec, kind)
    inside = _within(path, spec, u)
    u, f, told, assumed, given = _placed(spec, kind, stated, u[inside], f[inside], path)
    stated = stated._replace(mends=_mends(spec, stated.mends, given))
    return u, f, lines, inside, stated, told, assumed


def kind_of(path):
    """Return the kind of profile that belongs to the ending of a file's name, or None."""
    return _KIND_OF.get(Path(path).suffix.lower())


def _read(path, text, spec, kind):
    """Return a file's points (n,) in m in the file's axes, the line number of each, and the file's `Stated`."""
    ending, unit = path.suffix.lower(), spec.get("unit")
    origin = "tape_circle, flange_back or shift says where it is"
    shape = "state mirrored and downwards, true or false"
    mends = Mends("", "", origin, "declare unit: {}", shape, UNITS[unit or "mm"])
    if ending not in _SIMPACK and kind_of(path) not in (kind, None):
        raise InputError(path, "", f"expected a {kind} profile, got a {kind_of(path)}")
    if ending in _SIMPACK:
        _check_type(path, text, kind)
        u, f, lines = read_simpack(path, text, "smoothing" in spec)
        beyond = _simpack_points(path, text, _header(path, text)[1])[2].size - lines.size
        factor = 1.0 / _value(path, _header(path, text)[0], "units.len.f", float("nan"))
        mends = Mends(
            "mirror.y in the file", "mirror.z in the file", origin, "units.len.f in the file (of {})", "", factor, True
        )
        stated = Stated("SIMPACK", odd=f" and {beyond} beyond its bounds" if beyond else "")
    elif ending in VAMPIRE_FILES:
        u, f, lines, stated = profile_meters.read_vampire(path, text, kind, spec.get("side", "right"))
    elif profile_meters.is_meter_file(path, text):
        u, f, lines, stated = profile_meters.read_meter(path, text, kind, UNITS[unit or "mm"], spec.get("part"))
    else:
        u, f, lines, unit, headed = read_columns(path, text, kind, unit)
        advice = "u_{0},f_{0} in the header" if headed else "declare unit: {}"
        mends = mends._replace(unit=advice, factor=UNITS[unit])
        stated = Stated("columns", trimmed=False)
    for key, form in (("part", "MiniProf"), ("side", "Vampire")):
        if key in spec and not stated.about.startswith(form):
            raise InputError(path, key, f"expected this of {form} files only")
    return u, f, np.asarray(lines, dtype=int), stated._replace(mends=mends)


def _within(path, spec, u):
    """Return the mask of points between the abscissae ``within``; all points without this key."""
    if "within" not in spec:
        return np.ones(u.size, dtype=bool)
    low, high = spec["within"]
    inside = (u >= low) & (u <= high)
    if not inside.any() and u.size:
        expected = f"expected a part of {u.min():.4g} to {u.max():.4g} m"
        raise InputError(path, "within", f"{expected}, got {low:g} to {high:g}")
    return inside


def _shows_back(u, f):
    """Whether a wheel's innermost points, in the package's directions, rise again behind the flange's tip."""
    return bool(u.size) and bool(f[u < u.min() + _FACE].max() > f.min() + _BACK)


def _placed(spec, kind, stated, u, f, path):
    """Return points in the package's axes, a text of the conversions, names of assumed keys, and all keys used."""
    seen = stated.mirrored is None
    mirrored, downwards = profile_meters.seen(kind, u, f) if seen else (stated.mirrored, stated.downwards)
    given = {"mirrored": mirrored, "downwards": downwards, "tape_circle": stated.tape_circle, **spec}
    assumed = [key for key in stated.assumed if not {key, *_INSTEAD.get(key, ())} & set(spec)]
    told, (across, up) = [stated.about], stated.offset
    told += [f"moved by {1e3 * across:g} and {1e3 * up:g} mm"] if across or up else []
    u, f = u + across, f + up
    u = -u if given["mirrored"] else u
    f = -f if given["downwards"] else f
    told += [key + " (assumed)" * (key in assumed) for key in ("mirrored", "downwards") if given[key]]
    if "flange_back" in spec:
        if u.size and np.isfinite([u, f]).all():
            check_extent(u, f, kind, str(path), stated.mends)
        if not _shows_back(u, f):
            expected = (
                f"expected points up to the flange back, got none that lie {1e3 * _BACK:g} mm above the flange's tip"
            )
            raise InputError(path, "flange_back", f"{expected} behind it: tape_circle or shift says where u = 0 is")
        u = u - u.min(initial=np.inf) - spec["flange_back"]
        told += [f"flange back (innermost point) at {-1e3 * spec['flange_back']:g} mm"]
    elif "shift" in spec:
        u, f = u + spec["shift"][0], f + spec["shift"][1]
        told += ["shifted by {:g} and {:g} mm".format(*(1e3 * d for d in spec["shift"]))]
    elif given["tape_circle"]:
        u = u - given["tape_circle"]
        told += [f"tape circle {1e3 * given['tape_circle']:g} mm from the file's origin" + " (assumed)" * bool(assumed)]
    return u, f, ", ".join(told), assumed, given


def _mends(spec, mends, given):
    """Return the advice for messages: ``mends`` of the file's format, completed with keys for wrong directions."""
    if mends.u:  # a SIMPACK file states its directions
        return mends
    turned = {key: f"{key}: {str(not given[key]).lower()}" for key in ("mirrored", "downwards")}
    return mends._replace(
        u=turned["mirrored"], f=turned["downwards"], is_stated={"mirrored", "downwards"} <= set(spec),
        is_side_stated="mirrored" in spec,
    )  # fmt: skip


def _ranges(lines):
    """Return line numbers as text, with ranges for successive numbers."""
    runs = np.split(lines, np.flatnonzero(np.diff(lines) != 1) + 1)
    return ", ".join(f"{run[0]}" if run.size == 1 else f"{run[0]}-{run[-1]}" for run in runs)


def _checked(spec, kind):
    """Return ``spec``; InputError for unknown keys, wrong values or keys that do not belong to the file's format."""
    unknown = sorted(str(k) for k in set(spec) - _KEYS)
    if unknown:
        raise InputError(kind, unknown[0], one_of(sorted(_KEYS), unknown[0]))
    if not isinstance(spec.get("points"), (str, Path)):
        raise InputError(kind, "points", f"expected the path of a point file, got {spec.get('points')!r}")
    if spec.get("unit") not in (None, *UNITS):
        raise InputError(kind, "unit", one_of(UNITS, spec["unit"]))
    if "inclined" in spec and kind == "wheel":
        raise InputError(kind, "inclined", "expected this of rails only: leave it out")
    for key in ("inclined", "mirrored", "downwards"):
        if not isinstance(spec.get(key, True), bool):
            raise InputError(kind, key, f"expected true or false, got {spec[key]!r}")
    for key in ("shift", "within"):
        pair = spec.get(key, [0.0, 0.0])
        if not isinstance(pair, (list, tuple)) or len(pair) != 2 or not all(map(_is_distance, pair)):
            raise InputError(kind, key, f"expected two distances in m, within 1, got {pair!r}")
    _check_origin(spec, kind)
    if not isinstance(spec.get("part", 1), int) or isinstance(spec.get("part"), bool):
        raise InputError(kind, "part", f"expected a whole number, got {spec['part']!r}")
    if spec.get("side", "left") not in ("left", "right"):
        raise InputError(kind, "side", f"expected left or right, got {spec['side']!r}")
    if Path(spec["points"]).suffix.lower() in _SIMPACK and {"mirrored", "downwards", "shift"} & set(spec):
        expected = "expected none of these: a SIMPACK file states them itself"
        raise InputError(kind, "mirrored, downwards, shift", expected)
    if "unit" in spec and Path(spec["points"]).suffix.lower() in (*_SIMPACK, *VAMPIRE_FILES):
        raise InputError(kind, "unit", "expected no such key: SIMPACK and Vampire files have a unit of their own")
    smoothing = spec.get("smoothing", 0.0)
    if isinstance(smoothing, bool) or not isinstance(smoothing, (int, float)):
        raise InputError(kind, "smoothing", f"expected a distance in m, got {smoothing!r}")
    return spec


def _check_origin(spec, kind):
    """Raise an InputError if a wheel's origin is stated twice, or a rail's origin by a key for wheels."""
    given = [key for key in ("shift", "tape_circle", "flange_back") if key in spec]
    if len(given) > 1:
        raise InputError(kind, given[1], f"expected this or {given[0]}, not both")
    for key in set(given) - {"shift"}:
        if kind == "rail":
            expected = "expected this of wheels only: the gauge point (track.gauge_depth) places a rail"
            raise InputError(kind, key, expected)
        if not _is_distance(spec[key]):
            raise InputError(kind, key, f"expected a distance in m, within 1, got {spec[key]!r}")


def _is_distance(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= 1.0


def read_columns(path, text, kind, unit=None):
    """Read points u, f (n,) in m from a file of columns, the line number of each, the unit, and whether a header
    states the unit, which must agree with ``unit``."""
    file = read_column_file(path, text, header=False)
    columns, headed = [0, 1], False
    if file.names:
        named = [split_unit(name) for name in file.names]
        bases = [base for base, _ in named]
        if not {"u", "f"} <= set(bases):
            line, got = file.header
            raise InputError(path, f"line {line}", f"expected two numbers, got {got[:40]!r}{_HEADED}")
        columns = [bases.index("u"), bases.index("f")]
        headed = bool(named[columns[0]][1])
        unit = _agreed(path, file.header[0], [named[k][1] for k in columns], unit)
    points = file.numbers(columns)
    if unit is None:
        span = np.ptp(points[:, 0]) if points.size else 0.0
        likely = likely_unit(span, kind)
        guess = f"; u spans {span:g}, as of {likely}" if likely else ""
        raise InputError(
            path, "unit", f"expected a header u_m,f_m or u_mm,f_mm, or unit: {', '.join(UNITS)} beside the path{guess}"
        )
    u, f = points.T * UNITS[unit]
    return u, f, file.lines, unit, headed


def _agreed(path, line, stated, declared):
    """Return the unit that a header states for both columns, or the declared unit if it states none."""
    known = [{"in": "inch", "µm": "um", "μm": "um", "": declared}.get(unit.lower(), unit.lower()) for unit in stated]
    if known[0] != known[1] or declared not in (None, known[0]) or known[0] not in (None, *UNITS):
        got = f"u in {stated[0] or 'no unit'}, f in {stated[1] or 'no unit'}"
        got += f", declared {declared}" if declared else ""
        raise InputError(path, f"line {line}", f"expected one unit for both columns ({', '.join(UNITS)}), got {got}")
    return known[0]


def _header(path, text):
    """Return the keys before the points, as text, and the number of the line ``point.begin``."""
    keys = {}
    for number, line in enumerate(text.splitlines(), 1):
        line = line.partition("!")[0].strip()
        if line == "point.begin":
            return keys, number
        key, equals, value = line.partition("=")
        if equals:
            # "type" appears twice: header (rail or wheel) and spline (format of the original data)
            keys.setdefault(key.strip(), value.strip().strip("'\""))
    raise InputError(path, "point.begin", "expected a SIMPACK profile with a line point.begin, got the end of file")


def _check_type(path, text, kind):
    found = {"0": "rail", "1": "wheel"}.get(_header(path, text)[0].get("type"))
    if found is None:
        raise InputError(path, "type", "expected 0 (rail) or 1 (wheel) in the header")
    if found != kind:
        raise InputError(path, "type", f"expected a {kind} profile, got a {found}")


def _value(path, keys, name, default):
    text = keys.get(name)
    try:
        value = default if text is None else float(text)
    except ValueError:
        value = None
    if value is None or not np.isfinite(value):
        raise InputError(path, name, f"expected a number, got {text!r}")
    return value


def read_simpack(path, text, smoothed=False):
    """Read points u (to the field side) and f (up), (n,) in m, of a SIMPACK .prw or .prr file, and their line numbers.

    Shift, bounds, mirroring, inversion and unit are applied in the order of the file's numbering. Rotation, minimum
    distance and (without ``smoothed``) SIMPACK's approximation must be zero, as their definition is not public."""
    keys, begin = _header(path, text)
    for name in _UNSUPPORTED[: 2 if smoothed else 3]:
        if _value(path, keys, name, 0.0):
            raise InputError(path, name, f"expected 0 (export the processed points), got {keys[name]}")
    y, z, lines = _simpack_points(path, text, begin)
    y, z = y + _value(path, keys, "shift.y", 0.0), z + _value(path, keys, "shift.z", 0.0)
    keep = _inside(path, keys, "y", y) & _inside(path, keys, "z", z)
    y, z, lines = y[keep], z[keep], lines[keep]
    y = -y if _value(path, keys, "mirror.y", 0.0) else y
    z = -z if _value(path, keys, "mirror.z", 0.0) else z
    if _value(path, keys, "inversion", 0.0):
        y, z, lines = y[::-1], z[::-1], lines[::-1]
    factor = _value(path, keys, "units.len.f", float("nan"))
    if not factor > 0.0:
        raise InputError(path, "units.len.f", f"expected a positive number of units per m, got {factor:g}")
    return y / factor, -z / factor, lines


def _simpack_points(path, text, begin):
    rows = []
    for number, line in enumerate(text.splitlines(), 1):
        line = re.split("[!%]", line)[0].strip()
        if number <= begin or not line:
            continue
        if line == "point.end":
            file = read_column_file(path, rows, header=None)
            y, z = file.numbers([0, 1]).T
            return y, z, np.array(file.lines, dtype=int)
        rows.append((number, line))
    raise InputError(path, "point.end", "expected a line point.end after the points, got the end of file (truncated?)")


def _inside(path, keys, axis, values):
    """Return the mask of values inside SIMPACK's bounds; a minimum above the maximum disables the bounds."""
    low = _value(path, keys, f"bound.{axis}.min", 1.0)
    high = _value(path, keys, f"bound.{axis}.max", 0.0)
    return np.ones(values.size, dtype=bool) if low > high else (values >= low) & (values <= high)
