# Hard cases: every family's invariants in one table, known limits named, and what they look like.

HARD = config["hard_cases"]
FAMILIES = list(HARD["families"])
HARD_FIGURES = ["low_speed", "contact_jumps", "lift_off", "nadal", "stability_map", "tolerances", "sharp_curve"]
CORE["hard_cases"] = CORE["critical_speed"] + sources("analysis/contact/loaded", "analysis/contact/poses", "study/contact/tables", "study/hard_cases")


wildcard_constraints:
    family="|".join(FAMILIES),


rule hard_cases:
    message: "Hard cases: {wildcards.family}"
    input:
        core=CORE["hard_cases"],
        scenes=SCENES,
        table=rules.creep_table.output,
    output:
        table="<results>/hard_cases/{family}.csv",
        curves="<results>/hard_cases/{family}_curves.json",
    log: "<logs>/hard_cases/{family}.log"
    benchmark: "<benchmarks>/hard_cases/{family}.tsv"
    params:
        vehicles=HARD["vehicles"],
        settings=lambda wildcards: HARD["families"][wildcards.family],
    script: "../scripts/hard_cases/hard_cases.py"


rule hard_cases_table:
    message: "Hard cases: one table, and its summary"
    input:
        core=CORE["hard_cases"],
        tables=expand(rules.hard_cases.output.table, family=FAMILIES),
    output:
        table=shown("hard_cases/all.csv", "every check"),
        summary=shown("hard_cases/summary.csv", "cases"),
        limits=shown("hard_cases/limits.csv", "known limits"),
        text="<results>/hard_cases/all.md",
    log: "<logs>/hard_cases_table.log"
    script: "../scripts/hard_cases/hard_cases_table.py"


rule fig_hard_cases:
    message: "Hard cases: figures"
    input:
        core=CORE["hard_cases"] + sources(*STYLE),
        curves=expand(rules.hard_cases.output.curves, family=FAMILIES),
    output:
        **{name: shown(f"hard_cases/hard_cases_{name}.png", name.replace("_", " ")) for name in HARD_FIGURES},
        svg=expand("<results>/hard_cases/hard_cases_{name}.svg", name=HARD_FIGURES),
    log: "<logs>/fig_hard_cases.log"
    script: "../scripts/hard_cases/fig_hard_cases.py"


rule hard_cases_study:
    input:
        rules.hard_cases_table.output,
        rules.fig_hard_cases.output,
