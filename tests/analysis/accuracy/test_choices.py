"""Choices, errors and the front of speed against error."""

import numpy as np
import pandas as pd
import pytest

from tests.synthetic import hunting_run
from wrcore.analysis.accuracy import choices as aa
from wrcore.errors import InputError
from wrcore.scene.description import load_scene


def worn_run(**kwargs):
    """A hunting motion whose wheels creep: without wear there is no relative error of it."""
    run = hunting_run(**kwargs)
    run.groups["wheelset"]["vx_m_per_s"][:] = 20.0
    run.groups["wheelset/left"]["Fx_N"][:, 0], run.groups["wheelset/left"]["xi"][:, 0] = -1e3, 1e-3
    return run


def table(points):
    return pd.DataFrame(
        [{"status": "completed", "wall_s": wall, "y_rms_m": error, "method": str(k)} for k, (wall, error) in points]
    )


def test_combinations_list_each_choice_once():
    grid = {"detection": ["spatial"], "patch": ["moment"], "creep": ["she"], "method": ["rk45", "rk23"], "rtol": [1e-3]}
    wider = grid | {"detection": ["planar", "spatial"]}
    assert len(aa.combinations([grid, wider])) == 4


def test_a_choice_is_a_scene_that_loads():
    choice = aa.Choice("planar", "maximum", "table 0.02", "rk23", 1e-4)
    data = load_scene("config/scenes/wheelset.yaml", choice.overrides()).data
    assert data["contact"]["detection"] == "planar" and data["contact"]["patch"] == "maximum"
    assert data["contact"]["creep"]["model"] == "table" and data["contact"]["creep"]["tolerance"] == 0.02
    assert data["integration"]["rtol"] == 1e-4 and data["integration"]["atol"] == 0.0


def test_errors_of_a_run_shifted_by_a_known_amount():
    reference, run = worn_run(), hunting_run()
    run.groups["wheelset"]["y_m"] = reference["wheelset"].y_m + 1e-6
    run.groups["wheelset/left"]["N_N"][:, 0] *= 1.001  # 8.9 N of 8.9 kN on one of two wheels
    errors = aa.run_errors(run, reference)
    assert errors["y_rms_m"] == pytest.approx(1e-6) and errors["y_max_m"] == pytest.approx(1e-6)
    # Q and Y of two wheels: one vector of length 8.9 N spread over four values
    assert errors["force_rms_N"] == pytest.approx(8.9 / 2, rel=1e-6)
    assert errors["amplitude_relative"] == pytest.approx(0.0, abs=1e-12)


def test_errors_count_up_to_the_horizon_only():
    reference, run = worn_run(), hunting_run()
    run.groups["wheelset"]["y_m"] = reference["wheelset"].y_m + np.where(reference.t > 2.0, 1e-3, 0.0)
    assert aa.run_errors(run, reference, until=2.0)["y_max_m"] == 0.0
    assert aa.run_errors(run, reference)["y_max_m"] == pytest.approx(1e-3)


def test_a_run_that_stopped_early_has_no_error():
    reference, run = worn_run(duration=4.0), worn_run(duration=1.0)
    assert np.isnan(list(aa.run_errors(run, reference).values())).all()


def test_front_keeps_what_nothing_beats():
    points = enumerate([(1.0, 1e-3), (2.0, 1e-4), (2.5, 5e-4), (3.0, 1e-4), (4.0, 1e-6)])
    assert list(aa.pareto_front(table(points))["method"]) == ["0", "1", "4"]


def test_failed_choices_are_not_on_the_front():
    data = table(enumerate([(1.0, 1e-9), (2.0, 1e-4)]))
    data.loc[0, "status"] = "failed"
    assert list(aa.pareto_front(data)["method"]) == ["1"]


def test_recommendation_is_the_cheapest_that_is_accurate_enough():
    chosen = aa.recommendations(table(enumerate([(1.0, 1e-3), (2.0, 1e-4), (4.0, 1e-6)])), [1e-3, 5e-5, 1e-9])
    assert list(zip(chosen["accuracy_m"], chosen["method"], strict=True)) == [(1e-3, "0"), (5e-5, "2")]


def test_interpolated_contact_with_another_creep_table_is_refused():
    choice = aa.Choice("spatial", "tabulated", "table 0.005", "rk23", 1e-4)
    assert not any("tolerance" in change for change in choice.overrides() if "creep" in change)
    for creep in ("table 0.01", "she"):
        with pytest.raises(InputError, match="accuracy: grids.creep: expected table 0.005 with patch tabulated"):
            choice._replace(creep=creep).overrides()
