"""Run one scene with exact contact at two resolutions; the finer run is the reference for errors of models."""

import sys

from wrcore.analysis.accuracy.models import exact_row, exact_runs

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
settings, source = snakemake.params.settings, snakemake.input.scene
finer, coarser = exact_runs(source, settings["overrides"], settings["exact"], settings["duration"])
finer.save(snakemake.output.run)
exact_row(finer, coarser).to_csv(snakemake.output.table, index=False)
print(exact_row(finer, coarser).T.to_string())
