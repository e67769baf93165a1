"""Vehicles with several patch models, on numbers whose answers are known."""

import numpy as np
import pandas as pd
import pytest

from study.patch import runs


def test_deviations_are_from_exact_contact_of_the_same_vehicle():
    table = pd.DataFrame({"vehicle": ["a", "a", "b", "b"], "model": ["moment", "exact"] * 2})
    for name in runs.MEASURES:
        table[name] = [1.1, 1.0, 3.0, 4.0]
    found = runs.compared(table, "exact")
    for name in runs.MEASURES:
        assert found[f"{name}_deviation"].to_numpy() == pytest.approx([0.1, 0.0, -0.25, 0.0])


def test_linear_speeds_are_found_by_title_and_variant():
    variants = pd.DataFrame({"vehicle": ["trailer vehicle"] * 2, "variant": ["spatial", "exact contact"],
                             "critical_speed_m_per_s": [75.0, np.inf]})  # fmt: skip
    found = runs.linear_speeds(variants, {"trailer_vehicle": "trailer vehicle"}, {"moment": "spatial"})
    assert found == {("trailer_vehicle", "moment"): 75.0}


def test_a_wheelset_with_a_patch_model_has_all_measures():
    cycle = {"speed": 60.0, "shift": 0.003, "settling": {"window": 0.2, "longest": 0.2}}
    track = {"speed": 60.0, "integration.duration": 0.2}
    row = runs.model_runs("config/scenes/suspended_wheelset.yaml", ["contact.patch=maximum"], cycle, track, 0.1)
    found = row.iloc[0]
    assert found["status"] == "completed" and found["cycle_speed_m_per_s"] == 60.0
    assert (row[[*runs.MEASURES[1:], "real_time_factor"]] > 0.0).all(axis=None)
