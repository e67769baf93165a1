"""``wrcore contact``: contact patches of a wheelset at given positions and attitudes."""

import json
import math
import sys

from wrcore.cli.common.files import output, write_csv
from wrcore.cli.common.options import add_pair, as_runs, columns, pair_of
from wrcore.errors import InputError

ABOUT = """
Patches of both wheels for each pose of IN.csv. z given: forces at that height; only roll given: each wheel carries the
load by itself; neither: both are solved. Roll turns the wheelset about x first, then yaw about z.
"""

POSES = columns(
    "IN.csv, a row per pose",
    pose_id="any text, no two alike",
    **as_runs("y_m", "yaw_rad"),
    roll_rad="optional",
    z_m="optional",
    s_m="of rails of slices: arc length of the wheelset's cross-section",
    pitch_rad="of wheels of slices: angle by which they have rolled forward",
    V_m_per_s="optional: speed; where it is given creep forces act",
    omega_rad_per_s="optional: rolling rate, positive forward; empty: free rolling",
    vy_m_per_s="optional",
    yaw_rate_rad_per_s="optional",
    mu="optional: friction coefficient",
)

FILES = columns(
    "OUT.csv, a row per patch",
    pose_id="of its pose",
    side="left or right",
    patch="number at its wheel, from 1",
    **as_runs("u_wheel_m", "s_wheel_rad", "u_rail_m"),
    x_m="point of contact in the track frame, from the wheelset's cross-section; of strips the centroid of pressure",
    y_m="the same, left positive",
    z_m="the same, from the plane of the rails' highest points",
    **as_runs("contact_angle_rad", "penetration_m", "a_m", "b_m", "N_N", "p_max_Pa"),
    roll_rad="of the wheelset",
    z_wheelset_m="height of the wheelset's centre",
    x_min_m="where the patch begins",
    x_max_m="where it ends",
    width_m="of the patch in the contact plane",
    **as_runs("xi", "eta", "phi_per_m", "Fx_N", "Fy_N", "Mz_Nm"),
    load_residual_N="force that the wheel carries less the load that was asked; empty where z is given",
    not_loaded="1 where no height was found at which the wheel carries its load, else 0",
    half_space="1 where the patch is too wide for a half-space, else 0",
    conformal="1 where the patch lies in a hollow over which the normal turns too far, else 0",
    profile_edge="1 where the patch reaches beyond the end of a profile, else 0",
    search_fallback="1 where roll or yaw is so large that every strip was searched, else 0",
    hollow_ahead="1 where the wheel is yawed too far for its hollow, else 0",
    both_flanges="1 where both flanges of the wheelset touch: too wide for the gauge, else 0",
)


def add(commands):
    command = commands.add_parser(
        "contact", help="contact of a wheelset in given poses", description=ABOUT, epilog=f"{POSES}\n\n{FILES}"
    )
    command.add_argument("--poses", required=True, metavar="IN.csv", help="a pose per row")
    add_pair(
        command, "; a rail of slices: FILE.slcs, a table (columns s_m, profile), or '{slices: FILE, ...}'; a wheel of "
        "slices, out of round: FILE.slcw, a table (columns angle_rad, profile), or the same"
    )  # fmt: skip
    command.add_argument(
        "--rail-distance", type=float, metavar="m",
        help="of the origin of slices from the track's centre, and heights as the files have them; left out: the first "
        "slice lies as a rail that is the same everywhere",
    )  # fmt: skip
    command.add_argument("--shear-modulus", type=float, default=8.2e10, metavar="Pa", help="of both bodies, Pa")
    command.add_argument("--poisson-ratio", type=float, default=0.28, metavar="nu", help="of both bodies")
    command.add_argument(
        "--detection", choices=("planar", "spatial"), default="spatial",
        help="search in the wheelset's cross-section only, or ahead and behind it, too",
    )  # fmt: skip
    command.add_argument(
        "--patch", choices=("maximum", "moment", "exact", "tabulated", "surrogate", "grid"), default="moment",
        help="reduction of an overlap to an ellipse, or the real patch: solved, where the wheel rolls looked up, or "
        "from a trained network",
    )  # fmt: skip
    command.add_argument(
        "--resolution", choices=("coarse", "middle", "fine"), default="fine", help="of strips and grids"
    )
    command.add_argument(
        "--slip", choices=("surfaces", "creepages"), default="surfaces",
        help="rigid slip of strips and grids: of the real surfaces, or of one set of creepages per patch",
    )  # fmt: skip
    command.add_argument(
        "--load-by", choices=("vertical", "normal"), default="vertical",
        help="the load is the vertical sum of all forces on a wheel, or the sum of its normal forces",
    )  # fmt: skip
    command.add_argument("--friction", type=float, default=0.3, metavar="mu", help="where a pose gives none")
    command.add_argument("--wheel-load", type=float, required=True, metavar="N", help="per wheel, N")
    command.add_argument("--out", required=True, metavar="OUT.csv", help="a row per patch")
    command.set_defaults(run=run)


