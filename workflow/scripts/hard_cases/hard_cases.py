"""One family of hard cases: the table of its checks, and the curves that figures show."""

import json
import os
import sys

from study.hard_cases.study import run_family

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
vehicles = {}
for name, entry in snakemake.params.vehicles.items():
    table = os.path.relpath(snakemake.input.table[0], os.path.dirname(entry["scene"]))
    vehicles[name] = {**entry, "set": {**entry["set"], "contact.creep.table": table}}
found, curves = run_family(snakemake.wildcards.family, vehicles, dict(snakemake.params.settings))
found.to_csv(snakemake.output.table, index=False)
with open(snakemake.output.curves, "w") as file:
    json.dump(curves, file)
