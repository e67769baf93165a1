"""The Test Set's wheelset: values at the end, error against work, effect of stabilisation, drift over time."""

import sys

from study.ivp.problem import read_problem
from study.ivp.runs import solve, stabilisation_table, value_table, violation_history, work_precision

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
settings, output = snakemake.params.settings, snakemake.output
problem = read_problem(snakemake.input.problem)
parameters, drift = settings["baumgarte"], settings["drift"]
work = {key: settings[key] for key in ("tolerances", "repetitions", "feedback")}
for path, table in (
    (output.work_precision, work_precision(problem, **work)),
    (output.stabilisation, stabilisation_table(problem, parameters, settings["stabilisation_tolerances"])),
    (output.values, value_table(problem, solve(problem, **settings["values"]))),
    (output.history, violation_history(problem, parameters, drift["rtol"], drift["points"])),
):
    table.to_csv(path, index=False)
