"""Run every choice on one scene, timed, and compare it with the reference."""

import sys

from study.accuracy.errors import combinations, reference_row, reference_runs, study

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
settings = snakemake.params.settings
until = settings["until"] or float("inf")
source = (snakemake.input.scene, settings["overrides"])
scene, run, twin = reference_runs(*source, settings["reference"])
reference_row(scene, run, twin, until).to_csv(snakemake.output.reference, index=False)
table = study(*source, combinations(settings["grids"]), run, until, settings["repetitions"])
table.to_csv(snakemake.output.choices, index=False)
print(table.to_string())
