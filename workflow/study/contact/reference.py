"""Errors of the reductions relative to CONTACT: position, height, normal force, contact angle, maximum pressure."""

import math

import numpy as np
import pandas as pd
from scipy.optimize import brentq

from study.contact.tables import MATERIAL
from wrcore.contact.hertz import contact_modulus, hertz_table
from wrcore.contact.rigid.height_at_load import height_at_load, static_wheel_force
from wrcore.contact.search.reduction import (
    ANGLE,
    MAX_PATCHES,
    NORMAL,
    PATCH_COLUMNS,
    PENETRATION,
    REDUCTIONS,
    SEMI_A,
    SEMI_B,
    X,
    Y,
)  # fmt: skip
from wrcore.geometry.track import SIDES

ERRORS = {
    "lateral_m": "lateral offset from the pressure centroid",
    "longitudinal_m": "longitudinal offset from the pressure centroid",
    "height_equal_normal_m": "height of the wheelset at equal normal force",
    "height_equal_load_m": "height of the wheelset at equal vertical load",
    "normal_relative": "normal force at equal vertical load",
    "angle_rad": "contact angle",
    "p_max_relative": "greatest pressure",
    "approach_m": "approach",
}
"""Columns of `compare_with_contact` that are errors, value of wrcore less value of CONTACT, with their meaning."""


def compare_with_contact(geometry, reference, reductions=tuple(REDUCTIONS), detection="spatial"):
    """Return errors of wrcore relative to CONTACT, a row per case and reduction.

    Columns include patches (number of patches of wrcore), the columns of `ERRORS`, ``inside`` (all contact points of
    wrcore lie laterally within CONTACT's patch) and ``combined`` (CONTACT's single patch covers several patches of
    wrcore, with a gap between them).

    Cases are in CONTACT's axes (y right, z down). With several patches the position is that of their resultant; angle
    and approach are those of the most loaded patch, and p_max is the maximum.

    CONTACT's vertical force includes friction (mu = 0.3, the wheel rolls with creepage); wrcore's wheel at rest has no
    friction. On the flange the normal forces at equal vertical load therefore differ by up to a half. Only
    ``height_equal_load_m`` and ``normal_relative`` are taken at equal vertical load, the others at equal normal force.
    """
    rows = [
        _compare_case(geometry, case, reduction, detection == "spatial")
        for case in reference.itertuples()
        for reduction in reductions
    ]
    return pd.DataFrame(rows)


def _compare_case(geometry, case, reduction, spatial):
    """Return one row of `compare_with_contact`; quantities of the patch are taken at equal normal force."""
    patches = np.zeros((MAX_PATCHES, PATCH_COLUMNS))
    wheel = (geometry, hertz_table(), contact_modulus(**MATERIAL), SIDES[case.side], -1e-3 * case.y_ws_mm)
    pose, rule = (case.roll_rad, -case.yaw_rad, spatial, REDUCTIONS[reduction]), geometry.rolling_radius
    z = height_at_load(*wheel, *pose, case.Fz_wheel_N, rule, patches)

    def excess(height):
        return _forces(wheel, pose, height, patches).sum() - case.Fn_N

    z_normal = brentq(excess, z - 1e-3, z + 1e-3, xtol=1e-12)
    normal = _forces(wheel, pose, z, patches).sum()
    count = _forces(wheel, pose, z_normal, patches).size
    found = patches[:count]
    weights = found[:, NORMAL] / found[:, NORMAL].sum()
    first = found[np.argmax(weights)]
    pressure = 1.5 * found[:, NORMAL] / (math.pi * found[:, SEMI_A] * found[:, SEMI_B])
    across = (-1e3 * found[:, Y] - case.y_tr_mm) / math.cos(case.delta_rad)
    inside = bool(np.all((across >= case.s_min_mm) & (across <= case.s_max_mm)))
    height = rule - 1e-3 * case.z_ws_mm
    return {
        "set": case.set, "side": case.side, "y_m": -1e-3 * case.y_ws_mm, "yaw_rad": -case.yaw_rad,
        "reduction": reduction, "patches": count, "inside": inside, "combined": inside and count > 1,
        "contact_angle_rad": case.delta_rad, "contact_x_m": 1e-3 * case.x_tr_pc_mm,
        "lateral_m": weights @ found[:, Y] + 1e-3 * case.y_tr_pc_mm,
        "longitudinal_m": weights @ found[:, X] - 1e-3 * case.x_tr_pc_mm,
        "height_equal_normal_m": z_normal - height, "height_equal_load_m": z - height,
        "normal_relative": normal / case.Fn_N - 1.0, "angle_rad": first[ANGLE] - case.delta_rad,
        "p_max_relative": pressure.max() / (1e6 * case.pmax_MPa) - 1.0,
        "approach_m": first[PENETRATION] - 1e-3 * case.approach_mm,
    }  # fmt: skip


def _forces(wheel, pose, z, patches):
    """Return the normal forces (N) of a wheel at height ``z`` (m); fill ``patches``."""
    count, _ = static_wheel_force(*wheel, z, *pose, patches)
    return patches[:count, NORMAL]


def summarise(comparison):
    """Return mean, 90 % quantile and maximum of the absolute errors of `compare_with_contact` per set and reduction.

    Columns ``inside`` and ``combined`` count the cases with these properties.
    """
    rows = []
    for (name, reduction), part in comparison.groupby(["set", "reduction"], sort=False):
        counts = {"cases": len(part), "inside": int(part.inside.sum()), "combined": int(part.combined.sum())}
        for column, meaning in ERRORS.items():
            error = part[column].abs()
            values = {"mean": error.mean(), "q90": error.quantile(0.9), "max": error.max()}
            rows.append({"set": name, "reduction": reduction, **counts, "column": column, "quantity": meaning} | values)
    return pd.DataFrame(rows)
