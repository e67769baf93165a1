# Wear: a wheel profile over a distance, and what settings and models do to it.

WEAR = config["wear"]
CORE["wear"] = CORE["simulation"] + sources(
    "analysis/wear/evolve", "analysis/wear/worn_profiles", "analysis/wear/worn_rails", "analysis/wear/local_wear", "analysis/wear/wear_laws",
    "analysis/contact/in_run", "analysis/contact/loaded", "analysis/pictures/plot_wear", *VEHICLE, *STYLE, "study/wear"
)  # fmt: skip


rule wear_evolution:
    message: "A wheel profile over a distance"
    input:
        core=CORE["wear"],
        scenes=SCENES,
        plan=WEAR["plan"],
        table=rules.creep_table.output,
    output:
        table=shown("wear/evolution.csv", "evolution of a wheel profile"),
        figure=shown("wear/evolution.png", "evolution of a wheel profile"),
        svg="<results>/wear/evolution.svg",
    log: "<logs>/wear_evolution.log"
    benchmark: "<benchmarks>/wear_evolution.tsv"
    params:
        settings=WEAR["settings"],
    threads: 2
    script: "../scripts/wear/wear_evolution.py"


# no part of the study; on a line without tight curves, see reports/wear.md
use rule wear_evolution as wear_100000_km with:
    message: "A wheel profile over 100 000 km"
    input:
        core=CORE["wear"],
        scenes=SCENES,
        plan="config/wear/main_line.yaml",
        table=rules.creep_table.output,
    output:
        table="<results>/wear/100000_km.csv",
        figure="<results>/wear/100000_km.png",
        svg="<results>/wear/100000_km.svg",
    log: "<logs>/wear_100000_km.log"
    benchmark: "<benchmarks>/wear_100000_km.tsv"
    params:
        settings={"distance": 1.0e8},
    resources:
        runtime=480,


rule wear_influences:
    message: "What settings and models do to worn profiles"
    input:
        core=CORE["wear"],
        scenes=SCENES,
        plan=WEAR["plan"],
        table=rules.creep_table.output,
    output:
        table=shown("wear/influences.csv", "influences on worn profiles"),
        figure=shown("wear/influences.png", "influences on worn profiles"),
        svg="<results>/wear/influences.svg",
    log: "<logs>/wear_influences.log"
    benchmark: "<benchmarks>/wear_influences.tsv"
    params:
        settings=WEAR["influences"],
    script: "../scripts/wear/wear_influences.py"


rule wear_study:
    input:
        rules.wear_evolution.output,
        rules.wear_influences.output,
