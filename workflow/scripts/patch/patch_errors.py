"""Patch models against exact contact, pose by pose: tables and figures."""

import sys

import numpy as np
import pandas as pd

from study.contact.tables import study_pair
from study.patch import figures, tables
from wrcore.analysis.legible import save_figure

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
settings, output = snakemake.params.settings, snakemake.output
geometry = study_pair(snakemake.params.pair).left.geometry
models, rolling, shown = settings["models"], settings["rolling"], settings["shown"]
shifts = np.linspace(**settings["shifts"])
places, forces = tables.pose_errors(geometry, models, settings["loads"], shifts, rolling)
differences = tables.radius_differences(places)
conicity = tables.conicity_under_load(differences, settings["amplitudes"])
summary = tables.summary(places, forces, settings["zones"], pd.read_csv(snakemake.input.costs))
for name, table in (("places", places), ("forces", forces), ("differences", differences), ("conicity", conicity),
                    ("summary", summary)):  # fmt: skip
    table.to_csv(output[name], index=False)
print(summary.to_string(), conicity.to_string(), sep="\n")
pair = {"exact contact": models[tables.REFERENCE], shown["model"]: models[shown["model"]]}
how = {"speed": rolling["speed"], "friction": rolling["friction"], "creepage": shown["creepage"]}
for path, figure in (
    (output.errors_figure, figures.fig_patch_errors(places, shown["load"])),
    (output.patches_figure, figures.fig_patches(geometry, pair, shown["load"], shown["shifts"], how)),
):
    save_figure(figure, path, path.replace(".png", ".svg"))
