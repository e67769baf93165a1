"""Positions and attitudes of a wheelset from a file, for ``wrcore contact``."""

import numpy as np

from wrcore.errors import InputError
from wrcore.errors.column_files import read_table

POSE_LIMITS = {"y_m": 0.1, "yaw_rad": 0.5, "roll_rad": 0.5, "z_m": 2.0, "s_m": 1e6, "pitch_rad": 1e6}
MOTION_LIMITS = {"V_m_per_s": 200.0, "omega_rad_per_s": 4e3, "vy_m_per_s": 200.0, "yaw_rate_rad_per_s": 1e3, "mu": 2.0}
"""Columns of positions, attitudes and motion, and the maximum magnitude accepted in the unit of each."""

_NOT_NEGATIVE = ("V_m_per_s", "mu")
_WANTED = ("pose_id", "y_m", "yaw_rad")


def read_poses(path):
    """Read a CSV file of positions and attitudes of a wheelset as a table (pandas.DataFrame).

    Columns: pose_id, y_m, yaw_rad and optionally roll_rad, z_m, s_m, pitch_rad, V_m_per_s, omega_rad_per_s, vy_m_per_s,
    yaw_rate_rad_per_s, mu; NaN if not given. Each pose_id is unique. InputError names file, column, row and the
    expected value."""
    import pandas as pd

    limits = POSE_LIMITS | MOTION_LIMITS
    frame = read_table(path, "pose_id", limits)
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
    _refuse(path, frame, "pose_id", frame["pose_id"] == "", "any text")
    _refuse(path, frame, "pose_id", frame["pose_id"].duplicated(), "an id that no row before has")
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
    """Raise InputError for the first invalid row."""
    import pandas as pd

    if bad.any():
        row = int(np.argmax(bad.to_numpy()))
        given = frame[name].iloc[row]
        given = "nothing" if pd.isna(given) or given == "" else repr(str(given))
        raise InputError(path, f"{name}, row {row + 1}", f"expected {expected}, got {given}")
