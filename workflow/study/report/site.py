"""The report as plain HTML pages in reading order, without network and scripts.

Each category of results has a page. It starts with the answer, continues with figures and tables with their captions,
and ends with the command that reproduces them. Pages link to the pictures in the study's folders.
"""

import os
import re
from html import escape
from pathlib import Path
from types import SimpleNamespace

import pandas as pd
from docutils.core import publish_parts
from jinja2 import Environment, StrictUndefined

from study.report.answers import ANSWERS

MOST_ROWS = 12
"""Maximum number of rows of a table on a page; the file contains all rows."""

STYLE = """
body { font: 16px/1.45 sans-serif; max-width: 62rem; margin: 1rem auto; padding: 0 1rem; color: #222; }
nav { font-size: 0.9rem; margin-bottom: 1rem; } nav a { margin-right: 0.8rem; }
.answer { font-size: 1.15rem; border-left: 4px solid #0072b2; padding-left: 0.8rem; }
figure { margin: 0 0 0.5rem; } img { max-width: 100%; height: auto; }
.table { overflow-x: auto; } table { border-collapse: collapse; font-size: 0.8rem; }
td, th { border-bottom: 1px solid #ddd; padding: 0.15rem 0.5rem; text-align: right; }
pre { background: #f4f4f4; padding: 0.6rem; overflow-x: auto; white-space: pre-wrap; }
"""


def write_site(items, results, config, captions):
    """Write ``<results>/report/index.html`` and its linked pages; return these pages in reading order.

    ``items`` are the outputs that rules mark for the report: rule, pattern (path with wildcards), category, caption
    (file below ``captions``), labels, params. ValueError for a category without an answer.
    """
    results, captions = Path(results), Path(captions)
    unknown = sorted({item["category"] for item in items} - set(ANSWERS))
    if unknown:
        raise ValueError(f"no answer for the category {unknown[0]!r}: see study.report.answers")
    folder = results / "report"
    folder.mkdir(parents=True, exist_ok=True)
    pages = {}
    for category in ANSWERS:
        own = [item for item in items if item["category"] == category]
        if own:
            pages[category] = (_slug(category), _answer(category, results), own)
    names = {category: slug for category, (slug, _, _) in pages.items()}
    written = []
    for category, (slug, answer, own) in pages.items():
        parts = [_part(path, wildcards, item, folder, config, captions)
                 for item in own for path, wildcards in _files(item["pattern"])]  # fmt: skip
        body = f'<h1>{escape(_title(category))}</h1>\n<p class="answer">{escape(answer)}</p>\n' + "\n".join(parts)
        body += f"\n<h2>Again</h2>\n<pre>{escape(_command(own))}</pre>"
        written.append(_write(folder / f"{slug}.html", _title(category), body, names))
    lines = [
        f'<li><a href="{slug}.html">{escape(_title(c))}</a>: {escape(a)}</li>' for c, (slug, a, _) in pages.items()
    ]
    overview = f"<h1>Wheel-rail contact in railway dynamics</h1>\n<ol>\n{chr(10).join(lines)}\n</ol>"
    overview += "\n<h2>Again</h2>\n<pre>make study</pre>"
    return [_write(folder / "index.html", "Report", overview, names), *written]


def _answer(category, results):
    def read(name):
        if "*" in name:
            return {path.stem: pd.read_csv(path) for path in sorted(results.glob(name))}
        return pd.read_csv(results / name)

    return ANSWERS[category](read)


def _slug(category):
    return re.sub(r"[^a-z0-9]+", "_", category.lower().replace("'", "")).strip("_")


def _title(category):
    return category.partition(" ")[2]


def _files(pattern):
    """Return the existing files of a path with wildcards, each with the values of the wildcards."""
    pieces = re.split(r"\{(\w+)[^}]*\}", pattern)
    shape = "".join(f"(?P<{p}>[^/]+)" if k % 2 else re.escape(p) for k, p in enumerate(pieces))
    found = sorted(Path().glob("".join("*" if k % 2 else p for k, p in enumerate(pieces))))
    matches = [(path, re.fullmatch(shape, path.as_posix())) for path in found]
    return [(path, match.groupdict()) for path, match in matches if match]


def _part(path, wildcards, item, folder, config, captions):
    """Return the HTML of a figure or table with its labels and its caption."""
    labels = ", ".join(str(value).format(**wildcards) for value in item["labels"].values())
    link = escape(Path(os.path.relpath(path, folder)).as_posix())
    stub = SimpleNamespace(params=SimpleNamespace(**_spaces(item["params"])), config=config,
                           wildcards=SimpleNamespace(**wildcards))  # fmt: skip
    source = (captions / item["caption"]).read_text(encoding="utf-8")
    caption = Environment(undefined=StrictUndefined).from_string(source).render(snakemake=stub)
    said = publish_parts(caption, writer_name="html5", settings_overrides={"report_level": 5})["body"]
    if path.suffix == ".png":
        shown = f'<figure><a href="{link}"><img src="{link}" alt="{escape(labels)}" loading="lazy"></a></figure>'
    elif path.suffix == ".csv":
        shown = _table(path, link)
    else:
        shown = f'<p><a href="{link}">{escape(path.name)}</a></p>'
    return f"<h2>{escape(labels)}</h2>\n{shown}\n{said}"


def _spaces(values):
    """Return mappings as objects with attributes, the form that captions need."""
    return {name: SimpleNamespace(**value) if isinstance(value, dict) and all(isinstance(k, str) for k in value)
            else value for name, value in values.items()}  # fmt: skip


def _table(path, link):
    table = pd.read_csv(path, keep_default_na=False, na_values=[""])
    rows = table.head(MOST_ROWS).to_html(index=False, na_rep="", float_format=lambda value: f"{value:.4g}", border=0)
    return f'<div class="table">{rows}</div>\n<p>{len(table)} rows: <a href="{link}">{escape(path.name)}</a></p>'


def _command(items):
    """Return the command that reproduces a page's results: rules by name, or by their files if they have wildcards."""
    targets = dict.fromkeys(item["rule"] for item in items if "{" not in item["pattern"])
    targets |= dict.fromkeys(
        str(path) for item in items if "{" in item["pattern"] for path, _ in _files(item["pattern"])
    )
    return "snakemake --cores 2 " + " ".join(targets)


def _write(path, title, body, names):
    links = ['<a href="index.html">Report</a>']
    links += [f'<a href="{slug}.html">{escape(_title(category))}</a>' for category, slug in names.items()]
    page = f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n<title>{escape(title)}</title>\n'
    page += f"<style>{STYLE}</style>\n</head>\n<body>\n<nav>{' '.join(links)}</nav>\n{body}\n</body>\n</html>\n"
    path.write_text(page, encoding="utf-8")
    return path
