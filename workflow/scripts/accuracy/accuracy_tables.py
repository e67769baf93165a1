"""Build the creep tables that the study compares before the timed runs, which then only load them."""

import sys

from wrcore.creep.table import ensure_table

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
for creep in snakemake.params.creeps:
    law, _, tolerance = creep.partition(" ")
    if law == "table":
        table = ensure_table(snakemake.params.nu, "ellipse", float(tolerance))
        print(creep, table)
