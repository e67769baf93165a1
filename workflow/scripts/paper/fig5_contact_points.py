"""Fig. 5: contact points on the rail and wheel profiles."""

import sys

from study.paper.figures import fig5_contact_points
from wrcore.analysis.legible import save_figure
from wrcore.analysis.motion import horizons
from wrcore.run.output.files import load_runs
from wrcore.scene.description import load_scene

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
scene = load_scene(snakemake.input.scene)
cases = load_runs([*snakemake.input.planar, *snakemake.input.spatial, *snakemake.input.tight])
horizon = horizons(cases, snakemake.params.bound)
((case, runs),) = cases.items()
save_figure(fig5_contact_points(runs, scene.wheel, scene.rail, horizon.get(case)), *snakemake.output)
