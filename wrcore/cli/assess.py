"""``wrcore assess``: assess a stored run by a standard."""

from wrcore.cli.common.files import output, write_csv
from wrcore.cli.common.options import columns

ABOUT = """
Assess a stored run by EN 14363 (running safety and track loading: needs the forces of wheels at 1000 1/s or more) or EN
12299 (comfort: poses and accelerations of bodies at 200 1/s or more). reports/assessment.md says what of the
standards is done.
"""

FILES = columns(
    "sections.csv (EN 14363), a row per section, wheelset or wheel, and quantity",
    section="number of the section, from 0",
    begin_m="where it begins along the track",
    end_m="where it ends",
    radius_m="of the curve; inf: straight",
    quantity="sum_Y, Y_over_Q (low-pass 20 Hz, mean over 2 m in steps of 0.5 m), Q, Y_qst, Q_qst (low-pass 20 Hz)",
    wheelset="name",
    side="left or right; empty for sum_Y",
    p0_15="0.15 % percentile, N (of Y/Q a number)",
    p50="median",
    p99_85="99.85 % percentile",
)


def add(commands):
    command = commands.add_parser(
        "assess", help="assess a stored run by EN 14363, EN 12299 or ISO 2631", description=ABOUT, epilog=FILES
    )
    command.add_argument("run_file", metavar="run.h5", help="of 'wrcore simulate --out'")
    command.add_argument("--standard", default="EN 14363", metavar="'EN 14363'|'EN 12299'|'ISO 2631'", help="which one")
    command.add_argument("--begin", type=float, default=0.0, metavar="s", help="leave out what came before, s")
    command.add_argument("--freight", action="store_true", help="limits of freight wagons")
    command.add_argument("--out", metavar="sections.csv", help="write percentiles section by section (EN 14363)")
    command.add_argument(
        "--plot", metavar="FILE", help="draw the filtered forces with their limits (EN 14363): .svg or .png"
    )
    command.set_defaults(run=run)


def run(options):
    from wrcore.analysis.assessment.assess import assess
    from wrcore.analysis.pictures.style import save_figure
    from wrcore.run.output.files import load_run

    out = output(options.out) if options.out else None
    picture = output(options.plot, (".svg", ".png"), "--plot") if options.plot else None
    assessment = assess(load_run(options.run_file), options.standard, options.begin, options.freight)
    print(assessment)
    if out:
        write_csv(assessment.sections, out)
    if picture:
        save_figure(assessment.plot(), picture)
    return 0
