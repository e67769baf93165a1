"""Plot of an assessment by EN 14363: filtered forces of wheels over time, and their limits."""

import math

from matplotlib.figure import Figure

from wrcore.analysis.pictures.plot_run import HEIGHT, MOST_ENTRIES, WIDTH, looks, printed
from wrcore.analysis.pictures.style import ACCENT, styled
from wrcore.errors import InputError

CHANNELS = {"sum_Y": "sum_Y_N", "Q": "Q_N", "Q_qst": "Q_qst_N", "Y_qst": "Y_qst_N"}
"""Channel names with the unit of quantities whose names do not state it."""


@styled
def plot_assessment(assessment):
    """Draw an Assessment by EN 14363 with a panel per quantity of its summary.

    Limits of wheelsets that differ by less than a line's width are drawn as one line."""
    quantities = [name for name in assessment.summary.get("quantity", ()) if name in assessment.series]
    if not quantities:
        raise InputError("plot", "standard", f"expected an assessment by EN 14363, got {assessment.standard}")
    figure = Figure(figsize=(WIDTH, 0.7 + HEIGHT * len(quantities)), layout="constrained")
    rows = figure.subplots(len(quantities), 1, sharex=True, squeeze=False)[:, 0]
    for axes, quantity in zip(rows, quantities, strict=True):
        factor, label = printed(CHANNELS.get(quantity, quantity))
        lines = assessment.series[quantity]
        names = [" ".join(filter(None, column)).replace("_", " ") for column in lines]
        for name, look, column in zip(names, looks(names), lines, strict=True):
            axes.plot(lines.index, factor * lines[column], label=name, **look)
        known = {f"{limits[quantity]:.2g}": factor * limits[quantity] for limits in assessment.limits.values()}
        for limit in known.values():
            if math.isfinite(limit):
                for sign in (1.0,) if quantity.startswith("Q") else (-1.0, 1.0):
                    axes.axhline(sign * limit, color=ACCENT, linestyle="--", linewidth=0.8)
        axes.set(ylabel=label, xmargin=0)
        small = len(names) > MOST_ENTRIES // 2
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=7 if small else 9)
    rows[-1].set_xlabel("time / s")
    figure.suptitle(f"{assessment.standard}, filtered; dashed: limits", x=0.01, ha="left")
    return figure
