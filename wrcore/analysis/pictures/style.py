"""One style for all figures.

Planar and spatial detection keep their colour, line and marker in every figure; they differ in lightness too, so that a
grey copy stays readable. Units change in the functions that draw and nowhere before: m to mm, rad to mrad, N to kN.
"""

from functools import wraps
from pathlib import Path

import matplotlib as mpl

MM = 1e3


STYLE = {
    "figure.dpi": 100,
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "0.9",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "legend.frameon": False,
    "lines.linewidth": 1.2,
    "savefig.dpi": 200,
    "svg.hashsalt": "wrcore",
}


LINES = {
    "planar": {"color": "#0072B2", "linestyle": "-"},
    "spatial": {"color": "#E69F00", "linestyle": (0, (4, 2))},
}


MARKERS = {
    "planar": {"color": "#0072B2", "marker": "o", "s": 14, "linewidths": 0},
    "spatial": {"color": "#E69F00", "marker": "o", "s": 2.5, "linewidths": 0},
}
"""Blue and orange of the Okabe-Ito palette: told apart with any colour vision, and dark against light in grey. The
smaller markers of spatial detection lie on top, so that both are seen where they coincide."""


WHEEL, RAIL = "0.25", "0.6"


ACCENT = "#CC3311"


def styled(function):
    """Draw with the project's style, whatever the caller has set."""

    @wraps(function)
    def inner(*args, **kwargs):
        with mpl.rc_context({**mpl.rcParamsDefault, **STYLE, "backend": mpl.rcParams["backend"]}):
            return function(*args, **kwargs)

    return inner


@styled
def save_figure(figure, *paths):
    """Write a figure as ``.png`` and ``.svg`` by the paths' endings, folders created; equal figures give the same."""
    for path in map(Path, paths):
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, metadata={"Date": None} if path.suffix == ".svg" else None)


def derailed_at(axes, speeds, color):
    """Crosses at the upper edge of a panel, at the speeds (m/s) of runs that derailed."""
    if len(speeds):
        look = {"marker": "x", "linestyle": "", "color": color, "transform": axes.get_xaxis_transform()}
        axes.plot(speeds, [0.97] * len(speeds), label="derailed", **look)


def shared_legend(figure, panels, **kwargs):
    """One legend for all panels, above them, each label once."""
    entries = {}
    for axes in panels:
        handles, labels = axes.get_legend_handles_labels()
        entries.update(zip(labels, handles, strict=True))
    look = {"ncols": len(entries), "loc": "outside upper right"} | kwargs
    figure.legend(entries.values(), entries.keys(), **look)
