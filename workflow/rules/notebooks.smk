# Notebooks that compute what they show: executed as they are, by a fresh kernel in their folder.

NOTEBOOKS = sorted(p.stem for p in Path("notebooks").glob("*.ipynb") if p.stem != "first_light")
CORE["notebooks"] = sorted(str(p) for p in Path("wrcore").rglob("*") if p.suffix in (".py", ".yaml", ".csv"))


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
        "../scripts/notebook.py"


rule notebooks:
    input:
        expand(rules.notebook.output, notebook=NOTEBOOKS),
