"""Speed against error of all scenes: figure, front, and what to choose for which accuracy."""

import sys

import pandas as pd

from study.accuracy.errors import front_table, recommendation_table
from study.accuracy.figures import speed_against_error
from wrcore.analysis.style import save_figure

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
titles = snakemake.params.titles.values()
tables = dict(zip(titles, map(pd.read_csv, snakemake.input.choices), strict=True))
references = dict(zip(titles, map(pd.read_csv, snakemake.input.references), strict=True))
doubts = {title: row["y_rms_m"].iloc[0] for title, row in references.items()}
save_figure(speed_against_error(tables, snakemake.params.finest, doubts), *snakemake.output[:2])
recommendation_table(tables, snakemake.params.accuracies).to_csv(snakemake.output[2], index=False)
front_table(tables, references).to_csv(snakemake.output[3], index=False)
