"""Changing rails and out-of-round wheels: interpolation between sections at arc lengths or angles.

Feature lines divide a section into parts, each with the same number of points in all slices. Cubic splines along the
track (not-a-knot) connect corresponding points, so that features are interpolated along the feature lines. A part
exists from the first to the last of successive slices that have it: heads begin and end there. Before its first and
after its last slice the rail is prismatic. CONTACT (its user guide, variable profiles) reads ``.slcs`` files of slices
in this way.
"""

from dataclasses import dataclass, replace

import numpy as np

from wrcore.errors import InputError
from wrcore.geometry.profiles.profile import GAUGE_DEPTH, SPACING, STEEPEST, ProfileCurve, averaged_second_derivative
from wrcore.kernels.jit import jit

PATH_STEP = 5e-4
"""Largest distance of the paths across a part in the slice where it is widest, m, as in CONTACT. A section is the cubic
spline through the paths' points, which smooths shorter features."""

NARROWEST = 2e-3
"""Smallest width of a head, m."""

TURN = 2.0 * np.pi

# Rows of a point on a path: coordinates u and f, and their derivatives with respect to the path's number.
U, F, U_RATE, F_RATE = range(4)


@dataclass(frozen=True)
class Slice:
    """One section: arc length (m), cubic spline (u, f) over its chord length (m), and its feature lines."""

    s: float
    curve: object
    cuts: np.ndarray
    """(features,) chord lengths of the feature lines, m; NaN where a line does not exist."""

    @classmethod
    def through(cls, s, u, f, wavelength=0.0):
        """Return a slice through points u, f (m), ordered from the track's centre outwards.

        With a ``wavelength`` (m), shorter waves of the points are smoothed. The slice's ends are its only feature
        lines.
        """
        from scipy.interpolate import CubicSpline, make_smoothing_spline

        length, points = np.append(0.0, np.cumsum(np.hypot(np.diff(u), np.diff(f)))), np.column_stack([u, f])
        if not wavelength:
            return cls(s, CubicSpline(length, points), length[[0, -1]])
        weight = (length.size - 1) / length[-1] * (wavelength / TURN) ** 4
        return cls(s, make_smoothing_spline(length, points, lam=weight), length[[0, -1]])


@dataclass(frozen=True)
class Sheet:
    """One part of a rail over a run of slices."""

    first: float
    last: float
    """Arc lengths at which the part begins and ends, m; infinite if it continues beyond the first or last slice."""
    s: np.ndarray
    spline: object
    """Spline of the points (4, paths) over s; None for a single slice."""
    points: np.ndarray
    """(slices, 4, paths): points in rows U, F, U_RATE, F_RATE."""

    def at(self, s, nu=0):
        """Return points (n, 4, paths) at arc lengths s (n,), or with ``nu`` = 1 their derivative with respect to s.

        Values are NaN at arc lengths outside the part.
        """
        s = np.atleast_1d(np.asarray(s, float))
        inside = np.clip(s, self.s[0], self.s[-1])
        if self.spline is None:
            found = np.repeat(self.points if nu == 0 else 0.0 * self.points, s.size, 0)
        else:
            found = self.spline(inside, nu)
        if nu:
            found[s != inside] = 0.0
        found[(s < self.first) | (s > self.last)] = np.nan
        return found


