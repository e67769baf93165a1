"""reports/first_result.md works as written, from an empty folder, and prints what it shows."""

import pytest

from tests.pages import blocks, run_blocks

PAGE = "first_result.md"


def test_it_has_less_than_twenty_lines():
    (code,) = (text for kind, text in blocks(PAGE) if kind == "python")
    assert len([line for line in code.splitlines() if line.strip()]) < 20


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
