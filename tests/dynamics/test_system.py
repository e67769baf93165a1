"""Newton-Euler, Eq. (8) and force elements against exact mechanics (no wheels involved)."""

import math

import numpy as np
import pytest

from tests.conftest import ROOT
from tests.dynamics.test_body import matrix_of
from wrcore.dynamics.body import STATE_SIZE, euler_parameters
from wrcore.dynamics.integrate import integrate
from wrcore.dynamics.joint import COORDINATE, SPHERICAL, Joints, constraint_equations
from wrcore.dynamics.marker import FRAME
from wrcore.dynamics.suspension import pack_elements
from wrcore.dynamics.system import Bodies, Model, right_hand_side, workspace
from wrcore.dynamics.track import TrackModel
from wrcore.geometry.irregularity import no_irregularity
from wrcore.geometry.path import tangent_path
from wrcore.scene import compile_scene, load_scene

LEVEL = TrackModel(True, tangent_path(), no_irregularity())


@pytest.fixture(scope="module")
def contact(request):
    """Some contact model: the bodies of these tests have no wheels, so it is never used."""
    scene = {
        "name": "any",
        "speed": 1.0,
        "vehicle": {"model": "wheelset", "parameters": str(ROOT / "config/vehicles/wheelset.yaml")},
        "wheel": {"profile": "cone:1/20"},
        "rail": {"profile": "circle:0.05"},
        "contact": {"creep": {"model": "linear"}},
    }
    return compile_scene(load_scene(scene))[0].contact


def make_model(contact, masses, inertias, springs=(), joints=(), gravity=9.81, speed=0.0, alpha=5.0, beta=5.0):
    """A model without wheels. springs: bodies, markers, k, c, preload, rest; joints: kind, bodies, markers, axis."""
    m = len(joints)
    wheelless = np.zeros(len(masses), np.int64), np.zeros(0, np.int64)
    bodies = Bodies(np.array(masses, float), np.array(inertias, float), *wheelless)
    elements = pack_elements(
        [
            ((*ends, 0.0), [*markers[0], *np.add(markers[1], rest), *k, *c, *preload])
            for ends, markers, k, c, preload, rest in springs
        ]
    )
    equations = sum(3 if j[0] == SPHERICAL else 1 for j in joints)
    joined = Joints(
        np.array([j[0] for j in joints], np.int64), np.array([j[1] for j in joints], np.int64).reshape(m, 2),
        np.array([j[2] for j in joints], float).reshape(m, 2, 3), np.array([j[3] for j in joints], np.int64), equations,
    )  # fmt: skip
    return Model(bodies, contact, elements, joined, LEVEL, speed, gravity, alpha, beta)


def body_state(position=(0, 0, 0), angles=(0, 0, 0), velocity=(0, 0, 0), omega=(0, 0, 0)):
    return np.concatenate([position, euler_parameters(*angles), velocity, omega]).astype(float)


def run(model, state, duration, rtol=1e-10, points=201):
    return integrate(
        right_hand_side(model, workspace(model)), state, np.linspace(0, duration, points), "dop853", rtol, 1e-12
    )


def test_free_fall(contact):
    model = make_model(contact, [2.0], [[1, 2, 3]])
    end = run(model, body_state((1, 2, 3), velocity=(1, 0, 0.5)), 2.0).states[-1]
    np.testing.assert_allclose(end[:3], (1 + 2, 2, 3 + 0.5 * 2 - 0.5 * 9.81 * 4), atol=1e-9)


def test_torque_free_asymmetric_top_keeps_energy_and_momentum(contact):
    inertia = np.array([1.0, 2.0, 3.5])
    model = make_model(contact, [1.0], [inertia], gravity=0.0)
    result = run(model, body_state(angles=(0.1, 0.2, 0.3), omega=(0.1, 3.0, 0.2)), 20.0)

    turned = [matrix_of(state[3:7]) for state in result.states]
    local = np.array([A.T @ state[10:13] for A, state in zip(turned, result.states, strict=True)])
    energy = 0.5 * local**2 @ inertia
    momentum = np.array([A @ (inertia * w) for A, w in zip(turned, local, strict=True)])
    np.testing.assert_allclose(energy, energy[0], rtol=1e-8)  # rtol 1e-10 over about 100 turns
    np.testing.assert_allclose(momentum, np.broadcast_to(momentum[0], (len(momentum), 3)), atol=1e-7)
    norms = (result.states[:, 3:7] ** 2).sum(axis=1)
    np.testing.assert_allclose(norms, 1.0, atol=1e-10)
    assert local[:, 1].min() < -1.0  # it does tumble about the middle axis: otherwise nothing was tested


