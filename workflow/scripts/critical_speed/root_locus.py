"""Modes of one vehicle over speed, its modes at one speed in full, and what its linear critical speed depends on."""

import os
import sys

import numpy as np

from study.critical_speed.tables import loci
from wrcore.analysis.stability.stability import critical_speeds, modes
from wrcore.scene.description import load_scene

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
source, params, output = snakemake.input.scene, snakemake.params, snakemake.output
table = os.path.relpath(snakemake.input.table[0], os.path.dirname(source))
scenes = {}
for name, changes in params.variants.items():
    own = any(change.startswith(("contact.creep.tolerance=", "contact.creep.planes=")) for change in changes)
    shared = [] if own else [f"contact.creep.table={table}"]
    scenes[name] = load_scene(source, [*shared, "initial.y=0.0", *params.overrides, *changes])
speeds = np.linspace(**params.speeds)
locus = loci({name: scenes[name] for name in ("planar", "spatial")}, speeds)
linear = critical_speeds(scenes, np.linspace(**params.search))
shown, shapes = modes(scenes["spatial"], params.shown)
for name, content in (("locus", locus), ("linear", linear), ("shown", shown), ("shapes", shapes)):
    content.to_csv(output[name], index=False)
