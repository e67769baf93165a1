# Tables, the notebook and the report.


rule motion_table:
    message:
        "Table: motion"
    input:
        core=CORE["analysis"],
        planar=expand(rules.simulate.output.planar, case=CASES),
        spatial=expand(rules.simulate.output.spatial, case=CASES),
        tight=expand(rules.simulate_twins.output.tight, case=WITH_TWINS),
        mirrored=expand(rules.simulate_twins.output.mirrored, case=WITH_TWINS),
    output:
        report(
            "<results>/tables/motion.csv",
            caption="../report/motion.rst",
            category="02 The paper's figures",
            labels={"table": "motion"},
        ),
    log:
        "<logs>/motion_table.log",
    params:
        bound=config["twins"]["bound"],
    script:
        "../scripts/motion_table.py"


rule timing_table:
    message:
        "Table: timing"
    input:
        core=CORE["analysis"],
        samples=rules.time_runs.output,
    output:
        report(
            "<results>/tables/timing.csv",
            caption="../report/timing.rst",
            category="08 Cost",
            labels={"table": "timing"},
        ),
    log:
        "<logs>/timing_table.log",
    script:
        "../scripts/timing_table.py"


rule comparison_table:
    message:
        "Table: published values beside ours"
    input:
        core=CORE["analysis"],
        reference="reports/reference_values.csv",
        geometry=rules.contact_geometry.output,
        motion=rules.motion_table.output,
        timing=rules.timing_table.output,
    output:
        report(
            "<results>/tables/comparison.csv",
            caption="../report/comparison.rst",
            category="01 The paper's values and ours",
            labels={"table": "comparison"},
        ),
        "<results>/tables/comparison.md",
    log:
        "<logs>/comparison_table.log",
    params:
        case=config["comparison"]["case"],
    script:
        "../scripts/comparison_table.py"


rule first_light_notebook:
    message:
        "Notebook: loads runs, redraws Fig. 4"
    input:
        core=CORE["figures"],
        notebook="notebooks/first_light.ipynb",
        runs=expand([rules.simulate.output.planar, rules.simulate.output.spatial], case=CASES),
        tight=expand(rules.simulate_twins.output.tight, case=WITH_TWINS),
    output:
        "<results>/notebooks/first_light.ipynb",
    log:
        "<logs>/first_light_notebook.log",
    script:
        "../scripts/first_light_notebook.py"


rule study:
    input:
        rules.contact_geometry.output,
        rules.fig1_parametrisation.output,
        rules.fig2_profiles.output,
        rules.fig3_detection.output,
        rules.fig4_lateral_position.output,
        rules.fig5_contact_points.output,
        rules.motion_table.output,
        rules.timing_table.output,
        rules.comparison_table.output,
        rules.first_light_notebook.output,
        rules.notebooks.input,
        rules.creep_study.input,
        rules.contact_study.input,
        rules.critical_speed_study.input,
        rules.stability_study.input,
        rules.sweeps.input,
        rules.ivp_study.input,
        rules.speeds_study.input,
        rules.speed_against_error.output,
        rules.cost_study.input,


rule report_archive:
    message:
        "Report: {output}"
    input:
        rules.study.input,
        captions=expand("workflow/report/{name}", name=sorted(p.name for p in (HERE / "workflow/report").glob("*.rst"))),
    output:
        "<results>/report.zip",
    log:
        "<logs>/report_archive.log",
    params:
        config=config,
    script:
        "../scripts/report_archive.py"
