"""Cells of the table of exact contact that one run fills: a table, and a figure."""

import sys

from study.patch.cells import fig_cells, filled_by_run, told
from wrcore.analysis.legible import save_figure

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
source, output = snakemake.input.scene, snakemake.output
cells, lobes = filled_by_run(source, snakemake.params.overrides)
cells.to_csv(output.cells, index=False)
print(told(cells).to_string())
save_figure(fig_cells(cells, lobes), output.figure, output.svg)
