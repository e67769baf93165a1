"""Vehicles with every patch model beside exact contact: one table."""

import sys

import pandas as pd

from study.patch.runs import compared, linear_speeds

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
params = snakemake.params
rows = pd.concat(map(pd.read_csv, snakemake.input.rows), ignore_index=True)
speeds = linear_speeds(pd.read_csv(snakemake.input.variants), params.titles, params.variants)
critical = [speeds.get(key, float("nan")) for key in zip(rows["vehicle"], rows["model"], strict=True)]
rows.insert(2, "linear_critical_speed_m_per_s", critical)
compared(rows, params.exact).to_csv(snakemake.output[0], index=False)
print(compared(rows, params.exact).T.to_string())
