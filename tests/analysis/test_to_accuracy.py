"""Runs to an accuracy: what is stated bounds the error against an independent tight run, or it is not reached."""

import json

import numpy as np
import pytest

import wrcore as wr
from tests.conftest import ELLIPTIC as EXAMPLES
from wrcore.analysis.to_accuracy import (
    BELIEVED,
    COMPLETE,
    FINER,
    SAFETY,
    Accuracy,
    _end,
    _estimated,
    _is_steady,
    _next_ratio,
    difference,
    simulate_to_accuracy,
)
from wrcore.cli import NOT_REACHED, main
from wrcore.errors import InputError

WHEELSET = str(EXAMPLES / "suspended_wheelset.yaml")
COACH = str(EXAMPLES / "trailer_vehicle.yaml")
LOW = {"spectrum": {"level": "low", "seed": 3, "length": 500.0, "begin": 5.0}}
CURVE = [{"tangent": 5.0}, {"transition": 15.0}, {"curve": 100.0, "radius": 600.0}]
SCENES = {
    "wheelset": (WHEELSET, {"speed": 33.0, "integration.duration": 1.0}),
    "coach in a curve": (COACH, {"speed": 21.0, "track.path": CURVE, "integration.duration": 1.5}),
    "coach on irregular rails": (COACH, {"speed": 47.0, "track.irregularity": LOW, "integration.duration": 1.0}),
}


def tight(file, changes):
    changes = changes | {"integration.method": "tsit5", "integration.rtol": 1e-9, "integration.longest_step": 5e-3}
    return wr.simulate(wr.load_scene(file, changes))


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize(("of", "accuracy"), [("y", 1e-5), ("y", 1e-7), ("Q", 100.0)])
def test_what_is_stated_bounds_the_error(name, of, accuracy):
    run, found = simulate_to_accuracy(wr.load_scene(*SCENES[name]), accuracy, of)
    assert found.reached and found.found <= accuracy
    assert difference(run, tight(*SCENES[name]), of) <= accuracy
    assert found.cost >= 1.0  # a ratio of evaluations: how large it is, the study says


def test_mean_wear_number():
    file, changes = SCENES["wheelset"]
    run, found = simulate_to_accuracy(wr.load_scene(file, changes), 0.01, "wear")
    assert found.reached and difference(run, tight(file, changes), "wear") <= 0.01


def test_beyond_the_horizon_nothing_is_promised():
    apart = [1e-4, 2e-3, 1.5e-3, 2e-3, 8e-4]
    run = wr.simulate(WHEELSET, integration__duration=0.05)
    assert "horizon" in _end(run, apart, 1e-6)
    for closer in ([1e-4, 1e-5, 1e-6], apart[:4], [1.6e-4, 1.8e-4, 1.5e-4, 1e-4, 1.8e-6]):  # impacts that agree late
        assert _end(run, closer, 1e-6) == ""
    assert "no tighter" in _end(run, [1e-4], 1e-11)
    run.status, run.reason = "stalled", "the step size collapsed"
    assert "stalled" in _end(run, [1e-4], 1e-6)
    assert "stalled" not in COMPLETE


@pytest.mark.parametrize("order", [0.4, 0.7, 1.0])
def test_estimated_error_of_a_power_law_is_exact(order):
    """Runs at 1e-3, 1e-4 and 1e-5 whose errors are the tolerance to a power."""
    errors = np.array([1e-3, 1e-4, 1e-5]) ** order
    found, power = _estimated(list(-np.diff(errors)), [0.1, 0.1])
    assert power == pytest.approx(order) and found == pytest.approx(SAFETY * errors[-1])


def test_estimated_error_far_below_a_difference_is_not_believed():
    assert _estimated([1e-5], [0.01])[0] == pytest.approx(SAFETY * 1e-5 / BELIEVED[1])


def test_estimated_error_of_two_runs_takes_order_one():
    assert _estimated([9e-6], [0.1]) == (pytest.approx(SAFETY * 1e-6), 1.0)


def test_differences_that_hardly_fall_are_no_agreement():
    """A free wheelset at 79 m/s whose runs at 1e-6 and 1e-7 differ by 0.9 um, and by 27 um from tighter ones."""
    impacts, ratios = [5.5e-5, 1.5e-5, 9.0e-7], [0.1, 0.1, 0.1, 0.1]
    assert not _is_steady(impacts, ratios[:3], 1e-5) and _is_steady([*impacts, 9.5e-7], ratios, 1e-5)
    assert _is_steady(impacts[1:], ratios[:2], 1e-5) and _is_steady([1e-4, 1e-5, 9e-7], ratios[:3], 1e-5)


