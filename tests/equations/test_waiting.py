"""Instructions of one evaluation, followed one by one."""

import platform

import numpy as np
import pytest

from study.cost.recorded import record
from tests.conftest import ELLIPTIC
from tests.equations.waiting import instructions, looks
from wrcore.equations.equations_of_motion import Equations, fill_many
from wrcore.scene.description import load_scene

pytestmark = pytest.mark.skipif(
    (platform.system(), platform.machine()) != ("Linux", "x86_64"), reason="follows instructions of Linux on x86-64"
)


@pytest.fixture(scope="module")
def recorded():
    return record(load_scene(ELLIPTIC / "suspended_wheelset.yaml", ["speed=60", "integration.duration=0.1"]), 0.1, 4)


def follow(ask):
    try:
        return ask()
    except PermissionError as error:
        pytest.skip(f"here no process may follow another: {error}")


def test_instructions_are_those_of_one_evaluation(recorded):
    equations, model, work = Equations(recorded.model).arguments
    state, rates = recorded.states[:1], np.empty((1, recorded.states.shape[1]))
    lifted = state.copy()
    lifted[0, 2] += 0.1

    def count(one):
        def evaluate():
            fill_many(equations, 0.0, one, model, work, rates)

        return len(follow(lambda: instructions(evaluate, equations.address)))

    touching = count(state)
    assert count(state) == touching
    assert count(lifted) < 0.5 * touching


def test_looks_find_what_runs(recorded):
    equations, model, work = Equations(recorded.model).arguments
    states = np.tile(recorded.states, (50, 1))
    rates = np.empty_like(states)

    def evaluate():
        fill_many(equations, 0.0, states, model, work, rates)

    done = set(follow(lambda: instructions(evaluate, equations.address)))
    seen = looks(evaluate, 500)
    assert sum(seen.values()) == 500
    assert sum(count for place, count in seen.items() if place in done) > 250
