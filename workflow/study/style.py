"""Styles that figures of several questions have in common.

Planar and spatial detection have the same colour, line and marker in every figure. They also differ in lightness, so
that a grey copy is readable.
"""

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
