"""Smooth outline through measured points: checks, parametric spline, origin."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from wrcore.errors import InputError
from wrcore.errors.messages import warn
from wrcore.geometry.profiles.checks import Mends, check_extent, check_rail, check_sides, check_wheel
from wrcore.geometry.profiles.smoothing import even_out

if TYPE_CHECKING:  # a third of a second that runs with standard profiles need not wait
    from scipy.interpolate import BSpline

FEWEST = 8
"""Smallest number of points of a profile."""

_CLOSE = 1e-7  # m; the direction between closer points is dominated by rounding errors
_DEEPEST = 0.025  # m below a rail's top; deeper points, often around the head's underside, are never in contact
_LEVEL = 2e-7  # m; a rail's origin this close to the height of the top is kept
_ANY_SLOPE, _STEEP = 1e6, 10.0  # no limit of slope; largest slope of a curve
_NARROWEST = 0.02  # m; smallest usable width of a profile, below it the points are wrong
_LEFT_OUT = 3e-3  # m; largest width of the side faces of a single-valued profile
_WIDEST, _USUAL = 0.010, 5.0  # largest bridged gap, m; a gap is longer than this many median distances of points
_STRAIGHT, _BENT = 2e-5, 5e-4  # m; deviation from a line over a gap: below the first no gap, above the second an error
_COARSE = 3e-4  # m; largest deviation from a line between two points without a warning
_BENDS = 2.0  # 1/m; curvature from noise above which wrcore warns: 1 um at points 0.5 mm apart is 4 1/m
_MEDIAN = 0.6745  # ratio of the median magnitude of Gaussian noise to its standard deviation
_QUIET = 4e-7  # m; noise below it, and rounding to 1 um, changes conicity by less than 0.002
_ADVISED = 1.1  # smoothing over noise; from 0.7 to 1.4 conicity improves (0.5 to 10 um, points 0.1 to 1 mm apart)
_BACK = 1e-3  # m; largest backward step of u where two passes of a meter are joined


@dataclass(frozen=True, eq=False)
class Outline:
    """Parametric cubic spline (u(s), f(s)), s in [0, 1], in m."""

    curve: "BSpline"
    name: str
    points: np.ndarray
    """(n, 2): all given points in the axes of the outline, m."""
    s: np.ndarray
    """(n,): parameters of the points, NaN for points that were left out."""

    def _component(self, column):
        from scipy.interpolate import PPoly

        return PPoly.from_spline((self.curve.t, self.curve.c[:, column], self.curve.k))

    def _dense(self):
        knots = np.unique(self.curve.t)
        return np.unique(np.concatenate([knots[:-1] + k / 8 * np.diff(knots) for k in range(8)] + [knots[-1:]]))

    def span(self, steepest):
        """Return the connected range of u (m) around 0 that is single-valued and no steeper than ``steepest``."""
        return tuple(map(float, self.curve(np.array(self._ends(steepest)))[:, 0]))

    def followed(self, steepest):
        """Return the mask (n,) of points on the part of the outline within `span`."""
        first, last = self._ends(steepest)
        return (self.s >= first) & (self.s <= last)

    def _ends(self, steepest):
        """Return the parameters of the ends of `span`."""
        s = self._dense()
        u = self.curve(s)[:, 0]
        du, df = self.curve(s, nu=1).T
        good = (du > 0.0) & (np.abs(df) <= steepest * du)
        home = int(np.argmin(np.abs(u)))
        if not good[home]:
            raise InputError(self.name, "points", "expected a smooth profile around u = 0, got one too steep there")
        bad = np.flatnonzero(~good)
        first, last = bad[bad < home].max(initial=-1) + 1, bad[bad > home].min(initial=u.size) - 1
        return s[first], s[last]

    def working_span(self, steepest, trim):
        """Return `span`; InputError if it is too narrow or if too many points are outside.

        With ``trim`` points outside may be side faces and undersides of heads.
        """
        low, high = self.span(steepest)
        if high - low < _NARROWEST:
            got = f"got {high - low:.3g} m of it"
            raise InputError(self.name, "points", f"expected a smooth profile around u = 0, {got}")
        u, f = self.curve(self._dense()).T
        if trim:  # allow side faces and undersides of heads, but no second head and no flange
            u = u[f > f[(u >= low) & (u <= high)].max() - _DEEPEST]
        for end, rest in ((low, low - u.min()), (high, u.max() - high)):
            if rest > _LEFT_OUT:
                got = f"got a steeper place at u = {end:.4f} m with {rest:.4f} m of points beyond"
                kept = np.isfinite(self.s)
                size, _ = _scatter(*self.points[kept].T)
                got += _smoother(size) if size > _QUIET else " (of dents and noise: smoothing evens them out)"
                raise InputError(self.name, "points", f"expected slopes below {steepest:g}, {got}")
        return low, high

    def evaluate(self, u):
        """Return ordinate (m) and slope at the abscissae ``u`` (m, inside `span`)."""
        s = self._parameter(u)
        du, df = self.curve(s, nu=1).T
        return self.curve(s)[:, 1], df / du

    def _parameter(self, u):
        """Solve u(s) = u for s by Newton's method from a close start; u(s) is monotone inside the span."""
        dense = self._dense()
        table = self.curve(dense)[:, 0]
        home = int(np.argmin(np.abs(table)))
        turn = np.flatnonzero(np.diff(table) <= 0.0)
        first, last = turn[turn < home].max(initial=-1) + 1, turn[turn >= home].min(initial=table.size - 1)
        s = np.interp(u, table[first : last + 1], dense[first : last + 1])
        for _ in range(20):
            s = np.clip(s - (self.curve(s)[:, 0] - u) / self.curve(s, nu=1)[:, 0], 0.0, 1.0)
        if not np.all(np.abs(self.curve(s)[:, 0] - u) < 1e-12):
            raise InputError(self.name, "points", "expected a smooth profile, got one that no spline follows")
        return s

    def highest(self):
        """Return the highest point (u, f), m."""
        s = np.concatenate(([0.0, 1.0], self._component(1).derivative().roots(extrapolate=False)))
        points = self.curve(s[np.isfinite(s)])
        u, f = points[np.argmax(points[:, 1])]
        return float(u), float(f)

    def shifted(self, du, df):
        """Return the outline moved by (``du``, ``df``), m."""
        moved = type(self.curve)(self.curve.t, self.curve.c + (du, df), self.curve.k)
        return replace(self, curve=moved, points=self.points + (du, df))

    def innermost(self, depth):
        """Return the abscissa (m) of the leftmost point at most ``depth`` (m) below the ordinate 0.

        The result is NaN if the outline does not reach this depth at negative u.
        """
        u, f = self.curve(np.unique(self.curve.t)).T
        if not np.any((u < 0.0) & (f <= -depth)):
            return float("nan")
        crossing = self._component(1).solve(-depth, extrapolate=False)
        s = np.concatenate((crossing, self._component(0).derivative().roots(extrapolate=False), [0.0, 1.0]))
        points = self.curve(s[np.isfinite(s)])
        return float(points[points[:, 1] >= -depth - 1e-12, 0].min())


