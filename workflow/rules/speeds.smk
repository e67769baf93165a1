# Sweeps over speed: one job per vehicle, and what its runs show.

SPEEDS = config["speeds"]
VEHICLES = list(SPEEDS["vehicles"])
WITH_LINEAR = [vehicle for vehicle in VEHICLES if vehicle in config["critical_speed"]["vehicles"]]
SHOWN = [
    (track, detection, speed)
    for track in SPEEDS["tracks"]
    for detection in ("planar", "spatial")
    for speed in SPEEDS["shown"]
]


wildcard_constraints:
    vehicle="|".join(VEHICLES),


def vehicle_linear(wildcards):
    known = wildcards.vehicle in WITH_LINEAR
    return [f"<results>/critical_speed/{wildcards.vehicle}_linear.csv"] if known else []


rule sweep_speeds:
    message: "{wildcards.vehicle}: all speeds, all tracks, planar and spatial"
    input:
        core=CORE["simulation"] + CORE["vehicle"],
        scenes=SCENES,
        scene=lambda wildcards: SPEEDS["vehicles"][wildcards.vehicle]["scene"],
        table=rules.creep_table.output,
    output:
        speeds="<results>/speeds/{vehicle}/speeds.csv",
        shown=[
            f"<results>/speeds/{{vehicle}}/{track}_{detection}_v{speed:g}.h5" for track, detection, speed in SHOWN
        ],
    log: "<logs>/sweep_speeds/{vehicle}.log"
    benchmark: "<benchmarks>/sweep_speeds/{vehicle}.tsv"
    params:
        overrides=lambda wildcards: changes(SPEEDS["vehicles"][wildcards.vehicle]["set"]),
        speeds=SPEEDS["values"],
        tracks={track: changes(entry) for track, entry in SPEEDS["tracks"].items()},
        shown=SHOWN,
    script: "../scripts/speeds/sweep_speeds.py"


rule vehicle_lateral_motion:
    message: "Figure: lateral motion of all wheelsets of the {wildcards.vehicle}"
    input:
        core=CORE["vehicle_figures"],
        runs=[
            f"<results>/speeds/{{vehicle}}/{SPEEDS['released']}_{detection}_v{speed:g}.h5"
            for speed in SPEEDS["shown"]
            for detection in ("planar", "spatial")
        ],
    output:
        shown("speeds/vehicle_lateral_motion_{vehicle}.png", "lateral motion", vehicle="{vehicle}"),
        "<results>/speeds/vehicle_lateral_motion_{vehicle}.svg",
    log: "<logs>/vehicle_lateral_motion/{vehicle}.log"
    params:
        speeds=SPEEDS["shown"],
    script: "../scripts/speeds/vehicle_lateral_motion.py"


rule vehicle_guiding_forces:
    message: "Figure and table: forces of each wheel of the {wildcards.vehicle} on irregular track"
    input:
        core=CORE["vehicle_figures"],
        run=f"<results>/speeds/{{vehicle}}/{SPEEDS['disturbed']}_spatial_v{SPEEDS['shown'][1]:g}.h5",
        linear=vehicle_linear,
    output:
        shown("speeds/vehicle_guiding_forces_{vehicle}.png", "guiding forces", vehicle="{vehicle}"),
        "<results>/speeds/vehicle_guiding_forces_{vehicle}.svg",
        shown("speeds/vehicle_wheels_{vehicle}.csv", "wheels", vehicle="{vehicle}"),
    log: "<logs>/vehicle_guiding_forces/{vehicle}.log"
    script: "../scripts/speeds/vehicle_guiding_forces.py"


rule vehicle_over_speed:
    message: "Figures and tables: vehicles over speed"
    input:
        core=CORE["vehicle_figures"],
        speeds=expand(rules.sweep_speeds.output.speeds, vehicle=VEHICLES),
        linear=expand("<results>/critical_speed/{vehicle}_linear.csv", vehicle=WITH_LINEAR),
        benchmarks=expand("<benchmarks>/sweep_speeds/{vehicle}.tsv", vehicle=VEHICLES),
    output:
        shown("speeds/vehicle_hunting.png", "hunting over speed"),
        "<results>/speeds/vehicle_hunting.svg",
        shown("speeds/vehicle_response.png", "response over speed"),
        "<results>/speeds/vehicle_response.svg",
        shown("speeds/vehicle_timing.csv", "timing over vehicles", page="cost"),
    log: "<logs>/vehicle_over_speed.log"
    params:
        titles={vehicle: entry["title"] for vehicle, entry in SPEEDS["vehicles"].items()},
        with_linear=WITH_LINEAR,
        released=SPEEDS["released"],
        disturbed=SPEEDS["disturbed"],
    script: "../scripts/speeds/vehicle_over_speed.py"


rule vehicle_values:
    message: "Page: vehicle values and their sources"
    input:
        core="workflow/study/speeds/vehicle_page.py",
        vehicles=sorted(str(path.relative_to(HERE)) for path in HERE.glob("config/vehicles/*.yaml")),
    output:
        shown("speeds/vehicle_values.html", "values and their sources"),
    log: "<logs>/vehicle_values.log"
    script: "../scripts/speeds/vehicle_values.py"


rule speeds_study:
    input:
        rules.vehicle_values.output,
        expand(rules.vehicle_lateral_motion.output, vehicle=VEHICLES),
        expand(rules.vehicle_guiding_forces.output, vehicle=VEHICLES),
        rules.vehicle_over_speed.output,
