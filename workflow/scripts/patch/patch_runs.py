"""One vehicle with one patch model: limit cycle, and forces and wear on irregular track."""

import sys

from study.creep_table import with_creep_table
from study.patch.runs import model_runs

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
settings, source = snakemake.params.settings, snakemake.input.scene
changes = with_creep_table(source, snakemake.params.overrides, snakemake.input.table[0])
row = model_runs(source, changes, **settings, start=snakemake.params.start)
row.insert(0, "vehicle", snakemake.wildcards.hunter)
row.insert(1, "model", snakemake.wildcards.patch)
row.to_csv(snakemake.output[0], index=False)
print(row.T.to_string())
