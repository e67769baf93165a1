"""Compute limit cycles of one vehicle at falling speed (large disturbance) and at rising speed (small disturbance)."""

import sys

from study.creep_table import with_creep_table
from wrcore.analysis.stability.limit_cycles import Settling, limit_cycles
from wrcore.scene.description import load_scene

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
params, source = snakemake.params, snakemake.input.scene
settings = dict(params.settings)
overrides = with_creep_table(source, params.overrides, snakemake.input.table[0])
changes = [*overrides, "initial.y=0.0", f"contact.detection={snakemake.wildcards.detection}"]
settling = Settling(**settings.pop("settling"))
cycles = limit_cycles(load_scene(source, changes), params.speeds, settling, **settings)
if cycles.attrs.get("stopped"):
    raise KeyboardInterrupt  # the job must not save an incomplete table
cycles.insert(0, "detection", snakemake.wildcards.detection)
cycles.to_csv(snakemake.output[0], index=False)
