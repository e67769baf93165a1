"""``wrcore compare``: compare two stored runs."""

from wrcore.cli.common.files import output, write_csv
from wrcore.cli.common.options import columns

ABOUT = """
Compare two stored runs at the output times that both have: what does a modelling choice change? Printed are the keys
of the scenes that differ and, of each channel, the body or wheel where it differs most.
"""

FILES = columns(
    "table.csv, a row per group and channel; rms, max, mean, scale and error in the channel's unit",
    group="body or wheel",
    channel="name, also of channels that follow from those of contacts",
    unit="of the channel",
    rms="root mean square of the difference b - a over time, of contacts over patches, too",
    max="largest amount of the difference",
    t_max_s="when that is",
    mean="of the difference, with its sign",
    scale="root mean square of the channel (of places and motions: standard deviation, or how far the means "
    "are apart), the largest of all groups",
    relative="rms over scale",
    error="what the runs state of their own error; empty where they state none",
    compared="share of the common times at which both have a value",
)


def add(commands):
    command = commands.add_parser("compare", help="differences of two stored runs", description=ABOUT, epilog=FILES)
    command.add_argument("a", metavar="A.h5", help="of 'wrcore simulate --out'")
    command.add_argument("b", metavar="B.h5", help="another one; differences are B less A")
    command.add_argument("--out", metavar="table.csv", help="write the row of every channel of every group")
    command.add_argument("--plot", metavar="FILE", help="draw y, yaw, Q, Y and their differences: .svg or .png")
    command.set_defaults(run=run)


def run(options):
    from wrcore.analysis.compare import compare
    from wrcore.analysis.pictures.style import save_figure

    out = output(options.out) if options.out else None
    picture = output(options.plot, (".svg", ".png"), "--plot") if options.plot else None
    found = compare(options.a, options.b)
    print(found)
    if out:
        write_csv(found.table, out)
    if picture:
        save_figure(found.plot(), picture)
    return 0