@dataclass(frozen=True)
class RailSlices:
    """A rail described by slices: heights, slopes and heads at any arc length.

    Lateral coordinates u are positive to the field side, heights f upwards (m), from the files' origin or that of
    `moved`."""

    name: str
    s: np.ndarray
    """Arc lengths of the slices, m."""
    sheets: tuple
    source: str = ""
    alike: bool = False
    """Whether all slices are equal."""
    first: object = None
    """Arguments with which `read_profile` reads the first slice's profile (dict)."""

    @classmethod
    def of(cls, curve):
        """Return a prismatic rail with the profile of a `ProfileCurve`."""
        sheets = sheets_of(np.zeros(1), [Slice.through(0.0, curve.u, curve.f)])
        return cls(curve.name, np.zeros(1), tuple(sheets), curve.source, True)

    def moved(self, du, df):
        """Return the rail moved by ``du`` to the field side and ``df`` upwards, m."""
        shift = np.array([du, df, 0.0, 0.0])[:, None]
        return replace(self, sheets=tuple(_moved(sheet, shift) for sheet in self.sheets))

    def along(self, plain, depth=GAUGE_DEPTH):
        """Return the rail in the coordinates of a ``plain`` rail.

        The first slice's top and its inner face within ``depth`` (m) of the top are moved to those of the plain rail.
        """
        placed, distance = self.placed(depth)
        return placed.moved(distance - plain.gauge_offset(depth), 0.0)

    def placed(self, depth=GAUGE_DEPTH):
        """Return the rail with its origin at the first slice's highest point, and that point's gauge distance.

        The distance (m, positive) is from the origin to the innermost point within ``depth`` (m) of the top on the same
        head.
        """
        points = [sheet.at(self.s[0])[0] for sheet in self.sheets if sheet.first <= self.s[0]]
        u, f = (np.concatenate([p[row] for p in points]) for row in (U, F))
        top = int(np.argmax(f))
        low = np.flatnonzero(f[:top] < f[top] - depth)
        if not low.size:
            expected = f"expected a first slice down to {depth:g} m below its top on the gauge side, as the gauge asks"
            raise InputError(self.name, "gauge", expected)
        k = low[-1]
        crossing = u[k] + (u[k + 1] - u[k]) * (f[top] - depth - f[k]) / (f[k + 1] - f[k])
        inner = min(u[k + 1 : top + 1].min(), crossing)
        return self.moved(-u[top], -f[top]), float(u[top] - inner)

    @property
    def lateral(self):
        """Minimum and maximum lateral coordinate, m."""
        points = [sheet.points[:, U] for sheet in self.sheets]
        return min(float(p.min()) for p in points), max(float(p.max()) for p in points)

    def begins(self):
        """Return the arc lengths at which a part begins or ends, m, sorted."""
        ends = [end for sheet in self.sheets for end in (sheet.first, sheet.last)]
        return np.unique([end for end in ends if np.isfinite(end)])

    def heights(self, s, u):
        """Return height (m), slope across and slope along the track, each (n, m), as one array (3, n, m).

        ``s`` (n,) are arc lengths, m; ``u`` (m,) are equally spaced increasing lateral coordinates, m. Values are NaN
        without a rail or on faces steeper than `STEEPEST`.
        """
        return _heights(self.sheets, s, u)

    def heads(self, s, spacing=SPACING):
        """Return the heads at an arc length (m) as `ProfileCurve`, from the track's centre outwards.

        A head is a part of the section that is single-valued and no steeper than `STEEPEST`. Coordinates are those of
        the rail.
        """
        points = [sheet.at(s)[0] for sheet in self.sheets if sheet.first <= s <= sheet.last]
        low, high = min(p[U].min() for p in points), max(p[U].max() for p in points)
        u = spacing * np.arange(np.ceil(low / spacing), np.floor(high / spacing) + 1)
        f, slope, _ = self.heights(s, u)[:, 0]
        heads = []
        for run in _runs(np.isfinite(f)):
            for part in np.split(run, np.flatnonzero(np.abs(np.diff(f[run])) > 2.0 * STEEPEST * spacing) + 1):
                if part.size * spacing > NARROWEST:
                    name, at = f"{self.name}, head {len(heads) + 1} at s = {s:g} m", u[part]
                    second = averaged_second_derivative(at, f[part], slope[part])
                    heads.append(
                        ProfileCurve(name, "rail", at, f[part].copy(), slope[part].copy(), second, self.source)
                    )
        return heads


