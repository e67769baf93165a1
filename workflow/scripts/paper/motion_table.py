"""How the wheelset moves in each case, and how planar and spatial detection compare."""

import sys

from study.paper.tables import motion_table
from wrcore.run.output.files import load_runs

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
paths = snakemake.input.planar + snakemake.input.spatial + snakemake.input.tight + snakemake.input.mirrored
motion_table(load_runs(paths), snakemake.params.bound).to_csv(snakemake.output[0], index=False)
