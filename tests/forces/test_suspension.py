"""Force elements, as a vehicle file describes them, against vector algebra and textbook solutions."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.bodies.test_body import matrix_of
from tests.equations.test_equations_of_motion import body_state, contact, make_model, run  # noqa: F401 (contact is a fixture)
from wrcore.bodies.body import STATE_SIZE
from wrcore.equations.equations_of_motion import Equations
from wrcore.equations.model import workspace
from wrcore.forces.kinds.friction import GIVING_WAY
from wrcore.vehicle.element_parts import check_element
from wrcore.vehicle.elements import compile_elements
from wrcore.vehicle.layout import Layout

MASSES, INERTIAS = [3.0, 5.0], [[1.1, 1.7, 2.3], [2.1, 1.3, 3.1]]


def model_with(contact, items, positions=((0.0, 0.0, 2.0), (0.0, 0.0, 1.0)), spins=(False, False), speed=0.0):  # noqa: F811
    """A model of the bodies ``upper`` and ``lower``, free of gravity, with some elements."""
    items = [{"name": f"e{k}", "bodies": ["upper", "lower"], **item} for k, item in enumerate(items)]
    for item in items:
        check_element(item, "test")
    layout = Layout("test", ("upper", "lower"), np.array(positions, float), np.array(MASSES), np.array(spins), {})
    model, inertias = make_model(contact, MASSES, INERTIAS, gravity=0.0, speed=speed), np.array(INERTIAS)
    inertias[list(spins), 2] = inertias[list(spins), 0]  # bodies of revolution
    bodies = model.bodies._replace(spins=np.array(spins, np.int64), inertia=inertias)
    return model._replace(elements=compile_elements(items, layout, [], 0.0)[0], bodies=bodies)


def evaluate(model, state):
    """Force and moment (about the centre, without gyroscopic terms) of the elements on both bodies, and own rates."""
    work = workspace(model)
    rate = Equations(model, work)(0.0, state)
    wrenches = work.wrenches.copy()
    for b, inertia in enumerate(model.bodies.inertia):
        A, w = work.rotations[b], state[STATE_SIZE * b + 10 : STATE_SIZE * b + 13]
        wrenches[b, 3:] += np.cross(w, A @ (inertia * (A.T @ w)))
    return wrenches, rate[2 * STATE_SIZE :]


def at_rest(upper=(0.0, 0.0, 2.0), lower=(0.0, 0.0, 1.0), upper_angles=(0, 0, 0), lower_angles=(0, 0, 0), own=()):
    return np.concatenate([body_state(upper, upper_angles), body_state(lower, lower_angles), own])


def moving(velocity, own=()):
    """Nominal position, the upper body moving."""
    return np.concatenate([body_state((0, 0, 2.0), velocity=velocity), body_state((0, 0, 1.0)), own])


def tumbling(rng, own=()):
    """Both bodies anywhere, turned by large angles, moving and turning."""
    return np.concatenate([body_state(*rng.normal(size=(4, 3))) for _ in range(2)] + [np.array(own)])


def parts(state, b):
    r, p, v, w = np.split(state[STATE_SIZE * b : STATE_SIZE * (b + 1)], [3, 7, 10])
    return r, matrix_of(p), v, w


def relative_motion(state, marker):
    """Point of the upper body's marker, and its position and velocity in the axes of the lower body."""
    (r, A, v, w), (other, axes, u, turn) = parts(state, 0), parts(state, 1)
    point = r + A @ marker
    rate = v + np.cross(w, A @ marker) - u - np.cross(turn, point - other)
    return point, axes.T @ (point - other), axes.T @ rate


def wrenches_of(state, force, point, moment=(0.0, 0.0, 0.0)):
    """Wrenches of a force and a moment (track axes) on the upper body and of the opposite on the lower one."""
    moment = np.array(moment)
    return np.array([
        [*force, *(np.cross(point - parts(state, 0)[0], force) + moment)],
        [*-force, *(-np.cross(point - parts(state, 1)[0], force) - moment)],
    ])  # fmt: skip


SPRING = {"kind": "spring_damper", "at": [0.3, -0.4, 1.4], "stiffness": [700.0, 300.0, 500.0]}


