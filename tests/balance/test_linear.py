"""Linearised motion against exact mechanics, the textbook's hunting wheelset, and simulated motion."""

import math

import numpy as np
import pytest
from scipy.linalg import eigh

from tests.conftest import ELLIPTIC, ROOT
from tests.equations.test_equations_of_motion import LEVEL, body_state, make_model
from wrcore.analysis.stability.modes import linear_modes
from wrcore.analysis.stability.stability import at_speed, steady_motion
from wrcore.balance.linear import linearise, moved_states, steady_running
from wrcore.bodies.body import STATE_SIZE
from wrcore.bodies.marker import FRAME
from wrcore.contact.search import reduction
from wrcore.creep.kalker import kalker_coefficients, kalker_data
from wrcore.equations.equations_of_motion import Equations
from wrcore.equations.model import Model, state_size
from wrcore.integrate.integrator import integrate
from wrcore.run.motion import growth_rate
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene
from wrcore.vehicle.description import build_vehicle


@pytest.fixture(scope="module")
def contact():
    """Some contact model, for vehicles without wheels."""
    return cone_on_circle()[1].contact


def cone_on_circle(**contact):
    """Suspended wheelset with wheels of slope 1/20 on round rails (300 mm), linear creep, no damping of the contact."""
    contact = {"creep": {"model": "linear"}, "normal": {"damping": {"c_e": 1.0}}, **contact}
    scene = load_scene({
        "name": "conical wheelset", "speed": 10.0, "contact": contact,
        "vehicle": {"parameters": str(ROOT / "config/vehicles/suspended_wheelset.yaml")},
        "wheel": {"profile": "cone:1/20"}, "rail": {"profile": "circle:0.3"},
    })  # fmt: skip
    return scene, *compile_scene(scene)


def sprung_model(vehicle, contact, gravity):
    return Model(vehicle.bodies, contact, vehicle.elements, vehicle.joints, LEVEL, 20.0, gravity, 5.0, 5.0)


def nominal_state(vehicle, model):
    state = np.zeros(state_size(model))
    for body, position in enumerate(vehicle.positions):
        state[STATE_SIZE * body : STATE_SIZE * body + 8] = *position, 1, 0, 0, 0, model.speed
    return state


# car body, two bogies and springs instead of wheels; nothing is preloaded and there is no gravity
BODIES = {
    "car_body": {"kind": "body", "mass": 32000.0, "position": [0.0, 0.0, 1.8],
                 "inertia": {"roll": 56800.0, "pitch": 1.97e6, "yaw": 1.90e6}},
    "bogie_1": {"kind": "body", "mass": 2615.0, "position": [9.5, 0.0, 0.6],
                "inertia": {"roll": 1722.0, "pitch": 1476.0, "yaw": 3067.0}},
    "bogie_2": {"kind": "body", "mass": 2615.0, "position": [-9.5, 0.0, 0.6],
                "inertia": {"roll": 1722.0, "pitch": 1476.0, "yaw": 3067.0}},
}  # fmt: skip
SPRINGS = [
    ("car_body", f"bogie_{k}", (x, y, 1.1), (1.6e5, 1.7e5, 4.3e5), (0.0, 0.0, 1.0e4))
    for k, x in ((1, 9.5), (2, -9.5)) for y in (1.0, -1.0)
] + [
    (f"bogie_{k}", "frame", (x + dx, y, 0.46), (3.1e6, 3.9e6, 1.2e6), (0.0, 0.0, 0.0))
    for k, x in ((1, 9.5), (2, -9.5)) for dx in (1.28, -1.28) for y in (1.0, -1.0)
]  # fmt: skip


