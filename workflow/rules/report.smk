# The notebooks, the study as a whole, and its report.

NOTEBOOKS = sorted(p.stem for p in Path("notebooks").glob("*.ipynb"))
CORE["notebooks"] = sources("", "study/")


wildcard_constraints:
    notebook="|".join(NOTEBOOKS),


rule notebook:
    message:
        "Notebook: {wildcards.notebook}"
    input:
        core=CORE["notebooks"],
        scenes=SCENES,
        notebook="notebooks/{notebook}.ipynb",
    output:
        "<results>/notebooks/{notebook}.ipynb",
    log:
        "<logs>/notebooks/{notebook}.log",
    benchmark:
        "<benchmarks>/notebooks/{notebook}.tsv"
    script:
        "../scripts/report/notebook.py"


rule notebooks:
    input:
        expand(rules.notebook.output, notebook=NOTEBOOKS),


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
        rules.notebooks.input,
        rules.creep_study.input,
        rules.contact_study.input,
        rules.patch_study.input,
        rules.critical_speed_study.input,
        rules.hard_cases_study.input,
        rules.sweeps.input,
        rules.wear_study.input,
        rules.ivp_study.input,
        rules.speeds_study.input,
        rules.speed_against_error.output,
        rules.accuracy_requests.output,
        rules.claims.output,
        rules.cost_study.input,


rule report_archive:
    message:
        "Report: {output}"
    input:
        rules.study.input,
        captions=sorted(str(p.relative_to(HERE)) for p in (HERE / "workflow/report").rglob("*.rst")),
    output:
        "<results>/report.zip",
    log:
        "<logs>/report_archive.log",
    params:
        config=config,
    script:
        "../scripts/report/report_archive.py"
