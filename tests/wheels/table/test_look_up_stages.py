"""What is timed stage by stage is what an evaluation does."""

import numpy as np
import pytest

from tests.wheels.table.look_up_stages import FORCE, SEARCH, STATES, costs, one_by_one, up_to, wheels_of
from wrcore.wheels.contact_model import COUNTERS
from wrcore.wheels.exact_force import strip_wrenches

SCENE = "suspended_wheelset", {"integration.duration": 0.5, "speed": 60.0}


def test_stages_are_those_of_an_evaluation():
    wheels = wheels_of(SCENE[0], SCENE[1] | {"contact.patch": "tabulated"})
    work, counters, wrench = wheels.equations.work, np.zeros(COUNTERS, np.int64), np.zeros((1, 2, 6))
    patches, counts, bounds = work.patches.copy(), work.counts.copy(), work.bounds.copy()
    one_by_one(
        strip_wrenches, wheels.contact, wheels.motions, patches, counts, bounds, wrench, counters, wheels.work
    )  # the last one is that of the last state
    np.testing.assert_allclose(wrench, work.rail_wrenches, rtol=1e-12)
    arguments = wheels.contact, wheels.motions, patches[0, 0].copy(), counters, wheels.work
    assert up_to(SEARCH, *arguments) == 2 * STATES  # a patch each
    last = wheels.contact, wheels.motions[-1:, :1].repeat(2, axis=1), patches[0, 0].copy(), counters, wheels.work
    along = up_to(FORCE, *last) - up_to(FORCE - 1, *last)
    assert along == pytest.approx(2.0 * work.rail_wrenches[0, 0, 0], rel=1e-6)


def test_all_takes_longer_than_its_stages():
    row = costs(*SCENE, 100)
    stages = sum(row[name] for name in ("search", "place", "numbers", "creep force"))
    assert 0.0 < row["search"] < stages < 1.2 * row["wheel"] and row["moment"] < row["wheel"]
