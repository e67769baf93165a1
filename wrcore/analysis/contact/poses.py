"""Contact table of a wheelset at given positions, at rest or rolling, by any patch model, for ``wrcore contact``."""

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
"""Columns of rolling, empty if the wheelset is at rest."""

POSE_FLAGS = {"not_loaded": "1 where no height was found at which the wheel carries its load, else 0", **FLAGS}
"""Meaning of the flags of patches, 0 or 1, by name; the names are those of a run's counters."""

STILL = tuple(name for name in columns.CHANNELS if name not in ROLLING)
FIELDS = ("pose_id", "side", "patch", *STILL, "p_max_Pa", "roll_rad", "z_wheelset_m",
          "x_min_m", "x_max_m", "width_m", *ROLLING, "load_residual_N", *POSE_FLAGS)  # fmt: skip


def loaded_poses(
    poses, geometry, wheel_load, patch="moment", resolution="fine", slip="surfaces", load_by="vertical", friction=0.3,
    detection="spatial", shear_modulus=8.2e10, poisson_ratio=0.28,
):  # fmt: skip
    """Return a table of the patches of both wheels at each position of a table ``poses``.

    ``poses`` is a result of :func:`wrcore.contact.rigid.pose_file.read_poses`. The columns are FIELDS, with a row per
    patch and no row without contact or equilibrium. ``attrs`` are counts: patches solved ``on_grid`` instead of strips,
    patches ``on_fixed_strips``, whose tips were not found, and wheels ``without_height`` for the load.

    If z is given, forces are those at that height (default roll: 0). If only roll is given, each side is solved for the
    load separately. If neither is given, roll and height are those at which each wheel carries the load. A
    `WheelOnSlices` instead of a ``geometry`` applies to both sides, at the arc length ``s_m`` of each position, rolled
    forward by ``pitch_rad``. If V_m_per_s is above 0, the wheelset rolls, freely without omega_rad_per_s; else it is at
    rest. ``load_by``: the load (N per wheel) is the ``vertical`` component of all forces on a wheel, or the sum of its
    ``normal`` forces. ``friction`` applies if a position has no ``mu``. The other arguments are those of
    `LoadedWheels`.
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
    """Return the load residual by side, and `POSE_FLAGS` of each patch as a list of dictionaries by side.

    The residual (N) is carried minus required load, NaN without a ``load``. ``found`` are geometry and patches
    (`Found`) by side of a wheelset with roll and yaw (rad).
    """
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
    """Return a number of a table's row, or ``otherwise`` if its column is missing or empty."""
    value = getattr(pose, name, math.nan)
    return otherwise if math.isnan(value) else value