def fit(u, f, kind, name, lines=None, trim=False, inclination=0.0, smoothing=0.0, mends=None):
    """Check measured points and return the outline through them: wheel f(0) = 0, rail with its origin at the top.

    Arguments are those of `wrcore.geometry.profiles.profile.ProfileCurve.from_points`. ``mends`` (`Mends`) is the
    advice in messages; with False the shape is not checked.
    """
    mends = Mends() if mends is None else mends
    u, f = np.array(u, dtype=float), np.array(f, dtype=float)
    lines = np.arange(1, u.size + 1) if lines is None else np.asarray(lines)
    _check_numbers(u, f, name, lines)
    check_extent(u, f, kind, name, mends or Mends())
    rounding = _rounding(u, f, (mends or Mends()).factor)
    if not 0.0 <= smoothing <= 1e-3:
        raise InputError(name, "smoothing", f"expected a distance in m, 0 to 0.001, got {smoothing:g}")
    kept = np.flatnonzero(np.append(True, (np.diff(u) != 0.0) | (np.diff(f) != 0.0)))  # leave out repeated points
    if u[-1] < u[0]:
        kept = kept[::-1]
    if not trim:
        trim = _has_side_faces(u[kept], f[kept], name, lines[kept])
    if inclination:
        c, s = np.cos(np.arctan(inclination)), np.sin(np.arctan(inclination))
        u, f = u * c - f * s, u * s + f * c
    if kind == "rail":
        if mends:
            check_rail(u[kept], f[kept], name, mends)
        head = _head(u[kept], f[kept], lines[kept], name)
        if mends:
            check_sides(u[kept], f[kept], name)
        kept = kept[head]
    if trim:
        kept = kept[_forward(u[kept], f[kept])]
    if kind == "wheel" and mends:
        check_wheel(u[kept], f[kept], name, mends)
    outline = _spline(u, f, kept, name, lines, smoothing, rounding)
    return _rail_pose(outline) if kind == "rail" else _wheel_pose(outline)


