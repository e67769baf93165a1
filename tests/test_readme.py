"""What the README says can be done as written."""

import re

from study.accuracy.front import front_markdown
from tests.conftest import ROOT

TEXT = (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_table_of_choices_is_that_of_the_measurements():
    assert front_markdown() in TEXT


def test_the_example_runs_as_written(tmp_path, monkeypatch, capsys):
    (block,) = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)
    (tmp_path / "config").symlink_to(ROOT / "config")
    monkeypatch.chdir(tmp_path)
    exec(block, {})
    assert "completed" in capsys.readouterr().out
    assert (tmp_path / "run.h5").is_file() and (tmp_path / "hunting.png").is_file()


def test_every_file_that_is_named_exists():
    named = re.findall(r"\]\(([\w/.]+)\)", TEXT) + re.findall(r"`((?:config|tests|reports|wrcore)/[\w/.]+)`", TEXT)
    assert len(named) > 10
    assert [name for name in named if not (ROOT / name).exists()] == []