def test_spring_damper_oscillates_as_it_should(contact):
    # mass on one spring-damper to the moving frame, preload carries the weight: exact damped oscillation
    k, c, m, offset = 4000.0, 40.0, 10.0, 0.02
    marker = [[0, 0, 0], [0, 0, 1.0]]
    spring = ((0, FRAME), marker, (0, 0, k), (0, 0, c), (0, 0, m * 9.81), (0, 0, 0))
    result = run(make_model(contact, [m], [[1, 1, 1]], [spring]), body_state((0, 0, 1.0 + offset)), 1.0)
    omega = math.sqrt(k / m - (c / (2 * m)) ** 2)
    decay = c / (2 * m)
    t = result.t
    exact = offset * np.exp(-decay * t) * (np.cos(omega * t) + decay / omega * np.sin(omega * t))
    np.testing.assert_allclose(result.states[:, 2] - 1.0, exact, atol=1e-9)


def test_spring_off_the_centre_turns_the_body(contact):
    # springs at +-1.5 m: yaw oscillates with 2 k 1.5^2 / Izz
    k, Izz = 3000.0, 700.0
    springs = [((0, FRAME), [[0, s, 0], [0, s, 0]], (k, 0, 0), (0, 0, 0), (0, 0, 0), (0, 0, 0)) for s in (1.5, -1.5)]
    model = make_model(contact, [50.0], [[700, 100, Izz]], springs, gravity=0.0)
    result = run(model, body_state(angles=(0, 0, 1e-4)), 1.0)
    yaw = 2 * result.states[:, 6]
    np.testing.assert_allclose(yaw, 1e-4 * np.cos(math.sqrt(2 * k * 1.5**2 / Izz) * result.t), atol=1e-9)


