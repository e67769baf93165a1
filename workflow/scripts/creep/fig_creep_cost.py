"""Plot computing time over error of all creep laws and of CONTACT."""

import sys

import pandas as pd

from study.creep.figures import fig_creep_cost
from study.creep.laws import contact_points
from wrcore.analysis.legible import save_figure

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
figure = fig_creep_cost(pd.read_csv(snakemake.input.laws), contact_points(snakemake.params.reference))
save_figure(figure, *snakemake.output)
