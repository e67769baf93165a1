"""Inputs outside the path or the time of a run are refused or named in one line; nothing is passed over."""

import numpy as np
import pytest

import wrcore as wr
from tests.conftest import ELLIPTIC
from wrcore.run.checks import reach
from wrcore.run.checks.reach import check_reach, warn_of_unreached
from wrcore.run.simulate import simulate
from wrcore.scene.description import load_scene

SCENE = ELLIPTIC / "suspended_wheelset.yaml"  # its wheelset begins at arc length 0
SPEED = {"speed": 20.0, "integration.duration": 1.0}  # 20 m
SPECTRUM = {"level": "low", "seed": 1, "length": 50.0}
CURVE = [
    {"tangent": 10.0},
    {"transition": 10.0},
    {"tangent": 30.0},
    {"transition": 40.0},
    {"curve": 50.0, "radius": 900},
]
CHECK_RAIL = {"rail": "left", "length": 5.0, "flangeway": 0.04, "back_to_back": 1.36, "stiffness": 1e7}
CORRUGATION = {"wavelength": 0.1, "amplitude": 1e-5, "length": 5.0}
MOTOR = {"name": "motor", "bodies": ["wheelset", "frame"]}


def irregularity(tmp_path, begin, **keys):
    """Changes that give a scene 50 m of measured track from a chainage on, m."""
    s = begin + 0.25 * np.arange(201)
    (tmp_path / "track.csv").write_text("s_m,level_m\n" + "".join(f"{a:.2f},{1e-3 * np.sin(a):.6f}\n" for a in s))
    return {**SPEED, "track.irregularity": {"points": str(tmp_path / "track.csv"), **keys}}


@pytest.fixture
def said(monkeypatch):
    """Lines that were said."""
    lines: list[str] = []
    monkeypatch.setattr(reach, "warn", lines.append)
    return lines


def checked(changes):
    scene = load_scene(SCENE, {**SPEED, **changes})
    check_reach(scene, scene.data["integration"]["duration"])
    return scene


@pytest.mark.parametrize("begin", [12450.0, 22.0, -60.0])
def test_points_off_the_way_of_the_run_are_refused_with_the_key_that_mends_it(tmp_path, begin):
    changes = irregularity(tmp_path, begin)
    with pytest.raises(wr.InputError) as caught:
        simulate(SCENE, changes, progress=False)
    assert caught.value.field == "track.irregularity.points"
    text = str(caught.value)
    assert f"got {begin:.6g} to {begin + 50:.6g} m" in text and "chainage_at_start" in text and "\n" not in text


def test_chainage_at_start_shifts_points_to_the_beginning_of_the_run(tmp_path):
    moved = checked(irregularity(tmp_path, 12450.0, chainage_at_start=12450.0)).track.irregularity
    other = checked(irregularity(tmp_path, 12450.0, chainage_at_start=12445.0)).track.irregularity
    plain = load_scene(SCENE, irregularity(tmp_path, 12450.0)).track.irregularity
    np.testing.assert_allclose(moved.starts, plain.starts - 12450.0, atol=1e-9)
    np.testing.assert_allclose(other.starts, plain.starts - 12445.0, atol=1e-9)
    np.testing.assert_array_equal(moved.coefficients, plain.coefficients)


def test_wrong_chainage_at_start_is_named_with_one_that_fits(tmp_path):
    with pytest.raises(wr.InputError, match=r"such as 12450 instead of 13000$"):
        simulate(SCENE, irregularity(tmp_path, 12450.0, chainage_at_start=13000.0), progress=False)


def test_chainage_at_start_without_points_is_refused():
    changes = {"track.irregularity": {"spectrum": SPECTRUM, "chainage_at_start": 100.0}}
    with pytest.raises(wr.InputError, match=r"track.irregularity.chainage_at_start: expected points beside it"):
        load_scene(SCENE, changes)


