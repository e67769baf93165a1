"""reports/report_page.md works as written, from an empty folder, and prints what it shows."""

import re

from tests.conftest import ROOT
from tests.pages import blocks, run_blocks
from tests.reporting.html_parts import Parts

PAGE = "report_page.md"


def test_report_page_prints_what_it_shows(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    run_blocks(PAGE)
    (shown,) = (text for kind, text in blocks(PAGE) if kind == "text")
    printed = capsys.readouterr().out.splitlines()
    assert printed[0] == shown.strip()
    assert printed[1].endswith(f"sections: {', '.join(shown.split())}")
    rows = Parts((tmp_path / "report.html").read_text("utf-8")).rows
    assert len(rows["Q_max_N"]) == len(rows["integration_y"]) == 2 and len(rows["contact_errors"]) == 24


def test_report_page_has_at_most_400_words():
    text = re.sub(r"```.*?```", "", (ROOT / "reports" / PAGE).read_text("utf-8"), flags=re.DOTALL)
    assert len(text.split()) <= 400
