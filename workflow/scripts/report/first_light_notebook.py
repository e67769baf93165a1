"""Execute the notebook on this study's runs; the copy holds no times and no paths."""

import os
import sys
from pathlib import Path

import nbformat
from nbclient import NotebookClient

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
os.environ["WRCORE_RUNS"] = str(Path(snakemake.input.runs[0]).resolve().parent.parent)
notebook = nbformat.read(snakemake.input.notebook, as_version=4)
NotebookClient(notebook, record_timing=False).execute()
nbformat.write(notebook, snakemake.output[0])
