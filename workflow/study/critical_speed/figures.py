"""Figures of stability: root locus over speed, modes at one speed, limit cycles over speed.

Data are tables of `wrcore.analysis.stability.stability` in SI units; these functions convert lengths to mm.
"""

import numpy as np
from matplotlib.figure import Figure

from wrcore.analysis.pictures.style import ACCENT, LINES, MM, derailed_at, shared_legend, styled
from wrcore.analysis.stability.modes import OVERDAMPED

GREY = "0.72"

HIGHEST = 20.0
"""Maximum frequency in the figure of the root locus, Hz; modes of contact and bushes have higher frequencies."""


@styled
def fig_root_locus(loci, linear):
    """Plot damping ratio and frequency of all oscillating modes over speed, with hunting modes in colour.

    ``loci`` are tables of `study.critical_speed.tables.loci` by title of the row of panels. A line marks the variant
    ``spatial`` of `critical_speeds` (``linear``).
    """
    figure = Figure(figsize=(7.0, 0.6 + 2.3 * len(loci)), layout="constrained")
    panels = figure.subplots(len(loci), 2, sharex=True, squeeze=False)
    for (title, locus), (damping, frequency) in zip(loci.items(), panels, strict=True):
        shown = locus[(locus["damping_ratio"] < OVERDAMPED) & (locus["frequency_Hz"] <= HIGHEST)]
        hunting = shown["name"].str.contains("hunting")
        for axes, column in ((damping, "damping_ratio"), (frequency, "frequency_Hz")):
            others = shown[~hunting]
            axes.scatter(others["speed_m_per_s"], others[column], s=1.5, color=GREY, linewidths=0, label="other modes")
            for (detection, line), size in zip(LINES.items(), (14, 3), strict=True):
                rows = shown[hunting & (shown["detection"] == detection)]
                look = {"s": size, "color": line["color"], "linewidths": 0, "zorder": 3}
                axes.scatter(rows["speed_m_per_s"], rows[column], label=f"hunting, {detection}", **look)
            axes.axvline(_critical(linear[title]), color=ACCENT, linewidth=0.9, linestyle="-.")
        damping.axhline(0.0, color="0.3", linewidth=0.8)
        damping.set(ylabel="damping ratio", ylim=(-0.4, 0.6), xmargin=0.01)
        damping.set_title(title, loc="left")
        frequency.set(ylabel="frequency / Hz", ylim=(0.0, None), xmargin=0.01)
        frequency.set_title(f"linear critical speed {_critical(linear[title]):.1f} m/s", loc="right", color=ACCENT)
    for axes in panels[-1]:
        axes.set_xlabel("speed / (m/s)")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper right", ncols=len(labels), markerscale=2)
    return figure


def _critical(table):
    """Return the linear critical speed with spatial detection, m/s; NaN if it does not exist."""
    speed = table.set_index("variant").loc["spatial", "critical_speed_m_per_s"]
    return speed if np.isfinite(speed) else np.nan


@styled
def fig_limit_cycles(tables, linear):
    """Plot the amplitude of limit cycles over speed, after a large disturbance and after a small disturbance.

    ``tables`` of `limit_cycles` with a column detection are by title of the panel. A line marks the variant ``spatial``
    of `critical_speeds` (``linear``). Stars without a line are irregular motions; crosses at the top are derailments.
    """
    figure = Figure(figsize=(7.0, 0.6 + 2.4 * len(tables)), layout="constrained")
    panels = figure.subplots(len(tables), 1, squeeze=False)[:, 0]
    for axes, (title, table) in zip(panels, tables.items(), strict=True):
        for (detection, branch), rows in table.sort_values("speed_m_per_s").groupby(["detection", "branch"]):
            filled, planar = branch == "falling", detection == "planar"
            look = {
                **LINES[detection], "marker": "o" if planar else "D", "markersize": 5.5 if planar else 3.5,
                "markerfacecolor": LINES[detection]["color"] if filled else "white", "linewidth": 0.9,
                "zorder": 2 if planar else 3,
            }  # fmt: skip
            speeds, amplitudes = rows["speed_m_per_s"], MM * rows["amplitude_m"]
            irregular = rows["status"] == "irregular"
            axes.plot(speeds, amplitudes.where(~irregular), label=f"{branch} speed, {detection}", **look)
            star = {"marker": "*", "markersize": 7.0, "linestyle": "", "label": "irregular motion"}
            axes.plot(speeds[irregular], amplitudes[irregular], **{**look, **star})
            derailed_at(axes, speeds[rows["status"] == "derailed"], look["color"])
        look = {"color": ACCENT, "linewidth": 0.9, "linestyle": "-.", "label": "linear critical speed"}
        axes.axvline(_critical(linear[title]), **look)
        axes.set(ylabel="amplitude of y / mm", ylim=(-0.2, None))
        axes.set_title(title, loc="left")
    panels[-1].set_xlabel("speed / (m/s)")
    shared_legend(figure, panels, ncols=3, fontsize=8)
    return figure
