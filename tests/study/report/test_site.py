"""The report's pages: answer first, command last, one order, and nothing that needs a network."""

import re
from html.parser import HTMLParser
from pathlib import Path

import pandas as pd
import pytest
from matplotlib.figure import Figure

from study.report.answers import ANSWERS
from study.report.site import write_site
from tests.conftest import ROOT


class Page(HTMLParser):
    """Addresses and texts of a page, tag by tag."""

    def __init__(self, path):
        super().__init__()
        self.addresses, self.texts, self.tags = [], [], []
        self.feed(path.read_text("utf-8"))

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))
        self.addresses += [value for name, value in attributes if name in ("src", "href")]

    def handle_data(self, data):
        if data.strip():
            self.texts.append((self.tags[-1][0], data.strip()))


def check_pages(pages):
    """Everything that holds for every page of a report."""
    assert pages[0].name == "index.html"
    for path in pages:
        page = Page(path)
        tags = [tag for tag, _ in page.tags]
        assert not {"script", "link", "iframe"} & set(tags)
        for address in page.addresses:
            target, _, anchor = address.partition("#")
            assert re.match(r"[a-z]+:|//", address) is None, f"{path.name} leads elsewhere: {address}"
            assert not target or (path.parent / target).is_file(), f"{path.name}: {address} is not there"
        assert page.texts[-1][0] == "pre" and page.texts[-1][1].startswith(("snakemake --cores 2 ", "make study"))
        if path != pages[0]:
            first = tags.index("h1") + 1
            assert page.tags[first] == ("p", {"class": "answer"})
            (answer,) = [text for (tag, text) in page.texts[page.texts.index(_title(page)) + 1 :][:1]]
            assert re.search(r"\d", answer), answer
    links = [address for address in Page(pages[0]).addresses if address != "index.html"]
    assert list(dict.fromkeys(links)) == [path.name for path in pages[1:]]


def _title(page):
    return next(text for text in page.texts if text[0] == "h1")


@pytest.fixture
def results(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for folder in ("critical_speed", "sweeps"):
        (tmp_path / "results" / folder).mkdir(parents=True)
    columns = ["vehicle", "detection", "linear_critical_speed_m_per_s", "nonlinear_critical_speed_m_per_s"]
    rows = [
        ("coach", "planar", 75.1, 72.2),
        ("coach", "spatial", 75.0, 72.4),
        ("wheelset", "spatial", 58.1, float("nan")),
    ]
    pd.DataFrame(rows, columns=columns).to_csv("results/critical_speed/critical_speeds.csv", index=False)
    pd.DataFrame({"run": range(30), "status": ["completed"] * 29 + ["derailed"]}).to_csv("results/sweeps/a.csv")
    Figure().savefig("results/critical_speed/modes_coach.png")
    return Path("results")


def items(*changes):
    one = {"rule": "critical_speeds", "pattern": "results/critical_speed/critical_speeds.csv", "params": {},
           "labels": {"table": "all"}, "category": "07 Hunting: critical speeds",
           "caption": "critical_speed/critical_speeds.rst"}  # fmt: skip
    return [one | change for change in changes]


def test_pages_have_their_answer_first_and_the_command_last(results):
    marked = items(
        {"category": "12 Sweeps", "pattern": "results/sweeps/{sweep}.csv", "caption": "sweeps/sweep.rst",
         "labels": {"sweep": "{sweep}"}, "rule": "sweep_table"},
        {},
        {"rule": "fig_modes", "pattern": "results/critical_speed/modes_{vehicle}.png", "params": {"speed": 60.0},
         "labels": {"figure": "modes", "vehicle": "{vehicle}"}, "caption": "critical_speed/modes.rst"},
    )  # fmt: skip
    pages = write_site(marked, results, {}, ROOT / "workflow/report")
    check_pages(pages)
    assert [page.name for page in pages] == ["index.html", "07_hunting_critical_speeds.html", "12_sweeps.html"]
    text = pages[1].read_text("utf-8")
    assert "coach: linear 75.0 m/s, limit cycles from 72.4 m/s on; wheelset: linear 58.1 m/s." in text
    assert "<h2>modes, coach</h2>" in text and "at 60.0 m/s, spatial detection" in text
    assert "<pre>snakemake --cores 2 critical_speeds results/critical_speed/modes_coach.png</pre>" in text
    sweeps = pages[2].read_text("utf-8")
    assert "a: 30 runs, 29 completed, 1 derailed" in sweeps and sweeps.count("<tr") == 13 and "30 rows" in sweeps


def test_every_category_has_an_answer_and_none_too_many(results):
    with pytest.raises(ValueError, match="no answer for the category '14 New'"):
        write_site(items({"category": "14 New"}), results, {}, ROOT / "workflow/report")
    rules = (ROOT / "workflow/rules/common.smk").read_text("utf-8")
    assert re.findall(r'^    "\w+": "(\d\d [^"]+)",$', rules, re.MULTILINE) == list(ANSWERS) and list(
        ANSWERS
    ) == sorted(ANSWERS)
