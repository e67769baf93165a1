"""Slopes of the wrench by the surrogate against differences of the whole wrench, at random motions."""

import numpy as np
import pytest

from tests.conftest import SCENES
from tests.jacobian.test_hertzian_wheel import random_states
from wrcore.equations.equations_of_motion import Equations
from wrcore.jacobian.jacobian import new_jacobian
from wrcore.jacobian.wheels import UNCOUNTED, _difference_wrenches, add_slopes, contact_blocks
from wrcore.kernels.jit import jit
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene

COUNT = 300
CASES = {
    "tread and flange": {},
    "without damping": {"contact.normal.damping.c_e": 1.0},
    "falling friction": {"contact.friction": {"mu": 0.35, "falling": {"ratio": 0.4, "decay": 0.6}}},
    "friction across the rail": {
        "contact.friction": {"mu": 0.35, "across": {"angle": [0.02, 0.1, 0.6], "factor": [1.0, 0.8, 0.3]}}
    },
    "backwards": {},
}


@jit(allocates=False)
def blocks_of(jacobian, equations, states, model, work, found, expected, direct):
    """Derivatives by the kernel and by differences at all states, whose wheelset is lowered until a wheel touches."""
    for i in range(states.shape[0]):
        state, lowered = states[i], 0.0
        depth, state[2] = state[2], 0.48
        while work.counts.sum() == 0 and lowered < 0.05:
            state[2] -= 2e-5
            lowered += 2e-5
            contact_blocks(jacobian, 0.0, state, state, model, work, 1.0, found[i])
        state[2] -= depth
        contact_blocks(jacobian, 0.0, state, state, model, work, 1.0, found[i])
        direct[i] = min(jacobian.counts[0, 0], jacobian.counts[0, 1]) >= 0 and work.counts.sum() > 0
        expected[i] = 0.0
        jacobian.counts[:] = UNCOUNTED
        _difference_wrenches(jacobian, model, work, 1.0)
        add_slopes(jacobian, state, model, expected[i])
        work.counts[:] = 0


@pytest.mark.parametrize("case", CASES)
def test_slopes_of_the_surrogate_are_those_of_differences(case):
    changes = {"contact.patch": "surrogate", "speed": 20.0} | CASES[case]
    model, start = compile_scene(load_scene(SCENES / "suspended_wheelset.yaml", changes))
    equations = Equations(model)
    equations(0.0, start)
    equations.work.counts[:] = 0
    states, jacobian = random_states(model, start, case == "backwards")[:COUNT], new_jacobian(equations)
    found, expected = np.zeros((2, COUNT, 1, 12, 6))
    direct = np.zeros(COUNT, bool)
    states[:, 2] *= 8.0  # deep enough for the reference, one-sided differences of 10 nm
    blocks_of(jacobian, equations.arguments[0], states, *equations.arguments[1:], found, expected, direct)
    assert direct.mean() > 0.9
    scale = np.abs(expected).max(axis=-1, keepdims=True) + 1.0
    errors = (np.abs(found - expected) / scale).max(axis=(1, 2, 3))[direct]
    assert np.percentile(errors, 95) < 1e-3 and np.percentile(errors, 99) < 3e-3
