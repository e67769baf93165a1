"""``wrcore sweep``: many runs of a scene."""

import time

from wrcore.cli.common.files import output, refuse_others
from wrcore.cli.common.options import columns
from wrcore.errors import InputError

ABOUT = """
Run a scene many times with other values of its keys, and keep some numbers of each run. Every key of a sweep's file,
with unit, range and default: 'wrcore keys sweep'. The measures: 'python -m pydoc wrcore.sweep.measures'.
"""

FILES = columns(
    "The table, a row per run",
    run="number, from 0",
    **{"speed, contact.friction ...": "the sweep's keys by their paths, in SI units"},
    status="how the run ended",
    method="of integration",
    **{"y_rms_m, Q_max_N ...": "the sweep's measures; names end in their unit"},
)


def add(commands):
    command = commands.add_parser(
        "sweep", help="run a scene many times with other values of its keys", description=ABOUT, epilog=FILES
    )
    command.add_argument("sweep", metavar="SWEEP.yaml", help="'wrcore init FOLDER' makes one to start from")
    command.add_argument("--out", required=True, metavar="table.csv|table.h5", help="a row per run")
    command.add_argument("--threads", type=int, default=1, metavar="n", help="runs at the same time")
    command.add_argument("--batch", metavar="i/n", help="only the i-th of n equal parts, from 1")
    command.add_argument("--gather", nargs="+", metavar="part.csv", help="run nothing: put parts together")
    command.set_defaults(run=run)


def run(options):
    from wrcore.sweep.batch import gather, load_table, run_rows, sweep_to_file, write_table
    from wrcore.sweep.plan import load_sweep

    out = output(options.out, (".csv", ".h5"))
    refuse_others(out, "format", "wrcore sweep")
    if not 1 <= options.threads <= 1000:
        raise InputError("wrcore sweep", "--threads", f"expected 1 to 1000, got {options.threads}")
    sweep, started = load_sweep(options.sweep), time.perf_counter()
    if options.gather:
        gather(sweep, options.gather, out)
    elif options.batch:
        write_table(out, run_rows(sweep, sweep.rows(*_batch(options.batch, len(sweep.runs))), options.threads), sweep)
    else:
        sweep_to_file(sweep, out, options.threads)
    table = load_table(out)
    ends = ", ".join(f"{count} {status}" for status, count in table["status"].value_counts().items())
    seconds = f"{time.perf_counter() - started:.3g} s"
    if "wall_s" in table:
        seconds += f", integrations {table['wall_s'].sum():.3g} s in all"
    print(f"{sweep.data['name']}: {len(table)} of {len(sweep.runs)} runs, {ends}, in {seconds}: {out}")
    return 0


def _batch(text, runs):
    """Parse a batch such as 1/4: return its number (from 0) and the number of batches."""
    number, _, count = text.partition("/")
    if not (number.isdecimal() and count.isdecimal() and 1 <= int(number) <= int(count) <= runs):
        raise InputError("wrcore sweep", "--batch", f"expected i/n with 1 <= i <= n <= {runs} runs, got {text!r}")
    return int(number) - 1, int(count)
