"""Build the default creep table of the study's runs."""

import sys
from functools import partial

from tqdm import tqdm

from wrcore.creep.table import build_table, table_info, write_table

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
table = build_table(**snakemake.params.settings, progress=partial(tqdm, mininterval=5))
print(table_info(table))
write_table(snakemake.output[0], table)
