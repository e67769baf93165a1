"""What every kind of force element says of itself, and a law of the user's own."""

import math

import numpy as np
import pytest

from tests.dynamics.test_suspension import MASSES, at_rest, evaluate, model_with, moving
from tests.dynamics.test_system import body_state, contact, run  # noqa: F401 (contact is a fixture)
from wrcore.dynamics.energy import energy_balance, energy_channels
from wrcore.dynamics.suspension import with_laws
from wrcore.dynamics.system import workspace
from wrcore.elements import law
from wrcore.elements.kinds import KINDS
from wrcore.elements.kinds.compiled import FUNCTIONS, register
from wrcore.errors import InputError
from wrcore.kernels.jit import jit

AIR, CATCH = 7.0, 3.0  # N s^2/m^2, N/m

OWN = {"kind": "compiled", "direction": "z", "at": [0, 0, 1.5], "function": "air drag", "numbers": [AIR, CATCH]}


@jit(allocates=False)
def drag(elements, k, stretch, speed, inner, press):
    """c v |v|, and a stop that catches on one side alone."""
    resistance, stiffness = law.numbers(elements, k)[:2]
    caught = min(stretch, 0.0)
    force = resistance * speed * abs(speed)
    return force + stiffness * caught, stretch, 0.5 * stiffness * caught * caught, force * speed


@pytest.fixture
def registered():
    register("air drag", drag)
    yield
    del FUNCTIONS["air drag"]


def test_kinds_are_told_apart_in_pictures_and_say_what_they_need():
    assert len({tuple(sorted(kind.mark.items())) for kind in KINDS.values()}) == len(KINDS) >= 10
    for name, kind in KINDS.items():
        assert set(kind.needed) <= set(kind.keys), name


def test_a_law_of_ones_own_acts_as_it_says(contact, registered):  # noqa: F811
    model = model_with(contact, [OWN])
    for v in (-0.4, 0.0, 1.5):
        wrench, rates = evaluate(model, moving((0.3, 0.0, v), own=[0.2]))
        np.testing.assert_allclose(wrench[0, :3], [0.0, 0.0, -AIR * v * abs(v)], rtol=1e-14)
        assert rates == pytest.approx([0.0], abs=1e-15)
    for z in (-0.2, 0.3):
        wrench, rates = evaluate(model, at_rest(upper=(0, 0, 2.0 + z), own=[0.0]))
        assert wrench[0, 2] == pytest.approx(-CATCH * min(z, 0.0)) and rates == pytest.approx([z])


def test_a_law_of_ones_own_seen_from_a_wheelset_is_the_same(contact, registered):  # noqa: F811
    one = {**OWN, "at": [0.0, 0.4, 1.0]}
    first, second = (
        model_with(contact, [{**one, "bodies": bodies, "direction": "y"}], spins=(False, True))
        for bodies in (["upper", "lower"], ["lower", "upper"])
    )
    state = at_rest(upper=(0.0, -0.3, 2.0), own=[0.0])
    caught = [evaluate(model, state)[0][0, 1] for model in (first, second)]
    # the upper body is 0.3 m to the right: of the lower one, which the second element is told as its first
    assert caught == pytest.approx([CATCH * 0.3, 0.0])
    state = at_rest(upper=(0.0, 0.3, 2.0), own=[0.0])
    assert [evaluate(model, state)[0][0, 1] for model in (first, second)] == pytest.approx([0.0, -CATCH * 0.3])


def test_energy_with_a_law_of_ones_own_adds_up(contact, registered):  # noqa: F811
    model = model_with(contact, [{**OWN, "direction": axis} for axis in "xyz"])
    state = np.concatenate([
        body_state((0, 0, 2.0), velocity=(0.3, -1.2, 0.4), omega=(0.5, -0.3, 0.2)),
        body_state((0, 0, 1.0), velocity=(0.0, 0.5, -0.2), omega=(-0.1, 0.5, 0.2)), np.zeros(3),
    ])  # fmt: skip
    result = run(model, state, 2.0, points=4001)
    channels = energy_channels(model, workspace(model), result.t, result.states)
    balance = energy_balance(channels, result.t)
    assert np.abs(balance.imbalance).max() < 1e-6 * balance.turned_over[-1]
    assert np.ptp(channels["kinetic_J"]) > 0.1 * sum(MASSES) * 0.1


def test_a_law_that_does_not_return_four_numbers_is_refused(contact):  # noqa: F811
    register("wrong", jit(allocates=False)(lambda elements, k, stretch, speed, inner, press: stretch))
    try:
        with pytest.raises(TypeError, match="expected a kernel that returns"):
            with_laws(model_with(contact, [{**OWN, "function": "wrong"}]).elements)
    finally:
        del FUNCTIONS["wrong"]


def test_an_actuator_pushes_its_first_body_along_and_its_ends_apart(contact):  # noqa: F811
    along = {"kind": "actuator", "direction": "y", "at": [0.1, 0.2, 1.5], "force": 30.0}
    wrench = evaluate(model_with(contact, [along]), moving((0.3, 0.7, 0.0)))[0]
    np.testing.assert_allclose(wrench[:, :3], [[0.0, 30.0, 0.0], [0.0, -30.0, 0.0]], atol=1e-12)
    line = {"kind": "actuator", "direction": "line", "at": [[0.0, 0.3, 1.6], [0.0, 0.0, 1.2]], "force": 50.0}
    wrench = evaluate(model_with(contact, [line]), at_rest())[0]
    np.testing.assert_allclose(wrench[:, :3], [[0.0, 30.0, 40.0], [0.0, -30.0, -40.0]], atol=1e-12)
    for bodies, force in (("upper", "lower"), 30.0), (("lower", "upper"), -30.0):  # the lower one is a wheelset
        model = model_with(contact, [{**along, "at": [0.0, 0.4, 1.0], "bodies": list(bodies)}], spins=(False, True))
        assert evaluate(model, at_rest())[0][0, 1] == pytest.approx(force)


def test_an_unknown_function_is_an_error(contact, registered):  # noqa: F811
    with pytest.raises(InputError) as caught:
        model_with(contact, [{**OWN, "function": "ear drag"}])
    assert caught.value.field == "elements.e0.function" and "air drag" in caught.value.expected


def test_a_stop_on_a_line_presses_friction_with_its_force(contact):  # noqa: F811
    stop = {"name": "stop", "kind": "bump_stop", "direction": "line", "at": [[0, 0.6, 2.0], [0, 0.2, 1.0]], "gap": 0.0,
            "stiffness": 500.0}  # fmt: skip
    slips = {"kind": "friction", "direction": "x", "at": [0, 0, 1.5], "mu": 0.2, "normal": "stop", "approach": 1e-3}
    wrench = evaluate(model_with(contact, [stop, slips]), at_rest(upper=(0, 0.3, 2.2), own=[1e-3]))[0]
    assert wrench[0, 0] == pytest.approx(-0.2 * 500.0 * (math.hypot(0.7, 1.2) - math.hypot(0.4, 1.0)), rel=1e-12)
