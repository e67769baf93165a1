"""Figures of the benchmark: error over work, and drift of the constraints.

They draw the tables of `study.ivp.runs`. A method has the same colour and marker in all figures (`METHOD_STYLES`).
Lengths are converted to micrometres only in this module.
"""

from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from wrcore.analysis.pictures.style import ACCENT, styled

MICRO = 1e6

METHOD_STYLES = {
    "rk45": {"label": "Dormand-Prince 5(4)", "color": "#000000", "marker": "o", "linestyle": "-"},
    "rk45_projected": {"label": "the same, projected", "color": "#CC79A7", "marker": "s", "linestyle": (0, (1, 1))},
    "scipy_rk45": {"label": "scipy: RK45", "color": "#56B4E9", "marker": "^", "linestyle": "-."},
    "scipy_dop853": {"label": "scipy: DOP853", "color": "#009E73", "marker": "v", "linestyle": (0, (6, 1, 1, 1))},
    "scipy_lsoda": {"label": "scipy: LSODA", "color": "#E69F00", "marker": "P", "linestyle": (0, (3, 1))},
    "scipy_radau": {"label": "scipy: Radau", "color": "#D55E00", "marker": "X", "linestyle": (0, (6, 2, 2, 2))},
}
"""Label and style of each method. Colours are from Okabe-Ito; marker and line distinguish the methods in grey too."""

TREATMENT_STYLES = (
    {"color": "#000000", "linestyle": "-"},
    {"color": "#0072B2", "linestyle": (0, (4, 2))},
    {"color": "#E69F00", "linestyle": "-."},
    {"color": "#CC79A7", "linestyle": (0, (1, 1))},
    {"color": "#009E73", "linestyle": (0, (6, 1, 1, 1, 1, 1))},
)


@styled
def fig_ivp_work_precision(table, effort, bar):
    """Draw the error of the lateral position at the end over evaluations and over seconds.

    ``table`` is that of `work_precision`; failed runs are omitted. ``effort`` is that of the reference (``solver``,
    ``evaluations``), ``bar`` the accepted error (m).
    """
    figure = Figure(figsize=(7.2, 3.6), layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    for axes, column in zip(panels, ("evaluations", "seconds"), strict=True):
        for method, style in METHOD_STYLES.items():
            part = table[(table["method"] == method) & (table["status"] == "completed")]
            if len(part):
                axes.plot(part[column], MICRO * part["error_x_m"], markersize=4, **style)
        axes.axhline(MICRO * bar, color=ACCENT, linewidth=0.8)
        axes.set(xscale="log", yscale="log")
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.xaxis.set_minor_formatter(NullFormatter())
    panels[0].axvline(effort["evaluations"], color="0.5", linestyle=":", label=f"reference: {effort['solver']}")
    panels[0].set(xlabel="right-hand sides / 1", ylabel=r"error of $x$ at the end / µm", title="(a) evaluations")
    panels[1].set(xlabel="wall time / s", title="(b) time")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize=8)
    return figure


@styled
def fig_ivp_constraints(history):
    """Draw the violation of constraints over time (`violation_history`) for Baumgarte's parameters and projection."""
    figure = Figure(figsize=(7.2, 3.4), layout="constrained")
    panels = figure.subplots(1, 2)
    groups = history.groupby(["treatment", "alpha_per_s"])
    for ((treatment, alpha), part), style in zip(groups, TREATMENT_STYLES, strict=False):
        label = rf"$\alpha = \beta$ = {alpha:g}/s" if treatment == "Baumgarte" else treatment
        for axes, column in zip(panels, ("phi_m", "phi_rate_m_per_s"), strict=True):
            positive = part[part[column] > 0.0]
            axes.plot(positive["t_s"], MICRO * positive[column], label=label, linewidth=0.9, **style)
    panels[0].set(ylabel=r"$\max |\Phi|$ / µm", title="(a) position constraints")
    panels[1].set(ylabel=r"$\max |\dot\Phi|$ / (µm/s)", title="(b) velocity constraints")
    for axes in panels:
        axes.set(xlabel="time / s", yscale="log")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=5, fontsize=8)
    return figure
