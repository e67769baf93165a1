"""Speed against error of all scenes: figure, Pareto front, recommended choices by accuracy, errors of models."""

import sys

import pandas as pd

from wrcore.analysis.accuracy.choices import front_table, recommendation_table
from wrcore.analysis.accuracy.models import model_table
from wrcore.analysis.accuracy.plot_choices import speed_against_error
from wrcore.analysis.legible import save_figure

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
given, titles = snakemake.input, snakemake.params.titles
tables = dict(zip(titles.values(), map(pd.read_csv, given.choices), strict=True))
references = dict(zip(titles.values(), map(pd.read_csv, given.references), strict=True))
exacts = {titles[name]: pd.read_csv(path) for name, path in zip(snakemake.params.exact, given.exacts, strict=True)}
doubts = {title: row["y_rms_m"].iloc[0] for title, row in references.items()}
resolved = {title: row["model_y_rms_m"].iloc[0] for title, row in exacts.items()}
save_figure(speed_against_error(tables, snakemake.params.finest, doubts, resolved), *snakemake.output[:2])
recommendation_table(tables, snakemake.params.accuracies).to_csv(snakemake.output[2], index=False)
front_table(tables, references).to_csv(snakemake.output[3], index=False)
model_table(tables, exacts).to_csv(snakemake.output[4], index=False)
