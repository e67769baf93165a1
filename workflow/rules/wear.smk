# Wear: a wheel profile over a distance, and what settings and models do to it.

WEAR = config["wear"]
CORE["wear"] = CORE["simulation"] + sources(
    "analysis/evolve", "analysis/local_wear", "analysis/plot_wear", *VEHICLE, *STYLE, "study/wear"
)  # fmt: skip


rule wear_evolution:
    message:
        "A wheel profile over a distance"
    input:
        core=CORE["wear"],
        scenes=SCENES,
        plan=WEAR["plan"],
        table=rules.creep_table.output,
    output:
        table=report(
            "<results>/wear/evolution.csv",
            caption="../report/wear/evolution.rst",
            category="13 Wear",
            labels={"table": "evolution of a wheel profile"},
        ),
        figure=report(
            "<results>/wear/evolution.png",
            caption="../report/wear/evolution.rst",
            category="13 Wear",
            labels={"figure": "evolution of a wheel profile"},
        ),
        svg="<results>/wear/evolution.svg",
    log:
        "<logs>/wear_evolution.log",
    benchmark:
        "<benchmarks>/wear_evolution.tsv"
    params:
        settings=WEAR["settings"],
    script:
        "../scripts/wear/wear_evolution.py"


rule wear_influences:
    message:
        "What settings and models do to worn profiles"
    input:
        core=CORE["wear"],
        scenes=SCENES,
        plan=WEAR["plan"],
        table=rules.creep_table.output,
    output:
        table=report(
            "<results>/wear/influences.csv",
            caption="../report/wear/influences.rst",
            category="13 Wear",
            labels={"table": "influences on worn profiles"},
        ),
        figure=report(
            "<results>/wear/influences.png",
            caption="../report/wear/influences.rst",
            category="13 Wear",
            labels={"figure": "influences on worn profiles"},
        ),
        svg="<results>/wear/influences.svg",
    log:
        "<logs>/wear_influences.log",
    benchmark:
        "<benchmarks>/wear_influences.tsv"
    params:
        settings=WEAR["influences"],
    script:
        "../scripts/wear/wear_influences.py"


rule wear_study:
    input:
        rules.wear_evolution.output,
        rules.wear_influences.output,
