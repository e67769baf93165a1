"""Newton-Euler, Eq. (8) and force elements against exact mechanics (no wheels involved)."""

import math

import numpy as np
import pytest

from tests.bodies.test_body import matrix_of
from tests.conftest import ROOT
from wrcore.bodies.body import euler_parameters
from wrcore.bodies.joint import Joint, build_joints
from wrcore.bodies.marker import FRAME
from wrcore.equations.model import Bodies, Model
from wrcore.forces.suspension import pack_elements
from wrcore.geometry.irregularity import no_irregularity
from wrcore.geometry.path import tangent_path
from wrcore.integrate.integrator import integrate
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene
from wrcore.track.track import TrackModel

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
    wheelless = np.zeros(len(masses), np.int64), np.zeros(0, np.int64)
    bodies = Bodies(np.array(masses, float), np.array(inertias, float), *wheelless)
    elements = pack_elements(
        [
            ((*ends, 0.0), [*markers[0], *np.add(markers[1], rest), *k, *c, *preload])
            for ends, markers, k, c, preload, rest in springs
        ]
    )
    joined = build_joints([Joint(str(k), *joint) for k, joint in enumerate(joints)], bodies.spins)
    return Model(bodies, contact, elements, joined, LEVEL, speed, gravity, alpha, beta)


def body_state(position=(0, 0, 0), angles=(0, 0, 0), velocity=(0, 0, 0), omega=(0, 0, 0)):
    return np.concatenate([position, euler_parameters(*angles), velocity, omega]).astype(float)


def run(model, state, duration, rtol=1e-10, points=201):
    return integrate(model, state, np.linspace(0, duration, points), "scipy_dop853", rtol, 1e-12)


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
    joint = ("spherical", (0, FRAME), [[0, 0, length], [0, 0, 0]], 0)
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
    joint = ("coordinate", (0, FRAME), [[0, 0, 0], [0, 0, 0]], 0)
    model = make_model(contact, [4.0], [[1, 1, 1]], joints=[joint], speed=3.0)
    result = run(model, body_state((0.01, 0, 0), velocity=(3.0, 0, 0)), 1.0)
    violation = result.states[:, 0] - 3.0 * result.t
    np.testing.assert_allclose(violation, 0.01 * (1 + 5 * result.t) * np.exp(-5 * result.t), atol=1e-10)
