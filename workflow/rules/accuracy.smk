# Speed against error: every combination of model and integrator on a few scenes, one job per scene.

ACCURACY = config["accuracy"]
ACCURACY_SCENES = list(ACCURACY["scenes"])
WITH_EXACT = [name for name, entry in ACCURACY["scenes"].items() if "exact" in entry]


wildcard_constraints:
    measured="|".join(ACCURACY_SCENES),


def measured_scene(wildcards):
    return ACCURACY["scenes"][wildcards.measured]["scene"]


def measured_settings(wildcards):
    entry, grids = ACCURACY["scenes"][wildcards.measured], ACCURACY["grids"]
    own = dict.fromkeys(["models", "fastsim", "looked_up"], entry.get("models", {}))
    if "exact" not in entry:  # nothing to hold it against
        grids = {name: grid for name, grid in grids.items() if name != "looked_up"}
    return {
        "overrides": changes(entry["set"]),
        "grids": [{**grid, **own.get(name, {})} for name, grid in grids.items()],
        "reference": ACCURACY["reference"],
        "twins": ACCURACY["twins"],
        "until": entry.get("until"),
        "repetitions": ACCURACY["repetitions"],
    }


def exact_settings(wildcards):
    entry = ACCURACY["scenes"][wildcards.measured]
    own = dict(entry["exact"])
    duration = own.pop("duration")
    return {"overrides": changes(entry["set"]), "exact": {**ACCURACY["exact"], **own}, "duration": duration}


rule accuracy_exact:
    message: "{wildcards.measured}: exact contact at two resolutions"
    input:
        core=CORE["simulation"] + CORE["accuracy"],
        scenes=SCENES,
        scene=measured_scene,
    output:
        run="<results>/accuracy/{measured}_exact.h5",
        table="<results>/accuracy/{measured}_exact.csv",
    log: "<logs>/accuracy_exact/{measured}.log"
    benchmark: "<benchmarks>/accuracy_exact/{measured}.tsv"
    params:
        settings=exact_settings,
    script: "../scripts/accuracy/accuracy_exact.py"


def exact_run(wildcards):
    """The run with exact contact, for scenes that have one."""
    found = [wildcards.measured] if wildcards.measured in WITH_EXACT else []
    return expand(rules.accuracy_exact.output.run, measured=found)


rule accuracy_tables:
    message: "Creep tables of all sizes that are compared"
    input:
        core=CORE["creep"],
    output:
        touch("<results>/accuracy/tables.built"),
    log: "<logs>/accuracy_tables.log"
    params:
        nu=config["creep"]["table"]["nu"],
        creeps=ACCURACY["grids"]["models"]["creep"],
    threads: workflow.cores
    script: "../scripts/accuracy/accuracy_tables.py"


rule accuracy_study:
    message: "{wildcards.measured}: speed against error of every choice"
    input:
        core=CORE["simulation"] + CORE["accuracy"],
        scenes=SCENES,
        scene=measured_scene,
        tables=rules.accuracy_tables.output,
        exact=exact_run,
    output:
        choices="<results>/accuracy/{measured}.csv",
        reference="<results>/accuracy/{measured}_reference.csv",
    log: "<logs>/accuracy_study/{measured}.log"
    benchmark: "<benchmarks>/accuracy_study/{measured}.tsv"
    params:
        settings=measured_settings,
    # all cores: nothing else may run beside what is timed
    threads: workflow.cores
    script: "../scripts/accuracy/accuracy_study.py"


rule speed_against_error:
    message: "Figure and tables: speed against error"
    input:
        core=CORE["accuracy_figures"],
        choices=expand(rules.accuracy_study.output.choices, measured=ACCURACY_SCENES),
        references=expand(rules.accuracy_study.output.reference, measured=ACCURACY_SCENES),
        exacts=expand(rules.accuracy_exact.output.table, measured=WITH_EXACT),
    output:
        shown("accuracy/speed_against_error.png", "speed against error"),
        "<results>/accuracy/speed_against_error.svg",
        shown("accuracy/choose_for_accuracy.csv", "choose this for that accuracy"),
        "<results>/accuracy/accuracy_front.csv",
        shown("accuracy/models.csv", "errors of models"),
    log: "<logs>/speed_against_error.log"
    params:
        titles={name: entry["title"] for name, entry in ACCURACY["scenes"].items()},
        exact=WITH_EXACT,
        finest=ACCURACY["reference"]["creep"],
        accuracies=ACCURACY["accuracies"],
    script: "../scripts/accuracy/speed_against_error.py"


rule accuracy_requests:
    message: "Random scenes: is an accuracy that is asked for reached?"
    input:
        core=CORE["simulation"] + CORE["accuracy_requests"],
        scenes=SCENES,
        table=rules.creep_table.output,
    output:
        rows="<results>/accuracy/requests.csv",
        summary=shown("accuracy/requests_summary.csv", "accuracies asked for and reached"),
    log: "<logs>/accuracy_requests.log"
    benchmark: "<benchmarks>/accuracy_requests.tsv"
    params:
        settings=ACCURACY["requests"],
    script: "../scripts/accuracy/accuracy_requests.py"


rule claims:
    message: "What reports/accuracy.md promises: medians and worst cases"
    input:
        core=CORE["accuracy_figures"],
        contact=rules.contact_reductions.output.cases,
        creep=rules.creep_errors.output[0],
        patch=rules.patch_errors.output.summary,
        front=rules.speed_against_error.output[3],
    output:
        table="<results>/accuracy/claims.csv",
        text="<results>/accuracy/claims.md",
    log: "<logs>/claims.log"
    script: "../scripts/accuracy/claims.py"