def test_spring_damper_acts_along_the_second_bodys_axes(contact):  # noqa: F811
    item = {**SPRING, "damping": [20.0, 40.0, 30.0], "preload": [-50.0, 20.0, 90.0]}
    model = model_with(contact, [item])
    for state in (tumbling(np.random.default_rng(k)) for k in range(4)):
        point, place, rate = relative_motion(state, [0.3, -0.4, -0.6])
        stretch = place - [0.3, -0.4, 0.4]
        local = np.array(item["preload"]) - item["stiffness"] * stretch - item["damping"] * rate
        expected = wrenches_of(state, parts(state, 1)[1] @ local, point)
        np.testing.assert_allclose(evaluate(model, state)[0], expected, rtol=1e-11, atol=1e-9)
    np.testing.assert_allclose(evaluate(model, at_rest())[0][0, :3], item["preload"], rtol=1e-14)


CONSERVATIVE = {
    "spring_damper": [{**SPRING, "preload": [3.0, -8.0, 20.0]}],
    "rotation stiffness": [
        SPRING, {"kind": "spring_damper", "at": [0, 0, 1.5], "rotation_stiffness": [90.0, 10.0, 40.0]},
    ],
    "shear_spring": [
        {"kind": "shear_spring", "at": [[0, 0.2, 1.8], [0, 0.2, 1.2]], "stiffness": [200.0, 300.0, 400.0],
         "bending_stiffness": 60.0}
    ],
    "bump_stop": [
        {"kind": "bump_stop", "direction": axis, "at": [0.1, 0.2, 1.5], "gap": 0.1, "stiffness": 500.0}
        for axis in "xyz"
    ],
    "traction_rod": [
        {"kind": "traction_rod", "at": [[0.5, 0.1, 1.9], [-0.4, 0, 1.1]], "stiffness": 600.0, "preload": 40.0}
    ],
    "anti_roll_bar": [SPRING, {"kind": "anti_roll_bar", "stiffness": 90.0}],
    "bushing": [
        {**SPRING, "kind": "bushing", "cubic_stiffness": [900.0, 0.0, 500.0], "rotation_stiffness": [9.0, 1.0, 4.0],
         "rotation_cubic_stiffness": [3.0, 5.0, 2.0]}
    ],
}  # fmt: skip


def energy_of(kind, state):
    """Energy of the elements above; of an anti-roll bar k (1 + R11 - R22 - R33)/2, that is k (1 - cos roll)."""
    (r, A, _, _), (other, axes, _, _) = parts(state, 0), parts(state, 1)
    item, R = CONSERVATIVE[kind][0], axes.T @ A
    if kind == "traction_rod":
        here, there = r + A @ [0.5, 0.1, -0.1], other + axes @ [-0.4, 0.0, 0.1]
        stretch = np.linalg.norm(here - there) - np.linalg.norm([0.9, 0.1, 0.8])
        return 0.5 * 600.0 * stretch**2 - 40.0 * stretch
    marker = {"shear_spring": [0, 0.2, -0.5], "bump_stop": [0.1, 0.2, -0.5]}.get(kind, [0.3, -0.4, -0.6])
    stretch = relative_motion(state, np.array(marker))[1] - marker - [0, 0, 1.0]
    if kind == "bump_stop":
        return 0.5 * 500.0 * np.sum(np.maximum(np.abs(stretch) - 0.1, 0.0) ** 2)
    energy = 0.5 * np.sum(item["stiffness"] * stretch**2) - np.sum(np.array(item.get("preload", [0, 0, 0])) * stretch)
    if kind == "bushing":
        energy += 0.25 * np.sum(item["cubic_stiffness"] * stretch**4)
        energy += np.sum(item["rotation_cubic_stiffness"] * (0.5 * (1.0 - np.trace(R)) + np.diag(R)) ** 2)
    k = {
        "rotation stiffness": [90.0, 10.0, 40.0],
        "bushing": [9.0, 1.0, 4.0],
        "anti_roll_bar": [90.0, 0, 0],
        "shear_spring": [60.0, 60.0, 0],
    }
    kx, ky, kz = k.get(kind, [0.0, 0.0, 0.0])
    return energy + 0.5 * (np.array([ky + kz - kx, kx + kz - ky, kx + ky - kz]) @ (1.0 - np.diag(R)))


