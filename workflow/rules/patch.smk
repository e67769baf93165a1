# Patch models against exact contact: one pose at a time, in runs, and exact contact against CONTACT.

PATCH = config["patch"]
CORE["patch"] = CORE["simulation"] + sources("analysis/contact/loaded", "analysis/contact/poses", "analysis/contact/rolling_field", *STYLE, "study/contact", "study/patch")


rule patch_costs:
    message: "Cost of a patch with each model, in turn, nothing beside it"
    input:
        core=CORE["patch"] + sources("study/cost/recorded", "study/cost/timing"),
        scenes=SCENES,
        scene=PATCH["cost"]["scene"],
    output:
        shown("patch/costs.csv", "cost of a patch"),
    log: "<logs>/patch_costs.log"
    benchmark: "<benchmarks>/patch_costs.tsv"
    params:
        overrides=changes(PATCH["cost"]["set"]),
        models={name: PATCH["models"][name] for name in PATCH["cost"]["models"]},
        settings={name: PATCH["cost"][name] for name in ("states", "passes")},
    # all cores: nothing else may run beside what is timed
    threads: workflow.cores
    script: "../scripts/patch/patch_costs.py"


rule wheel_on_rail:
    message: "Figure: a loaded wheel on its rail, with its patch"
    input:
        core=CORE["patch"] + sources("analysis/contact/patch", "analysis/pictures/plot_patch"),
    output:
        shown("patch/wheel_on_rail_patch.png", "a wheel on its rail"),
        "<results>/patch/wheel_on_rail_patch.svg",
    log: "<logs>/wheel_on_rail.log"
    params:
        pair=CONTACT_PAIR,
        shown=PATCH["shown"],
        rolling={name: PATCH["rolling"][name] for name in ("speed", "friction")},
    script: "../scripts/patch/wheel_on_rail.py"


rule looked_up_cells:
    message: "Figure: cells of the table that exact contact is looked up in"
    input:
        core=CORE["patch"],
        scenes=SCENES,
        scene=PATCH["cells"]["scene"],
    output:
        cells="<results>/patch/looked_up_cells.csv",
        figure=shown("patch/looked_up_cells.png", "cells of looked-up contact"),
        svg="<results>/patch/looked_up_cells.svg",
    log: "<logs>/looked_up_cells.log"
    benchmark: "<benchmarks>/looked_up_cells.tsv"
    params:
        overrides=changes(PATCH["cells"]["set"]),
    script: "../scripts/patch/looked_up_cells.py"


rule patch_errors:
    message: "Patch models against exact contact, pose by pose"
    input:
        core=CORE["patch"],
        costs=rules.patch_costs.output[0],
    output:
        places="<results>/patch/places.csv",
        forces="<results>/patch/forces.csv",
        differences="<results>/patch/radius_differences.csv",
        conicity=shown("patch/conicity.csv", "equivalent conicity under load"),
        summary=shown("patch/summary.csv", "errors of patch models", caption="patch_errors"),
        errors_figure=shown("patch/patch_errors.png", "errors of patch models"),
        patches_figure=shown("patch/patch_fields.png", "patches"),
        svg=expand("<results>/patch/{name}.svg", name=["patch_errors", "patch_fields"]),
    log: "<logs>/patch_errors.log"
    benchmark: "<benchmarks>/patch_errors.tsv"
    params:
        pair=CONTACT_PAIR,
        settings={name: PATCH[name] for name in PATCH if name not in ("cost", "cells")},
    script: "../scripts/patch/patch_errors.py"


rule patch_reference:
    message: "Patch models against CONTACT's loaded cases"
    input:
        core=CORE["patch"],
        reference=CONTACT["reductions"]["reference"],
    output:
        cases="<results>/patch/contact_cases.csv",
        summary=shown("patch/contact.csv", "patch models against CONTACT"),
    log: "<logs>/patch_reference.log"
    params:
        pair=CONTACT_PAIR,
        models={name: entry for name, entry in PATCH["models"].items() if "slip" not in entry},  # at rest
    script: "../scripts/patch/patch_reference.py"


RUNS = PATCH["runs"]


wildcard_constraints:
    hunter="|".join(RUNS["vehicles"]),
    patch="|".join(RUNS["models"]),


def runs_start(wildcards):
    start = RUNS["models"][wildcards.patch].get("start")
    return None if start is None else changes(start)


rule patch_runs:
    message: "{wildcards.hunter} with {wildcards.patch}: limit cycle, irregular track"
    input:
        core=CORE["simulation"] + sources(*VEHICLE, "analysis/stability/stability", "analysis/stability/limit_cycles", "study/patch/runs"),
        scenes=SCENES,
        scene=lambda wildcards: CRITICAL["vehicles"][wildcards.hunter]["scene"],
        table=rules.creep_table.output,
    output:
        "<results>/patch/runs/{hunter}_{patch}.csv",
    log: "<logs>/patch_runs/{hunter}_{patch}.log"
    benchmark: "<benchmarks>/patch_runs/{hunter}_{patch}.tsv"
    params:
        overrides=lambda wildcards: changes(RUNS["models"][wildcards.patch]["set"]),
        start=runs_start,
        settings=lambda wildcards: RUNS["vehicles"][wildcards.hunter],
    script: "../scripts/patch/patch_runs.py"


rule patch_models:
    message: "Vehicles with every patch model"
    input:
        core=sources("study/patch/runs"),
        rows=expand(rules.patch_runs.output, hunter=RUNS["vehicles"], patch=RUNS["models"]),
        variants=rules.critical_speeds.output.variants,
    output:
        shown("patch/models.csv", "vehicles with every patch model", page="critical_speed"),
    log: "<logs>/patch_models.log"
    params:
        titles={name: CRITICAL["vehicles"][name]["title"] for name in RUNS["vehicles"]},
        variants={name: entry["variant"] for name, entry in RUNS["models"].items() if "variant" in entry},
        exact=RUNS["exact"],
    script: "../scripts/patch/patch_models.py"


rule patch_page:
    message: "What was found of the patch models"
    input:
        core=sources("study/patch/page", "study/patch/tables"),
        summary=rules.patch_errors.output.summary,
        conicity=rules.patch_errors.output.conicity,
        contact=rules.patch_reference.output.summary,
        models=rules.patch_models.output[0],
    output:
        "<results>/patch/patch.md",
    log: "<logs>/patch_page.log"
    script: "../scripts/patch/patch_page.py"


rule patch_study:
    input:
        rules.patch_page.output,
        rules.patch_models.output,
        rules.patch_reference.output,
        rules.patch_costs.output,
        rules.wheel_on_rail.output,
        rules.looked_up_cells.output,
        rules.patch_errors.output,
