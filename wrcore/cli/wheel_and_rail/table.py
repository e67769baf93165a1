"""``wrcore table``: creep tables."""

from wrcore.cli.common.files import HDF5, output, refuse_others

ABOUT = """
Creep tables: exact rolling contact, solved once on patches of all shapes. Scenes build the one they need by themselves.
"""


def add(commands):
    command = commands.add_parser("table", help="build or describe a creep table", description=ABOUT)
    actions = command.add_subparsers(metavar="ACTION", required=True, help="what to do")
    build = actions.add_parser(
        "build", help="refine until a random check meets the tolerance",
        description="Build a creep table and refine it until a random check meets the tolerance: seconds to minutes.",
    )  # fmt: skip
    build.add_argument("--nu", type=float, default=0.28, help="Poisson's ratio, 0 to 0.5")
    build.add_argument(
        "--planes", choices=("ellipse", "sdec"), default="ellipse",
        help="shapes of patch: ellipses (4 inputs), or double ellipses that are wider on one side (5 inputs)",
    )  # fmt: skip
    build.add_argument(
        "--tolerance", type=float, metavar="t", help="99 %% error of the force as a fraction of mu N (default: 0.005)"
    )
    build.add_argument("--out", required=True, metavar="table.h5", help="the table")
    build.set_defaults(run=run_build)
    info = actions.add_parser(
        "info", help="what a table holds and how accurate it is", description="Print a table's properties, a line each."
    )
    info.add_argument("file", metavar="table.h5", help="of 'wrcore table build'")
    info.set_defaults(run=run_info)


def run_build(options):
    from wrcore.creep.table import DEFAULT_TOLERANCE, SCHEMA, build_table, show_progress, write_table

    out = output(options.out, HDF5)
    refuse_others(out, "schema", SCHEMA)
    tolerance = DEFAULT_TOLERANCE if options.tolerance is None else options.tolerance
    table = build_table(options.nu, options.planes, tolerance, show_progress)
    write_table(out, table)
    return _print_table(table)


def run_info(options):
    from wrcore.creep.table import load_table

    return _print_table(load_table(options.file))


def _print_table(table):
    from wrcore.creep.table import table_info

    for name, value in table_info(table).items():
        print(f"{name:24s} {value:.6g}" if isinstance(value, float) else f"{name:24s} {value}")
    return 0
