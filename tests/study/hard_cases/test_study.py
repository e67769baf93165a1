"""The study: families by name, summary, known limits, text, figures; what a check and a refusal are."""

import math

import pandas as pd
import pytest

from study.hard_cases.cases import Check, computed, refused, table
from study.hard_cases.figures import FIGURES, fig_low_speed, fig_nadal, fig_stability_map
from study.hard_cases.study import FAMILIES, known_limits, report_text, run_family, summary, unexplained
from wrcore.errors import InputError

LABEL = {"vehicle": "a", "detection": "planar", "integrator": "b"}


def _refuse():
    raise InputError("file", "field", "expected something else")


def test_a_value_that_is_no_number_fails_either_way():
    for least in (False, True):
        assert not Check("x", math.nan, 1.0, "1", "", least).passed
    assert Check("x", 1.0, 1.0, "1", "").passed and Check("x", 1.0, 1.0, "1", "", True).passed
    assert not Check("x", 1.1, 1.0, "1", "").passed and not Check("x", 0.9, 1.0, "1", "", True).passed


def test_a_case_that_must_be_refused_and_is_not_fails():
    (row,) = refused("f", "c", "", LABEL, _refuse)
    assert row["outcome"] == "refused" and row["passed"]
    (row,) = refused("f", "c", "", LABEL, lambda: None)
    assert row["outcome"] == "failed" and not row["passed"]


def test_summary_names_known_limits_and_what_nobody_explains():
    known = Check("x", 2.0, 1.0, "1", "", known_limit="a model")
    checks = [known, Check("y", 3.0, 1.0, "1", ""), Check("z", 0.0, 1.0, "1", "")]
    found = table(computed("f", "c", "", LABEL, checks) + refused("f", "d", "", LABEL, _refuse))
    cases = summary(found).set_index("case")
    assert tuple(cases.loc["c", ["runs", "survived", "checks", "passed", "known"]]) == (1, 1, 3, 1, 1)
    assert tuple(cases.loc["d", ["runs", "survived", "refused", "failed"]]) == (1, 0, 1, 0)
    assert known_limits(found)["value"].tolist() == [2.0]
    assert unexplained(found)["invariant"].tolist() == ["y"]
    text = report_text(found)
    assert "2 runs: 1 survived, 1 refused" in text and "1 unexplained" in text and "a model" in text


def test_settings_of_a_family_must_be_complete(vehicles):
    with pytest.raises(InputError, match="expected settings for derailments, nadal"):
        run_family("flange", vehicles, {"nadal": {}})


def test_a_family_runs_from_its_settings_and_can_be_drawn(vehicles):
    push = {"largest": 250e3, "rate": 50e3}
    settings = {
        "derailments": {"speeds": [30.0], "detections": ["planar"], "methods": ["auto"],
                        "pushes": {"suspended wheelset": {"largest": 500e3, "rate": 200e3}}},
        "nadal": {"name": "suspended wheelset", "speed": 10.0, "frictions": [0.4], "detections": ["planar", "spatial"],
                  "turn": 45e3, "push": push},
    }  # fmt: skip
    found, curves = run_family("flange", vehicles, settings)
    assert len(unexplained(found)) == 0 and set(found["status"]) == {"derailed"}
    assert set(known_limits(found)["case"]) == {"Nadal's limit"}  # planar detection climbs late
    (axes,) = fig_nadal(curves).axes
    assert [len(line.get_xdata()) for line in axes.lines] == [1, 1, 1]


def test_figures_belong_to_families_and_show_their_curves():
    assert {family for family, _ in FIGURES.values()} <= set(FAMILIES)
    steps = {"vehicle": "a", "integrator": "tsit5", "found_s": 2e-3}
    curve = [steps | {"speed_m_per_s": v, "predicted_s": 1e-3 * v} for v in (1, 2)]
    axes = fig_stability_map({"stability_map": curve}).axes[0]
    assert axes.lines[0].get_ydata().tolist() == [1.0, 2.0]  # ms
    label = {"vehicle": "a", "detection": "spatial", "least_speed_m_per_s": 1e-3}
    braking = [label | {"t_s": t, "v_m_per_s": 1 - t} for t in (0, 1)]
    off = [{"vehicle": "a", "speed_m_per_s": 0.1, "least_speed_m_per_s": x, "y_off_m": 1e-3 * x}
           for x in (0.0, 1e-3, 0.5)]  # fmt: skip
    axes = fig_low_speed({"braking": braking, "regularisation": off}).axes
    assert axes[0].lines[0].get_ydata().tolist() == [1, 0]
    assert axes[1].lines[0].get_ydata().tolist() == pytest.approx([1e-3, 0.5])  # mm; no change cannot be drawn


def test_tables_survive_a_csv_file(tmp_path):
    found = table(computed("f", "c", "", LABEL, [Check("x", 2.0, 1.0, "1", "", known_limit="a model")]))
    found.to_csv(tmp_path / "t.csv", index=False)
    again = pd.read_csv(tmp_path / "t.csv")
    assert len(unexplained(again)) == 0 and len(known_limits(again)) == 1
    assert report_text(again) == report_text(found)
