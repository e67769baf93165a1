"""Forces of each wheel on irregular track, over time and in a table."""

import sys

import pandas as pd

from wrcore.analysis.assessment.wheels import wheel_table
from wrcore.analysis.legible import save_figure
from wrcore.analysis.pictures.plot_motion import guiding_forces
from wrcore.run.output.files import load_run

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
run = load_run(snakemake.input.run)
linear = None
if snakemake.input.linear:
    variants = pd.read_csv(snakemake.input.linear[0]).set_index("variant")
    linear = variants.loc["spatial", "critical_speed_m_per_s"]
save_figure(guiding_forces(run, f"{run.scene['speed']:g} m/s on irregular track", linear), *snakemake.output[:2])
wheel_table(run, 0.5 * run.t[-1]).to_csv(snakemake.output[2], index=False)
