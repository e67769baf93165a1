"""The Jacobian and the linear system of the Rosenbrock methods against plain differences and numpy's solver."""

import json

import numpy as np
import pytest

from tests.conftest import ELLIPTIC
from tests.forces.test_control import STEERING
from wrcore.bodies.body import STATE_SIZE, matrix_of
from wrcore.equations.equations_of_motion import Equations
from wrcore.equations.model import internal_states
from wrcore.integrate.integrator import integrate
from wrcore.jacobian.block_elimination import factorise, new_system, solve_stage
from wrcore.jacobian.jacobian import joined_bodies, new_jacobian, plan_sweep, refresh_jacobian
from wrcore.jacobian.moving_axes import ANGLE, RATE, carry, rates_of_increments
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene

CURVE = "track={path: [{transition: 20}, {curve: 300, radius: 500, cant: 0.05}]}"
BRAKED = "drive.brakes=[{name: brake, bodies: [wheelset_2, bogie_1], force: {arc_length: [0, 90], force: [0, 9000]}}]"
MOTORS = (
    "drive.motors=[{name: left_1, bodies: [wheelset_1, car_body], wheel: left},"
    " {name: right_1, bodies: [wheelset_1, car_body], wheel: right}]"
)
CASES = {
    "wheelset": ("suspended_wheelset", []),
    "wheelset in a curve": ("suspended_wheelset", [CURVE]),
    "wheelset, looked up": ("suspended_wheelset", ["contact.patch=tabulated", "initial.y=0.002"]),
    "vehicle": ("trailer_vehicle", []),
    "vehicle with axle boxes": ("trailer_vehicle", ["vehicle.axle_boxes=true"]),
    "locomotive": ("locomotive", [BRAKED, "initial.y=0.002"]),
    "a control law": ("guided_car", ["track.path=tangent", f"control={json.dumps({'front': STEERING})}", MOTORS]),
}


@pytest.fixture(scope="module", params=CASES)
def moving(request):
    """Model, time, state in motion, its rate, and a function of time and state."""
    name, overrides = CASES[request.param]
    model, start = compile_scene(load_scene(ELLIPTIC / f"{name}.yaml", ["speed=20", *overrides]))
    end = integrate(model, start, [0.0, 1.5], "tsit5", 1e-6, 1e-9).end.memory
    t, state, equations = end.clock[0], end.state, Equations(model)
    return model, t, state, equations(t, state), equations


def refreshed(moving, jacobian=None, whole=True, along=False):
    model, t, state, rate, equations = moving
    jacobian = jacobian or new_jacobian(equations)
    refresh_jacobian(
        plan_sweep(model), joined_bodies(model), whole, along, jacobian, t, state, rate, np.empty_like(state),
        np.empty_like(state), np.empty(99), *equations.arguments,
    )  # fmt: skip
    return jacobian


def displaced(state, bodies, column, axes, size):
    """State with one unknown moved by a size."""
    out = state.copy()
    body, k = divmod(column % (6 * bodies), 6)
    if column >= 12 * bodies:
        out[STATE_SIZE * bodies + column - 12 * bodies] += size
    elif column >= 6 * bodies:
        out[STATE_SIZE * body + 7 + k] += size
    elif k < 3:
        out[STATE_SIZE * body + k] += size
    else:
        out[STATE_SIZE * body + 3 : STATE_SIZE * body + 7] += 0.5 * size * axes[body, k - 3]
    return out


def turned(values, bodies, rate, angle):
    """Vectors and Euler parameters of all bodies, turned about the vertical by an angle; None: their rates instead."""
    out, factor = values.copy(), (lambda half: 1j * rate * half if angle is None else np.exp(1j * angle * half))
    for body in range(bodies):
        for x, y, half in ((7, 8, 1.0), (10, 11, 1.0), (3, 6, 0.5), (4, 5, 0.5)):
            pair = (values[13 * body + x] + 1j * values[13 * body + y]) * factor(half)
            out[13 * body + x], out[13 * body + y] = pair.real, pair.imag
        if angle is None:
            out[13 * body : 13 * body + 3] = out[13 * body + 9] = out[13 * body + 12] = 0.0
    if angle is None:
        out[13 * bodies :] = 0.0
    return out


def rates_seen(function, t, state, bodies, rate, angle=0.0):
    """Right-hand side in axes that turn at a rate, positions aside."""
    return turned(function(t, state) - turned(state, bodies, rate, None), bodies, rate, -angle)


def on_its_circle(state, bodies, rate, t):
    """Where a state is after a time if all of it turns at a rate."""
    out = turned(state, bodies, rate, rate * t)
    for body in range(bodies):
        velocity = state[13 * body + 7] + 1j * state[13 * body + 8]
        way = velocity * (t if rate == 0.0 else (np.exp(1j * rate * t) - 1.0) / (1j * rate))
        out[13 * body : 13 * body + 3] += way.real, way.imag, t * state[13 * body + 9]
    return out


