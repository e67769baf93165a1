"""Run one batch of a sweep in this process."""

import sys

from wrcore.sweep.batch import run_rows, write_table
from wrcore.sweep.plan import load_sweep

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
sweep = load_sweep(snakemake.input.sweep)
print(sweep, "batch", snakemake.wildcards.batch)
write_table(snakemake.output[0], run_rows(sweep, sweep.rows(int(snakemake.wildcards.batch)), snakemake.threads), sweep)
