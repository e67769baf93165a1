"""Named profiles from their published sections, and `named_profile`, which accepts names, formulas and files."""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from wrcore.errors import InputError, similar
from wrcore.errors.checked_calls import OneOf, Within, checked
from wrcore.errors.checked_yaml import parse_ratio
from wrcore.geometry.profiles import files as profile_files
from wrcore.geometry.profiles.profile import SPACING, WINDOW, ProfileCurve
from wrcore.geometry.profiles.sections import Arc, Line, Polynomial, incline

_MM = 1e-3

# S1002, EN 13715 / UIC 510-2 (ORE S1002). Coefficients as in the widely copied definition "courtesy of Dr H. Netter,
# DLR". mm; y from the tape circle to the field side, z = additional rolling radius (down), so f = -z.
_S1002_ARCS = (  # y from, y to, centre y, centre z, R, z = zc + side sqrt(R^2 - (y - yc)^2)
    (-70.0, -62.764705882, -49.5, 9.519259302, 20.5, 1),
    (-62.764705882, -49.662510381, -55.0, 16.0, 12.0, 1),
    (-49.662510381, -39.764473993, -58.558326413, 8.834924130, 20.0, 1),
    (-38.426669071, -35.0, -26.210665, 16.446, 13.0, -1),
)
_S1002_FLANGE = (-93.576667419, -2.747477419)
_S1002_C = (
    -4320.221063, -1038.384026, -106.5501873, -6.051367875, -0.2054332446, -4.169739389e-3, -4.687195829e-5,
    -2.252755540e-7,
)  # fmt: skip
_S1002_B = (
    0.0, -3.358537058e-2, 1.565681624e-3, -2.810427944e-5, 5.844240864e-8, -1.562379023e-8, 5.309217349e-15,
    -5.957839843e-12, 2.646656573e-13,
)  # fmt: skip
_S1002_A = (1.364323640, -0.066666667)
_S1002_TREAD_START, _S1002_TREAD_END = 32.15796, 60.0

_CONE_RANGE = (-0.070, 0.060)  # m; width of S1002
_CIRCLE_DEPTH = 0.040  # m; a circular rail head ends here: about the height of a rail head


@dataclass(frozen=True)
class RailHead:
    """Symmetric rail head: tangent arcs from the crown outwards, then a straight side face."""

    radii: tuple
    """Radii of the arcs from the crown to the gauge corner, mm."""
    half_widths: tuple
    """Half widths of the head at the joints between the arcs, mm; one fewer than ``radii``."""
    side: float
    """Inclination of the side face against the vertical, such as 1/20."""
    source: str


_EN13674 = "EN 13674-1, dimensions as in github rohrbecka/EN13674"
RAIL_HEADS = {
    "UIC60-MBench": RailHead(
        (300.0, 80.0, 13.0), (10.5, 25.98802), 1 / 20, "UIC60 of the Manchester contact benchmark (SIMPACK UIC_60)"
    ),
    "60E1": RailHead((300.0, 80.0, 13.0), (10.228, 26.0265), 1 / 20, _EN13674),
    "60E2": RailHead((200.0, 70.0, 16.0, 8.0), (11.889, 24.4565, 35.387), 1 / 20, _EN13674),
    "54E1": RailHead((300.0, 80.0, 13.0), (10.012, 24.8635), 1 / 20, _EN13674),
    "50E6": RailHead((200.0, 60.0, 13.0), (15.471, 21.919), 1 / 20, _EN13674),
    "49E1": RailHead((300.0, 80.0, 13.0), (7.6335, 23.4175), 1 / 17.2, _EN13674),
}
_SIDE_DEPTH = 0.020  # m below the crown; the side face is needed for the gauge only, which is measured at 14 mm
_S1002_SOURCE = "S1002 (EN 13715), sections with coefficients by H. Netter, DLR"


def s1002_sections():
    """Return the sections of the S1002 wheel, in m, from the flange back (-70 mm) to the field side (60 mm).

    At the tape circle f(0) = 0. With the published coefficients the height jumps by 0.118 um at -35 mm and 0.037 um at
    -26 mm. In a Hermite cell a jump would be a wrong slope, so a linear function of u is added to section C that closes
    both (slope change below 2e-5)."""
    h, g, f, d = (
        Arc.between(a * _MM, b * _MM, yc * _MM, -zc * _MM, r * _MM, -side) for a, b, yc, zc, r, side in _S1002_ARCS
    )
    start, end = _S1002_ARCS[2][1] * _MM, _S1002_ARCS[3][0] * _MM
    c0, c1 = _S1002_FLANGE
    e = Line(start, -c0 * _MM - c1 * start, end, -c0 * _MM - c1 * end)
    c = Polynomial(-0.035, -0.026, tuple(-k for k in _S1002_C))
    b = Polynomial(-0.026, _S1002_TREAD_START * _MM, tuple(-k for k in _S1002_B))
    a = Polynomial(_S1002_TREAD_START * _MM, _S1002_TREAD_END * _MM, tuple(-k for k in _S1002_A))
    return h, g, f, e, d, _closed(c, d.ends[1][1], b.ends[0][1]), b, a


