"""``wrcore compare``: compare two stored runs, or a stored run and a measured signal."""

from pathlib import Path

from wrcore.cli.common.files import output, write_csv
from wrcore.cli.common.options import columns
from wrcore.errors import InputError

ABOUT = """
Compare two stored runs at the output times that both have: what does a modelling choice change? Printed are the keys
of the scenes that differ and, of each channel, the body or wheel where it differs most.

With --channel the second file is a measured signal (CSV, MATLAB .mat or HDF5). Its channels are resampled and filtered
like those of the run. Then --out is a folder for tables.
"""

FILES = (
    columns(
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
    + """

With a signal, in the folder:
  differences.csv, a row per channel, of run less signal
  sections.csv, a row per section, channel and statistic: simulated, measured, difference
  validation.csv, a row per quantity and statistic: mean and standard deviation of the differences over the sections
  spectra.csv, densities, coherence and transfer function by channel and frequency
  overlay.svg, spectra.svg"""
)


def add(commands):
    command = commands.add_parser("compare", help="differences of two stored runs", description=ABOUT, epilog=FILES)
    command.add_argument("a", metavar="A.h5", help="of 'wrcore simulate --out'")
    command.add_argument("b", metavar="B", help="another run (.h5); differences are B less A; or a measured signal")
    command.add_argument("--out", metavar="table.csv|FOLDER", help="table of two runs; with a signal a folder")
    command.add_argument("--plot", metavar="FILE", help="draw y, yaw, Q, Y and differences of two runs: .svg or .png")
    signal = command.add_argument_group("with a measured signal")
    signal.add_argument(
        "--channel", action="append", default=[], metavar="TITLE=CHANNEL",
        help="column of the signal and channel of the run, such as 'Acc Y=car_body.ay_m_per_s2'; a minus before the "
        "channel reverses the sign; may be repeated",
    )  # fmt: skip
    signal.add_argument(
        "--unit", action="append", default=[], metavar="TITLE=UNIT", help="unit of a column, if the file has none"
    )
    signal.add_argument("--axis", metavar="TITLE", help="column of time or distance; found by its name if left out")
    signal.add_argument("--rate", type=float, metavar="Hz", help="sampling rate of a file without a time, Hz")
    signal.add_argument("--offset", type=float, metavar="s|m", help="added to the signal's time or distance, s or m")
    signal.add_argument("--align", metavar="CHANNEL", help="align by the correlation of this channel")
    signal.add_argument("--band", nargs=2, metavar=("LOW", "HIGH"), help="band of a filter, Hz or 1/m; none: no corner")
    signal.add_argument("--section", type=float, metavar="s|m", help="length of sections, s or m; default: EN 14363's")
    command.set_defaults(run=run)


def run(options):
    if options.channel:
        return _run_with_signal(options)
    given = [name for name in SIGNAL_OPTIONS if getattr(options, name) not in (None, [])]
    if given:
        raise InputError("wrcore compare", f"--{given[0]}", "expected --channel beside it, which makes B a signal")
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


SIGNAL_OPTIONS = ("unit", "axis", "rate", "offset", "align", "band", "section")
"""Options that only a measured signal has."""


def _run_with_signal(options):
    """Compare a run with a measured signal, and write tables and figures into the folder ``--out``."""
    import pandas as pd

    from wrcore.analysis.compare import compare
    from wrcore.analysis.pictures.style import save_figure
    from wrcore.run.output.files import load_run
    from wrcore.signals.read import read_signal

    if options.plot:
        raise InputError("wrcore compare", "--plot", "expected none with a signal: --out FOLDER has the figures")
    folder = Path(options.out) if options.out else None
    if folder is not None and (folder.exists() and not folder.is_dir() or not folder.absolute().parent.is_dir()):
        raise InputError("--out", folder, "expected a folder, or the name of a new one in an existing folder")
    band = None if options.band is None else [_corner(text) for text in options.band]
    run = load_run(options.a)
    units = dict(_pair(text, "--unit") for text in options.unit)
    channels = dict(_pair(text, "--channel") for text in options.channel)
    signal = read_signal(options.b, channels, options.axis, options.rate, units)
    if options.offset is not None:
        signal = signal.shifted(options.offset)
    if options.align:
        before = signal.x[0]
        signal = signal.aligned(run, options.align, band or (None, None))
        print(f"aligned by {signal.x[0] - before:+.6g} {'s' if signal.axis == 't_s' else 'm'}")
    found = compare(run, signal, band, options.section)
    print(found)
    if folder is not None:
        folder.mkdir(exist_ok=True)
        spectra = {channel: found.spectra(channel) for channel in found.signal}
        write_csv(found.table, folder / "differences.csv")
        write_csv(found.sections, folder / "sections.csv")
        write_csv(found.validation, folder / "validation.csv")
        write_csv(pd.concat(spectra, names=["channel"]).reset_index("channel"), folder / "spectra.csv")
        save_figure(found.plot(), folder / "overlay.svg")
        save_figure(found.plot_spectra(), folder / "spectra.svg")
    return 0


def _pair(text, option):
    """Return title and value of an option ``TITLE=VALUE``."""
    title, equals, value = text.rpartition("=")
    if not equals or not title.strip() or not value.strip():
        raise InputError(option, text, "expected TITLE=VALUE")
    return title.strip(), value.strip()


def _corner(text):
    """Return a corner frequency, or None for the word ``none``."""
    try:
        return None if text.lower() == "none" else float(text)
    except ValueError:
        raise InputError("--band", text, "expected two numbers, or none for no corner") from None