def _check_numbers(u, f, name, lines):
    if u.ndim != 1 or u.shape != f.shape:
        raise InputError(name, "points", f"expected two columns of equal length, got shapes {u.shape} and {f.shape}")
    if u.size < FEWEST:
        raise InputError(name, "points", f"expected at least {FEWEST} points, got {u.size}")
    bad = np.flatnonzero(~(np.isfinite(u) & np.isfinite(f)))
    if bad.size:
        i = bad[0]
        raise InputError(name, f"line {lines[i]}", f"expected finite numbers, got {u[i]:g}, {f[i]:g}")


def _has_side_faces(u, f, name, lines):
    """Whether u does not increase on side faces at the ends; InputError if it does not increase elsewhere."""
    du, df = np.diff(u), np.diff(f)
    at_end = np.minimum(u[1:] - u.min(), u.max() - u[1:]) < _LEFT_OUT
    back = du <= 0.0
    wrong = np.flatnonzero(back & ~(at_end & (np.abs(df) > -_STEEP * du)))
    if wrong.size:
        i = wrong[0] + 1
        got = f"got {u[i]:.9g} m beside {u[i - 1]:.9g} m"
        where = "leave out anything below the head or behind the flange"
        raise InputError(name, f"line {lines[i]}", f"expected strictly monotone u ({where}), {got}")
    return bool(back.any())


def _head(u, f, lines, name):
    """Return the slice of connected rail points around the highest point, down to `_DEEPEST` below it."""
    top = int(np.argmax(f))
    low = f < f[top] - _DEEPEST
    deep = np.flatnonzero(low)
    keep = slice(deep[deep < top].max(initial=-1) + 1, deep[deep > top].min(initial=f.size))
    low[keep] = True
    if not low.all():
        i = int(np.argmin(low))
        got = f"got another one, {f[top] - f[i]:.3g} m below the highest, at u = {u[i]:.4g} m"
        raise InputError(name, f"line {lines[i]}", f"expected one rail head, {got}: leave it out")
    return keep


def _forward(u, f):
    """Return the mask of points without backward steps of less than `_BACK`, where a meter's passes are joined.

    Points of side faces are kept, as these may be undercut.
    """
    remain, du, df = np.ones(u.size, dtype=bool), np.diff(u), np.diff(f)
    level = np.abs(df) < du
    for i in np.flatnonzero((du[1:] < 0.0) & (np.abs(df[1:]) < -_STEEP * du[1:]) & level[:-1]) + 2:
        ahead = np.flatnonzero(u[i:] > u[i - 1])[:1] + i
        if ahead.size and u[i - 1] - u[i : ahead[0]].min() < _BACK and np.hypot(du, df)[i : ahead[0]].sum() < 2 * _BACK:
            remain[i : ahead[0]] = False
    return remain


def _check_gaps(u, f, name, lines):
    """Warn of gaps between points that are bridged; InputError for gaps over which the shape is unknown."""
    du, df = np.diff(u), np.diff(f)
    length, angle = np.hypot(du, df), np.arctan2(df, du)
    turn = np.abs(np.diff(angle, prepend=angle[:1], append=angle[-1:]))
    bend = length * (turn[:-1] + turn[1:]) / 8.0  # an arc's rise over its chord
    wide = (length > _USUAL * np.median(length)) & (bend > _STRAIGHT) & (np.abs(df) < _STEEP * du)
    for i in np.flatnonzero(wide):
        gap = f"a gap of {length[i]:.2g} m at u = {u[i]:.4g} m, over which the profile bends by {bend[i]:.2g} m"
        if length[i] > _WIDEST or bend[i] > _BENT:
            expected = f"expected points at most {_USUAL * np.median(length):.2g} m apart, as elsewhere"
            raise InputError(name, f"line {lines[i + 1]}", f"{expected}, got {gap}")
        warn(f"{name}: line {lines[i + 1]}: {gap}, is bridged by a spline")
    coarse = np.where(~wide & (np.abs(df) < _STEEP * du), bend, 0.0)
    i = int(np.argmax(coarse))
    if coarse[i] > _COARSE:
        apart = (
            f"points {length[i]:.2g} m apart at u = {u[i]:.4g} m, between which the profile bends by {coarse[i]:.2g} m"
        )
        warn(f"{name}: line {lines[i + 1]}: {apart}: the curve may be wrong by as much")


