"""What planar detection misses, over yaw and contact angle."""

import sys

import numpy as np

from wrcore.analysis_contact import pair_geometry, planar_error_map, study_pair
from wrcore.figures import save_figure
from wrcore.figures_contact import fig_planar_error

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
settings = snakemake.params.settings
shifts, yaws = (np.linspace(**settings[name]) for name in ("shifts", "yaws"))
table = planar_error_map(pair_geometry(study_pair(snakemake.params.pair)), shifts, yaws, settings["load"])
table.to_csv(snakemake.output.table, index=False)
save_figure(fig_planar_error(table), snakemake.output.figure, snakemake.output.svg)
