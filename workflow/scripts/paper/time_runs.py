"""Time planar and spatial runs in pairs, with nothing beside them."""

import sys
from functools import partial

from study.creep_table import with_creep_table
from study.paper.tables import time_runs
from wrcore.scene.description import load_scene

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
params = snakemake.params


def scene_of(scene, changes, detection, repetition):
    """Scene of one run of a pair; each repetition starts a little further aside."""
    start = load_scene(scene, changes).data["initial"]["y"] + params.shift * (repetition - 1)
    return load_scene(scene, [*changes, f"contact.detection={detection}", f"initial.y={start}"])


cases = {}
for case, (scene, overrides) in params.cases.items():
    changes = with_creep_table(scene, overrides, snakemake.input.table[0])
    cases[case] = partial(scene_of, scene, changes)
    if case in params.first:
        short = f"integration.duration={params.first[case]}"
        cases[f"{case}, first {params.first[case]:g} s"] = partial(scene_of, scene, [*changes, short])
time_runs(cases, params.repetitions).to_csv(snakemake.output[0], index=False)
