"""Jumps of the contact point, loss of contact and impacts."""

from dataclasses import replace

import numpy as np
import pytest

from study.hard_cases.cases import contacts, prepare, run
from study.hard_cases.contact import GAP, depth, drops, impacts, restitution
from wrcore.contact.search import reduction


def test_fast_impacts_keep_the_root_of_the_damping_factor():
    # int v/c_d dv: far above v0 the approach stores v^2/2, the separation v^2/(2 c_e)
    assert restitution(100.0, 0.8, 0.05) == pytest.approx(np.sqrt(0.8), rel=1e-4)
    assert restitution(1e-5, 0.8, 0.05) == pytest.approx(1.0, abs=1e-4)
    assert restitution(0.3, 1.0, 0.05) == pytest.approx(1.0, abs=1e-9)


def test_impacts_follow_the_damping_law(vehicles, assert_passed):
    methods = ["ros34pw2", "rodas5", "tsit5"]
    found, curve = impacts(vehicles, "free wheelset", [0.001, 0.01, 0.5], ["spatial"], methods)
    assert_passed(found)
    assert len(curve) == 9


def test_the_depth_of_an_impact(vehicles):
    """Hertz's spring against the greatest penetration of a run at a tight tolerance, at speeds without much damping."""
    setting = prepare(vehicles, "free wheelset", {"initial.y": 0.0, "contact.patch": "maximum"})
    for speed in (1e-3, 5e-3):
        state = setting.state.copy()
        state[[2, 9]] += GAP, -speed
        falling = replace(setting, state=state, model=setting.model._replace(gravity=0.0))
        found = run(falling, 2.0 * GAP / speed, 5e3, rtol=1e-8)
        deepest = np.nanmax(contacts(falling.model, found.t, found.states)[..., reduction.PENETRATION])
        assert deepest == pytest.approx(depth(setting, speed), rel=0.02)


def test_an_impact_between_the_stages_of_a_step_is_not_missed(vehicles, assert_passed):
    # with the embedded estimate alone the wheelset comes back 2000 times as high as it fell from
    found, _ = drops(vehicles, "free wheelset", 1e-3, 1.0, ["planar"], ["ros34pw2", "rodas5"], [1e-4, 1e-6])
    assert_passed(found)
