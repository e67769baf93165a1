"""The contact search against a dense one at random poses."""

import sys

from wrcore.analysis_contact import pair_geometry, study_pair
from wrcore.analysis_contact_search import search_table

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
geometry = pair_geometry(study_pair(snakemake.params.pair))
search_table(geometry, **snakemake.params.settings).to_csv(snakemake.output[0], index=False)