def momenta(state):
    """Linear and angular momentum about the origin, and kinetic energy, of both bodies."""
    linear, angular, energy = np.zeros(3), np.zeros(3), 0.0
    for b, (mass, inertia) in enumerate(zip(MASSES, INERTIAS, strict=True)):
        r, A, v, w = parts(state, b)
        spin = A @ (inertia * (A.T @ w))
        linear, angular = linear + mass * v, angular + mass * np.cross(r, v) + spin
        energy += 0.5 * mass * v @ v + 0.5 * w @ spin
    return linear, angular, energy


@pytest.mark.parametrize("kind", CONSERVATIVE)
def test_a_free_pair_keeps_momentum_and_energy_under_large_rotations(contact, kind):  # noqa: F811
    state = np.concatenate([
        body_state((0.1, 0.0, 2.1), (0.5, -0.4, 0.6), (0.3, -0.2, 0.4), (4.5, -6.0, 3.0)),
        body_state((0.0, 0.1, 1.0), (-0.3, 0.2, 0.1), (0.0, 0.5, -0.2), (-1.0, 0.5, 2.0)),
    ])  # fmt: skip
    states = run(model_with(contact, CONSERVATIVE[kind]), state, 2.0, points=21).states
    linear, angular, kinetic = (np.array(column) for column in zip(*map(momenta, states), strict=True))
    scale = np.abs(angular).max()
    np.testing.assert_allclose(linear, np.broadcast_to(linear[0], linear.shape), atol=1e-8 * scale)
    np.testing.assert_allclose(angular, np.broadcast_to(angular[0], angular.shape), atol=1e-8 * scale)
    total = kinetic + [energy_of(kind, state) for state in states]
    # integrated with rtol 1e-10; the corners of a bump stop's polygon cost some digits
    np.testing.assert_allclose(total, total[0], atol=1e-7 * kinetic.max())
    assert np.ptp(kinetic) > 0.05 * kinetic.max()  # energy did go to and fro
    turned = [np.trace(parts(state, 1)[1].T @ parts(state, 0)[1]) for state in states]
    assert min(turned) < 1.0  # a relative rotation of 90 degrees at least


def test_dampers_take_energy_but_no_momentum(contact):  # noqa: F811
    items = [
        {**SPRING, "damping": [20.0, 40.0, 30.0], "rotation_damping": [5.0, 9.0, 7.0]},
        {"kind": "damper", "at": [0.2, 0, 1.5], "direction": "x", "damping": 50.0, "series_stiffness": 400.0},
        {"kind": "damper", "at": [[0.2, 0.3, 1.5], [0.0, 0, 1.0]], "direction": "line", "damping": 50.0},
    ]
    state = np.concatenate([tumbling(np.random.default_rng(9)), [0.0]])
    states = run(model_with(contact, items), state, 6.0, points=31).states
    linear, angular, _ = (np.array(column) for column in zip(*map(momenta, states), strict=True))
    np.testing.assert_allclose(linear, np.broadcast_to(linear[0], linear.shape), atol=1e-8)
    np.testing.assert_allclose(angular, np.broadcast_to(angular[0], angular.shape), atol=1e-7)
    first, last = (np.linalg.norm(parts(state, 0)[3] - parts(state, 1)[3]) for state in (states[0], states[-1]))
    assert last < 0.2 * first  # most of the relative turning has gone


