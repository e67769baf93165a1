"""Rails that change along the track and wheels out of round: sections at arc lengths or angles, and what lies between.

A section is cut by feature lines into parts, each with the same number of points in all slices. Through the points that
correspond run cubic splines along the track (not-a-knot), so that features are interpolated along, not across. A part
exists only from the first to the last slice of a run that has it: heads begin and end there. Before the rail's first
and after its last slice the rail goes on unchanged. This is how CONTACT (its user guide, variable profiles) reads
``.slcs`` files of slices.
"""

from dataclasses import dataclass, replace

import numpy as np

from wrcore.errors import InputError
from wrcore.geometry.profiles.profile import GAUGE_DEPTH, SPACING, STEEPEST, ProfileCurve, averaged_second_derivative
from wrcore.kernels.jit import jit

PATH_STEP = 5e-4
"""Greatest distance of the paths across a part, in the slice where it is widest, m: as in CONTACT. A section is the
cubic spline through them, which evens out what is shorter."""

NARROWEST = 2e-3
"""A head is at least so wide, m."""

TURN = 2.0 * np.pi

# Of a point on a path: its place, and its rates over the path's number.
U, F, U_RATE, F_RATE = range(4)


@dataclass(frozen=True)
class Slice:
    """One section: arc length, the cubic spline (u, f) over its chord length (m), and where its parts are cut."""

    s: float
    curve: object
    cuts: np.ndarray
    """(features,) chord lengths of the feature lines, m; NaN where a line does not exist."""

    @classmethod
    def through(cls, s, u, f, wavelength=0.0):
        """A slice through points u, f (m) from the track's centre outwards, or without their waves shorter than a
        ``wavelength`` (m); its ends are its only feature lines."""
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
    """Arc lengths between which it exists, m; infinite where the rail goes on unchanged."""
    s: np.ndarray
    spline: object
    """Of the points (4, paths) over s; None for a single slice."""
    points: np.ndarray
    """(slices, 4, paths)."""

    def at(self, s, nu=0):
        """Points (n, 4, paths) at arc lengths (n,), or their first derivative; NaN where the part does not exist."""
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
    """A rail of slices: heights, slopes and heads at any arc length.

    Lateral coordinates u count to the field side, heights f up (m), from the files' origin unless it was `moved`."""

    name: str
    s: np.ndarray
    """Arc lengths of the slices, m."""
    sheets: tuple
    source: str = ""
    alike: bool = False
    """Whether all slices are the same."""
    first: object = None
    """How `read_profile` reads the first slice's profile (dict)."""

    @classmethod
    def of(cls, curve):
        """A rail with the same `ProfileCurve` everywhere."""
        sheets = sheets_of(np.zeros(1), [Slice.through(0.0, curve.u, curve.f)])
        return cls(curve.name, np.zeros(1), tuple(sheets), curve.source, True)

    def moved(self, du, df):
        """The rail moved by ``du`` to the field side and ``df`` up, m."""
        shift = np.array([du, df, 0.0, 0.0])[:, None]
        return replace(self, sheets=tuple(_moved(sheet, shift) for sheet in self.sheets))

    def along(self, plain, depth=GAUGE_DEPTH):
        """The rail moved so that the first slice's inner face, within ``depth`` (m) of its top, and its top lie where
        those of a ``plain`` rail do, in whose coordinates it is then."""
        placed, distance = self.placed(depth)
        return placed.moved(distance - plain.gauge_offset(depth), 0.0)

    def placed(self, depth=GAUGE_DEPTH):
        """The rail moved so that the first slice's highest point is its origin, and the distance (m, positive) from
        there to its innermost point within ``depth`` (m) of it on the same head."""
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
        """Least and greatest lateral coordinate, m."""
        points = [sheet.points[:, U] for sheet in self.sheets]
        return min(float(p.min()) for p in points), max(float(p.max()) for p in points)

    def begins(self):
        """Arc lengths at which a part begins or ends, m, sorted."""
        ends = [end for sheet in self.sheets for end in (sheet.first, sheet.last)]
        return np.unique([end for end in ends if np.isfinite(end)])

    def heights(self, s, u):
        """Height (m) of the rail at arc lengths (n,) over lateral coordinates (m,) that increase evenly, its slope
        across, and its slope along the track, each (n, m); NaN where there is no rail or only a wall."""
        return _heights(self.sheets, s, u)

    def heads(self, s, spacing=SPACING):
        """Heads at an arc length (m), `ProfileCurve` each, from the track's centre outwards: runs of the section that
        are single-valued and no steeper than `STEEPEST`. Their ordinates count from the rail's own origin."""
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
    """A wheel of slices: its profile at angles about its axle, constant beyond them unless they go round.

    Lateral coordinates u count to the field side, heights f up, from the tape circle: the radius is r0 - f. Angles
    count from the wheel's lowest point, when it has not turned, towards x ahead.
    """

    name: str
    angles: np.ndarray
    """Of the slices, rad; of a wheel with slices all round with some of them again beyond either end."""
    sheets: tuple

    def round(self):
        """`ProfileCurve` of a wheel of revolution near it: of the slice that reaches furthest at the tape circle."""
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
        """Height (m) at angles (n,) of any turn over lateral coordinates (m,) that increase evenly, its slope across,
        and its rate over the angle (m/rad), each (n, m); NaN where there is no profile or only a wall."""
        middle = 0.5 * (self.angles[0] + self.angles[-1])
        within = middle + np.remainder(np.asarray(angles) - middle + 0.5 * TURN, TURN) - 0.5 * TURN
        return _heights(self.sheets, within, u)


