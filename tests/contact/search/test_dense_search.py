"""The contact search against a dense search at random positions: no patch is missed, invented or split."""

import math

import numpy as np
import pandas as pd
import pytest

from tests.contact.search import dense_search as search
from wrcore.contact.rigid.wheel_on_rail import WheelOnRail
from wrcore.contact.search.detection import axle_direction
from wrcore.contact.search.reduction import MAX_PATCHES, MAXIMUM, PATCH_COLUMNS
from wrcore.contact.search.strip import make_pose
from wrcore.geometry.profiles.standards import named_profile


def test_random_poses_give_finite_patches(benchmark_pair):
    poses = search.random_poses(20_000, seed=7)
    assert np.abs(poses - [0.0, 0.46, 0.0, 0.0]).max(axis=0) == pytest.approx([0.012, 0.003, 0.01, 0.03], rel=1e-3)
    for detection in ("planar", "spatial"):
        for reduction in ("maximum", "moment"):
            counts = search.count_patches(benchmark_pair, poses, detection, reduction)
            assert counts.min() == 0 and counts.max() >= 1


@pytest.mark.parametrize("reduction", ["maximum", "moment"])
@pytest.mark.parametrize("detection", ["planar", "spatial"])
def test_no_patch_is_missed_invented_or_split(benchmark_pair, detection, reduction):
    # recall 100 % above 0.1 um, none invented; half of the wheels lowered to between 0.1 um and 0.5 mm
    poses = search.random_poses(1500, seed=11)
    depths = 10.0 ** np.random.default_rng(12).uniform(-7.0, -3.3, len(poses))
    for lowered in (None, depths):
        table = search.compare_with_dense(benchmark_pair, poses, detection, reduction, lowered)
        assert table.outcome.eq("found").all(), table[table.outcome != "found"].to_string()
        assert table.overlaps.gt(0).mean() > 0.4
    assert table.overlaps.gt(1).any()


def test_dense_search_of_a_cone_on_a_circle_knows_the_overlap():
    # A parabola of depth d and curvature B: half width sqrt(d/B), B = 1/(2 R); a wheel of revolution adds nothing
    wheel, rail = named_profile("cone:1/20", "wheel"), named_profile("circle:0.3", "rail")
    geometry = WheelOnRail(wheel, rail).geometry
    axle = axle_direction(0.0, 0.0)
    lowest = search._touching(geometry, 1.0, 0.0, 0.46, axle, True)
    overlaps = np.zeros((4, 4))
    depth = 2e-5
    pose = make_pose(1.0, 0.0, lowest - depth, *axle, True)
    assert search.dense_overlaps(geometry, pose, overlaps) == 1
    low, high, deepest, _ = overlaps[0]
    assert high - low == pytest.approx(2 * math.sqrt(2 * 0.3 * depth), abs=2 * search.DENSE_STEP)
    assert deepest == pytest.approx(depth, rel=5e-3)  # along the normal, on strips 0.1 mm apart


def test_judge_tells_each_kind_of_failure(benchmark_pair, monkeypatch):
    poses = np.array([[0.0, 0.4598, 0.0, 0.0]])
    axle, there = axle_direction(0.0, 0.0), np.empty((MAX_PATCHES, PATCH_COLUMNS))

    def verdict(patches):
        def fake(*arguments):
            for k, patch in enumerate(patches):
                arguments[-1][k] = patch
            return len(patches)

        monkeypatch.setitem(search.judge.py_func.__globals__, "find_patches", fake)
        return search.judge.py_func(
            benchmark_pair, 1.0, *poses[0, :2], axle, True, MAXIMUM, there.copy(), np.empty((8, 4))
        )

    row = np.zeros(PATCH_COLUMNS)
    row[[0, 7]] = 3.2e-3, 1e-5  # inside the overlap of the centred wheel, at 3.25 mm
    beside, bad = row.copy(), row.copy()
    beside[0], bad[8] = -0.035, np.nan
    assert verdict([row])[0] == search.FOUND
    assert verdict([])[0] == search.MISSED
    assert verdict([row, row])[0] == search.SPLIT
    assert verdict([row, beside])[0] == search.INVENTED
    assert verdict([bad])[0] == search.BAD


def test_close_overlaps_may_count_as_one():
    overlaps = np.zeros((4, 4))
    overlaps[:4, :2] = [[0.0, 1e-3], [1.1e-3, 2e-3], [2.7e-3, 9e-3], [9.5e-3, 1e-2]]  # 0.1, 0.7, 0.5 mm apart
    assert search._group(overlaps, 4) == 2
    assert overlaps[:, 3].tolist() == [0.0, 0.0, 1.0, 1.0]


def test_search_table_counts_every_wheel(benchmark_pair):
    table = search.search_table(benchmark_pair, poses=50, dense=20)
    assert table.wheels_searched.tolist() == [100] * 4
    assert table.wheels_compared.tolist() == [80] * 4
    assert (table[["bad", "missed", "invented", "split"]] == 0).all(axis=None)
    assert table.overlaps.gt(40).all()


def test_search_finds_nearly_everything_at_angles_beyond_its_cells(benchmark_pair):
    # up to 100 mrad of yaw: where the search saw only the window over the rail, 70 of these wheels and 190 shallow ones
    # missed an overlap, up to 5 mm deep; what is left are slivers of a wheel that turns back over the rail's very end,
    # narrower than 0.16 mm
    poses = search.random_poses(1500, 7, ranges={"yaw": 0.1, "roll": 0.02})
    depths = 10.0 ** np.random.default_rng(8).uniform(-6.0, -3.3, len(poses))
    deep, shallow = (search.compare_with_dense(benchmark_pair, poses, depths=lowered) for lowered in (None, depths))
    assert (deep.outcome == "missed").sum() <= 3 and (shallow.outcome == "missed").sum() == 0
    assert (pd.concat([deep, shallow]).outcome == "split").sum() <= 3