@pytest.mark.parametrize("axis", range(3))
def test_rotation_stiffness_about_each_axis(contact, axis):  # noqa: F811
    k, angle = np.array([900.0, 500.0, 700.0]), 0.8
    item = {
        "kind": "spring_damper",
        "at": [0, 0, 1.5],
        "rotation_stiffness": list(k),
        "rotation_damping": [3.0, 4.0, 5.0],
    }
    model = model_with(contact, [item])
    e = np.eye(3)[axis]
    # one rotation alone: the moment of k (1 - cos angle) about the lower body's axis
    wrench = evaluate(model, at_rest(upper_angles=angle * e))[0]
    np.testing.assert_allclose(wrench[0], [0, 0, 0, *(-k * math.sin(angle) * e)], atol=1e-10)
    np.testing.assert_allclose(wrench[1], -wrench[0], atol=1e-10)
    # small angles at once: kx roll, ky pitch, kz yaw; products of the angles are what is neglected
    small = np.array([1e-4, -2e-4, 3e-4])
    np.testing.assert_allclose(evaluate(model, at_rest(upper_angles=small))[0][0, 3:], -k * small, atol=1e-7 * k.max())
    state = at_rest()
    state[10 + axis] = 0.3
    np.testing.assert_allclose(evaluate(model, state)[0][0, 3:], -0.3 * np.array([3.0, 4.0, 5.0]) * e, atol=1e-12)


def test_shear_spring_is_the_beam_with_q_h_over_2_and_bending(contact):  # noqa: F811
    h, k, bend = 0.6, 2000.0, 150.0
    item = {"kind": "shear_spring", "at": [[0, 0, 1.8], [0, 0, 1.2]], "stiffness": [900.0, k, 5000.0]}
    model = model_with(contact, [{**item, "bending_stiffness": bend}])
    # moments about the spring's ends, which lie 0.2 m below the upper and above the lower body's centre
    upper, lower = np.array([0, 0, -0.2]), np.array([0, 0, 0.2])

    def end_moments(state):
        wrenches = evaluate(model, state)[0]
        ends = [parts(state, 0)[1] @ upper, parts(state, 1)[1] @ lower]
        return [w[3:] - np.cross(end, w[:3]) for w, end in zip(wrenches, ends, strict=True)], wrenches[0, 1]

    moments, force = end_moments(at_rest(upper=(0, 0.01, 2.0)))
    assert force == pytest.approx(-k * 0.01)
    np.testing.assert_allclose(moments, 2 * [[-k * 0.01 * h / 2, 0, 0]], atol=1e-12)
    # both ends stay where they are and turn against each other by theta: bending alone
    theta = 1e-4
    turned = at_rest((0, -0.2 * theta / 2, 2.0), (0, -0.2 * theta / 2, 1.0), (theta / 2, 0, 0), (-theta / 2, 0, 0))
    moments, force = end_moments(turned)
    np.testing.assert_allclose(
        moments, [[-bend * theta, 0, 0], [bend * theta, 0, 0]], atol=1e-6 * bend * theta + k * theta**2
    )
    assert abs(force) < k * theta**2


@pytest.mark.parametrize("axis", range(3))
def test_damper_along_each_axis_and_by_characteristic(contact, axis):  # noqa: F811
    direction, e = "xyz"[axis], np.eye(3)[axis]
    curve = {"velocity": [0.0, 0.1, 0.3], "force": [0.0, 500.0, 600.0]}
    one_sided = {"velocity": [-0.2, 0.0, 0.5], "force": [-100.0, 20.0, 30.0]}
    linear, by_curve, skew = (
        model_with(contact, [{"kind": "damper", "at": [0, 0, 1.5], "direction": direction, **law}])
        for law in ({"damping": 70.0}, {"characteristic": curve}, {"characteristic": one_sided})
    )
    for v in (-0.8, -0.3, -0.05, 0.0, 0.07, 0.2, 0.5):
        state = moving(v * e + 0.3 * np.roll(e, 1))  # motion across does not matter
        np.testing.assert_allclose(evaluate(linear, state)[0][0, :3], -70.0 * v * e, atol=1e-12)
        force = math.copysign(np.interp(abs(v), [0.0, 0.1, 0.3, 1.3], [0.0, 500.0, 600.0, 1100.0]), v)
        np.testing.assert_allclose(evaluate(by_curve, state)[0][0, :3], -force * e, atol=1e-10)
        force = np.interp(v, [-1.2, -0.2, 0.0, 0.5], [-700.0, -100.0, 20.0, 30.0])
        np.testing.assert_allclose(evaluate(skew, state)[0][0, :3], -force * e, atol=1e-10)


