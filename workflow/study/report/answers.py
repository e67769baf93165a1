"""The answer of each page of the report: one or two sentences with numbers from the study's tables.

Each category of results has one function, in reading order. Its argument ``read`` is a function that returns a table by
its path below the results, or tables by name if the path contains a star.
"""

import numpy as np

ACCURACY = 1e-6
"""Accuracy of the lateral position for which the answer states the speed, m; the nearest one in the study is used."""


def _percent(value):
    return f"{100 * value:.2g} %"


def _paper_values(read):
    table = read("paper/comparison.csv")
    asked = table[table["within"].isin(["yes", "no"])]
    return (
        f"{(asked['within'] == 'yes').sum()} of {len(asked)} published or derived values are met within the tolerance "
        f"that was set beforehand; {len(table) - len(asked)} more are shown without one."
    )


def _paper_figures(read):
    motion, timing = read("paper/motion.csv"), read("paper/timing.csv")
    row = motion[motion["detection"] == "spatial"].iloc[0]
    cost = timing[timing["case"] == row["case"]].iloc[0]
    return (
        f"The free wheelset hunts at {row['frequency_Hz']:.2f} Hz; up to the prediction horizon of "
        f"{row['prediction_horizon_s']:.1f} s planar and spatial detection differ by at most "
        f"{1e3 * row['planar_spatial_max_m']:.2g} mm. In {cost['runs']} pairs a planar run takes "
        f"{cost['ratio_per_run_least']:.2f} to {cost['ratio_per_run_largest']:.2f} times as long as a spatial one "
        f"(median {cost['ratio_per_run']:.2f}): one evaluation takes {cost['ratio_per_call_least']:.2f} to "
        f"{cost['ratio_per_call_largest']:.2f} times as long, and after the first flange impact the number of "
        f"evaluations is another one in each pair ({cost['ratio_of_calls_least']:.2f} to "
        f"{cost['ratio_of_calls_largest']:.2f} times that of the spatial run)."
    )


def _contact(read):
    largest = read("contact/force_steps.csv").groupby("reduction")["largest_step_N"].max()
    return (
        f"Over a micrometre of lateral shift the force jumps by up to {1e-3 * largest['maximum']:.3g} kN with the "
        f"reduction to the deepest point and changes by at most {1e-3 * largest['moment']:.2g} kN with moments."
    )


def _patch(read):
    table = read("patch/summary.csv")
    whole = table[(table["zone"] == table["zone"].iloc[0]) & (table["unit"] == "%")]
    first = whole["quantity"].iloc[0]
    rows = whole[whole["quantity"] == first].set_index("model")
    rows = rows[rows["worst"] > 0.0]
    said = [f"{name} {row['median']:.2g} % (worst {row['worst']:.2g} %)" for name, row in rows.iterrows()]
    return f"Median error of the {first}, against exact contact at its finest: {', '.join(said)}."


def _creep(read):
    laws = read("creep/creep_laws.csv")
    rows = laws[(laws["cases"] == "ellipse") & (laws["against"] == "CONTACT")]
    best = rows.sort_values("force_q95").groupby("family", sort=False).first()
    said = [
        f"{name} {_percent(best.loc[family, 'force_q95'])} in {best.loc[family, 'us_per_case']:.3g} µs"
        for family, name in (("table ellipse", "a table"), ("fastsim", "FASTSIM"), ("polach", "Polach's formula"),
                             ("exact", "the exact solver"))
        if family in best.index
    ]  # fmt: skip
    return f"95 % of CONTACT's elliptic cases are met within these parts of the friction limit: {', '.join(said)}."


def _speeds(read):
    table = read("speeds/vehicle_timing.csv")
    said = [
        f"{vehicle} {rows['real_time_factor'].min():.0f} to {rows['real_time_factor'].max():.0f}"
        for vehicle, rows in table.groupby("vehicle", sort=False)
    ]
    lower = table.loc[table["detection"] == "spatial", "planar_over_this_per_call"]
    return (
        f"Runs over speed take place this many times faster than real time: {', '.join(said)}; a right-hand side with "
        f"planar detection costs {lower.min():.2f} to {lower.max():.2f} times one with spatial detection."
    )


