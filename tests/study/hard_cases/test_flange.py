"""Flange climb and derailment."""

import math

import pytest

from study.hard_cases.cases import prepare
from study.hard_cases.flange import flange_angle, nadal, nadal_limit


def test_nadal_limit_of_the_s1002(vehicles):
    # flank of 70 degrees (EN 13715); (tan 70 - 0.36)/(1 + 0.36 tan 70) = 1.20, as in textbooks
    assert flange_angle(prepare(vehicles, "suspended wheelset").scene) == pytest.approx(math.radians(70.0), abs=1e-6)
    assert nadal_limit(0.36, math.radians(70.0)) == pytest.approx(1.20, abs=0.005)
    assert nadal_limit(0.0, 1.0) == pytest.approx(math.tan(1.0))


def test_a_wheel_climbs_at_nadal_s_limit(vehicles, assert_passed):
    push = {"largest": 250e3, "rate": 50e3}
    found, curve = nadal(vehicles, "suspended wheelset", 10.0, [0.1, 0.5], ["spatial"], 45e3, push)
    assert_passed(found)
    assert curve[0]["Y_over_Q"] > 2.0 * curve[1]["Y_over_Q"]
