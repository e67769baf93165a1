"""Tables of the contact study: geometry of pairs, error of planar detection, continuity of reductions, patches.

All tables are pandas frames in SI units; a column carries its unit.
"""

import math

import numpy as np
import pandas as pd

from wrcore.analysis.contact.rigid import TOUCH
from wrcore.contact.hertz import contact_modulus, hertz_table
from wrcore.contact.rigid.height_at_load import height_at_load, settle, static_wheel_force
from wrcore.contact.rigid.wheel_on_rail import WheelsetOnTrack
from wrcore.contact.search.detection import planar_error_bound
from wrcore.contact.search.reduction import (
    ANGLE,
    MAX_PATCHES,
    MAXIMUM,
    NORMAL,
    PATCH_COLUMNS,
    REDUCTIONS,
    SEMI_A,
    U_WHEEL,
)  # fmt: skip
from wrcore.contact.search.strip import gap_at, make_pose, strip_point
from wrcore.geometry.profiles.standards import named_profile
from wrcore.kernels.jit import jit

MATERIAL = {"shear_modulus": 8.2e10, "poisson_ratio": 0.28}
"""Steel as in the reference cases of CONTACT, Pa and -."""


_DESCENT = 2e-5  # m


def study_pair(settings):
    """Return a wheelset on its track from one entry of the study's pairs.

    The entry contains names of wheel and rail, inclination (ratio), gauge, rolling_radius and half_distance (m).
    """
    wheel = named_profile(settings["wheel"], "wheel")
    rail = named_profile(settings["rail"], "rail", settings["inclination"])
    sizes = (settings["gauge"], settings["rolling_radius"], settings["half_distance"])
    return WheelsetOnTrack.alike(wheel, rail, *sizes)


def first_order_law(yaw, angle, radius=0.46):
    """Return the first-order error of planar detection in the normal penetration, m.

    It is r psi^2 tan^2(delta) cos(delta)/2 with yaw psi, contact angle delta (rad) and rolling radius r (m).
    """
    return 0.5 * radius * np.square(yaw) * np.square(np.tan(angle)) * np.cos(angle)


@jit
def _descend(geometry, pose, u):
    """Return the strip of the local minimum of the gap near strip ``u``: fixed steps, then golden section to 1e-9 m."""
    here = gap_at(geometry, pose, u)[0]
    while here > 0.5 and u < 0.0:  # outside the rail profile at the gauge face: start at the face
        u += _DESCENT
        here = gap_at(geometry, pose, u)[0]
    step = _DESCENT if gap_at(geometry, pose, u + _DESCENT)[0] < here else -_DESCENT
    for _ in range(3000):
        ahead = gap_at(geometry, pose, u + step)[0]
        if ahead >= here:
            break
        u, here = u + step, ahead
    low, high, part = u - _DESCENT, u + _DESCENT, 0.5 * (math.sqrt(5.0) - 1.0)
    while high - low > 1e-9:
        a, b = high - part * (high - low), low + part * (high - low)
        if gap_at(geometry, pose, a)[0] < gap_at(geometry, pose, b)[0]:
            high = b
        else:
            low = a
    return 0.5 * (low + high)


