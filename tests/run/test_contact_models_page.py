"""The page that helps to choose a contact model runs as it stands."""

import re

import pytest

from tests.pages import blocks, run_blocks

PAGE = "contact_models.md"
NUMBER = re.compile(r"\d+\.\d+")


def test_page_prints_what_it_shows(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    run_blocks(PAGE, left_out=("text",))
    shown = [line for kind, text in blocks(PAGE) if kind == "text" for line in text.splitlines()]
    for one, other in zip(shown, capsys.readouterr().out.splitlines(), strict=True):
        assert NUMBER.split(one) == NUMBER.split(other)
        values = ([float(number) for number in NUMBER.findall(line)] for line in (one, other))
        assert next(values) == pytest.approx(next(values), rel=0.15, abs=0.11)
