"""``wrcore evolve``: worn wheel profiles over a distance."""

from functools import partial

from wrcore.cli.common.options import columns
from wrcore.errors import InputError

ABOUT = """
Wear a wheel profile over the distance of a plan, or go on with an interrupted one. Every key of a plan, with
unit, range and default: 'wrcore keys wear'. The method: reports/wear.md.
"""

FILES = (
    "FOLDER gets profile_000.csv (u_m, f_m) and so on, rail_0_left_000.csv if rails wear, and steps.csv.\n\n"
    + columns(
        "steps.csv, a row per step",
        step="number, that of its profile",
        distance_m="run so far, at the step's beginning",
        step_m="length of the step",
        worn_m="deepest loss of the ordinate since new or turned",
        rate_max="greatest wear rate, depth normal to the profile, m per m",
        volume_m3_per_m="volume that a wheel loses per distance",
        worn_volume_m3="the same over the step",
        Sh_m="flange height",
        Sd_m="flange thickness",
        qR_m="flange slope",
        hollow_m="depth of the tread's hollow",
        equivalent_conicity="at an amplitude of 3 mm",
        at_limit="limits of the plan that are reached: the wheel is turned, or ends there",
    )
)


def add(commands):
    command = commands.add_parser(
        "evolve", help="wear a wheel profile over the distance of a plan", description=ABOUT, epilog=FILES
    )
    command.add_argument("plan", metavar="PLAN.yaml", help="'wrcore init FOLDER' makes one to start from")
    command.add_argument("--out", required=True, metavar="FOLDER", help="created if needed")
    command.add_argument("--threads", type=int, default=1, metavar="n", help="scenes of a step at the same time")
    command.set_defaults(run=run)


def run(options):
    from wrcore.analysis.wear.evolve import evolve

    if not 1 <= options.threads <= 1000:
        raise InputError("wrcore evolve", "--threads", f"expected 1 to 1000, got {options.threads}")
    table = evolve(options.plan, options.out, partial(print, flush=True), threads=options.threads)
    columns = ["distance_m", "worn_m", "Sh_m", "Sd_m", "qR_m", "equivalent_conicity"]
    print(table[columns].to_string(index=False, float_format=lambda value: f"{value:.5g}"))
    return 0