BEHIND = [
    ({"track.irregularity.spectrum": {**SPECTRUM, "begin": -90.0}}, "track.irregularity.spectrum.begin"),
    ({"track.check_rails": [{**CHECK_RAIL, "begin": -9.0}]}, "track.check_rails.0.begin"),
    ({"track.corrugation": {**CORRUGATION, "begin": -9.0}}, "track.corrugation.begin"),
    ({"contact.friction": {"arc_length": [-20, -9], "mu": [0.3, 0.1]}}, "contact.friction.arc_length"),
    ({"contact.friction": {"left": 0.3, "right": {"arc_length": [-20, -9], "mu": [0.3, 0.1]}}},
     "contact.friction.right.arc_length"),
    ({"drive.motors": [{**MOTOR, "torque": {"time": [-2, -1], "torque": [0, 9]}}]}, "drive.motors.motor.torque.time"),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "field"), BEHIND)
def test_inputs_behind_the_beginning_are_refused(changes, field):
    with pytest.raises(wr.InputError) as caught:
        checked(changes)
    assert caught.value.field == field and "on the way of the run" in str(caught.value)


AHEAD = [
    ({"track.irregularity.spectrum": {**SPECTRUM, "begin": 500.0}}, "track.irregularity.spectrum.begin", "500 m"),
    ({"track.crossing": {"slices": "crossing:1/12", "at": 90.0}, "rail": {"profile": "60E1", "inclination": 0}},
     "track.crossing.at", "m, the run ends at 21.2 m"),
    ({"track.path": CURVE}, "track.path.3.transition", "50 m"),
    ({"track.check_rails": [{**CHECK_RAIL, "begin": 90.0}]}, "track.check_rails.0.begin", "90 m"),
    ({"track.corrugation": {**CORRUGATION, "begin": 90.0}}, "track.corrugation.begin", "90 m"),
    ({"contact.friction": {"arc_length": [60, 90], "mu": [0.3, 0.1]}}, "contact.friction.arc_length", "60 m"),
    ({"drive.motors": [{**MOTOR, "torque": {"time": [2, 3], "torque": [0, 9]}}]}, "drive.motors.motor.torque.time",
     "2 s, the run ends at 1 s"),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "field", "says"), AHEAD)
def test_inputs_beyond_the_end_are_named_in_one_line(said, changes, field, says):
    checked(changes)
    assert len(said) == 1 and f": {field}: " in said[0] and says in said[0]


def test_gradients_that_a_run_has_not_reached_are_named_after_it(said):
    gradients = [{"gradient": 0.0, "length": 90.0}, {"gradient": 0.01, "radius": 2000.0}]
    scene = checked({"track.gradients": gradients})
    assert said == []
    warn_of_unreached(scene, np.array([20.0]))
    assert len(said) == 1 and "track.gradients.1.gradient" in said[0] and "ends at 20 m" in said[0]


def test_inputs_on_the_way_are_passed_in_silence(said, tmp_path):
    checked(irregularity(tmp_path, -30.0))
    checked({"track.irregularity.spectrum": {**SPECTRUM, "begin": 15.0}, "track.path": CURVE[:3]})
    checked({"contact.friction": {"arc_length": [-5, 9], "mu": [0.3, 0.1]}})
    assert said == []


def test_a_session_knows_no_end_but_names_points_of_another_chainage(said, tmp_path):
    check_reach(load_scene(SCENE, irregularity(tmp_path, 60.0)))
    assert said == []
    check_reach(load_scene(SCENE, irregularity(tmp_path, 12450.0)))
    assert len(said) == 1 and "12450 m ahead" in said[0] and "chainage_at_start" in said[0]
    with pytest.raises(wr.InputError, match="on the way of the run"):
        check_reach(load_scene(SCENE, irregularity(tmp_path, -60.0)))


def test_a_run_counts_outputs_before_the_irregularity(tmp_path):
    changes = irregularity(tmp_path, 5.0) | {"integration.duration": 0.5, "output.rate": 10.0}
    counters = simulate(SCENE, changes, progress=False).counters
    assert counters["before_irregularity"] == 3 and counters["beyond_irregularity"] == 0  # at 0, 2 and 4 m
