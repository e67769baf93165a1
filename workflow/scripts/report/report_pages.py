"""The study's report as plain pages in one reading order."""

import sys
from pathlib import Path

from study.report.site import write_site

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
results = Path(snakemake.output[0]).parent.parent
write_site(snakemake.params.marked, results, snakemake.params.config, "workflow/report")
