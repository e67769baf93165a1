"""Vehicle files as a page of the report."""

import sys
from pathlib import Path

from study.speeds.vehicle_page import vehicle_page

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
Path(snakemake.output[0]).write_text(vehicle_page(snakemake.input.vehicles), encoding="utf-8")
