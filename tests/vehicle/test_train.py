"""Trains: each vehicle moves as it does alone."""

import numpy as np
import pytest

from tests.conftest import ELLIPTIC
from wrcore.balance.equilibrium import solve_equilibrium
from wrcore.bodies.body import STATE_SIZE
from wrcore.creep.laws import LAWS
from wrcore.equations.equations_of_motion import Equations
from wrcore.errors import InputError
from wrcore.run.simulate import simulate
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene, static_equilibrium
from wrcore.track.track import TrackModel

COUPLED = ["vehicle.count=3", "vehicle.spacing=26"]


@pytest.mark.parametrize("boxes", ["true", "false"])
def test_vehicles_of_a_train_accelerate_as_alone(boxes):
    overrides = ["speed=60", f"vehicle.axle_boxes={boxes}", "initial.yaw=0.002"]
    alone, start = compile_scene(load_scene(ELLIPTIC / "trailer_vehicle.yaml", overrides))
    train, starts = compile_scene(load_scene(ELLIPTIC / "trailer_vehicle.yaml", [*overrides, *COUPLED]))
    n = len(alone.bodies.mass)
    assert len(train.bodies.mass) == 3 * n
    one, all_three = (Equations(m)(0.0, s) for m, s in ((alone, start), (train, starts)))
    for k in range(3):
        own = slice(STATE_SIZE * n * k, STATE_SIZE * n * (k + 1))
        shifted = starts[own].copy()
        shifted[::STATE_SIZE] += 26.0 * k
        np.testing.assert_allclose(shifted, start[: STATE_SIZE * n], rtol=0, atol=1e-12)
        # rates are differences of spring forces at 26 m and 52 m down the track: rounding of 1e-14 m times 3e7 N/m
        np.testing.assert_allclose(all_three[own], one[: STATE_SIZE * n], rtol=1e-9, atol=1e-8)


def test_equilibrium_of_a_train_is_that_of_its_vehicles():
    scene = load_scene(ELLIPTIC / "suspended_wheelset.yaml", ["vehicle.count=3", "vehicle.spacing=2.5"])
    model, _ = compile_scene(scene)
    equilibrium = static_equilibrium(scene, model)
    contact = model.contact._replace(friction=1e-9, law=LAWS["she"])
    level = model._replace(contact=contact, track=TrackModel(True, model.track.path, model.track.irregularity))
    solved = solve_equilibrium(level, equilibrium.state)
    assert solved.residual < 1e-8
    np.testing.assert_allclose(solved.wheel_loads, equilibrium.wheel_loads, rtol=1e-9)


def test_vehicles_run_one_behind_the_other():
    """On tangent track every vehicle repeats the first one's motion; steps are common to all."""
    overrides = ["speed=60", "integration.duration=0.3", "integration.rtol=1e-8", "integration.atol=1e-11"]
    alone = simulate(load_scene(ELLIPTIC / "suspended_wheelset.yaml", overrides))
    train = simulate(
        load_scene(ELLIPTIC / "suspended_wheelset.yaml", [*overrides, "vehicle.count=2", "vehicle.spacing=3"])
    )
    for k in (1, 2):
        wheelset = train[f"vehicle_{k}_wheelset"]
        np.testing.assert_allclose(wheelset.y_m, alone["wheelset"].y_m, rtol=0, atol=1e-9)
        np.testing.assert_allclose(wheelset.x_m + 3.0 * (k - 1), alone["wheelset"].x_m, rtol=0, atol=1e-9)


def test_one_vehicle_is_no_train():
    scene = load_scene(ELLIPTIC / "trailer_vehicle.yaml", ["vehicle.count=1"])
    assert scene.vehicle.unit is None
    assert scene.vehicle.body_names[0] == "car_body"


@pytest.mark.parametrize(
    ("overrides", "field", "expected"),
    [
        (["vehicle.count=2"], "vehicle.spacing", "expected a distance in m, as vehicle.count is 2"),
        (["vehicle.count=2", "vehicle.spacing=20"], "vehicle.spacing", "more than the 21.56 m between the outermost"),
        (["vehicle.count=2", "vehicle.spacing=0"], "vehicle.spacing", "above 0"),
        (["vehicle.count=0"], "vehicle.count", "1 to 1000"),
        (["vehicle.count=1.5"], "vehicle.count", "1 to 1000"),
    ],
)
def test_bad_trains_are_refused(overrides, field, expected):
    with pytest.raises(InputError, match=expected) as error:
        load_scene(ELLIPTIC / "trailer_vehicle.yaml", overrides)
    assert error.value.field == field
