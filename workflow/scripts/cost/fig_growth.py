"""Plot computing time over number of wheelsets, duration, tolerance and simultaneous scenes."""

import sys

import pandas as pd

from study.cost.figures import fig_growth
from wrcore.analysis.legible import save_figure

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
given = snakemake.input
figure = fig_growth(*(pd.read_csv(path) for path in (given.wheelsets, given.runs, given.simultaneous)))
save_figure(figure, snakemake.output.png, snakemake.output.svg)
