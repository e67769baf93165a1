"""Common style of all figures; only functions that draw convert units."""

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

WHEEL, RAIL, ACCENT = "0.25", "0.6", "#CC3311"


def styled(function):
    """Decorate a function that draws, so that it uses the project's style instead of the caller's."""

    @wraps(function)
    def inner(*args, **kwargs):
        with mpl.rc_context({**mpl.rcParamsDefault, **STYLE, "backend": mpl.rcParams["backend"]}):
            return function(*args, **kwargs)

    return inner


def plain(name):
    """Return a user's name for figures, with escaped dollar signs, which would begin a formula."""
    return str(name).replace("$", r"\$")


@styled
def save_figure(figure, *paths):
    """Write a figure as ``.png`` or ``.svg`` by the ending of each path; files of equal figures are identical."""
    for path in map(Path, paths):
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, metadata={"Date": None} if path.suffix == ".svg" else None)


LINES = {
    "planar": {"color": "#0072B2", "linestyle": "-"},
    "spatial": {"color": "#E69F00", "linestyle": (0, (4, 2))},
}


MARKERS = {
    "planar": {"color": "#0072B2", "marker": "o", "s": 14, "linewidths": 0},
    "spatial": {"color": "#E69F00", "marker": "o", "s": 2.5, "linewidths": 0},
}
"""Marker style of planar and spatial detection. Blue and orange of the Okabe-Ito palette can be distinguished with any
colour vision, and in grey. The markers of spatial detection are smaller and on top, so that coinciding markers are both
visible."""


def derailed_at(axes, speeds, color):
    """Draw crosses at the upper edge of a panel, at the speeds (m/s) of derailed runs."""
    if len(speeds):
        look = {"marker": "x", "linestyle": "", "color": color, "transform": axes.get_xaxis_transform()}
        axes.plot(speeds, [0.97] * len(speeds), label="derailed", **look)


def shared_legend(figure, panels, **kwargs):
    """Draw one legend for all panels above them, with each label once."""
    entries = {}
    for axes in panels:
        handles, labels = axes.get_legend_handles_labels()
        entries.update(zip(labels, handles, strict=True))
    look = {"ncols": len(entries), "loc": "outside upper right"} | kwargs
    figure.legend(entries.values(), entries.keys(), **look)
