"""Figures 1 to 3: surfaces and their coordinates, points on the profiles, planar and spatial detection."""

import sys

from study.paper.figures import fig1_parametrisation, fig2_profiles, fig3_detection
from wrcore.analysis.legible import save_figure
from wrcore.scene.description import load_scene

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
scene = load_scene(snakemake.input.scene)
draw = {
    "fig1_parametrisation": lambda: fig1_parametrisation(scene),
    "fig2_profiles": lambda: fig2_profiles(scene.wheel, scene.rail),
    "fig3_detection": lambda: fig3_detection(scene, **snakemake.params.pose),
}
save_figure(draw[snakemake.rule](), *snakemake.output)