@jit
def _planar_errors(geometry, hertz, modulus, load, shifts, yaws, out):
    """Fill ``out`` with rows of `planar_error_map` for the left wheel without roll."""
    rows = np.empty((MAX_PATCHES, PATCH_COLUMNS))
    i = 0
    for yaw in yaws:
        for y in shifts:
            row = out[i]
            i += 1
            row[:] = np.nan
            row[0], row[1] = yaw, y
            z = height_at_load(geometry, hertz, modulus, 1.0, y, 0.0, yaw, True, MAXIMUM, load, geometry.rolling_radius,
                               rows)  # fmt: skip
            if np.isnan(z):
                continue
            count, _ = static_wheel_force(geometry, hertz, modulus, 1.0, y, z, 0.0, yaw, True, MAXIMUM, rows)
            k = np.argmax(rows[:count, NORMAL])
            ex, ey = -math.sin(yaw), math.cos(yaw)
            spatial, planar = make_pose(1.0, y, z, ex, ey, 0.0, True), make_pose(1.0, y, z, ex, ey, 0.0, False)
            at = _descend(geometry, spatial, rows[k, U_WHEEL])
            below = _descend(geometry, planar, at)
            gap, slope = gap_at(geometry, spatial, at)
            planar_gap, planar_slope = gap_at(geometry, planar, below)
            _, _, radius, _, _, along = strip_point(geometry, spatial, at)
            row[2], row[3], row[4], row[5] = rows[k, ANGLE], radius, at, below
            row[6] = -gap / math.sqrt(1.0 + slope * slope)
            row[7] = -planar_gap / math.sqrt(1.0 + planar_slope * planar_slope)
            row[8] = (planar_gap - gap) / math.sqrt(1.0 + slope * slope)
            row[9] = radius * along * spatial.q + (at - below) * ex
            row[10] = planar_error_bound(geometry, 1.0, y, z, ex, ey, 0.0)
            row[11] = rows[k, SEMI_A]


def planar_error_map(geometry, shifts, yaws, load, same_patch=2e-3):
    """Return errors of planar detection at the most loaded patch of a left wheel, over lateral shift and yaw.

    Shifts are positive to the left (m), yaw is in rad, roll is zero. At its height the wheel carries a vertical load
    (N) with spatial detection and the reduction ``maximum``.

    Columns: u_spatial_m, u_planar_m (deepest strips), spatial_m, planar_m (penetration along the normal, negative where
    planar detection finds no contact), missed_m (spatial less planar overlap along the normal), shift_m (error of the
    longitudinal position), bound_m (`planar_error_bound`), a_m (semi-axis along rolling), law_m (first-order law).
    Errors are NaN if the distance of the deepest strips exceeds ``same_patch`` (m): they belong to different patches.
    """
    modulus = contact_modulus(**MATERIAL)
    out = np.empty((len(shifts) * len(yaws), 12))
    shifts, yaws = np.asarray(shifts, dtype=float), np.asarray(yaws, dtype=float)
    _planar_errors(geometry, hertz_table(), modulus, float(load), shifts, yaws, out)
    names = ["yaw_rad", "y_m", "contact_angle_rad", "radius_m", "u_spatial_m", "u_planar_m", "spatial_m", "planar_m",
             "missed_m", "shift_m", "bound_m", "a_m"]  # fmt: skip
    table = pd.DataFrame(out, columns=names)
    other = (table.u_spatial_m - table.u_planar_m).abs() > same_patch
    other |= table.planar_m < -0.1  # past the end of the rail's profile
    table.loc[other, ["planar_m", "missed_m", "shift_m"]] = np.nan
    return table.assign(law_m=first_order_law(table.yaw_rad, table.contact_angle_rad, table.radius_m))


def over_contact_angle(table, edges, column):
    """Return the median of a column of `planar_error_map` per class of contact angle and yaw, shape (n, yaws).

    Classes have the ``edges`` (n + 1,), rad. The median is NaN where contact of this pair never has such an angle.
    """
    classes = pd.cut(table.contact_angle_rad, edges, labels=range(len(edges) - 1))
    median = table.groupby([classes, "yaw_rad"], observed=False)[column].median()
    return median.unstack("yaw_rad")


@jit
def _sweep(geometry, hertz, modulus, y, z, spatial, reduction, force):
    rows = np.empty((MAX_PATCHES, PATCH_COLUMNS))
    for i in range(y.shape[0]):
        force[i] = 0.0
        for wheel in range(2):
            side = 1.0 - 2.0 * wheel
            force[i] += static_wheel_force(geometry, hertz, modulus, side, y[i], z, 0.0, 0.0, spatial, reduction, rows)[
                1
            ]


