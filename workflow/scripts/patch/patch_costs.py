"""Cost of a patch with each model, all in turn, nothing beside them."""

import sys

from study.patch.costs import patch_costs

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
settings, source = snakemake.params.settings, snakemake.input.scene
costs = patch_costs(source, snakemake.params.overrides, snakemake.params.models, settings["states"], settings["passes"])
costs.to_csv(snakemake.output[0], index=False)
print(costs.to_string())
