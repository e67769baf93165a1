"""Static equilibrium against statics by hand."""

import copy

import numpy as np
import pytest
import yaml

import wrcore as wr
from tests.conftest import ELLIPTIC, ROOT
from wrcore.balance.equilibrium import displaced, wheel_loads
from wrcore.bodies.body import STATE_SIZE, matrix_of
from wrcore.contact.search import reduction
from wrcore.equations.equations_of_motion import Equations
from wrcore.equations.model import workspace
from wrcore.errors.checked_yaml import read_yaml
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene, static_equilibrium
from wrcore.vehicle.description import GRAVITY

TRAILER = read_yaml(ROOT / "config" / "vehicles" / "trailer_vehicle.yaml")
CAR = 32000 * GRAVITY


@pytest.fixture
def equilibrium_of(tmp_path):
    """Scene, model and equilibrium of a vehicle's data."""

    def find(data, *overrides):
        (tmp_path / "vehicle.yaml").write_text(yaml.safe_dump(data, sort_keys=False))
        overrides = [f"vehicle.parameters={tmp_path / 'vehicle.yaml'}", "contact.creep.model=linear", *overrides]
        scene = load_scene(ELLIPTIC / "trailer_vehicle.yaml", ["vehicle.axle_boxes=false", "initial.y=0", *overrides])
        model = compile_scene(scene)[0]
        return scene, model, static_equilibrium(scene, model)

    return find


def heights(scene, equilibrium):
    """Height of each body's centre in equilibrium, m, by name."""
    names = scene.vehicle.body_names
    return {name: equilibrium.state[STATE_SIZE * b + 2] for b, name in enumerate(names)}


def test_displacements_turn_bodies_about_track_axes():
    """Rodrigues' rotation, after that of the body, for each row and body by itself; all else stays."""
    model, state = compile_scene(load_scene(ELLIPTIC / "trailer_vehicle.yaml", ["initial.yaw=0.004"]))
    rng, n = np.random.default_rng(1), len(model.bodies.mass)
    rows = 0.3 * rng.normal(size=(3, 6 * n + len(state) - STATE_SIZE * n))
    for row, moved in zip(rows, displaced(state, model, rows), strict=True):
        for body in range(n):
            at, (*shift, a, b, c) = STATE_SIZE * body, row[6 * body : 6 * body + 6]
            angle, across = np.linalg.norm([a, b, c]), np.array([[0.0, -c, b], [c, 0.0, -a], [-b, a, 0.0]])
            turn = np.eye(3) + np.sin(angle) / angle * across + (1.0 - np.cos(angle)) / angle**2 * across @ across
            expected = turn @ matrix_of(state[at + 3 : at + 7])
            np.testing.assert_allclose(matrix_of(moved[at + 3 : at + 7]), expected, rtol=0, atol=1e-14)
            np.testing.assert_array_equal(moved[at : at + 3], state[at : at + 3] + shift)
            np.testing.assert_array_equal(moved[at + 7 : at + 13], state[at + 7 : at + 13])
        np.testing.assert_array_equal(moved[STATE_SIZE * n :], state[STATE_SIZE * n :] + row[6 * n :])


@pytest.mark.parametrize("axle_boxes", ["false", "true"])
def test_trailer_vehicle_loads_its_eight_wheels_alike(equilibrium_of, axle_boxes):
    scene, model, equilibrium = equilibrium_of(TRAILER, f"vehicle.axle_boxes={axle_boxes}")
    # 44 482 kg on eight wheels: 54 546 N (derived from the masses of Manchester vehicle 1)
    assert equilibrium.wheel_loads.shape == (4, 2)
    weight = sum(part["mass"] for part in TRAILER["bodies"].values()) * GRAVITY
    np.testing.assert_allclose(equilibrium.wheel_loads, weight / 8, rtol=1e-6)
    assert weight / 8 == pytest.approx(54546, abs=0.5)
    # springs hold the nominal position: what is left is the wheelsets' lowering onto the rails, under 0.3 mm
    lowered = {name: heights(scene, equilibrium)[name] - place[2] for name, place in zip(
        scene.vehicle.body_names, scene.vehicle.positions, strict=True)}  # fmt: skip
    assert -3e-4 < lowered["wheelset_1"] < 0.0 and len(lowered) == (15 if axle_boxes == "true" else 7)
    np.testing.assert_allclose(list(lowered.values()), lowered["wheelset_1"], atol=1e-8)
    assert equilibrium.residual < 1e-6
    np.testing.assert_allclose(
        equilibrium.state[len(lowered) * STATE_SIZE :], 0.0, atol=1e-9
    )  # dampers' springs are relaxed