def _critical(read):
    table = read("critical_speed/critical_speeds.csv")
    said = []
    for row in table[table["detection"] == "spatial"].itertuples():
        cycle = row.nonlinear_critical_speed_m_per_s
        from_cycle = f", limit cycles from {cycle:.1f} m/s on" if np.isfinite(cycle) else ""
        said.append(f"{row.vehicle}: linear {row.linear_critical_speed_m_per_s:.1f} m/s{from_cycle}")
    return f"Critical speeds, spatial detection: {'; '.join(said)}. In between the disturbance decides."


def _accuracy(read):
    table = read("accuracy/choose_for_accuracy.csv")
    asked = min(table["accuracy_m"].unique(), key=lambda accuracy: abs(np.log(accuracy / ACCURACY)))
    some = table[np.isclose(table["accuracy_m"], asked)]
    said = [f"{row.scene} {row.real_time_factor:.0f} ({row.method})" for row in some.itertuples()]
    return (
        f"The fastest choice whose integration errs by at most {1e6 * asked:.3g} µm runs this "
        f"many times faster than real time: {', '.join(said)}."
    )


def _cost(read):
    table = read("cost/cost_breakdown.csv")
    said = [
        f"{row.scene} {row.ns:.0f} ns ({row.times_least:.1f} times the machine's least)"
        for row in table[table["stage"] == "whole"].itertuples()
    ]
    return f"One evaluation of the equations of motion takes: {', '.join(said)}."


def _hard_cases(read):
    table = read("hard_cases/summary.csv")
    whole = table[["runs", "survived", "refused", "failed", "checks", "passed", "known"]].sum()
    open_ones = whole["checks"] - whole["passed"] - whole["known"]
    return (
        f"Of {whole['runs']:.0f} runs at the edges {whole['survived']:.0f} reach their end, {whole['refused']:.0f} are "
        f"refused with a reason and {whole['failed']:.0f} fail; of {whole['checks']:.0f} checks {whole['passed']:.0f} "
        f"pass, {whole['known']:.0f} miss their limit for a known reason of the model and {open_ones:.0f} without one."
    )


def _ivp(read):
    table = read("ivp/ivp_work_precision.csv")
    ours = table[(table["method"] == "rk45") & (table["status"] == "completed")]
    best = ours.loc[ours["error_x_m"].idxmin()]
    return (
        f"On the Test Set's wheelset our Dormand-Prince pair ends within {1e6 * best['error_x_m']:.2g} µm of the "
        f"reference after {best['evaluations']:.0f} evaluations, {best['seconds']:.2g} s."
    )


def _sweeps(read):
    said = []
    for name, table in read("sweeps/*.csv").items():
        ends = ", ".join(f"{count} {status}" for status, count in table["status"].value_counts().items())
        said.append(f"{name}: {len(table)} runs, {ends}")
    return f"Runs by their end: {'; '.join(said)}."


def _wear(read):
    table, influences = read("wear/evolution.csv"), read("wear/influences.csv").set_index("variant")
    last = table.iloc[-1]
    return (
        f"After {1e-3 * last['distance_m']:.0f} km the deepest place of the wheel has lost {1e3 * last['worn_m']:.2f} "
        f"mm and the conicity at 3 mm went from {table['equivalent_conicity'].iloc[0]:.3f} to "
        f"{last['equivalent_conicity']:.3f}; the settings' influence on the depth is "
        f"{_percent(influences.loc['default', 'depth_deviation'])}."
    )


def _crossings(read):
    table = read("crossings/models.csv")
    said = [
        f"{row.model} errs by {1e6 * row.height_largest_m:.2g} µm in height and {_percent(row.p_max_worst)} in "
        f"greatest pressure at worst, and takes {row.cpu_s / table.cpu_s.iloc[0]:.2g} of its time"
        for row in table.iloc[1:].itertuples()
    ]
    return f"On the nose of a crossing, against {table.model.iloc[0]}: {'; '.join(said)}."


ANSWERS = {
    "01 The paper's values and ours": _paper_values,
    "02 The paper's figures": _paper_figures,
    "03 Contact geometry": _contact,
    "04 The real patch": _patch,
    "05 Creep forces": _creep,
    "06 Wheelset and trailer vehicle": _speeds,
    "07 Hunting: critical speeds": _critical,
    "08 Speed against error": _accuracy,
    "09 Cost": _cost,
    "10 Hard cases": _hard_cases,
    "11 Benchmark of integrators": _ivp,
    "12 Sweeps": _sweeps,
    "13 Wear": _wear,
    "14 Crossings": _crossings,
}
"""Function of the answer for each category of the results, in reading order."""
