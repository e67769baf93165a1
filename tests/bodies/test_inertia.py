"""Products of inertia, and wheelsets that carry what does not turn with the axle, against exact mechanics."""

import copy
import json

import numpy as np
import pytest
from scipy.linalg import expm

from tests.bodies.test_body import matrix_of
from tests.conftest import ELLIPTIC
from tests.energy_balance import energy_balance
from tests.equations.test_equations_of_motion import body_state, contact, make_model, run  # noqa: F401
from tests.vehicle.conftest import TRAILER
from wrcore.bodies.body import STATE_SIZE, euler_of
from wrcore.bodies.inertia import inertia_tensors, principal, tensor_of
from wrcore.equations.energy import energy_channels
from wrcore.equations.model import workspace
from wrcore.errors import InputError
from wrcore.integrate.integrator import integrate
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene
from wrcore.vehicle.description import build_vehicle

SIDES = np.array([4.0, 1.0, 2.5])
BOX = 6.0 / 12.0 * (np.sum(SIDES**2) - SIDES**2) * np.eye(3)
"""Of a homogeneous box of 6 kg, in its own axes."""


def turned(axis, angle):
    """Rotation matrix."""
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    return expm(angle * np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]))


R = turned([1.0, -2.0, 0.5], 0.7)
"""The box in the body's axes."""


