"""Fig. 4: lateral position over time."""

import sys

from wrcore.analysis import horizons
from wrcore.figures import fig4_lateral_position, save_figure
from wrcore.results import load_runs

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
cases = load_runs([*snakemake.input.planar, *snakemake.input.spatial, *snakemake.input.tight])
titled = {title: cases[case] for case, title in snakemake.params.titles.items()}
save_figure(fig4_lateral_position(titled, horizons(titled, snakemake.params.bound)), *snakemake.output)