def _closed(polynomial, f0, f1):
    """Return the polynomial plus the linear function with which it begins at ``f0`` and ends at ``f1`` (m)."""
    (u0, own0), (u1, own1) = polynomial.ends
    slope = ((f1 - own1) - (f0 - own0)) / (u1 - u0)
    offset = (f0 - own0) - slope * u0
    first, second, *rest = polynomial.coefficients
    return Polynomial(u0, u1, (first + offset / polynomial.scale, second + slope, *rest), polynomial.scale)


def rail_sections(head):
    """Return the sections of an upright RailHead from the gauge side to the field side, crown at (0, 0), in m."""
    right: list = []
    start = uc = fc = before = 0.0
    ends = [w * _MM for w in head.half_widths] + [None]
    for radius, end in zip((r * _MM for r in head.radii), ends, strict=True):
        # the centre moves along the common normal, so that the arcs are tangent
        uc, fc = uc + (before - radius) * np.sin(start), fc + (before - radius) * np.cos(start)
        stop = np.pi / 2 - np.arctan(head.side) if end is None else float(np.arcsin((end - uc) / radius))
        right.append(Arc(uc, fc, radius, start, stop))
        start, before = stop, radius
    u, f = right[-1].ends[1]
    right.append(Line(u, f, u + head.side * (f + _SIDE_DEPTH), -_SIDE_DEPTH))
    crown = Arc(0.0, right[0].fc, right[0].radius, -right[0].last, right[0].last)
    return (*(_mirrored(s) for s in reversed(right[1:])), crown, *right[1:])


def _mirrored(section):
    if isinstance(section, Line):
        return Line(-section.u1, section.f1, -section.u0, section.f0)
    return Arc(-section.uc, section.fc, section.radius, -section.last, -section.first)


def circle_sections(radius):
    """Return the section of a circular rail head (radius in m) with its top at (0, 0)."""
    end = np.arccos(max(1.0 - _CIRCLE_DEPTH / radius, 0.0))
    return (Arc(0.0, -radius, radius, -end, end),)


def cone_sections(slope):
    """Return the section of a conical wheel, f = slope * u, with the larger radius on the flange side (-u)."""
    low, high = _CONE_RANGE
    return (Line(low, slope * low, high, slope * high),)


@checked
def named_profile(
    spec: str | Path | dict[str, Any],
    kind: Annotated[str, OneOf(("wheel", "rail"))],
    inclination: Annotated[float | None, Within(-0.2, 0.2), "a ratio like 1/40, as a number within 0.2"] = None,
    window: Annotated[float, Within(1e-6, 0.1, "m")] = WINDOW,
    spacing: Annotated[float, Within(1e-6, 1e-3, "m")] = SPACING,
) -> ProfileCurve:
    """Return a profile by its name, an analytic form or a file.

    Parameters
    ----------
    spec : str or dict
        "S1002" (wheel); "UIC60-MBench", "60E1", ... (rails, `RAIL_HEADS`); "cone:1/20" (wheel); "circle:0.3" (rail,
        radius in m); the path of a point file (CSV, SIMPACK, MiniProf, Vampire); or ``{"points": path, "unit": "mm",
        "tape_circle": 0.07, ...}`` of which only ``points`` is required: `wrcore.geometry.profiles.files.read_profile`.
    kind : {"wheel", "rail"}
        Use of the profile.
    inclination : float, optional
        Inclination of the rail, for instance 1/40; 0 is upright. It is required for named rails and for point files
        with ``inclined: False``. Points of other files have their inclination in the track: then it must be 0 or
        absent, as for wheels.
    window : float
        Averaging length of the curvature, m.
    spacing : float
        Distance of the nodes, m.

    Returns
    -------
    ProfileCurve
        Its ``source`` names its origin and, for a file, the points that were read, rotated and left out.

    Raises
    ------
    InputError
        For an unknown name, a wheel used as a rail (or the reverse), a rail without an inclination, or a wrong file.

    Examples
    --------
    >>> import wrcore as wr
    >>> wheel, rail = wr.named_profile("S1002", "wheel"), wr.named_profile("60E1", "rail", inclination=1 / 40)
    >>> round(1e3 * float(wheel(-0.035)), 2), rail.name
    (-6.87, '60E1')
    """
    spec = str(spec) if isinstance(spec, Path) else spec
    upright = isinstance(spec, dict) and spec.get("inclined") is False
    if kind == "rail" and inclination is None and (upright or (isinstance(spec, str) and spec in RAIL_HEADS)):
        name = spec["points"] if isinstance(spec, dict) and "points" in spec else spec
        raise InputError(kind, "inclination", f"expected a ratio for {name}, such as 1/40, 1/20 or 0 (upright)")
    is_file = isinstance(spec, dict) or _is_file(spec)
    if inclination and (kind == "wheel" or (is_file and not upright)):
        raise InputError(kind, "inclination", _without_effect(spec, kind))
    inclination = inclination or 0.0
    options = {"window": window, "spacing": spacing}
    if is_file:
        return profile_files.read_profile(spec, kind, inclination, **options)
    sections, source = _sections(spec, kind)
    if kind == "rail":
        sections = incline(sections, inclination)
    return ProfileCurve.from_sections(spec, kind, sections, source, **options)


