"""Run one case with planar and with spatial detection."""

import os
import sys

from wrcore.run.results import write_run
from wrcore.run.simulate import simulate
from wrcore.scene.description import load_scene

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
# a scene names files relative to its own folder
table = os.path.relpath(snakemake.input.table[0], os.path.dirname(snakemake.input.scene))
overrides = [*snakemake.params.overrides, f"contact.creep.table={table}"]
for detection, path in snakemake.output.items():
    run = simulate(load_scene(snakemake.input.scene, [*overrides, f"contact.detection={detection}"]))
    print(detection, run.status, run.reason, run.counters)
    write_run(path, run)