def test_a_damper_with_a_value_per_axis_is_a_damper_along_each(contact):  # noqa: F811
    item = {"kind": "damper", "at": [0, 0, 1.5], "damping": [0.0, 30.0, 80.0]}
    force = evaluate(model_with(contact, [item]), moving((0.3, 0.2, -0.1)))[0][0, :3]
    np.testing.assert_allclose(force, [0.0, -30.0 * 0.2, 80.0 * 0.1], atol=1e-12)
    model = model_with(contact, [{**item, "series_stiffness": [0.0, 500.0, 900.0]}])
    wrench, rates = evaluate(model, moving((0, 0, 0), own=[-0.02, 0.01]))
    np.testing.assert_allclose(wrench[0, :3], [0.0, -500.0 * 0.02, 900.0 * 0.01], atol=1e-12)
    np.testing.assert_allclose(rates, [500.0 * 0.02 / 30.0, -900.0 * 0.01 / 80.0])


def driven(model, displacement, times, own):
    """Force along z on the upper body that is moved vertically as told, over time; the element has one own state."""

    def state_at(t, x):
        return at_rest(upper=(0, 0, 2.0 + displacement(t)), own=x)

    function = Equations(model, workspace(model))
    ends = times[0], times[-1]
    solved = solve_ivp(
        lambda t, x: function(0.0, state_at(t, x))[2 * STATE_SIZE :], ends, own, "DOP853", times, rtol=1e-10, atol=1e-13
    )
    return np.array([evaluate(model, state_at(t, x))[0][0, 2] for t, x in zip(times, solved.y.T, strict=True)])


MAXWELL = {"kind": "damper", "at": [0, 0, 1.5], "direction": "z", "damping": 400.0, "series_stiffness": 3000.0}


def test_maxwell_damper_relaxes_after_a_step(contact):  # noqa: F811
    k, c, step = 3000.0, 400.0, 0.01
    times = np.linspace(0.0, 5 * c / k, 21)
    force = driven(model_with(contact, [MAXWELL]), lambda t: step, times, [0.0])
    np.testing.assert_allclose(force, -k * step * np.exp(-k * times / c), atol=1e-8 * k * step)


@pytest.mark.parametrize("ratio", [0.1, 1.0, 10.0])
def test_maxwell_damper_in_the_frequency_domain(contact, ratio):  # noqa: F811
    # F/x = i w c / (1 + i w c/k): |F/x| = c w / sqrt(1 + (c w/k)^2), ahead of x by pi/2 - atan(c w/k)
    k, c, amplitude = 3000.0, 400.0, 0.004
    w = ratio * k / c
    settled = math.ceil(25.0 * ratio / (2 * math.pi)) * 2 * math.pi / w  # 25 decay times c/k in whole periods
    times = settled + np.linspace(0.0, 2 * math.pi / w, 65)
    force = driven(
        model_with(contact, [MAXWELL]), lambda t: amplitude * math.sin(w * t), np.concatenate([[0.0], times]), [0.0]
    )
    response = -2.0 * np.mean(force[1:-1] * np.exp(-1j * w * times[:-1])) / (amplitude / 1j)
    assert abs(response) == pytest.approx(c * w / math.sqrt(1.0 + ratio**2), rel=1e-7)
    assert np.angle(response) == pytest.approx(math.pi / 2 - math.atan(ratio), abs=1e-7)


def test_saturating_damper_in_series_with_a_spring(contact):  # noqa: F811
    # a yaw damper: 12 kN at 20 mm/s and no more, behind 6 MN/m; pulled at constant speed
    k, curve = 6e6, {"velocity": [0.0, 0.02, 0.1], "force": [0.0, 12e3, 12e3]}
    item = {"kind": "damper", "at": [0, 0, 1.5], "direction": "z", "characteristic": curve, "series_stiffness": k}
    model, times = model_with(contact, [item]), np.linspace(0.0, 0.5, 11)
    c = 12e3 / 0.02
    slow = driven(model, lambda t: 0.01 * t, times, [0.0])  # below its limit: Maxwell's response to a ramp
    np.testing.assert_allclose(slow, -c * 0.01 * (1.0 - np.exp(-k * times / c)), atol=1e-4)
    fast = -driven(model, lambda t: 0.05 * t, times, [0.0])
    # beyond it the force stays, but for the thousandth of the steepest slope that an inverse needs
    assert fast[-1] == pytest.approx(12e3 + 1e-3 * c * (0.05 - 0.02), rel=1e-6)
    assert -driven(model, lambda t: 0.05 * t, np.array([0.0, 1e-5]), [0.0])[-1] == pytest.approx(k * 0.05e-5, rel=1e-3)


