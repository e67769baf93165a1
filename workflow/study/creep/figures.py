"""Figures of the creep laws: curves, traction fields, cost against error, error maps, smoothness.

Data are the tables of `study.creep.laws` and `study.creep.smoothness`. A law has equal colour, marker and line
in all figures (`LAW_STYLES`). All quantities are nondimensional (unit 1) or over a stated scale; errors are drawn
in per cent of the friction limit, costs in microseconds.
"""

import numpy as np
from matplotlib import colormaps
from matplotlib.collections import PolyCollection
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter

from wrcore.analysis.pictures.plot_creep import LAW_STYLES, legend_below
from wrcore.analysis.pictures.style import ACCENT, styled

PERCENT = 100.0


TABLE_LABELS = {"table ellipse": -13, "table sdec": 7}  # points above the marker
COST_LABELS = {"exact": {"label": "exact, operator ready"}}
CONTACT_STYLE = {"CONTACT": {"color": "0.35", "marker": "o"}, "its FASTSIM": {"color": "0.35", "marker": "^"}}

TRACTION_COLOURS = ListedColormap(colormaps["Blues"](np.linspace(0.0, 0.65, 256)))


@styled
def fig_creep_traction(fields):
    """Plot traction, stick and slip over the contact patch, a panel for each `ContactField` by title."""
    figure = Figure(figsize=(7.4, 3.3), layout="constrained")
    widths = [np.ptp(field.x_edges) for field in fields.values()]
    panels = figure.subplots(1, len(fields), squeeze=False, sharey=True, width_ratios=widths)[0]
    top = max(np.hypot(field.px, field.py).max() for field in fields.values())
    for axes, (title, field) in zip(panels, fields.items(), strict=True):
        mesh = _traction(axes, field, top)
        axes.set_title(title, fontsize=9)
    panels[0].set_ylabel("$y/c$ (left) / 1")
    figure.colorbar(mesh, ax=panels, label=r"$|p|\,c^2/(\mu N)$ / 1", shrink=0.85)
    handles = [
        Line2D([], [], color=ACCENT, linewidth=1.6, label="border of the stick area"),
        Line2D(
            [], [], color="k", marker=r"$\rightarrow$", linestyle="none", markersize=10, label="traction on the wheel"
        ),
    ]
    legend_below(figure, handles, 2)
    return figure


def _outlines(field):
    """Return corners of the rectangular panels, (N, 4, 2), in the order of the field's arrays."""
    left, right = field.x_edges[:, 1:], field.x_edges[:, :-1]
    low, high = (np.broadcast_to(edge[:, None], left.shape) for edge in (field.y_edges[:-1], field.y_edges[1:]))
    corners = [(left, low), (right, low), (right, high), (left, high)]
    return np.stack([np.stack([x.ravel(), y.ravel()], axis=-1) for x, y in corners], axis=1)


def _traction(axes, field, top):
    outlines, size = _outlines(field), np.hypot(field.px, field.py)
    mesh = PolyCollection(
        outlines, array=size, cmap=TRACTION_COLOURS, edgecolors="face", linewidths=0.2, rasterized=True
    )
    mesh.set_clim(0.0, top)
    axes.add_collection(mesh)
    axes.plot(*np.moveaxis(stick_border(field), -1, 0), color=ACCENT, linewidth=1.6)
    shown = _arrow_places(field)
    arrows = {"color": "k", "pivot": "mid", "units": "dots", "width": 2.0, "headwidth": 4.0, "headlength": 4.5}
    axes.quiver(field.x[shown], field.y[shown], field.px[shown] / top, field.py[shown] / top, scale=0.045, **arrows)
    axes.set(xlabel="$x/c$ (rolling) / 1", aspect="equal")
    axes.grid(False)
    axes.autoscale_view()
    return mesh


def stick_border(field):
    """Return the border of the stick area, also at the patch's edge, as a polyline (m, 2) with NaN rows at breaks."""
    ny, n = field.x_edges.shape[0], field.x_edges.shape[1] - 1
    stick, gap = field.stick.reshape(ny, n), [np.nan, np.nan]
    rows = []
    for j in range(ny):
        padded = np.concatenate([[False], stick[j], [False]])
        for k in np.flatnonzero(padded[1:] != padded[:-1]):
            rows += [(field.x_edges[j, k], field.y_edges[j]), (field.x_edges[j, k], field.y_edges[j + 1]), gap]
    for j in range(ny + 1):
        for low, high in _differing(field, stick, j):
            rows += [(low, field.y_edges[j]), (high, field.y_edges[j]), gap]
    return np.array(rows).reshape(-1, 2)


