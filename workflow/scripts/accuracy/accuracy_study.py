"""Run and time every choice on one scene; compare with the reference, a tight run of its model and exact contact."""

import sys

from wrcore.analysis.accuracy.choices import combinations, reference_row, reference_runs, run_choices
from wrcore.analysis.accuracy.models import reference_choice, twins, with_model_errors
from wrcore.run.output.files import load_run

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
settings = snakemake.params.settings
until = settings["until"] or float("inf")
source = (snakemake.input.scene, settings["overrides"])
scene, run, twin = reference_runs(*source, settings["reference"])
reference_row(scene, run, twin, until).to_csv(snakemake.output.reference, index=False)
choices = combinations(settings["grids"])
tight = twins(*source, choices, (reference_choice(settings["reference"]), run), **settings["twins"])
exact = load_run(snakemake.input.exact[0]) if snakemake.input.exact else None
table = run_choices(*source, choices, run, until, settings["repetitions"], twins=tight)
table = with_model_errors(table, tight, exact)
table.to_csv(snakemake.output.choices, index=False)
print(table.to_string())
