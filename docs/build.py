"""Build the documentation site without a network: ``python docs/build.py [FOLDER]`` (default: results/docs).

Sources are laid out in a temporary folder: the pages of `docs/`, `reports/*.md` as guides, notebooks as tutorials, and
what `reference.py` makes of docstrings, parsers and schemas. Warnings are errors.
"""

import re
import shutil
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
GUIDES = (
    "first_result", "bring_your_own", "scenes", "contact_models", "lubrication", "tracks", "crossings",
    "vehicle_files", "own_physics", "freight_wagon", "co_simulation", "fmi", "sweeps", "clusters", "arrays",
    "assessment", "report_page", "signals", "wear", "how_runs_end", "accuracy", "limits", "patch", "looked_up",
    "stability", "response", "cost", "comparison", "gallery", "evidence", "versions",
)  # fmt: skip
"""Pages of `reports/` in reading order; others follow."""

TUTORIALS = (
    "contact_geometry",
    "wheelset_hunting",
    "trailer_vehicle",
    "creep_table",
    "speed_against_error",
    "first_light",
)
FINDINGS = (
    ("Does it reproduce the paper?", "comparison", "Comparison with the paper and with other published values"),
    ("What does the patch model matter, pose by pose?", "patch", "One patch"),
    ("And in runs of vehicles?", "patch", "Vehicles"),
    ("What costs what?", "cost", "Pairs"),
    ("Where do the methods break?", "stability", "Known limits"),
)
"""Questions, and the sections of reports that answer them."""
PICTURES = (
    ("The paper's Fig. 4: a free wheelset, planar and spatial. Beyond the prediction horizon (shaded) only statistics "
     "can be compared.", "fig4_lateral_position"),
    ("Creep laws and tables: cost against error, with CONTACT's own points.", "creep_cost"),
    ("Hunting of wheelset and trailer vehicle: linear critical speeds and limit cycles.", "limit_cycles"),
    ("Where the time of one right-hand side goes, against the machine's limit.", "cost_breakdown"),
)  # fmt: skip
"""Captions and committed figures."""


def section(text, heading):
    """Text below a heading, up to the next one of the same or a higher level, without the heading."""
    found = re.search(rf"^(#+) {re.escape(heading)}\n(.*?)(?=^#{{1,2}} |\Z)", text, re.MULTILINE | re.DOTALL)
    if not found:
        raise ValueError(f"no section {heading!r}")
    return found[2].strip()


def ordered(names, first):
    """Names, those of ``first`` in its order before all others."""
    return [name for name in first if name in names] + sorted(set(names) - set(first))


def toctree(entries, options=()):
    """A table of contents in Markdown."""
    return "\n".join(["```{toctree}", *(f":{option}:" for option in options), *entries, "```", ""])


def findings():
    """What the study found, from the reports that state it."""
    from page_tables import front_markdown

    parts = [
        "# What the study found\n",
        "Quoted from the pages that are named; they have the commands that make their numbers. The whole study is "
        "`results/report.zip` (`make study`), to be read in a browser.\n",
        "## What does an accuracy cost?\n",
        "![Speed against error of every choice, in six scenes](../figures/speed_against_error.png)\n",
        "The fastest choice for an accuracy of the lateral position (`snakemake speed_against_error`, kept in "
        f"`wrcore/run/accuracy_front.csv`):\n\n{front_markdown()}\n",
    ]
    for question, name, heading in FINDINGS:
        text = guide_text(section((ROOT / f"reports/{name}.md").read_text("utf-8"), heading))
        parts.append(f"## {question}\n\n{text}\n\nFrom [{name}]({name}.md).\n")
    parts.append("## Pictures\n")
    parts += [
        f"{caption} (Rule in [gallery](gallery.md).)\n\n![{caption}](../figures/{name}.png)\n"
        for caption, name in PICTURES
    ]
    return "\n".join(parts)


def guide_text(text):
    """Text of a page of `reports/` as a page of the site: links to figures and theory lead there, those to files that
    are not part of the site are plain text.
    """
    text = text.replace("](figures/", "](../figures/").replace("](../docs/theory/", "](../theory/")
    return re.sub(r"\]\(\.\./(?!figures/|theory/)[^)]*\)", "]", text)


def lay_out(folder):
    """Write all sources of the site.

    Parameters
    ----------
    folder : Path
        Empty or not yet there.
    """
    from figures import draw_figures
    from reference import write_reference

    shutil.copytree(ROOT / "docs", folder, ignore=shutil.ignore_patterns("__pycache__"))
    guides, tutorials = folder / "guide", folder / "tutorials"
    guides.mkdir()
    tutorials.mkdir()
    shutil.copytree(ROOT / "reports/figures", folder / "figures")
    for path in (ROOT / "reports").glob("*.md"):
        (guides / path.name).write_text(guide_text(path.read_text("utf-8")), "utf-8")
    names = ordered([path.stem for path in guides.glob("*.md")], GUIDES)
    (guides / "findings.md").write_text(findings(), "utf-8")
    (guides / "index.md").write_text(f"# How to\n\n{toctree(names)}", "utf-8")
    names = [_tutorial(path, tutorials) for path in (ROOT / "notebooks").glob("*.ipynb")]
    (tutorials / "index.md").write_text(f"# Tutorials\n\n{toctree(ordered(names, TUTORIALS))}", "utf-8")
    draw_figures(folder / "theory")
    write_reference(folder / "reference")


def _tutorial(path, folder):
    """Write a notebook as Markdown, with outputs where the study has executed it; its name."""
    from nbconvert import MarkdownExporter

    executed = ROOT / "results/notebooks" / path.name
    text, resources = MarkdownExporter().from_filename(str(executed if executed.exists() else path))
    for name, content in resources["outputs"].items():
        (folder / f"{path.stem}_{name}").write_bytes(content)
        text = text.replace(f"]({name})", f"]({path.stem}_{name})")
    text = re.sub(r"\]\(\.\./[^)]*\)", "]", text)
    lead, _, rest = text.strip().partition("\n")
    where = f"*The notebook is `notebooks/{path.name}`; `make study` executes it into `results/notebooks/`.*"
    (folder / f"{path.stem}.md").write_text(f"{lead}\n\n{where}\n\n{rest}\n", "utf-8")
    return path.stem


def build(target):
    """Build the site into a folder; exit status of Sphinx."""
    from sphinx.cmd.build import main

    with tempfile.TemporaryDirectory() as place:
        source = Path(place) / "source"
        lay_out(source)
        doctrees = str(Path(place) / "doctrees")
        return main(["-q", "-W", "--keep-going", "-b", "html", "-d", doctrees, str(source), str(target)])


if __name__ == "__main__":
    sys.path[:0] = [str(ROOT), str(ROOT / "workflow"), str(ROOT / "docs")]
    out = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "results/docs"
    status = build(out)
    if not status:
        print(f"documentation: {out / 'index.html'}")
    sys.exit(status)
