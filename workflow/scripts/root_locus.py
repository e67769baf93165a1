"""Modes of one vehicle over speed with planar and with spatial detection, and its modes at one speed in full."""

import os
import sys

import numpy as np

from wrcore.analysis_stability import modes_in_full, stability_over_speed
from wrcore.scene import load_scene

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
source, params, output = snakemake.input.scene, snakemake.params, snakemake.output
table = os.path.relpath(snakemake.input.table[0], os.path.dirname(source))
overrides = [f"contact.creep.table={table}", "initial.y=0.0"]
scenes = {name: load_scene(source, [*overrides, f"contact.detection={name}"]) for name in ("planar", "spatial")}
locus, linear = stability_over_speed(scenes, np.linspace(**params.speeds))
shown, shapes = modes_in_full(scenes["spatial"], params.shown)
for name, content in (("locus", locus), ("linear", linear), ("shown", shown), ("shapes", shapes)):
    content.to_csv(output[name], index=False)
