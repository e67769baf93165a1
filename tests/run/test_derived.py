"""Derived channels: the same from a stored run and when a scene asks for them, by one name; wrong names are refused."""

import numpy as np
import pandas as pd
import pytest

import wrcore as wr
from tests.conftest import SCENES
from tests.synthetic import hunting_run
from wrcore.errors import InputError
from wrcore.run.derived import OF_WHEELS, OF_WHEELSETS
from wrcore.run.results import load_run
from wrcore.scene.description import load_scene

SCENE, CHANGES = SCENES / "suspended_wheelset.yaml", {"speed": 30, "integration.duration": 0.1}
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


def test_wrong_names_say_what_was_meant(runs):
    with pytest.raises(InputError, match=r"output.channels.1: expected one of pose, .*; did you mean 'Y_over_Q'\?"):
        load_scene(SCENE, {"output.channels": ["pose", "Y_overQ"]})
    with pytest.raises(AttributeError, match=r"follows from these, Q_N.*did you mean 'Y_over_Q'\?"):
        _ = runs[0]["wheelset/left"].Y_overQ
    with pytest.raises(KeyError, match="no channel 'sum_Y'.*did you mean 'sum_Y_N'"):
        runs[0]["wheelset"]["sum_Y"]
