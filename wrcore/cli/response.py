"""``wrcore response``: frequency response of a scene's vehicle."""

from wrcore.cli.common.files import output, write_csv
from wrcore.cli.common.options import columns
from wrcore.errors import InputError

ABOUT = """
Frequency response of a scene's vehicle about steady running on straight track: what harmonic irregularity and forces
make of channels. reports/response.md explains inputs, outputs and phases.
"""

FILES = columns(
    "OUT.csv, a row per input, output and frequency",
    input="as given",
    output="as given",
    frequency_Hz="of both",
    amplitude="of the output per unit of the input (m, N or N m), in the unit that the channel's name states",
    phase_rad="of the output before the input",
)


def add(commands):
    command = commands.add_parser("response", help="frequency response of a vehicle", description=ABOUT, epilog=FILES)
    command.add_argument("scene", metavar="SCENE.yaml", help="scene file")
    command.add_argument(
        "--input", required=True, nargs="+", metavar="NAME", help="such as level, alignment, car_body.Fz_N"
    )
    command.add_argument(
        "--output", required=True, nargs="+", metavar="CHANNEL", help="such as car_body.az_m_per_s2 wheelset_1/left.Q_N"
    )
    command.add_argument("--from", type=float, default=0.1, dest="low", metavar="Hz", help="lowest frequency, Hz")
    command.add_argument("--to", type=float, default=30.0, metavar="Hz", help="highest frequency, Hz")
    command.add_argument("--count", type=int, default=300, help="number of frequencies, evenly on a logarithmic axis")
    command.add_argument("--speed", type=float, metavar="m/s", help="m/s (default: the scene's)")
    command.add_argument("--out", required=True, metavar="OUT.csv", help="the table")
    command.add_argument("--plot", metavar="FILE", help="Bode plot, .svg or .png")
    command.set_defaults(run=run)


def run(options):
    import numpy as np
    import pandas as pd

    from wrcore.analysis.pictures.plot_response import plot_frequency_response
    from wrcore.analysis.pictures.style import save_figure
    from wrcore.analysis.response.frequency_response import frequency_response
    from wrcore.cli.draw import FIGURES

    out = output(options.out)
    figure = output(options.plot, FIGURES, "--plot") if options.plot else None
    if not (0.0 < options.low < options.to < float("inf") and 2 <= options.count <= 100_000):
        raise InputError("wrcore response", "--from", "expected 0 < from < to, and 2 to 100000 frequencies")
    frequencies = np.geomspace(options.low, options.to, options.count)
    table = frequency_response(options.scene, options.input, options.output, frequencies, options.speed)
    rows = [
        pd.DataFrame({
            "input": source, "output": channel, "frequency_Hz": table.index, "amplitude": values.abs(),
            "phase_rad": np.unwrap(np.angle(values)),
        })
        for (source, channel), values in table.items()
    ]  # fmt: skip
    write_csv(pd.concat(rows), out)
    if figure:
        save_figure(plot_frequency_response(table), figure)
    return 0
