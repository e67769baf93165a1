"""Figures of speed against error of modelling and integration choices.

Units, colours and style are those of :mod:`wrcore.analysis.pictures.style`.
"""

import numpy as np
from matplotlib.figure import Figure

from wrcore.analysis.accuracy.choices import pareto_front
from wrcore.analysis.pictures.style import ACCENT, shared_legend, styled

MODELS = (
    ("spatial, fine table", "#222222", "o"),
    ("spatial, default table", "#0072B2", "s"),
    ("spatial, coarse table", "#56B4E9", "D"),
    ("spatial, formula or FASTSIM", "#E69F00", "^"),
    ("planar", "#CC79A7", "v"),
    ("exact contact, looked up", "#009E73", "P"),
    ("reduction to the maximum", "0.6", "x"),
)
"""Kinds of model: label, colour (Okabe-Ito; dark to light in grey) and marker."""

INTEGRATION, MODEL = "#0072B2", "#E69F00"
"""Colours of the errors of integration and model; in greyscale, filled dark marks and open light marks differ."""


def model_kind(row, finest):
    """Return the label in ``MODELS`` of a row of `run_choices`."""
    if row["patch"] != "moment":
        return MODELS[5 if row["patch"] == "tabulated" else 6][0]
    if row["detection"] != "spatial":
        return MODELS[4][0]
    if not row["creep"].startswith("table"):
        return MODELS[3][0]
    if row["creep"] == finest:
        return MODELS[0][0]
    coarse = float(row["creep"].split()[1]) > 1e-2
    return MODELS[2 if coarse else 1][0]


@styled
def speed_against_error(tables, finest, doubts=None, resolved=None):
    """Plot the real-time factor over the error of y, a panel per scene.

    ``tables`` of :func:`wrcore.analysis.accuracy.choices.run_choices` are given by title. With columns of
    `wrcore.analysis.accuracy.models`, the marker shows the kind of model: filled at the error of the integration, open
    at the error of the model. Without them, marks show the difference from the reference (creep ``finest``), coloured
    by kind of model.

    Vertical lines (RMS, m) show differences between the two reference runs (``doubts``) and between the two runs with
    exact contact (``resolved``). Smaller errors, or smaller errors of models, are not resolved.
    """
    rows = -(-len(tables) // 2)
    figure = Figure(figsize=(7.4, 1.1 + 2.5 * rows), layout="constrained")
    panels = np.ravel(figure.subplots(rows, min(2, len(tables)), squeeze=False))
    for axes, (title, table) in zip(panels, tables.items(), strict=False):
        done = table[(table["status"] == "completed") & table["y_rms_m"].notna()]
        apart = "integration_y_rms_m" in done
        kinds = [model_kind(row, finest) for _, row in done.iterrows()]
        if apart:
            axes.scatter([], [], s=12, c=INTEGRATION, label="error of the integration")
            axes.scatter([], [], s=14, facecolors="none", edgecolors=MODEL, label="error of the model")
        for label, color, marker in reversed(MODELS):
            _marks(axes, done[[kind == label for kind in kinds]], label, color, marker, apart)
        own = done[[kind == MODELS[0][0] for kind in kinds]] if apart else done
        front = pareto_front(own)
        label = "fastest with moment, fine table" if apart else "best of all"
        axes.plot(front["y_rms_m"], front["real_time_factor"], color=ACCENT, lw=1.0, label=label)
        least = 0.5 * _least_error(done)
        if doubts and doubts[title] > least:
            axes.axvline(doubts[title], color="0.3", ls=":", lw=0.9, label="difference of the references")
        if resolved and title in resolved:
            axes.axvline(resolved[title], color=MODEL, ls="--", lw=0.9, label="resolution of exact contact")
        axes.set(xscale="log", yscale="log", xlabel="error of y, rms / m", ylabel="real-time factor / 1")
        if doubts:  # their difference is often far below all marks, which set the range
            axes.set_xlabel(f"error of y, rms / m (references: {doubts[title]:.0e} m)")
            axes.set_xlim(left=least)
        axes.set_title(title, loc="left")
    for axes in panels[len(tables) :]:
        axes.remove()
    shared_legend(figure, panels[: len(tables)], fontsize=7, ncols=3)
    return figure


def _least_error(rows):
    """Return the smallest plotted error above zero, m."""
    columns = [name for name in ("integration_y_rms_m", "model_y_rms_m") if name in rows] or ["y_rms_m"]
    values = rows[columns].to_numpy()
    return min(values[values > 0.0], default=1.0)


def _marks(axes, rows, label, color, marker, apart):
    """Plot the marks of the choices of one kind of model."""
    speed, size = rows["real_time_factor"], {"s": 9, "marker": marker, "lw": 0.7}
    if not apart:
        axes.scatter(rows["y_rms_m"], speed, c=color, label=label, **size)
        return
    axes.scatter([], [], c="0.2", label=label, **size)
    hollow = {"c": MODEL} if marker == "x" else {"facecolors": "none", "edgecolors": MODEL}
    axes.scatter(rows["model_y_rms_m"], speed, **hollow, **size | {"lw": 1.0, "s": 14})
    axes.scatter(rows["integration_y_rms_m"], speed, c=INTEGRATION, **size)
