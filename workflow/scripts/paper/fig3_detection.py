"""Fig. 3: planar and spatial detection at one pose."""

import sys

from study.paper.figures import fig3_detection
from study.report.legible import save_figure
from wrcore.scene.description import load_scene

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
save_figure(fig3_detection(load_scene(snakemake.input.scene), **snakemake.params.pose), *snakemake.output)
