"""One family of hard cases: the table of its checks, and the curves that figures show."""

import json
import sys

from study.hard_cases.study import run_family

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
vehicles = {name: {**entry, "table": snakemake.input.table[0]} for name, entry in snakemake.params.vehicles.items()}
found, curves = run_family(snakemake.wildcards.family, vehicles, dict(snakemake.params.settings))
found.to_csv(snakemake.output.table, index=False)
with open(snakemake.output.curves, "w") as file:
    json.dump(curves, file)
