"""Run one case's spatial twins: with tighter tolerances, and started on the other side of the track."""

import sys

from study.creep_table import with_creep_table
from wrcore.run.output.files import write_run
from wrcore.run.simulate import simulate
from wrcore.scene.description import load_scene

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
overrides = with_creep_table(snakemake.input.scene, snakemake.params.overrides, snakemake.input.table[0])
overrides = [*overrides, "contact.detection=spatial"]
start = load_scene(snakemake.input.scene, overrides).data["initial"]["y"]
twins = {
    "tight": [f"integration.{key}={snakemake.params.twins[key]}" for key in ("rtol", "atol")],
    "mirrored": [f"initial.y={-start}"],
}
for name, changes in twins.items():
    run = simulate(load_scene(snakemake.input.scene, overrides + changes))
    print(name, run.status, run.reason, run.counters)
    write_run(snakemake.output[name], run)