@dataclass(frozen=True)
class WheelSlices:
    """A wheel described by slices: its profile at angles about its axle.

    If the slices do not cover the whole turn, the profile is constant beyond the first and the last.

    Lateral coordinates u are positive to the field side, heights f upwards, from the tape circle: the radius is r0 - f.
    Angles are measured from the lowest point of the unturned wheel, positive towards x ahead.
    """

    name: str
    angles: np.ndarray
    """Angles of the slices, rad; if they cover the whole turn, some slices are repeated beyond either end."""
    sheets: tuple

    def round(self):
        """Return the `ProfileCurve` of a similar round wheel: that of the slice with the largest tape circle radius."""
        f = self.heights(self.angles, np.zeros(1))[0, :, 0]
        if not np.isfinite(f).any():
            raise InputError(self.name, "", "expected profiles that reach over the tape circle, u = 0")
        at = self.angles[np.nanargmin(f)]
        points = [sheet.at(at)[0] for sheet in self.sheets]
        low, high = min(p[U].min() for p in points), max(p[U].max() for p in points)
        u = SPACING * np.arange(np.ceil(low / SPACING), np.floor(high / SPACING) + 1)
        f, slope, _ = self.heights(at, u)[:, 0]
        (run,) = [run for run in _runs(np.isfinite(f)) if u[run[0]] <= 0.0 <= u[run[-1]]]
        second = averaged_second_derivative(u[run], f[run], slope[run])
        return ProfileCurve(self.name, "wheel", u[run], f[run].copy(), slope[run].copy(), second, self.name)

    def heights(self, angles, u):
        """Return height (m), slope across and derivative with respect to the angle (m/rad), as one array (3, n, m).

        ``angles`` (n,) may be of any turn, rad; ``u`` (m,) are equally spaced increasing lateral coordinates, m. Values
        are NaN without a profile or on faces steeper than `STEEPEST`.
        """
        middle = 0.5 * (self.angles[0] + self.angles[-1])
        within = middle + np.remainder(np.asarray(angles) - middle + 0.5 * TURN, TURN) - 0.5 * TURN
        return _heights(self.sheets, within, u)


def _heights(sheets, s, u):
    """Return height and both slopes of sheets (3, n, m), see `RailSlices.heights`."""
    s, u = np.atleast_1d(np.asarray(s, float)), np.ascontiguousarray(u, float)
    found = np.full((3, s.size, u.size), np.nan)
    step = (u[-1] - u[0]) / (u.size - 1) if u.size > 1 else 1.0
    for sheet in sheets:
        there = np.flatnonzero((s >= sheet.first) & (s <= sheet.last))
        if there.size:
            _lay(sheet.at(s[there]), sheet.at(s[there], 1), there, u, step, found)
    return found


def sheets_of(s, slices, through=True):
    """Return the sheets of one head.

    ``slices`` holds a `Slice` or None for each of the rail's arc lengths ``s`` (m, increasing). If ``through`` is
    False, the slices are control points of cubic B-splines, which smooth them.
    """
    size = next(one.cuts.size for one in slices if one)
    cuts = np.array([one.cuts if one else np.full(size, np.nan) for one in slices])
    width = np.diff(cuts, axis=1)
    counts = [int(np.ceil(np.max(w[np.isfinite(w)], initial=0.0) / PATH_STEP - 1e-9)) for w in width.T]
    known, sections = {}, []
    for one in slices:  # slices of one profile share a section
        key = one and (id(one.curve), one.cuts.tobytes())
        if key not in known:
            known[key] = _section(one, counts) if one else [None] * (size - 1)
        sections.append(known[key])
    sheets = []
    for part in range(size - 1):
        for run in _runs(np.isfinite(width[:, part])):
            sheets.append(_sheet(s, run, np.stack([sections[k][part] for k in run]), through))
    return sheets


