"""Methods with a Jacobian in axes that turn with the track: exact, of their order, at the price of straight track."""

import numpy as np
import pytest

from tests.conftest import ELLIPTIC
from wrcore.bodies.body import STATE_SIZE
from wrcore.integrate.engine import NEXT, T
from wrcore.integrate.integrator import integrate
from wrcore.jacobian.moving_axes import carry, rates_of_increments
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene

BODIES = 3


def curve(radius, cant=0.1):
    return [{"tangent": 20.0}, {"transition": 30.0}, {"curve": 400.0, "radius": radius, "cant": cant}]


def coach(path, **changes):
    """The trailer vehicle at 16.7 m/s: model and initial state."""
    return compile_scene(load_scene(ELLIPTIC / "trailer_vehicle.yaml", {"speed": 16.7, "track.path": path, **changes}))


@pytest.mark.parametrize("turn", [(0.0, 0.0), (0.7, 0.0), (0.7, 0.4), (-2.0, -1.0)])
def test_rates_of_increments_are_their_derivatives(turn):
    """Along any path u(t) of the increments the state's rate leads back to u', by central differences."""
    size = STATE_SIZE * BODIES + 2
    start, drift, a, b = np.random.default_rng(3).normal(size=(4, size))

    def state_at(t):
        state = a * t + b * t**2
        carry(BODIES, turn, drift, t, start, state)
        return state

    for t in (0.0, 0.3):
        rate = (state_at(t + 1e-5) - state_at(t - 1e-5)) / 2e-5
        rates_of_increments(BODIES, turn, drift, t, start, state_at(t), rate)
        np.testing.assert_allclose(rate, a + 2.0 * b * t, atol=1e-8)
    np.testing.assert_array_equal(state_at(0.0), start)


@pytest.mark.parametrize(
    ("method", "rtol"), [("rodas4", 1e-3), ("rodas4", 1e-5), ("ros34pw2", 1e-2), ("ros34pw2", 1e-3)]
)
def test_a_steady_curve_costs_what_straight_track_costs(method, rtol):
    """The longest step, 0.05 s, for a vehicle in which nothing moves (with resting axes: 45 to 130 steps a second)."""
    steps = []
    for path in ("tangent", curve(300.0), curve(3000.0, 0.02)):
        model, start = coach(path, **{"initial.y": 0.0})
        before = integrate(model, start, [0.0, 15.0], method, rtol)
        steps.append(integrate(model, before.end, [15.0, 16.0], method, rtol).steps)
    assert steps[0] == 20 and max(steps[1:]) <= 1.5 * steps[0]


def test_methods_keep_their_orders_in_a_tight_curve():
    """R = 300 m on irregular rails: with resting axes, in which suspension blocks grow old, Rodas4 was of order 2."""
    rough = {"spectrum": {"level": "low", "seed": 1, "length": 200.0, "begin": 5.0}}
    path = [{"tangent": 5.0}, {"transition": 20.0}, {"curve": 300.0, "radius": 300.0, "cant": 0.1}]
    model, start = coach(path, **{"initial.y": 0.0, "track.irregularity": rough})
    start = integrate(model, start, [0.0, 4.0], "tsit5", 1e-8).states[-1]
    exact = integrate(model, start, [4.0, 4.25], "tsit5", 1e-10).states[-1]
    places = np.ravel([STATE_SIZE * body + np.arange(3) for body in model.bodies.wheelsets])
    for method, steps, order, bound in (
        ("rodas4", (4e-3, 2e-3), 4, 2e-9), ("ros34pw2", (1e-3, 5e-4), 3, 5e-9), ("rk4", (1e-3, 5e-4), 4, 1e-9),
        ("rk23", (1e-3, 5e-4), 3, 2e-9), ("tsit5", (1e-3,), 5, 1e-9), ("rk45", (1e-3,), 5, 1e-9),
    ):  # fmt: skip
        errors = [
            np.abs(integrate(model, start, [4.0, 4.25], method, step=h).states[-1] - exact)[places].max() for h in steps
        ]
        assert errors[-1] < bound, method
        assert np.all(np.log2(np.array(errors[:-1]) / errors[1:]) > order - 0.4), method


@pytest.mark.parametrize("method", ["rodas4", "ros34pw2", "tsit5"])
def test_steps_and_errors_fall_with_the_tolerance_in_a_transition(method):
    model, start = coach(curve(300.0), **{"initial.y": 0.0})
    exact = integrate(model, start, [0.0, 3.0], "tsit5", 1e-9).states[-1]
    places = np.ravel([STATE_SIZE * body + np.arange(3) for body in model.bodies.wheelsets])
    runs = [integrate(model, start, [0.0, 3.0], method, rtol) for rtol in (1e-3, 1e-5, 1e-7)]
    errors = [np.abs(run.states[-1] - exact)[places].max() for run in runs]
    assert runs[0].rhs_evaluations < runs[1].rhs_evaluations < runs[2].rhs_evaluations
    assert errors[1] < 1e-6 and errors[2] < 3e-8


@pytest.mark.parametrize("method", ["tsit5", "rodas4"])
def test_a_rejected_step_leaves_wheelsets_on_their_lap(method):
    """Far too long an attempt, after which the path's next lap (its circle goes on without end) is nearer."""
    model, start = coach(curve(300.0), **{"initial.y": 0.0})
    before = integrate(model, start, [0.0, 5.0], method, 1e-3).end
    plain = integrate(model, before, [5.0, 5.1], method, 1e-3)
    before.memory.clock[NEXT] = 2.0 * np.pi * 300.0 / 16.7
    wild = integrate(model, before, [5.0, 5.1], method, 1e-3)
    assert wild.rejected > plain.rejected
    ahead = 16.7 * (wild.end.memory.clock[T] - plain.end.memory.clock[T])  # the last step reaches beyond the end
    np.testing.assert_allclose(wild.end.arc_lengths, plain.end.arc_lengths + ahead, atol=0.05)
    np.testing.assert_allclose(wild.states[-1], plain.states[-1], atol=1e-2)
