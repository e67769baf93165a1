"""Irregular track and a sharp curve."""

import pytest

from study.hard_cases.track import balance_speed, curve


def test_balance_speed():
    # V^2/R = g tan(asin(0.15/1.5))
    assert balance_speed(300.0, 0.15) == pytest.approx(17.199, abs=1e-3)


def test_curves_push_with_what_newton_asks_for(vehicles, assert_passed):
    found, history = curve(
        vehicles, ["trailer vehicle"], 300.0, 0.15, [20.0, 40.0, 250.0], [1.0, 1.2], 8.0, ["tsit5"], ["spatial"]
    )
    assert_passed(found)
    assert abs(history[0]["expected_N"]) < 1.0 < 1e4 < abs(history[-1]["expected_N"])
