"""Plausibility checks of measured wheel and rail points: directions, origin and unit.

The shape shows most errors of signs and origins. A wheel has a flange at its inner end, which points down (f is
positive upwards), and its tape circle on the tread. A rail's head falls at both ends and does not lean away from the
track's centre. Implausible points raise an InputError that names the key to correct.
"""

from typing import NamedTuple

import numpy as np

from wrcore.errors import InputError
from wrcore.errors.messages import warn

LARGEST, SMALLEST = 1.0, 5e-3
"""Largest size and smallest width of a profile, m; they detect wrong units."""

UNITS = {"m": 1.0, "mm": 1e-3, "inch": 0.0254, "cm": 1e-2, "um": 1e-6}
"""Length of the units of profile files, m. If a profile fits several units, the first of them is guessed."""

_NARROW = 0.02  # m; narrower profiles are scaled, parts, or files in cm that were read in mm
_WIDTHS = {"wheel": (0.05, 0.18), "rail": (0.03, 0.1)}  # m, of files in the right unit
_TREAD = 0.35  # the tread, or a rail's running surface, is the widest part with smaller slopes
_ON_TREAD = 0.5  # slope at the tape circle of a wheel; flanks have 1 and more
_FLANGE = 4e-3  # m; smallest height of a flange beside the tread
_CERTAIN = 12e-3  # m; a larger fall or rise beside the tread is a flange, even if stated directions differ
_FLANK = 10e-3  # m below the tape circle, where the thickness of flanges is measured
_FLANK_AT = -56e-3, -20e-3  # m; tape circles 55 (trams) to 76 mm from the flange back, flanges 20 to 35 mm thick
_STRAIGHT = 3e-4  # m; treads without a flange that deviate less from a line are cones and cylinders
_VERTICAL = 6.0  # slope of 80 degrees: flanges of wheels have 70 to 76, sides of rails 87
_STEP = 5e-4  # m
_FALSE_FLANGE = 5e-3  # m; largest height of a worn tread above its field side
_SIDES = 12e-3, 8e-3  # m below a rail's top: depth at which its sides are compared, and the smallest such depth
_OPEN = 4e-3  # m; half a head falls less than this at its open end
_STEEP = 0.7  # slope; sides of rails and flanges of wheels are steeper, a circle of 300 mm reaches it at 172 mm
_SIDE_MARGIN, _DEEP = 15e-3, 40e-3  # m; largest extent of a rail beyond its sides, down to this depth
_OUTWARD = (
    1.0 / 55.0
)  # rails lean towards the track's centre by 1/20 to 1/40 or stand upright; worn ones seem to lean less


class Mends(NamedTuple):
    """Advice in messages: the keys to change if points are read with wrong directions, origin or unit."""

    u: str = "u with the other sign"
    f: str = "f with the other sign"
    origin: str = "u from the tape circle"
    unit: str = "u and f in m"
    """Advice for a wrong unit; {} is replaced by the likely unit."""
    any_shape: str = "mends=False"
    """Advice to read a wheel without a flange."""
    factor: float = 1.0
    """Length of the file's unit, m."""
    is_stated: bool = False
    """Whether the user stated both directions, so that they are not assumed."""
    is_side_stated: bool = False
    """Whether the user stated the direction of u."""


def likely_unit(span, kind):
    """Return the unit in which a lateral extent ``span`` is that of a wheel or rail; None if there is none."""
    low, high = _WIDTHS[kind]
    return next((unit for unit, factor in UNITS.items() if low <= span * factor <= high), None)


def check_extent(u, f, kind, name, mends):
    """Raise an InputError for points (m) wider or higher than `LARGEST` or narrower than `SMALLEST`.

    The message names the unit in which they would be a ``kind``.
    """
    width, height = np.ptp(u), np.ptp(f)
    if width >= SMALLEST and max(width, height) <= LARGEST:
        if width < _NARROW and likely_unit(width / mends.factor, kind) == "cm":
            mend = mends.unit.format("cm")
            warn(f"{name}: a {kind} only {1e3 * width:.3g} mm wide; if its numbers are in cm: {mend}")
        return
    low, high = _WIDTHS[kind]
    raw = width / mends.factor
    likely = likely_unit(raw, kind)
    expected = f"expected a profile 5 mm to 1 m wide, got numbers that span {raw:.4g}"
    expected += f" and {height / mends.factor:.4g}" if height > LARGEST else ""
    if likely:
        raise InputError(name, "unit", f"{expected}; looks like {likely}: {mends.unit.format(likely)}")
    raise InputError(
        name, "unit", f"{expected}: in none of {', '.join(UNITS)} a {kind} {1e3 * low:g} to {1e3 * high:g} mm wide"
    )


