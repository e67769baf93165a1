"""Compute errors of all creep laws, tables and levels of the exact solver in CONTACT's cases."""

import sys
from pathlib import Path

from study.creep.laws import error_table, read_reference
from wrcore.analysis.creep_curves import creep_models
from wrcore.creep.table import load_table

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
params = snakemake.params
models = creep_models(params.nu, {Path(p).stem: load_table(p) for p in snakemake.input.tables}, params.grids)
errors = error_table(read_reference(params.reference), models, params.nu, params.levels)
errors.to_csv(snakemake.output[0], index=False)
