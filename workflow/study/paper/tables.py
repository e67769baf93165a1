"""The paper's tables: motion, timing, rigid contact geometry, and comparison with published values."""

import numpy as np
import pandas as pd

from wrcore.analysis.contact.rigid import rigid_contact
from wrcore.analysis.motion import difference, first_flange_contact, horizons, mirror_defect, zero_where_absent
from wrcore.geometry.track import SIDES
from wrcore.run.motion import amplitude, growth_rate, hunting_frequency
from wrcore.run.simulate import simulate


def motion_row(run, body="wheelset"):
    """Return the row of a run in the table of motion.

    Frequency, wavelength and growth are determined before the first flange contact."""
    flange = first_flange_contact(run, body)
    early = run.t <= (np.inf if np.isnan(flange) else flange)
    y = run[body].y_m
    frequency = hunting_frequency(run.t[early], y[early])
    return {
        "status": run.status,
        "simulated_s": float(run.t[-1]),
        "first_flange_contact_s": flange,
        "frequency_Hz": frequency,
        "wavelength_m": run.scene["speed"] / frequency,
        "growth_per_s": growth_rate(run.t[early], y[early]),
        "amplitude_second_half_m": amplitude(y[run.t >= 0.5 * run.t[-1]]),
        "max_normal_force_N": max(float(np.max(zero_where_absent(run[f"{body}/{side}"].N_N))) for side in SIDES),
    }


def motion_table(cases, bound):
    """Return the table of motion and of the difference between planar and spatial, one row per case and detection.

    Runs are ``planar``, ``spatial`` and optionally ``spatial_tight`` (tighter tolerances) and ``spatial_mirrored``
    (started on the other side of the track). Frequency and growth are determined before the first flange contact. The
    difference between planar and spatial and the mirror defect are determined up to the prediction horizon for a bound
    (m), or over the whole run without a twin.
    """
    horizon = horizons(cases, bound)
    rows = []
    for case, runs in cases.items():
        until = horizon.get(case, np.inf)
        rms, largest = difference(runs["planar"], runs["spatial"], until=until)
        mirrored = runs.get("spatial_mirrored")
        comparison = {
            "prediction_horizon_s": horizon.get(case, np.nan),
            "planar_spatial_rms_m": rms,
            "planar_spatial_max_m": largest,
            "mirror_defect_m": mirror_defect(runs["spatial"], mirrored, until) if mirrored else np.nan,
        }
        for detection in ("planar", "spatial"):
            rows.append({"case": case, "detection": detection} | motion_row(runs[detection]) | comparison)
    return pd.DataFrame(rows)


def time_runs(cases, repetitions):
    """Measure the time of runs with ``planar`` and ``spatial`` detection in pairs; return samples for `timing_table`.

    ``cases`` maps a case to a function of the detection and the repetition (from 1) that returns the scene. Each
    repetition may start from another state, so that the scatter contains that of the motion. The first run of a pair
    alternates. One pair before the first repetition loads compiled kernels and caches and is not recorded.
    """
    rows = []
    for case, scene_of in cases.items():
        for repetition in range(repetitions + 1):
            order = ("planar", "spatial") if repetition % 2 else ("spatial", "planar")
            for detection in order:
                run = simulate(scene_of(detection, max(repetition, 1)))
                counters = {name: run.counters[name] for name in ("wall_s", "rhs_evaluations", "steps", "rejected")}
                row = {"case": case, "detection": detection, "repetition": repetition, "simulated_s": run.t[-1]}
                rows.append(row | counters)
    samples = pd.DataFrame(rows)
    return samples[samples["repetition"] > 0].reset_index(drop=True)


def geometry_table(scene, y):
    """Return the rigid contact geometry (:func:`rigid_contact`) of a scene's wheelset at lateral positions y (m)."""
    return rigid_contact(scene.alike.geometry, y, scene.detection)


