"""Figures of vehicles: units on every axis, both detections, every wheelset."""

import copy

import numpy as np
import pandas as pd
import pytest

from study.speeds.figures import HUNTING, RESPONSE, over_speed
from study.speeds.tables import speed_row
from tests.synthetic import hunting_run
from wrcore.analysis.pictures.plot_motion import guiding_forces, lateral_motion


def vehicle_run(detection):
    run = hunting_run(detection)
    run.scene["integration"] = {"duration": 4.0}
    for k in (1, 2):
        for group in ("wheelset", "wheelset/left", "wheelset/right"):
            run.groups[group.replace("wheelset", f"wheelset_{k}")] = copy.deepcopy(run.groups[group])
    for group in ("wheelset", "wheelset/left", "wheelset/right"):
        del run.groups[group]
    return run


@pytest.fixture(scope="module")
def runs():
    return {detection: vehicle_run(detection) for detection in ("planar", "spatial")}


def labels(figure):
    return [text for axes in figure.axes for text in (axes.get_xlabel(), axes.get_ylabel()) if text]


def test_lateral_motion_shows_every_wheelset_in_mm(runs):
    figure = lateral_motion({"20 m/s": runs, "60 m/s": runs})
    assert len(figure.axes) == 4
    drawn = figure.axes[0].lines[0].get_xydata()
    assert drawn[-1, 0] == pytest.approx(10 / 2.6, abs=0.02)  # ten swings
    np.testing.assert_allclose(drawn[:, 1], 1e3 * runs["planar"]["wheelset_1"].y_m[: len(drawn)])
    assert "first 3.8 of 4 s" in figure.axes[0].get_title(loc="left")
    assert set(labels(figure)) == {"y / mm", "time / s"}


def test_guiding_forces_show_both_wheels_in_kN(runs):
    figure = guiding_forces(runs["spatial"], "any")
    assert len(figure.axes) == 6
    assert [len(axes.lines) for axes in figure.axes] == [2] * 6
    assert figure.axes[0].lines[0].get_ydata()[0] == pytest.approx(8.9 * np.cos(0.03))
    run = copy.deepcopy(runs["spatial"])
    run.t = 2.0 * run.t
    assert guiding_forces(run, "any").axes[0].lines[0].get_xdata()[[0, -1]].tolist() == [4.0, 8.0]
    assert {"Q / kN", "Y / kN", "Y/Q", "time / s"} == set(labels(figure))


@pytest.mark.parametrize("quantities", [HUNTING, RESPONSE])
def test_over_speed_draws_a_line_per_vehicle_and_detection(runs, quantities):
    rows = []
    for detection, run in runs.items():
        for speed in (20.0, 40.0, 60.0):
            row = speed_row(run) | {"speed_m_per_s": speed, "detection": detection, "track": "released"}
            rows.append(row | {column: 1.0 for column, _, _ in quantities})
    table = pd.DataFrame(rows)
    figure = over_speed({"wheelset": table, "coach": table}, "released", quantities)
    assert [len(axes.lines) for axes in figure.axes] == [4] * len(quantities)
    assert "speed / (m/s)" in labels(figure)
    assert {label for _, _, label in quantities} <= set(labels(figure))


def test_speeds_beyond_the_critical_one_are_marked(runs):
    run = runs["spatial"]
    assert guiding_forces(run, "any", 15.0).get_suptitle() == "any, above the linear critical speed of 15.0 m/s"
    assert guiding_forces(run, "any", 25.0).get_suptitle() == "any, below the linear critical speed of 25.0 m/s"
    assert guiding_forces(run, "any", np.inf).get_suptitle() == "any, below the linear critical speed"
    row = speed_row(run) | {"detection": "spatial", "track": "released", "amplitude_m": 5e-3}
    table = pd.DataFrame([row | {"speed_m_per_s": speed} for speed in (20.0, 40.0)])
    figure = over_speed({"wheelset": table, "coach": table}, "released", HUNTING, {"wheelset": 30.0, "coach": np.inf})
    for axes in figure.axes:
        assert [line.get_xdata()[0] for line in axes.lines if "critical" in line.get_label()] == [30.0]


def test_a_run_that_derailed_early_has_no_late_part(runs):
    run = copy.deepcopy(runs["spatial"])
    whole, run.status = speed_row(run), "derailed"
    row = speed_row(run)
    assert row["status"] == "derailed" and whole["Q_min_N"] > 0.0 and whole.keys() == row.keys()
    measured = ("amplitude", "Q_", "Y_", "T_gamma", "creep_power", "car_body")
    late = [name for name in row if name.startswith(measured)]
    assert len(late) == 12 and np.isnan([row[name] for name in late]).all()
    assert row["frequency_Hz"] == whole["frequency_Hz"] and row["simulated_s"] == whole["simulated_s"]


def test_derailed_runs_are_crosses_and_gaps(runs):
    row = speed_row(runs["spatial"]) | {"detection": "spatial", "track": "released", "amplitude_m": 5e-3}
    rows = [
        row | {"speed_m_per_s": speed, "status": "derailed" if speed == 40.0 else "completed"}
        for speed in (20.0, 40.0, 60.0)
    ]
    axes = over_speed({"wheelset": pd.DataFrame(rows)}, "released", HUNTING).axes[0]
    line, crosses = axes.lines
    np.testing.assert_allclose(line.get_ydata(), [5.0, np.nan, 5.0])
    assert list(crosses.get_xdata()) == [40.0] and crosses.get_marker() == "x"
