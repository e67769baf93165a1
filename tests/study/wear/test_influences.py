"""Influences on worn profiles, on numbers whose answers are known."""

import numpy as np
import pandas as pd
import pytest

from study.wear.figures import fig_influences
from study.wear.influences import influence_table, variant_depth, with_copies
from wrcore.analysis.pictures.plot_wear import plot_evolution


def test_copies_share_and_differ_in_their_seeds():
    spectrum = {"spectrum": {"level": "low", "seed": 3}}
    plan = {"scenes": [{"share": 0.6, "set": {"speed": 40, "track.irregularity": spectrum}}, {"share": 0.4}]}
    scenes = with_copies(plan, 2)["scenes"]
    assert [part["share"] for part in scenes] == [0.3, 0.3, 0.2, 0.2]
    seeds = [part["set"]["track.irregularity"]["spectrum"]["seed"] for part in scenes[:2]]
    assert seeds == [3, 103] and spectrum["spectrum"]["seed"] == 3


def test_deviations_are_from_the_first_variant():
    u = np.linspace(-0.01, 0.01, 81)
    hill = 1e-4 * np.exp(-((u / 4e-3) ** 2))
    table = pd.DataFrame({"equivalent_conicity": [0.1, 0.2], "step_m": [1.0, 0.0]})
    found = influence_table({"finest": (u, hill, table, 5.0), "other": (u, 1.1 * hill, table, 1.0)}).set_index(
        "variant"
    )
    assert found.loc["finest", "depth_deviation"] == 0.0 and found.loc["finest", "steps"] == 1
    assert found.loc["other", "depth_deviation"] == pytest.approx(0.1)
    assert found.loc["other", "area_deviation"] == pytest.approx(0.1)
    assert found.loc["other", "worn_max_m"] == pytest.approx(1.1e-4)
    assert fig_influences({"finest": (u, hill)}, 1e6).axes[0].get_title() == "after 1000 km"


def test_a_variant_of_a_plan(tmp_path):
    u, depth, table, seconds = variant_depth("config/wear/smoke.yaml", {"distance": 5e4}, tmp_path / "a")
    assert depth.max() > 0.0 and table["step_m"].sum() == pytest.approx(5e4) and seconds > 0.0
    drawn = plot_evolution([(0.0, u, u), (5e4, u, u + depth)], table)
    assert len(drawn.axes) == 6
