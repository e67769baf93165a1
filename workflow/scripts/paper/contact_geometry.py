"""Rigid geometry of the wheel-rail pair: wheelset height and rolling radii over the lateral position."""

import sys

from study.paper.tables import geometry_table
from wrcore.scene.description import load_scene

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
geometry_table(load_scene(snakemake.input.scene), snakemake.params.y).to_csv(snakemake.output[0], index=False)
