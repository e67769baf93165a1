"""Run one vehicle over all speeds, on all tracks, planar and spatial; keep the runs that figures show."""

import sys

from study.creep_table import with_creep_table
from study.speeds.sweep import sweep_speeds
from study.speeds.tables import speed_table
from wrcore.run.output.files import write_run

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
overrides = with_creep_table(snakemake.input.scene, snakemake.params.overrides, snakemake.input.table[0])
speeds = snakemake.params.speeds
runs = sweep_speeds(snakemake.input.scene, overrides, speeds, snakemake.params.tracks)
speed_table(runs).to_csv(snakemake.output.speeds, index=False)
for (track, detection, speed), path in zip(snakemake.params.shown, snakemake.output.shown, strict=True):
    write_run(path, runs[detection, track][speeds.index(speed)])
