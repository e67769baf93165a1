"""Fig. 4: lateral position over time."""

import sys

from wrcore.analysis.legible import save_figure
from wrcore.analysis.motion import horizons
from wrcore.analysis.pictures.plot_motion import lateral_position
from wrcore.run.output.files import load_runs

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
cases = load_runs([*snakemake.input.planar, *snakemake.input.spatial, *snakemake.input.tight])
titled = {title: cases[case] for case, title in snakemake.params.titles.items()}
save_figure(lateral_position(titled, horizons(titled, snakemake.params.bound)), *snakemake.output)
