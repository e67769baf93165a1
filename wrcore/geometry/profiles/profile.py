"""ProfileCurve: the representation of a wheel or rail profile in all calculations.

Positions and slopes at the nodes are those of the exact sections; between the nodes the profile is a cubic Hermite
polynomial. The curvature is stored separately: it jumps between sections, which Hertz' theory cannot represent. So the
curvature is averaged along the profile, while position and slope are exact.
"""

from dataclasses import dataclass, field

import numpy as np

from wrcore.errors import InputError
from wrcore.geometry.profiles import points as profile_points
from wrcore.geometry.profiles import sections as profile_sections

SPACING = 5e-5
"""Default distance of nodes, m. Hermite error on a 13 mm arc: 0.01 um at slope 5 and 1.2 um at slope 10 (vertical)."""

WINDOW = 1e-3
"""Default length along the profile over which the curvature is averaged, m."""

STEEPEST = 10.0
"""Largest slope of a curve (84 degrees), at which it ends: f(u) is not suitable for steeper parts."""

GAUGE_DEPTH = 0.014
"""Depth below the highest point at which the gauge is measured, m (CONTACT user guide, Manchester example)."""


@dataclass(frozen=True, eq=False)
class ProfileCurve:
    """Wheel or rail profile f(u), both in m: u positive to the field side, f positive upwards."""

    name: str
    kind: str
    """Kind of profile: for a "wheel" f = 0 at the tape circle (u = 0) and the radius is r(u) = r0 - f(u); for a "rail",
    with its inclination in the track, f(0) = 0 is the highest point."""
    u: np.ndarray
    """(n,): nodes, m, increasing and uniform."""
    f: np.ndarray
    """(n,): heights at the nodes, m."""
    df: np.ndarray
    """(n,): slopes at the nodes."""
    d2f: np.ndarray
    """(n,): second derivative from the averaged curvature, 1/m (see `averaged_second_derivative`)."""
    source: str = ""
    """Standard, file or form from which the profile comes."""
    outline: object = field(default=None, repr=False)
    """Exact sections (tuple) or `profile_points.Outline`; used for the gauge only."""

    def __post_init__(self):
        for array in (self.u, self.f, self.df, self.d2f):
            array.setflags(write=False)

    @classmethod
    def from_sections(cls, name, kind, sections, source="", window=WINDOW, spacing=SPACING):
        """Return the curve of exact sections (Arc, Line or Polynomial) in order of increasing u (m).

        Sections of rails have their inclination in the track (`profile_sections.incline`). ``window`` is the averaging
        length of the curvature, m; ``spacing`` is the distance of the nodes, m; u = 0 is a node.
        """
        low, high, used = profile_sections.usable_span(sections, STEEPEST)
        u = _nodes(low, high, spacing)
        f, df = profile_sections.evaluate(used, u)
        return cls(name, kind, u, f, df, averaged_second_derivative(u, f, df, window), source, tuple(sections))

    @classmethod
    def from_points(cls, u, f, kind, name="points", *, lines=None, trim=False, inclination=0.0, smoothing=0.0,
                    window=WINDOW, spacing=SPACING, mends=None):  # fmt: skip
        """Return the curve through measured points u, f (m), u strictly increasing or decreasing.

        A parametric cubic spline (C2 along the profile) is fitted and sampled at uniform nodes (see `from_sections`).
        Noise of the standard deviation ``smoothing`` (m) is removed.

        Wheels are shifted vertically to f(0) = 0. Rails are rotated by ``inclination`` (0 for points with the
        inclination in the track) and shifted to their highest point; an origin within 0.2 um of its height is kept.
        ``trim`` keeps the single-valued part around the origin; without it a profile that turns back is an error.
        ``name``, the points' ``lines`` in a file and ``mends`` (`wrcore.geometry.profiles.checks.Mends`) are for
        messages; with ``mends=False`` points of any shape are accepted."""
        outline = profile_points.fit(u, f, kind, name, lines, trim, inclination, smoothing, mends)
        low, high = outline.working_span(STEEPEST, trim)
        nodes = _nodes(low, high, spacing)
        value, slope = outline.evaluate(nodes)
        d2f = averaged_second_derivative(nodes, value, slope, window)
        return cls(name, kind, nodes, value, slope, d2f, f"measured points, {name}", outline)

    def __call__(self, u, nu=0):
        """Return ordinate (``nu=0``, m), slope (1) or second derivative (2, 1/m) at ``u`` (m); NaN beyond the ends.

        Ordinate and slope are those of the cubic Hermite polynomial, the second derivative is interpolated linearly."""
        u = np.asarray(u, dtype=float)
        h = self.spacing
        u = np.where((u >= self.u[0]) & (u <= self.u[-1]), u, np.nan)
        i = np.clip(np.nan_to_num((u - self.u[0]) / h), 0, self.u.size - 2).astype(int)
        return self._in_cell(i, (u - self.u[i]) / h, nu)

    def _in_cell(self, i, t, nu):
        f0, f1, h = self.f[i], self.f[i + 1], self.spacing
        m0, m1 = h * self.df[i], h * self.df[i + 1]
        c2, c3 = 3.0 * (f1 - f0) - 2.0 * m0 - m1, 2.0 * (f0 - f1) + m0 + m1
        if nu == 0:
            return f0 + t * (m0 + t * (c2 + t * c3))
        if nu == 1:
            return (m0 + t * (2.0 * c2 + 3.0 * t * c3)) / h
        if nu == 2:
            return (1.0 - t) * self.d2f[i] + t * self.d2f[i + 1]
        raise ValueError(f"nu must be 0, 1 or 2, got {nu!r}")

    @property
    def spacing(self):
        """Distance of the nodes, m."""
        return (self.u[-1] - self.u[0]) / (self.u.size - 1)

    def gauge_offset(self, depth=GAUGE_DEPTH):
        """Return the distance (m, positive) from a rail's origin to its innermost point within ``depth`` of the top.

        The result is NaN if the profile ends above that depth (m) on the gauge side. InputError for a wheel.
        """
        if self.kind != "rail":
            raise InputError(self.name, "gauge", "expected a rail profile, got a wheel")
        if isinstance(self.outline, profile_points.Outline):
            return -self.outline.innermost(depth)
        return -profile_sections.innermost(self.outline, depth)

    @property
    def gauge_offset_m(self):
        """Distance `gauge_offset` at the usual depth of 14 mm, m; NaN for a wheel."""
        return self.gauge_offset() if self.kind == "rail" else float("nan")


