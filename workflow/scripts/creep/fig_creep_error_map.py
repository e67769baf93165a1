"""Compute and plot errors of a creep table over its range."""

import sys

from study.creep.figures import fig_creep_error_map
from study.creep.smoothness import error_map
from wrcore.analysis.creep_curves import table_model
from wrcore.analysis.legible import save_figure
from wrcore.creep.table import load_table

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
params = snakemake.params
errors = error_map(table_model(params.name, load_table(snakemake.input.table[0])), params.patches, params.level)
errors.to_csv(snakemake.output[2], index=False)
save_figure(fig_creep_error_map(errors, params.name), *snakemake.output[:2])
