"""Looked-up beside exact contact where runs pass."""

import numpy as np
import pytest

from study.patch.look_up_errors import errors
from study.patch.visited_errors import PAIRS, SCENES, visited, wheel_errors, with_hollow
from wrcore.contact.search import reduction


@pytest.mark.parametrize("patch", ["tabulated", "surrogate"])
def test_both_models_at_the_states_of_a_run(patch):
    scene, changes, _ = SCENES["hunting"]
    rows, forces, outside = visited(scene, changes, 0.2, 5, judged=patch)
    assert len(outside) == len(rows["exact"]) == len(rows[patch]) == 10 and not outside.any()
    found = errors(rows["exact"], rows[patch])
    on_wheels = wheel_errors(rows["exact"][:, reduction.ANGLE], forces["exact"], forces[patch])
    # with one patch each the force along its normal is N, but for the rail's frame
    np.testing.assert_allclose(on_wheels["wheel, along"], found["N"], atol=0.05)
    assert 0.0 < found["N"].max() < 0.5 and found["F"].max() < 1.5
    assert np.ptp(rows["exact"][:, reduction.NORMAL]) > 100.0  # not always the same


def test_the_hollow_wheel_is_a_file(tmp_path):
    name = next(pair for pair in PAIRS if pair.startswith("hollow"))
    points = with_hollow(PAIRS[name], tmp_path)["wheel.profile"]["points"]
    u, f = np.genfromtxt(points, delimiter=",", skip_header=1, unpack=True)
    assert abs(np.interp(0.0, u, f)) < 1e-9 and len(u) > 1000
    assert with_hollow({"rail.profile": "54E1"}, tmp_path) == {"rail.profile": "54E1"}
