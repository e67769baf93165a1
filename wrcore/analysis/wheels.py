"""What a vehicle's runs say: wheel loads, guiding forces, wear, ride and hunting, per wheel and over speed.

Definitions. Q: vertical force of a wheel on its rail, positive downwards. Y: its lateral force on the rail in the plane
of the track, positive to the field side (a flange pushes with positive Y). Y/Q: their quotient wheel by wheel. Wear
number T gamma: sum over the patches of |Fx xi| + |Fy eta|, the creep work per metre run without spin (N).
"""

import numpy as np
import pandas as pd

from wrcore.analysis import SIDES, amplitude, growth_rate, hunting_frequency

OUTWARDS = {"left": 1.0, "right": -1.0}

UNLOADED = 1e3
"""Below this Q counts as no contact and Y/Q is left out, N."""

SMALLEST = 1e-6
"""Motions below this are not asked for a frequency or a damping, m."""


def wheelsets_of(run):
    """Names of a run's wheelsets, in the order of their groups."""
    return [name for name in run.groups if f"{name}/left" in run.groups]


def wheel_forces(run, wheelset, side):
    """Forces of a wheel on its rail.

    Parameters
    ----------
    run : Run
    wheelset : str
    side : {"left", "right"}

    Returns
    -------
    Q, Y : numpy.ndarray, shape (n,)
        Vertical (downwards) and lateral (to the field side) force, N.
    """
    contact = run[f"{wheelset}/{side}"]
    cosine, sine = np.cos(contact.contact_angle_rad), np.sin(contact.contact_angle_rad)
    vertical = np.nansum(contact.N_N * cosine + contact.Fy_N * sine, axis=1)
    lateral = np.nansum(contact.Fy_N * cosine - contact.N_N * sine, axis=1)
    return vertical, -OUTWARDS[side] * lateral


def wear_number(run, wheelset, side):
    """Wear number T gamma of a wheel over time, N, shape (n,)."""
    contact = run[f"{wheelset}/{side}"]
    return np.nansum(np.abs(contact.Fx_N * contact.xi) + np.abs(contact.Fy_N * contact.eta), axis=1)


def quotient(vertical, lateral):
    """Y/Q; NaN where the wheel is as good as unloaded."""
    return np.divide(lateral, vertical, out=np.full(np.shape(vertical), np.nan), where=np.asarray(vertical) > UNLOADED)


def wheel_table(run, begin=0.0):
    """Loads, guiding forces and wear of each wheel.

    Parameters
    ----------
    run : Run
    begin : float
        Start of the evaluation, s.

    Returns
    -------
    pandas.DataFrame
        A row per wheel: wheelset, side, mean, least and largest Q, largest |Y| (N), largest |Y/Q| and mean wear number
        (N).
    """
    late = run.t >= begin
    rows = []
    for wheelset in wheelsets_of(run):
        for side in SIDES:
            vertical, lateral = (force[late] for force in wheel_forces(run, wheelset, side))
            ratio = np.abs(quotient(vertical, lateral))
            rows.append(
                {
                    "wheelset": wheelset,
                    "side": side,
                    "Q_mean_N": np.mean(vertical),
                    "Q_min_N": np.min(vertical),
                    "Q_max_N": np.max(vertical),
                    "Y_max_N": np.max(np.abs(lateral)),
                    "Y_over_Q_max": np.nan if np.all(np.isnan(ratio)) else np.nanmax(ratio),
                    "wear_number_mean_N": np.mean(wear_number(run, wheelset, side)[late]),
                }
            )
    return pd.DataFrame(rows)


def hunting(t, y):
    """Frequency (Hz), growth (1/s) and damping ratio of a decaying, steady or growing lateral motion.

    Parameters
    ----------
    t, y : numpy.ndarray, shape (n,)
        Times (s) and lateral positions (m) from release on.

    Returns
    -------
    frequency, growth, damping_ratio : float
        NaN once the motion has died before it has swung.
    """
    swinging = np.flatnonzero(np.abs(y) > SMALLEST)
    end = swinging[-1] + 1 if swinging.size else 0
    frequency, growth = hunting_frequency(t[:end], y[:end]), growth_rate(t[:end], y[:end])
    return frequency, growth, -growth / np.hypot(growth, 2.0 * np.pi * frequency)


def speed_row(run, begin=0.5, body="car_body"):
    """What one run of a sweep over speeds shows.

    Parameters
    ----------
    run : Run
        Output channels pose, contact and, for accelerations, acceleration.
    begin : float
        Part of the run after which forces, amplitude and ride count.
    body : str
        Body whose accelerations are given; left out where the vehicle has none of this name.

    Returns
    -------
    dict
        Columns carry their unit. Hunting is that of the leading wheelset over the whole run.
    """
    leading = wheelsets_of(run)[0]
    start = begin * run.scene["integration"]["duration"]
    late = run.t >= min(start, run.t[-1])
    y = run[leading].y_m
    frequency, growth, damping = hunting(run.t, y)
    wheels = wheel_table(run, min(start, run.t[-1]))
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
        "wear_number_mean_N": wheels["wear_number_mean_N"].mean(),
    }
    for axis in "yz":
        channel = run.groups.get(body, {}).get(f"a{axis}_m_per_s2")
        row[f"car_body_a{axis}_rms_m_per_s2"] = np.nan if channel is None else np.sqrt(np.mean(channel[late] ** 2))
        row[f"car_body_a{axis}_max_m_per_s2"] = np.nan if channel is None else np.max(np.abs(channel[late]))
    counters = {name: run.counters[name] for name in ("wall_s", "rhs_evaluations", "steps", "rejected")}
    return row | counters


def speed_table(runs):
    """Rows of :func:`speed_row` for runs given as ``{(detection, track): [run, ...]}``, detection and track in front.

    Returns
    -------
    pandas.DataFrame
    """
    return pd.DataFrame(
        [
            {"detection": detection, "track": track} | speed_row(run)
            for (detection, track), group in runs.items()
            for run in group
        ]
    )


def cost_table(tables, job_seconds):
    """Cost of sweeps over speed, planar against spatial, and what of each job is not integration.

    Parameters
    ----------
    tables : dict of str to pandas.DataFrame
        By vehicle, from :func:`speed_table`.
    job_seconds : dict of str to float
        Each vehicle's whole job, from the start of its process to its end, s.

    Returns
    -------
    pandas.DataFrame
        A row per vehicle, track and detection.
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
