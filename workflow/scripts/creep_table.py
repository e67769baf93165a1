"""Build the creep table that every run reads."""

import sys

from snakemake.script import snakemake
from tqdm import tqdm

from wrcore.creep.table import build_table, table_info, write_table

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
table = build_table(**snakemake.params.settings, progress=tqdm)
print(table_info(table))
write_table(snakemake.output[0], table)