def test_sprung_vehicle_has_the_frequencies_of_its_stiffness_and_mass_matrices(contact):
    """K x = w^2 M x with K = sum of B^T k B, B the relative displacement u + theta x (P - c) at the spring's point."""
    elements = [
        {"name": f"spring_{i}", "kind": "spring_damper", "bodies": [first, second], "at": list(at),
         "stiffness": list(k), "rotation_stiffness": list(turning), "preload": [0.0, 0.0, 0.0]}
        for i, (first, second, at, k, turning) in enumerate(SPRINGS)
    ]  # fmt: skip
    vehicle = build_vehicle({"name": "sprung", "bodies": BODIES, "elements": elements}, "test")
    model = sprung_model(vehicle, contact, 0.0)
    table, shapes, _ = linear_modes(vehicle, linearise(model, nominal_state(vehicle, model)))

    names = list(BODIES)
    stiffness, mass = np.zeros((18, 18)), np.zeros((18, 18))
    for k, body in enumerate(BODIES.values()):
        mass[6 * k : 6 * k + 6, 6 * k : 6 * k + 6] = np.diag([body["mass"]] * 3 + [*body["inertia"].values()])
    for first, second, at, k, turning in SPRINGS:
        relative = np.zeros((6, 18))
        for name, sign in ((first, 1.0), (second, -1.0)):
            if name in names:
                column = 6 * names.index(name)
                x, y, z = np.array(at) - BODIES[name]["position"]
                relative[:, column : column + 6] += sign * np.eye(6)
                relative[:3, column + 3 : column + 6] += sign * np.array([[0, z, -y], [-z, 0, x], [y, -x, 0]])
        stiffness += relative.T @ np.diag([*k, *turning]) @ relative
    squares, vectors = eigh(stiffness, mass)
    np.testing.assert_allclose(table["imag_rad_per_s"], np.sqrt(squares), rtol=1e-6)
    assert np.all(np.abs(table["real_per_s"]) < 1e-6 * table["imag_rad_per_s"])
    for shape, vector in zip(shapes, vectors.T, strict=True):  # no two frequencies are equal here
        exact = vector / vector[np.argmax(np.abs(vector))]
        same = shape.ravel() / shape.ravel()[np.argmax(np.abs(exact))]
        np.testing.assert_allclose(same, exact, atol=1e-4)
    expected = {"car body bounce", "car body pitch", "car body yaw", "car body lower sway", "car body upper sway",
                "bogie bounce, in phase", "bogie bounce, in antiphase", "bogie roll, in phase"}  # fmt: skip
    assert expected <= set(table["name"])


def test_body_above_its_springs_swings_like_an_inverted_pendulum(contact):
    """Springs at +-b, h below the centre: K = [[2 ky, 2 ky h], [2 ky h, 2 kz b^2 + 2 ky h^2 - m g h]] in (y, roll).

    The weight stands on the springs' upper ends, which a roll angle phi moves by h phi sideways from under the centre.
    """
    m, roll, b, h, ky, kz, g = 9000.0, 8000.0, 1.1, 0.9, 2.0e5, 3.0e5, 9.81
    data = {
        "name": "body",
        "bodies": {"body": {"kind": "body", "mass": m, "position": [0, 0, 1.5],
                            "inertia": {"roll": roll, "pitch": 2.0e4, "yaw": 2.0e4}}},
        "elements": [{"name": f"spring_{y}", "kind": "spring_damper", "bodies": ["body", "frame"],
                      "at": [0.0, y, 1.5 - h], "stiffness": [1.0e5, ky, kz]} for y in (b, -b)],
    }  # fmt: skip
    vehicle = build_vehicle(data, "test")
    model = sprung_model(vehicle, contact, g)
    table, shapes, _ = linear_modes(vehicle, linearise(model, nominal_state(vehicle, model)))
    sideways = table[np.max(np.abs(shapes[:, 0, [1, 3]]), axis=1) > 1e-3]
    stiffness = [[2 * ky, 2 * ky * h], [2 * ky * h, 2 * kz * b**2 + 2 * ky * h**2 - m * g * h]]
    exact = np.sqrt(eigh(stiffness, np.diag([m, roll]), eigvals_only=True))
    np.testing.assert_allclose(sideways["imag_rad_per_s"], exact, rtol=1e-6)
    assert list(sideways["name"]) == ["body lower sway", "body upper sway"]


def test_damper_in_series_with_a_spring(contact):
    """m x'' = -k x - s (x - d), c d' = s (x - d): roots of m c l^3 + m s l^2 + (k + s) c l + k s."""
    m, k, s, c = 800.0, 2.0e5, 1.5e5, 4.0e3
    data = {
        "name": "mass",
        "bodies": {"mass": {"kind": "body", "mass": m, "position": [0, 0, 1],
                            "inertia": {"roll": 1.0, "pitch": 1.0, "yaw": 1.0}}},
        "elements": [{"name": "spring", "kind": "spring_damper", "bodies": ["mass", "frame"], "at": [0, 0, 1],
                      "stiffness": [0.0, 0.0, k]},
                     {"name": "damper", "kind": "damper", "bodies": ["mass", "frame"], "at": [0, 0, 1],
                      "direction": "z", "damping": c, "series_stiffness": s}],
    }  # fmt: skip
    vehicle = build_vehicle(data, "test")
    model = sprung_model(vehicle, contact, 9.81)
    values = np.linalg.eigvals(linearise(model, nominal_state(vehicle, model)).matrix)
    moving = np.sort_complex(values[np.abs(values) > 1e-3])
    np.testing.assert_allclose(moving, np.sort_complex(np.roots([m * c, m * s, (k + s) * c, k * s])), rtol=1e-6)


