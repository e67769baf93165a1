"""Fig. 1: surfaces and their coordinates."""

import sys

from wrcore.figures import fig1_parametrisation, save_figure
from wrcore.scene import load_scene

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
save_figure(fig1_parametrisation(load_scene(snakemake.input.scene)), *snakemake.output)
