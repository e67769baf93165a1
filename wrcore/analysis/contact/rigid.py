"""Rigid contact geometry of pairs of profiles over lateral position and yaw."""

import numpy as np
import pandas as pd

from wrcore.analysis.contact.poses import loaded_poses
from wrcore.contact.rigid.conicity import conicity_curve
from wrcore.contact.rigid.first_touch import first_touch
from wrcore.contact.search.strip import cubic_at
from wrcore.geometry.track import SIDES

TOUCH = 1e-3
"""Wheel load that defines first touch, N; the penetration is below 1 nm."""


def touch_table(pairs, shifts):
    """Return the rigid first touch of several pairs at lateral shifts (n,), m, with roll, without yaw.

    Columns: ``pair`` and the columns of :func:`wrcore.contact.rigid.first_touch.first_touch`.
    """
    tables = {label: first_touch(pair, shifts) for label, pair in pairs.items()}
    return pd.concat(tables, names=["pair"]).reset_index(level="pair").reset_index(drop=True)


def conicity_table(pairs, amplitudes):
    """Return equivalent conicity of several pairs over amplitudes (n,), m, with roll and without (EN 15302)."""
    rows = []
    for label, pair in pairs.items():
        curves = [conicity_curve(pair, amplitudes, roll).equivalent_conicity for roll in (True, False)]
        columns = {"pair": label, "amplitude_m": amplitudes}
        rows.append(pd.DataFrame(columns | {"conicity_with_roll": curves[0], "conicity_without_roll": curves[1]}))
    return pd.concat(rows, ignore_index=True)


def location_with_yaw(geometry, shifts, yaws, detection="spatial"):
    """Return contact positions of an unloaded wheelset at all combinations of lateral shifts (m) and yaw angles (rad).

    The wheelset rolls until both wheels touch. Columns: roll, and position, contact angle and rolling radius at each
    wheel's most loaded patch.
    """
    yaw, y = (grid.ravel() for grid in np.meshgrid(yaws, shifts, indexing="ij"))
    poses = pd.DataFrame({"pose_id": np.arange(y.size), "y_m": y, "yaw_rad": yaw, "roll_rad": np.nan, "z_m": np.nan})
    patches = loaded_poses(poses, geometry, TOUCH, "maximum", detection=detection)
    patches = patches.sort_values("N_N").groupby(["pose_id", "side"], sort=True).last().reset_index()
    table = poses[["pose_id", "yaw_rad", "y_m"]].merge(patches, on="pose_id", suffixes=("", "_contact"))
    radius = [_radius(geometry, u) for u in table.u_wheel_m]
    columns = ["yaw_rad", "y_m", "side", "roll_rad", "u_wheel_m", "u_rail_m", "x_m", "contact_angle_rad"]
    return table[columns].assign(rolling_radius_m=radius)


def _radius(geometry, u):
    return geometry.rolling_radius + cubic_at(geometry.wheel, geometry.wheel_start, geometry.wheel_step, u)[0]


RIGID_LOAD = 1e-3
"""Wheel load at which the wheelset is regarded as rigid, N. The penetration is then below 1 nm."""


def rigid_contact(geometry, shifts, detection="planar"):
    """Return the table of rigid contact geometry of a wheelset at lateral positions (n,), m, without yaw.

    It is the basis of conicity. Columns are y_m, roll_rad, lowering_m (of the centre below the nominal radius) and
    radius_difference_m (left minus right). For each side's most loaded patch they are u_wheel, u_rail (m) and contact
    angle (rad).
    """
    poses = pd.DataFrame(
        {"pose_id": range(len(shifts)), "y_m": shifts, "yaw_rad": 0.0, "roll_rad": np.nan, "z_m": np.nan}
    )
    touching = loaded_poses(poses, geometry, RIGID_LOAD, "maximum", detection=detection)
    patches = touching.sort_values("N_N").groupby(["pose_id", "side"]).last()
    table = pd.DataFrame({"y_m": shifts})
    for side in SIDES:
        rows = patches.xs(side, level="side").reindex(range(len(shifts)))
        for name in ("u_wheel_m", "u_rail_m", "contact_angle_rad"):
            table[f"{side}_{name}"] = rows[name].to_numpy()
    table.insert(1, "roll_rad", rows["roll_rad"].to_numpy())
    table.insert(2, "lowering_m", geometry.rolling_radius - rows["z_wheelset_m"].to_numpy())
    left, right = (
        np.array(
            [
                cubic_at(geometry.wheel, geometry.wheel_start, geometry.wheel_step, u)[0]
                for u in table[f"{side}_u_wheel_m"]
            ]
        )
        for side in SIDES
    )
    table.insert(3, "radius_difference_m", left - right)
    return table