def _differing(field, stick, j):
    """Return intervals of x where only one of the two strips at the border ``y_edges[j]`` sticks."""
    spans = [[], []]
    for side, strip in enumerate((j - 1, j)):
        if 0 <= strip < stick.shape[0]:
            edges = field.x_edges[strip]
            spans[side] = [(edges[k + 1], edges[k]) for k in np.flatnonzero(stick[strip])]
    cuts = np.unique([end for span in spans[0] + spans[1] for end in span])
    for low, high in zip(cuts[:-1], cuts[1:], strict=True):
        middle = (low + high) / 2
        covered = [any(start < middle < end for start, end in span) for span in spans]
        if covered[0] != covered[1]:
            yield low, high


def _arrow_places(field, spacing=0.24):
    """Return indices of the panels nearest to the points of a square grid inside the patch."""
    x, y = (np.arange(-20, 21) * spacing for _ in range(2))
    points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    distance = np.hypot(field.x - points[:, :1], field.y - points[:, 1:])
    return np.unique(np.argmin(distance, axis=1)[distance.min(axis=1) < 0.4 * spacing])


@styled
def fig_creep_cost(laws, contact):
    """Plot time per case over the 95 % quantile of the error, for all laws, tables and levels.

    Data are rows of `laws_table` relative to CONTACT on ellipses, and `contact_points`.
    """
    figure = Figure(figsize=(6.8, 4.6), layout="constrained")
    axes = figure.subplots()
    rows = laws[(laws["cases"] == "ellipse") & (laws["against"] == "CONTACT")]
    for family, style in LAW_STYLES.items():
        part = rows[rows["family"] == family]
        if len(part):
            _cost_line(axes, part, "us_per_case", {**style, **COST_LABELS.get(family, {})})
    exact = rows[rows["family"] == "exact"]
    single = {"label": "exact, one case with its operator", "markerfacecolor": "w", "linestyle": "--"}
    _cost_line(axes, exact, "us_from_nothing", {**LAW_STYLES["exact"], **single})
    for row in rows.itertuples():
        if row.family == "exact":
            _annotate(axes, row.model.removeprefix("exact, "), (PERCENT * row.force_q95, row.us_per_case), (-14, -12))
        elif row.family.startswith("table"):
            _annotate(
                axes,
                row.model.partition("_")[2],
                (PERCENT * row.force_q95, row.us_per_case),
                (-3, TABLE_LABELS[row.family]),
            )
    for program, style in CONTACT_STYLE.items():
        part = contact[contact["program"] == program]
        label = f"{program}, measured elsewhere on another machine"
        _cost_line(axes, part, "us_per_case", {**style, "label": label, "markerfacecolor": "0.8", "linestyle": ":"})
        for row in part.itertuples():
            _annotate(axes, f"{row.n_across}²", (PERCENT * row.force_q95, row.us_per_case), (7, -1))
    percent = FuncFormatter(lambda value, _: f"{value:g}")
    axes.set(xscale="log", yscale="log", ylabel="CPU time per case / µs")
    axes.set_xlabel(r"force error $|\Delta F|/(\mu N)$ that 95 % of the ellipse cases keep / %")
    axes.xaxis.set_major_formatter(percent)
    axes.yaxis.set_major_formatter(percent)
    figure.legend(loc="outside lower center", ncols=2, fontsize=8)
    return figure


def _cost_line(axes, rows, cost, style):
    axes.plot(PERCENT * rows["force_q95"], rows[cost], **{"linewidth": 0.9, **style})


def _annotate(axes, text, at, offset):
    axes.annotate(text, at, offset, textcoords="offset points", fontsize=7, color="0.25")


@styled
def fig_creep_error_map(errors, name):
    """Plot errors of a table (`error_map`) over a/b and over creepage size, spin direction and shape number psi."""
    inputs = [("size", "size of creepage $r$ / 1"), ("beta", r"spin direction $\beta$ / rad")]
    inputs += [("psi", r"shape number $|\psi|$ / 1")] if np.ptp(errors["psi"]) > 0 else []
    figure = Figure(figsize=(0.8 + 2.2 * len(inputs), 4.6), layout="constrained")
    panels = figure.subplots(2, len(inputs), sharey=True)
    for row, (error, title) in zip(panels, (("force_error", "force"), ("moment_error", "moment")), strict=True):
        for axes, (column, label) in zip(row, inputs, strict=True):
            mesh = _error_panel(axes, errors, column, error)
            axes.set_xlabel(label)
        row[0].set_ylabel(f"{title}: $a/b$ / 1")
    text = r"error that 95 % keep / % of $\mu N$, $\mu N c$"
    figure.colorbar(mesh, ax=panels, label=text, extend="both", format=FuncFormatter(lambda value, _: f"{value:g}"))
    figure.suptitle(f"table {name} against the exact solver", fontsize=9)
    return figure


