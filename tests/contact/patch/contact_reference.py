"""Reference cases of CONTACT (module 1) in the package's axes and units, and what a solver misses of them.

The files count x forward, y right, z down; forces act on the rail, creepages are rail minus wheel. With
(x, y, z) -> (x, -y, -z) and the bodies exchanged, longitudinal quantities of the contact plane change their signs, the
lateral ones and those about the normal keep theirs. ``mbench_contact.csv`` is part of the tests, the other files belong
to others and may be absent.

A solver under test is a function ``solver(case, geometry) -> Outcome``; `compare` has it solve cases, `summary`
condenses its table.
"""

import math
import os
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from wrcore.contact.rigid.wheel_on_rail import WheelOnRail
from wrcore.contact.search.strip import make_pose
from wrcore.contact.search.surfaces import Motion, contact_plane
from wrcore.geometry.profiles.files import read_profile, read_simpack
from wrcore.geometry.profiles.profile import ProfileCurve
from wrcore.geometry.profiles.standards import named_profile

SHEAR_MODULUS, POISSON_RATIO, FRICTION = 8.2e10, 0.28, 0.3
"""Of all cases: Pa, -, -."""

SETS = ("mbench_contact", "loaded_partial_slip", "one_pose_many_creepages", "separate_patches", "worn_on_uic60")
TRAVELLING = Path(__file__).parents[2] / "data" / "contact" / "mbench_contact.csv"
FILES = {"S1002": "MBench_S1002_v3.prw", "UIC60": "MBench_UIC60_v3.prr", "worn": "worn_high_mileage.prw"}
WORN_ORIGIN = 0.07
"""Tape circle of the worn wheel from its flange back, m."""

_SURFACE_LAG = -1 / 6
"""CONTACT's lateral slip with D = 3 differs from the surfaces' by this times spin and element size, as its reported
creepages (creep_s_D3 - creep_s) show; the cases were run on their coarsest grid."""

BLENDED = ("A22015", "load10kN036", "load10kN058")
"""Two lobes 4 to 8 mm apart, where CONTACT fades their coupling out: the normal force differs by 3 to 5 % for that."""


class Case(NamedTuple):
    """One contact patch that CONTACT solved; SI units, axes and signs of the package.

    The patch's own quantities refer to CONTACT's reference point: origin (x, y, z) in the track frame, x from the
    wheelset's cross-section, and the plane at ``angle``.
    """

    name: str
    subset: str
    side: str
    y: float
    z: float
    roll: float
    yaw: float
    """Pose of the wheelset (m, rad)."""
    vx: float
    vy: float
    rolling_rate: float
    """Velocity of its centre (m/s) and angular velocity about the axle (rad/s, positive forward)."""
    speed: float
    """CONTACT's reference velocity of the patch, by which creepages are divided, m/s."""
    load: float
    """Vertical, N."""
    patch: int
    patches: int
    """Number of the patch, and patches of this wheel."""
    origin: tuple
    angle: float
    xi: float
    eta: float
    phi: float
    """Creepages (-, -, 1/m)."""
    normal: float
    fx: float
    fs: float
    mn: float
    """Forces on the wheel (N) and moment about the normal (N m)."""
    surface_fx: float
    surface_fs: float
    surface_mn: float
    """The same with the rigid slip of the surfaces (D = 3); NaN where not known."""
    surface_eta: float
    """To be added to the surfaces' lateral slip before comparing with that: see `_SURFACE_LAG`."""
    curved: tuple
    """Whole force on the wheel in the track frame with contact in a curved plane (D = 4), x and y, N; NaN likewise."""
    p_max: float
    approach: float
    area: float
    extent: tuple
    """x_min, x_max, s_min, s_max, m; edges of elements."""
    centroid: tuple
    """x, s of the pressure's centroid, m."""
    dx: float
    """Element size along x of CONTACT's grid, m."""
    slip_share: float
    error: float
    """Slip area over contact area; CONTACT's own error of forces over mu N."""
    flag: str

    @property
    def sign(self):
        """+1 left, -1 right."""
        return 1.0 if self.side == "left" else -1.0

    @property
    def axle(self):
        """Direction of the wheel's axle outwards, track frame."""
        roll, yaw = self.roll, self.yaw
        axle = -math.sin(yaw) * math.cos(roll), math.cos(yaw) * math.cos(roll), math.sin(roll)
        return tuple(self.sign * c for c in axle)

    @property
    def pose(self):
        """`Pose` of the wheel at CONTACT's height."""
        return self.pose_at(self.z)

    def pose_at(self, z):
        """`Pose` of the wheel with the wheelset's centre at height z, m."""
        return make_pose(self.sign, self.y, z, *self.axle, True)

    @property
    def plane(self):
        """`ContactPlane` of CONTACT."""
        return contact_plane(*self.origin, self.angle)

    @property
    def motion(self):
        """`Motion` of the wheelset."""
        turning = (self.sign * self.rolling_rate * c for c in self.axle)
        return Motion(self.vx, self.vy, 0.0, *turning, self.speed)


