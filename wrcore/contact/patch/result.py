"""Result of one loaded contact patch with all its fields, for all patch models."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from wrcore.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MM, _MPA = 1e3, 1e-6
_MOST_ARROWS = 18
"""Maximum number of arrows on the longer side of a plot; denser fields are thinned out."""
_LEGEND_BELOW = -0.45
"""Position of the legend's upper edge from the lower edge of the axes, inches: below the axis label."""


@dataclass(frozen=True, eq=False)
class Patch:
    """A contact patch: forces on the wheel and the fields behind them; SI units.

    The patch lies in a plane with the axes x (forward), s (to the left) and n (from rail into wheel) through
    ``origin``, turned by ``contact_angle`` about x. Fields are flat arrays over cells of any size: elements of a grid
    or panels of strips.

    Attributes
    ----------
    x, s, dx, ds : (n,) ndarray
        Centres and sizes of cells, m, relative to ``origin``.
    pressure, traction_x, traction_s : (n,) ndarray
        Mean normal pressure and traction on the wheel, Pa.
    slip_x, slip_s : (n,) ndarray
        Slip of the wheel over the rail, over the speed; zero where the surfaces adhere.
    stick : (n,) ndarray of bool
        Adhesion; cells without pressure are neither adhesion nor slip.
    normal, fx, fs : float
        Normal force, longitudinal and lateral force in the contact plane on the wheel, N.
    mn : float
        Moment on the wheel about the normal at ``origin``, N m.
    xi, eta, phi : float
        Creepages at ``origin``: longitudinal, lateral (-), spin (1/m), of the wheel relative to the rail.
    contact_angle : float
        Rad.
    origin : tuple of float
        Reference point in the track frame, m; x from the wheelset's cross-section.
    friction : float
    side : str
        left, right or empty.
    peak : float
        Maximum pressure, Pa, if it is known more accurately than from the cells; else NaN.
    ends : tuple of float
        x_min, x_max, s_min, s_max, m, if they are known more accurately than from the cells; else empty.
    pose : tuple of float
        y, z (m), roll and yaw (rad) of the wheelset; may be empty.
    load_residual : float
        Vertical force on the wheel minus the given load, N; NaN without a given load.
    flags : tuple of str
        Exceeded limits: names of columns of ``wrcore contact``.

    Examples
    --------
    >>> import wrcore as wr
    >>> pair = wr.WheelsetOnTrack.alike(wr.named_profile("S1002", "wheel"), wr.named_profile("60E1", "rail", 1 / 40))
    >>> (tread,) = wr.patch(pair, y=0.003, load=5e4)
    >>> round(1e-3 * tread.normal, 1), tread.side, len(tread.pressure) == len(tread.x)
    (49.9, 'left', True)
    """

    x: np.ndarray = field(repr=False)
    s: np.ndarray = field(repr=False)
    dx: np.ndarray = field(repr=False)
    ds: np.ndarray = field(repr=False)
    pressure: np.ndarray = field(repr=False)
    traction_x: np.ndarray = field(repr=False)
    traction_s: np.ndarray = field(repr=False)
    slip_x: np.ndarray = field(repr=False)
    slip_s: np.ndarray = field(repr=False)
    stick: np.ndarray = field(repr=False)
    normal: float
    fx: float
    fs: float
    mn: float
    xi: float
    eta: float
    phi: float
    contact_angle: float
    origin: tuple
    friction: float
    side: str = ""
    peak: float = math.nan
    ends: tuple = ()
    pose: tuple = ()
    load_residual: float = math.nan
    flags: tuple = ()

    @property
    def cell_area(self) -> np.ndarray:
        """Area of each cell, m^2, shape (n,)."""
        return self.dx * self.ds

    @property
    def touching(self) -> np.ndarray:
        """Whether a cell has pressure, shape (n,)."""
        return self.pressure > 0.0

    @property
    def friction_work(self) -> np.ndarray:
        """Frictional work in each cell per metre rolled and area, N/m^2, shape (n,).

        It is traction times slip, scaled so that the total equals the work of the forces on the creepages."""
        work = -(self.traction_x * self.slip_x + self.traction_s * self.slip_s)
        total = work @ self.cell_area
        known = -(self.fx * self.xi + self.fs * self.eta + self.mn * self.phi)
        return work * max(known, 0.0) / total if total > 0.0 else np.zeros(work.shape)

    @property
    def p_max(self) -> float:
        """Maximum pressure, Pa; on a grid: the maximum of the means of cells."""
        return float(self.pressure.max(initial=0.0)) if math.isnan(self.peak) else self.peak

    @property
    def area(self) -> float:
        """Area of the contact patch, m^2."""
        return float(self.cell_area[self.touching].sum())

    @property
    def stick_area(self) -> float:
        """Area of adhesion, m^2."""
        return float(self.cell_area[self.touching & self.stick].sum())

    @property
    def slip_area(self) -> float:
        """Area of slip, m^2."""
        return self.area - self.stick_area

    @property
    def extent(self) -> tuple[float, ...]:
        """Extent x_min, x_max, s_min, s_max, m: outer edges of cells with pressure; NaN without contact."""
        if self.ends:
            return self.ends
        at = self.touching
        if not at.any():
            return (math.nan,) * 4
        sides = ((self.x[at], 0.5 * self.dx[at]), (self.s[at], 0.5 * self.ds[at]))
        return tuple(float(end) for c, half in sides for end in ((c - half).min(), (c + half).max()))

    @property
    def centroid(self) -> tuple[float, float]:
        """Centroid x and s of the pressure, m; NaN without contact."""
        load = self.pressure * self.cell_area
        total = load.sum()
        return (float(load @ self.x / total), float(load @ self.s / total)) if total > 0.0 else (math.nan, math.nan)

    @property
    def track_force(self) -> np.ndarray:
        """Force on the wheel in the track frame (forward, left, up), N, shape (3,)."""
        cosine, sine = math.cos(self.contact_angle), math.sin(self.contact_angle)
        lateral, vertical = self.fs * cosine - self.normal * sine, self.fs * sine + self.normal * cosine
        return np.array([self.fx, lateral, vertical])

    def plot(self, axes: Any = None) -> Figure:
        """Draw pressure, tractions, and areas of adhesion and slip.

        Parameters
        ----------
        axes : matplotlib.axes.Axes, optional
            Drawn into; by default into a new figure.

        Returns
        -------
        matplotlib.figure.Figure
            Axes in mm, rolling direction to the right; shades are the pressure (MPa), arrows the traction on the
            wheel, hatched cells slip.
        """
        import matplotlib.pyplot as plt

        if axes is not None and not hasattr(axes, "add_collection"):
            raise InputError("Patch.plot", "axes", f"expected axes of matplotlib, got {axes!r:.60}")
        new = axes is None
        figure, axes = plt.subplots(figsize=(6.4, 5.2), layout="constrained") if new else (axes.figure, axes)
        self._draw_cells(figure, axes)
        self._draw_arrows(axes)
        axes.set_aspect("equal")
        axes.autoscale_view()
        axes.set_xlabel("x, rolling direction / mm")
        axes.set_ylabel("s, to the left / mm")
        forces = " kN, ".join(f"{name} {1e-3 * f:.2f}" for name, f in (("N", self.normal), ("Fx", self.fx)))
        axes.set_title(f"{forces} kN, Fs {1e-3 * self.fs:.2f} kN", fontsize="medium")
        return figure

    def _draw_cells(self, figure, axes):
        """Cells with pressure, shaded; those that slip hatched."""
        from matplotlib import colormaps
        from matplotlib.collections import PolyCollection
        from matplotlib.colors import ListedColormap
        from matplotlib.patches import Patch as Swatch
        from matplotlib.transforms import ScaledTranslation

        at = self.touching
        x, s, dx, ds = (_MM * values[at] for values in (self.x, self.s, 0.5 * self.dx, 0.5 * self.ds))
        corners = [np.column_stack([x + a * dx, s + b * ds]) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        boxes: Any = np.stack(corners, axis=1)
        shades = ListedColormap(colormaps["Greys"](np.linspace(0.05, 0.65, 256)))  # light: arrows stand out
        cells = PolyCollection(boxes, array=_MPA * self.pressure[at], cmap=shades, edgecolors="face", linewidths=0.2)
        cells.set_clim(0.0, _MPA * max(self.p_max, 1.0))
        axes.add_collection(cells)
        style: dict[str, Any] = {"facecolors": "none", "edgecolors": "C0", "linewidths": 0.0}
        axes.add_collection(PolyCollection(boxes[~self.stick[at]], hatch="////", **style))
        figure.colorbar(cells, ax=axes, label="pressure / MPa")
        swatches = Swatch(fc="0.8", label="adhesion"), Swatch(fc="0.8", ec="C0", lw=0.0, hatch="////", label="slip")
        below = axes.transAxes + ScaledTranslation(0.0, _LEGEND_BELOW, figure.dpi_scale_trans)
        place = {"loc": "upper left", "bbox_to_anchor": (0.0, 0.0), "bbox_transform": below}
        axes.legend(handles=list(swatches), ncols=2, frameon=False, **place)

    def _draw_arrows(self, axes):
        """Draw the traction in up to `_MOST_ARROWS` squared cells, with even spacing."""
        at = np.flatnonzero(self.touching)
        if not at.size:
            return
        x_min, x_max, s_min, s_max = self.extent
        side = max(x_max - x_min, s_max - s_min) / _MOST_ARROWS
        squares = np.floor((self.x[at] - x_min) / side) * 1000 + np.floor((self.s[at] - s_min) / side)
        chosen = at[np.unique(squares, return_index=True)[1]]
        longest = max(self.friction * self.p_max, 1.0)
        tx, ts = self.traction_x[chosen] / longest, self.traction_s[chosen] / longest
        where = _MM * self.x[chosen], _MM * self.s[chosen]
        axes.quiver(*where, tx, ts, angles="xy", scale_units="xy", scale=0.4 / (_MM * side), color="k", width=0.0035)
