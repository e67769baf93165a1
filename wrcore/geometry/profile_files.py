"""Profile files: CSV or columns of points, SIMPACK .prw/.prr. All conversions to the package's axes happen here.

Point files list u (lateral, positive to the field side) and f (positive up), one point a line; ``#``, ``%`` or ``!``
starts a comment. The unit stands in a header line ``u_m,f_m`` or ``u_mm,f_mm``, or is declared beside the path. Columns
may be separated by commas, semicolons, tabs or blanks; beside semicolons and tabs numbers may have decimal commas.
Further columns are not read; a header names them all. The UIC 519 / EN 15302 reference profiles (``*.dat``) follow this
convention without a header: declare ``unit: mm``. Files of profile meters (MiniProf) begin with
lines ``Name=value``, which are passed over; in which directions their columns count, and from where, is declared beside
the path: ``mirrored``, ``downwards``, ``shift``.

SIMPACK files list y (positive to the field side once ``mirror.y`` is applied) and z (positive down).
"""

import re
from pathlib import Path

import numpy as np

from wrcore.errors import InputError, one_of
from wrcore.errors.input_files import check_regular
from wrcore.geometry.profile import SPACING, WINDOW, ProfileCurve

_UNITS = {"m": 1.0, "mm": 1e-3}
_KEYS = {"points", "unit", "inclined", "smoothing", "mirrored", "downwards", "shift"}
_SEPARATED = "; decimal commas are read beside semicolons and tabs only"
_HEADED = "; a header above them is u_m,f_m or u_mm,f_mm: u to the field side, f up"
_UNSUPPORTED = ("rotate", "point.dist.min", "approx.smooth")


def read_profile(spec, kind, inclination=0.0, window=WINDOW, spacing=SPACING):
    """ProfileCurve of a ``kind`` from the path of a point file, or from a dict of ``points`` (the path) and how to read
    it.

    Keys: ``unit`` (m or mm); ``inclined`` (default True): a rail's points lie in the track pose already, else
    ``inclination`` turns them; ``smoothing`` (m). For files of columns: ``mirrored``: the first column counts towards
    the track's centre; ``downwards``: the second one counts down; ``shift`` (m, 2): added to u and f after that."""
    spec = _checked(spec if isinstance(spec, dict) else {"points": spec}, kind)
    path, unit = Path(spec["points"]), spec.get("unit")
    text = _text(path)
    simpack = path.suffix.lower() in (".prw", ".prr")
    if simpack:
        _check_type(path, text, kind)
    u, f, lines = read_simpack(path, text, "smoothing" in spec) if simpack else read_columns(path, text, unit)
    if not simpack:
        u, f = _turned(spec, u, f)
    turn = 0.0 if spec.get("inclined", True) or kind == "wheel" else inclination
    return ProfileCurve.from_points(
        u, f, kind, str(path), lines=lines, trim=simpack, inclination=turn,
        smoothing=float(spec.get("smoothing", 0.0)), window=window, spacing=spacing,
    )  # fmt: skip


def _turned(spec, u, f):
    """Points of columns in the package's directions, and from its origin."""
    across, up = spec.get("shift", (0.0, 0.0))
    u = (-u if spec.get("mirrored", False) else u) + across
    return u, (-f if spec.get("downwards", False) else f) + up


def _checked(spec, kind):
    unknown = sorted(str(k) for k in set(spec) - _KEYS)
    if unknown:
        raise InputError(kind, unknown[0], one_of(sorted(_KEYS), unknown[0]))
    if not isinstance(spec.get("points"), (str, Path)):
        raise InputError(kind, "points", f"expected the path of a point file, got {spec.get('points')!r}")
    if spec.get("unit") not in (None, *_UNITS):
        raise InputError(kind, "unit", f"expected m or mm, got {spec['unit']!r}")
    for key in ("inclined", "mirrored", "downwards"):
        if not isinstance(spec.get(key, True), bool):
            raise InputError(kind, key, f"expected true or false, got {spec[key]!r}")
    shift = spec.get("shift", [0.0, 0.0])
    if not isinstance(shift, (list, tuple)) or len(shift) != 2 or not all(map(_is_distance, shift)):
        raise InputError(kind, "shift", f"expected two distances in m, within 1, got {shift!r}")
    if Path(spec["points"]).suffix.lower() in (".prw", ".prr") and {"mirrored", "downwards", "shift"} & set(spec):
        expected = "expected none of these: a SIMPACK file states them itself"
        raise InputError(kind, "mirrored, downwards, shift", expected)
    smoothing = spec.get("smoothing", 0.0)
    if isinstance(smoothing, bool) or not isinstance(smoothing, (int, float)):
        raise InputError(kind, "smoothing", f"expected a distance in m, got {smoothing!r}")
    return spec


