"""What runs say: flange contact, hunting, differences between models, how far a run can be trusted, what it cost."""

import numpy as np
import pandas as pd

from wrcore.contact.geometry import contact_geometry
from wrcore.contact.poses import geometry_table as rigid_contact
from wrcore.simulate import simulate

FLANGE_ANGLE = 0.7
"""Contact angle from which a contact counts as flange contact, rad. S1002 on UIC60 at 1:40 jumps across this value:
from the flange root to the flange, whose face stands at 1.22 rad (70 degrees)."""

SIDES = ("left", "right")


def first_flange_contact(run, body="wheelset", angle=FLANGE_ANGLE):
    """Time of the first contact on a flange.

    Parameters
    ----------
    run : Run
    body : str
        Wheelset whose contacts are searched.
    angle : float
        Contact angle from which a patch counts as flange contact, rad.

    Returns
    -------
    float
        First output time with such a patch on either side, s; NaN if there is none.
    """
    steep = [np.nanmax(np.abs(_patches(run[f"{body}/{side}"].contact_angle_rad)), axis=1) >= angle for side in SIDES]
    when = np.flatnonzero(np.logical_or(*steep))
    return float(run.t[when[0]]) if when.size else np.nan


def _patches(values):
    """Channels of shape (n, patches) with NaN for an absent patch, as numbers that never win a maximum."""
    return np.where(np.isnan(values), 0.0, values)


def zero_crossings(t, y):
    """Times at which a sampled motion passes through zero, by linear interpolation.

    Parameters
    ----------
    t, y : array_like, shape (n,)
        Times (s) and motion (any unit).

    Returns
    -------
    ndarray
        Times in order, s.
    """
    t, y = np.asarray(t), np.asarray(y)
    before = _sign_changes(y)
    return t[before] - y[before] * (t[before + 1] - t[before]) / (y[before + 1] - y[before])


def _sign_changes(y):
    """Indices of the samples just before a change of sign."""
    return np.flatnonzero((y[:-1] < 0) != (y[1:] < 0))


def hunting_frequency(t, y):
    """Frequency of a lateral motion about the track's centre, from its zero crossings.

    Parameters
    ----------
    t, y : array_like, shape (n,)
        Times (s) and lateral positions (m).

    Returns
    -------
    float
        Frequency, Hz; NaN with fewer than three crossings.
    """
    when = zero_crossings(t, y)
    return 0.5 * (when.size - 1) / (when[-1] - when[0]) if when.size > 2 else np.nan


def amplitude(y):
    """Half of the peak-to-peak value of a motion, in its unit."""
    return 0.5 * float(np.ptp(y)) if np.size(y) else np.nan


def growth_rate(t, y):
    """Exponential growth of an oscillation: slope of the logarithm of its extrema over time.

    Parameters
    ----------
    t, y : array_like, shape (n,)
        Times (s) and motion.

    Returns
    -------
    float
        Rate, 1/s, positive if the motion grows; NaN with fewer than two extrema between zero crossings.
    """
    t, y = np.asarray(t), np.asarray(y)
    edges = _sign_changes(y) + 1
    tops = [start + int(np.argmax(np.abs(y[start:end]))) for start, end in zip(edges[:-1], edges[1:], strict=True)]
    tops = [top for top in tops if y[top] != 0.0]
    if len(tops) < 2:
        return np.nan
    return float(np.polyfit(t[tops], np.log(np.abs(y[tops])), 1)[0])


def difference(run, other, channel="y_m", group="wheelset", until=np.inf):
    """Root mean square and maximum of the difference between two runs over their common output times.

    Parameters
    ----------
    run, other : Run
        Runs with the same output rate.
    channel, group : str
        What to compare; a channel of shape (n,).
    until : float
        End of the comparison, s.

    Returns
    -------
    rms, maximum : float
        In the channel's unit.

    Raises
    ------
    ValueError
        If the output times differ.
    """
    t, gap = _gap(run, other, channel, group)
    gap = gap[t <= until]
    return float(np.sqrt(np.mean(gap**2))), float(np.max(gap))