def _pair(options, poses):
    """Return the `ContactGeometry` of wheel and rail, or a `WheelOnSlices` if one of them has slices."""
    from wrcore.cli.common.options import profile_of, slices_of
    from wrcore.contact.changing_rails.sections import WheelOnSlices
    from wrcore.geometry.changing_rails.slices import RailSlices
    from wrcore.geometry.profiles.profile import GAUGE_DEPTH

    rail, out_of_round = slices_of(options, "rail"), slices_of(options, "wheel")
    distance, sizes = options.rail_distance, (options.rolling_radius, options.tape_circle_half_distance)
    if rail is None and out_of_round is None and distance is not None:
        raise InputError("wrcore contact", "--rail-distance", "expected this with rails or wheels of slices only")
    if rail is not None and rail.alike and distance is None:
        options.rail = json.dumps(rail.first) if len(rail.first) > 1 else rail.first["points"]  # JSON is YAML, too
        rail = None
    if rail is None and out_of_round is None:
        return pair_of(options).left.geometry
    for slices, name, what in (
        (rail, "s_m", "arc length of the wheelset"),
        (out_of_round, "pitch_rad", "wheel's angle"),
    ):
        missing = poses.index[poses[name].isna()]
        if slices is not None and missing.size:
            expected = f"expected the {what}, as the {'rail' if slices is rail else 'wheel'} is one of slices"
            raise InputError(options.poses, f"{name}, row {missing[0] + 1}", expected)
    wheel = profile_of(options, options.wheel, "wheel") if out_of_round is None else out_of_round.round()
    if rail is None:
        curve = profile_of(options, options.rail, "rail")
        distance = 0.5 * options.gauge + curve.gauge_offset(GAUGE_DEPTH) if distance is None else distance
        if math.isnan(distance):
            raise InputError(
                curve.name, "gauge", "expected a rail down to where the gauge is measured, or the distance"
            )
        rail = RailSlices.of(curve)
    elif distance is None:
        rail, offset = rail.placed()
        distance = 0.5 * options.gauge + offset
    return WheelOnSlices(wheel, rail, *sizes, distance, out_of_round)


def run(options):
    from wrcore.analysis.contact.poses import POSE_FLAGS, loaded_poses
    from wrcore.contact.rigid.pose_file import read_poses

    out = output(options.out)
    poses = read_poses(options.poses)
    table = loaded_poses(
        poses, _pair(options, poses), options.wheel_load, options.patch, options.resolution, options.slip,
        options.load_by, options.friction, options.detection, options.shear_modulus, options.poisson_ratio,
    )  # fmt: skip
    if table.empty:
        raise InputError(options.poses, "", "expected a pose in which a wheel touches its rail, got none")
    write_csv(table, out)
    missing = len(set(poses.pose_id) - set(table.pose_id))
    remarks = f", {missing} poses without contact" if missing else ""
    if options.patch != "grid" and table.attrs["on_grid"]:
        remarks += f", {table.attrs['on_grid']} patches by the grid"
    if table.attrs["on_fixed_strips"]:
        remarks += f", {table.attrs['on_fixed_strips']} on fixed strips"
    print(f"{len(poses)} poses, {len(table)} patches{remarks}: {out}")
    flagged = {name: int(table[name].sum()) for name in POSE_FLAGS if table[name].any()}
    if table.attrs["without_height"]:
        flagged["wheels that no height loads"] = table.attrs["without_height"]
    if flagged:
        named = ", ".join(f"{name} {count}" for name, count in flagged.items())
        print(f"wrcore contact: warning: patches beyond the models' limits: {named}", file=sys.stderr)
    return 0
