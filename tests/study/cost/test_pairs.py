"""The benchmarks: what they compare, and orders of magnitude that no load of the machine hides."""

import numpy as np
import pytest

from study.cost import pairs
from study.cost.chains import over_chains
from study.cost.runs import batch_table, rejection_table
from study.cost.search import loaded_wheels, search_costs
from study.cost.stages import search_all
from tests.conftest import ELLIPTIC
from wrcore.contact.search.reduction import MAX_PATCHES, PATCH_COLUMNS
from wrcore.kernels.handles import Handle
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene


@pytest.fixture(scope="module")
def scene():
    return load_scene(ELLIPTIC / "suspended_wheelset.yaml", ["speed=60", "integration.duration=0.3"])


def by_contender(rows):
    return {row["contender"]: row for row in rows}


def test_scipy_is_slower_at_the_same_error(scene):
    """Its ratio on a quiet machine is the bar's; here, beside other work, only that it is slower at all."""
    rows = by_contender(pairs.engine_against_scipy("wheelset", scene, 1e-8, [1e-3, 1e-4, 1e-5, 1e-6], 3))
    assert list(rows) == ["compiled", "scipy"]
    assert rows["scipy"]["ratio"] > 1.0
    assert rows["scipy"]["bar"] == "ratio at least 8"
    assert rows["scipy"]["error_m"] == 1e-8


def test_time_at_an_error_lies_between_two_runs():
    errors, seconds = np.array([1e-4, 1e-8, 1e-6]), np.array([[1.0, 100.0, 10.0], [2.0, 200.0, 20.0]])
    np.testing.assert_allclose(pairs.time_at_error(1e-7, errors, seconds), np.sqrt(10.0) * np.array([10.0, 20.0]))
    np.testing.assert_allclose(pairs.time_at_error(1e-3, errors, seconds), [1.0, 2.0])  # the loosest will do
    assert np.isnan(pairs.time_at_error(1e-9, errors, seconds)).all()


def test_plain_equations_are_hundreds_of_times_slower(scene):
    rows = pairs.compiled_against_plain(scene, states=2, duration=0.01, passes=1)
    assert [row["of"] for row in rows] == ["evaluation"] * 2 + ["run"] * 2
    assert rows[1]["ratio"] > 100.0
    assert rows[3]["ratio"] > 30.0


def test_fastsim_costs_more_than_formulas(scene):
    laws = ("she", "fastsim")
    scenes = {law: load_scene(ELLIPTIC / "suspended_wheelset.yaml", [f"contact.creep.model={law}"]) for law in laws}
    rows = by_contender(pairs.right_hand_sides("creep law", scenes, 3, 1))
    assert rows["fastsim"]["ratio"] > 3.0
    assert rows["fastsim"]["excess"] == pytest.approx(rows["fastsim"]["time"] - rows["she"]["time"])


def test_planar_and_spatial_runs_are_timed_in_turn(scene):
    rows = by_contender(pairs.planar_against_spatial("wheelset", scene, 2))
    assert list(rows) == ["spatial", "planar"]
    assert 0.1 < rows["planar"]["ratio"] < 10.0


def test_search_is_timed_on_tread_and_flange(scene):
    model, _ = compile_scene(scene)
    rows = search_costs(model.contact, 20, 1)
    groups = ["tread, maximum", "tread, moment", "flange, maximum", "flange, moment"]
    assert [row["group"] for row in rows[::2]] == [f"search: {group}" for group in groups]
    assert [row["contender"] for row in rows] == ["spatial", "planar"] * 4
    motions = loaded_wheels(model.contact, "flange", 5)
    patches = np.zeros((5, MAX_PATCHES, PATCH_COLUMNS))
    assert search_all(Handle(model.contact), motions, patches) >= 5  # all of them touch


def test_chains_grow_no_faster_than_their_length(scene):
    model, _ = compile_scene(scene)
    table = over_chains(model, [4, 32], 3)
    assert list(table["joint"]) == ["spherical"] * 2 + ["revolute"] * 2
    for _, part in table.groupby("joint"):
        short, long = part["evaluation_ns_per_bar"]
        assert long < 2.0 * short  # a dense solver's cost per bar would grow by 64


def test_parts_of_a_batch_make_up_the_whole():
    table = batch_table(ELLIPTIC / "suspended_wheelset.yaml", ["integration.duration=0.1"], [20.0, 40.0], 1)
    for name in ("sweep", "runs"):
        batch = table[table["batch"] == name]
        share = dict(zip(batch["part"], batch["share"], strict=True))
        assert share["whole"] == 1.0
        assert share["integration"] + share["all else"] == pytest.approx(1.0, abs=1e-9)
        assert 0.0 < share["integration"] < 1.0
        assert any(part.startswith("profiled: ") for part in share)


def test_rejected_steps_are_shares_of_all_attempts(scene):
    table = rejection_table({"wheelset": scene}, ["tsit5", "rk23"], [1e-3])
    assert list(table["method"]) == ["tsit5", "rk23"]
    np.testing.assert_allclose(table["share"], table["rejected"] / (table["steps"] + table["rejected"]))
    assert (table["smooth"] == (table["share"] <= 0.1)).all()