def test_pendulum_by_lagrange_multipliers(contact):
    # A rod on a spherical joint swings like a physical pendulum; period from the elliptic integral.
    from scipy.special import ellipk

    m, length, moment, start = 3.0, 0.8, 0.5, 0.7
    joint = (SPHERICAL, (0, FRAME), [[0, 0, length], [0, 0, 0]], 0)
    model = make_model(contact, [m], [[moment, moment, moment]], joints=[joint])
    position = (0, length * math.sin(start), -length * math.cos(start))
    period = 4 * math.sqrt((moment + m * length**2) / (m * 9.81 * length)) * ellipk(math.sin(start / 2) ** 2)
    result = run(model, body_state(position, (start, 0, 0)), period)
    np.testing.assert_allclose(result.states[-1, :3], position, atol=1e-7)
    # the joint's point stays at the origin: position violation with Baumgarte at rtol 1e-10
    half = result.states[len(result.t) // 2]
    assert half[1] == pytest.approx(-position[1], abs=1e-7)
    assert np.abs(np.linalg.norm(result.states[:, :3], axis=1) - length).max() < 1e-9


def test_baumgarte_removes_a_violation_at_its_own_rate(contact):
    # prescribed x with alpha = beta = 5: Phi'' + 10 Phi' + 25 Phi = 0, so Phi = (1 + 5 t) exp(-5 t) Phi_0
    joint = (COORDINATE, (0, FRAME), [[0, 0, 0], [0, 0, 0]], 0)
    model = make_model(contact, [4.0], [[1, 1, 1]], joints=[joint], speed=3.0)
    result = run(model, body_state((0.01, 0, 0), velocity=(3.0, 0, 0)), 1.0)
    violation = result.states[:, 0] - 3.0 * result.t
    np.testing.assert_allclose(violation, 0.01 * (1 + 5 * result.t) * np.exp(-5 * result.t), atol=1e-10)


def test_reduced_solution_equals_the_full_matrix_of_eq_8(contact):
    # two bodies joined by a spherical joint, one also to the frame: Eq. (8) assembled and solved densely
    rng = np.random.default_rng(3)
    joints = [
        (SPHERICAL, (0, 1), [[0.3, 0.1, -0.2], [-0.4, 0.2, 0.1]], 0),
        (SPHERICAL, (1, FRAME), [[0.5, 0, 0.2], [0.2, 0.3, 0.4]], 0),
        (COORDINATE, (0, FRAME), [[0, 0, 0], [0.1, 0, 0]], 0),
    ]
    springs = [
        (
            (0, 1),
            rng.normal(size=(2, 3)),
            rng.uniform(1, 9, 3),
            rng.uniform(1, 9, 3),
            rng.normal(size=3),
            rng.normal(size=3),
        )
    ]
    inertias, masses = rng.uniform(1, 3, (2, 3)), [2.0, 5.0]
    model = make_model(contact, masses, inertias, springs, joints, speed=2.0, alpha=3.0, beta=7.0)
    state = np.concatenate([body_state(*rng.normal(size=(4, 3))) for _ in range(2)])
    work = workspace(model)
    rate = right_hand_side(model, work)(0.4, state)
    free = make_model(contact, masses, inertias, springs, [], speed=2.0)
    unconstrained = right_hand_side(free, workspace(free))(0.4, state)
    M, D = np.zeros((12, 12)), np.zeros((7, 12))
    for b in range(2):
        A = work.rotations[b]
        M[6 * b : 6 * b + 3, 6 * b : 6 * b + 3] = masses[b] * np.eye(3)
        M[6 * b + 3 : 6 * b + 6, 6 * b + 3 : 6 * b + 6] = A @ np.diag(inertias[b]) @ A.T
    constraints = work.constraints
    for row in range(7):
        for end in range(2):
            body = constraints.owner[row, end]
            if body != FRAME:
                D[row, 6 * body : 6 * body + 6] += constraints.jacobian[row, end]
    velocity_rates = lambda r: np.concatenate([r[STATE_SIZE * b + 7 : STATE_SIZE * b + 13] for b in range(2)])  # noqa: E731
    g = M @ velocity_rates(unconstrained)
    right = constraints.gamma - 2 * 3.0 * constraints.phi_rate - 7.0**2 * constraints.phi
    full = np.linalg.solve(np.block([[M, D.T], [D, np.zeros((7, 7))]]), np.concatenate([g, right]))
    np.testing.assert_allclose(velocity_rates(rate), full[:12], rtol=1e-9, atol=1e-9)


def test_constraints_match_finite_differences(contact):
    # D and gamma against differences of Phi along a motion with constant velocities: Phi' = D v, Phi'' = -gamma
    rng = np.random.default_rng(4)
    joints = [(SPHERICAL, (0, 1), rng.normal(size=(2, 3)), 0), (COORDINATE, (1, FRAME), [[0, 0, 0], [0, 0.2, 0]], 1)]
    model = make_model(contact, [1.0, 1.0], np.ones((2, 3)), joints=joints, gravity=0.0)
    state = np.concatenate([body_state(*rng.normal(size=(4, 3))) for _ in range(2)])
    free = make_model(contact, [1.0, 1.0], np.ones((2, 3)), gravity=0.0)  # unit spheres: w stays constant
    h = 1e-3
    times = np.array([-2, -1, 0, 1, 2]) * h
    function = right_hand_side(free, workspace(free))
    backwards = integrate(lambda t, y: -function(t, y), state, [0, h, 2 * h], "dop853", 1e-13, 1e-14).states
    forwards = integrate(function, state, [0, h, 2 * h], "dop853", 1e-13, 1e-14).states
    values = []
    for t, y in zip(times, [backwards[2], backwards[1], state, forwards[1], forwards[2]], strict=True):
        work = workspace(model)
        right_hand_side(model, work)(t, y)
        c = work.constraints
        constraint_equations(
            model.joints, model.track, t, 0.0, y, work.rotations, c.phi, c.phi_rate, c.jacobian, c.gamma, c.owner
        )
        values.append((c.phi.copy(), c.phi_rate.copy(), c.gamma.copy()))
    phi = np.array([v[0] for v in values])
    np.testing.assert_allclose((phi[0] - 8 * phi[1] + 8 * phi[3] - phi[4]) / (12 * h), values[2][1], atol=1e-8)
    second = (-phi[0] + 16 * phi[1] - 30 * phi[2] + 16 * phi[3] - phi[4]) / (12 * h * h)
    np.testing.assert_allclose(second, -values[2][2], atol=1e-5)
