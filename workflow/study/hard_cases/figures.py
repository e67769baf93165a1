"""Figures of the hard cases, drawn from the curves of `study.hard_cases.study.run_family`.

Values are converted from SI units only in this module. Planar and spatial detection have the same line styles as in all
other figures.
"""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from wrcore.analysis.pictures.style import ACCENT, LINES, MM, styled

KILO = 1e-3

METHODS = {
    "tsit5": ("#0072B2", "o"), "rk45": ("#56B4E9", "s"), "rk4": ("#CC79A7", "v"), "rk23": ("#E69F00", "^"),
    "rodas5": ("#D55E00", "h"), "rodas4": ("#222222", "D"), "rodas4p2": ("#009E73", "X"), "ros34pw2": ("0.55", "P"),
}  # fmt: skip
"""Colour and marker of each integrator. Colours are from Okabe-Ito and run from dark to light in grey."""

DASHES = ("-", (0, (4, 2)), (0, (1, 1)), "-.")

SHADES = ("#222222", "#0072B2", "#E69F00", "#56B4E9", "#CC79A7")


def _groups(curve, *columns):
    """Group a curve (list of dict) by the values of some columns, in the order of the rows."""
    return pd.DataFrame(curve).groupby(list(columns), sort=False)


def _panels(count, width=7.2, height=2.9):
    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, np.ravel(figure.subplots(1, count, squeeze=False))


@styled
def fig_low_speed(curves):
    """Draw braking to standstill, and the influence of the minimum speed for creepages (family ``low_speed``)."""
    figure, (braking, influence) = _panels(2, 7.8)
    rows = pd.DataFrame(curves["braking"])
    rows = rows[(rows["detection"] == "spatial") & (rows["least_speed_m_per_s"] == rows["least_speed_m_per_s"].min())]
    for (vehicle, part), color, dash in zip(
        rows.groupby("vehicle", sort=False), SHADES, ("-", "--", "-.", ":"), strict=False
    ):
        braking.plot(part["t_s"], part["v_m_per_s"], color=color, linestyle=dash, label=vehicle)
    braking.set(xlabel="time / s", ylabel="speed / (m/s)")
    braking.set_title("braked to standstill", loc="left")
    for (speed, part), color, marker in zip(
        _groups(curves["regularisation"], "speed_m_per_s"), SHADES, "osD", strict=False
    ):
        shown = part[part["y_off_m"] > 0.0]
        look = {"color": color, "marker": marker, "markersize": 4, "label": f"{speed[0]:g} m/s"}
        influence.plot(shown["least_speed_m_per_s"], MM * shown["y_off_m"], **look)
        influence.axvline(speed[0], color=color, linewidth=0.7, linestyle=":")
    influence.set(xscale="log", yscale="log", xlabel="smallest speed of creepages / (m/s)", ylabel="change of y / mm")
    influence.set_title("suspended wheelset", loc="left")
    braking.legend(fontsize=7)
    look = {"loc": "center left", "bbox_to_anchor": (1.0, 0.5)}
    influence.legend(fontsize=7, title="running speed\n(dotted)", title_fontsize=7, **look)
    return figure


@styled
def fig_contact_jumps(curves):
    """Draw lateral force and contact point over y under load, and a slow push to the flange and back.

    The family of cases is ``contact``.
    """
    figure, (force, point, push) = _panels(3, 9.0)
    for (pair, detection), part in _groups(curves["pose_sweeps"], "pair", "detection"):
        steep = {"linewidth": 0.8 if "1:20" in pair else 1.4, "label": f"{pair.rsplit(', ', 1)[-1]}, {detection}"}
        force.plot(MM * part["y_m"], -KILO * part["force_N"], **LINES[detection] | steep)
        point.plot(MM * part["y_m"], MM * part["u_wheel_m"], **LINES[detection] | steep)
    force.set(xlabel="y / mm", ylabel="restoring force / kN", yscale="symlog")
    point.set(xlabel="y / mm", ylabel="contact on the left wheel / mm")
    slowest = pd.DataFrame(curves["slow_push"])
    slowest = slowest[slowest["duration_s"] == slowest["duration_s"].max()]
    for detection, part in slowest.groupby("detection", sort=False):
        one = part[part["integrator"] == part["integrator"].iloc[0]]
        push.plot(MM * one["y_m"], KILO * one["force_N"], **LINES[detection], label=detection)
    push.set(xlabel="y / mm", ylabel="force / kN")
    for axes, title in ((force, "static"), (point, "static"), (push, "slow push and return")):
        axes.set_title(title, loc="left")
        axes.legend(fontsize=6.5)
    return figure


