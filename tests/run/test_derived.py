"""Derived channels: the same from a stored run and when a scene asks for them, by one name; wrong names are refused."""

import math

import numpy as np
import pandas as pd
import pytest

import wrcore as wr
from tests.analysis.response.test_curving import cone
from tests.conftest import ELLIPTIC
from tests.synthetic import hunting_run
from wrcore.errors import InputError
from wrcore.run.output.derived import OF_WHEELS, OF_WHEELSETS
from wrcore.run.output.files import load_run
from wrcore.scene.description import load_scene

SCENE, CHANGES = ELLIPTIC / "suspended_wheelset.yaml", {"speed": 30, "integration.duration": 0.1}
ASKED = [*OF_WHEELS, *OF_WHEELSETS]


@pytest.fixture(scope="module")
def runs():
    """With the contacts' channels, and with derived ones instead."""
    channels = (["pose", "velocity", "contact"], ["pose", *ASKED])
    return [wr.simulate(load_scene(SCENE, CHANGES | {"output.channels": part})) for part in channels]


def test_what_is_asked_for_is_what_follows_from_the_contacts(runs, tmp_path):
    full, lean = runs
    lean.save(tmp_path / "lean.h5")
    stored = load_run(tmp_path / "lean.h5")
    assert set(stored["wheelset/left"]) == set(OF_WHEELS.values()) and "sum_Y_N" in stored["wheelset"]
    for name in OF_WHEELS.values():
        for side in ("left", "right"):
            values = stored[f"wheelset/{side}"][name]
            np.testing.assert_array_equal(values, full[f"wheelset/{side}"][name])
            assert np.nanmax(np.abs(values)) > 0.0
    np.testing.assert_array_equal(stored["wheelset"].sum_Y_N, full["wheelset"].sum_Y_N)
    pd.testing.assert_frame_equal(stored.wheel_forces(), full.wheel_forces())
    assert "N_N" not in stored["wheelset/left"] and "vx_m_per_s" not in stored["wheelset"]


def test_sum_of_y_is_to_the_left(runs):
    left, right = (runs[0][f"wheelset/{side}"].Y_N for side in ("left", "right"))
    np.testing.assert_array_equal(runs[0]["wheelset"].sum_Y_N, left - right)


def test_a_run_holds_what_it_holds(runs):
    """What follows is offered, but neither listed nor written."""
    wheel = runs[0]["wheelset/left"]
    assert "Q_N" not in wheel and "Q_N" not in list(wheel) and "Q_N" in dir(wheel)
    assert "wheelset/left.Q_N" not in runs[0].to_pandas()
    assert runs[0].plot("wheelset/left.Q_N", "wheelset.sum_Y_N").axes[0].get_ylabel() == "Q / kN"


def test_pressure_of_an_ellipse_and_quotient_of_what_is_stored():
    run = hunting_run()
    run.groups["wheelset/left"]["a_m"][:, 0], run.groups["wheelset/left"]["b_m"][:, 0] = 4e-3, 3e-3
    assert run["wheelset/left"].p_max_Pa[0, 0] == pytest.approx(1.5 * 8.9e3 / (np.pi * 4e-3 * 3e-3))
    assert np.isnan(run["wheelset/left"].p_max_Pa[:, 1:]).all()
    run.groups["wheelset/left"] = {"Q_N": np.full(3, 5e4), "Y_N": np.full(3, 1e4)}
    np.testing.assert_allclose(run["wheelset/left"].Y_over_Q, 0.2)
    with pytest.raises(KeyError, match="no channel 'p_max_Pa'"):
        run["wheelset/left"]["p_max_Pa"]


def test_radii_and_conicity_of_given_contacts():
    """Radii of 0.46 m and a tenth of y more or less, on rails whose middle is that of the track; none at the middle."""
    run = hunting_run()
    wheelset = run["wheelset"]
    np.testing.assert_allclose(run["wheelset/right"].rolling_radius_m, 0.46 - 0.1 * wheelset.y_m, rtol=1e-12)
    off = np.abs(wheelset.y_m) > 1e-4
    np.testing.assert_allclose(wheelset.effective_conicity[off], 0.1, rtol=1e-9)
    assert np.isnan(wheelset.effective_conicity[~off]).all()


def on_cones(**changes):
    """A free wheelset with cones on rails of circles, 4 s, and the conicity that it has for small displacements."""
    scene = load_scene(cone(
        speed=10.0, initial={"y": 0.002}, integration={"duration": 4.0, "rtol": 1e-8, "atol": 1e-11},
        output={"rate": 100.0, "channels": ["pose", "contact"]}, **changes,
    ))  # fmt: skip
    slope, radius, rail = 0.05, 0.46, 0.3
    e = scene.track.rail_distance(scene.rail) - rail * math.sin(math.atan(slope))
    return wr.simulate(scene), slope * (e + rail * slope) / (e - radius * slope)


def test_a_cone_has_its_own_conicity():
    """At each instant within what 2 mm and the yaw of the swing make of it; over the swing within 0.2 %."""
    run, conicity = on_cones()
    wheelset, left = run["wheelset"], run["wheelset/left"]
    y, difference = wheelset.y_m, wheelset.rolling_radius_difference_m
    off = np.abs(y) > 1e-4
    np.testing.assert_allclose(wheelset.effective_conicity[off], conicity, rtol=0.015)
    assert np.isnan(wheelset.effective_conicity[~off]).all() and not off.all()
    assert np.sum(difference * y) / (2.0 * np.sum(y**2)) == pytest.approx(conicity, rel=2e-3)
    np.testing.assert_array_equal(difference, left.rolling_radius_m - run["wheelset/right"].rolling_radius_m)
    compressed = 0.46 - 0.05 * left.u_wheel_m[:, 0] - left.rolling_radius_m  # by half of the penetration
    np.testing.assert_allclose(compressed, 0.5 * left.penetration_m[:, 0], rtol=0.01)


def test_conicity_counts_from_the_middle_of_the_rails_as_they_lie(tmp_path):
    """Both rails swing by 5 mm: what the wheelset is off the track's middle then says nothing."""
    s = np.linspace(0.0, 60.0, 241)
    pd.DataFrame({"s_m": s, "alignment_m": 0.005 * np.sin(np.pi * s / 60.0) ** 2}).to_csv(
        tmp_path / "swing.csv", index=False
    )
    irregularity = {"points": str(tmp_path / "swing.csv"), "fade_in": 0.0, "fade_out": 0.0}
    run, conicity = on_cones(track={"irregularity": irregularity})
    wheelset = run["wheelset"]
    assert np.nanmax(np.abs(wheelset.rolling_radius_difference_m / (2.0 * wheelset.y_m) - conicity)) > 0.03
    found = wheelset.effective_conicity[np.isfinite(wheelset.effective_conicity)]
    np.testing.assert_allclose(found, conicity, rtol=0.02)


def test_wrong_names_say_what_was_meant(runs):
    with pytest.raises(InputError, match=r"output.channels.1: expected one of pose, .*; did you mean 'Y_over_Q'\?"):
        load_scene(SCENE, {"output.channels": ["pose", "Y_overQ"]})
    with pytest.raises(AttributeError, match=r"follows from these, Q_N.*did you mean 'Y_over_Q'\?"):
        _ = runs[0]["wheelset/left"].Y_overQ
    with pytest.raises(KeyError, match="no channel 'sum_Y'.*did you mean 'sum_Y_N'"):
        runs[0]["wheelset"]["sum_Y"]
