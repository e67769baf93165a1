"""Compute and plot the contact of a wheel on the nose of a crossing for all patch models."""

import sys

import numpy as np

from study.crossings.figures import fig_nose
from study.crossings.nose import over_the_nose, summary, wheel_on_crossing
from wrcore.analysis.legible import save_figure
from wrcore.scene.description import load_scene

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
params, output = snakemake.params, snakemake.output
pair = wheel_on_crossing(load_scene(snakemake.input.scene))
table = over_the_nose(pair, params.models, np.linspace(**params.places), params.load, params.yaw)
table.to_csv(output.table, index=False)
summary(table).to_csv(output.summary, index=False)
print(summary(table).to_string())
save_figure(fig_nose(table), output.figure, output.svg)
