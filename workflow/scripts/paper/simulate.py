"""Run one case with planar and with spatial detection."""

import sys

from study.creep_table import with_creep_table
from wrcore.run.output.files import write_run
from wrcore.run.simulate import simulate
from wrcore.scene.description import load_scene

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
overrides = with_creep_table(snakemake.input.scene, snakemake.params.overrides, snakemake.input.table[0])
for detection, path in snakemake.output.items():
    run = simulate(load_scene(snakemake.input.scene, [*overrides, f"contact.detection={detection}"]))
    print(detection, run.status, run.reason, run.counters)
    write_run(path, run)
