"""Patch models against CONTACT's loaded cases: normal force and greatest pressure at its height."""

import math

import pandas as pd

from wrcore.analysis.contact.loaded import LoadedWheels
from wrcore.contact.search import reduction as columns

LOAD = 1e3
"""Cases under smaller vertical loads are contacts of two points, N."""


def compare_with_contact(geometry, reference, models):
    """Each loaded case of CONTACT (in its axes) that is one patch beside every model (arguments of
    `LoadedWheels` by name) at the same height: errors of the wheel's normal force (relative),
    greatest pressure (relative), length along and width across of the nearest patch (m).
    """
    wheels = {name: LoadedWheels(geometry, **settings) for name, settings in models.items()}
    rows = []
    for case in reference[(reference["Fz_wheel_N"] > LOAD) & (reference["n_patches"] == 1)].itertuples():
        roll, yaw = angles_of_contact(case.roll_rad, -case.yaw_rad)
        pose = -1e-3 * case.y_ws_mm, geometry.rolling_radius - 1e-3 * case.z_ws_mm, roll, yaw
        key = {"set": case.set, "side": case.side, "y_m": pose[0], "yaw_rad": yaw}
        for name, some in wheels.items():
            found = some.at_height(case.side, *pose)
            near = min(found, key=lambda one: abs(one.row[columns.Y] + 1e-3 * case.y_tr_pc_mm))
            rows.append(key | {
                "model": name,
                "normal_relative": sum(one.row[columns.NORMAL] for one in found) / case.Fn_N - 1.0,
                "p_max_relative": max(one.row[columns.P_MAX] for one in found) / (1e6 * case.pmax_MPa) - 1.0,
                "length_m": near.extent[1] - near.extent[0] - 1e-3 * (case.x_max_mm - case.x_min_mm),
                "width_m": near.extent[2] - 1e-3 * (case.s_max_mm - case.s_min_mm),
            })  # fmt: skip
    return pd.DataFrame(rows)


def angles_of_contact(roll, yaw):
    """Roll and yaw (rad; roll first, then yaw about the vertical) of CONTACT's axle: yaw first, then roll about x."""
    across, up = math.cos(yaw) * math.cos(roll), math.cos(yaw) * math.sin(roll)
    return math.asin(up), math.atan2(math.sin(yaw), across)


QUANTITIES = {
    "normal_relative": ("normal force at CONTACT's height", 100.0, "%"),
    "p_max_relative": ("greatest pressure at CONTACT's height", 100.0, "%"),
    "length_m": ("length along rolling", 1e3, "mm"),
    "width_m": ("width across", 1e3, "mm"),
}
"""Columns of `compare_with_contact`: name, factor to the printed unit, and unit."""


def distributions(cases):
    """Median, 95 % and worst amount of the errors of `compare_with_contact` by set and model, and the worst case."""
    rows = []
    for (name, model), part in cases.groupby(["set", "model"], sort=False):
        for column, (what, factor, unit) in QUANTITIES.items():
            size = factor * part[column].abs()
            worst = part.loc[size.idxmax()]
            rows.append({
                "set": name, "model": model, "quantity": what, "unit": unit, "cases": len(part),
                "median": size.median(), "q95": size.quantile(0.95), "worst": size.max(), "worst_side": worst["side"],
                "worst_y_m": worst["y_m"], "worst_yaw_rad": worst["yaw_rad"],
            })  # fmt: skip
    return pd.DataFrame(rows)
