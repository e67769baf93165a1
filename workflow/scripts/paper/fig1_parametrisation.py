"""Fig. 1: surfaces and their coordinates."""

import sys

from study.paper.figures import fig1_parametrisation
from study.report.legible import save_figure
from wrcore.scene.description import load_scene

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
save_figure(fig1_parametrisation(load_scene(snakemake.input.scene)), *snakemake.output)
