"""The metro car: a vehicle that data alone describes."""

import numpy as np
import pytest

from tests.conftest import SCENES
from wrcore.bodies.body import STATE_SIZE
from wrcore.run.simulate import simulate
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene, static_equilibrium
from wrcore.vehicle.description import GRAVITY


def test_seventeen_bodies_stand_evenly_on_eight_wheels():
    scene = load_scene(SCENES / "metro_car.yaml")
    model, _ = compile_scene(scene)
    assert len(scene.vehicle.body_names) == 17
    assert scene.vehicle.joints.equations == 10 * 5  # eight axle boxes and two centre pivots
    # masses of GZ18: car body, two bogies with their wheelsets
    equilibrium = static_equilibrium(scene, model)
    np.testing.assert_allclose(equilibrium.wheel_loads, (30549 + 2 * 8900) * GRAVITY / 8, rtol=1e-6)
    lowered = equilibrium.state[: 17 * STATE_SIZE].reshape(17, STATE_SIZE)[:, 2] - scene.vehicle.positions[:, 2]
    np.testing.assert_allclose(lowered, lowered[0], atol=1e-8)


@pytest.mark.parametrize("axle_boxes", [True, False])
def test_ten_seconds_on_irregular_track(axle_boxes):
    scene = load_scene(SCENES / "metro_car.yaml", [f"vehicle.axle_boxes={str(axle_boxes).lower()}"])
    result = simulate(scene)
    assert result.status == "completed" and result.t[-1] == 10.0
    car, axle = result["car_body"], result["wheelset_1"]
    assert np.abs(axle.y_m).max() < 0.01  # within the flanges' play and what the track is out of line
    assert 1e-3 < np.ptp(car.z_m) < 0.03  # it does ride on its springs
