"""How often a wheel's patches change."""

import numpy as np
import pytest

from study.wear.flutter import flutter, main
from tests.conftest import ROOT


def test_a_wheel_that_goes_to_and_fro_between_one_patch_and_two():
    t = 1e-3 * np.arange(101)
    normal = np.full((101, 2), 5e4)
    angle = np.tile([-0.3, -0.8], (101, 1))
    normal[::2, 1] = angle[::2, 1] = np.nan
    count, changed, mean, deviation, steps = flutter(t, normal, angle)
    assert count == pytest.approx(1.5, abs=0.01) and changed == pytest.approx(1000.0) and steps == pytest.approx(1000.0)
    assert mean == pytest.approx(0.55, abs=0.01) and deviation == pytest.approx(0.25, abs=0.01)


def test_a_wheel_that_stays_on_one_patch():
    t, still = np.linspace(0.0, 1.0, 11), np.ones((11, 1))
    assert flutter(t, 1e4 * still, 0.1 * still) == pytest.approx((1.0, 0.0, 0.1, 0.0, 0.0))


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--begin", "7"], "less than the duration of 6 s, got 7 s"),
        (["--scene", "9"], "scene from 0 to 5, got 9"),
        (["--patches", "round"], "got 'round'"),
        ([], "that an earlier step has written"),
    ],
)
def test_what_cannot_be_asked_is_said_in_a_line(more, said, tmp_path, monkeypatch, capsys):
    plan = str(ROOT / "config" / "wear" / "main_line.yaml")
    monkeypatch.setattr("sys.argv", ["flutter", str(tmp_path), "3", "--plan", plan, *more])
    with pytest.raises(SystemExit):
        main()
    assert said in capsys.readouterr().err
