"""Plot root loci and limit cycles of the vehicles and tabulate their critical speeds."""

import sys

import pandas as pd

from study.critical_speed.figures import fig_limit_cycles, fig_root_locus
from study.critical_speed.tables import critical_table
from wrcore.analysis.legible import save_figure

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
titles, given, output = list(snakemake.params.titles.values()), snakemake.input, snakemake.output
loci, linear = (dict(zip(titles, map(pd.read_csv, paths), strict=True)) for paths in (given.loci, given.linear))
tables = [pd.read_csv(path) for path in given.cycles]  # planar and spatial of each vehicle in turn
cycles = {title: pd.concat(tables[2 * k : 2 * k + 2]) for k, title in enumerate(titles)}
critical_table(linear, cycles).to_csv(output.table, index=False)
pd.concat(linear, names=["vehicle"]).reset_index("vehicle").to_csv(output.variants, index=False)
save_figure(fig_root_locus(loci, linear), output.locus, output.svg[0])
save_figure(fig_limit_cycles(cycles, linear), output.cycles, output.svg[1])
