"""Put the batches of a sweep together and draw it."""

import sys

from wrcore.analysis.legible import save_figure
from wrcore.analysis.plot_sweep import sweep_scatter
from wrcore.sweep.batch import gather, load_table
from wrcore.sweep.plan import load_sweep

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
gather(load_sweep(snakemake.input.sweep), snakemake.input.batches, snakemake.output.table)
figure = sweep_scatter(load_table(snakemake.output.table), snakemake.params.varied, snakemake.params.shown)
save_figure(figure, snakemake.output.figure, snakemake.output.svg)
