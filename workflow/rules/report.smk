# The notebooks, the study as a whole, and its report.

from snakemake.io import get_flag_value

NOTEBOOKS = sorted(p.stem for p in Path("notebooks").glob("*.ipynb"))
CORE["notebooks"] = sources("", "study/")


wildcard_constraints:
    notebook="|".join(NOTEBOOKS),


rule notebook:
    message: "Notebook: {wildcards.notebook}"
    input:
        core=CORE["notebooks"],
        scenes=SCENES,
        notebook="notebooks/{notebook}.ipynb",
    output:
        "<results>/notebooks/{notebook}.ipynb",
    log: "<logs>/notebooks/{notebook}.log"
    benchmark: "<benchmarks>/notebooks/{notebook}.tsv"
    script: "../scripts/report/notebook.py"


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
        rules.crossings_study.input,
        rules.ivp_study.input,
        rules.speeds_study.input,
        rules.speed_against_error.output,
        rules.accuracy_requests.output,
        rules.claims.output,
        rules.cost_study.input,


def report_items(wildcards):
    """What the rules mark for the report, in their order; params only where they are plain values."""
    items = []
    for rule in workflow.rules:
        plain = {name: value for name, value in rule.params.items() if not callable(value)}
        for path in rule.output:
            flag = get_flag_value(path, "report")
            if flag:
                caption = Path(flag.caption.get_path_or_uri(secret_free=True)).resolve()
                items.append({
                    "rule": rule.name, "pattern": str(path), "category": flag.category, "labels": dict(flag.labels),
                    "caption": caption.relative_to(HERE / "workflow/report").as_posix(), "params": plain,
                })  # fmt: skip
    return items


rule report_pages:
    message: "Report as pages: {output}"
    input:
        rules.study.input,
        core=sources("study/report"),
        captions=sorted(str(p.relative_to(HERE)) for p in (HERE / "workflow/report").rglob("*.rst")),
    output:
        "<results>/report/index.html",
    log: "<logs>/report_pages.log"
    params:
        marked=report_items,
        config=config,
    script: "../scripts/report/report_pages.py"


rule report_archive:
    message: "Report: {output}"
    input:
        rules.study.input,
        captions=sorted(str(p.relative_to(HERE)) for p in (HERE / "workflow/report").rglob("*.rst")),
    output:
        "<results>/report.zip",
    log: "<logs>/report_archive.log"
    params:
        config=GIVEN,
    script: "../scripts/report/report_archive.py"
