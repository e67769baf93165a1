"""Influences on worn profiles, each variant against the first."""

import sys
from pathlib import Path

from study.creep_table import plan_with_creep_table
from study.wear.figures import fig_influences
from study.wear.influences import influence_table, variant_changes, variant_depth
from wrcore.analysis.legible import save_figure
from wrcore.analysis.wear.evolve import load_wear_plan, plan_mark

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
plan, settings, found = snakemake.input.plan, snakemake.params.settings, {}
for name, variant in settings["variants"].items():
    changes = variant_changes(variant, settings["distance"])
    changes = plan_with_creep_table(plan, changes, snakemake.input.table[0])
    copies = variant.get("copies", 1)
    mark = plan_mark(*load_wear_plan(plan, changes))[:12]
    folder = Path(snakemake.output.table).with_name("influences") / f"{mark}_{copies}"
    found[name] = variant_depth(plan, changes, folder, copies)
    print(name, found[name][2].iloc[-1].to_dict())
influences = influence_table(found)
influences.to_csv(snakemake.output.table, index=False)
print(influences.to_string())
figure = fig_influences({name: part[:2] for name, part in found.items()}, settings["distance"])
save_figure(figure, snakemake.output.figure, snakemake.output.svg)