@pytest.mark.parametrize("patch", ["moment", "maximum"])
def test_wheels_roll_without_slip_at_the_start(patch):
    scene = load_scene(
        ELLIPTIC / "trailer_vehicle.yaml", ["initial.y=0", f"contact.patch={patch}", "contact.creep.model=she"]
    )
    model, state = compile_scene(scene)
    work = workspace(model)
    Equations(model, work)(0.0, state)
    xi = work.patches[:, :, 0, reduction.XI]
    np.testing.assert_allclose(xi, 0.0, atol=1e-6)  # what overcomes the spin moments' part about the axle
    np.testing.assert_allclose(xi[:, 0], xi[:, 1], atol=1e-12)


def test_load_off_the_centre(equilibrium_of):
    data, x, y = copy.deepcopy(TRAILER), 0.6, 0.08
    data["bodies"]["car_body"]["position"] = [x, y, 1.8]
    scene, model, equilibrium = equilibrium_of(data)
    loads = equilibrium.wheel_loads
    rest = (2615 + 2 * 1813) * GRAVITY
    front = CAR * (0.5 + x / 19.0) + rest  # level: moments about the rear bogie's centre
    assert loads[:2].sum() == pytest.approx(front, rel=1e-5)
    assert loads.sum() == pytest.approx(CAR + 2 * rest, rel=1e-9)
    # moments of all forces on the vehicle about the track's centre line, with the places where wheels do touch
    work = workspace(model)
    Equations(model._replace(contact=model.contact._replace(friction=1e-9)), work)(0.0, equilibrium.state)
    moment = 0.0
    for wheelset in range(4):
        for side in range(2):
            for row in work.patches[wheelset, side, : work.counts[wheelset, side]]:
                angle = row[reduction.ANGLE]
                across, up = row[reduction.NORMAL] * np.array([-np.sin(angle), np.cos(angle)])
                moment += row[reduction.Y] * up - row[reduction.Z] * across
    centres = equilibrium.state[: STATE_SIZE * 7].reshape(7, STATE_SIZE)[:, 1]
    assert moment == pytest.approx(GRAVITY * scene.vehicle.bodies.mass @ centres, rel=1e-6)
    assert moment == pytest.approx(CAR * y, rel=0.02)  # the wheelsets give way by a millimetre or so
    assert np.all(loads[:, 0] > 1.05 * loads[:, 1])


def test_a_vehicle_without_enough_preload_sinks_onto_its_springs(equilibrium_of):
    data = copy.deepcopy(TRAILER)
    for item in data["elements"]:
        if item["name"].startswith("secondary_spring"):
            item["preload"] = [0.0, 0.0, 0.0]
    scene, _, equilibrium = equilibrium_of(data)
    found, nominal = heights(scene, equilibrium), heights(*equilibrium_of(TRAILER)[::2])
    sunk = {name: nominal[name] - found[name] for name in found}
    # four secondary springs of 430 kN/m, eight primary springs of 1.22 MN/m that were preloaded for the bogies alone
    assert sunk["bogie_1"] == pytest.approx(CAR / 8 / 1.22e6, rel=1e-6)
    assert sunk["car_body"] - sunk["bogie_1"] == pytest.approx(CAR / 4 / 430e3, rel=1e-6)
    np.testing.assert_allclose(equilibrium.wheel_loads, 54546.05, rtol=1e-6)


def test_a_bogie_under_a_frame_that_carries_load(equilibrium_of):
    # the front half: the car body's weight comes from the moving frame, as a stated preload
    data = copy.deepcopy(TRAILER)
    keep = ("bogie_1", "wheelset_1", "wheelset_2", "axle_box_1_left", "axle_box_1_right", "axle_box_2_left",
            "axle_box_2_right")  # fmt: skip
    data["bodies"] = {name: part for name, part in data["bodies"].items() if name in keep}
    data["elements"] = [
        item for item in data["elements"] if all(name in keep for name in item["bodies"])
    ] + [
        {"name": f"load_{side}", "kind": "spring_damper", "bodies": ["bogie_1", "frame"], "at": [9.5, y, 0.8275],
         "stiffness": [160e3, 160e3, 430e3], "preload": [0.0, 0.0, -CAR / 4]}
        for side, y in (("left", 1.0), ("right", -1.0))
    ]  # fmt: skip
    scene, _, equilibrium = equilibrium_of(data)
    # the springs to the frame stretch by the wheelsets' lowering of about 0.2 mm and carry that much less
    lowered = scene.vehicle.positions[0, 2] - heights(scene, equilibrium)["bogie_1"]
    weight = CAR / 2 + (2615 + 2 * 1813) * GRAVITY - 2 * 430e3 * lowered
    np.testing.assert_allclose(equilibrium.wheel_loads, weight / 4, rtol=1e-6)
    assert 0.0 < lowered < 3e-4


