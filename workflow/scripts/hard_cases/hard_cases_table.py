"""The checks of all families of hard cases in one table, cases and known limits in short."""

import sys
from pathlib import Path

import pandas as pd

from study.hard_cases.study import known_limits, report_text, summary

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
found = pd.concat(map(pd.read_csv, snakemake.input.tables), ignore_index=True)
found.to_csv(snakemake.output.table, index=False)
summary(found).to_csv(snakemake.output.summary, index=False)
known_limits(found).to_csv(snakemake.output.limits, index=False)
Path(snakemake.output.text).write_text(report_text(found))
