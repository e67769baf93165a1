"""Time all creep laws, tables and levels in turn, with nothing beside them."""

import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # the job holds all cores but computes on one; read when scipy is loaded

import sys  # noqa: E402
from pathlib import Path  # noqa: E402

from study.creep.laws import ReferenceCases, creep_models, read_reference, time_models
from wrcore.creep.table import load_table  # noqa: E402

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
params = snakemake.params
models = creep_models(params.nu, {Path(p).stem: load_table(p) for p in snakemake.input.tables}, params.grids)
cases = ReferenceCases(*(values[:: params.every] for values in read_reference(params.reference)["ellipse"]))
time_models(models, cases, params.nu, params.levels, params.passes).to_csv(snakemake.output[0], index=False)
