"""A vehicle begins in balance with all its forces, and a symmetric one as symmetric as numbers are."""

import numpy as np
import pytest
import yaml

from tests.conftest import ELLIPTIC, ROOT
from wrcore.bodies.body import STATE_SIZE
from wrcore.contact.search import reduction
from wrcore.equations.equations_of_motion import Equations
from wrcore.forces.drive import undriven
from wrcore.run.simulate import simulate
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene

STRAIGHT = {"contact.creep.model": "she", "initial.y": 0.0, "initial.yaw": 0.0}


def metro_car(folder, independent=False, stiff=False):
    """The metro car, made symmetric; ``stiff``: with primary dampers in series with bushes of 200 MN/m, 60 us."""
    data = yaml.safe_load((ROOT / "config" / "vehicles" / "metro_car.yaml").read_text())
    for item in data["elements"]:
        ends = item.get("at")
        if item["name"].startswith("traction_rod"):
            item["at"] = [[x, 0.0, z] for x, _, z in ends]
        elif item["name"].startswith("lateral_damper"):
            item["at"] = [[np.sign(x) * 7.85, y, z] for x, y, z in ends]
            item["at"] = [[float(value) for value in end] for end in item["at"]]
        elif stiff and item["name"].startswith("primary_damper"):
            item.pop("characteristic", None)
            item |= {"damping": 12e3, "series_stiffness": 2e8}
    for part in data["bodies"].values():
        if independent and part["kind"] == "wheelset":
            part["independent_wheels"] = True
    (folder / "car.yaml").write_text(yaml.safe_dump(data))
    return {"vehicle.parameters": str(folder / "car.yaml")}


def smooth(name, changes):
    """A scene on straight, level and perfect track."""
    return load_scene(
        load_scene(ELLIPTIC / f"{name}.yaml", ["track={gauge: 1.435, path: tangent}"]), STRAIGHT | changes
    )


def beginning(scene):
    """Lateral places, differences of the normal forces left and right, and rates of all velocities and own states."""
    model, state = compile_scene(scene)
    model = undriven(model)
    equations, bodies = Equations(model), STATE_SIZE * len(model.bodies.mass)
    state = state[: bodies + model.elements.states]
    rates = equations(0.0, state)
    work = equations.work
    found = np.arange(reduction.MAX_PATCHES) < work.counts[..., None]
    normal = np.where(found, work.patches[..., reduction.NORMAL], 0.0).sum(axis=2)
    aside = state[1:bodies:STATE_SIZE] - scene.vehicle.positions[:, 1]
    accelerations = rates[:bodies].reshape(-1, STATE_SIZE)[:, 7:]
    return aside, normal[:, 0] - normal[:, 1], accelerations, rates[bodies:]


def asked(name, folder):
    own = {"metro_car": metro_car, "metro_car_independent": lambda folder: metro_car(folder, True)}
    return name.removesuffix("_independent"), own[name](folder) if name in own else {}


VEHICLES = ("suspended_wheelset", "trailer_vehicle", "metro_car", "metro_car_independent", "freight_wagon_laden",
            "freight_wagon_empty", "locomotive")  # fmt: skip


@pytest.mark.parametrize("contact", [("moment", "spatial"), ("maximum", "planar")], ids="-".join)
@pytest.mark.parametrize("name", VEHICLES)
def test_symmetric_vehicles_begin_symmetric_and_in_balance(name, contact, tmp_path):
    # as it was: 3e-12 m, 3e-5 N and, of axle boxes that had lost their pitch, 4e-3 rad/s^2 for the metro car
    scene, own = asked(name, tmp_path)
    changes = {"contact.patch": contact[0], "contact.detection": contact[1], **own}
    aside, apart, accelerations, rates = beginning(smooth(scene, changes))
    assert np.abs(aside).max() < 1e-12
    assert np.abs(apart).max() < 1e-6
    free = 2e-3 if name == "locomotive" else 1e-8  # nothing holds the train along the track: its rolling resistance
    assert np.abs(accelerations[:, 0]).max() < free and np.abs(accelerations[:, 1:]).max() < 1e-8
    assert np.abs(rates).max(initial=0.0) < 1e-9


@pytest.mark.parametrize("name", ["suspended_wheelset", "trailer_vehicle"])
def test_exact_contact_begins_symmetric_too(name):
    # single precision in rolling made 1e-10 m and 2e-4 N of a yaw of 1e-16; it leaves accelerations of 1e-6 to all
    exact = {"contact.patch": "exact", "contact.creep.model": "table"}
    aside, apart, accelerations, rates = beginning(smooth(name, exact))
    assert np.abs(aside).max() < 1e-12
    assert np.abs(apart).max() < 1e-6
    assert np.abs(accelerations).max() < 5e-6 and np.abs(rates).max(initial=0.0) < 1e-9


def test_a_vehicle_that_does_not_begin_symmetric_keeps_its_place(tmp_path):
    # traction rods off the middle: the car of the file stands 0.3 um aside, in balance
    scene = smooth("metro_car", {})
    aside, _, accelerations, _ = beginning(scene)
    assert 1e-8 < np.abs(aside).max() < 1e-6 and np.abs(accelerations).max() < 1e-8


def test_a_stiff_damper_makes_no_transient_on_smooth_straight_track(tmp_path):
    changes = {**metro_car(tmp_path, stiff=True), "integration.duration": 10.0}
    run = simulate(smooth("metro_car", changes), progress=False)
    assert run.status == "completed" and run.counters["steps"] < 300
    assert max(np.abs(run[name].y_m).max() for name in ("car_body", "wheelset_1", "wheelset_4")) < 1e-9