def check_wheel(u, f, name, mends):
    """Raise an InputError if points u, f (m, in order of increasing u) are no wheel in the package's axes."""
    if not u.min() < 0.0 < u.max():
        got = f"got it outside, u from {u.min():.4g} to {u.max():.4g} m: {mends.origin}"
        raise InputError(name, "points", f"expected u = 0 (tape circle) inside a wheel profile, {got}")
    at, height, first, last = _tread(u, f)
    ends = _ends(height, first, last)
    falls = min(height[0], height[-1]) if height.size else 0.0
    both = max(f[0], f[-1]) < f.max() - _FALSE_FLANGE or min(ends["inner fall"], ends["outer fall"]) > _FLANGE
    if both and falls < height.max() - _FLANGE:
        inner = at[np.argmax(height)] < 0.5 * (at[0] + at[-1])
        expected = "expected a wheel, got a profile that falls on both sides like a rail"
        mend = mends.f if inner else f"{mends.u} and {mends.f}"
        raise InputError(name, "points", f"{expected}; of a wheel whose flange stands up: {mend}")
    if _has_steep_side(u, f, at[first]) and not mends.is_stated:
        expected = f"expected a wheel's flange, at negative u less steep than {_VERTICAL:g}"
        raise InputError(name, "points", f"{expected}, got the side of a rail; of a wheel {mends.any_shape}")
    largest = max(ends, key=ends.get)
    size = ends[largest]
    turns = {"outer fall": mends.u, "inner rise": mends.f, "outer rise": f"{mends.u} and {mends.f}"}
    if largest in turns and size > (_CERTAIN if mends.is_stated else _FLANGE):
        got = f"got the flange at {'positive' if largest.startswith('outer') else 'negative'} u"
        got += ", f positive down" if largest.endswith("rise") else ""
        expected = "expected the flange at negative u and f positive up (the largest radius at the flange)"
        raise InputError(name, "points", f"{expected}, {got}: {turns[largest]}")
    if size <= _FLANGE and not mends.is_stated:
        bent = np.ptp(height - np.polyval(np.polyfit(at, height, 1), at))
        if bent > _STRAIGHT or np.polyfit(at, height, 1)[0] < -0.01:
            got = f"got none in points from u = {u.min():.4g} to {u.max():.4g} m"
            mend = f"add points up to the flange, or, of a wheel without one, {mends.any_shape}"
            raise InputError(name, "points", f"expected a wheel with a flange at negative u, {got}: {mend}")
    slope = np.interp(0.0, at, np.gradient(height, at))
    lowest = at[np.argmin(height)]
    is_short = largest == "inner fall" and size > max(_FLANGE, -lowest)
    if abs(slope) > _ON_TREAD or is_short:
        got = (
            f"got it only {1e3 * max(-lowest, 0.0):.3g} mm from"
            if is_short
            else f"got a slope of {slope:.2g} there, on"
        )
        raise InputError(name, "points", f"expected u = 0 (tape circle) on the tread, {got} the flange: {mends.origin}")
    if largest == "inner fall" and size > _CERTAIN and not mends.is_stated:
        below = np.flatnonzero((at < 0.0) & (height < np.interp(0.0, at, height) - _FLANK))
        low, high = _FLANK_AT
        if below.size and not low <= at[below[-1]] <= high:
            expected = f"expected u = 0 (tape circle) {-1e3 * high:g} to {-1e3 * low:g} mm from the flank of the flange"
            got = f"got {-1e3 * at[below[-1]]:.3g} mm: {mends.origin}; of another wheel {mends.any_shape}"
            raise InputError(name, "points", f"{expected}, {got}")


