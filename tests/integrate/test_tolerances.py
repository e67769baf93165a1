"""What one number buys: the same error on straight track and in curves, for one vehicle and for a train."""

import numpy as np
import pytest

from tests.conftest import SCENES
from wrcore.dynamics.body import STATE_SIZE
from wrcore.integrate.integrator import METHODS, integrate
from wrcore.integrate.tolerances import LENGTH, RATE, SHARE, step_tolerances
from wrcore.scene.description import compile_scene, load_scene

ROUGH = {"spectrum": {"level": "low", "seed": 1, "length": 300.0, "begin": 20.0}}
TRACKS = {
    "straight": {"speed": 20.0},
    "R 600": {"speed": 25.0, "track.path": [{"transition": 60.0}, {"curve": 300.0, "radius": 600.0, "cant": 0.1}]},
}


def test_tolerances_by_kind():
    """A wheelset: all from 1e-4 of 1 cm, and atol on top; own states of elements count as positions."""
    model, _ = compile_scene(load_scene(SCENES / "suspended_wheelset.yaml"))
    lever = np.sqrt(1120.0 / 1813.0)  # roll and yaw moment of inertia, mass
    bound = 1e-4 * LENGTH
    rate = 20.0 / 0.75  # at 20 m/s; RATE above 22.5 m/s
    expected = [bound] * 3 + [bound / (2 * lever)] * 4 + [rate * bound] * 3 + [rate * bound / lever] * 3
    np.testing.assert_allclose(step_tolerances(model, 1e-4), expected, rtol=1e-12)
    np.testing.assert_allclose(step_tolerances(model, 1e-4, 2 * bound), 3 * np.array(expected), rtol=1e-12)
    fast = step_tolerances(model._replace(speed=60.0), 1e-4)
    np.testing.assert_allclose(fast[7:10], RATE * bound, rtol=1e-12)
    for method in METHODS:
        share = SHARE.get(method, 1.0)
        np.testing.assert_allclose(step_tolerances(model, 1e-4, 0.0, method), share * np.array(expected), rtol=1e-12)
    metro, start = compile_scene(load_scene(SCENES / "metro_car.yaml"))
    found = step_tolerances(metro, 1e-4)
    assert len(found) == len(start) and np.all(found[STATE_SIZE * len(metro.bodies.mass) :] == bound)


@pytest.mark.parametrize("method", METHODS)
def test_the_default_keeps_wheelsets_within_a_micrometre(method):
    """Every method, on irregular rails, straight and in a curve: at most 1 um over the run, and not for nothing."""
    for track in TRACKS.values():
        scene = load_scene(SCENES / "trailer_vehicle.yaml", {**track, "track.irregularity": ROUGH})
        model, start = compile_scene(scene)
        times = np.linspace(0.0, 3.0, 61)
        exact = integrate(model, start, times, "tsit5", 1e-9).states
        places = np.ravel([STATE_SIZE * body + np.arange(1, 3) for body in model.bodies.wheelsets])
        run = integrate(model, start, times, method)
        assert np.sqrt(np.mean((run.states - exact)[:, places] ** 2)) < 1e-6
        assert run.steps < 4000


def test_a_train_is_integrated_as_accurately_as_its_vehicles():
    """Three coaches far apart take as many steps as one: the body that errs most counts, not the mean of all."""
    steps = []
    for count in (1, 3):
        more = {"vehicle.count": count, "vehicle.spacing": 40.0} if count > 1 else {}
        scene = load_scene(SCENES / "trailer_vehicle.yaml", {"speed": 20.0, **more})
        steps.append(integrate(*compile_scene(scene), [0.0, 2.0], "rodas4", 1e-5).steps)
    assert abs(steps[1] - steps[0]) <= 2
