"""Rigid geometry of the wheel-rail pair: wheelset height and rolling radii over the lateral position."""

import sys

import pandas as pd
from snakemake.script import snakemake

from wrcore.contact import geometry_table
from wrcore.scene import load_scene

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
scene = load_scene(snakemake.input.scene)
pd.DataFrame(geometry_table(scene.geometry, snakemake.params.y)).to_csv(snakemake.output[0], index=False)
