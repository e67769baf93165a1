"""Plot creep curves of all laws and of the exact solution."""

import sys

from wrcore.analysis.creep_curves import creep_curves, creep_models
from wrcore.analysis.legible import save_figure
from wrcore.analysis.pictures.plot_creep import fig_creep_curves
from wrcore.creep.table import load_table

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
params = snakemake.params
models = creep_models(params.nu, {"table": load_table(snakemake.input.table[0])}, [params.fastsim_grid])
curves = creep_curves(models, params.nu, params.a_over_b, params.level, params.points)
curves.to_csv(snakemake.output[2], index=False)
save_figure(fig_creep_curves(curves), *snakemake.output[:2])
