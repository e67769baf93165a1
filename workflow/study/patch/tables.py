"""Patch models against exact contact, pose by pose: force, pressure, place, rolling radius, creep forces.

All tables are pandas frames in SI units; a column carries its unit. The left wheel is looked at: by symmetry the right
one at y is the left one at -y.
"""

import math
from typing import NamedTuple

import numpy as np
import pandas as pd

from wrcore.analysis.contact.loaded import LoadedWheels, Rolling
from wrcore.contact.search import reduction as columns

REFERENCE = "exact, fine"
"""What the other models are judged by."""


class Carried(NamedTuple):
    """What a wheel's patches come to together."""

    normal: float
    p_max: float
    lateral: float
    """Where the normal forces' resultant lies to the left of the track's centre, m."""
    radius: float
    """Radius on which the wheel rolls: rate of rolling times it is the speed less the mean of the rigid slip, m."""
    creep: np.ndarray
    """Sum of creep forces in the track frame, N."""


def carried(found, rolling):
    """`Carried` of the patches (`Found`) of a wheel, with the `Rolling` with which they were found, its rate given."""
    rows = np.array([one.row for one in found]).reshape(-1, columns.PATCH_COLUMNS)
    normal, angle = rows[:, columns.NORMAL], rows[:, columns.ANGLE]
    total = normal.sum()
    if not total > 0.0:
        return Carried(0.0, *(math.nan,) * 3, np.full(3, math.nan))
    share, fy = normal / total, rows[:, columns.FY]
    creep = np.array([rows[:, columns.FX].sum(), fy @ np.cos(angle), fy @ np.sin(angle)])
    radius = (1.0 - share @ rows[:, columns.XI]) * rolling.speed / rolling.rate
    return Carried(total, rows[:, columns.P_MAX].max(), share @ rows[:, columns.Y], radius, creep)


def pose_errors(geometry, models, loads, shifts, rolling):
    """Each model beside the reference, pose by pose: vertical wheel loads (N) and lateral positions (m), without yaw,
    at the roll and height at which the `REFERENCE` among the models carries the load on both wheels; ``rolling`` is
    speed (m/s), friction, and pairs of creepages (longitudinal, lateral) of a wheel that otherwise rolls freely.

    The first table has, at the reference's height, normal_N and its relative error; where the model carries the load
    itself, p_max_Pa, lateral_m, radius_m and their errors (relative, m, m), and height_m of the wheelset. Radii are
    compared less those of the centred wheelset: what both wheels have in common, the rate of rolling follows.

    The second has per creepage ``used`` (the reference's creep force over mu N) and errors of the creep force over the
    reference's mu N under equal load: at equal motion of the wheelset, and at equal creepage, where each model rolls on
    its own radius.
    """
    wheels = {name: LoadedWheels(geometry, **settings) for name, settings in models.items()}
    places, forces = [], []
    for load in loads:
        roll, z = wheels[REFERENCE].settled(0.0, load)
        centred = {name: _of_model(some, (0.0, load, roll, z), rolling)[0]["radius_m"] for name, some in wheels.items()}
        for y in shifts:
            roll, z = wheels[REFERENCE].settled(y, load)
            if math.isnan(z):
                continue
            here = {"load_N": load, "y_m": y}
            found = {name: _of_model(some, (y, load, roll, z), rolling) for name, some in wheels.items()}
            sure, _, sure_forces = found[REFERENCE]
            for name, (row, on_radius, same_creepage) in found.items():
                common = centred[name] - centred[REFERENCE]
                errors = {
                    "normal_relative": row["normal_N"] / sure["normal_N"] - 1.0,
                    "p_max_relative": row["p_max_Pa"] / sure["p_max_Pa"] - 1.0,
                    "lateral_error_m": row["lateral_m"] - sure["lateral_m"],
                    "radius_error_m": row["radius_m"] - sure["radius_m"] - common,
                }
                places.append(here | {"model": name} | row | errors)
                bound = rolling["friction"] * sure["normal_N"]
                same_motion = on_radius(sure["radius_m"] + common)
                for k, force in enumerate(sure_forces):
                    facts = {"model": name, "creepage": k, "used": np.linalg.norm(force) / bound}
                    gaps = [np.linalg.norm(some[k] - force) / bound for some in (same_motion, same_creepage)]
                    forces.append(here | facts | dict(zip(("same_motion", "same_creepage"), gaps, strict=True)))
    return pd.DataFrame(places), pd.DataFrame(forces)


