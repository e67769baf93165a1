"""A two-axle freight wagon on leaf springs and double links: all its damping is friction that grows with the load."""

import numpy as np
import pytest

from tests.conftest import ELLIPTIC, ROOT
from tests.energy_balance import energy_balance
from wrcore.errors.checked_yaml import read_yaml
from wrcore.forces.law import INNER, NUMBERS, PRESSING_SPRING
from wrcore.run.simulate import simulate
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene, static_equilibrium
from wrcore.vehicle.description import GRAVITY

VEHICLES = ROOT / "config" / "vehicles"


def scene_of(load, **changes):
    return load_scene(ELLIPTIC / f"freight_wagon_{load}.yaml", changes)


@pytest.mark.parametrize("load, mass", [("empty", 13.5e3), ("laden", 45e3)])
def test_it_stands_evenly_and_its_friction_grows_with_its_load(load, mass):
    scene = scene_of(load, contact__creep__model="linear")
    model, _ = compile_scene(scene)
    equilibrium = static_equilibrium(scene, model)
    np.testing.assert_allclose(equilibrium.wheel_loads, mass * GRAVITY / 4, rtol=1e-6)
    on_a_spring = scene.vehicle.bodies.mass[0] * GRAVITY / 4
    elements = scene.vehicle.elements
    limits = sorted(elements.directed[elements.law[:, INNER] >= 0, NUMBERS + 1])  # in nominal position
    expected = sorted(4 * [mu * on_a_spring for mu in (0.07, 0.08, 0.14)])
    np.testing.assert_allclose(limits, expected, rtol=1e-6)


def test_both_files_are_the_same_wagon_but_for_its_load():
    empty, laden = (read_yaml(VEHICLES / f"freight_wagon_{load}.yaml") for load in ("empty", "laden"))
    assert empty["elements"] == laden["elements"] and empty["bodies"]["wheelset_1"] == laden["bodies"]["wheelset_1"]


def without_friction(load, folder):
    """The scene with a hundredth of the friction in joints and leaves."""
    data = read_yaml(VEHICLES / f"freight_wagon_{load}.yaml")
    for item in data["elements"]:
        if item["kind"] == "friction":
            item["mu"] *= 0.01
    path = folder / "smooth.yaml"
    path.write_text(repr(data).replace("'", '"'))
    return scene_of(load, vehicle__parameters=str(path))


def test_energy_of_a_hunting_wagon_adds_up_and_its_friction_takes_part():
    changes = {"output.channels": ["pose", "energy"], "output.rate": 5000.0, "integration.rtol": 1e-7}
    changes |= {"speed": 30.0, "integration.method": "rk45", "integration.duration": 3.0}
    found = simulate(load_scene(ELLIPTIC / "freight_wagon_empty.yaml", changes))
    assert found.status == "completed"
    energy = found["energy"]
    balance = energy_balance(energy, found.t)
    assert np.abs(balance.imbalance).max() < 1e-4 * balance.turned_over[-1]
    assert np.trapezoid(energy["dissipated_by_dampers_W"], found.t) > 1.0


def test_friction_in_links_and_leaves_keeps_hunting_small(tmp_path):
    amplitudes = []
    for scene in (scene_of("empty"), without_friction("empty", tmp_path)):
        found = simulate(load_scene(scene, {"speed": 25.0, "integration.duration": 20.0}))
        assert found.status == "completed"
        amplitudes.append(np.ptp(found["wheelset_2"].y_m[found.t > 15.0]) / 2)
    assert 1e-4 < amplitudes[0] < 0.25 * amplitudes[1]


def test_friction_in_a_train_is_pressed_by_its_own_vehicle():
    one, two = scene_of("empty").vehicle, scene_of("empty", vehicle={"count": 2, "spacing": 14.0}).vehicle
    assert two.elements.states == 2 * one.elements.states
    pressed = two.elements.law[two.elements.law[:, INNER] >= 0, PRESSING_SPRING]
    assert sorted(pressed) == sorted(3 * [k for k, row in enumerate(two.elements.springs) if row[8] > 0.0])
