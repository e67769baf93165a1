"""Time all creep laws, tables and levels of the exact solver in turn, without other jobs on the machine."""

import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # the job reserves all cores, computes on one; set before scipy loads

import sys  # noqa: E402
from pathlib import Path  # noqa: E402

from study.creep.laws import ReferenceCases, read_reference, time_models
from wrcore.analysis.creep_curves import creep_models
from wrcore.creep.table import load_table  # noqa: E402

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
params = snakemake.params
models = creep_models(params.nu, {Path(p).stem: load_table(p) for p in snakemake.input.tables}, params.grids)
cases = ReferenceCases(*(values[:: params.every] for values in read_reference(params.reference)["ellipse"]))
time_models(models, cases, params.nu, params.levels, params.passes).to_csv(snakemake.output[0], index=False)
