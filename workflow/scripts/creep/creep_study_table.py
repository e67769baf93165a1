"""Build one creep table of the study and record its computing time."""

import sys
from functools import partial

import pandas as pd
from tqdm import tqdm

from study.creep.laws import timed_table
from wrcore.creep.table import write_table

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
table, row = timed_table(**snakemake.params.settings, progress=partial(tqdm, mininterval=5))
print(row)
write_table(snakemake.output.table, table)
pd.DataFrame([row]).to_csv(snakemake.output.cost, index=False)
