"""Cost per run and per right-hand-side call."""

import sys

import pandas as pd

from study.paper.tables import timing_table

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
timing_table(pd.read_csv(snakemake.input.samples[0])).to_csv(snakemake.output[0], index=False)
