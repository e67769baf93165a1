"""Fig. 2: points on the profiles."""

import sys

from study.paper.figures import fig2_profiles
from study.report.legible import save_figure
from wrcore.scene.description import load_scene

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
scene = load_scene(snakemake.input.scene)
save_figure(fig2_profiles(scene.wheel, scene.rail), *snakemake.output)
