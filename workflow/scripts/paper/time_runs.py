"""Time planar and spatial runs in turn, with nothing beside them."""

import os
import sys

from study.paper.tables import time_runs
from wrcore.scene.description import load_scene

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
cases = {}
for case, (scene, overrides) in snakemake.params.cases.items():
    # a scene names files relative to its own folder
    table = os.path.relpath(snakemake.input.table[0], os.path.dirname(scene))
    changes = [*overrides, f"contact.creep.table={table}"]
    cases[case] = {d: load_scene(scene, [*changes, f"contact.detection={d}"]) for d in ("planar", "spatial")}
time_runs(cases, snakemake.params.repetitions).to_csv(snakemake.output[0], index=False)
