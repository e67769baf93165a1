"""Time planar and spatial runs in turn, with nothing beside them."""

import sys

from wrcore.analysis import time_runs
from wrcore.scene import load_scene

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
cases = {
    case: {d: load_scene(scene, [*overrides, f"contact.detection={d}"]) for d in ("planar", "spatial")}
    for case, (scene, overrides) in snakemake.params.cases.items()
}
time_runs(cases, snakemake.params.repetitions).to_csv(snakemake.output[0], index=False)
