"""Measure the time of a batch of runs outside the integration, and the share of rejected steps."""

import sys

import numpy as np

from study.cost.runs import batch_table, rejection_table
from wrcore.scene.description import load_scene

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
scenes, batch, rejections = snakemake.params.scenes, snakemake.params.batch, dict(snakemake.params.rejections)
_, source, changes = scenes[batch["scene"]]
speeds = np.linspace(**batch["speeds"])
batch_table(source, changes, speeds, batch["passes"]).to_csv(snakemake.output.batch, index=False)
chosen = {title: load_scene(path, changes) for title, path, changes in map(scenes.get, rejections.pop("scenes"))}
rejection_table(chosen, **rejections).to_csv(snakemake.output.rejections, index=False)
