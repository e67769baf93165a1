# One job per case: a series of runs that share imports and compiled kernels.


rule simulate:
    message:
        "{wildcards.case}: planar and spatial run"
    input:
        core=CORE["simulation"],
        scenes=SCENES,
        scene=case_scene,
        table=rules.creep_table.output,
    output:
        planar="<results>/runs/{case}/planar.h5",
        spatial="<results>/runs/{case}/spatial.h5",
    log:
        "<logs>/simulate/{case}.log",
    benchmark:
        "<benchmarks>/simulate/{case}.tsv"
    params:
        overrides=case_overrides,
    script:
        "../scripts/simulate.py"


rule simulate_twins:
    message:
        "{wildcards.case}: tighter and mirrored twin of the spatial run"
    input:
        core=CORE["simulation"],
        scenes=SCENES,
        scene=case_scene,
        table=rules.creep_table.output,
    output:
        tight="<results>/runs/{case}/spatial_tight.h5",
        mirrored="<results>/runs/{case}/spatial_mirrored.h5",
    log:
        "<logs>/simulate_twins/{case}.log",
    benchmark:
        "<benchmarks>/simulate_twins/{case}.tsv"
    params:
        overrides=case_overrides,
        twins=config["twins"],
    script:
        "../scripts/simulate_twins.py"


rule time_runs:
    message:
        "Timing: planar and spatial runs in turn, nothing beside them"
    input:
        core=CORE["simulation"] + CORE["analysis"],
        scenes=SCENES,
        table=rules.creep_table.output,
    output:
        "<results>/tables/timing_samples.csv",
    log:
        "<logs>/time_runs.log",
    benchmark:
        "<benchmarks>/time_runs.tsv"
    params:
        cases={case: [config["cases"][case]["scene"], overrides(case)] for case in config["timing"]["cases"]},
        repetitions=config["timing"]["repetitions"],
    # all cores: nothing else may run beside it
    threads: workflow.cores
    script:
        "../scripts/time_runs.py"
