"""Figures of the hard cases."""

import json
import sys
from pathlib import Path

from study.hard_cases.figures import FIGURES
from wrcore.analysis.legible import save_figure

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
paths = map(Path, snakemake.input.curves)
curves = {path.name.removesuffix("_curves.json"): json.loads(path.read_text()) for path in paths}
for (name, (family, figure)), svg in zip(FIGURES.items(), snakemake.output.svg, strict=True):
    save_figure(figure(curves[family]), snakemake.output[name], svg)
