"""The page that helps to choose a contact model runs as it stands."""

import re

import pytest

from tests.pages import blocks, run_blocks

PAGE = "contact_models.md"


def test_first_block_of_the_page_prints_what_it_shows(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    run_blocks(PAGE, left_out=("text",))
    shown = next(text for kind, text in blocks(PAGE) if kind == "text")
    printed = capsys.readouterr().out
    for one, other in zip(shown.splitlines(), printed.splitlines(), strict=True):
        assert one.split(":")[0] == other.split(":")[0]
        amplitudes = [float(re.search(r"[\d.]+ mm", line)[0][:-3]) for line in (one, other)]
        assert amplitudes[1] == pytest.approx(amplitudes[0], abs=0.03)
