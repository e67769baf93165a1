# What things cost: pairs timed in turn, stages of one evaluation, growth, batches, rejected steps.

COST = config["cost"]
CORE["cost"] = CORE["simulation"] + sources("sweep", "reference", "study/cost")
COST_SCENES = {name: (entry["title"], entry["scene"], changes(entry["set"])) for name, entry in COST["scenes"].items()}


rule cost_pairs:
    message:
        "Benchmarks: pairs in turn, nothing beside them"
    input:
        core=CORE["cost"],
        scenes=SCENES,
    output:
        pairs=report(
            "<results>/cost/benchmarks.csv",
            caption="../report/cost/benchmarks.rst",
            category="09 Cost",
            labels={"table": "benchmarks"},
        ),
        machine=report(
            "<results>/cost/benchmark_machine.csv",
            caption="../report/cost/benchmark_machine.rst",
            category="09 Cost",
            labels={"table": "machine"},
        ),
    log:
        "<logs>/cost_pairs.log",
    benchmark:
        "<benchmarks>/cost_pairs.tsv"
    params:
        scenes=COST_SCENES,
        settings=COST["pairs"],
    # all cores: nothing else may run beside what is timed
    threads: workflow.cores
    script:
        "../scripts/cost/cost_pairs.py"


rule cost_growth:
    message:
        "Cost over wheelsets, duration, tolerance, simultaneous scenes"
    input:
        core=CORE["cost"],
        scenes=SCENES,
    output:
        wheelsets=report(
            "<results>/cost/growth_wheelsets.csv",
            caption="../report/cost/growth_wheelsets.rst",
            category="09 Cost",
            labels={"table": "growth with wheelsets"},
        ),
        runs=report(
            "<results>/cost/growth_runs.csv",
            caption="../report/cost/growth_runs.rst",
            category="09 Cost",
            labels={"table": "growth with duration and tolerance"},
        ),
        simultaneous=report(
            "<results>/cost/growth_scenes.csv",
            caption="../report/cost/growth_scenes.rst",
            category="09 Cost",
            labels={"table": "scenes at the same time"},
        ),
        chains=report(
            "<results>/cost/growth_chains.csv",
            caption="../report/cost/growth_chains.rst",
            category="09 Cost",
            labels={"table": "growth with joints"},
        ),
        findings=report(
            "<results>/cost/growth_memory.csv",
            caption="../report/cost/growth_memory.rst",
            category="09 Cost",
            labels={"table": "arithmetic or memory"},
        ),
    log:
        "<logs>/cost_growth.log",
    benchmark:
        "<benchmarks>/cost_growth.tsv"
    params:
        scenes=COST_SCENES,
        settings=COST["growth"],
    threads: workflow.cores
    script:
        "../scripts/cost/cost_growth.py"


rule fig_growth:
    message:
        "Figure: growth of cost"
    input:
        core=CORE["cost"] + sources(*STYLE),
        wheelsets=rules.cost_growth.output.wheelsets,
        runs=rules.cost_growth.output.runs,
        simultaneous=rules.cost_growth.output.simultaneous,
    output:
        png=report(
            "<results>/cost/growth.png",
            caption="../report/cost/growth.rst",
            category="09 Cost",
            labels={"figure": "growth"},
        ),
        svg="<results>/cost/growth.svg",
    log:
        "<logs>/fig_growth.log",
    script:
        "../scripts/cost/fig_growth.py"


rule cost_stages:
    message:
        "Time, operations and bytes of one right-hand side by stage"
    input:
        core=CORE["cost"] + sources(*STYLE),
        scenes=SCENES,
    output:
        stages=report(
            "<results>/cost/cost_breakdown.csv",
            caption="../report/cost/cost_breakdown.rst",
            category="09 Cost",
            labels={"table": "stages of a right-hand side"},
        ),
        limits=report(
            "<results>/cost/machine_limits.csv",
            caption="../report/cost/machine_limits.rst",
            category="09 Cost",
            labels={"table": "limits of the machine"},
        ),
        png=report(
            "<results>/cost/cost_breakdown.png",
            caption="../report/cost/cost_breakdown.rst",
            category="09 Cost",
            labels={"figure": "stages of a right-hand side"},
        ),
        svg="<results>/cost/cost_breakdown.svg",
    log:
        "<logs>/cost_stages.log",
    benchmark:
        "<benchmarks>/cost_stages.tsv"
    params:
        scenes=COST_SCENES,
        settings=COST["stages"],
    threads: workflow.cores
    script:
        "../scripts/cost/cost_stages.py"


rule cost_runs:
    message:
        "Batch of runs, rejected steps"
    input:
        core=CORE["cost"],
        scenes=SCENES,
    output:
        batch=report(
            "<results>/cost/batch.csv",
            caption="../report/cost/batch.rst",
            category="09 Cost",
            labels={"table": "a batch in one process"},
        ),
        rejections=report(
            "<results>/cost/rejected_steps.csv",
            caption="../report/cost/rejected_steps.rst",
            category="09 Cost",
            labels={"table": "rejected steps"},
        ),
    log:
        "<logs>/cost_runs.log",
    benchmark:
        "<benchmarks>/cost_runs.tsv"
    params:
        scenes=COST_SCENES,
        batch=COST["batch"],
        rejections=COST["rejections"],
    threads: workflow.cores
    script:
        "../scripts/cost/cost_runs.py"


rule cost_study:
    input:
        rules.cost_pairs.output,
        rules.cost_growth.output,
        rules.fig_growth.output,
        rules.cost_stages.output,
        rules.cost_runs.output,
