# A published benchmark of constrained wheelset dynamics: the Test Set's "Wheelset", solved and priced.

IVP = config["ivp"]
CORE["ivp"] = sources("kernels", "study/ivp/problem", "study/ivp/wheelset", "study/ivp/runs")
CORE["ivp_figures"] = CORE["ivp"] + sources(*STYLE, "study/ivp/figures")


rule ivp_wheelset:
    message: "Benchmark: the Test Set's wheelset, nothing beside it"
    input:
        core=CORE["ivp"],
        problem=IVP["problem"],
    output:
        work_precision=shown("ivp/ivp_work_precision.csv", "error and work"),
        stabilisation=shown("ivp/ivp_stabilisation.csv", "Baumgarte and projection"),
        values="<results>/ivp/ivp_values.csv",
        history="<results>/ivp/ivp_constraints.csv",
    log: "<logs>/ivp_wheelset.log"
    benchmark: "<benchmarks>/ivp_wheelset.tsv"
    params:
        settings=IVP,
    # all cores: nothing else may run beside it
    threads: workflow.cores
    script: "../scripts/ivp/ivp.py"


rule fig_ivp:
    message: "Benchmark: error against work, drift of the constraints"
    input:
        core=CORE["ivp_figures"],
        problem=IVP["problem"],
        work_precision=rules.ivp_wheelset.output.work_precision,
        history=rules.ivp_wheelset.output.history,
    output:
        work_precision=shown("ivp/ivp_work_precision.png", "error and work"),
        constraints=shown("ivp/ivp_constraints.png", "drift of the constraints"),
        svg=expand("<results>/ivp/ivp_{name}.svg", name=["work_precision", "constraints"]),
    log: "<logs>/fig_ivp.log"
    params:
        bar=IVP["bar"],
    script: "../scripts/ivp/fig_ivp.py"


rule ivp_study:
    input:
        rules.ivp_wheelset.output,
        rules.fig_ivp.output,
