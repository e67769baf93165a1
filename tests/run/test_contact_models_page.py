"""The pages that help to choose a contact model and to lubricate a rail print the results that they show."""

import re

import pytest

from tests.pages import blocks, run_blocks

NUMBER = re.compile(r"\d+(?:\.\d+)?")


@pytest.mark.parametrize("page", ["contact_models.md", "lubrication.md"])
def test_page_prints_what_it_shows(page, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    run_blocks(page, left_out=("text",))
    shown = [line for kind, text in blocks(page) if kind == "text" for line in text.splitlines()]
    for one, other in zip(shown, capsys.readouterr().out.splitlines(), strict=True):
        assert NUMBER.split(one) == NUMBER.split(other)
        values = ([float(number) for number in NUMBER.findall(line)] for line in (one, other))
        assert next(values) == pytest.approx(next(values), rel=0.15, abs=0.11)
