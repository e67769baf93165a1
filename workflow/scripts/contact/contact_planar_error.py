"""Compute and plot errors of planar detection over yaw and contact angle."""

import sys

import numpy as np

from study.contact.figures import fig_planar_error
from study.contact.tables import planar_error_map, study_pair
from wrcore.analysis.legible import save_figure

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
settings = snakemake.params.settings
shifts, yaws = (np.linspace(**settings[name]) for name in ("shifts", "yaws"))
table = planar_error_map(study_pair(snakemake.params.pair).left.geometry, shifts, yaws, settings["load"])
table.to_csv(snakemake.output.table, index=False)
save_figure(fig_planar_error(table), snakemake.output.figure, snakemake.output.svg)
