# Speed against error: every combination of model and integrator on a few scenes, one job per scene.

ACCURACY = config["accuracy"]
ACCURACY_SCENES = list(ACCURACY["scenes"])


wildcard_constraints:
    measured="|".join(ACCURACY_SCENES),


def measured_scene(wildcards):
    return ACCURACY["scenes"][wildcards.measured]["scene"]


def measured_settings(wildcards):
    entry = ACCURACY["scenes"][wildcards.measured]
    return {
        "overrides": changes(entry["set"]),
        "grids": [{**ACCURACY["grids"]["models"], **entry.get("models", {})}, ACCURACY["grids"]["integrators"]],
        "reference": ACCURACY["reference"],
        "until": entry.get("until"),
        "repetitions": ACCURACY["repetitions"],
    }


rule accuracy_tables:
    message:
        "Creep tables of all sizes that are compared"
    input:
        core=CORE["creep"],
    output:
        touch("<results>/accuracy/tables.built"),
    log:
        "<logs>/accuracy_tables.log",
    params:
        nu=config["creep"]["table"]["nu"],
        creeps=ACCURACY["grids"]["models"]["creep"],
    threads: workflow.cores
    script:
        "../scripts/accuracy/accuracy_tables.py"


rule accuracy_study:
    message:
        "{wildcards.measured}: speed against error of every choice"
    input:
        core=CORE["simulation"] + CORE["accuracy"],
        scenes=SCENES,
        scene=measured_scene,
        tables=rules.accuracy_tables.output,
    output:
        choices="<results>/accuracy/{measured}.csv",
        reference="<results>/accuracy/{measured}_reference.csv",
    log:
        "<logs>/accuracy_study/{measured}.log",
    benchmark:
        "<benchmarks>/accuracy_study/{measured}.tsv"
    params:
        settings=measured_settings,
    # all cores: nothing else may run beside what is timed
    threads: workflow.cores
    script:
        "../scripts/accuracy/accuracy_study.py"


rule speed_against_error:
    message:
        "Figure and tables: speed against error"
    input:
        core=CORE["accuracy_figures"],
        choices=expand(rules.accuracy_study.output.choices, measured=ACCURACY_SCENES),
        references=expand(rules.accuracy_study.output.reference, measured=ACCURACY_SCENES),
    output:
        report(
            "<results>/accuracy/speed_against_error.png",
            caption="../report/accuracy/speed_against_error.rst",
            category="07 Speed against error",
            labels={"figure": "speed against error"},
        ),
        "<results>/accuracy/speed_against_error.svg",
        report(
            "<results>/accuracy/choose_for_accuracy.csv",
            caption="../report/accuracy/choose_for_accuracy.rst",
            category="07 Speed against error",
            labels={"table": "choose this for that accuracy"},
        ),
        "<results>/accuracy/accuracy_front.csv",
    log:
        "<logs>/speed_against_error.log",
    params:
        titles={name: entry["title"] for name, entry in ACCURACY["scenes"].items()},
        finest=ACCURACY["reference"]["creep"],
        accuracies=ACCURACY["accuracies"],
    script:
        "../scripts/accuracy/speed_against_error.py"


rule claims:
    message:
        "What the README promises: medians and worst cases"
    input:
        core=CORE["accuracy_figures"],
        contact=rules.contact_reductions.output.cases,
        creep=rules.creep_errors.output[0],
        front="wrcore/run/accuracy_front.csv",
    output:
        table="<results>/accuracy/claims.csv",
        text="<results>/accuracy/claims.md",
    log:
        "<logs>/claims.log",
    script:
        "../scripts/accuracy/claims.py"
