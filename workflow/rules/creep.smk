# Creep laws and creep tables against the exact solver and against CONTACT: errors, costs, figures.
# CONTACT's cases are read where the tests keep them: one copy, whose provenance stands in its first line.

CREEP = config["creep"]
CREEP_TABLES = {table["name"]: table for table in CREEP["tables"]}
CREEP_REFERENCE = expand(
    "{folder}/{file}.csv",
    folder=CREEP["reference"],
    file=["contact_timing", "ellipse_cases", "kbt_extremes", "sdec_cases"],
)


wildcard_constraints:
    table="|".join(CREEP_TABLES),


rule creep_table:
    message: "Creep table by exact rolling contact"
    input:
        core=CORE["creep"],
    output:
        "<results>/creep/creep.h5",
    log: "<logs>/creep_table.log"
    benchmark: "<benchmarks>/creep_table.tsv"
    params:
        settings=config["creep"]["table"],
    script: "../scripts/creep/creep_table.py"


rule creep_study_table:
    message: "Creep table {wildcards.table}"
    input:
        core=CORE["creep_study"],
    output:
        table="<results>/creep/{table}.h5",
        cost="<results>/creep/{table}.csv",
    log: "<logs>/creep_study_table/{table}.log"
    benchmark: "<benchmarks>/creep_study_table/{table}.tsv"
    params:
        settings=lambda wildcards: {"nu": CREEP["nu"], **CREEP_TABLES[wildcards.table]},
    script: "../scripts/creep/creep_study_table.py"


rule creep_errors:
    message: "Errors of all creep laws in CONTACT's cases"
    input:
        core=CORE["creep_study"],
        reference=CREEP_REFERENCE,
        tables=expand(rules.creep_study_table.output.table, table=CREEP_TABLES),
    output:
        "<results>/creep/errors.csv",
    log: "<logs>/creep_errors.log"
    benchmark: "<benchmarks>/creep_errors.tsv"
    params:
        reference=CREEP["reference"],
        nu=CREEP["nu"],
        grids=CREEP["fastsim_grids"],
        levels=CREEP["levels"],
    script: "../scripts/creep/creep_errors.py"


rule creep_costs:
    message: "Costs of all creep laws in turn, nothing beside them"
    input:
        core=CORE["creep_study"],
        reference=CREEP_REFERENCE,
        tables=expand(rules.creep_study_table.output.table, table=CREEP_TABLES),
    output:
        "<results>/creep/cost_samples.csv",
    log: "<logs>/creep_costs.log"
    benchmark: "<benchmarks>/creep_costs.tsv"
    params:
        reference=CREEP["reference"],
        nu=CREEP["nu"],
        grids=CREEP["fastsim_grids"],
        levels=CREEP["levels"],
        passes=CREEP["cost"]["passes"],
        every=CREEP["cost"]["every"],
    # all cores: nothing else may run beside it
    threads: workflow.cores
    script: "../scripts/creep/creep_costs.py"


rule creep_laws:
    message: "Table: creep laws, error and cost"
    input:
        core=CORE["creep_study"],
        errors=rules.creep_errors.output,
        costs=rules.creep_costs.output,
        tables=expand(rules.creep_study_table.output.cost, table=CREEP_TABLES),
    output:
        shown("creep/creep_laws.csv", "laws, error and cost"),
        "<results>/creep/creep_laws.md",
    log: "<logs>/creep_laws.log"
    script: "../scripts/creep/creep_laws.py"


rule fig_creep_curves:
    message: "Creep curves of all laws"
    input:
        core=CORE["creep_figures"],
        table=expand(rules.creep_study_table.output.table, table=CREEP["shown"]),
    output:
        shown("creep/creep_curves.png", "curves"),
        "<results>/creep/creep_curves.svg",
        "<results>/creep/curves.csv",
    log: "<logs>/fig_creep_curves.log"
    params:
        nu=CREEP["nu"],
        **CREEP["curves"],
    script: "../scripts/creep/fig_creep_curves.py"


rule fig_creep_traction:
    message: "Traction, stick and slip"
    input:
        core=CORE["creep_figures"],
    output:
        shown("creep/creep_traction.png", "traction"),
        "<results>/creep/creep_traction.svg",
    log: "<logs>/fig_creep_traction.log"
    params:
        nu=CREEP["nu"],
        **CREEP["traction"],
    script: "../scripts/creep/fig_creep_traction.py"


rule fig_creep_cost:
    message: "Cost against error of all creep laws"
    input:
        core=CORE["creep_figures"],
        reference=CREEP_REFERENCE,
        laws=rules.creep_laws.output[0],
    output:
        shown("creep/creep_cost.png", "cost against error"),
        "<results>/creep/creep_cost.svg",
    log: "<logs>/fig_creep_cost.log"
    params:
        reference=CREEP["reference"],
    script: "../scripts/creep/fig_creep_cost.py"


rule fig_creep_error_map:
    message: "Where the creep table errs"
    input:
        core=CORE["creep_figures"],
        table=expand(rules.creep_study_table.output.table, table=CREEP["shown"]),
    output:
        shown("creep/creep_error_map.png", "error of the table"),
        "<results>/creep/creep_error_map.svg",
        "<results>/creep/error_map.csv",
    log: "<logs>/fig_creep_error_map.log"
    benchmark: "<benchmarks>/fig_creep_error_map.tsv"
    params:
        name=CREEP["shown"],
        **CREEP["error_map"],
    script: "../scripts/creep/fig_creep_error_map.py"


rule fig_creep_smoothness:
    message: "Smoothness of the creep table"
    input:
        core=CORE["creep_figures"],
        table=expand(rules.creep_study_table.output.table, table=CREEP["shown"]),
    output:
        shown("creep/creep_smoothness.png", "smoothness of the table"),
        "<results>/creep/creep_smoothness.svg",
        "<results>/creep/smoothness.csv",
    log: "<logs>/fig_creep_smoothness.log"
    params:
        **CREEP["smoothness"],
    script: "../scripts/creep/fig_creep_smoothness.py"


rule creep_study:
    input:
        rules.creep_laws.output,
        rules.fig_creep_curves.output,
        rules.fig_creep_traction.output,
        rules.fig_creep_cost.output,
        rules.fig_creep_error_map.output,
        rules.fig_creep_smoothness.output,
