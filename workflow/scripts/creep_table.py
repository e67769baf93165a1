"""Build the creep table that every run reads."""

import sys

from snakemake.script import snakemake
from wrcore.creep.table import build_table

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
build_table(snakemake.output[0], **snakemake.params.settings, progress=True)
