"""Plots of creep laws: force over creepage, for one patch and nondimensional."""

from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from wrcore.analysis.pictures.style import styled
from wrcore.creep.cases import MODELS, creep_force
from wrcore.errors.checked_calls import ABOVE_ZERO, OneOf, checked

LOOKS = ("-", (0, (4, 2)), (0, (1, 1)), "-.", (0, (6, 1, 1, 1)), (0, (2, 2)))
"""Line styles of the laws, which differ in greyscale, too."""


@checked
@styled
def plot_creep_force(
    models: Annotated[str | Sequence[str], OneOf(MODELS)] = ("linear", "polach", "fastsim", "table"),
    a: Annotated[float, ABOVE_ZERO] = 5e-3,
    b: Annotated[float, ABOVE_ZERO] = 5e-3,
    normal_force: Annotated[float, ABOVE_ZERO] = 5e4,
    mu: Annotated[float, ABOVE_ZERO] = 0.3,
    spin: float = 0.5,
    largest: Annotated[float, ABOVE_ZERO] = 8e-3,
) -> Figure:
    """Draw creep laws for one elliptic patch: longitudinal force over xi without spin, lateral force over eta with it.

    Parameters
    ----------
    models : str or sequence of str
        Creep laws of :func:`wrcore.creep_force`.
    a, b : float
        Semi-axes along and across rolling, m.
    normal_force : float
        Normal force, N.
    mu : float
        Friction coefficient.
    spin : float
        Spin creepage in the right panel, 1/m.
    largest : float
        Largest creepage drawn.

    Returns
    -------
    matplotlib.figure.Figure

    Examples
    --------
    >>> import wrcore as wr
    >>> figure = wr.plot_creep_force(["linear", "polach"])
    >>> [line.get_label() for line in figure.axes[0].lines][:2]
    ['linear', 'polach']
    """
    models = [models] if isinstance(models, str) else list(models)
    figure = Figure(figsize=(7.2, 3.0), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    creepage = np.linspace(0.0, largest, 81)
    for model, look in zip(models, LOOKS * len(models), strict=False):
        fx, _, _ = creep_force(model, a, b, normal_force, creepage, 0.0, 0.0, mu)
        _, fy, _ = creep_force(model, a, b, normal_force, 0.0, creepage, spin, mu)
        left.plot(1e3 * creepage, -1e-3 * fx, linestyle=look, label=model)
        right.plot(1e3 * creepage, -1e-3 * fy, linestyle=look)
    left.set(xlabel="longitudinal creepage xi / 0.1 %", ylabel="force against the creepage / kN")
    right.set(xlabel=f"lateral creepage eta / 0.1 %, spin {spin:g} 1/m")
    limit = 1e-3 * mu * normal_force
    for axes in (left, right):
        axes.axhline(limit, color="0.6", linewidth=0.8)
        axes.set_ylim(-0.15 * limit, 1.15 * limit)
    left.legend()
    return figure


LAW_STYLES: dict[str, dict[str, Any]] = {
    "exact": {"label": "exact", "color": "#000000", "marker": "o", "linestyle": "-"},
    "table ellipse": {"label": "table, ellipses", "color": "#0072B2", "marker": "s", "linestyle": (0, (1, 1))},
    "table sdec": {"label": "table, five inputs", "color": "#56B4E9", "marker": "D", "linestyle": (0, (4, 2))},
    "fastsim": {"label": "FASTSIM", "color": "#D55E00", "marker": "^", "linestyle": "-."},
    "polach": {"label": "Polach", "color": "#009E73", "marker": "v", "linestyle": (0, (6, 1, 1, 1, 1, 1))},
    "she": {"label": "Shen-Hedrick-Elkins", "color": "#CC79A7", "marker": "P", "linestyle": (0, (3, 1))},
    "linear": {"label": "linear", "color": "0.55", "marker": "X", "linestyle": (0, (1, 3))},
}
"""Okabe-Ito colours; marker and line style distinguish the laws in greyscale."""


CURVES = (
    ("longitudinal", "xi", "fx", "(a) longitudinal"),
    ("lateral", "eta", "fy", "(b) lateral"),
    ("spin", "phi", "fy", "(c) pure spin: lateral force"),
    ("combined", "eta", "fy", "(d) lateral with spin: force"),
    ("lateral", "eta", "mz", "(e) lateral: moment"),
    ("spin", "phi", "mz", "(f) pure spin: moment"),
)


SYMBOLS = {
    "xi": r"$\xi' = \xi\,G c^2/(\mu N)$ / 1",
    "eta": r"$\eta' = \eta\,G c^2/(\mu N)$ / 1",
    "phi": r"$\varphi' = \varphi\,G c^3/(\mu N)$ / 1",
    "fx": r"$F_x/(\mu N)$ / 1",
    "fy": r"$F_y/(\mu N)$ / 1",
    "mz": r"$M_z/(\mu N c)$ / 1",
}


def _line_style(family):
    style = {key: LAW_STYLES[family][key] for key in ("color", "linestyle")}
    return {**style, "linewidth": 2.4 if family == "exact" else 1.3, "zorder": 2 if family == "exact" else 3}


def legend_below(figure, handles, columns, **kwargs):
    figure.legend(handles=handles, loc="outside lower center", ncols=columns, fontsize=8, **kwargs)


@styled
def fig_creep_curves(curves):
    """Plot forces of one model of each family of laws over creepage (`wrcore.analysis.creep_curves.creep_curves`).

    Panels show pure longitudinal, pure lateral, pure spin and combined creepage.
    """
    figure = Figure(figsize=(7.2, 5.0), layout="constrained")
    for axes, (line, along, force, title) in zip(figure.subplots(2, 3).flat, CURVES, strict=True):
        part = curves[curves["line"] == line]
        for family in LAW_STYLES:
            one = part[part["family"] == family]
            axes.plot(one[along], one[force], label=LAW_STYLES[family]["label"], **_line_style(family))
        bounded = part.loc[~part["family"].isin(["linear", "she"]), force]
        room = 0.12 * np.ptp(bounded)
        axes.set(xlabel=SYMBOLS[along], ylabel=SYMBOLS[force], ylim=(bounded.min() - room, bounded.max() + room))
        axes.set_title(title, fontsize=9)
        axes.margins(x=0)
        if line == "combined":
            axes.text(
                0.97, 0.93, rf"$\varphi'$ = {part['phi'].iloc[0]:.2g}", transform=axes.transAxes, ha="right", va="top"
            )
    drawn = [family for family in LAW_STYLES if family in set(curves["family"])]
    handles = [Line2D([], [], label=LAW_STYLES[family]["label"], **_line_style(family)) for family in drawn]
    legend_below(figure, handles, 4, handlelength=3.5)
    return figure