def test_friction_that_is_held_does_not_creep(contact):  # noqa: F811
    limit, k = 2000.0, 1e6
    item = {"kind": "friction", "at": [0, 0, 1.5], "direction": "z", "force": limit, "series_stiffness": k}
    model = model_with(contact, [item])
    for part, own_rate in ((0.97, 0.0), (-0.97, 0.0), (1.0, 0.0), (1.1, 0.1 * limit / k / GIVING_WAY)):
        force = part * limit
        wrenches, rates = evaluate(model, at_rest(upper=(0, 0, 2.0 + force / k), own=[0.0]))
        assert wrenches[0][2] == pytest.approx(-force) and rates == pytest.approx([own_rate], abs=1e-9)
    assert evaluate(model, moving((0.0, 0.0, 0.3), own=[-limit / k]))[1] == pytest.approx([0.3])  # it slides


def test_bump_stop_follows_its_table(contact):  # noqa: F811
    # lateral bump stop of Manchester vehicle 1 (config/vehicles/trailer_vehicle.yaml)
    x = np.array([0.0, 25, 30, 35, 40, 45, 50, 55, 60, 65]) * 1e-3
    force = np.array([0.0, 0.0, 600, 1760, 3730, 6870, 11580, 17170, 29200, 230000])
    item = {"kind": "bump_stop", "at": [0, 0, 1.5], "direction": "y"}
    model = model_with(contact, [{**item, "characteristic": {"displacement": list(x), "force": list(force)}}])
    for d in (0.0, 0.01, 0.025, 0.0275, 0.05, 0.062, 0.065):
        for side in (1.0, -1.0):
            found = evaluate(model, at_rest(upper=(0, side * d, 2.0)))[0][0]
            np.testing.assert_allclose(found[:3], [0, -side * np.interp(d, x, force), 0], atol=1e-6)
    slope = (230000 - 29200) / 0.005  # beyond the table the last slope goes on
    found = evaluate(model, at_rest(upper=(0, -0.07, 2.0)))[0][0, 1]
    assert found == pytest.approx(230000 + slope * 0.005, rel=1e-12)
    # a stop on one side only, and one by gap and stiffness
    one = {"displacement": [-0.1, -0.03, 0.0], "force": [-7000.0, 0.0, 0.0]}
    model = model_with(contact, [{**item, "characteristic": one}])
    forces = [evaluate(model, at_rest(upper=(0, d, 2.0)))[0][0, 1] for d in (-0.2, -0.05, -0.02, 0.1)]
    np.testing.assert_allclose(forces, [17000.0, 2000.0, 0.0, 0.0], atol=1e-9)
    for gap in (0.0, 0.02):
        model = model_with(contact, [{**item, "gap": gap, "stiffness": 1e5}])
        forces = [evaluate(model, at_rest(upper=(0, d, 2.0)))[0][0, 1] for d in (-0.05, 0.01, 0.05)]
        np.testing.assert_allclose(
            forces, [1e5 * (0.05 - gap), -1e5 * max(0.01 - gap, 0), -1e5 * (0.05 - gap)], atol=1e-9
        )


