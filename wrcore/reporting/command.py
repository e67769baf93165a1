"""``wrcore report``: a report of stored runs as one HTML page."""

from wrcore.errors import InputError
from wrcore.errors.new_files import output

ABOUT = """
Write a report of stored runs: one HTML page without scripts, which any browser shows and prints to PDF. It has the
scene, key figures with their definitions, track, motion, wheel forces, contact positions, assessments by standards,
wear number, spectra, what the run cost and how accurate it is. Several runs stand side by side. Sections for which the
runs have no data are left out; the end of the page says why.
"""


def add(commands):
    """Add the parser of the command."""
    command = commands.add_parser("report", help="report of stored runs as one HTML page", description=ABOUT)
    command.add_argument("runs", nargs="+", metavar="run.h5", help="of 'wrcore simulate --out', at most 6")
    command.add_argument("--out", required=True, metavar="FILE.html", help="write the page here")
    command.add_argument(
        "--channel", action="append", default=[], metavar="GROUP.CHANNEL", dest="channels",
        help="draw this channel, such as car_body.y_m, in place of the default; may be repeated",
    )  # fmt: skip
    command.add_argument(
        "--over", default="auto", metavar="auto|time|distance",
        help="horizontal axis of figures; auto: distance where the track varies along it",
    )  # fmt: skip
    command.add_argument("--begin", type=float, default=0.0, metavar="s", help="begin of the evaluation, s")
    command.add_argument(
        "--no-accuracy", action="store_true",
        help="estimate no errors: integrate nothing again and solve no exact contact",
    )  # fmt: skip
    command.add_argument("--freight", action="store_true", help="limits of freight wagons (EN 14363)")
    command.add_argument("--scene", metavar="SCENE.yaml", help="of a single run whose files are not found from here")
    command.add_argument(
        "--trust", action="store_true", help="run laws that the run files name, to estimate errors (default: no)"
    )
    command.set_defaults(run=run)


def run(options):
    """Execute the command and return its exit status."""
    out = output(options.out, (".html",))
    from wrcore.reporting.report import report

    try:
        page = report(
            options.runs, options.channels, options.begin, options.over, not options.no_accuracy, options.freight,
            options.scene, options.trust,
        )  # fmt: skip
    except InputError as error:
        if error.source != "report":
            raise
        raise InputError("wrcore report", error.field, error.expected) from None
    page.write(out)
    print(f"{out}: {len(page.html) / 1e6:.2g} MB, sections: {', '.join(page.sections)}")
    return 0