def binned_errors(errors, column, error, share=0.95):
    """Return the quantile ``share`` of an error in cells of a/b and another input.

    Edges are logarithmic for a/b and "size". Returned are edges_a_over_b (n + 1,), edges (m + 1,) and quantile (n, m),
    NaN in cells without a case.
    """
    patches = errors["a_over_b"].nunique()
    counts = (max(1, patches // 20), 5) if column == "psi" else (min(14, patches), 10)  # some patches in each cell
    edges = []
    for name, count in zip(("a_over_b", column), counts, strict=True):
        log = name in ("a_over_b", "size")
        low, high = errors[name].min(), errors[name].max() * (1 + 1e-9)
        edges.append(np.geomspace(low, high, count + 1) if log else np.linspace(low, high, count + 1))
        edges[-1][0] = low  # geomspace may round the minimum up
    cell = [
        np.searchsorted(edge, errors[name], "right") - 1 for edge, name in zip(edges, ("a_over_b", column), strict=True)
    ]
    result = np.full((len(edges[0]) - 1, len(edges[1]) - 1), np.nan)
    for (i, j), part in errors.groupby(cell)[error]:
        result[i, j] = part.quantile(share)
    return *edges, result


def _error_panel(axes, errors, column, error):
    a_over_b, other, quantile = binned_errors(errors, column, error)
    look = {"cmap": "cividis", "norm": "log", "rasterized": True}
    mesh = axes.pcolormesh(other, a_over_b, np.ma.masked_invalid(PERCENT * quantile), **look)
    mesh.set_clim(0.01, 3.0)
    axes.set(yscale="log", xscale="log" if column == "size" else "linear")
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.grid(False)
    return mesh


SMOOTH_PANELS = {
    "cells": ("(a) across many cells:\nall inputs change", "place $x$ / 1", False),
    "border": ("(b) the sharpest bend of (a),\n100 times wider, less its mean", "place $x$ / 1", True),
    "axis": ("(c) past pure spin,\nless its mean", r"place $x = \xi'/\varphi'$ / 1", True),
    "zero": ("(d) through zero creepage:\nfull adhesion", "place $x$ / 1", False),
}
"""Title, label of x, and whether the mean is subtracted, for each line of `study.creep.smoothness.smoothness`."""


OUTPUTS = {
    "fx": {"color": "#0072B2", "linestyle": "-", "label": r"$F_x/(\mu N)$"},
    "fy": {"color": "#E69F00", "linestyle": (0, (4, 2)), "label": r"$F_y/(\mu N)$"},
    "mz": {"color": "#000000", "linestyle": (0, (1, 1)), "label": r"$M_z/(\mu N c)$"},
}


@styled
def fig_creep_smoothness(lines, table):
    """Plot forces and slopes of a creep table along lines across its cells, its pole and zero creepage (`smoothness`).

    Dots are the exact solver. A text states the variation of the slope of F_x at the pole (`smoothness_table`).
    """
    figure = Figure(figsize=(8.4, 4.6), layout="constrained")
    panels = figure.subplots(2, 4, sharex="col")
    for (name, (title, label, centred)), column in zip(SMOOTH_PANELS.items(), panels.T, strict=True):
        part = lines[lines["line"] == name]
        for output, style in OUTPUTS.items():
            _smooth_pair(column, part, output, style, centred)
        column[0].set_title(title, fontsize=8)
        column[1].set_xlabel(label)
        column[1].locator_params(axis="x", nbins=4)
    panels[0, 0].set_ylabel("force, moment / 1")
    panels[1, 0].set_ylabel("slope along $x$ / 1")
    panels[1, 2].set_title(_axis_text(table), fontsize=7)
    handles = [Line2D([], [], **style) for style in OUTPUTS.values()]
    handles.append(Line2D([], [], color="0.4", marker=".", linestyle="none", label="exact solver"))
    legend_below(figure, handles, 4, handlelength=3)
    return figure


def _axis_text(table):
    rows = table[(table["line"] == "axis") & (table["output"] == "fx")].set_index("source")["variation"]
    return f"slope of $F_x$ varies by\n{PERCENT * rows['table']:.1f} % (exact {PERCENT * rows['exact']:.1f} %)"


def _smooth_pair(column, part, output, style, centred):
    for axes, channel in zip(column, (output, f"d{output}"), strict=True):
        inner = slice(1, -1) if channel != output else slice(None)
        table, exact = (part[part["source"] == source].iloc[inner] for source in ("table", "exact"))
        mean = table[channel].mean() if centred else 0.0
        axes.plot(exact["x"], exact[channel] - mean, ".", color=style["color"], markersize=4, alpha=0.6)
        axes.plot(table["x"], table[channel] - mean, **style)
