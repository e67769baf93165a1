"""Plot traction, stick and slip areas of some cases of rolling contact."""

import sys

from study.creep.figures import fig_creep_traction
from wrcore.analysis.legible import save_figure
from wrcore.contact.rolling.ellipse import RollingContact

sys.stdout = sys.stderr = open(snakemake.log[0], "w", buffering=1)
params = snakemake.params
fields = {}
for case in params.cases:
    patch = (case["a_over_b"], case["psi"], params.nu)
    fields[case["title"]] = RollingContact(*patch, params.level).field(*case["creepages"])
save_figure(fig_creep_traction(fields), *snakemake.output)
