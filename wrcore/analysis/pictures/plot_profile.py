"""Plot of one profile, with the points of its file that it follows and those that were omitted."""

import math

from matplotlib.figure import Figure

from wrcore.analysis.pictures.style import ACCENT, MM, RAIL, styled
from wrcore.geometry.profiles.points import Outline
from wrcore.geometry.profiles.profile import GAUGE_DEPTH, STEEPEST


@styled
def plot_profile(curve):
    """Draw a `ProfileCurve` in the package's axes, true to scale."""
    figure = Figure(figsize=(7.2, 4.0), layout="constrained")
    axes = figure.subplots()
    axes.plot(MM * curve.u, MM * curve.f, color=RAIL, linewidth=5.0, label="curve")
    if isinstance(curve.outline, Outline):
        points, followed = MM * curve.outline.points, curve.outline.followed(STEEPEST)
        for some, color, label in ((followed, "0", "points"), (~followed, ACCENT, "left out")):
            if some.any():
                axes.plot(*points[some].T, ".", markersize=2, color=color, label=label)
    if curve.kind == "wheel":
        axes.plot(0.0, 0.0, "o", markerfacecolor="none", color=ACCENT, label="tape circle")
    elif not math.isnan(curve.gauge_offset_m):
        inside = -MM * curve.gauge_offset_m
        axes.plot([inside] * 2, [0.0, -MM * GAUGE_DEPTH], "--", color=ACCENT, label="gauge, down to 14 mm")
    axes.set(xlabel="u, to the field side / mm", ylabel="f, up / mm", aspect="equal")
    axes.legend(fontsize=7, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure
