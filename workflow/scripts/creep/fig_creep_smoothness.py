"""Compute and plot the smoothness of a creep table across its cells, at its pole and at zero creepage."""

import sys

from study.creep.figures import fig_creep_smoothness
from study.creep.smoothness import smoothness, smoothness_table
from wrcore.analysis.creep_curves import table_model
from wrcore.analysis.legible import save_figure
from wrcore.creep.table import load_table

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
lines = smoothness(table_model("table", load_table(snakemake.input.table[0])), **dict(snakemake.params.items()))
table = smoothness_table(lines)
table.to_csv(snakemake.output[2], index=False)
save_figure(fig_creep_smoothness(lines, table), *snakemake.output[:2])
