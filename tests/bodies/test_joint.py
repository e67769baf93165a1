"""Constraint equations against differences of Phi along motions, the solver's order, and joints in exact mechanics."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from tests.equations.test_equations_of_motion import LEVEL, body_state, contact, make_model, run  # noqa: F401 (a fixture)
from wrcore.bodies.body import STATE_SIZE, matrix_of
from wrcore.bodies.joint import Joint, build_joints, evaluate_joints, joint_jacobian, joint_state
from wrcore.bodies.marker import FRAME
from wrcore.equations.equations_of_motion import Equations
from wrcore.equations.model import workspace
from wrcore.errors import InputError

SPINS = np.array([0, 0, 1])
"""Two bodies, then a wheelset."""
WHEELSET = 2
SPEED = 7.0
ON_AXLE, OFF_AXLE = (0.0, 0.4, 0.0), (0.3, -0.2, 0.5)

JOINTS = {
    "coordinate x": Joint("j", "coordinate", (0, FRAME), [OFF_AXLE, (0.1, 0.2, 0.3)], axis=0),
    "coordinate y": Joint("j", "coordinate", (1, FRAME), [OFF_AXLE, (0.1, 0.2, 0.3)], axis=1),
    "coordinate z of a wheelset": Joint("j", "coordinate", (WHEELSET, FRAME), [ON_AXLE, (0.1, 0.2, 0.3)], axis=2),
    "spherical": Joint("j", "spherical", (0, 1), [OFF_AXLE, (0.6, 0.1, -0.2)]),
    "spherical on a wheelset": Joint("j", "spherical", (0, WHEELSET), [OFF_AXLE, ON_AXLE]),
    "spherical to the frame": Joint("j", "spherical", (1, FRAME), [OFF_AXLE, (0.6, 0.1, -0.2)]),
    "revolute about x": Joint("j", "revolute", (0, 1), [OFF_AXLE, (0.6, 0.1, -0.2)], axis=0),
    "revolute about z": Joint("j", "revolute", (1, 0), [OFF_AXLE, (0.6, 0.1, -0.2)], axis=2),
    "axle box": Joint("j", "revolute", (WHEELSET, 1), [ON_AXLE, OFF_AXLE], axis=1),
    "axle box named first": Joint("j", "revolute", (1, WHEELSET), [OFF_AXLE, ON_AXLE], axis=1),
    "wheelset in fixed bearings": Joint("j", "revolute", (FRAME, WHEELSET), [(0.1, 0.2, 0.3), ON_AXLE], axis=1),
    "revolute to the frame": Joint("j", "revolute", (0, FRAME), [OFF_AXLE, (0.1, 0.2, 0.3)], axis=1),
    "no turn about y": Joint("j", "no_turn", (0, 1), [OFF_AXLE, (0.6, 0.1, -0.2)], axis=1),
    "no turn about z against the frame": Joint("j", "no_turn", (FRAME, 0), [OFF_AXLE, (0.1, 0.2, 0.3)], axis=2),
    "rigid link": Joint("j", "rigid_link", (0, 1), [OFF_AXLE, (0.6, 0.1, -0.2)], length=1.3),
    "rigid link on a wheelset": Joint("j", "rigid_link", (WHEELSET, 0), [ON_AXLE, OFF_AXLE], length=0.4),
    "rigid link to the frame": Joint("j", "rigid_link", (FRAME, 0), [(0.1, 0.2, 0.3), OFF_AXLE], length=0.7),
}


def euler_rates_of(p, w):
    """p' = 1/2 E(p)^T w for an angular velocity in track axes."""
    e0, e1, e2, e3 = p
    return 0.5 * np.array([[-e1, -e2, -e3], [e0, e3, -e2], [-e3, e0, e1], [e2, -e1, e0]]) @ w


def random_motion(rng):
    """Functions of time: state (13 n,) and accelerations v' (n, 6) of bodies that move arbitrarily."""
    n = len(SPINS)
    start = np.array([body_state(*rng.normal(size=(4, 3))) for _ in range(n)])
    start[WHEELSET, 10:13] += 40.0 * matrix_of(start[WHEELSET, 3:7])[:, 1]  # it spins
    pull = rng.normal(size=(n, 6))  # accelerations at t = 0; they grow in proportion to time
    growth = rng.normal(size=(n, 6))

    def rates(t, flat):
        rate = np.empty((n, STATE_SIZE))
        for b, state in enumerate(flat.reshape(n, STATE_SIZE)):
            w = state[10:13]
            axle = matrix_of(state[3:7])[:, 1]
            rate[b] = [
                *state[7:10],
                *euler_rates_of(state[3:7], w - SPINS[b] * axle * (axle @ w)),
                *accelerations(t)[b],
            ]
        return rate.ravel()

    def accelerations(t):
        return pull + growth * t

    def state(t):
        if t == 0.0:
            return start.ravel()
        return solve_ivp(rates, (0.0, t), start.ravel(), "DOP853", rtol=1e-13, atol=1e-14).y[:, -1]

    return state, accelerations