def _nodes(low, high, spacing):
    """Return the multiples of ``spacing`` from ``low`` to ``high`` (m), both included within rounding."""
    return spacing * np.arange(np.ceil(low / spacing - 1e-9), np.floor(high / spacing + 1e-9) + 1)


def averaged_second_derivative(u, f, df, window=WINDOW):
    """Return the second derivative (n,), 1/m, that corresponds to the mean curvature over an arc length ``window`` (m).

    ``u``, ``f`` (m) and the slopes ``df`` are values at nodes, all (n,). The mean curvature is the change of the
    tangent's angle over the window centred at the node, divided by its length; at the ends the window is shortened.

    The result is f'' = kappa (1 + f'^2)^(3/2), so that Hertz' local curvature f'' / (1 + f'^2)^(3/2) is the mean. On a
    circular arc it is exact for any slope, unlike the mean of f'' over u."""
    if not window > 0.0:
        raise ValueError(f"window must be positive, got {window!r}")
    angle = np.arctan(df)
    half_turn = 0.5 * np.diff(angle)
    # chord -> arc of a circle that turns by the same angle; np.sinc(x) = sin(pi x) / (pi x)
    length = np.hypot(np.diff(u), np.diff(f)) / np.sinc(half_turn / np.pi)
    s = np.concatenate(([0.0], np.cumsum(length)))
    ahead, behind = np.minimum(s + window / 2, s[-1]), np.maximum(s - window / 2, 0.0)
    curvature = (np.interp(ahead, s, angle) - np.interp(behind, s, angle)) / (ahead - behind)
    return curvature * (1.0 + df**2) ** 1.5
