# Sweeps: a few long jobs of many short runs each, and one table. Which batches there are, the sweep's file says.
from wrcore.sweep.plan import load_sweep

SWEEPS = {}
for file in config["sweeps"]:
    try:
        SWEEPS[Path(file).stem] = load_sweep(file)
    except InputError as error:
        refuse("sweeps", f"{error}")
CORE["sweeps"] = CORE["simulation"] + sources("sweep")
CORE["sweeps_figures"] = sources("sweep", *STYLE, "analysis/pictures/plot_run", "analysis/plot_sweep")


wildcard_constraints:
    sweep="|".join(SWEEPS) or "none",
    batch=r"\d+",


def sweep_file(wildcards):
    return SWEEPS[wildcards.sweep].source


def sweep_shown(wildcards):
    measures = SWEEPS[wildcards.sweep].data["measures"]
    return "amplitude_m" if "amplitude_m" in measures else measures[0]


def sweep_batches(wildcards):
    count = SWEEPS[wildcards.sweep].batches
    return expand(rules.sweep_batch.output, sweep=wildcards.sweep, batch=range(count))


rule sweep_batch:
    message: "Sweep {wildcards.sweep}: batch {wildcards.batch}"
    input:
        core=CORE["sweeps"],
        scenes=SCENES,
        sweep=sweep_file,
    output:
        "<results>/sweeps/{sweep}/{batch}.csv",
    log: "<logs>/sweep_batch/{sweep}_{batch}.log"
    benchmark: "<benchmarks>/sweep_batch/{sweep}_{batch}.tsv"
    resources:
        mem_mb=1000,
        runtime=30,
    script: "../scripts/sweeps/sweep_batch.py"


rule sweep_table:
    message: "Sweep {wildcards.sweep}: table and figure"
    input:
        core=CORE["sweeps_figures"],
        sweep=sweep_file,
        batches=sweep_batches,
    output:
        table="<results>/sweeps/{sweep}.csv",
        figure=shown("sweeps/sweep_{sweep}.png", "{sweep}"),
        svg="<results>/sweeps/sweep_{sweep}.svg",
    log: "<logs>/sweep_table/{sweep}.log"
    params:
        varied=lambda wildcards: list(SWEEPS[wildcards.sweep].runs.columns),
        shown=sweep_shown,
    script: "../scripts/sweeps/sweep_table.py"


rule sweeps:
    input:
        expand(rules.sweep_table.output, sweep=SWEEPS),
