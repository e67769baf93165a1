"""Time evaluations and runs over number of wheelsets, duration, tolerance and simultaneous scenes."""

import sys

import pandas as pd

from study.cost.chains import over_chains
from study.cost.growth import cache_sizes, findings, over_runs, over_scenes, over_wheelsets
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
scenes, settings, output = snakemake.params.scenes, snakemake.params.settings, snakemake.output
trains = pd.concat([over_wheelsets(*scenes[train["scene"]], **train["size"]) for train in settings["trains"].values()])
runs = over_runs(*scenes[settings["runs"]["scene"]], **settings["runs"]["size"])
_, source, overrides = scenes[settings["chains"]["scene"]]
base, _ = compile_scene(load_scene(source, overrides))
chains = over_chains(base, **settings["chains"]["size"])
together = over_scenes(*scenes[settings["simultaneous"]["scene"]], **settings["simultaneous"]["size"])
for path, table in (
    (output.wheelsets, trains),
    (output.runs, runs),
    (output.simultaneous, together),
    (output.chains, chains),
    (output.findings, findings(trains, cache_sizes())),
):
    table.to_csv(path, index=False)
    print(table.to_string())
