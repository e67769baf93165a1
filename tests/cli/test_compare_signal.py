"""``wrcore compare RUN SIGNAL``: tables and figures in a folder, one line for a wrong option."""

import re

import numpy as np
import pandas as pd
import pytest
from synthetic import hunting_run

from wrcore.cli import main


@pytest.fixture
def files(tmp_path):
    """A stored run with hunting that grows, and a logger's file of it, 3 s later, in mm and with the other sign."""
    run = hunting_run(growth=0.4, duration=6.0)
    run.save(tmp_path / "run.h5")
    t = np.arange(1.0, 5.0, 0.002)
    y = 2.0 * np.exp(0.4 * t) * np.cos(2 * np.pi * 2.6 * t)
    rows = [f"{a:.3f};{b:.6f}".replace(".", ",") for a, b in zip(t + 3.0, -y, strict=True)]
    (tmp_path / "car.csv").write_text("\n".join(["Zeit [s];Wegaufnehmer 1 [mm]", *rows]))
    return str(tmp_path / "run.h5"), str(tmp_path / "car.csv"), tmp_path / "out"


def test_tables_and_figures_of_a_signal(files, capsys):
    run, signal, out = files
    channel = ["--channel", "Wegaufnehmer 1=-wheelset.y_m"]
    options = [*channel, "--align", "wheelset.y_m", "--band", "none", "20", "--section", "1"]
    assert main(["compare", run, signal, "--out", str(out), *options]) == 0
    said = capsys.readouterr().out
    assert float(re.search(r"aligned by (\S+) s", said)[1]) == pytest.approx(-3.0, abs=1e-3)
    table = pd.read_csv(out / "differences.csv")
    assert table["correlation"].item() > 0.999 and table["relative"].item() < 0.02
    assert set(pd.read_csv(out / "sections.csv")["section"]) == {0, 1, 2, 3}
    assert pd.read_csv(out / "validation.csv")["values"].tolist() == [4, 4, 4]
    assert set(pd.read_csv(out / "spectra.csv")["channel"]) == {"wheelset.y_m"}
    assert (out / "overlay.svg").is_file() and (out / "spectra.svg").is_file()
    assert main(["compare", run, signal, *channel, "--offset", "-3"]) == 0


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (["--align", "wheelset.y_m"], "--align: expected --channel beside it"),
        (["--channel", "y"], "--channel: y: expected TITLE=VALUE"),
        (["--channel", "Wegaufnehmer 1=wheelset.y_m", "--band", "x", "2"], "--band: x: expected two numbers"),
        (["--channel", "Wegaufnehmer 1=wheelset.y_m", "--plot", "a.svg"], "--plot: expected none with a signal"),
        (["--channel", "Weg=wheelset.y_m"], "channels Weg: expected one of"),
        (["--channel", "Wegaufnehmer 1=wheelset.y_m", "--out", "none/out"], "expected a folder, or the name of a new"),
        (["--channel", "Wegaufnehmer 1=wheelset.y_m", "--offset", "100"], "expected a run and a signal that overlap"),
    ],
)
def test_a_wrong_option_is_one_line(options, expected, files, capsys):
    assert main(["compare", *files[:2], *options]) == 2
    assert expected in capsys.readouterr().err