def _gap(run, other, channel, group, sign=1.0):
    n = min(run.t.size, other.t.size)
    if n == 0 or not np.allclose(run.t[:n], other.t[:n], rtol=0, atol=1e-9):
        raise ValueError("the runs have no common output times")
    return run.t[:n], np.abs(run.groups[group][channel][:n] - sign * other.groups[group][channel][:n])


def prediction_horizon(run, twin, bound, channel="y_m", group="wheelset"):
    """Time up to which a run agrees with its twin, run to a tighter tolerance, within a bound.

    Parameters
    ----------
    run, twin : Run
        Two runs of one scene with the same output rate.
    bound : float
        Largest difference that still counts as agreement, in the channel's unit.
    channel, group : str
        What to compare; a channel of shape (n,).

    Returns
    -------
    float
        Last output time before the bound is first exceeded, s; the end of the shorter run if it never is; NaN if
        they differ from the start.
    """
    t, gap = _gap(run, twin, channel, group)
    apart = np.flatnonzero(~(gap <= bound))
    if not apart.size:
        return float(t[-1])
    return float(t[apart[0] - 1]) if apart[0] else np.nan


def horizons(cases, bound):
    """Prediction horizons of the spatial runs that have a tighter twin.

    Parameters
    ----------
    cases : dict of str to dict of str to Run
        Runs by case and by ``spatial``, ``spatial_tight`` (where run) and others.
    bound : float
        Agreement in lateral position that is asked for, m.

    Returns
    -------
    dict of str to float
        Horizon by case, s.
    """
    paired = {case: runs for case, runs in cases.items() if "spatial_tight" in runs}
    return {case: prediction_horizon(runs["spatial"], runs["spatial_tight"], bound) for case, runs in paired.items()}


def mirror_defect(run, mirrored, until=np.inf, group="wheelset"):
    """Largest |y + y'| between a run and the run started on the other side of the track, m.

    Zero for a program that treats left and right alike, as long as rounding has not been amplified.
    """
    t, gap = _gap(run, mirrored, "y_m", group, sign=-1.0)
    return float(np.max(gap[t <= until]))


def motion_row(run, body="wheelset"):
    """What one run shows, as a row of a table.

    Parameters
    ----------
    run : Run
    body : str
        Wheelset to look at.

    Returns
    -------
    dict
        Columns carry their unit. Frequency, wavelength and growth are those before the first flange contact.
    """
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
        "max_normal_force_N": max(float(np.max(_patches(run[f"{body}/{side}"].N_N))) for side in SIDES),
    }


