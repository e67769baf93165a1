"""Compare the contact search with a dense search at random positions of a wheelset."""

import sys

from study.contact.search import search_table
from study.contact.tables import study_pair

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
geometry = study_pair(snakemake.params.pair).left.geometry
search_table(geometry, **snakemake.params.settings).to_csv(snakemake.output[0], index=False)
