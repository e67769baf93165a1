"""Vehicles, planar and spatial, over speed: motion, response, cost."""

import sys

import pandas as pd

from study.speeds.figures import HUNTING, RESPONSE, over_speed
from study.speeds.tables import cost_table
from wrcore.analysis.legible import save_figure

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
tables = dict(zip(snakemake.params.titles.values(), map(pd.read_csv, snakemake.input.speeds), strict=True))
linear = [pd.read_csv(path).set_index("variant").loc["spatial"] for path in snakemake.input.linear]
titles = [snakemake.params.titles[vehicle] for vehicle in snakemake.params.with_linear]
critical = dict(zip(titles, (row["critical_speed_m_per_s"] for row in linear), strict=True))
save_figure(over_speed(tables, snakemake.params.released, HUNTING, critical), *snakemake.output[:2])
save_figure(over_speed(tables, snakemake.params.disturbed, RESPONSE, critical), *snakemake.output[2:4])
job_seconds = [pd.read_csv(path, sep="\t")["s"].iloc[0] for path in snakemake.input.benchmarks]
cost_table(tables, dict(zip(tables, job_seconds, strict=True))).to_csv(snakemake.output[4], index=False)