def test_every_entry_against_central_differences(moving):
    """One column at a time, all rows: entries that the sweeps leave out must be zero."""
    model, t, state, _, function = moving
    n = len(model.bodies.mass)
    jacobian = refreshed(moving)
    rows = np.r_[[13 * b + 7 + k for b in range(n) for k in range(6)], 13 * n : len(state)].astype(int)
    found, rate = np.vstack([jacobian.by_position, jacobian.by_velocity]), jacobian.turn[0]
    assert rate == pytest.approx(0.0 if model.track.tangent else state[7] / 500.0, rel=0.01)
    # a rail is the same everywhere, but for its curvature: in a curve the displacement along it is left out
    along = [] if model.track.tangent else [6 * b for b in model.bodies.wheelsets]
    for column in set(range(len(found))) - set(along):
        size = 1e-7 if column < 6 * n or column >= 12 * n else 1e-6
        moved = (displaced(state, n, column, jacobian.axes, s) for s in (size, -size))
        ahead, behind = (rates_seen(function, t, one, n, rate) for one in moved)
        slope = (ahead - behind) / (2 * size)
        # one-sided: a contact 0.1 mm deep gets 0.5e-4 stiffer over 1e-8 m. Rounding: heights to 5e-17 m, which a
        # contact's stiffness over mass, 1.6e6/s^2, and the difference 1e-8 turn into 0.01 (found: 0.0115).
        tolerance = 1e-4 * np.abs(slope).max() + 0.015
        np.testing.assert_allclose(found[column], slope[rows], rtol=0, atol=tolerance, err_msg=str(column))
        if column < 12 * n and column % 6 >= 3:
            body, place = column % (6 * n) // 6, column % 6 - 3 + 3 * (column >= 6 * n)
            turn = jacobian.axes[body] @ slope[13 * body + 3 : 13 * body + 7] * [2, 2, 2, 1]
            np.testing.assert_allclose(jacobian.turning[body, :, place], turn, atol=1e-5)
    drift = np.zeros_like(state)
    for body in range(n):
        drift[13 * body : 13 * body + 3] = state[13 * body + 7 : 13 * body + 10]
    np.testing.assert_array_equal(jacobian.drift, drift)
    later, earlier = (
        rates_seen(function, t + s, on_its_circle(state, n, rate, s), n, rate, rate * s) for s in (1e-7, -1e-7)
    )
    found, expected = jacobian.by_time, (later - earlier) / 2e-7
    for body in range(n):  # velocities stay
        expected[13 * body : 13 * body + 3] = 0.0
    np.testing.assert_allclose(found, expected, atol=1e-4 * np.abs(expected).max() + 0.01)


def test_the_drift_of_the_whole_state(moving):
    """It is all of the state's rate, as increments see it, and the derivative with respect to time is that along it."""
    model, t, state, _, function = moving
    jacobian, n = refreshed(moving, along=True), len(model.bodies.mass)
    axes = jacobian.turn[RATE], jacobian.turn[ANGLE]

    def seen(s):
        there = np.zeros_like(state)
        carry(n, axes, jacobian.drift, s, state, there)
        rates = function(t + s, there)
        rates_of_increments(n, axes, jacobian.drift, s, state, there, rates)
        return rates

    np.testing.assert_allclose(seen(0.0), 0.0, atol=1e-9 * np.abs(jacobian.drift).max())
    expected = (seen(1e-7) - seen(-1e-7)) / 2e-7
    np.testing.assert_allclose(jacobian.by_time, expected, atol=1e-4 * np.abs(expected).max() + 0.02)
    assert np.abs(jacobian.by_time - refreshed(moving).by_time).max() > 0.01 * np.abs(expected).max()


def test_refreshing_the_contacts_is_taking_the_whole_anew(moving):
    """Taken where the wheelsets are a bit aside, then refreshed where they are: only contacts are that nonlinear."""
    model, t, state, rate, function = moving
    n, aside = len(model.bodies.mass), state.copy()
    for body in model.bodies.wheelsets:
        aside[13 * body + 1] += 2e-4
        aside[13 * body + 7 : 13 * body + 13] += [1e-3, 2e-3, 1e-3, 1e-3, 1e-3, 2e-3]
    known = refreshed(moving)
    found = refreshed((model, t, aside, function(t, aside), function))

    def blocks(jacobian):
        return np.vstack([jacobian.by_position, jacobian.by_velocity])

    before = np.abs(blocks(found) - blocks(known))
    rates = refreshed(moving, found, whole=False)
    after = np.abs(blocks(rates) - blocks(known))
    scale = np.abs(blocks(known)).max(axis=1, keepdims=True) + 1e-9
    wheelsets = [6 * b + k for b in model.bodies.wheelsets for k in (1, 2, 3, 5)]
    wheelsets += [6 * n + 6 * b + k for b in model.bodies.wheelsets for k in range(6)]
    assert (before / scale)[wheelsets].max() > 0.1
    assert (after / scale)[wheelsets].max() < 0.02  # gyroscopic and inertial terms follow with the whole only
    np.testing.assert_array_equal(rates.drift, known.drift)
    np.testing.assert_allclose(rates.by_time, known.by_time, atol=1e-3 * np.abs(known.by_time).max())