def motion_table(cases, bound):
    """One row per case and detection: how the wheelset moves, and how planar and spatial compare.

    Parameters
    ----------
    cases : dict of str to dict of str to Run
        Runs by case and by ``planar``, ``spatial`` and, where run, ``spatial_tight`` (tighter tolerances) and
        ``spatial_mirrored`` (started on the other side of the track).
    bound : float
        Agreement in lateral position that the prediction horizon asks for, m.

    Returns
    -------
    pandas.DataFrame
        Frequency and growth up to the first flange contact; the difference between planar and spatial and the mirror
        defect up to the prediction horizon (over the whole run where there is no twin).
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
    """Time planar and spatial runs of scenes, in turn.

    Parameters
    ----------
    cases : dict of str to dict of str to Scene
        Scenes by case and by ``planar`` and ``spatial``.
    repetitions : int
        Timed runs of each scene; one more before them warms up compiled kernels and caches.

    Returns
    -------
    pandas.DataFrame
        What `timing_table` takes.
    """
    rows = []
    for case, scenes in cases.items():
        for repetition in range(repetitions + 1):
            for detection, scene in scenes.items():
                run = simulate(scene)
                counters = {name: run.counters[name] for name in ("wall_s", "rhs_evaluations", "steps", "rejected")}
                row = {"case": case, "detection": detection, "repetition": repetition, "simulated_s": run.t[-1]}
                rows.append(row | counters)
    samples = pd.DataFrame(rows)
    return samples[samples["repetition"] > 0].reset_index(drop=True)


def geometry_table(scene, y):
    """Rigid contact geometry of a scene's wheelset, see :func:`wrcore.contact.poses.geometry_table`.

    Parameters
    ----------
    scene : Scene
    y : sequence of float
        Lateral positions of the wheelset, m.

    Returns
    -------
    pandas.DataFrame
    """
    vehicle = scene.vehicle
    geometry = contact_geometry(scene.wheel, scene.rail, scene.track, vehicle.rolling_radius, vehicle.half_distance)
    return rigid_contact(geometry, y, scene.detection)


def timing_table(samples):
    """Cost per run and per right-hand-side call, and planar over spatial.

    Parameters
    ----------
    samples : pandas.DataFrame
        One row per timed run: case, detection, repetition, simulated_s, wall_s, rhs_evaluations, steps, rejected.
        Planar and spatial runs of one repetition follow each other, so that a slow moment of the machine hits both.

    Returns
    -------
    pandas.DataFrame
        One row per case and detection with the median over the repetitions; the columns ``ratio_per_run`` and
        ``ratio_per_call`` hold the median of the paired ratios planar / spatial and are equal in both rows.
    """
    samples = samples.assign(us_per_call=1e6 * samples["wall_s"] / samples["rhs_evaluations"])
    columns = ["simulated_s", "wall_s", "rhs_evaluations", "steps", "rejected", "us_per_call"]
    table = samples.groupby(["case", "detection"], sort=False)[columns].median()
    table.insert(0, "runs", samples.groupby(["case", "detection"]).size())
    table["real_time_factor"] = table["simulated_s"] / table["wall_s"]
    paired = samples.pivot(index=["case", "repetition"], columns="detection", values=["wall_s", "us_per_call"])
    for name, column in (("ratio_per_run", "wall_s"), ("ratio_per_call", "us_per_call")):
        ratio = (paired[column]["planar"] / paired[column]["spatial"]).groupby("case").median()
        table[name] = ratio.reindex(table.index.get_level_values("case")).to_numpy()
    return table.reset_index()


def comparison_table(reference, ours):
    """Reference values beside ours.

    Parameters
    ----------
    reference : pandas.DataFrame
        Columns quantity, unit, value, tolerance (absolute, empty where a value is only shown), source.
    ours : dict of str to float
        Our value by quantity.

    Returns
    -------
    pandas.DataFrame
        The reference with the columns ours and within (yes, no, or empty without a tolerance or a value of ours).
    """
    table = reference.copy()
    table.insert(3, "ours", [ours.get(quantity, np.nan) for quantity in table["quantity"]])
    gap = (table["ours"] - table["value"]).abs()
    verdict = np.where(gap <= table["tolerance"], "yes", "no")
    table["within"] = np.where(gap.isna() | table["tolerance"].isna(), "", verdict)
    return table


def our_values(geometry, motion, timing, case):
    """Our side of the comparison with published values.

    Parameters
    ----------
    geometry, motion, timing : pandas.DataFrame
        Contact geometry over the lateral position, `motion_table` and `timing_table`.
    case : str
        Case that is compared: the paper's.

    Returns
    -------
    dict of str to float
        By the quantity's name in the reference table.
    """
    run = motion[(motion["case"] == case) & (motion["detection"] == "spatial")].iloc[0]
    cost = timing[timing["case"] == case].iloc[0]
    values = {
        "time planar / spatial": cost["ratio_per_run"],
        "hunting frequency": run["frequency_Hz"],
        "growth rate": run["growth_per_s"],
        "first flange contact": run["first_flange_contact_s"],
    }
    for row in geometry.itertuples():
        values[f"wheelset lowering at y = {1e3 * row.y_m:g} mm"] = row.lowering_m
        values[f"rolling radius difference at y = {1e3 * row.y_m:g} mm"] = row.radius_difference_m
    return values
