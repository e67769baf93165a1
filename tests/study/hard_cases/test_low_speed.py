"""Low speed: no blow-up, no step collapse."""

import numpy as np

from study.hard_cases.cases import table
from study.hard_cases.low_speed import braking, regularisation


def test_regularisation_does_not_touch_higher_speeds(vehicles, assert_passed):
    found, curve = regularisation(vehicles, "suspended wheelset", [0.01], [1e-4, 1e-3, 1e-1], 0.02)
    assert_passed(found)
    assert curve[1]["y_off_m"] < 1e-9 < 1e-5 < curve[2]["y_off_m"]


def test_braking_ends_at_rest_without_step_collapse(vehicles, assert_passed):
    # with differences of 1e-7 m/s in the Jacobian the last one takes 1e7 steps; with tolerances of velocities by the
    # speed in each step it takes 21 000, by that of the beginning it took 11 000
    found, _ = braking(vehicles, 1.0, 0.5, 1.0, [1e-3, 1e-4])
    assert_passed(found)
    assert table(found)["steps"].max() < 40_000
    assert np.all(table(found)["status"] == "completed")
