"""Derivatives of the rails' wrenches by hand against differences, at 10 000 random motions."""

import numpy as np
import pytest

from tests.conftest import ELLIPTIC
from wrcore.equations.equations_of_motion import Equations
from wrcore.jacobian.hertzian_wheel import differentiable
from wrcore.jacobian.jacobian import new_jacobian
from wrcore.jacobian.wheels import UNCOUNTED, _difference_wrenches, add_slopes, contact_blocks
from wrcore.kernels.jit import jit
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene
from wrcore.wheels.modes import ELLIPSES

COUNT = 2000
CASES = {
    "moment": [],
    "maximum": ["contact.patch=maximum"],
    "falling friction": ["contact.friction={mu: 0.35, falling: {ratio: 0.4, decay: 0.6}}"],
    "friction across the rail": [
        "contact.friction={mu: 0.35, across: {angle: [0.02, 0.1, 0.6], factor: [1.0, 0.8, 0.3]}}"
    ],
    "Polach, planar": ["contact.creep.model=polach", "contact.detection=planar"],
    "backwards": [],
}


@jit(allocates=False)
def blocks_of(jacobian, equations, states, model, work, found, expected, touching):
    """Derivatives by hand and by differences at all states, whose wheelset is lowered until a wheel touches."""
    for i in range(states.shape[0]):
        state, lowered = states[i], 0.0
        depth, state[2] = state[2], 0.48
        while work.counts.sum() == 0 and lowered < 0.05:
            state[2] -= 2e-5
            lowered += 2e-5
            contact_blocks(jacobian, 0.0, state, state, model, work, 1.0, found[i])
        state[2] -= depth
        contact_blocks(jacobian, 0.0, state, state, model, work, 1.0, found[i])
        touching[i] = work.counts.sum()
        expected[i] = 0.0
        jacobian.counts[:] = UNCOUNTED
        _difference_wrenches(jacobian, model, work, 1.0)
        add_slopes(jacobian, state, model, expected[i])
        work.counts[:] = 0


def random_states(model, start, backwards):
    """States of a wheelset all over the rails; z is how deep it is pressed in."""
    random, n = np.random.default_rng(7), COUNT
    states = np.tile(start, (n, 1))
    roll, yaw = random.uniform(-4e-3, 4e-3, n), random.uniform(-8e-3, 8e-3, n)
    speed = np.where(random.random(n) < 0.8, 20.0, 0.5) * (-1.0 if backwards else 1.0)
    states[:, 1] += random.uniform(-6.5e-3, 6.5e-3, n)
    states[:, 2] = 10.0 ** random.uniform(-5.0, -4.0, n)
    states[:, 3:7] = np.column_stack([np.ones(n), 0.5 * roll, np.zeros(n), 0.5 * yaw])
    states[:, 3:7] /= np.linalg.norm(states[:, 3:7], axis=1, keepdims=True)
    states[:, 7:10] = np.column_stack([speed, random.normal(0, 0.05, n), random.normal(0, 0.02, n)])
    rate = speed / 0.46 * (1.0 + random.normal(0, 1e-3, n))
    states[:, 10:13] = np.column_stack([random.normal(0, 0.05, n), rate, random.normal(0, 0.02, n)])
    return states


@pytest.mark.parametrize("case", CASES)
def test_slopes_of_ellipses_are_those_of_differences(case):
    model, start = compile_scene(load_scene(ELLIPTIC / "suspended_wheelset.yaml", ["speed=20", *CASES[case]]))
    equations = Equations(model)
    assert differentiable.py_func(equations.arguments[1].value.contact)
    equations(0.0, start, ELLIPSES)
    equations.work.counts[:] = 0
    states, jacobian = random_states(model, start, "backwards" in case), new_jacobian(equations)
    found, expected = np.zeros((2, len(states), 1, 12, 6))
    touching = np.zeros(len(states), np.int64)
    blocks_of(jacobian, equations.arguments[0], states, *equations.arguments[1:], found, expected, touching)
    assert (touching > 0).all() and (touching > 1).mean() > 0.01
    scale = np.abs(expected).max(axis=-1, keepdims=True) + 1.0
    errors = (np.abs(found - expected) / scale).max(axis=(1, 2, 3))
    print(case, *(f"{100 * e:.4f} %" for e in np.percentile(errors, [50, 95, 99, 100])), (touching > 1).mean())
    # a contact 10 um deep stiffens by 5e-4 over the difference of 10 nm; a few differences cross an edge of the profile
    assert np.percentile(errors, 95) < 1e-3 and np.percentile(errors, 99) < 3e-3