def test_traction_rod_acts_along_its_line_at_any_angle(contact):  # noqa: F811
    here, there = np.array([0.5, 0.1, 1.9]), np.array([-0.4, 0.0, 1.1])
    rod = {
        "kind": "traction_rod",
        "at": [list(here), list(there)],
        "stiffness": 600.0,
        "damping": 30.0,
        "preload": -40.0,
    }
    damper = {"kind": "damper", "direction": "line", "at": rod["at"], "damping": 30.0}
    with_rod, with_damper = model_with(contact, [rod]), model_with(contact, [damper])
    for state in (tumbling(np.random.default_rng(k)) for k in range(4)):
        (r, A, v, w), (other, axes, u, turn) = parts(state, 0), parts(state, 1)
        arm, back = A @ (here - [0, 0, 2]), axes @ (there - [0, 0, 1])
        line = r + arm - other - back
        length = np.linalg.norm(line)
        speed = line @ (v + np.cross(w, arm) - u - np.cross(turn, back)) / length
        tension = 600.0 * (length - np.linalg.norm(here - there)) + 40.0
        for model, pull in ((with_rod, tension + 30.0 * speed), (with_damper, 30.0 * speed)):
            expected = wrenches_of(state, -pull * line / length, r + arm)
            np.testing.assert_allclose(evaluate(model, state)[0], expected, rtol=1e-10, atol=1e-9)


def test_anti_roll_bar_resists_roll_alone(contact):  # noqa: F811
    model = model_with(contact, [{"kind": "anti_roll_bar", "stiffness": 900.0, "damping": 20.0}])
    for pitch, yaw in ((0.4, 0.0), (0.0, -0.7)):
        np.testing.assert_allclose(evaluate(model, at_rest(upper_angles=(0, pitch, yaw)))[0], 0.0, atol=1e-12)
    wrenches = evaluate(model, at_rest(upper=(0.1, 0.2, 2.5), upper_angles=(0.3, 0, 0)))[0]
    np.testing.assert_allclose(wrenches[0], [0, 0, 0, -900.0 * math.sin(0.3), 0, 0], atol=1e-12)
    np.testing.assert_allclose(wrenches[1], -wrenches[0], atol=1e-12)
    state = at_rest()
    state[10:13] = 0.5, 0.6, 0.7
    np.testing.assert_allclose(evaluate(model, state)[0][0], [0, 0, 0, -10.0, 0, 0], atol=1e-12)


ON_AXLES = [
    {**SPRING, "at": [0.0, 0.9, 1.0], "damping": [20.0, 40.0, 30.0], "preload": [-50.0, 20.0, 90.0]},
    {"kind": "damper", "direction": "z", "at": [0.0, 0.9, 1.0],
     "characteristic": {"velocity": [-0.2, 0.0, 0.5], "force": [-100.0, 20.0, 30.0]}},
    {"kind": "bump_stop", "direction": "y", "at": [0.0, 0.9, 1.0],
     "characteristic": {"displacement": [-0.1, -0.03, 0.0], "force": [-7000.0, 0.0, 0.0]}},
]  # fmt: skip


@pytest.mark.parametrize("item", ON_AXLES, ids=lambda item: item["kind"])
def test_nothing_turns_a_wheelset_about_its_axle_whichever_body_is_named_first(contact, item):  # noqa: F811
    spins = (False, True)
    rng = np.random.default_rng(2)
    angles, shift = 0.02 * rng.normal(size=(2, 3)), 0.05 * rng.normal(size=(2, 3))
    shift[:, 1] = -0.05, 0.03  # the bump stop acts
    state = np.concatenate([
        body_state(shift[0] + [0, 0, 2.0], angles[0], rng.normal(size=3)),
        body_state(shift[1] + [0, 0, 1.0], angles[1], rng.normal(size=3), (0.1, 40.0, 0.2)),
    ])  # fmt: skip
    model = model_with(contact, [item], spins=spins)
    axle = matrix_of(state[STATE_SIZE + 3 : STATE_SIZE + 7])[:, 1]
    wrench = evaluate(model, state)[0]
    assert np.linalg.norm(wrench[1, :3]) > 1.0
    assert abs(wrench[1, 3:] @ axle) < 1e-9 * np.linalg.norm(wrench[1, 3:])
    # named the other way round, with preload and characteristic for the opposite motion: the same forces
    turned = {**item, "bodies": ["lower", "upper"]}
    if "preload" in item:
        turned["preload"] = [-force for force in item["preload"]]
    if "characteristic" in item:
        turned["characteristic"] = {
            key: [-value for value in values[::-1]] for key, values in item["characteristic"].items()
        }
    np.testing.assert_allclose(evaluate(model_with(contact, [turned], spins=spins), state)[0], wrench, rtol=1e-12)
