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
    count, changed, size, spread, turned, swing, rises = flutter(t, normal, angle)
    both = 2.0 * 5e4 * np.cos(0.25)  # half an angle of 0.5 between them
    assert count == pytest.approx(1.5, abs=0.01) and changed == pytest.approx(1000.0) and rises == pytest.approx(500.0)
    assert size == pytest.approx(0.5 * (5e4 + both), rel=0.01) and spread == pytest.approx(0.5 * (both - 5e4), rel=0.01)
    assert turned == pytest.approx(0.425, abs=2e-3) and swing == pytest.approx(0.125, abs=1e-3)


def test_a_wheel_that_stays_on_one_patch():
    t, still = np.linspace(0.0, 1.0, 11), np.ones((11, 1))
    expected = (1.0, 0.0, 1e4, 0.0, 0.1, 0.0, 0.0)
    assert flutter(t, 1e4 * still, 0.1 * still) == pytest.approx(expected, abs=1e-8)


def test_an_angle_that_swings_through_zero_is_not_folded():
    t, angle = np.linspace(0.0, 1.0, 5), np.array([[-0.1], [0.02], [-0.1], [0.02], [-0.1]])
    assert flutter(t, np.full((5, 1), 1e4), angle)[4:] == pytest.approx((0.052, np.std(angle), 2.0), abs=1e-8)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--settle", "7"], "less than the duration of 0.15 s, got 7 s"),
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
