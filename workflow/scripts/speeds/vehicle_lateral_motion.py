"""Lateral motion of all wheelsets at the speeds that figures show."""

import sys

from wrcore.analysis.legible import save_figure
from wrcore.analysis.pictures.plot_motion import lateral_motion
from wrcore.run.output.files import load_run

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
runs = [load_run(path) for path in snakemake.input.runs]
titles = [f"{speed:g} m/s" for speed in snakemake.params.speeds]
pairs = zip(runs[::2], runs[1::2], strict=True)
titled = {title: {"planar": p, "spatial": s} for title, (p, s) in zip(titles, pairs, strict=True)}
save_figure(lateral_motion(titled), *snakemake.output)
