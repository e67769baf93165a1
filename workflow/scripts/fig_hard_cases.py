"""One figure of the hard cases."""

import json
import sys
from pathlib import Path

from wrcore.figures import save_figure
from wrcore.figures_hard_cases import FIGURES

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
family, figure = FIGURES[snakemake.wildcards.hard_figure]
path = next(path for path in map(Path, snakemake.input.curves) if path.name == f"{family}_curves.json")
save_figure(figure(json.loads(path.read_text())), *snakemake.output)
