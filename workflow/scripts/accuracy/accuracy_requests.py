"""Test whether runs reach the requested accuracy on random scenes, by two tight runs of each scene."""

import sys

import pandas as pd

from study.accuracy.requests import judged, random_scene, summary
from study.creep_table import with_creep_table

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
settings, parts = snakemake.params.settings, []
for seed in range(settings["first"], settings["first"] + settings["count"]):
    kind, changes = random_scene(seed, settings["seconds"])
    source = f"config/scenes/{kind}.yaml"
    changes = with_creep_table(source, changes, snakemake.input.table[0])
    rows = judged(source, changes, settings["of"], settings["tight"])
    print(seed, kind, changes, rows.to_string(), sep="\n")
    parts.append(rows.assign(seed=seed, kind=kind, changes=str(changes)))
table = pd.concat(parts, ignore_index=True)
table.to_csv(snakemake.output.rows, index=False)
summary(table).to_csv(snakemake.output.summary, index=False)
print(summary(table).to_string())
