"""Run one case with planar and with spatial detection."""

import sys

from wrcore.results import write_run
from wrcore.scene import load_scene
from wrcore.simulate import simulate

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
for detection, path in snakemake.output.items():
    overrides = [*snakemake.params.overrides, f"contact.detection={detection}"]
    run = simulate(load_scene(snakemake.input.scene, overrides))
    print(detection, run.status, run.reason, run.counters)
    write_run(path, run)