def evaluated(joints, t, state):
    rotations = np.array([matrix_of(part[3:7]) for part in state.reshape(-1, STATE_SIZE)] + [np.eye(3)])
    values = joint_state(joints)
    evaluate_joints(joints, t, SPEED, state, rotations, values)
    return values


@pytest.mark.parametrize("joint", JOINTS.values(), ids=JOINTS)
def test_constraints_match_differences_along_a_motion(joint):
    # Phi' = D v + dPhi/dt and D v' = Phi'' + gamma, with Phi' and Phi'' by central differences of fourth order
    joints, h = build_joints([joint], SPINS), 2e-4
    size = joints.equations
    for seed in range(3):
        state, accelerations = random_motion(np.random.default_rng(seed))
        values = [evaluated(joints, k * h, state(k * h)) for k in (-2, -1, 0, 1, 2)]
        difference = lambda rows: (rows[0] - 8 * rows[1] + 8 * rows[3] - rows[4])[0, :size] / (12 * h)  # noqa: E731
        rate, gamma = values[2].rate[0, :size], values[2].gamma[0, :size]
        np.testing.assert_allclose(difference([v.phi for v in values]), rate, atol=1e-8)

        D = joint_jacobian(joints, values[2], len(SPINS)).reshape(size, -1)
        velocities = state(0.0).reshape(-1, STATE_SIZE)[:, 7:].ravel()
        on_frame = joints.bodies[0, 1] == FRAME
        explicit = -values[2].along[0, :size, 0] * SPEED if on_frame else 0.0  # dPhi/dt of a frame that runs ahead
        np.testing.assert_allclose(D @ velocities + explicit, rate, atol=1e-12)

        second = difference([v.rate for v in values])
        np.testing.assert_allclose(D @ accelerations(0.0).ravel() - second, gamma, atol=1e-7)
        assert np.abs(gamma).max() > 1e-3  # else nothing was compared


@pytest.mark.parametrize(
    ("joint", "field", "expected"),
    [
        (Joint("a", "spherical", (1, 1), np.zeros((2, 3))), "joints.a.bodies", "two different"),
        (Joint("a", "revolute", (2, 0), [(0, 1, 0), (0, 0, 0)], axis=0), "joints.a.axis", "the axle"),
        (Joint("a", "spherical", (0, 2), [(0, 0, 0), (0.1, 1, 0)]), "joints.a.at", "axle"),
        (Joint("a", "revolute", (2, 3), np.zeros((2, 3)), axis=1), "joints.a.bodies", "one wheelset"),
        (Joint("a", "rigid_link", (0, 1), np.zeros((2, 3))), "joints.a.at", "apart"),
        (Joint("a", "coordinate", (0, 1), np.zeros((2, 3))), "joints.a.bodies", "frame"),
    ],
)
def test_impossible_joints_are_refused_by_name(joint, field, expected):
    with pytest.raises(InputError) as error:
        build_joints([joint], [0, 0, 1, 1], "file.yaml")
    assert error.value.source == "file.yaml" and error.value.field == field and expected in error.value.expected


def test_a_chain_in_any_order_becomes_block_tridiagonal():
    n = 30
    links = [Joint(str(k), "spherical", (k, k - 1 if k else FRAME), np.zeros((2, 3))) for k in range(n)]
    shuffled = [links[k] for k in np.random.default_rng(1).permutation(n)]
    joints = build_joints(shuffled, np.zeros(n))
    assert joints.order.tiles == 2 * n - 1
    np.testing.assert_array_equal(joints.order.first, np.maximum(np.arange(n) - 1, 0))
    for k, place in enumerate(joints.listed):
        assert tuple(joints.bodies[k]) == shuffled[place].bodies


def test_axle_boxes_of_different_wheelsets_stay_apart():
    # wheelsets 0 to 3, boxes 4 to 11; a box is listed first, and a separate body's coordinate lies in between
    boxes = [Joint(str(k), "revolute", (k % 4, 4 + k), [(0, 1, 0), (0, 0, 0)], axis=1) for k in range(8)]
    boxes.insert(3, Joint("x", "coordinate", (12, FRAME), np.zeros((2, 3))))
    joints = build_joints(boxes, [1] * 4 + [0] * 9)
    sizes = sorted((stop - start, size) for start, stop, size in joints.order.clusters.tolist())
    assert sizes == [(1, 1)] + 4 * [(2, 5)]
    assert joints.order.tiles == 4 * 3 + 1 and joints.equations == 41
    for start, stop, _ in joints.order.clusters:
        held = {body for pair in joints.bodies[start:stop].tolist() for body in pair if 0 <= body < 4}
        assert len(held) <= 1


def jointed(contact, masses, inertias, spins, joints, **options):  # noqa: F811
    """A model of bodies some of which are wheelsets (without wheels)."""
    model = make_model(contact, masses, inertias, **options)
    spins = np.array(spins)
    return model._replace(bodies=model.bodies._replace(spins=spins), joints=build_joints(joints, spins))


