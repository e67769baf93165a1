"""Small figures of a report as SVG inside the page."""

from __future__ import annotations

import hashlib
import io
import re
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wrcore.analysis.pictures.style import STYLE, styled
from wrcore.reporting.page import Markup

WIDTH, HEIGHT = 4.6, 2.25
"""Size of a panel, inches; the page scales it to the width of a column."""

MARGINS = {"left": 0.135, "right": 0.965, "top": 0.93, "bottom": 0.195}
"""Margins of a panel relative to its size; a layout that is computed takes three times as long."""

FRAME = 0.6, 0.55
"""Width and height that the labels of the axes of a picture true to scale take, inches."""

FONT = 9.0
"""Size of letters, points: 9 px on a phone and 13 px in the widest column of the page."""

BINS = 300
"""Largest number of bins of a line; each bin keeps the smallest and the largest value."""

LEAST_BINS = 60
"""Smallest number of bins of a line, for pages with very many lines."""

SETTINGS: dict[str, Any] = {
    **STYLE, "font.size": FONT, "axes.labelsize": FONT, "xtick.labelsize": FONT - 0.5, "ytick.labelsize": FONT - 0.5,
    "lines.linewidth": 1.0, "axes.linewidth": 0.6, "xtick.major.width": 0.6, "ytick.major.width": 0.6,
    "svg.fonttype": "none", "font.family": "sans-serif", "axes.titlesize": FONT, "axes.titlepad": 3.0,
    "axes.formatter.useoffset": False, "axes.formatter.limits": (-4, 5), "text.parse_math": False,
    "path.simplify_threshold": 0.2, "axes.labelpad": 2.0, "axes.edgecolor": "0.4", "legend.fontsize": FONT - 0.5,
}  # fmt: skip
"""Style of panels; names are the user's, so that dollar signs do not begin a formula."""


@styled
def panel(
    draw: Callable[[Axes], object], label: str, size: tuple[float, float] = (WIDTH, HEIGHT), fits: bool = False
) -> Markup:
    """Return a figure with one pair of axes as SVG.

    Parameters
    ----------
    draw : callable
        Draws into the axes.
    label : str
        Description for readers who do not see the picture; it also makes identifiers within the page unique.
    size : tuple of float
        Width and height, inches.
    fits : bool
        Whether the height follows from the limits of the axes, for a picture that is true to scale; then the margins
        are computed from the texts.
    """
    settings: Any = {**SETTINGS, "svg.hashsalt": hashlib.sha256(label.encode()).hexdigest()}
    with rc_context(settings):
        figure = Figure(figsize=size, layout="constrained" if fits else None)
        axes = figure.subplots()
        draw(axes)
        if fits:
            (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
            figure.set_size_inches(size[0], (size[0] - FRAME[0]) * (high - low) / (right - left) + FRAME[1])
        else:
            figure.subplots_adjust(**MARGINS)
        buffer = io.StringIO()
        figure.savefig(buffer, format="svg", transparent=True, metadata={"Date": None, "Creator": None})
    return _inside_page(buffer.getvalue(), label)


def _inside_page(svg: str, label: str) -> Markup:
    """Return an SVG without what a file needs: declarations, metadata, comments, size and names of groups; coordinates
    of lines are rounded to 0.01 points."""
    from html import escape

    svg = svg[svg.index("<svg") :]
    svg = re.sub(r"<!--.*?-->|<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    view = re.search(r'viewBox="([^"]*)"', svg)
    opened = f'<svg viewBox="{view[1] if view else "0 0 1 1"}" role="img" aria-label="{escape(label)}" '
    svg = opened + 'xmlns:xlink="http://www.w3.org/1999/xlink">' + svg[svg.index(">") + 1 :]
    svg = re.sub(r'<g id="[^"<>]*"', "<g", svg)
    svg = re.sub(r' d="([^"]*)"', lambda found: f' d="{_rounded(found[1])}"', svg)
    svg = re.sub(r' (x|y)="(-?\d+\.\d{3,})"', lambda found: f' {found[1]}="{float(found[2]):.2f}"', svg)
    return Markup(re.sub(r"\n\s*", "\n", svg))


def _rounded(path: str) -> str:
    """Return the coordinates of an SVG path rounded to 0.01."""
    short = re.sub(r"-?\d+\.\d{3,}", lambda found: f"{float(found[0]):.2f}", path)
    return re.sub(r"\s+", " ", short).strip()


def thinned(x: np.ndarray, y: np.ndarray, bins: int = BINS) -> tuple[np.ndarray, np.ndarray]:
    """Return a line (n,) with at most two points for each of ``bins`` equal parts of its samples: the smallest and the
    largest value of each part, in their order. NaN separates pieces of a line and is kept where a part has no value.

    Examples
    --------
    >>> x = np.arange(1000.0)
    >>> thinned(x, np.where(x == 345.0, 7.0, 0.0), 10)[1].max()
    np.float64(7.0)
    """
    if len(x) <= 2 * bins:
        return x, y
    width = -(-len(y) // bins)
    parts = np.pad(np.asarray(y, float), (0, -len(y) % width), constant_values=np.nan).reshape(-1, width)
    first = width * np.arange(len(parts))
    low = first + np.where(np.isnan(parts), np.inf, parts).argmin(axis=1)
    high = first + np.where(np.isnan(parts), -np.inf, parts).argmax(axis=1)
    kept = np.unique(np.concatenate([[0, len(x) - 1], low, high]))
    return x[kept], y[kept]


def line(axes: Axes, x: np.ndarray, y: np.ndarray, bins: int = BINS, **look: object) -> None:
    """Draw a line, or the columns of an array (n, k) of contact patches, with at most ``bins`` bins of points."""
    for column in np.reshape(np.asarray(y, float), (len(x), -1)).T:
        if np.isfinite(column).any():
            axes.plot(*thinned(np.asarray(x, float), column, bins), **look)  # type: ignore[arg-type]


def swatch(color: str, dashed: bool = False) -> Markup:
    """Return a short line for a legend of the page."""
    dash = ' stroke-dasharray="6 3"' if dashed else ""
    return Markup(
        f'<svg class="swatch" viewBox="0 0 26 10" aria-hidden="true"><line x1="0" x2="26" y1="5" y2="5" '
        f'stroke="{color}" stroke-width="2.4"{dash}/></svg>'
    )


def legend(entries: Sequence[tuple[str, str, bool]]) -> Markup:
    """Return a legend of the page from labels, colours and whether lines are dashed."""
    from wrcore.reporting.page import element

    return element("div", *(element("span", swatch(color, dash), label) for label, color, dash in entries),
                   class_="legend")  # fmt: skip
