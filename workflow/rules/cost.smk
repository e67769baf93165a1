# What things cost: pairs timed in turn, stages of one evaluation, growth, batches, rejected steps.

COST = config["cost"]
CORE["cost"] = CORE["simulation"] + sources("sweep", "reference", "study/cost")
COST_SCENES = {name: (entry["title"], entry["scene"], changes(entry["set"])) for name, entry in COST["scenes"].items()}


rule cost_pairs:
    message: "Benchmarks: pairs in turn, nothing beside them"
    input:
        core=CORE["cost"],
        scenes=SCENES,
    output:
        pairs=shown("cost/benchmarks.csv", "benchmarks"),
        machine=shown("cost/benchmark_machine.csv", "machine"),
    log: "<logs>/cost_pairs.log"
    benchmark: "<benchmarks>/cost_pairs.tsv"
    params:
        scenes=COST_SCENES,
        settings=COST["pairs"],
    # all cores: nothing else may run beside what is timed
    threads: workflow.cores
    script: "../scripts/cost/cost_pairs.py"


rule cost_growth:
    message: "Cost over wheelsets, duration, tolerance, simultaneous scenes"
    input:
        core=CORE["cost"],
        scenes=SCENES,
    output:
        wheelsets=shown("cost/growth_wheelsets.csv", "growth with wheelsets"),
        runs=shown("cost/growth_runs.csv", "growth with duration and tolerance"),
        simultaneous=shown("cost/growth_scenes.csv", "scenes at the same time"),
        chains=shown("cost/growth_chains.csv", "growth with joints"),
        findings=shown("cost/growth_memory.csv", "arithmetic or memory"),
    log: "<logs>/cost_growth.log"
    benchmark: "<benchmarks>/cost_growth.tsv"
    params:
        scenes=COST_SCENES,
        settings=COST["growth"],
    threads: workflow.cores
    script: "../scripts/cost/cost_growth.py"


rule fig_growth:
    message: "Figure: growth of cost"
    input:
        core=CORE["cost"] + sources(*STYLE),
        wheelsets=rules.cost_growth.output.wheelsets,
        runs=rules.cost_growth.output.runs,
        simultaneous=rules.cost_growth.output.simultaneous,
    output:
        png=shown("cost/growth.png", "growth"),
        svg="<results>/cost/growth.svg",
    log: "<logs>/fig_growth.log"
    script: "../scripts/cost/fig_growth.py"


rule cost_stages:
    message: "Time, operations and bytes of one right-hand side by stage"
    input:
        core=CORE["cost"] + sources(*STYLE),
        scenes=SCENES,
    output:
        stages=shown("cost/cost_breakdown.csv", "stages of a right-hand side"),
        limits=shown("cost/machine_limits.csv", "limits of the machine"),
        png=shown("cost/cost_breakdown.png", "stages of a right-hand side"),
        svg="<results>/cost/cost_breakdown.svg",
    log: "<logs>/cost_stages.log"
    benchmark: "<benchmarks>/cost_stages.tsv"
    params:
        scenes=COST_SCENES,
        settings=COST["stages"],
    threads: workflow.cores
    script: "../scripts/cost/cost_stages.py"


rule cost_runs:
    message: "Batch of runs, rejected steps"
    input:
        core=CORE["cost"],
        scenes=SCENES,
    output:
        batch=shown("cost/batch.csv", "a batch in one process"),
        rejections=shown("cost/rejected_steps.csv", "rejected steps"),
    log: "<logs>/cost_runs.log"
    benchmark: "<benchmarks>/cost_runs.tsv"
    params:
        scenes=COST_SCENES,
        batch=COST["batch"],
        rejections=COST["rejections"],
    threads: workflow.cores
    script: "../scripts/cost/cost_runs.py"


rule cost_study:
    input:
        rules.cost_pairs.output,
        rules.cost_growth.output,
        rules.fig_growth.output,
        rules.cost_stages.output,
        rules.cost_runs.output,
