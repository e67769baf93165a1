"""Plot the modes of one vehicle at one speed."""

import sys

import pandas as pd

from wrcore.analysis.legible import save_figure
from wrcore.analysis.pictures.plot_response import fig_modes

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
title = f"{snakemake.wildcards.vehicle.replace('_', ' ')}, {snakemake.params.speed:g} m/s"
save_figure(fig_modes(pd.read_csv(snakemake.input.modes), title), *snakemake.output)
