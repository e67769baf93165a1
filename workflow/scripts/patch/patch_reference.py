"""Patch models against CONTACT's loaded cases."""

import sys

import pandas as pd

from study.contact.tables import study_pair
from study.patch.reference import compare_with_contact, distributions

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
geometry = study_pair(snakemake.params.pair).left.geometry
reference = pd.read_csv(snakemake.input.reference, comment="#")
cases = compare_with_contact(geometry, reference, snakemake.params.models)
cases.to_csv(snakemake.output.cases, index=False)
distributions(cases).to_csv(snakemake.output.summary, index=False)
print(distributions(cases).to_string())
