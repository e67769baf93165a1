"""Contact of a wheelset at rest in given poses: the table behind ``wrcore contact``."""

import math

import numpy as np

from wrcore.contact import reduction as columns
from wrcore.contact.normal import contact_modulus, hertz_table
from wrcore.contact.statics import height_at_load, settle, wheel_at_rest
from wrcore.errors import InputError, check_number, one_of
from wrcore.errors.checked_csv import read_csv_table
from wrcore.geometry.track import SIDES

PATCH_FIELDS = {
    "u_wheel_m": columns.U_WHEEL, "s_wheel_rad": columns.S_WHEEL, "u_rail_m": columns.U_RAIL, "x_m": columns.X,
    "y_m": columns.Y, "z_m": columns.Z, "contact_angle_rad": columns.ANGLE, "penetration_m": columns.PENETRATION,
    "a_m": columns.SEMI_A, "b_m": columns.SEMI_B, "N_N": columns.NORMAL,
}  # fmt: skip
"""Columns of the result and of the patch array."""


POSE_LIMITS = {"y_m": 0.1, "yaw_rad": 0.5, "roll_rad": 0.5, "z_m": 2.0}
MOTION_LIMITS = {"V_m_per_s": 200.0, "omega_rad_per_s": 4e3, "vy_m_per_s": 200.0, "yaw_rate_rad_per_s": 1e3, "mu": 2.0}
"""Columns of poses and of their motion, and the greatest value that is taken for the unit."""

_NOT_NEGATIVE = ("V_m_per_s", "mu")
_WANTED = ("pose_id", "y_m", "yaw_rad")


def read_poses(path):
    """Read and check a CSV file of poses.

    Parameters
    ----------
    path : str or Path
        Columns pose_id, y_m, yaw_rad and optionally roll_rad, z_m, and of the motion V_m_per_s, omega_rad_per_s,
        vy_m_per_s, yaw_rate_rad_per_s, mu; an empty cell counts as not given.

    Returns
    -------
    pandas.DataFrame
        With all of these columns; NaN for what is not given.

    Raises
    ------
    InputError
        Naming the file, the column (and row) and what was expected.
    """
    import pandas as pd

    frame = read_csv_table(path, "pose_id")
    limits = POSE_LIMITS | MOTION_LIMITS
    known = ("pose_id", *limits)
    for name in _WANTED:
        if name not in frame:
            raise InputError(path, name, f"expected this column; found {', '.join(map(str, frame.columns))}")
    own = {name.split("_")[0].lower() for name in limits}
    for name in frame.columns:  # other columns are left alone, but not a pose in another unit or spelling
        if name not in known and str(name).split("_")[0].strip().lower() in own:
            raise InputError(path, name, f"unknown column; expected {', '.join(known)}")
    if frame.empty:
        raise InputError(path, "", "expected at least one pose, got none")
    for name, limit in limits.items():
        if name not in frame:
            frame[name] = np.nan
            continue
        values = pd.to_numeric(frame[name], errors="coerce")
        empty = frame[name].isna()
        bad = (values.isna() & ~empty) | (values.abs() > limit) | (empty & (name in _WANTED))
        expected = f"a number within {limit:g}"
        if name in _NOT_NEGATIVE:
            bad, expected = bad | (values < 0.0), f"0 to {limit:g}"
        _refuse(path, frame, name, bad, expected)
        frame[name] = values
    still = frame["V_m_per_s"].isna() | (frame["V_m_per_s"] == 0.0)
    moves = frame[["omega_rad_per_s", "vy_m_per_s", "yaw_rate_rad_per_s"]].fillna(0.0).ne(0.0).any(axis=1)
    _refuse(path, frame, "V_m_per_s", still & moves, "a speed above 0 where the wheelset moves")
    return frame


def _refuse(path, frame, name, bad, expected):
    """Name the first row that is bad."""
    if bad.any():
        row = int(np.argmax(bad.to_numpy()))
        raise InputError(path, f"{name}, row {row + 1}", f"expected {expected}, got {str(frame[name].iloc[row])!r}")


def solve_poses(
    poses, geometry, wheel_load, detection="spatial", reduction="moment", shear_modulus=8.2e10, poisson_ratio=0.28
):
    """Patches of both wheels for every pose, statically (damping factor 1: plain Hertz).

    Parameters
    ----------
    poses : pandas.DataFrame
        As from :func:`read_poses`. Neither roll nor z given: both are solved so that each wheel carries
        ``wheel_load`` vertically. Roll given, z not: each side is solved by itself. z given, roll not: roll is zero.
    geometry : ContactGeometry
    wheel_load : float
        Vertical load per wheel, N, above 0 and up to 1e6.
    detection : {"planar", "spatial"}
    reduction : {"maximum", "moment"}
    shear_modulus, poisson_ratio : float
        Material of both bodies, Pa and -.

    Returns
    -------
    pandas.DataFrame
        One row per patch; a wheel without contact has none. A pose without equilibrium gives no rows.

    Raises
    ------
    InputError
        For an unknown choice, or a number in another unit.
    """
    import pandas as pd

    check_number(wheel_load, 1e-9, 1e6, "contact", "wheel_load", "N")
    check_number(shear_modulus, 1e9, 1e12, "contact", "shear_modulus", "Pa")
    check_number(poisson_ratio, 0.0, 0.5, "contact", "poisson_ratio")
    hertz, modulus, spatial = hertz_table(), contact_modulus(shear_modulus, poisson_ratio), detection == "spatial"
    if detection not in ("planar", "spatial"):
        raise InputError("detection", "", f"expected planar or spatial, got {detection!r}")
    if reduction not in columns.REDUCTIONS:
        raise InputError("patch", "", one_of(columns.REDUCTIONS, reduction))
    rule = columns.REDUCTIONS[reduction]
    rows = []
    patches = np.zeros((columns.MAX_PATCHES, columns.PATCH_COLUMNS))
    nominal = geometry.rolling_radius
    for pose in poses.itertuples():
        y, yaw, roll, heights = pose.y_m, pose.yaw_rad, pose.roll_rad, {side: pose.z_m for side in SIDES}
        if math.isnan(roll) and math.isnan(pose.z_m):
            roll, z = settle(geometry, hertz, modulus, y, yaw, spatial, rule, wheel_load, nominal)
            heights = {side: z for side in SIDES}
        elif math.isnan(pose.z_m):
            heights = {
                side: height_at_load(
                    geometry, hertz, modulus, sign, y, roll, yaw, spatial, rule, wheel_load, nominal, patches
                )
                for side, sign in SIDES.items()
            }
        elif math.isnan(roll):
            roll = 0.0
        for side, sign in SIDES.items():
            z = heights[side]
            if math.isnan(z):
                continue
            count, _ = wheel_at_rest(geometry, hertz, modulus, sign, y, z, roll, yaw, spatial, rule, patches)
            for number, row in enumerate(patches[:count], start=1):
                values = {name: row[column] for name, column in PATCH_FIELDS.items()}
                p_max = 1.5 * values["N_N"] / (math.pi * values["a_m"] * values["b_m"])
                rows.append({"pose_id": pose.pose_id, "side": side, "patch": number, **values, "p_max_Pa": p_max,
                             "roll_rad": roll, "z_wheelset_m": z})  # fmt: skip
    names = ["pose_id", "side", "patch", *PATCH_FIELDS, "p_max_Pa", "roll_rad", "z_wheelset_m"]
    return pd.DataFrame(rows, columns=names)
