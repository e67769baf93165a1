"""A wheel profile over the distance of a plan: table, figure, and the profiles themselves."""

import sys
from pathlib import Path

from study.creep_table import plan_with_creep_table
from wrcore.analysis.legible import save_figure
from wrcore.analysis.pictures.plot_wear import plot_evolution
from wrcore.analysis.wear.evolve import evolve, load_wear_plan, plan_mark, profiles_over_distance

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
plan = snakemake.input.plan
changes = plan_with_creep_table(plan, dict(snakemake.params.settings), snakemake.input.table[0])
folder = Path(snakemake.output.table).with_name("profiles") / plan_mark(*load_wear_plan(plan, changes))[:12]
table = evolve(plan, folder, print, changes, snakemake.threads)  # a job that was killed goes on there
profiles = profiles_over_distance(folder)
table.to_csv(snakemake.output.table, index=False)
save_figure(plot_evolution(profiles, table), snakemake.output.figure, snakemake.output.svg)