def lateral_sweep(geometry, reach, step, load, detection="spatial"):
    """Return the vertical force of both wheels (N) over the lateral position, per reduction, at constant height.

    Each wheel carries the vertical load (N) at y = 0; roll and yaw are zero. Columns: y_m from -reach to reach (m),
    ``maximum_N`` and ``moment_N``.
    """
    hertz, modulus, spatial = hertz_table(), contact_modulus(**MATERIAL), detection == "spatial"
    count = round(reach / step)
    table = pd.DataFrame({"y_m": step * np.arange(-count, count + 1)})
    for name, reduction in REDUCTIONS.items():
        z = settle(geometry, geometry, hertz, modulus, 0.0, 0.0, spatial, reduction, load, geometry.rolling_radius)[1]
        force = np.empty(len(table))
        _sweep(geometry, hertz, modulus, table.y_m.to_numpy(), z, spatial, reduction, force)
        table[f"{name}_N"] = force
    return table


def sweep_jumps(sweep, reaches):
    """Return measures of the continuity of the force of `lateral_sweep` in each range -reach..reach (m).

    Columns: largest_step_N between neighbouring positions, its position at_m, smooth_step_N (99th percentile of the
    steps, from the smooth slope), and the ratio of both steps.
    """
    rows = []
    for reach in reaches:
        part = sweep[sweep.y_m.abs() <= reach + 1e-12]
        for name in REDUCTIONS:
            steps = np.abs(np.diff(part[f"{name}_N"]))
            smooth = np.percentile(steps, 99)
            row = {"reach_m": reach, "reduction": name, "largest_step_N": steps.max(), "smooth_step_N": smooth}
            rows.append(row | {"ratio": steps.max() / smooth, "at_m": part.y_m.iloc[int(np.argmax(steps))]})
    return pd.DataFrame(rows)


@jit
def _force_over_depth(geometry, hertz, modulus, y, yaw, heights, reduction, out):
    rows = np.empty((MAX_PATCHES, PATCH_COLUMNS))
    for i in range(heights.shape[0]):
        count, force = static_wheel_force(geometry, hertz, modulus, 1.0, y, heights[i], 0.0, yaw, True, reduction, rows)
        out[i] = np.nan
        out[i, 0], out[i, 1], out[i, 2] = heights[i], count, force
        for k in range(count):
            out[i, 3 + 2 * k], out[i, 4 + 2 * k] = rows[k, U_WHEEL], rows[k, NORMAL]


def force_over_height(geometry, y, yaw, lowering, reduction="moment"):
    """Return contact patches of the left wheel, without roll, at heights below first touch (``lowering`` (n,), m).

    Columns: lowering_m, patches (their number), vertical_N, and position u_wheel_m and normal force N_N of each patch,
    from the flange to the field side (NaN for patches that do not exist).
    """
    hertz, modulus = hertz_table(), contact_modulus(**MATERIAL)
    rows, nominal = np.empty((MAX_PATCHES, PATCH_COLUMNS)), geometry.rolling_radius
    rule = REDUCTIONS[reduction]
    top = height_at_load(geometry, hertz, modulus, 1.0, y, 0.0, yaw, True, MAXIMUM, TOUCH, nominal, rows)
    lowering = np.asarray(lowering, dtype=float)
    out = np.empty((lowering.size, 3 + 2 * MAX_PATCHES))
    _force_over_depth(geometry, hertz, modulus, y, yaw, top - lowering, rule, out)
    names = ["lowering_m", "patches", "vertical_N"]
    names += [f"{name}_{k + 1}_{unit}" for k in range(MAX_PATCHES) for name, unit in (("u_wheel", "m"), ("N", "N"))]
    return pd.DataFrame(out, columns=names).assign(lowering_m=lowering, patches=out[:, 1].astype(int))
