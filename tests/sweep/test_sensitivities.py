"""reports/sweeps.md: what it says of sensitivities runs as it stands, with fewer and shorter runs."""

from tests.conftest import ROOT
from tests.pages import blocks


def test_the_guide_runs(monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    (code,) = (text for kind, text in blocks("sweeps.md") if kind == "python")
    code = code.replace('"integration.duration": 1.0', '"integration.duration": 0.1').replace("n=64", "n=4")
    exec(compile(code, "sweeps.md", "exec"), {})
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert [words[0] for words in lines] == ["speed", "vehicle.elements.*.stiffness.factor", "contact.friction"]
    assert all(len(words) == 3 and float(words[2]) < 2.0 for words in lines)
