"""Compute modes of one vehicle over speed, its modes at one speed, and linear critical speeds of its variants."""

import sys

import numpy as np

from study.creep_table import with_creep_table
from study.critical_speed.tables import loci
from wrcore.analysis.stability.stability import critical_speeds, modes
from wrcore.scene.description import load_scene

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
source, params, output = snakemake.input.scene, snakemake.params, snakemake.output
scenes = {}
for name, changes in params.variants.items():
    overrides = ["initial.y=0.0", *params.overrides, *changes]
    scenes[name] = load_scene(source, with_creep_table(source, overrides, snakemake.input.table[0]))
speeds = np.linspace(**params.speeds)
locus = loci({name: scenes[name] for name in ("planar", "spatial")}, speeds)
linear = critical_speeds(scenes, np.linspace(**params.search))
shown, shapes = modes(scenes["spatial"], params.shown)
for name, content in (("locus", locus), ("linear", linear), ("shown", shown), ("shapes", shapes)):
    content.to_csv(output[name], index=False)