@styled
def fig_lift_off(curves):
    """Draw restitution over speed with that of the damping law, and a drop with bounces (family ``contact``)."""
    figure, (impact, drop) = _panels(2)
    rows = pd.DataFrame(curves["impacts"])
    law = rows.drop_duplicates("speed_m_per_s").sort_values("speed_m_per_s")
    impact.plot(law["speed_m_per_s"], law["expected"], color="0.3", label="from the damping law")
    for method, part in rows[rows["detection"] == "spatial"].groupby("integrator", sort=False):
        color, marker = METHODS[method]
        impact.plot(part["speed_m_per_s"], part["restitution"], color=color, marker=marker, markersize=4, linestyle="",
                    label=method)  # fmt: skip
    impact.set(xscale="log", xlabel="speed of the impact / (m/s)", ylabel="restitution")
    rows = pd.DataFrame(curves["drops"])
    rows = rows[(rows["rtol"] == rows["rtol"].min()) & (rows["detection"] == rows["detection"].iloc[0])]
    for (method, part), dash in zip(rows.groupby("integrator", sort=False), DASHES, strict=False):
        color, _ = METHODS[method]
        drop.plot(part["t_s"], MM * part["lift_m"], color=color, linewidth=0.9, linestyle=dash, label=method)
    shown = rows.loc[rows["lift_m"].abs() > 0.01 * rows["lift_m"].max(), "t_s"].max()
    drop.set(xlabel="time / s", ylabel="height above rest / mm", xlim=(0.0, 1.2 * shown))
    for axes, title in ((impact, "free wheelset on both rails"), (drop, "dropped")):
        axes.set_title(title, loc="left")
        axes.legend(fontsize=7)
    return figure


@styled
def fig_nadal(curves):
    """Draw Y/Q of a climbing wheelset over the coefficient of friction, with Nadal's limit (family ``flange``)."""
    figure, (axes,) = _panels(1, 4.2, 3.0)
    rows = pd.DataFrame(curves["nadal"])
    limit = rows.drop_duplicates("friction").sort_values("friction")
    axes.plot(limit["friction"], limit["nadal"], color=ACCENT, label="Nadal's limit")
    for detection, part in rows.groupby("detection", sort=False):
        look = {"color": LINES[detection]["color"], "marker": "o" if detection == "planar" else "D", "markersize": 4}
        axes.plot(part["friction"], part["Y_over_Q"], linestyle="", **look, label=f"climbs, {detection}")
    axes.set(xlabel="friction coefficient", ylabel="Y/Q (mean over 2 m)", ylim=(0.0, None))
    axes.legend(fontsize=7)
    return figure


@styled
def fig_stability_map(curves):
    """Draw the maximum stable step over speed: from runs (markers) and linearised (lines; family ``integration``)."""
    groups = _groups(curves["stability_map"], "vehicle")
    figure, panels = _panels(groups.ngroups, 3.7 * groups.ngroups, 3.1)
    for axes, ((vehicle,), table) in zip(panels, groups, strict=True):
        for method, part in table.groupby("integrator", sort=False):
            color, marker = METHODS[method]
            axes.plot(part["speed_m_per_s"], MM * part["predicted_s"], color=color, linewidth=0.9)
            axes.plot(part["speed_m_per_s"], MM * part["found_s"], color=color, marker=marker, markersize=4,
                      linestyle="", label=method)  # fmt: skip
        axes.set(xscale="log", yscale="log", xlabel="speed / (m/s)", ylabel="largest stable step / ms")
        axes.set_title(vehicle, loc="left")
    panels[0].plot([], [], color="0.5", linewidth=0.9, label="linearised")
    panels[0].legend(fontsize=7, ncols=2)
    return figure


