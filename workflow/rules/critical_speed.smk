# Stability of vehicles: root locus, modes, limit cycles, critical speeds.

CRITICAL = config["critical_speed"]
HUNTING = list(CRITICAL["vehicles"])
CORE["critical_speed"] = CORE["simulation"] + sources(
    "analysis/stability/modes", "analysis/stability/stability", "analysis/stability/limit_cycles",
    "study/critical_speed/tables",
)  # fmt: skip
CORE["critical_speed_figures"] = CORE["critical_speed"] + sources(*STYLE, "analysis/pictures/plot_response", "study/critical_speed")


wildcard_constraints:
    detection="planar|spatial",


def critical_scene(wildcards):
    return CRITICAL["vehicles"][wildcards.vehicle]["scene"]


def critical_set(wildcards):
    return changes(CRITICAL["vehicles"][wildcards.vehicle]["set"])


def cycle_speeds(wildcards):
    return CRITICAL["vehicles"][wildcards.vehicle]["cycle_speeds"]


rule root_locus:
    message: "{wildcards.vehicle}: modes over speed, linear critical speeds"
    input:
        core=CORE["critical_speed"],
        scenes=SCENES,
        scene=critical_scene,
        table=rules.creep_table.output,
    output:
        locus="<results>/critical_speed/{vehicle}_modes.csv",
        linear="<results>/critical_speed/{vehicle}_linear.csv",
        shown="<results>/critical_speed/{vehicle}_energies.csv",
        shapes="<results>/critical_speed/{vehicle}_shapes.csv",
    log: "<logs>/root_locus/{vehicle}.log"
    benchmark: "<benchmarks>/root_locus/{vehicle}.tsv"
    params:
        overrides=critical_set,
        speeds=CRITICAL["speeds"],
        search=CRITICAL["search"],
        shown=CRITICAL["shown"],
        variants={name: changes(entry) for name, entry in CRITICAL["variants"].items()},
    script: "../scripts/critical_speed/root_locus.py"


rule limit_cycles:
    message: "{wildcards.vehicle}, {wildcards.detection}: limit cycles over speed"
    input:
        core=CORE["critical_speed"],
        scenes=SCENES,
        scene=critical_scene,
        table=rules.creep_table.output,
    output:
        "<results>/critical_speed/{vehicle}_{detection}_limit_cycles.csv",
    log: "<logs>/limit_cycles/{vehicle}_{detection}.log"
    benchmark: "<benchmarks>/limit_cycles/{vehicle}_{detection}.tsv"
    params:
        overrides=critical_set,
        speeds=cycle_speeds,
        settings=CRITICAL["limit_cycles"],
    script: "../scripts/critical_speed/limit_cycles.py"


rule critical_speeds:
    message: "Critical speeds: root locus, limit cycles, table"
    input:
        core=CORE["critical_speed_figures"],
        loci=expand(rules.root_locus.output.locus, vehicle=HUNTING),
        linear=expand(rules.root_locus.output.linear, vehicle=HUNTING),
        cycles=expand(rules.limit_cycles.output, vehicle=HUNTING, detection=["planar", "spatial"]),
    output:
        table=shown("critical_speed/critical_speeds.csv", "critical speeds"),
        variants=shown("critical_speed/critical_speed_variants.csv", "what the critical speed depends on"),
        locus=shown("critical_speed/root_locus.png", "root locus"),
        cycles=shown("critical_speed/limit_cycles.png", "limit cycles"),
        svg=expand("<results>/critical_speed/{name}.svg", name=["root_locus", "limit_cycles"]),
    log: "<logs>/critical_speeds.log"
    params:
        titles={name: entry["title"] for name, entry in CRITICAL["vehicles"].items()},
        disturbance=CRITICAL["limit_cycles"]["settling"]["disturbance"],
    script: "../scripts/critical_speed/critical_speeds.py"


rule fig_modes:
    message: "Modes of the {wildcards.vehicle}"
    input:
        core=CORE["critical_speed_figures"],
        modes=rules.root_locus.output.shown,
    output:
        shown("critical_speed/modes_{vehicle}.png", "modes", vehicle="{vehicle}"),
        "<results>/critical_speed/modes_{vehicle}.svg",
    log: "<logs>/fig_modes/{vehicle}.log"
    params:
        speed=CRITICAL["shown"],
    script: "../scripts/critical_speed/fig_modes.py"


rule critical_speed_study:
    input:
        rules.critical_speeds.output,
        expand(rules.fig_modes.output, vehicle=HUNTING),
        expand(rules.root_locus.output.shapes, vehicle=HUNTING),