def described(tensor):
    """The keys of a vehicle file."""
    names = {"roll": (0, 0), "pitch": (1, 1), "yaw": (2, 2), "xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}
    return {name: (1.0 if i == j else -1.0) * float(tensor[i, j]) for name, (i, j) in names.items()}


def with_tensors(model, tensors, spins=None):
    """The model with other inertia."""
    spins = model.bodies.spins if spins is None else np.array(spins)
    moments, axes = principal(tensors, spins)
    return model._replace(bodies=model.bodies._replace(inertia=moments, axes=axes, spins=spins))


def test_products_of_a_turned_box_are_integrals_over_its_mass():
    u = (np.arange(40) + 0.5) / 40 - 0.5
    points = np.stack(np.meshgrid(*(u * side for side in SIDES), indexing="ij"), axis=-1).reshape(-1, 3) @ R.T
    x, y, z = points.T
    mass = 6.0 / len(points)
    found = described(R @ BOX @ R.T)
    for name, integral in (("xy", x * y), ("xz", x * z), ("yz", y * z), ("roll", y**2 + z**2), ("yaw", x**2 + y**2)):
        assert found[name] == pytest.approx(mass * integral.sum(), rel=1e-3), name
    np.testing.assert_allclose(tensor_of(found), R @ BOX @ R.T, rtol=1e-14)


def test_a_body_has_the_tensor_of_its_file():
    trailer = copy.deepcopy(TRAILER)
    tensor = turned([0.2, 1.0, 0.3], 0.2) @ np.diag([2000.0, 1500.0, 3100.0]) @ turned([0.2, 1.0, 0.3], 0.2).T
    trailer["bodies"]["bogie_1"]["inertia"] = described(tensor)
    vehicle = build_vehicle(trailer, "trailer")
    tensors, k = inertia_tensors(vehicle.bodies), vehicle.body_names.index("bogie_1")
    np.testing.assert_allclose(tensors[k], tensor, rtol=1e-13)
    np.testing.assert_allclose(vehicle.bodies.inertia[k], [1500.0, 2000.0, 3100.0], rtol=1e-12)
    other = vehicle.body_names.index("bogie_2")
    np.testing.assert_array_equal(tensors[other], np.diag([1722.0, 1476.0, 3067.0]))


def test_a_body_does_not_care_for_the_axes_in_which_it_is_described(contact):  # noqa: F811
    plain = make_model(contact, [6.0], [np.diag(BOX)], gravity=0.0)
    other = with_tensors(plain, [R @ BOX @ R.T])
    start = body_state(angles=(0.1, 0.2, 0.3), omega=(0.1, 3.0, 0.2))
    expected = run(plain, start, 5.0).states
    beginning = start.copy()
    beginning[3:7] = euler_of(matrix_of(start[3:7]) @ R.T)
    found = run(other, beginning, 5.0).states
    np.testing.assert_allclose(found[:, 10:13], expected[:, 10:13], atol=1e-7)
    for mine, theirs in zip(found[::50], expected[::50], strict=True):
        np.testing.assert_allclose(matrix_of(mine[3:7]) @ R, matrix_of(theirs[3:7]), atol=1e-7)


def test_a_torque_free_body_with_products_keeps_energy_and_momentum(contact):  # noqa: F811
    tensor = R @ np.diag([1.0, 2.0, 3.5]) @ R.T
    model = with_tensors(make_model(contact, [1.0], [[1, 1, 1]], gravity=0.0), [tensor])
    start = body_state(angles=(0.1, 0.2, 0.3))
    start[10:13] = matrix_of(start[3:7]) @ R @ [0.1, 3.0, 0.2]  # next to the middle axis, about which it tumbles
    result = run(model, start, 20.0, points=2001)
    axes = [matrix_of(state[3:7]) for state in result.states]
    momentum = np.array([A @ tensor @ A.T @ s[10:13] for A, s in zip(axes, result.states, strict=True)])
    kinetic = 0.5 * np.sum(momentum * result.states[:, 10:13], axis=1)
    np.testing.assert_allclose(kinetic, kinetic[0], rtol=1e-8)
    np.testing.assert_allclose(momentum, np.broadcast_to(momentum[0], momentum.shape), atol=1e-7)
    channels = energy_channels(model, workspace(model), result.t, result.states)
    np.testing.assert_allclose(channels["kinetic_J"], kinetic, rtol=1e-12)
    local = np.array([(A @ R).T @ s[10:13] for A, s in zip(axes, result.states, strict=True)])
    assert local[:, 1].min() < -2.0


def small_angles(tensor, stiffness, start, t):
    """Angles (n, 3) of J a'' + K a = 0 from rest."""
    square, modes = np.linalg.eig(np.linalg.solve(tensor, np.diag(stiffness)))
    return (modes @ (np.cos(np.sqrt(square)[:, None] * t) * np.linalg.solve(modes, start)[:, None])).T


@pytest.mark.parametrize("joined", [False, True])
def test_small_angles_follow_the_inverse_tensor(contact, joined):  # noqa: F811
    # springs along z at +-1 m of x and y, along x at +-1 m of y: stiffness 2 k in roll, pitch and yaw; the second time
    # a joint holds the centre, so that the tensor's inverse in Eq. (8) is looked at, too
    tensor, k, frame = R @ BOX @ R.T, [300.0, 500.0, 900.0], -1
    places = [((0, 1, 0), 2, k[0]), ((1, 0, 0), 2, k[1]), ((0, 1, 0), 0, k[2])]
    springs = [
        ((0, frame), [sign * np.array(place), sign * np.array(place)], 0.5 * stiff * np.eye(3)[axis], *[(0, 0, 0)] * 3)
        for place, axis, stiff in places
        for sign in (1, -1)
    ]
    joints = [("spherical", (0, frame), [[0, 0, 0], [0, 0, 0]], 0)] if joined else []
    model = with_tensors(make_model(contact, [6.0], [[1, 1, 1]], springs, joints, gravity=0.0), [tensor])
    start = 1e-5 * np.array([1.0, -0.5, 0.7])
    result = run(model, body_state(angles=start), 2.0)
    expected = small_angles(tensor, k, start, result.t)
    np.testing.assert_allclose(2.0 * result.states[:, 4:7], expected, atol=2e-9)
    diagonal = small_angles(np.diag(np.diag(tensor)), k, start, result.t)
    assert np.abs(expected - diagonal).max() > 3e-6


def test_a_spinning_axle_with_a_gear_box_nutates_by_its_own_moment_alone(contact):  # noqa: F811
    # small angles: D_x roll'' = s I yaw', D_z yaw'' = -s I roll', frequency s I / sqrt(D_x D_z)
    along, spun, up, spin, rate = 1500.0, 112.0, 900.0, 40.0, 1e-4
    model = make_model(contact, [1800.0], [[1, 1, 1]], gravity=0.0)
    model = with_tensors(model, [np.diag([along, spun, up])], [1])
    result = run(model, body_state(omega=(rate, spin, 0.0)), 1.0)
    roll, _, yaw = 2.0 * result.states[:, 4:7].T
    frequency = spin * spun / np.sqrt(along * up)
    np.testing.assert_allclose(roll, rate / frequency * np.sin(frequency * result.t), atol=1e-11)
    expected = -np.sqrt(along / up) * rate / frequency * (1.0 - np.cos(frequency * result.t))
    np.testing.assert_allclose(yaw, expected, atol=1e-11)


def test_it_moves_as_with_a_gear_box_of_its_own(contact):  # noqa: F811
    # an axle, and on it by a joint a box that does not turn with it, products included
    axle, box = np.diag([800.0, 112.0, 800.0]), np.array([[700.0, 0, 150.0], [0, 400.0, 0], [150.0, 0, 100.0]])
    together = make_model(contact, [1800.0], [[1, 1, 1]], gravity=0.0)
    whole = axle + box
    whole[1, 1] = 112.0
    together = with_tensors(together, [whole], [1])
    joint = ("revolute", (0, 1), [[0, 0, 0], [0, 0, 0]], 1)
    apart = make_model(contact, [1000.0, 800.0], [[1, 1, 1]] * 2, joints=[joint], gravity=0.0, alpha=0.0, beta=0.0)
    apart = with_tensors(apart, [axle, box], [1, 0])
    omega = (2e-3, 40.0, -1e-3)
    one = run(together, body_state(omega=omega), 1.0).states
    two = run(apart, np.concatenate([body_state(omega=omega), body_state(omega=(2e-3, 0.0, -1e-3))]), 1.0).states
    np.testing.assert_allclose(one[:, 4:7], two[:, 4:7], atol=1e-3 * np.abs(two[:, 4:7]).max())
    channels = energy_channels(together, workspace(together), np.linspace(0, 1, len(one)), one)
    np.testing.assert_allclose(channels["kinetic_J"], channels["kinetic_J"][0], rtol=1e-9)


def test_turning_the_own_frame_about_the_axle_changes_nothing(contact):  # noqa: F811
    model = make_model(contact, [1800.0], [[1, 1, 1]], gravity=0.0)
    tensor = np.array([[1500.0, 0, 150.0], [0, 112.0, 0], [150.0, 0, 900.0]])
    model = with_tensors(model, [tensor], [1])
    ends = [
        run(model, body_state(angles=(0.02, pitch, 0.1), omega=(0.1, 40.0, 0.05)), 0.5).states for pitch in (0, 1.0)
    ]
    np.testing.assert_allclose(ends[0][:, 7:13], ends[1][:, 7:13], atol=1e-8)


CURVE = ["track.path=[{tangent: 20}, {transition: 20}, {curve: 100, radius: 500, cant: 0.1}]", "initial.y=0.003"]


@pytest.mark.parametrize("boxes", [True, False])
def test_energy_of_a_vehicle_with_both(boxes):
    change = {
        "wheelset_*": {"inertia": {"roll": 1400.0, "xz": 120.0}},
        "bogie_1": {"inertia": {"xy": 80.0, "xz": -250.0, "yz": 40.0}},
        "car_body": {"inertia": {"xz": 30000.0}},
    }
    overrides = [f"vehicle.bodies={json.dumps(change)}", f"vehicle.axle_boxes={json.dumps(boxes)}", *CURVE]
    model, state = compile_scene(load_scene(ELLIPTIC / "trailer_vehicle.yaml", overrides))
    times = np.arange(8001) / 4000.0
    result = integrate(model, state, times, "rk45", 1e-7, 1e-10)
    assert result.status == "completed" and len(model.bodies.axes)
    work = workspace(model)
    balance = energy_balance(energy_channels(model, work, result.t, result.states), result.t)
    assert np.abs(balance.imbalance).max() < 1e-6 * balance.turned_over[-1]
    assert state.size == len(model.bodies.mass) * STATE_SIZE + model.elements.states


@pytest.mark.parametrize(
    ("body", "change", "field", "expected"),
    [
        ("bogie_1", {"xz": 2400.0}, "bodies.bogie_1.inertia", "principal moments above 0"),
        ("wheelset_1", {"xy": 1.0}, "bodies.wheelset_1.inertia.xy", "xz alone"),
        ("wheelset_2", {"xz": 950.0}, "bodies.wheelset_2.inertia", "above 0"),
        ("bogie_1", {"zx": 1.0}, "bodies.bogie_1.inertia.zx", "pitch, roll, xy, xz, yaw, yz"),
    ],
)
def test_inertia_that_no_body_has(body, change, field, expected):
    trailer = copy.deepcopy(TRAILER)
    trailer["bodies"][body]["inertia"] |= change
    with pytest.raises(InputError) as error:
        build_vehicle(trailer, "trailer")
    assert error.value.field == field and expected in error.value.expected
