"""What was found of the patch models, as tables in Markdown."""

import sys
from pathlib import Path

import pandas as pd

from study.patch.page import page

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
text = page(*(pd.read_csv(snakemake.input[name]) for name in ("summary", "conicity", "contact", "models")))
Path(snakemake.output[0]).write_text(text, encoding="utf-8")