def test_refreshed_in_axes_that_have_turned(moving):
    """Where they have turned by 0.3 rad since the whole was taken, the blocks turn back by that."""
    model, n = moving[0], len(moving[0].bodies.mass)
    straight, aside = refreshed(moving), new_jacobian(moving[-1])
    aside.turn[1] = 0.3
    refreshed(moving, aside)
    c, s = np.cos(0.3), np.sin(0.3)
    axes = np.kron(np.eye(2 * n), [[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    own = np.eye(internal_states(model))
    whole = np.block([[axes, np.zeros((6 * n, len(own)))], [np.zeros((len(own), 6 * n)), own]])
    for found, known, left in (
        (aside.by_position, straight.by_position, axes),
        (aside.by_velocity, straight.by_velocity, whole),
    ):
        expected = left @ known @ whole.T
        np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-4 * np.abs(expected).max() + 0.02)


def test_stages_are_solved_as_a_dense_system_would_be(moving):
    """Unknown: displacements, velocities, own states; the matrix written out in full and solved by numpy."""
    model, _, state, _, _ = moving
    n, sigma = len(model.bodies.mass), 900.0
    omegas = state[: 13 * n].reshape(n, 13)[:, 10:]
    axles = np.array([matrix_of(part[3:7])[:, 1] for part in state[: 13 * n].reshape(n, 13)])
    frames = omegas - np.sum(omegas * axles, axis=1, keepdims=True) * axles  # a wheelset's frame does not spin
    jacobian, system = refreshed(moving), new_system(moving[-1])
    size, rate = 12 * n + internal_states(model), jacobian.turn[0]
    matrix = np.zeros((size + n,) * 2)  # last the lengths of p
    for b in range(n):
        q, v = 6 * b, 6 * n + 6 * b
        matrix[q : q + 3, v : v + 3] = np.eye(3)
        matrix[q, q + 1], matrix[q + 1, q] = rate, -rate
        matrix[q + 3 : q + 6, q + 3 : q + 6] = jacobian.turning[b, :3, :3]
        matrix[q + 3 : q + 6, v + 3 : v + 6] = jacobian.turning[b, :3, 3:]
        matrix[q + 3 : q + 6, size + b] = model.bodies.spins[b] * frames[b] + (1 - model.bodies.spins[b]) * omegas[b]
        matrix[q + 5, size + b] -= rate
        matrix[size + b, q + 3 : q + 6], matrix[size + b, v + 3 : v + 6] = np.split(jacobian.turning[b, 3], 2)
        matrix[size + b, size + b] = -2.0 * model.alpha
    matrix[6 * n : size, : 6 * n], matrix[6 * n : size, 6 * n : size] = jacobian.by_position.T, jacobian.by_velocity.T

    def unknowns(vector):
        bodies = vector[: 13 * n].reshape(n, 13)
        turns = [2 * jacobian.axes[b, :3] @ bodies[b, 3:7] for b in range(n)]
        lengths = [jacobian.axes[b, 3] @ bodies[b, 3:7] for b in range(n)]
        return np.r_[np.hstack([bodies[:, :3], turns]).ravel(), bodies[:, 7:].ravel(), vector[13 * n :], lengths]

    right = np.random.default_rng(1).normal(size=len(state))
    expected = np.linalg.solve(sigma * np.eye(len(matrix)) - matrix, unknowns(right))
    increment = right.copy()
    assert factorise(jacobian, system, sigma)
    solve_stage(jacobian, system, sigma, increment)
    np.testing.assert_allclose(unknowns(increment), expected, atol=1e-12 * np.abs(expected).max())


def test_ellipses_and_lobes_get_the_kernel_of_their_slopes(moving):
    equations = moving[-1]
    new_jacobian(equations)
    assert equations.arguments[1].value.kernels.contact_derivatives_kernel != 0


def test_patches_that_are_solved_get_none():
    model, _ = compile_scene(load_scene(ELLIPTIC / "suspended_wheelset.yaml", ["contact.patch=exact"]))
    equations = Equations(model)
    given = equations.arguments[1]
    kernels = given.value.kernels._replace(contact_derivatives_kernel=1)
    given.lay(given.value._replace(kernels=kernels))  # as if another model had gone before
    new_jacobian(equations)
    assert given.value.kernels.contact_derivatives_kernel == 0


def test_a_singular_system_is_reported(moving):
    jacobian = new_jacobian(moving[-1])  # of zeros: with sigma = 0 nothing is left
    assert not factorise(jacobian, new_system(moving[-1]), 0.0)
    assert factorise(jacobian, new_system(moving[-1]), 1.0)