def _without_effect(spec, kind):
    """Return the error text for an inclination without effect on the profile, with the correction."""
    name = spec.get("points") if isinstance(spec, dict) else spec
    if kind == "wheel":
        return f"expected none for the wheel {name}: only rails have one"
    said = ", inclined: true," if isinstance(spec, dict) and "inclined" in spec else ""
    return (
        f"expected none or 0, as the points of {name}{said} lie in the track pose already; for points of an upright"
        f" rail write {{points: {name}, inclined: false}}, which the inclination then turns"
    )


def _is_file(spec):
    """Whether a text is a path: it has a suffix or a folder, or such a file exists."""
    if not isinstance(spec, str) or spec.startswith(("cone:", "circle:")):
        return False
    return bool(Path(spec).suffix) or "/" in spec or "\\" in spec or os.path.isfile(spec)


def _sections(spec, kind):
    """Return the sections and the source of a named or analytic profile of a ``kind``."""
    name = str(spec)
    form, _, value = name.partition(":")
    if name == "S1002":
        found, build, source = "wheel", s1002_sections, _S1002_SOURCE
    elif name in RAIL_HEADS:
        head = RAIL_HEADS[name]
        found, build, source = "rail", lambda: rail_sections(head), head.source
    elif form == "cone" and value:
        found, build, source = "wheel", lambda: cone_sections(_number(name, value, -0.5, 0.5)), "analytic"
    elif form == "circle" and value:
        found, build, source = "rail", lambda: circle_sections(_number(name, value, 0.01, 100.0)), "analytic"
    else:
        known = [row["name"] for row in list_profiles() if row["kind"] == kind]
        expected = f"expected a point file or one of {', '.join(known)}, got {spec!r}{similar(spec, known)}"
        raise InputError(kind, "profile", expected)
    if found != kind:
        raise InputError(kind, "profile", f"expected a {kind} profile, got {spec!r}, which is a {found}")
    return build(), source


def _number(spec, value, low, high):
    number = parse_ratio(value)
    if not low <= number <= high:
        raise InputError("profile", spec, f"expected a number from {low:g} to {high:g} after the colon, got {value!r}")
    return number


def list_profiles() -> list[dict[str, str]]:
    """Return the table of the named profiles.

    Returns
    -------
    list of dict
        Keys name, kind, sections (from the flange or from the crown), source.

    Examples
    --------
    >>> import wrcore as wr
    >>> [row["name"] for row in wr.list_profiles() if row["kind"] == "rail"][:3]
    ['UIC60-MBench', '60E1', '60E2']
    """
    rows = [{"name": "S1002", "kind": "wheel", "sections": "arcs, line, polynomials", "source": _S1002_SOURCE}]
    for name, head in RAIL_HEADS.items():
        radii = ", ".join(f"R{r:g}" for r in head.radii)
        side = f"side 1:{1 / head.side:g}"
        rows.append({"name": name, "kind": "rail", "sections": f"{radii}, {side}", "source": head.source})
    rows.append({"name": "cone:1/20", "kind": "wheel", "sections": "cone of any slope", "source": "analytic"})
    rows.append({"name": "circle:0.3", "kind": "rail", "sections": "arc of any radius (m)", "source": "analytic"})
    return rows