def test_joints_are_eliminated(contact):
    """A body hung from the frame by a spherical joint: two pendulum modes w^2 = m g l/(J + m l^2) and a free yaw."""
    m, length, inertia = 3.0, 0.8, (0.5, 0.7, 0.2)
    joint = ("spherical", (0, FRAME), [[0, 0, length], [0, 0, 0]], 0)
    model = make_model(contact, [m], [inertia], joints=[joint], speed=7.0)
    linear = linearise(model, body_state((0, 0, -length), velocity=(7.0, 0, 0)))
    assert linear.matrix.shape == (6, 6)
    exact = [math.sqrt(m * 9.81 * length / (moment + m * length**2)) for moment in inertia[:2]]
    frequencies = np.sort(np.abs(np.linalg.eigvals(linear.matrix).imag))
    np.testing.assert_allclose(frequencies, [0, 0, *np.repeat(np.sort(exact), 2)], rtol=1e-6, atol=1e-6)
    # the joint's point stays where it is: sideways x - l pitch = 0, y + l roll = 0
    x, y, z, roll, pitch, _ = linear.basis[:6, :3]
    np.testing.assert_allclose([x + length * pitch, y - length * roll, z], 0.0, atol=1e-12)


def hunting_matrix(model, row, height, speed):
    """System matrix of (y, psi, y', psi') of a conical wheelset (slope g) on round rails (radius R), linear creep.

    All terms of first order, for two patches under the wheelset's centre that are stiff against all else:

    - geometry, b half the distance of the contacts and r the wheel's radius there: the wheelset rolls by phi = P y,
      P = g/(b - r g); contacts shift by -R phi on the rails; the radii change by +-l y, l = g (b + R g)/(b - r g),
      Wickens' equivalent conicity for straight generators (cos of the slope d = atan g is kept throughout);
    - creepages: longitudinal -+(l y/r + b psi'/V); lateral e = ((1 + r P) y' - V psi)/(V cos d), spin
      psi' cos d/V -+ sin d/r; with Kalker's f11, f22, f23, f33 the lateral force is T = -f22 e - f23 psi' cos d/V on
      both wheels and +-S, S = f23 sin d/r, which is proportional to the normal force N;
    - the normal forces change by +-n: roll moments (with rolling speed W = V/r, spin inertia J)
      Ix P y'' - J W psi' = 2 b [n (cos d + S'sin d) + T sin d + (S cos d - N sin d) P y]
                            - 2 (R P + 1) (N cos d + S sin d) y + r F + 2 (b P - l) Q y,   Q = N sin d - S cos d;
    - sideways m y'' = F - ky y,  F = 2 T cos d + 2 n (S' cos d - sin d) - 2 (S sin d + N cos d) P y;
    - yaw Iz psi'' + J W P y' = -2 b f11 (l y/r + b psi'/V) + 2 f23 e cos d - 2 f33 cos^2 d psi'/V
                                + 2 Q (b - r g) psi - kpsi psi.

    Source of the conicity: Wickens, Fundamentals of Rail Vehicle Dynamics (2003), chapter 2; the rest follows from the
    creepages of two cones that roll on a plane that follows the rails.
    """
    g, big_r = 1 / 20, 0.3
    m, (ix, j, iz) = model.bodies.mass[0], model.bodies.inertia[0]
    ky, kpsi = 2 * 0.75e6, 2 * 1.5e6 * 1.0**2  # config/vehicles/suspended_wheelset.yaml
    product, normal = row[reduction.SEMI_A] * row[reduction.SEMI_B], row[reduction.NORMAL]
    c11, c22, c23, c33 = kalker_coefficients(row[reduction.SEMI_A] / row[reduction.SEMI_B], kalker_data(0.28))
    shear = model.contact.shear_modulus
    f11, f22, f23, f33 = shear * np.array([product * c11, product * c22, product**1.5 * c23, product**2 * c33])
    b, r = row[reduction.Y], height - row[reduction.Z]
    sine, cosine = math.sin(math.atan(g)), math.cos(math.atan(g))
    turn, conicity = g / (b - r * g), g * (b + big_r * g) / (b - r * g)
    pull = f23 * sine / r
    slope, down, across = pull / normal, normal * cosine + pull * sine, normal * sine - pull * cosine
    y, psi, y_rate, psi_rate, y_acceleration = np.eye(5)
    creep = ((1 + r * turn) * y_rate - speed * psi) / (speed * cosine)
    force = -f22 * creep - f23 * cosine / speed * psi_rate
    # n (D + r K) = X - r (F without n), from the roll moments
    lever, share = 2 * b * (cosine + slope * sine), 2 * (slope * cosine - sine)
    plain = 2 * force * cosine - 2 * (pull * sine + normal * cosine) * turn * y
    rest = (
        ix * turn * y_acceleration - j * speed / r * psi_rate
        - 2 * b * (force * sine + (pull * cosine - normal * sine) * turn * y)
        + 2 * (big_r * turn + 1) * down * y - 2 * (b * turn - conicity) * across * y
    )  # fmt: skip
    shift = (rest - r * plain) / (lever + r * share)
    sideways = m * y_acceleration + ky * y - plain - share * shift
    yaw = (
        -2 * b * f11 * (conicity / r * y + b / speed * psi_rate) + 2 * f23 * cosine * creep
        - 2 * f33 * cosine**2 / speed * psi_rate + (2 * across * (b - r * g) - kpsi) * psi
        - j * speed / r * turn * y_rate
    )  # fmt: skip
    return np.array([y_rate[:4], psi_rate[:4], -sideways[:4] / sideways[4], yaw[:4] / iz])