def _section(one, counts):
    """Return points (4, paths) of each part of a slice, or None for a missing part.

    The section is smooth across feature lines.
    """
    from scipy.interpolate import CubicSpline

    points = [None] * len(counts)
    for run in _runs(np.isfinite(np.diff(one.cuts))):
        share = [np.arange(counts[k]) / counts[k] for k in run]
        low, high = one.cuts[run], one.cuts[run + 1]
        at = np.concatenate([a + (b - a) * t for a, b, t in zip(low, high, share, strict=True)] + [high[-1:]])
        section = one.curve(at)
        rates = CubicSpline(at, section)(at, 1)
        first = 0
        for k, a, b in zip(run, low, high, strict=True):
            here = slice(first, first + counts[k] + 1)
            points[k] = np.concatenate([section[here], (b - a) / counts[k] * rates[here]], axis=1).T
            first += counts[k]
    return points


def _runs(flags):
    """Return the index arrays of consecutive True values."""
    at = np.flatnonzero(flags)
    return [run for run in np.split(at, np.flatnonzero(np.diff(at) != 1) + 1) if run.size]


def _moved(sheet, shift):
    from scipy.interpolate import CubicSpline

    points = sheet.points + shift
    spline = None if sheet.spline is None else CubicSpline(sheet.s, points)
    return replace(sheet, spline=spline, points=points)


def _sheet(s, run, points, through):
    """Return the `Sheet` of a part with these points (slices, 4, paths) over a ``run`` of slices."""
    from scipy.interpolate import CubicSpline

    first = -np.inf if run[0] == 0 else s[run[0]]
    last = np.inf if run[-1] == s.size - 1 else s[run[-1]]
    spline = None
    if run.size > 1:
        spline = CubicSpline(s[run], points) if through else _approximating(s[run], points)
    return Sheet(first, last, s[run], spline, points)


def _approximating(s, points):
    """Return the cubic B-spline over s with ``points`` as control points, the outermost ones twice.

    At equally spaced slices its value is (1, 4, 1)/6 of three neighbouring points.
    """
    from scipy.interpolate import BSpline

    ends = (s[1] - s[0]) * np.arange(-3, 0), (s[-1] - s[-2]) * np.arange(1, 4)
    knots = np.concatenate([s[0] + ends[0], s, s[-1] + ends[1]])
    return BSpline(knots, np.concatenate([points[:1], points, points[-1:]]), 3)


@jit
def _lay(points, rates, rows, u, step, found):
    """Write height and slopes of sections into ``rows`` of ``found`` (3, all, m) at points higher than those present.

    ``points`` and ``rates`` (derivatives along the track) have the shape (n, 4, paths). Between two paths the section
    is a cubic Hermite polynomial.
    """
    for i in range(rows.size):
        k = rows[i]
        p, q = points[i], rates[i]
        for j in range(p.shape[1] - 1):
            width = p[U, j + 1] - p[U, j]
            if not (p[U_RATE, j] > 0.0 and p[U_RATE, j + 1] > 0.0 and width > 0.0):
                continue
            m0, m1 = p[F_RATE, j] / p[U_RATE, j], p[F_RATE, j + 1] / p[U_RATE, j + 1]
            rise = p[F, j + 1] - p[F, j]
            if max(abs(m0), abs(m1), abs(rise) / width) > STEEPEST:
                continue
            along0, along1 = q[F, j] - m0 * q[U, j], q[F, j + 1] - m1 * q[U, j + 1]
            m0, m1 = m0 * width, m1 * width
            c2, c3 = 3.0 * rise - 2.0 * m0 - m1, m0 + m1 - 2.0 * rise
            a = max(int(np.ceil((p[U, j] - u[0]) / step - 1e-9)), 0)
            b = min(int(np.floor((p[U, j + 1] - u[0]) / step + 1e-9)), u.size - 1)
            for n in range(a, b + 1):
                t = (u[n] - p[U, j]) / width
                f = p[F, j] + t * (m0 + t * (c2 + t * c3))
                if not found[0, k, n] >= f:
                    found[0, k, n] = f
                    found[1, k, n] = (m0 + t * (2.0 * c2 + 3.0 * t * c3)) / width
                    found[2, k, n] = along0 + t * (along1 - along0)
