"""A loaded wheel on its rail, with its patch."""

import sys

from study.contact.tables import study_pair
from wrcore.analysis.legible import save_figure
from wrcore.analysis.pictures.plot_patch import plot_wheel_on_rail

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
shown, rolling = snakemake.params.shown, snakemake.params.rolling
pose = {"y": shown["picture"], "load": shown["load"], "speed": rolling["speed"], "mu": rolling["friction"]}
pose["resolution"] = "fine"
save_figure(plot_wheel_on_rail(study_pair(snakemake.params.pair), **pose), *snakemake.output)
