"""Tables of vehicles over speed: a row for each run, and the cost of the runs."""

import numpy as np
import pandas as pd

from wrcore.analysis.assessment.wheels import wheel_table, wheelsets_of
from wrcore.analysis.motion import hunting
from wrcore.run.motion import amplitude

OF_WHOLE_RUNS = {"speed_m_per_s", "status", "simulated_s", "frequency_Hz", "growth_per_s", "damping_ratio"}
"""Columns that are also determined for runs that ended early."""


def speed_row(run, begin=0.5, body="car_body"):
    """Return the row of one run in the table of a sweep over speeds.

    Forces, amplitude and accelerations are from the part of the run after ``begin`` (fraction of its duration), hunting
    of the leading wheelset from the whole run. Accelerations are NaN if the vehicle has no such body. If the run ended
    early (``status``), only the columns `OF_WHOLE_RUNS` are not NaN.
    """
    leading, whole = wheelsets_of(run)[0], run.status == "completed"
    start = begin * run.scene["integration"]["duration"] if whole else 0.0
    late = run.t >= start
    y = run[leading].y_m
    frequency, growth, damping = hunting(run.t, y)
    wheels = wheel_table(run, start)
    row = {
        "speed_m_per_s": run.scene["speed"],
        "status": run.status,
        "simulated_s": float(run.t[-1]),
        "amplitude_m": amplitude(y[late]),
        "frequency_Hz": frequency,
        "growth_per_s": growth,
        "damping_ratio": damping,
        "Q_min_N": wheels["Q_min_N"].min(),
        "Q_max_N": wheels["Q_max_N"].max(),
        "Y_max_N": wheels["Y_max_N"].max(),
        "Y_over_Q_max": wheels["Y_over_Q_max"].max(),
        "T_gamma_mean_N": wheels["T_gamma_mean_N"].mean(),
        "T_gamma_spin_mean_N": wheels["T_gamma_spin_mean_N"].mean(),
        "creep_power_mean_W": wheels["creep_power_mean_W"].mean(),
    }
    for axis in "yz":
        channel = run.groups.get(body, {}).get(f"a{axis}_m_per_s2")
        row[f"car_body_a{axis}_rms_m_per_s2"] = np.nan if channel is None else np.sqrt(np.mean(channel[late] ** 2))
        row[f"car_body_a{axis}_max_m_per_s2"] = np.nan if channel is None else np.max(np.abs(channel[late]))
    if not whole:
        row |= dict.fromkeys(row.keys() - OF_WHOLE_RUNS, np.nan)
    counters = {name: run.counters[name] for name in ("wall_s", "rhs_evaluations", "steps", "rejected")}
    return row | counters


def speed_table(runs):
    """Return the table of :func:`speed_row` for runs ``{(detection, track): [run, ...]}``.

    Its first columns are detection and track."""
    return pd.DataFrame(
        [
            {"detection": detection, "track": track} | speed_row(run)
            for (detection, track), group in runs.items()
            for run in group
        ]
    )


def cost_table(tables, job_seconds):
    """Return the cost of sweeps over speed (`speed_table` by vehicle), a row per vehicle, track and detection.

    Spatial is compared with planar detection. The time of each vehicle's job that is not integration is computed from
    ``job_seconds``, the time of its whole process.
    """
    rows = []
    for vehicle, table in tables.items():
        work = table["wall_s"].sum()
        for (track, detection), part in table.groupby(["track", "detection"], sort=False):
            planar = table[(table["track"] == track) & (table["detection"] == "planar")]
            calls = part["rhs_evaluations"].sum()
            us_per_call = 1e6 * part["wall_s"].sum() / calls
            rows.append(
                {
                    "vehicle": vehicle,
                    "track": track,
                    "detection": detection,
                    "runs": len(part),
                    "simulated_s": part["simulated_s"].sum(),
                    "wall_s": part["wall_s"].sum(),
                    "real_time_factor": part["simulated_s"].sum() / part["wall_s"].sum(),
                    "rhs_evaluations": calls,
                    "us_per_call": us_per_call,
                    "planar_over_this_per_call": 1e6
                    * planar["wall_s"].sum()
                    / planar["rhs_evaluations"].sum()
                    / us_per_call,
                    "job_s": job_seconds[vehicle],
                    "job_overhead": 1.0 - work / job_seconds[vehicle],
                }
            )
    return pd.DataFrame(rows)