@pytest.mark.parametrize("before", [1e-5, 1e-6, np.inf])
def test_estimated_error_where_differences_do_not_fall_is_theirs(before):
    assert _estimated([before, 1e-5], [0.1, 0.1]) == (SAFETY * 1e-5, 0.0)
    assert _estimated([before, np.inf], [0.1, 0.1])[0] == np.inf


def test_next_tolerance_follows_from_the_missing_accuracy():
    assert _next_ratio(10.0**1.3, 1.0) == pytest.approx(0.1)
    assert _next_ratio(1.01, 1.0) == FINER[0] and _next_ratio(1e9, 1.0) == FINER[1]
    assert _next_ratio(np.inf, 1.0) == _next_ratio(5.0, 0.6) == _next_ratio(0.9, 1.0) == 0.1
    assert _next_ratio(5.0, 0.8) < _next_ratio(5.0, 1.0)


@pytest.mark.parametrize("name", ["coach in a curve", "coach on irregular rails"])
def test_cost_of_a_micrometre_is_below_three_default_runs(name):
    """The default tolerance, 1e-4, keeps 1 um in both scenes."""
    scene = wr.load_scene(*SCENES[name])
    run, found = simulate_to_accuracy(scene, 1e-6)
    plain = wr.simulate(scene)
    assert found.reached and difference(plain, tight(*SCENES[name])) < 1e-6
    assert found.cost * run.counters["rhs_evaluations"] < 3.0 * plain.counters["rhs_evaluations"]


def test_status_of_an_accuracy_that_is_not_reached(capsys, monkeypatch):
    run = wr.simulate(WHEELSET, integration__duration=0.05)
    missed = Accuracy("y", 1e-9, 1e-6, False, 1e-11, 2.0, "1e-09 m not reached")
    monkeypatch.setattr("wrcore.analysis.to_accuracy.simulate_to_accuracy", lambda *_: (run, missed))
    assert main(["simulate", WHEELSET, "--accuracy", "1e-9"]) == NOT_REACHED
    assert "not reached" in capsys.readouterr().out


@pytest.mark.parametrize(("ended", "status"), [("derailed", NOT_REACHED), ("stalled", 1), ("failed", 1)])
def test_what_did_not_get_to_its_end_is_no_success_however_accurate(ended, status, monkeypatch):
    run = wr.simulate(WHEELSET, integration__duration=0.05)
    run.status, run.reason = ended, "as made up here"
    sure = Accuracy("y", 1e-6, 1e-8, True, 1e-5, 2.0, "y within 1e-08 m")
    monkeypatch.setattr("wrcore.analysis.to_accuracy.simulate_to_accuracy", lambda *_: (run, sure))
    assert main(["simulate", WHEELSET, "--accuracy", "1e-6"]) == status


def test_runs_that_derail_at_other_times_do_not_agree(monkeypatch):
    lengths = iter([0.1, 0.2, 0.3, 0.3])

    def derail(scene, progress):
        run = wr.simulate(WHEELSET, integration__duration=next(lengths), progress=False)
        run.status = "derailed"
        return run

    monkeypatch.setattr("wrcore.analysis.to_accuracy.simulate", derail)
    run, found = simulate_to_accuracy(wr.load_scene(WHEELSET), 1e-6)
    assert found.reached and next(lengths, None) is None and run.t[-1] == 0.3


def test_command_states_what_it_found_and_keeps_it(tmp_path, capsys):
    out = tmp_path / "run.h5"
    arguments = ["simulate", WHEELSET, "--set", "integration.duration=0.3", "--accuracy", "1e-6", "--json"]
    assert main([*arguments, "--out", str(out)]) == 0
    said = capsys.readouterr().out.splitlines()
    assert any("y within" in line for line in said) and json.loads(said[-1])["status"] == "completed"
    settings = wr.load_run(out).settings
    assert settings["accuracy_reached"] is True and 0.0 < settings["accuracy_found"] <= 1e-6
    assert settings["accuracy_of"] == "y" and np.isfinite(settings["accuracy_cost"])


def test_an_accuracy_below_any_resolution_is_not_reached():
    run, found = simulate_to_accuracy(wr.load_scene(WHEELSET, {"integration.duration": 0.05}), 1e-30)
    assert not found.reached and found.rtol == pytest.approx(1e-11) and "no tighter" in found.reason
    assert run.status == "completed"


@pytest.mark.parametrize(("changes", "accuracy", "of", "field"), [
    ({}, 0.0, "y", "--accuracy"), ({}, float("nan"), "y", "accuracy: expected"), ({}, 1e-6, "x", "--accuracy-of"),
    ({"output.channels": ["pose"]}, 1e-6, "y", "output.channels"),
])  # fmt: skip
def test_bad_requests(changes, accuracy, of, field):
    with pytest.raises(InputError, match=field):
        simulate_to_accuracy(wr.load_scene(WHEELSET, changes), accuracy, of)