def _heights(sheets, s, u):
    """Height of sheets and both slopes, see `RailSlices.heights`."""
    s, u = np.atleast_1d(np.asarray(s, float)), np.ascontiguousarray(u, float)
    found = np.full((3, s.size, u.size), np.nan)
    step = (u[-1] - u[0]) / (u.size - 1) if u.size > 1 else 1.0
    for sheet in sheets:
        there = np.flatnonzero((s >= sheet.first) & (s <= sheet.last))
        if there.size:
            _lay(sheet.at(s[there]), sheet.at(s[there], 1), there, u, step, found)
    return found


def sheets_of(s, slices, through=True):
    """Sheets of one head's slices, a `Slice` or None at each of the rail's arc lengths ``s`` (m, increasing); not
    ``through`` the slices: they are the control points of cubic B-splines, which even out what they hold."""
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
    """Points (4, paths) of each part of a slice, None where it has none: the section is smooth across feature lines."""
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
    """Indices of the runs of True."""
    at = np.flatnonzero(flags)
    return [run for run in np.split(at, np.flatnonzero(np.diff(at) != 1) + 1) if run.size]


def _moved(sheet, shift):
    from scipy.interpolate import CubicSpline

    points = sheet.points + shift
    spline = None if sheet.spline is None else CubicSpline(sheet.s, points)
    return replace(sheet, spline=spline, points=points)


def _sheet(s, run, points, through):
    """The part with these points (slices, 4, paths) over a ``run`` of slices."""
    from scipy.interpolate import CubicSpline

    first = -np.inf if run[0] == 0 else s[run[0]]
    last = np.inf if run[-1] == s.size - 1 else s[run[-1]]
    spline = None
    if run.size > 1:
        spline = CubicSpline(s[run], points) if through else _approximating(s[run], points)
    return Sheet(first, last, s[run], spline, points)


def _approximating(s, points):
    """Cubic B-spline over s with ``points`` as control points, the outermost ones twice: at evenly spaced slices it
    takes (1, 4, 1)/6 of three neighbours."""
    from scipy.interpolate import BSpline

    ends = (s[1] - s[0]) * np.arange(-3, 0), (s[-1] - s[-2]) * np.arange(1, 4)
    knots = np.concatenate([s[0] + ends[0], s, s[-1] + ends[1]])
    return BSpline(knots, np.concatenate([points[:1], points, points[-1:]]), 3)


@jit
def _lay(points, rates, rows, u, step, found):
    """Lay sections, ``points`` and ``rates`` along the track (n, 4, paths), over lateral coordinates into the rows of
    ``found`` (3, all, m), where they are higher than what is there. Between two paths runs a cubic Hermite polynomial.
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
