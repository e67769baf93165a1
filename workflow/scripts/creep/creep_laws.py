"""Combine errors and computing time of all creep laws in one table."""

import sys
from pathlib import Path

import pandas as pd

from study.creep.laws import laws_markdown, laws_table

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
tables = pd.concat([pd.read_csv(path) for path in snakemake.input.tables])
laws = laws_table(pd.read_csv(snakemake.input.errors[0]), pd.read_csv(snakemake.input.costs[0]), tables)
laws.to_csv(snakemake.output[0], index=False)
Path(snakemake.output[1]).write_text(laws_markdown(laws))