@pytest.mark.parametrize(
    ("stiffening", "patch", "tolerance"), [(100.0, "maximum", 2e-3), (1.0, "maximum", 0.01), (1.0, "moment", 0.01)]
)
def test_hunting_of_a_conical_wheelset_equals_the_textbook(stiffening, patch, tolerance):
    """Steel, and a material a hundred times as stiff, whose contacts yield as little as the textbook's."""
    _, model, state = cone_on_circle(patch=patch)
    model = model._replace(contact=model.contact._replace(shear_modulus=8.2e10 * stiffening))
    higher = 6e-5 * (stiffening > 1.0) * (np.arange(STATE_SIZE) == 2)  # the stiff contact takes less penetration
    state = steady_running(model, state + higher, 50).state
    equations = Equations(model)
    equations(0.0, state)
    for speed in (5.0, 20.0, 40.0, 60.0, 80.0):
        found = np.linalg.eigvals(steady_motion(model, state, speed).matrix)
        exact = np.linalg.eigvals(hunting_matrix(model, equations.work.patches[0, 0, 0], state[2], speed))
        hunting = exact[np.argmax(exact.real)]
        nearest = found[np.argmin(np.abs(found - complex(hunting.real, abs(hunting.imag))))]
        assert nearest.real == pytest.approx(hunting.real, rel=tolerance)
        assert nearest.imag == pytest.approx(abs(hunting.imag), rel=tolerance)


def test_steady_running_stays_as_it_is():
    """The suspended wheelset at its own spin for a second: nothing moves but by rounding errors (and x by V t)."""
    model, state = compile_scene(load_scene(ELLIPTIC / "suspended_wheelset.yaml", ["initial.y=0.0"]))
    linear = steady_running(model, state)
    assert np.max(np.abs(linear.residual)) < 1e-9
    run = integrate(model, linear.state, np.linspace(0, 1, 11), "scipy_dop853", 1e-12, 1e-14)
    moved = run.states - linear.state
    moved[:, 0] -= model.speed * run.t
    np.testing.assert_allclose(moved, 0.0, atol=1e-8)  # from the start's spin, 1e-3 rad/s slower, it would not


@pytest.mark.parametrize("speed", [30.0, 75.0])
def test_small_free_motion_grows_as_its_eigenvalue_says(speed):
    """Suspended wheelset on real profiles, below and above its critical speed, started in its hunting mode (10 um)."""
    scene = load_scene(ELLIPTIC / "suspended_wheelset.yaml", ["initial.y=0.0"])
    model, state = compile_scene(scene)
    linear = steady_motion(model, state, speed)
    model, _ = at_speed(model, state, speed)
    values, vectors = np.linalg.eig(linear.matrix)
    table, _, _ = linear_modes(scene.vehicle, linear)
    mode = table[table["name"] == "wheelset hunting"].iloc[0]
    vector = vectors[:, np.argmin(np.abs(values - complex(mode["real_per_s"], mode["imag_rad_per_s"])))]
    move = np.real(linear.basis @ vector / (linear.basis @ vector)[1]) * 1e-5
    start = moved_states(model, linear.state, move[None, :])[0]
    times = np.linspace(0.0, 0.5, 1001)
    run = integrate(model, start, times, "scipy_dop853", 1e-9, 1e-13)
    assert growth_rate(run.t, run.states[:, 1]) == pytest.approx(mode["real_per_s"], rel=0.01)