def _is_distance(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= 1.0


def _text(path):
    try:
        check_regular(path)
        data = path.read_bytes()
        wide = data.startswith((b"\xff\xfe", b"\xfe\xff"))
        return data.decode("utf-16" if wide else "utf-8-sig", errors="replace")
    except (OSError, ValueError) as error:
        fault = getattr(error, "strerror", None) or error
        raise InputError(path, "", f"expected a readable profile file: {fault}") from None


def _numbers(path, line, text):
    """Two numbers or more of one line; a comma within is a decimal one beside semicolons and tabs, elsewhere it
    separates."""
    text = text.strip(" \t,;")
    apart = re.split(r"[\s,]*[;\t]\s*", text)
    words = [word.replace(",", ".") for word in apart] if len(apart) > 1 else re.split(r"\s*,\s*|\s+", text)
    mixed = len(apart) == 1 and "," in text and re.search(r"[^\s,]\s+[^\s,]", text)
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        numbers = []
    if len(numbers) < 2 or (mixed and not all(re.search("[.eE]", word) for word in words)):
        hint = _HEADED if re.search(r"[^\W\d_eE]", text) else _SEPARATED if "," in text else ""
        raise InputError(path, f"line {line}", f"expected two numbers, got {text[:40]!r}{hint}")
    return numbers


def read_columns(path, text, unit=None):
    """Points u, f (n,) in m of a CSV or blank-separated file and the line number of each; a header line may state the
    ``unit``, or must agree with it."""
    points, lines, stated, whole = [], [], 0, True
    for number, line in enumerate(text.splitlines(), 1):
        line = re.split("[#%!]", line)[0].strip()
        names = re.findall(r"[^\s,;]+", line.replace('"', "").lower())
        header = re.fullmatch(r"u_(m|mm) f_(m|mm)", " ".join(names[:2]))
        if header and not points:
            unit, stated = _agreed(path, number, header.groups(), unit), len(names)
        elif re.match(r"[A-Za-z]\w*\s*=", line) and not points:
            continue
        elif line:
            points.append(_numbers(path, number, line))
            lines.append(number)
            count = stated or len(points[0])
            if len(points[-1]) != count:
                raise InputError(path, f"line {number}", f"expected {count} numbers, got {line[:40]!r}{_SEPARATED}")
            whole = whole and "," in line and not re.search("[.;\t]", line)
    if points and whole and not stated and len(points[0]) > 2:
        raise InputError(path, f"line {lines[0]}", f"expected numbers with decimal points{_SEPARATED}")
    if unit is None:
        raise InputError(path, "unit", "expected a header u_m,f_m or u_mm,f_mm, or unit: m or mm beside the path")
    u, f = np.array([point[:2] for point in points], dtype=float).reshape(-1, 2).T * _UNITS[unit]
    return u, f, lines


def _agreed(path, line, stated, declared):
    if stated[0] != stated[1] or declared not in (None, stated[0]):
        got = f"u in {stated[0]}, f in {stated[1]}" + (f", declared {declared}" if declared else "")
        raise InputError(path, f"line {line}", f"expected one unit for both columns, got {got}")
    return stated[0]


def _header(path, text):
    """Keys before the points, as text, and the line numbers of the key lines."""
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
    """Points u (to the field side) and f (up), (n,) in m, of a SIMPACK .prw or .prr file, and the line number of each.

    Applied, in the order of the file's own numbering: shift, bounds, mirroring, inversion, unit. Rotation, minimum
    distance and, unless the caller smooths, SIMPACK's approximation are refused where they are not zero, as their
    definition is not public."""
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
    points, lines = [], []
    for number, line in enumerate(text.splitlines(), 1):
        line = line.partition("!")[0].strip()
        if number <= begin or not line:
            continue
        if line == "point.end":
            y, z = np.array(points, dtype=float).reshape(-1, 2).T
            return y, z, np.array(lines, dtype=int)
        points.append(_numbers(path, number, line)[:2])
        lines.append(number)
    raise InputError(path, "point.end", "expected a line point.end after the points, got the end of file (truncated?)")


def _inside(path, keys, axis, values):
    """SIMPACK's bounds; a minimum above the maximum switches them off."""
    low = _value(path, keys, f"bound.{axis}.min", 1.0)
    high = _value(path, keys, f"bound.{axis}.max", 0.0)
    return np.ones(values.size, dtype=bool) if low > high else (values >= low) & (values <= high)
