"""Run the benchmarks and record the machine."""

import sys

import pandas as pd

from study.cost.pairs import benchmark_table
from study.cost.timing import machine

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
found = machine()
table = benchmark_table(snakemake.params.scenes, snakemake.params.settings)
table.to_csv(snakemake.output.pairs, index=False)
pd.DataFrame([found]).to_csv(snakemake.output.machine, index=False)
print(table.to_string())