def _of_model(wheels, pose, rolling):
    """Row of a model, its creep forces as a function of the radius of free rolling, and those on its own radius."""
    y, load, roll, z = pose
    speed = rolling["speed"]

    def at(height, rate, vy=0.0):
        motion = Rolling(speed, rate, vy)
        return carried(wheels.at_height("left", y, height, roll, 0.0, motion, rolling["friction"]), motion)

    nominal = speed / wheels.geometry.rolling_radius
    own = wheels.height("left", y, load, roll)
    alone = at(own, nominal)
    row = {
        "normal_N": at(z, nominal).normal, "height_m": own, "p_max_Pa": alone.p_max, "lateral_m": alone.lateral,
        "radius_m": alone.radius,
    }  # fmt: skip

    def forces(radius):
        return [at(own, (1.0 - xi) * speed / radius, eta * speed).creep for xi, eta in rolling["creepages"]]

    return row, forces, forces(alone.radius)


def radius_differences(places):
    """Rolling radius difference of a wheelset, left less right, from the radii of the left wheel in `pose_errors` at
    shifts in pairs y and -y: load_N, model, y_m > 0, difference_m and slope (difference over 2 y).
    """
    keys = ["load_N", "model"]
    part = places[[*keys, "y_m", "radius_m"]].assign(y_nm=(1e9 * places["y_m"]).round())
    mirrored = part.assign(y_nm=-part["y_nm"])[[*keys, "y_nm", "radius_m"]]
    both = part[part["y_nm"] > 0.0].merge(mirrored, on=[*keys, "y_nm"], suffixes=("", "_right"))
    difference = both["radius_m"] - both["radius_m_right"]
    return both[[*keys, "y_m"]].assign(difference_m=difference, slope=difference / (2.0 * both["y_m"]))


def conicity_under_load(differences, amplitudes, points=400):
    """Equivalent conicity by harmonic linearisation: of a sine of the amplitude (m) in the radius difference
    (`radius_differences`, linear in between); NaN beyond the shifts.
    """
    sine, rows = np.sin((np.arange(points) + 0.5) * (0.5 * math.pi / points)), []
    for (load, model), part in differences.groupby(["load_N", "model"], sort=False):
        y, difference = np.append(0.0, part["y_m"]), np.append(0.0, part["difference_m"])
        for amplitude in amplitudes:
            over = np.interp(amplitude * sine, y, difference, right=math.nan)
            rows.append({"load_N": load, "model": model, "amplitude_m": amplitude,
                         "conicity": float(np.mean(over * sine) / amplitude)})  # fmt: skip
    return pd.DataFrame(rows)


QUANTITIES = {
    "normal_relative": ("normal force at equal height", 100.0, "%"),
    "p_max_relative": ("greatest pressure under equal load", 100.0, "%"),
    "lateral_error_m": ("lateral position of the resultant", 1e3, "mm"),
    "radius_error_m": ("rolling radius", 1e3, "mm"),
    "same_motion": ("creep force at equal motion", 100.0, "% of μN"),
    "same_creepage": ("creep force at equal creepage", 100.0, "% of μN"),
}
"""Columns of `pose_errors`: name, factor to the printed unit, and unit."""


def summary(places, forces, zones, costs=None):
    """Median, 95 % and worst error of each model (both tables of `pose_errors`) over all loads and shifts of a zone
    (from, to, m), and where the worst is; ``costs`` (model, us_per_patch) are joined.
    """
    rows = []
    for model in places["model"].unique():
        if model == REFERENCE:
            continue
        for zone, (low, high) in zones.items():
            for table, names in ((places, list(QUANTITIES)[:4]), (forces, list(QUANTITIES)[4:])):
                part = table[(table["model"] == model) & table["y_m"].between(low - 1e-9, high + 1e-9)]
                rows += [_spread({"model": model, "zone": zone}, part, name) for name in names if len(part)]
    table = pd.DataFrame(rows)
    return table if costs is None else table.merge(costs[["model", "us_per_patch"]], on="model", how="left")


def _spread(key, part, column):
    what, factor, unit = QUANTITIES[column]
    size = factor * part[column].abs()
    worst = part.loc[size.idxmax()]
    return key | {
        "quantity": what, "unit": unit, "count": int(size.count()), "median": size.median(),
        "q95": size.quantile(0.95), "worst": size.max(), "worst_load_N": worst["load_N"], "worst_y_m": worst["y_m"],
    }  # fmt: skip
