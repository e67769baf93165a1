"""What the README and the pages it sends a reader to first say can be done as written."""

import re

import pytest

from docs.page_tables import front_markdown
from tests.conftest import ROOT
from wrcore.cli import parser
from wrcore.run.accuracy import measured_front

PAGES = ("README.md", "reports/accuracy.md", "reports/limits.md", "reports/first_result.md")
TEXTS = {page: (ROOT / page).read_text(encoding="utf-8") for page in PAGES}
README = TEXTS["README.md"]


def test_it_is_read_in_two_minutes():
    assert len(README.split()) <= 700


def test_the_example_has_five_lines_and_runs_as_written(tmp_path, monkeypatch, capsys):
    (block,) = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    assert len([line for line in block.splitlines() if line.strip()]) <= 5
    monkeypatch.chdir(tmp_path)
    exec(block, {})
    said = capsys.readouterr().out
    assert "completed" in said and "Y_over_Q_max" in said and (tmp_path / "hunting.png").is_file()


def test_what_is_to_be_typed_can_be_typed():
    lines = [line.strip() for line in README.splitlines() if line.startswith("    ")]
    assert {line.split()[0] for line in lines} == {"make", "wrcore"}
    for line in lines:
        program, *words = line.partition("#")[0].split()
        assert "|" not in words
        if program == "make":
            assert re.search(rf"^{words[0]}:", (ROOT / "Makefile").read_text(), re.MULTILINE)
        elif "--help" not in words:
            parser().parse_args(words)


@pytest.mark.parametrize("page", PAGES)
def test_every_file_that_is_named_exists(page):
    folder = (ROOT / page).parent
    linked = [folder / name for name in re.findall(r"\]\(([\w/.]+)\)", TEXTS[page])]
    named = [ROOT / name for name in re.findall(r"`((?:config|tests|reports|wrcore|notebooks)/[\w/.]*)`", TEXTS[page])]
    assert linked
    assert [str(path) for path in linked + named if not path.exists()] == []


def test_the_table_of_choices_is_that_of_the_measurements():
    page = TEXTS["reports/accuracy.md"]
    assert front_markdown() in page
    front = measured_front()
    reached = front[front["y_rms_m"] <= 1e-7].groupby(["kind", "speed_m_per_s"])["real_time_factor"].max()
    assert len(reached) == len(front.groupby(["kind", "speed_m_per_s"]))
    assert f"{reached.min():.0f} to {float(f'{reached.max():.3g}'):.0f} times faster than real time" in page


def test_terms_are_explained_before_they_are_used():
    page = TEXTS["reports/accuracy.md"]
    terms, rest = page.partition("## Errors of integration")[::2]
    for term in ("planar", "spatial", "`moment`", "`maximum`", "`exact`", "rtol", "μN", "CONTACT", "creep"):
        assert term in terms and term in rest
