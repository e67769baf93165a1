"""Figures of cost show what is in their tables, in the units of their labels."""

import numpy as np
import pandas as pd
import pytest

from study.cost.figures import STAGE_COLOURS, fig_breakdown, fig_growth
from study.cost.operations import STAGES
from wrcore.analysis.legible import save_figure


@pytest.fixture
def growth():
    wheelsets = pd.DataFrame({"scene": ["a", "a", "b"], "wheelsets": [1, 4, 8]})
    wheelsets["evaluation_us_per_wheelset"], wheelsets["run_us_per_wheelset"] = [0.7, 0.6, 0.9], [1.0, 0.7, 1.1]
    runs = pd.DataFrame({"varied": ["duration_s", "duration_s", "rtol"], "value": [1.0, 10.0, 1e-4]})
    scenes = pd.DataFrame({"threads": [1, 2, 1, 2], "scenes": [1, 1, 2, 2], "scene_ms": [10.0, 10.0, 9.0, 5.0]})
    runs = runs.assign(run_ms=[5.0, 50.0, 7.0], run_ms_low=[4.0, 45.0, 6.5], run_ms_high=[6.0, 60.0, 7.5])
    return wheelsets, runs, scenes.assign(scene_ms_low=scenes["scene_ms"] - 1, scene_ms_high=scenes["scene_ms"] + 2)


def lines(axes):
    return {line.get_label(): line.get_xydata() for line in axes.lines if not line.get_label().startswith("_")}


def test_growth_shows_every_table(growth, tmp_path):
    figure = fig_growth(*growth)
    train, duration, tolerance, scenes = figure.axes
    np.testing.assert_allclose(lines(train)["a: evaluation"], [[1, 0.7], [4, 0.6]])
    np.testing.assert_allclose(lines(train)["b: evaluation"], [[8, 0.9]])
    np.testing.assert_allclose(duration.lines[0].get_xydata(), [[1, 5], [10, 50]])
    np.testing.assert_allclose(tolerance.lines[0].get_xydata(), [[1e-4, 7]])
    assert [text.get_text() for text in scenes.get_legend().get_texts()] == ["1 at a time", "2 at a time"]
    bars = duration.collections[0].get_segments()
    np.testing.assert_allclose([bar[:, 1] for bar in bars], [[4, 6], [45, 60]])
    for axes in figure.axes:
        assert "/" in axes.get_xlabel() and "/" in axes.get_ylabel()
    save_figure(figure, tmp_path / "growth.png", tmp_path / "growth.svg")


def breakdown(scene):
    times = [40.0, 30.0, 0.0, 90.0, 80.0, 90.0, 160.0, 210.0, 700.0]
    table = pd.DataFrame({"scene": scene, "stage": [*STAGES, "whole"], "ns": times})
    return table.assign(share=table["ns"] / 700.0, least_ns=0.25 * table["ns"], times_least=4.0)


def test_breakdown_shows_stages_beside_their_limits(tmp_path):
    figure = fig_breakdown(pd.concat([breakdown("wheelset"), breakdown("vehicle")]))
    assert [axes.get_title(loc="left") for axes in figure.axes] == [
        f"{scene}: 700 ns in all, 4.0 times the least" for scene in ("wheelset", "vehicle")
    ]
    axes = figure.axes[0]
    shown = [label.get_text() for label in axes.get_xticklabels()]
    assert shown == [stage for stage in STAGES if stage != "joints"]  # nothing is done there
    np.testing.assert_allclose([bar.get_height() for bar in axes.patches], [40, 30, 90, 80, 90, 160, 210])
    least = axes.collections[-1].get_segments()
    np.testing.assert_allclose([line[0, 1] for line in least], [10, 7.5, 22.5, 20, 22.5, 40, 52.5])
    assert axes.texts[0].get_text() == "40 ns\n6 %"
    save_figure(figure, tmp_path / "breakdown.png", tmp_path / "breakdown.svg")


def test_every_stage_has_a_colour():
    assert set(STAGE_COLOURS) == set(STAGES)
