"""Compare both reductions: continuity of the force, coexisting and merging patches, errors relative to CONTACT."""

import sys

import numpy as np
import pandas as pd

from study.contact import figures as figures_contact
from study.contact import tables as analysis_contact
from study.contact.reference import compare_with_contact, summarise
from wrcore.analysis.legible import save_figure

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
settings, output = snakemake.params.settings, snakemake.output
geometry = analysis_contact.study_pair(snakemake.params.pair).left.geometry
cases = compare_with_contact(geometry, pd.read_csv(snakemake.input.reference, comment="#"))
cases.to_csv(output.cases, index=False)
summarise(cases).to_csv(output.summary, index=False)
sweep = analysis_contact.lateral_sweep(geometry, max(settings["reaches"]), settings["step"], settings["load"])
analysis_contact.sweep_jumps(sweep, settings["reaches"]).to_csv(output.jumps, index=False)
lowering = np.linspace(**settings["lowering"])
patches = {
    pose["title"]: analysis_contact.force_over_height(geometry, pose["y"], pose["yaw"], lowering)
    for pose in settings["poses"]
}
pd.concat(patches, names=["pose"]).reset_index("pose").to_csv(output.patches, index=False)
for path, figure in (
    (output.sweep_figure, figures_contact.fig_lateral_sweep(sweep)),
    (output.patch_figure, figures_contact.fig_patch_forces(patches)),
):
    save_figure(figure, path, path.replace(".png", ".svg"))