@styled
def fig_tolerances(curves):
    """Draw errors over the tolerance, and drift and number of steps over Baumgarte's feedback.

    The family of cases is ``integration``.
    """
    figure, (errors, drift, steps) = _panels(3, 9.0)
    rows = pd.DataFrame(curves["tolerance_ladder"])
    rows = rows[(rows["vehicle"] == rows["vehicle"].iloc[0]) & (rows["detection"] == rows["detection"].iloc[-1])]
    for method, part in rows.groupby("integrator", sort=False):
        color, marker = METHODS[method]
        errors.plot(part["rtol"], MM * part["error_m"], color=color, marker=marker, markersize=4, label=method)
    errors.set(xscale="log", yscale="log", xlabel="relative tolerance", ylabel="error of y / mm")
    table = pd.DataFrame(curves["baumgarte"])
    equal = table[table["alpha_per_s"] == table["beta_per_s"]]
    for method, part in equal.groupby("integrator", sort=False):
        color, marker = METHODS[method]
        look = {"color": color, "marker": marker, "markersize": 4, "label": method}
        drift.plot(part["beta_per_s"], part["violation_m"], **look)
        steps.plot(part["beta_per_s"], part["steps"], **look)
    drift.set(yscale="log", ylabel="largest violation of a joint / m")
    steps.set(yscale="log", ylabel="steps")
    for axes in (drift, steps):
        axes.set_xscale("symlog", linthresh=1.0)
        axes.set_xlim(-0.1, None)
        axes.set_xlabel(r"$\alpha = \beta$ / (1/s)")
    for axes, title in ((errors, rows["vehicle"].iloc[0]), (drift, "axle boxes on joints"), (steps, "the same runs")):
        axes.set_title(title, loc="left")
        axes.legend(fontsize=6.5)
    return figure


@styled
def fig_sharp_curve(curves):
    """Draw the lateral force of all wheels on the rails in a sharp curve, and the force by Newton's law.

    The vehicle enters the curve through a transition. The family of cases is ``track``.
    """
    figure, (axes,) = _panels(1, 5.2, 3.8)
    rows = pd.DataFrame(curves["curve"])
    rows = rows[(rows["vehicle"] == rows["vehicle"].iloc[-1]) & (rows["integrator"] == rows["integrator"].iloc[0])]
    for (share, table), width in zip(rows.groupby("share", sort=False), (1.8, 0.9), strict=False):
        for detection, part in table.groupby("detection", sort=False):
            look = {**LINES[detection], "linewidth": width}
            axes.plot(part["t_s"], KILO * part["Y_N"], **look, label=f"{share:g} × balanced speed, {detection}")
        newton = {"color": ACCENT, "linewidth": width, "linestyle": "-.", "label": f"{share:g} ×, Newton's law"}
        axes.axhline(KILO * table["expected_N"].iloc[0], **newton)
    axes.set(xlabel="time / s", ylabel="lateral force on the rails / kN")
    axes.set_title(str(rows["vehicle"].iloc[0]), loc="left")
    figure.legend(fontsize=7, loc="outside lower center", ncols=2)
    return figure


FIGURES = {
    "low_speed": ("low_speed", fig_low_speed), "contact_jumps": ("contact", fig_contact_jumps),
    "lift_off": ("contact", fig_lift_off), "nadal": ("flange", fig_nadal),
    "stability_map": ("integration", fig_stability_map), "tolerances": ("integration", fig_tolerances),
    "sharp_curve": ("track", fig_sharp_curve),
}  # fmt: skip
"""Family of cases and drawing function of each figure, by the name of its file."""
