"""Tolerances, stable steps, Baumgarte's parameters, long runs, restarts."""

import numpy as np
import pytest

from study.hard_cases import integration
from study.hard_cases.integration import (
    amplification,
    baumgarte,
    predicted_step,
    stability_map,
    tolerance_ladder,
)


@pytest.fixture(scope="module")
def boxes(vehicles):
    trailer = vehicles["trailer vehicle"]
    return vehicles | {"with axle boxes": trailer | {"set": {"vehicle.axle_boxes": True}}}


def test_stability_functions_against_known_limits():
    # Taylor polynomials of order p on the negative real axis (Hairer and Wanner, Solving ODEs II, table IV.2.1)
    assert predicted_step("rk23", np.array([-1.0 + 0j]), 10.0) == pytest.approx(2.5127, abs=1e-3)
    assert predicted_step("rk45", np.array([-1.0 + 0j]), 10.0) == pytest.approx(3.3066, abs=1e-3)
    for method in ("rodas5", "rodas4", "rodas4p2", "ros34pw2"):  # L-stable
        assert abs(amplification(method, -1e9)) < 1e-6
    for method in ("tsit5", "rk4", "rodas5", "rodas4", "rodas4p2", "ros34pw2"):
        assert amplification(method, 0.01) == pytest.approx(np.exp(0.01), abs=1e-8)


def test_errors_fall_with_the_tolerance(vehicles, assert_passed):
    methods = ["tsit5", "rk45", "rk23", "rk4", "rodas5", "rodas4", "rodas4p2", "ros34pw2"]
    found, curve = tolerance_ladder(
        vehicles, ["suspended wheelset"], 20.0, [1e-1, 1e-4, 1e-7], methods, ["spatial"], 0.5
    )
    assert_passed(found)
    errors = {(row["integrator"], row["rtol"]): row["error_m"] for row in curve}
    # at 1e-4 it is stability that bounds the steps of explicit methods: what they err by begins to fall below that
    assert all(errors[method, 1e-7] < 0.1 * errors[method, 1e-4] for method in methods)


def test_the_largest_stable_step_is_that_of_the_linearised_motion(vehicles, assert_passed):
    found, curve = stability_map(vehicles, ["suspended wheelset"], [1.0, 20.0], ["tsit5", "ros34pw2"], 0.05)
    assert_passed(found)
    assert curve[0]["found_s"] < 0.1 * curve[2]["found_s"]
    assert curve[1]["found_s"] == 0.05


def test_baumgarte_s_feedback_bounds_the_drift(boxes, assert_passed):
    pairs = [(0.0, 0.0), (50.0, 50.0), (1000.0, 1000.0)]
    found, curve = baumgarte(boxes, "with axle boxes", pairs, 1.0, ["tsit5"])
    assert_passed(found)
    assert curve[1]["violation_m"] < 0.1 * curve[0]["violation_m"]


def test_stiff_feedback_costs_implicit_steps_nothing(boxes, assert_passed):
    # left out of the Jacobian, the feedback on Euler parameters bounds steps by about 1/alpha: ten times as many
    found, curve = baumgarte(boxes, "with axle boxes", [(5.0, 5.0), (1000.0, 1000.0)], 2.0, ["ros34pw2"])
    assert_passed(found)
    assert curve[1]["steps"] < 1.2 * curve[0]["steps"]


def test_derailing_of_rk4_at_rtol_0_1_is_a_known_limit(vehicles, assert_passed):
    # a step of rk4 may have 5 mm of error there, more than the 4 mm to the flange; at 0.05 it has half of that
    arguments = ["suspended wheelset"], 20.0, [0.1, 0.05], ["rk4", "tsit5"], ["spatial"], 2.0
    found, _ = tolerance_ladder(vehicles, *arguments)
    assert_passed(found)
    derailed = {(row["integrator"], row["condition"]) for row in found if row["status"] == "derailed"}
    assert derailed == {("rk4", "20 m/s, rtol 0.1")}
    limits = {row["integrator"] for row in found if row["known_limit"]}
    assert limits == {"rk4"}


def test_step_limit_excuses_longer_steps_at_low_speed_alone():
    decaying, growing = np.array([-1.0 + 0.0j]), np.array([2.0 + 0.0j])
    assert integration.step_limit(0.1, decaying, True) == integration.BOUNDED
    assert integration.step_limit(0.1, decaying, False) == integration.step_limit(1.0, decaying, True) == ""
    assert integration.step_limit(80.0, growing, False) == integration.GROWS
