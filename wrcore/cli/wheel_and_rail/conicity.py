"""``wrcore conicity``: equivalent conicity of a wheelset on its track."""

import argparse
import sys

from wrcore.cli.common.files import output, write_csv
from wrcore.cli.common.options import add_pair, columns, pair_of
from wrcore.errors import InputError
from wrcore.run.output.channels import DESCRIPTIONS

ABOUT = """
Equivalent conicity of a rigid wheelset on its track over the amplitude of its swing (EN 15302).
"""

FILES = columns(
    "OUT.csv, a row per amplitude",
    amplitude_m="half of the swing, peak to peak",
    equivalent_conicity="of a cone with the same wavelength",
    wavelength_m="of the swing; inf for conicity 0",
    y_min_m="turning point on the right",
    y_max_m="turning point on the left",
    profile_edge="1 where a wheel would touch with the end of a profile before this amplitude, else 0",
    no_wave="1 where the rolling radius difference lets no wave of this amplitude exist, else 0",
)
TABLE = columns(
    "OUT2.csv, a row per lateral position; _right_ as _left_",
    y_m="of the wheelset",
    roll_rad="of the wheelset",
    rolling_radius_difference_m="left less right",
    u_wheel_left_m=DESCRIPTIONS["u_wheel_m"],
    u_rail_left_m=DESCRIPTIONS["u_rail_m"],
    contact_angle_left_rad=DESCRIPTIONS["contact_angle_rad"],
    height_left_m="of the wheelset's centre above the rails' highest points",
    profile_edge="1 where a wheel touches with the end of a profile, else 0",
    not_level="1 where no roll was found at which both wheels touch, else 0",
)


def add(commands):
    command = commands.add_parser(
        "conicity",
        help="equivalent conicity of a wheelset on its track (EN 15302)",
        description=ABOUT,
        epilog=f"{FILES}\n\n{TABLE}",
    )
    add_pair(command)
    command.add_argument("--right-wheel", metavar="NAME|FILE", help="where it differs from --wheel")
    command.add_argument("--right-rolling-radius", type=float, metavar="m", help="where it differs, m")
    command.add_argument(
        "--roll", action=argparse.BooleanOptionalAction, default=False,
        help="let the wheelset roll so that both wheels touch; the standard does not (default: no)",
    )  # fmt: skip
    command.add_argument("--amplitudes-from", type=float, default=0.001, metavar="m", help="least amplitude, m")
    command.add_argument("--to", type=float, default=0.008, metavar="m", help="largest amplitude, m")
    command.add_argument("--step", type=float, default=0.001, metavar="m", help="of the amplitudes, m")
    command.add_argument("--out", required=True, metavar="OUT.csv", help="a row per amplitude")
    command.add_argument("--table", metavar="OUT2.csv", help="rolling radius difference over the lateral position")
    command.set_defaults(run=run)


def run(options):
    import numpy as np

    from wrcore.contact.rigid.conicity import conicity_curve
    from wrcore.contact.rigid.first_touch import first_touch

    out = output(options.out)
    table_out = output(options.table, option="--table") if options.table else None
    first, last, step = options.amplitudes_from, options.to, options.step
    if not (0.0 < first <= last <= 0.05 and (last - first) / 1e4 <= step < float("inf") and step > 0.0):
        raise InputError("wrcore conicity", "--amplitudes-from", "expected 0 < from <= to <= 0.05 m and a step > 0")
    amplitudes = first + step * np.arange(int((last - first) / step + 1e-9) + 1)
    pair = pair_of(options)
    curve = conicity_curve(pair, amplitudes, options.roll)
    if curve["equivalent_conicity"].isna().all():
        raise InputError("wrcore conicity", "--to", "expected an amplitude at which the wheelset swings, got none")
    write_csv(curve, out)
    flagged = [f"{name} {curve[name].sum()}" for name in ("profile_edge", "no_wave") if curve[name].any()]
    if flagged:
        print(f"wrcore conicity: warning: amplitudes without conicity: {', '.join(flagged)}", file=sys.stderr)
    if table_out:
        shifts = 1e-4 * np.arange(-round(last / 1e-4) - 20, round(last / 1e-4) + 21)
        write_csv(first_touch(pair, shifts, options.roll), table_out)
    return 0
