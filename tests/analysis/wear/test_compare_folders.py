"""Two folders of wear at one distance, on folders whose wheels wear in proportion to it."""

import sys

import numpy as np
import pytest

from wrcore.analysis.wear import compare_folders
from wrcore.analysis.wear.wear_folder import claim, write_rows
from wrcore.analysis.wear.worn_profiles import file_of, write_points

U = np.linspace(-0.06, 0.05, 23)
DISTANCES = np.array([0.0, 1e6, 3e6, 3e6, 4e6])  # m: turned after the third one


def worn(folder, rate):
    """A folder whose ordinate rises by a rate (m per m), three times that below the flange's place."""
    folder.mkdir()
    rise = np.where(compare_folders.FLANGE > U, 3.0, 1.0) * rate
    for step, distance in enumerate(DISTANCES):
        write_points(file_of(folder, "profile", step), U, U**2 + rise * (distance - 3e6 * (step > 2)))
    rows = [
        {"step": k, "distance_m": distance, "step_m": 1.0, "at_limit": int(k == 2)}
        | dict.fromkeys(compare_folders.SHOWN, rate * distance)
        for k, distance in enumerate(DISTANCES)
    ]
    claim(folder, "mark", {})
    write_rows(folder, rows)
    return str(folder)


def test_rows_at_a_distance(tmp_path, monkeypatch, capsys):
    folders = [worn(tmp_path / name, rate) for name, rate in (("a", 1e-10), ("b", 2e-10))]
    monkeypatch.setattr(sys, "argv", ["compare_folders", *folders, "--km", "2000", "3500"])
    compare_folders.main()
    rows = [line.split(", ") for line in capsys.readouterr().out.splitlines()[1:]]
    assert [row[1] for row in rows] == 2 * folders and [row[2] for row in rows[2:]] == ["beyond", "beyond"]
    for row, rate in zip(rows, (1e-10, 2e-10), strict=False):
        assert float(row[2]) == pytest.approx(1e3 * rate * 2e6)  # mm
        assert row[-2:] == ["0.20 of 0.40", "0.60 of 1.20"]
