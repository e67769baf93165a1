"""Friction that grows with the force in another element, and bushings, against closed forms."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.equations.test_equations_of_motion import contact  # noqa: F401 (a fixture)
from tests.forces.test_suspension import at_rest, evaluate, model_with
from wrcore.bodies.body import STATE_SIZE
from wrcore.equations.equations_of_motion import Equations
from wrcore.equations.model import workspace
from wrcore.errors import InputError
from wrcore.forces.kinds.friction import FLOOR

LOAD, STIFFNESS, MU, AMPLITUDE = 4e4, 1e6, 0.3, 0.01  # N, N/m, 1, m
SPRING = {
    "name": "spring", "kind": "spring_damper", "at": [0, 0, 1.5], "stiffness": [0.0, 0.0, STIFFNESS],
    "preload": [0, 0, LOAD],
}  # fmt: skip
STOP = {
    "name": "stop", "kind": "bump_stop", "direction": "y", "at": [0, 0, 1.5],
    "characteristic": {"displacement": [-1.0, 0.0, 1.0], "force": [-1e5, 0.0, 0.0]},
}  # fmt: skip
PRESSED = {"kind": "friction", "at": [0, 0, 1.5], "mu": MU, "normal": "spring"}


def lost_in_a_loop(model, place, axis, pace, lead=0.0):
    """Work that friction takes while the upper body moves by ``AMPLITUDE`` sin(pace t) along an axis from ``place``.

    It also lifts by twice as much, ``lead`` (rad) ahead, if that is not 0. Over the second period; what springs take
    cancels over a period.
    """
    work, direction = workspace(model), np.eye(3)[axis]
    function = Equations(model, work)
    up = np.array([0.0, 0.0, 2.0]) * (lead != 0.0)

    def slopes(t, x):
        swing, lift = math.sin(pace * t) * direction, math.sin(pace * t + lead) * up
        state = at_rest(np.add(place, [0, 0, 2.0]) + AMPLITUDE * (swing + lift), own=x[:1])
        state[7:10] = AMPLITUDE * pace * (math.cos(pace * t) * direction + math.cos(pace * t + lead) * up)
        rate = function(0.0, state)
        return [*rate[2 * STATE_SIZE :], -work.wrenches[0, :3] @ state[7:10]]

    quarter, x, lost = 0.5 * math.pi / pace, [0.0, 0.0], []
    for k in range(-1, 8, 2):  # from one turning point to the next
        ends = max(k, 0) * quarter, (k + 2 if k > 0 else 1) * quarter
        x = solve_ivp(slopes, ends, x, "LSODA", rtol=1e-8, atol=1e-10).y[:, -1]
        lost.append(x[1])
    return lost[4] - lost[2]


@pytest.mark.parametrize("frequency", [0.1, 2.5, 10.0])
@pytest.mark.parametrize("lift", [0.0, 0.02, 0.06, None])
def test_a_slider_loses_its_limit_times_the_way_it_slides(contact, lift, frequency):  # noqa: F811
    c, own = 5e6, {"force": MU * LOAD} if lift is None else {"mu": MU, "normal": "spring"}
    item = {"kind": "friction", "at": [0, 0, 1.5], "direction": "x", "series_stiffness": c, **own}
    limit = MU * max(LOAD - STIFFNESS * (lift or 0.0), 0.0)  # lifted by 60 mm the spring pulls, and nothing rubs
    lost = lost_in_a_loop(model_with(contact, [SPRING, item]), (0.0, 0.0, lift or 0.0), 0, 2.0 * math.pi * frequency)
    nothing = 4.0 * AMPLITUDE * FLOOR * MU * LOAD
    assert lost == pytest.approx(4.0 * limit * (AMPLITUDE - limit / c), rel=1e-3, abs=1.01 * nothing)
    assert lost > 0.0


@pytest.mark.parametrize("lead", [0.7, 2.5])
def test_a_slider_under_a_load_that_changes_loses_as_much_at_any_speed(contact, lead):  # noqa: F811
    """The load swings by half of itself: the lost work of 10 Hz is that of 0.1 Hz, and nearly Coulomb's."""
    model = model_with(contact, [SPRING, {**PRESSED, "direction": "x", "series_stiffness": 5e6}])
    slow, fast = (lost_in_a_loop(model, (0.0, 0.0, 0.0), 0, 2.0 * math.pi * f, lead) for f in (0.1, 10.0))
    assert fast == pytest.approx(slow, rel=3e-3)
    assert slow == pytest.approx(coulomb_loss(lead, 5e6), rel=0.01)