RATIOS = {"per_run": "wall_s", "per_call": "us_per_call", "of_calls": "rhs_evaluations"}
"""Ratios planar / spatial of a pair of runs: time of the run, time of one evaluation of the right-hand side, and number
of evaluations."""

SPREAD = {"": "median", "_least": "min", "_largest": "max"}
"""Endings of the columns of a ratio, and the statistic over all pairs in each column."""


def timing_table(samples):
    """Return the cost per run and per evaluation of the right-hand side: medians over the repetitions of `time_runs`.

    ``ratio_per_run``, ``ratio_per_call`` and ``ratio_of_calls`` (`RATIOS`) are medians of the paired ratios planar /
    spatial. Columns with ``_least`` and ``_largest`` are minimum and maximum of all pairs. Both rows of a case have the
    same ratios. Planar and spatial runs of one repetition follow each other, so that the machine's load affects both.
    """
    samples = samples.assign(us_per_call=1e6 * samples["wall_s"] / samples["rhs_evaluations"])
    columns = ["simulated_s", "wall_s", "rhs_evaluations", "steps", "rejected", "us_per_call"]
    table = samples.groupby(["case", "detection"], sort=False)[columns].median()
    table.insert(0, "runs", samples.groupby(["case", "detection"]).size())
    table["real_time_factor"] = table["simulated_s"] / table["wall_s"]
    paired = samples.pivot(index=["case", "repetition"], columns="detection", values=list(RATIOS.values()))
    for name, column in RATIOS.items():
        ratio = (paired[column]["planar"] / paired[column]["spatial"]).groupby("case")
        for end, statistic in SPREAD.items():
            found = ratio.agg(statistic).reindex(table.index.get_level_values("case"))
            table[f"ratio_{name}{end}"] = found.to_numpy()
    return table.reset_index()


def comparison_table(reference, ours):
    """Return a table that compares reference values with the values of this study.

    ``reference`` has the columns quantity, unit, value, tolerance (absolute; empty for values without a check) and
    source. ``ours`` contains, by quantity, a number or median, minimum and maximum. Added columns are ours, ours_least
    and ours_largest (of repeated measurements) and within (yes, no, or empty without a tolerance or a value).
    """
    table = reference.copy()
    found = [np.atleast_1d(ours.get(quantity, np.nan)) for quantity in table["quantity"]]
    for place, name in enumerate(("ours", "ours_least", "ours_largest")):
        table.insert(3 + place, name, [values[place] if place < len(values) else np.nan for values in found])
    gap = (table["ours"] - table["value"]).abs()
    verdict = np.where(gap <= table["tolerance"], "yes", "no")
    table["within"] = np.where(gap.isna() | table["tolerance"].isna(), "", verdict)
    return table


TIMED = {
    "time planar / spatial": "per_run",
    "time of an evaluation planar / spatial": "per_call",
    "evaluations planar / spatial": "of_calls",
}
"""Quantities of the reference table that are ratios of timed pairs (`RATIOS`)."""


def our_values(geometry, motion, timing, case):
    """Return the study's values for the comparison with published values, by the quantity's name in that table.

    They are values of the paper's case from contact geometry over the lateral position, `motion_table` and
    `timing_table`. Ratios of timed pairs have median, minimum and maximum.
    """
    run = motion[(motion["case"] == case) & (motion["detection"] == "spatial")].iloc[0]
    cost = timing[timing["case"] == case].iloc[0]
    values = {
        **{quantity: [cost[f"ratio_{name}{end}"] for end in SPREAD] for quantity, name in TIMED.items()},
        "hunting frequency": run["frequency_Hz"],
        "growth rate": run["growth_per_s"],
        "first flange contact": run["first_flange_contact_s"],
    }
    for row in geometry.itertuples():
        values[f"wheelset lowering at y = {1e3 * row.y_m:g} mm"] = row.lowering_m
        values[f"rolling radius difference at y = {1e3 * row.y_m:g} mm"] = row.radius_difference_m
    return values