class Outcome(NamedTuple):
    """What a solver found for a case, in its contact plane; NaN for what it does not give."""

    normal: float
    p_max: float
    extent: tuple = (math.nan,) * 4
    fx: float = math.nan
    fs: float = math.nan
    mn: float = math.nan
    z_equal: float = math.nan
    """Height of the wheelset at which the normal force is the case's, m."""
    track: tuple = (math.nan,) * 3
    """The force in the track frame, N."""


def reference_path(name):
    """Path of a set's file, or None; WRCORE_REFERENCE names their folder."""
    shared = Path(os.environ.get("WRCORE_SHARED", Path(__file__).parents[4] / "shared"))
    path = Path(os.environ.get("WRCORE_REFERENCE", shared / "reference")) / f"{name}.csv"
    if path.is_file():
        return path
    return TRAVELLING if name == "mbench_contact" else None


def cases(name):
    """Cases of a set of `SETS`; an empty list where its file is absent.

    Returns
    -------
    list of Case
    """
    path = reference_path(name)
    if path is None:
        return []
    table = pd.read_csv(path, comment="#")
    table["flag"] = table.get("flag", pd.Series("", index=table.index)).fillna("")
    return [_case(row, i) for i, row in enumerate(table.to_dict("records"))]


def _case(row, number):
    """A `Case` from a row of a file."""
    mm = {key[:-3]: 1e-3 * value for key, value in row.items() if key.endswith("_mm")}

    def get(key):
        return row.get(key, math.nan)

    bound, c = FRICTION * row["Fn_N"], mm.get("c", math.nan)
    area = 1e-6 * get("area_mm2") if c == c else get("n_elem") * mm.get("grid_dx", math.nan) ** 2
    z_tr = mm["z_tr_pc"] - mm["s_pc"] * math.sin(row["delta_rad"])
    forces = -get("Fx_N"), get("Fs_N"), get("Mn_Nm")
    change = -bound * get("dfx_D3"), bound * get("dfs_D3"), bound * c * get("dmz_D3")
    return Case(
        str(row.get("case_id", f"{row['set']}{number:03d}")), row["set"], row["side"],
        -mm["y_ws"], 0.46 - mm["z_ws"], *_pose_angles(row["roll_rad"], -row["yaw_rad"]),
        2.0, -1e-3 * row.get("vy_ws_mm_s", 0.0), -get("vpitch_rad_s"), 1e-3 * get("V_ref_mm_s"), row["Fz_wheel_N"],
        int(row["patch"]), int(row["n_patches"]), (mm["x_tr"], -mm["y_tr"], -z_tr), row["delta_rad"],
        -get("creep_x"), get("creep_s"), get("spin_per_m"), row["Fn_N"], *forces,
        *(f + d for f, d in zip(forces, change, strict=True)),
        _SURFACE_LAG * get("spin_per_m") * mm.get("grid_dx_coarsest", math.nan),
        (-get("Ftot_x_tr_N") - get("dFtot_x_D4_N"), get("Ftot_y_tr_N") + get("dFtot_y_D4_N")),
        1e6 * row["pmax_MPa"], mm["approach"], area,
        (mm["x_min"], mm["x_max"], -mm["s_max"], -mm["s_min"]), (mm["x_pc"], -mm["s_pc"]), mm.get("grid_dx", math.nan),
        get("n_slip_over_n"), get("err_est"), row["flag"],
    )  # fmt: skip


def _pose_angles(roll, yaw):
    """Roll and yaw of the package (roll first, then yaw about z) for CONTACT's axle: yaw first, then roll about x.

    The axle's height is sin(roll) cos(yaw) there: 2 um at a wheel for 10 mrad of roll and 24 mrad of yaw.
    """
    axle = -math.sin(yaw), math.cos(yaw) * math.cos(roll), math.cos(yaw) * math.sin(roll)
    return math.asin(axle[2]), math.atan2(-axle[0], axle[1])