def check_rail(u, f, name, mends):
    """Raise an InputError if points u, f (m) are no rail in the package's axes.

    The points are in order of increasing u, with the rail's inclination in the track.
    """
    top = int(np.argmax(f))
    if top in (0, f.size - 1):
        low = int(np.argmin(f))
        mend = mends.f if low not in (0, f.size - 1) else "a wheel's points may stand here"
        expected = "expected a rail head with f positive up, got its highest point at an end"
        raise InputError(name, "points", f"{expected}: {mend}")
    inner, outer = f[top] - f[:top].min(), f[top] - f[top:].min()
    depth = min(inner, outer, _SIDES[0])
    if not (mends.is_stated or mends.is_side_stated) and inner < _OPEN and outer >= _SIDES[1]:
        warn(f"{name}: half a rail head, without its gauge side (negative u); where that is the side: {mends.u}")
    if mends.is_side_stated or depth < _SIDES[1]:
        return
    left, right = (_side(u, f, top, step, depth) for step in (-1, 1))
    middle, half = 0.5 * (left + right), 0.25 * (right - left)
    head = np.abs(u - middle) < half
    if head.sum() > 3:
        lean = np.polyfit(u[head], f[head], 1)[0]
        if lean < -_OUTWARD:
            got = f"got one that leans outwards by 1/{-1.0 / lean:.0f}"
            expected = "expected a rail upright or leaning towards the track's centre, u to the field side"
            raise InputError(name, "points", f"{expected}, {got}: {mends.u}, or the opposite where that is so")


def check_sides(u, f, name):
    """Raise an InputError for points of a rail that lie laterally outside its head.

    A curve without steep parts is not checked, as it has no sides: rails of roller rigs and of tests are circles.
    """
    top = int(np.argmax(f))
    slopes = np.abs(np.diff(f)) / np.maximum(np.abs(np.diff(u)), 1e-9)
    if np.max(slopes[f[1:] > f[top] - _DEEP], initial=0.0) < _STEEP:
        return
    sides = [_side(u, f, top, step, _SIDES[0]) for step in (-1, 1)]
    near = (f < f[top] - _SIDES[0]) & (f > f[top] - _DEEP)
    for edge, sign in zip(sides, (-1.0, 1.0), strict=True):
        if edge is not None and np.any(near & (sign * (u - edge) > _SIDE_MARGIN)):
            wide = f"{1e3 * _SIDE_MARGIN:g} mm"
            expected = f"expected a rail whose sides fall, got points more than {wide} beside its head"
            raise InputError(name, "points", f"{expected}, as of another head or a wheel: leave them out (within)")


def _side(u, f, top, step, depth):
    """Return the abscissa (m) of the first point of a head at ``depth`` (m) below its top on one side, or None."""
    reached = f[top] - f[top::step] >= depth * (1.0 - 1e-9)
    return float(u[top::step][np.argmax(reached)]) if reached.any() else None


def _tread(u, f):
    """Return uniform abscissae (m), heights there (m), and the end indices of the widest part with a tread's slope.

    The ends of the profile, which may be side faces, are left out.
    """
    ahead = np.flatnonzero(np.append(True, u[1:] > np.maximum.accumulate(u)[:-1]))
    width = u[ahead[-1]] - u[ahead[0]]
    at = np.linspace(u[ahead[0]] + 0.01 * width, u[ahead[-1]] - 0.01 * width, 120)
    height = np.interp(at, u[ahead], f[ahead])
    level = np.abs(np.diff(height)) < _TREAD * np.diff(at)
    edges = np.flatnonzero(np.diff(np.concatenate(([False], level, [False])).astype(int)))
    if not edges.size:
        return at, height, 0, at.size - 1
    begin = 2 * int(np.argmax(edges[1::2] - edges[::2]))
    return at, height, int(edges[begin]), int(edges[begin + 1])


def _has_steep_side(u, f, inner):
    """Whether points inside the abscissa ``inner`` (m) rise outwards as steeply as a rail's side, over `_STEP`."""
    length = np.append(0.0, np.hypot(np.diff(u), np.diff(f)).cumsum())
    at = np.arange(0.0, length[-1], _STEP)  # a coarse step, as rounding makes points close together steep
    across, up = np.diff(np.interp(at, length, u)), np.diff(np.interp(at, length, f))
    return bool(np.any((up > _VERTICAL * np.abs(across)) & (np.interp(at[1:], length, u) <= inner)))


def _ends(height, first, last):
    """Return the heights (m) by which the profile falls and rises beyond its tread, on the inner and outer side."""
    inner, outer = height[: first + 1], height[last:]
    return {
        "inner fall": height[first] - inner.min(), "inner rise": inner.max() - height[first],
        "outer fall": height[last] - outer.min(), "outer rise": outer.max() - height[last],
    }  # fmt: skip
