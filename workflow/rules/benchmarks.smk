# A published benchmark of constrained wheelset dynamics: the Test Set's "Wheelset", solved and priced.

IVP = config["ivp_wheelset"]
CORE["ivp"] = sources("dynamics", "analysis_ivp", "analysis_ivp_problem", "analysis_ivp_wheelset")
CORE["ivp_figures"] = CORE["ivp"] + sources("figures", "figures_benchmarks")


rule ivp_wheelset:
    message:
        "Benchmark: the Test Set's wheelset, nothing beside it"
    input:
        core=CORE["ivp"],
        problem=IVP["problem"],
    output:
        work_precision=report(
            "<results>/tables/ivp_work_precision.csv",
            caption="../report/ivp_work_precision.rst",
            category="10 Benchmark of integrators",
            labels={"table": "error and work"},
        ),
        stabilisation=report(
            "<results>/tables/ivp_stabilisation.csv",
            caption="../report/ivp_stabilisation.rst",
            category="10 Benchmark of integrators",
            labels={"table": "Baumgarte and projection"},
        ),
        values="<results>/tables/ivp_values.csv",
        history="<results>/tables/ivp_constraints.csv",
    log:
        "<logs>/ivp_wheelset.log",
    benchmark:
        "<benchmarks>/ivp_wheelset.tsv"
    params:
        settings=IVP,
    # all cores: nothing else may run beside it
    threads: workflow.cores
    script:
        "../scripts/ivp.py"


rule fig_ivp:
    message:
        "Benchmark: error against work, drift of the constraints"
    input:
        core=CORE["ivp_figures"],
        problem=IVP["problem"],
        work_precision=rules.ivp_wheelset.output.work_precision,
        history=rules.ivp_wheelset.output.history,
    output:
        work_precision=report(
            "<results>/figures/ivp_work_precision.png",
            caption="../report/ivp_work_precision.rst",
            category="10 Benchmark of integrators",
            labels={"figure": "error and work"},
        ),
        constraints=report(
            "<results>/figures/ivp_constraints.png",
            caption="../report/ivp_constraints.rst",
            category="10 Benchmark of integrators",
            labels={"figure": "drift of the constraints"},
        ),
        svg=expand("<results>/figures/ivp_{name}.svg", name=["work_precision", "constraints"]),
    log:
        "<logs>/fig_ivp.log",
    params:
        bar=IVP["bar"],
    script:
        "../scripts/fig_ivp.py"


rule ivp_study:
    input:
        rules.ivp_wheelset.output,
        rules.fig_ivp.output,