def profiles(name, from_files=False):
    """Wheel and rail of a set (ProfileCurve), and rolling radius and half distance (m); None where a file is absent.

    ``from_files``: the points that CONTACT was given instead of the standards' sections, which they follow to 0.1 um.
    """
    table = reference_path(name)
    paths = {key: table and table.with_name(file) for key, file in FILES.items()}
    present = {key: path is not None and path.is_file() for key, path in paths.items()}
    if from_files and not (present["S1002"] and present["UIC60"]):
        return None
    rail = read_profile(paths["UIC60"], "rail") if from_files else named_profile("UIC60-MBench", "rail", 1 / 40)
    if name != "worn_on_uic60":
        wheel = read_profile(paths["S1002"], "wheel") if from_files else named_profile("S1002", "wheel")
        return wheel, rail, 0.46, 0.75
    if not present["worn"]:
        return None
    u, f, _ = read_simpack(paths["worn"], paths["worn"].read_text())
    u = u - WORN_ORIGIN
    wheel = ProfileCurve.from_points(u, f, "wheel", "worn_high_mileage", trim=True)
    near = np.abs(u) < 2e-3
    lowered = float(np.polynomial.Polynomial.fit(u[near], f[near], 5)(0.0))
    return wheel, rail, 0.46 - lowered, 0.6737 + WORN_ORIGIN


def geometry(name, from_files=False):
    """ContactGeometry of `profiles`; None where a file is absent."""
    pair = profiles(name, from_files)
    return pair and WheelOnRail(*pair).geometry


def height_at_normal(normal_at, case, tolerance=1e-7):
    """Height of the wheelset (m) at which a patch carries the case's normal force.

    Parameters
    ----------
    normal_at : callable
        Normal force (N) of a solver at a height (m).
    case : Case
        The search starts at its height.
    tolerance : float
        Relative, of the force.
    """
    goal = case.normal ** (2 / 3)
    z, before, slope = case.z, None, -goal / case.approach
    for _ in range(20):
        excess = normal_at(z) ** (2 / 3) - goal
        if abs(excess) < 2 / 3 * tolerance * goal:
            break
        if before is not None and z != before[0] and excess != before[1]:
            slope = (excess - before[1]) / (z - before[0])
        before, z = (z, excess), z - excess / slope
    return z


def compare(solver, cases, geometry):
    """Errors of a solver: its result less CONTACT's.

    Parameters
    ----------
    solver : callable
        ``solver(case, geometry) -> Outcome``
    cases : list of Case
    geometry : ContactGeometry

    Returns
    -------
    pandas.DataFrame
        Per case: normal and p_max (relative), x_min .. s_max (m), height (m, at equal normal force), fx, fs, force
        (norm of both) and mn over the friction bound of the case (mn over bound times c = sqrt(area/pi)), surface_fx,
        surface_fs, surface_force, surface_mn against CONTACT's D = 3, all in one plane; in the track frame curved_x,
        curved_y, curved_force, over vertical load times friction, against its D = 4, where the plane is curved. Forces
        of a solver are scaled by its own bound.
    """
    rows = []
    for case in cases:
        found = solver(case, geometry)
        bound, own = FRICTION * case.normal, FRICTION * found.normal
        row = {"name": case.name, "subset": case.subset, "side": case.side, "y": case.y, "yaw": case.yaw}
        row |= {"normal": found.normal / case.normal - 1.0, "p_max": found.p_max / case.p_max - 1.0}
        row |= dict(zip(("x_min", "x_max", "s_min", "s_max"), np.subtract(found.extent, case.extent), strict=True))
        row["height"] = found.z_equal - case.z
        c = math.sqrt(case.area / math.pi)
        for prefix in ("", "surface_"):
            fx, fs, mn = (getattr(case, prefix + name) / bound for name in ("fx", "fs", "mn"))
            errors = found.fx / own - fx, found.fs / own - fs, (found.mn / own - mn) / c
            row |= dict(zip((f"{prefix}fx", f"{prefix}fs", f"{prefix}mn"), errors, strict=True))
            row[f"{prefix}force"] = math.hypot(*errors[:2])
        x, y, z = found.track
        errors = (force / z - wanted / case.load for force, wanted in zip((x, y), case.curved, strict=True))
        row["curved_x"], row["curved_y"] = (error / FRICTION for error in errors)
        row["curved_force"] = math.hypot(row["curved_x"], row["curved_y"])
        rows.append(row)
    return pd.DataFrame(rows)


def summary(table):
    """Median, 95 % quantile and greatest absolute value of the columns of `compare` that have any."""
    columns = table.select_dtypes("number").drop(columns=["y", "yaw"]).abs().dropna(axis=1, how="all")
    return columns.quantile([0.5, 0.95, 1.0]).T.set_axis(["median", "q95", "max"], axis=1)
