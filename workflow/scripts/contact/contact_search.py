"""The contact search against a dense one at random poses."""

import sys

from study.contact.search import search_table
from study.contact.tables import study_pair
from wrcore.analysis.contact import pair_geometry

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
geometry = pair_geometry(study_pair(snakemake.params.pair))
search_table(geometry, **snakemake.params.settings).to_csv(snakemake.output[0], index=False)
