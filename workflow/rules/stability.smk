# Hard cases: every family's invariants in one table, known limits named, and what they look like.

HARD = config["stability_study"]
FAMILIES = list(HARD["families"])
HARD_FIGURES = ["low_speed", "contact_jumps", "lift_off", "nadal", "stability_map", "tolerances", "sharp_curve"]
CORE["hard_cases"] = CORE["stability"] + sources(
    "analysis_contact", "analysis_hard_cases", "analysis_hard_low_speed", "analysis_hard_contact",
    "analysis_hard_flange", "analysis_hard_profiles", "analysis_hard_friction", "analysis_hard_integration",
    "analysis_hard_long", "analysis_hard_track", "analysis_hard_study", "streaming", "checkpoints",
)  # fmt: skip


wildcard_constraints:
    family="|".join(FAMILIES),


def hard_settings(wildcards):
    return HARD["families"][wildcards.family]


rule hard_cases:
    message:
        "Hard cases: {wildcards.family}"
    input:
        core=CORE["hard_cases"],
        scenes=SCENES,
        table=rules.creep_table.output,
    output:
        table="<results>/tables/hard_cases/{family}.csv",
        curves="<results>/tables/hard_cases/{family}_curves.json",
    log:
        "<logs>/hard_cases/{family}.log",
    benchmark:
        "<benchmarks>/hard_cases/{family}.tsv"
    params:
        vehicles=HARD["vehicles"],
        settings=hard_settings,
    script:
        "../scripts/hard_cases.py"


rule stability_table:
    message:
        "Hard cases: one table, and its summary"
    input:
        core=CORE["hard_cases"],
        tables=expand(rules.hard_cases.output.table, family=FAMILIES),
    output:
        table=report(
            "<results>/tables/stability.csv",
            caption="../report/stability_table.rst",
            category="09 Hard cases",
            labels={"table": "every check"},
        ),
        summary=report(
            "<results>/tables/stability_summary.csv",
            caption="../report/stability_summary.rst",
            category="09 Hard cases",
            labels={"table": "cases"},
        ),
        limits=report(
            "<results>/tables/stability_limits.csv",
            caption="../report/stability_limits.rst",
            category="09 Hard cases",
            labels={"table": "known limits"},
        ),
        text="<results>/tables/stability.md",
    log:
        "<logs>/stability_table.log",
    script:
        "../scripts/stability_table.py"


rule fig_hard_cases:
    message:
        "Hard cases: figures"
    input:
        core=CORE["hard_cases"] + sources("figures", "figures_hard_cases"),
        curves=expand(rules.hard_cases.output.curves, family=FAMILIES),
    output:
        **{
            name: report(
                f"<results>/figures/hard_cases_{name}.png",
                caption=f"../report/hard_cases_{name}.rst",
                category="09 Hard cases",
                labels={"figure": name.replace("_", " ")},
            )
            for name in HARD_FIGURES
        },
        svg=expand("<results>/figures/hard_cases_{name}.svg", name=HARD_FIGURES),
    log:
        "<logs>/fig_hard_cases.log",
    script:
        "../scripts/fig_hard_cases.py"


rule stability_study:
    input:
        rules.stability_table.output,
        rules.fig_hard_cases.output,