def _scatter(u, f):
    """Return the standard deviation (m) of the points' noise and the curvature (1/m) that it adds to the curve.

    The noise is estimated from the distance of each point from the cubic through its four neighbours. Both are 0 if no
    part of the profile is suitable for the estimate.
    """
    around = np.stack([u[i : u.size - 4 + i] for i in (0, 1, 3, 4)])
    between, own = around[:, None] - around, np.eye(4, dtype=bool)[..., None]
    with np.errstate(all="ignore"):  # on side faces points lie above each other
        beside = np.where(own, 1.0, (u[2:-2] - around) / (between + own)).prod(axis=1)
        missed = f[2:-2] - sum(beside[k] * f[i : u.size - 4 + i] for k, i in enumerate((0, 1, 3, 4)))
        scatter = np.abs(missed) / np.sqrt(1.0 + (beside**2).sum(axis=0)) / _MEDIAN
    level = (np.abs(f[4:] - f[:-4]) < u[4:] - u[:-4]) & np.isfinite(scatter)
    if not np.any(level):
        return 0.0, 0.0
    return float(np.median(scatter[level])), float(np.median(scatter[level] / (0.25 * (u[4:] - u[:-4])[level]) ** 2))


def _rounding(u, f, factor):
    """Return the rounding's standard deviation (m) of points rounded to 0.1 to 0.001 units of ``factor`` m, else 0."""
    raw = np.concatenate((u, f)) / factor
    step = next((10.0**-d for d in (1, 2, 3) if np.all(np.abs(raw - np.round(raw, d)) < 1e-3 * 10.0**-d)), 0.0)
    return step * factor / np.sqrt(12.0)


def _smoother(size):
    """Return the text that advises a smoothing for noise of a standard deviation ``size`` (m)."""
    return f" (smoothing: {_ADVISED * size:.1e} evens them out)"


def _check_scatter(u, f, name, rounding):
    """Warn if the points' noise adds curvature to the curve, and advise a smoothing.

    ``rounding`` (m) is the standard deviation of rounding, whose errors are correlated between neighbours.
    """
    size, bend = _scatter(u, f)
    if bend > _BENDS and size > _QUIET and not size < 0.5 * rounding:
        advised = rounding / _ADVISED if size < 2.0 * rounding else size
        warn(f"{name}: points scatter by {size:.1e} m, which bends the curve by {bend:.2g}/m{_smoother(advised)}")


def _spline(u, f, kept, name, lines, smoothing, rounding):
    """Return the Outline through the points ``kept``: a parametric cubic spline over chord length.

    Points that nearly coincide with the preceding point are left out.
    """
    from scipy.interpolate import BSpline, splprep

    used = list(kept[:1])
    for i in kept[1:]:
        if np.hypot(u[i] - u[used[-1]], f[i] - f[used[-1]]) > _CLOSE:
            used.append(i)
    if len(used) < FEWEST:
        raise InputError(name, "points", f"expected at least {FEWEST} distinct points, got {len(used)}")
    _check_gaps(u[used], f[used], name, lines[used])
    if smoothing == 0.0:
        _check_scatter(u[used], f[used], name, rounding)
    points = np.column_stack((u[used], f[used]))
    if smoothing:
        length = np.append(0.0, np.cumsum(np.hypot(*np.diff(points, axis=0).T)))
        try:
            points = even_out(length, points, smoothing)
        except (np.linalg.LinAlgError, ValueError):
            expected = f"expected less than {smoothing:g} m of points that lie so close together"
            raise InputError(name, "smoothing", expected) from None
    (knots, coefficients, degree), at = splprep(points.T, s=0.0, k=3)
    s = np.full(u.size, np.nan)
    s[used] = at
    return Outline(BSpline(knots, np.column_stack(coefficients), degree), name, np.column_stack((u, f)), s)


def _rail_pose(outline):
    """Return the outline of a rail moved to f = 0 at its top; an origin at the height of the top is kept."""
    top_u, top_f = outline.highest()
    low, high = outline.shifted(-top_u, 0.0).span(_ANY_SLOPE)
    if low < -top_u < high:
        here = float(outline.shifted(-top_u, 0.0).evaluate(np.array([-top_u]))[0][0])
        if top_f - here <= _LEVEL:
            return outline.shifted(0.0, -here)
    return outline.shifted(-top_u, -top_f)


def _wheel_pose(outline):
    """Return the outline of a wheel moved vertically to f(0) = 0."""
    outline.span(_ANY_SLOPE)
    return outline.shifted(0.0, -float(outline.evaluate(np.zeros(1))[0][0]))
