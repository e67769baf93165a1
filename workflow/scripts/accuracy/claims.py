"""Tabulate the errors that reports/accuracy.md states: median, 95 % and maximum."""

import sys
from pathlib import Path

import pandas as pd

from study.accuracy.claims import claims, claims_markdown

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
table = claims(*(pd.read_csv(snakemake.input[name]) for name in ("contact", "creep", "patch", "front")))
table.to_csv(snakemake.output.table, index=False)
Path(snakemake.output.text).write_text(claims_markdown(table), encoding="utf-8")
