"""One vehicle with one patch model: limit cycle, and forces and wear on irregular track."""

import os
import sys

from study.patch.runs import model_runs

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
settings, source = snakemake.params.settings, snakemake.input.scene
table = os.path.relpath(snakemake.input.table[0], os.path.dirname(source))
changes = snakemake.params.overrides
own = any(change.startswith("contact.creep.planes=") for change in changes)  # builds, or finds, a table of its own
row = model_runs(
    source, [*([] if own else [f"contact.creep.table={table}"]), *changes], **settings, start=snakemake.params.start
)
row.insert(0, "vehicle", snakemake.wildcards.hunter)
row.insert(1, "model", snakemake.wildcards.patch)
row.to_csv(snakemake.output[0], index=False)
print(row.T.to_string())
