"""Measure time, operations and bytes of one evaluation by stage, and the limits of the machine."""

import sys

import pandas as pd

from study.cost.figures import fig_breakdown
from study.cost.stages import breakdown, limits, with_limits
from wrcore.analysis.legible import save_figure
from wrcore.scene.description import load_scene

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
settings, output = snakemake.params.settings, snakemake.output
found = limits(settings["size"]["passes"])
chosen = map(snakemake.params.scenes.get, settings["scenes"])
tables = [breakdown(title, load_scene(path, changes), **settings["size"]) for title, path, changes in chosen]
table = with_limits(tables, found)
table.to_csv(output.stages, index=False)
pd.DataFrame([found]).to_csv(output.limits, index=False)
save_figure(fig_breakdown(table), output.png, output.svg)
print(found, table.to_string())
