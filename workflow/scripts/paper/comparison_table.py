"""Published values beside ours."""

import sys
from pathlib import Path

import pandas as pd

from study.paper.tables import comparison_table, our_values

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
tables = (pd.read_csv(snakemake.input[name][0]) for name in ("geometry", "motion", "timing"))
table = comparison_table(
    pd.read_csv(snakemake.input.reference, comment="#"), our_values(*tables, snakemake.params.case)
)
table.to_csv(snakemake.output[0], index=False)
rounded = table.astype(object).where(table.notna(), "")
Path(snakemake.output[1]).write_text(rounded.to_markdown(index=False, floatfmt=".6g") + "\n")
