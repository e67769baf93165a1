"""Looks that figures of several questions share.

Planar and spatial detection keep their colour, line and marker in every figure; they differ in lightness too, so that a
grey copy stays readable.
"""

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
