# From real profiles to the paper's figures and timing table: snakemake --cores 2
# The same on a smaller problem, beside it:                   snakemake --cores 2 --configfile config/smoke.yaml
from snakemake.utils import min_version

min_version("9.20")


configfile: "config/study.yaml"


include: "workflow/rules/common.smk"
include: "workflow/rules/creep.smk"
include: "workflow/rules/paper.smk"
include: "workflow/rules/contact.smk"
include: "workflow/rules/ivp.smk"
include: "workflow/rules/speeds.smk"
include: "workflow/rules/critical_speed.smk"
include: "workflow/rules/patch.smk"
include: "workflow/rules/accuracy.smk"
include: "workflow/rules/cost.smk"
include: "workflow/rules/sweeps.smk"
include: "workflow/rules/hard_cases.smk"
include: "workflow/rules/wear.smk"
include: "workflow/rules/crossings.smk"
include: "workflow/rules/report.smk"


report: "workflow/report/overview.rst"


rule all:
    default_target: True
    input:
        rules.study.input,
        rules.report_pages.output,
        rules.report_archive.output,
