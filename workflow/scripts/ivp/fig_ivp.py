"""Error against work and drift of the constraints in the Test Set's wheelset."""

import sys

import pandas as pd

from study.ivp.figures import fig_ivp_constraints, fig_ivp_work_precision
from study.ivp.problem import read_problem
from wrcore.analysis.legible import save_figure

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
tables, output = snakemake.input, snakemake.output
effort = read_problem(tables.problem).reference.effort
for path, figure in (
    (output.work_precision, fig_ivp_work_precision(pd.read_csv(tables.work_precision), effort, snakemake.params.bar)),
    (output.constraints, fig_ivp_constraints(pd.read_csv(tables.history))),
):
    save_figure(figure, path, path.replace(".png", ".svg"))