def coulomb_loss(lead, c, points=200_000):
    """Work that a spring and a slider in series take over a period, the slider returned to its limit point by point."""
    phase = np.linspace(0.0, 4.0 * math.pi, points + 1)
    x, limit = AMPLITUDE * np.sin(phase), MU * (LOAD - STIFFNESS * 2.0 * AMPLITUDE * np.sin(phase + lead))
    force = np.zeros_like(x)
    for k in range(points):
        force[k + 1] = min(max(force[k] + c * (x[k + 1] - x[k]), -limit[k + 1]), limit[k + 1])
    return np.trapezoid(force[points // 2 :], x[points // 2 :])


@pytest.mark.parametrize("pace", [0.1, 100.0])
def test_the_loop_of_a_leaf_spring_at_any_speed(contact, pace):  # noqa: F811
    # force (P - k z)(1 + mu z'/b ...) against z: the linear part of the load cancels over a period, and the approach
    # from both turning points leaves 4 mu P (A - b tanh(A/b))
    distance = 0.004
    model = model_with(contact, [SPRING, {**PRESSED, "direction": "z", "approach": distance}])
    exact = 4.0 * MU * LOAD * (AMPLITUDE - distance * math.tanh(AMPLITUDE / distance))
    assert lost_in_a_loop(model, (0.0, 0.0, 0.0), 2, pace) == pytest.approx(exact, rel=1e-6)


def test_a_link_is_a_pendulum_with_friction_in_its_joints(contact):  # noqa: F811
    length, distance = 0.3, 0.002
    link = {**PRESSED, "mu": 0.08, "direction": "y", "approach": distance, "pendulum": length}
    model = model_with(contact, [SPRING, link])
    for lift in (0.0, 0.01, 0.03):  # slid by many distances, then to the middle and on: N y/l +- mu N
        load = LOAD - STIFFNESS * lift
        for own, sign in ((distance, 1.0), (-distance, -1.0)):
            force = -evaluate(model, at_rest(upper=(0, 0.02, 2.0 + lift), own=[own]))[0][0, 1]
            assert force == pytest.approx(load * (0.02 / length + sign * 0.08), rel=1e-12)
    exact = 4.0 * 0.08 * LOAD * (AMPLITUDE - distance * math.tanh(AMPLITUDE / distance))
    assert lost_in_a_loop(model, (0.0, 0.0, 0.0), 1, 1.0) == pytest.approx(exact, rel=1e-6)


def test_a_bump_stop_presses_on_one_side_alone(contact):  # noqa: F811
    model = model_with(
        contact, [STOP, {**PRESSED, "normal": "stop", "direction": "x", "approach": 1e-3, "force": 50.0}]
    )
    for y, limit in ((-0.02, 50.0 + MU * 2000.0), (0.02, 50.0)):
        force = evaluate(model, at_rest(upper=(0, y, 2.0), own=[1e-3]))[0][0, 0]
        assert force == pytest.approx(-limit, rel=1e-12)
    assert evaluate(model, at_rest(own=[1e-3]))[0][0, 0] == pytest.approx(-50.0)


def test_which_body_is_named_first_does_not_matter_to_a_wheelset(contact):  # noqa: F811
    slider = {**PRESSED, "direction": "x", "approach": 1e-3}
    turned = {**SPRING, "bodies": ["lower", "upper"], "preload": [0, 0, -LOAD]}
    at, spins = [0.0, 0.9, 1.0], (False, True)
    state = at_rest(upper=(0, 0, 1.99), own=[1e-3])
    first = [{**SPRING, "at": at}, {**slider, "at": at}]
    second = [{**turned, "at": at}, {**slider, "at": at, "bodies": ["lower", "upper"]}]
    one, other = (evaluate(model_with(contact, items, spins=spins), state)[0] for items in (first, second))
    np.testing.assert_allclose(one, other, rtol=1e-12)
    assert abs(one[0, 0]) == pytest.approx(MU * (LOAD + 0.01 * STIFFNESS))


BAD = [
    (
        {"normal": "nothing"},
        "elements.e1.normal",
        "a spring or bump stop between the same two bodies",
    ),
    ({"bodies": ["lower", "upper"]}, "elements.e1.normal", "in the same order"),
    ({"bodies": ["upper", "frame"]}, "elements.e1.normal", "between the same two bodies"),
    ({"mu": None}, "elements.e1", "expected both mu and normal"),
    ({"mu": None, "normal": None}, "elements.e1.force", "expected a value, or mu and normal"),
    ({"approach": 1e-3}, "elements.e1.approach", "either approach or series_stiffness"),
    ({"pendulum": 0.3}, "elements.e1.pendulum", "mu, normal and approach"),
    ({"series_stiffness": None}, "elements.e1.series_stiffness", "or approach"),
    ({"series_stiffness": 0.0}, "elements.e1.series_stiffness", "above 0"),
]


@pytest.mark.parametrize("changes, field, expected", BAD)
def test_errors_name_the_friction_and_its_key(contact, changes, field, expected):  # noqa: F811
    item = {**PRESSED, "direction": "x", "series_stiffness": 1e6, **changes}
    with pytest.raises(InputError) as caught:
        model_with(contact, [SPRING, {key: value for key, value in item.items() if value is not None}])
    assert caught.value.field == field and expected in caught.value.expected


def test_a_bushing_is_cubic_along_and_about_all_axes(contact):  # noqa: F811
    k, cubic, turn, hard = np.array([[7e3, 3e3, 5e3], [2e7, 0.0, 3e7], [90.0, 10.0, 40.0], [500.0, 300.0, 0.0]])
    item = {
        "kind": "bushing", "at": [0, 0, 1.5], "stiffness": list(k), "cubic_stiffness": list(cubic),
        "rotation_stiffness": list(turn), "rotation_cubic_stiffness": list(hard), "preload": [0.0, 0.0, 100.0],
    }  # fmt: skip
    model = model_with(contact, [item])
    d = np.array([0.02, -0.03, 0.01])
    wrench = evaluate(model, at_rest(upper=d + [0, 0, 2.0]))[0][0]
    np.testing.assert_allclose(wrench[:3], [0, 0, 100.0] - k * d - cubic * d**3, rtol=1e-12)
    bare = model_with(contact, [{key: value for key, value in item.items() if "rotation" not in key}])
    for angle in np.vstack([0.7 * np.eye(3), -0.01 * np.eye(3)]):  # the moment of k (1 - cos) + h (1 - cos)^2
        state = at_rest(upper_angles=angle)
        moment = evaluate(model, state)[0][0, 3:] - evaluate(bare, state)[0][0, 3:]
        expected = -(turn + 2.0 * hard * (1.0 - np.cos(angle))) * np.sin(angle)
        np.testing.assert_allclose(moment, expected, atol=1e-9)
