"""Accuracies asked of random scenes: which scenes are drawn, and what counts as reached and as missed."""

import pandas as pd

from study.accuracy.requests import KINDS, judged, random_scene, summary
from tests.conftest import ELLIPTIC
from wrcore.scene.description import load_scene

TIGHT = [{"method": method, "rtol": 1e-9, "longest_step": step} for method, step in (("tsit5", 5e-3), ("rk45", 4e-3))]


def test_random_scenes_are_of_all_kinds_and_can_be_loaded():
    drawn = [random_scene(seed) for seed in range(100, 160)]
    assert [kind for kind, _ in drawn[:4]] == list(KINDS)
    for kind, changes in drawn:
        assert load_scene(ELLIPTIC / f"{kind}.yaml", changes).data["integration"]["duration"] <= 4.0
    for key in ("track.path", "track.irregularity"):
        assert 12 <= sum(key in changes for _, changes in drawn) <= 48
    assert random_scene(7) == random_scene(7) != random_scene(11)


def test_a_request_is_judged_by_independent_tight_runs():
    changes = {"speed": 33.0, "integration.duration": 0.3}
    table = judged(ELLIPTIC / "suspended_wheelset.yaml", changes, {"y": [1e-5], "wear": [0.1]}, TIGHT)
    assert table["trusted"].all() and table["reached"].all() and (table["ratio"] <= 1.0).all()


def test_missed_is_what_was_said_to_be_reached_and_can_be_judged():
    rows = [
        # trusted, reached, ratio
        (True, True, 0.1), (True, True, 3.0), (True, False, 5.0), (False, True, 9.0),
    ]  # fmt: skip
    table = pd.DataFrame(rows, columns=["trusted", "reached", "ratio"]).assign(of="y", asked=1e-6, cost=2.0)
    (row,) = summary(table).to_dict("records")
    assert (row["requests"], row["trusted"], row["reached"], row["missed"], row["worst_ratio"]) == (4, 3, 2, 1, 3.0)
