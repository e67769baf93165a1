"""reports/first_result.md and the site's first page work as written, from an empty folder, and print what they show."""

import re

import numpy as np
import pytest

import wrcore as wr
from tests.conftest import ROOT
from tests.pages import blocks, run_blocks

PAGE = "first_result.md"


def test_it_has_less_than_twenty_lines():
    (code,) = (text for kind, text in blocks(PAGE) if kind == "python")
    assert len([line for line in code.splitlines() if line.strip()]) < 20


WORN = re.compile(r"wr\.named_profile\(\W+\w+\W+, \W*wheel\W*\)\(u\) [^\n#]*np\.exp\([^\n#]*")
"""A worn wheel as pages and notebooks write it, up to its comment."""


def test_hollow_wheel_of_every_page_lowers_the_tread():
    u = np.linspace(-0.055, 0.055, 600)
    new, found = wr.named_profile("S1002", "wheel")(u), {}
    pages = [ROOT / "README.md", *(ROOT / "reports").glob("*.md"), *(ROOT / "docs").rglob("*.md")]
    for path in [*pages, *(ROOT / "notebooks").glob("*.ipynb")]:
        for text in WORN.findall(path.read_text("utf-8").replace('\\"', '"')):
            found[path.name] = eval(text, {"wr": wr, "np": np, "u": u})
    assert {"first_result.md", "bring_your_own.md"} <= set(found)
    for name, f in found.items():
        radius = 0.46 - f  # f = r0 - r: a smaller radius lies higher
        lost = (0.46 - new) - radius
        assert lost.min() >= 0.0, f"{name}: wear adds material"
        assert lost[np.abs(u) < 1e-3].min() == pytest.approx(3e-4, rel=0.01), name
        assert lost[np.abs(u) > 0.04].max() < 1e-8, name


def test_it_prints_what_it_shows(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    run_blocks(PAGE)
    (shown,) = (text for kind, text in blocks(PAGE) if kind == "text")
    lines = [line.split() for line in shown.strip().splitlines()]
    printed = [line.split() for line in capsys.readouterr().out.strip().splitlines()[-len(lines) :]]
    assert printed[0] == lines[0] and len(printed) == 9
    for mine, theirs in zip(printed[1:], lines[1:], strict=True):
        assert mine[:2] == theirs[:2]
        assert [float(x) for x in mine[2:]] == pytest.approx([float(x) for x in theirs[2:]], rel=0.01, abs=0.02)
    assert (tmp_path / "curve.png").read_bytes().startswith(b"\x89PNG")


def test_the_first_page_of_the_site_prints_what_it_shows(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    found = dict(blocks("../docs/index.md"))
    assert len(list(filter(None, found["python"].splitlines()))) == 5
    exec(compile(found["python"], "docs/index.md", "exec"), {})
    printed, shown = (text.strip().splitlines() for text in (capsys.readouterr().out, found["text"]))
    assert printed[0].split(" in ")[0] == shown[0].split(" in ")[0] and printed[1].split() == shown[1].split()
    for mine, theirs in zip(printed[2:], shown[2:], strict=True):
        assert mine.split()[0] == theirs.split()[0]
        assert [float(x) for x in mine.split()[1:]] == pytest.approx([float(x) for x in theirs.split()[1:]], rel=0.01)
    assert (tmp_path / "hunting.png").read_bytes().startswith(b"\x89PNG")
