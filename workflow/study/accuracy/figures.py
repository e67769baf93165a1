"""Figures of speed against error.

Units, colours and style are those of :mod:`wrcore.analysis.style`.
"""

import numpy as np
from matplotlib.figure import Figure

from study.accuracy.errors import pareto_front
from wrcore.analysis.style import ACCENT, shared_legend, styled

MODELS = (
    ("spatial, fine table", "#222222", "o"),
    ("spatial, default table", "#0072B2", "s"),
    ("spatial, coarse table", "#56B4E9", "D"),
    ("spatial, formula or FASTSIM", "#E69F00", "^"),
    ("planar", "#CC79A7", "v"),
    ("reduction to the maximum", "0.6", "x"),
)
"""Kinds of model: label, colour (Okabe-Ito; dark to light in grey) and marker."""


def model_kind(row, finest):
    """Which of ``MODELS`` a row of the study belongs to."""
    if row["patch"] == "maximum":
        return MODELS[5][0]
    if row["detection"] != "spatial":
        return MODELS[4][0]
    if not row["creep"].startswith("table"):
        return MODELS[3][0]
    if row["creep"] == finest:
        return MODELS[0][0]
    coarse = float(row["creep"].split()[1]) > 1e-2
    return MODELS[2 if coarse else 1][0]


@styled
def speed_against_error(tables, finest, doubts=None):
    """Real-time factor over error, one panel per scene: every choice, and the front that no choice beats.

    Parameters
    ----------
    tables : dict of str to pandas.DataFrame
        By title, from :func:`study.accuracy.errors.study`.
    finest : str
        Creep of the reference, as in the column ``creep``.
    doubts : dict of str to float, optional
        Difference between the two reference runs (RMS, m), drawn as a line: errors below it mean nothing.

    Returns
    -------
    matplotlib.figure.Figure
    """
    rows = -(-len(tables) // 2)
    figure = Figure(figsize=(7.4, 0.9 + 2.5 * rows), layout="constrained")
    panels = np.ravel(figure.subplots(rows, min(2, len(tables)), squeeze=False))
    for axes, (title, table) in zip(panels, tables.items(), strict=False):
        done = table[(table["status"] == "completed") & table["y_rms_m"].notna()]
        kinds = [model_kind(row, finest) for _, row in done.iterrows()]
        for label, color, marker in reversed(MODELS):
            here = done[[kind == label for kind in kinds]]
            axes.scatter(here["y_rms_m"], here["real_time_factor"], s=9, c=color, marker=marker, lw=0.7, label=label)
        front = pareto_front(done)
        axes.plot(front["y_rms_m"], front["real_time_factor"], color=ACCENT, lw=1.0, label="best of all")
        if doubts:
            axes.axvline(doubts[title], color="0.3", ls=":", lw=0.9, label="difference of the references")
        axes.set(xscale="log", yscale="log", xlabel="error of y, rms / m", ylabel="real-time factor")
        axes.set_title(title, loc="left")
    for axes in panels[len(tables) :]:
        axes.remove()
    shared_legend(figure, panels[:1], fontsize=7, ncols=3)
    return figure
