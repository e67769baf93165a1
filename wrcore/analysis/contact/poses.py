"""Contact of a wheelset in given poses, at rest or rolling, by any patch model: the table of ``wrcore contact``."""

import math

import numpy as np
import pandas as pd

from wrcore.analysis.contact.loaded import SMOOTH, LoadedWheels, Rolling, carried
from wrcore.analysis.contact.on_slices import LoadedOnSlices
from wrcore.contact.changing_rails.sections import WheelOnSlices
from wrcore.contact.rigid.height_at_load import is_not_loaded
from wrcore.contact.search import reduction as columns
from wrcore.errors import InputError, check_number
from wrcore.geometry.track import SIDES
from wrcore.run.checks.validity import FLAGS, flags

ROLLING = ("xi", "eta", "phi_per_m", "Fx_N", "Fy_N", "Mz_Nm")
"""Columns of rolling, empty where the wheelset does not move."""

POSE_FLAGS = {"not_loaded": "1 where no height was found at which the wheel carries its load, else 0", **FLAGS}
"""Flags of a pose's patches, 0 or 1, and what they mean: names as of the counters of a run."""

STILL = tuple(name for name in columns.CHANNELS if name not in ROLLING)
FIELDS = ("pose_id", "side", "patch", *STILL, "p_max_Pa", "roll_rad", "z_wheelset_m",
          "x_min_m", "x_max_m", "width_m", *ROLLING, "load_residual_N", *POSE_FLAGS)  # fmt: skip


def loaded_poses(
    poses, geometry, wheel_load, patch="moment", resolution="fine", slip="surfaces", load_by="vertical", friction=0.3,
    detection="spatial", shear_modulus=8.2e10, poisson_ratio=0.28,
):  # fmt: skip
    """Patches of both wheels for every pose of a table, as from :func:`wrcore.contact.rigid.pose_file.read_poses`:
    columns
    FIELDS, a row per patch, none without contact or equilibrium; ``attrs``: patches solved ``on_grid`` instead of
    strips, and ``on_fixed_strips``, whose tips were not found; wheels ``without_height`` that no height loads.

    z given: forces at that height (roll left out: 0). Roll given, z not: each side is solved for the load by itself.
    Neither: both are solved so that each wheel carries it. In place of a ``geometry`` a `WheelOnSlices` stands for both
    sides, at the arc length ``s_m`` of each pose, rolled forward by ``pitch_rad``. With V_m_per_s above 0 the wheelset
    rolls, freely where omega_rad_per_s is not given; else it stands. ``load_by``: the load (N per wheel) is the
    ``vertical`` sum of all forces on a wheel, or that of its ``normal`` forces; ``friction`` holds where a pose has no
    ``mu``; all else as for `LoadedWheels`.
    """
    check_number(wheel_load, 1e-9, 1e6, "contact", "wheel_load", "N")
    check_number(friction, 0.0, 2.0, "contact", "friction")
    if load_by not in ("vertical", "normal"):
        raise InputError("load_by", "", f"expected vertical or normal, got {load_by!r}")
    on_slices = isinstance(geometry, WheelOnSlices)
    kind = LoadedOnSlices if on_slices else LoadedWheels
    wheels = kind(geometry, patch, resolution, slip, shear_modulus, poisson_ratio, detection)
    rows, on_grid, on_fixed, lost = [], 0, 0, 0
    for pose in poses.itertuples():
        if on_slices:
            wheels.s, wheels.turned = _given(pose, "s_m", 0.0), _given(pose, "pitch_rad", 0.0)
        y, yaw, mu = pose.y_m, pose.yaw_rad, _given(pose, "mu", friction)
        speed, rolling = _given(pose, "V_m_per_s", 0.0), None
        if speed > 0.0:
            rolling = Rolling(speed, _given(pose, "omega_rad_per_s", math.nan), _given(pose, "vy_m_per_s", 0.0),
                              _given(pose, "yaw_rate_rad_per_s", 0.0))  # fmt: skip
        how = {"rolling": rolling, "friction": max(mu, SMOOTH)}
        to_load = how | {"vertical": load_by == "vertical"}
        roll, heights = wheels.placed(SIDES, y, yaw, (pose.roll_rad, pose.z_m), wheel_load, to_load, ("contact", "z_m"))
        load = wheel_load if math.isnan(pose.z_m) else math.nan
        found = {}
        for side, z in heights.items():
            patches = [] if math.isnan(z) else wheels.at_height(side, y, z, roll, yaw, **how)
            found[side] = wheels.geometry, patches
            lost += math.isnan(z)
        residual, limits = pose_flags(wheels.contact, found, load, roll, yaw, load_by == "vertical")
        for side, (_, patches) in found.items():
            for number, one in enumerate(patches):
                on_grid, on_fixed = on_grid + one.on_grid, on_fixed + one.on_fixed
                if mu == 0.0:
                    one.row[columns.FX : columns.MZ + 1] = 0.0
                rows.append([
                    pose.pose_id, side, number + 1, *(one.row[columns.CHANNELS[name]] for name in STILL),
                    one.row[columns.P_MAX], roll, heights[side], *one.extent,
                    *(math.nan if rolling is None else one.row[columns.CHANNELS[name]] for name in ROLLING),
                    residual[side], *map(int, limits[side][number].values()),
                ])  # fmt: skip
    table = pd.DataFrame(rows, columns=list(FIELDS))
    table.attrs |= {"on_grid": on_grid, "on_fixed_strips": int(on_fixed), "without_height": lost}
    return table


def pose_flags(contact, found, load, roll, yaw, vertical=True):
    """Residual of the load (N; carried less asked, NaN without a ``load``) by side, and `POSE_FLAGS` of each patch, a
    list of dictionaries by side, of a wheelset in a pose (rad); ``found``: geometry and patches (`Found`) by side."""
    rows = np.full((1, 1, 2, columns.MAX_PATCHES, columns.PATCH_COLUMNS), np.nan)
    for side, (_, patches) in found.items():
        for number, one in enumerate(patches):
            rows[0, 0, list(SIDES).index(side), number] = one.row
    geometries = tuple(geometry for geometry, _ in found.values())
    known = flags(contact._replace(geometries=(geometries * 2)[:2]), rows, np.array([[roll]]), np.array([[yaw]]))
    residuals, limits = {}, {}
    for side, (_, patches) in found.items():
        residuals[side] = carried(patches, vertical) - load
        missed = is_not_loaded(residuals[side], load, [one.row[columns.PENETRATION] for one in patches])
        at = 0, 0, list(SIDES).index(side)
        limits[side] = [
            {"not_loaded": bool(missed)} | {k: bool(v[0, 0] if v.ndim == 2 else v[(*at, i)]) for k, v in known.items()}
            for i in range(len(patches))
        ]
    return residuals, limits


def _given(pose, name, otherwise):
    """A number of a pose, or what holds where its column is missing or empty."""
    value = getattr(pose, name, math.nan)
    return otherwise if math.isnan(value) else value
