"""Execute a notebook in its folder; the copy holds no times and no paths."""

import os
import sys
from pathlib import Path

import nbformat
from nbclient import NotebookClient

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
os.environ["WRCORE_PROGRESS"] = "0"  # a bar would end up in the copy
source = Path(snakemake.input.notebook)
notebook = nbformat.read(source, as_version=4)
NotebookClient(notebook, record_timing=False, resources={"metadata": {"path": str(source.parent)}}).execute()
nbformat.write(notebook, snakemake.output[0])
