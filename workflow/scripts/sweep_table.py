"""Put the batches of a sweep together and draw it."""

import sys

from wrcore.figures import save_figure
from wrcore.figures_sweep import sweep_scatter
from wrcore.sweep_batch import gather, load_table

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
gather(snakemake.input.batches, snakemake.output.table)
figure = sweep_scatter(load_table(snakemake.output.table), snakemake.params.varied, snakemake.params.shown)
save_figure(figure, snakemake.output.figure, snakemake.output.svg)