def test_axle_boxes_swing_as_if_the_wheelset_did_not_spin(contact):  # noqa: F811
    # Two boxes hang from the ends of an axle whose centre is held. They swing in phase as physical pendulums:
    # period from the elliptic integral, with the moment of inertia J + m c^2 about the axle.
    m, J, c, start, spin = 90.0, 4.0, 0.3, 0.9, 60.0
    held = [Joint(axis, "coordinate", (0, FRAME), np.zeros((2, 3)), "xyz".index(axis)) for axis in "xyz"]
    boxes = [Joint(f"{y}", "revolute", (0, body), [(0, y, 0), (0, 0, c)], 1) for body, y in ((1, 1.0), (2, -1.0))]
    model = jointed(contact, [1500, m, m], [[900, 110, 900], [5, J, 6], [5, J, 6]], [1, 0, 0], held + boxes)
    hanging = -c * math.sin(start), -c * math.cos(start)
    parts = [body_state(omega=(0, spin, 0))] + [
        body_state((hanging[0], y, hanging[1]), (0, start, 0)) for y in (1.0, -1.0)
    ]
    period = 4 * math.sqrt((J + m * c**2) / (m * 9.81 * c)) * ellipk(math.sin(start / 2) ** 2)
    result = run(model, np.concatenate(parts), period)
    half, end = result.states[len(result.t) // 2], result.states[-1]
    for at, y in ((STATE_SIZE, 1.0), (2 * STATE_SIZE, -1.0)):
        np.testing.assert_allclose(end[at : at + 3], (hanging[0], y, hanging[1]), atol=1e-7)
        np.testing.assert_allclose(half[at : at + 3], (-hanging[0], y, hanging[1]), atol=1e-7)
    np.testing.assert_allclose(end[10:13], (0, spin, 0), atol=1e-7)  # a revolute joint has no moment about its axis


def test_conical_pendulum_on_a_rigid_link(contact):  # noqa: F811
    # a point mass circles at the angle theta: w^2 = g / (L cos theta), tension m g / cos theta
    m, length, theta = 2.0, 1.5, 0.6
    w = math.sqrt(9.81 / (length * math.cos(theta)))
    link = Joint("rod", "rigid_link", (0, FRAME), [(0, 0, 0), (0, 0, 0)], length=length)
    model = jointed(contact, [m], [[1, 1, 1]], [0], [link])
    radius, depth = length * math.sin(theta), -length * math.cos(theta)
    state = body_state((radius, 0, depth), velocity=(0, w * radius, 0))
    work = workspace(model)
    Equations(model, work)(0.0, state)
    assert work.constraints.multipliers[0, 0] == pytest.approx(m * 9.81 / math.cos(theta), rel=1e-12)
    result = run(model, state, 2 * math.pi / w)
    np.testing.assert_allclose(np.hypot(*result.states[:, :2].T), radius, atol=1e-7)
    np.testing.assert_allclose(result.states[-1, :3], (radius, 0, depth), atol=1e-7)


def test_welded_bodies_move_as_one(contact):  # noqa: F811
    # 1000 kg and 500 kg, 3 m apart, on a spring to the frame, against one body of 1500 kg on the same spring
    first, second = np.array([300.0, 400.0, 500.0]), np.array([50.0, 80.0, 90.0])
    whole = first + second + np.array([0.0, 3000.0, 3000.0])  # 1000 (1 m)^2 + 500 (2 m)^2
    weld = [Joint("w", kind, (0, 1), [(-0.5, 0.2, 0.1), (2.5, 0.2, 0.1)], 1) for kind in ("no_turn", "revolute")]

    def held(marker):
        nothing = 0.0, 0.0, 0.0
        return [((0, FRAME), (marker, (0.3, 0.8, 1.0)), (4e4, 5e4, 6e4), (20.0, 0.0, 0.0), nothing, nothing)]

    pair = make_model(contact, [1000.0, 500.0], [first, second], held((0.2, 0.8, -0.3)))
    pair = pair._replace(joints=build_joints(weld, pair.bodies.spins))
    single = make_model(contact, [1500.0], [whole], held((1.2, 0.8, -0.3)))
    turn, omega = (0.1, -0.05, 0.2), np.array([0.4, -0.3, 0.5])
    A = matrix_of(body_state(angles=turn)[3:7])
    centre, velocity = np.array([0.0, 0.1, 0.2]), np.array([0.3, -0.1, 0.2])
    start = body_state(centre, turn, velocity, omega)
    parts = [
        body_state(centre + A @ arm, turn, velocity + np.cross(omega, A @ arm), omega)
        for arm in ([1, 0, 0], [-2, 0, 0])
    ]
    one, both = run(single, start, 3.0), run(pair, np.concatenate(parts), 3.0)
    arms = np.array([matrix_of(row[3:7])[:, 0] for row in one.states])
    np.testing.assert_allclose(both.states[:, :3], one.states[:, :3] + arms, atol=2e-7)
    np.testing.assert_allclose(both.states[:, 13:16], one.states[:, :3] - 2.0 * arms, atol=2e-7)
    np.testing.assert_allclose(both.states[:, 3:7], one.states[:, 3:7], atol=2e-7)
    assert np.ptp(one.states[:, 3]) > 0.05
    assert pair.joints.equations == 6