@pytest.mark.parametrize("path", ["tangent", "[{tangent: 100}]"])
def test_the_start_stands_on_rails_that_are_out_of_line(tmp_path, path):
    # 3 mm to the left, 5 mm up, the left rail 4 mm above the right one, all along the vehicle: each wheel has its
    # static load, axle boxes stay where their joints hold them
    names = "s_m,alignment_m,level_m,cross_level_m\n"
    rows = "".join(f"{s},{0.003},{0.005},{0.004}\n" for s in range(-60, 61, 2))
    (tmp_path / "offset.csv").write_text(names + rows)
    scene = load_scene(ELLIPTIC / "trailer_vehicle.yaml", [
        "contact.creep.model=linear", "initial.y=0.002", "initial.yaw=0.003", f"track.path={path}",
        f"track.irregularity={{points: {tmp_path / 'offset.csv'}, fade_in: 30, fade_out: 30}}",
        "vehicle.axle_boxes=true",
    ])  # fmt: skip
    model, state = compile_scene(scene)
    loads = wheel_loads(Equations(model._replace(contact=model.contact._replace(friction=1e-9, law=2))), state)
    np.testing.assert_allclose(loads, 54546, rtol=3e-3)  # rolling at 20 m/s, yawed by 3 mrad: approach speeds, damping
    names = scene.vehicle.body_names
    for k in range(1, 5):
        for side, y in (("left", 1.0), ("right", -1.0)):
            box, axle = (
                state[STATE_SIZE * names.index(name) : STATE_SIZE * (names.index(name) + 1)]
                for name in (f"axle_box_{k}_{side}", f"wheelset_{k}")
            )
            np.testing.assert_allclose(box[:3], axle[:3] + y * matrix_of(axle[3:7])[:, 1], atol=1e-12)
            assert axle[1] == pytest.approx(0.002 + 0.003, abs=1e-9)


VEHICLES = ("wheelset", "suspended_wheelset", "trailer_vehicle")


@pytest.mark.parametrize("name", VEHICLES)
@pytest.mark.parametrize("speed", [20.0, 60.0])
def test_a_centred_run_begins_in_steady_running(name, speed):
    # explicit methods at their stability limit leave a noise of the size of the tolerance
    settings = {"duration": 0.1, "rtol": 1e-10}  # 1e-12 m, times the stiffness of a contact, 1e9 N/m
    run = wr.simulate(ELLIPTIC / f"{name}.yaml", speed=speed, initial={"y": 0.0}, integration=settings)
    for group in (group for group in run.keys() if "/" in group):
        load = np.nansum(run[group].N_N, axis=1)
        assert np.ptp(load) < 1e-6 * load.mean(), group
        assert np.abs(np.nansum(run[group].Fy_N, axis=1)).min() > 0.01 * load.mean()  # of spin


@pytest.mark.parametrize("name", VEHICLES)
@pytest.mark.parametrize("boxes", [False, True])
def test_a_moved_wheelset_begins_at_rest_vertically_in_roll_and_about_its_axle(name, boxes):
    changes = {"initial": {"y": 0.002, "yaw": 0.001}}
    if name == "trailer_vehicle":
        changes["vehicle"] = {"axle_boxes": boxes}
    model, state = compile_scene(load_scene(ELLIPTIC / f"{name}.yaml", **changes))
    rates = Equations(model)(0.0, state)
    for body in model.bodies.wheelsets:
        part, rate = (row[STATE_SIZE * body : STATE_SIZE * (body + 1)] for row in (state, rates))
        about = matrix_of(part[3:7])[:, 1] @ rate[10:13]
        np.testing.assert_allclose([rate[9], rate[10], about], 0.0, atol=1e-6)
        assert abs(rate[8]) > 1e-2  # sideways nothing holds it
        assert part[1] == pytest.approx(0.002, abs=1e-12)


def test_without_friction_wheels_begin_at_pure_rolling():
    changes = {"contact": {"friction": 1e-9, "creep": {"model": "she"}}, "initial": {"y": 0.002, "yaw": 0.05}}
    _, state = compile_scene(load_scene(ELLIPTIC / "suspended_wheelset.yaml", **changes))
    assert np.linalg.norm(state[10:13]) == pytest.approx(20.0 / 0.46, rel=0.02)


def test_a_train_begins_as_its_vehicles_do():
    changes = ["initial.y=0", "contact.creep.model=she"]
    train = ["vehicle.count=2", "vehicle.spacing=30"]
    alone, both = (
        compile_scene(load_scene(ELLIPTIC / "trailer_vehicle.yaml", [*changes, *more]))[1] for more in ([], train)
    )
    size = 7 * STATE_SIZE
    bodies = both[: 2 * size].reshape(2, 7, STATE_SIZE)[:, :, 1:]
    np.testing.assert_allclose(bodies, [alone[:size].reshape(7, STATE_SIZE)[:, 1:]] * 2, atol=1e-10)
