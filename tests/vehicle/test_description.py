"""Vehicle files: what bodies become, and one line that names the element for whatever is wrong."""

import numpy as np
import pytest

from tests.conftest import ELLIPTIC
from tests.vehicle.conftest import element
from wrcore.cli import main
from wrcore.errors import InputError
from wrcore.scene.description import load_scene
from wrcore.vehicle.description import build_vehicle


def test_lumped_axle_boxes_make_up_the_published_wheelset(trailer):
    # Manchester vehicle 1: wheelset 1813 kg, 1120 kg m^2 in roll and yaw, 112 kg m^2 in pitch; 44 482 kg in all
    vehicle = build_vehicle(trailer, "trailer", axle_boxes=False)
    assert len(vehicle.body_names) == 7
    for body in vehicle.bodies.wheelsets:
        assert vehicle.bodies.mass[body] == pytest.approx(1813.0)
        np.testing.assert_allclose(vehicle.bodies.inertia[body], [1120.0, 112.0, 1120.0])
    assert vehicle.bodies.mass.sum() == pytest.approx(44482.0)


def test_wheelsets_are_numbered_from_the_front_wherever_they_stand_in_the_file(trailer):
    trailer["bodies"] = dict(reversed(trailer["bodies"].items()))
    vehicle = build_vehicle(trailer, "trailer", axle_boxes=False)
    assert vehicle.wheelset_names == ("wheelset_1", "wheelset_2", "wheelset_3", "wheelset_4")


def test_templates_hold_anchors_and_nothing_else(trailer):
    trailer["templates"] = {"spring": {"stiffness": "whatever"}}
    assert build_vehicle(trailer, "trailer", axle_boxes=False).elements.springs.shape == (15, 15)


@pytest.mark.parametrize("name", ["t", "end", "energy", "drive", "control"])
def test_a_body_named_as_a_part_of_runs_is_refused(trailer, name):
    trailer["bodies"][name] = trailer["bodies"].pop("car_body")
    with pytest.raises(InputError, match=f"expected another name, as {name} stands for ") as caught:
        build_vehicle(trailer, "trailer", axle_boxes=False)
    assert (caught.value.source, caught.value.field) == ("trailer", f"bodies.{name}")


def set_in(element_name, /, **keys):
    """A change of an element's keys; None takes one away."""

    def change(data):
        item = element(data, element_name)
        for key, value in keys.items():
            if value is None:
                del item[key]
            else:
                item[key] = value

    return change


def set_body(name, **keys):
    return lambda data: data["bodies"][name].update(keys)


def with_joint(**joint):
    return lambda data: data.update(joints=[{"name": "pivot", "kind": "spherical", **joint}])


def add(**item):
    return lambda data: data["elements"].append({"name": "new", "bodies": ["car_body", "bogie_1"], **item})


CAR_ON_WHEELSET = {"bodies": ["wheelset_1", "bogie_1"], "at": [10.78, 1.0, 0.46]}
DAMPER = "primary_damper_1_left"
FALLING = {"velocity": [0.0, 0.1, 0.2], "force": [0.0, 300.0, 200.0]}
BAD = [
    # keys of the wrong kind, missing keys, wrong shapes
    (set_in("coupler", gap=0.1), "elements.coupler.gap", "unknown for kind spring_damper"),
    (set_in("coupler", k=1.0), "elements.coupler.k", "unknown for kind spring_damper"),
    (set_in("coupler", kind="spring"), "elements.coupler.kind", "spring_damper"),
    (set_in("coupler", at=None), "elements.coupler.at", "spring_damper needs one"),
    (set_in("coupler", kind=None), "elements.coupler.kind", "the key is missing"),
    (set_in("coupler", stiffness=None, damping=None), "elements.coupler", "expected one of stiffness"),
    (set_in("coupler", at=[0.0, 1.8]), "elements.coupler.at", "a point [x, y, z] in m"),
    (set_in("coupler", stiffness=[1.0, 2.0]), "elements.coupler.stiffness", "three numbers [x, y, z]"),
    (set_in("coupler", stiffness=1.0e6), "elements.coupler.stiffness", "three numbers [x, y, z]"),
    (set_in("coupler", stiffness=[1e6, -1.0, 0]), "elements.coupler.stiffness.1", "none negative: stiffnesses in N/m"),
    (set_in("anti_roll_bar_1", stiffness=-1.0), "elements.anti_roll_bar_1.stiffness", "N m/rad, not negative, got -1"),
    (set_in("coupler", stiffness="1 MN/m"), "elements.coupler.stiffness", "in N/m, got '1 MN/m'"),
    (set_in("coupler", preload=[0, 0, float("inf")]), "elements.coupler.preload.2", "finite"),
    (set_in("anti_roll_bar_1", stiffness=[1.0, 0, 0]), "elements.anti_roll_bar_1.stiffness", "a stiffness in N m/rad"),
    (set_in(DAMPER, direction=None), f"elements.{DAMPER}.damping", "without a direction"),
    (set_in(DAMPER, damping=[0.0, 0.0, 1.0]), f"elements.{DAMPER}.damping", "with a direction"),
    (set_in(DAMPER, damping=None), f"elements.{DAMPER}", "either damping or characteristic"),
    (set_in(DAMPER, damping=0.0), f"elements.{DAMPER}.series_stiffness", "above 0"),
    (set_in(DAMPER, series_stiffness=0), f"elements.{DAMPER}.series_stiffness", "above 0"),
    (set_in(DAMPER, damping=None, series_stiffness=0.0, characteristic={"velocity": [0, 1], "force": [0, 2]}),
     f"elements.{DAMPER}.series_stiffness", "above 0"),
    (set_in("lateral_bump_stop_1", gap=0.02), "elements.lateral_bump_stop_1", "either a characteristic"),
    (set_in("lateral_bump_stop_1", characteristic=None), "elements.lateral_bump_stop_1", "gap and stiffness"),
    (add(kind="friction", at=[9.5, 0, 0.7], direction="y", force=1e3), "elements.new.series_stiffness", "needs one"),
    (add(kind="friction", at=[9.5, 0, 0.7], direction="y", mu=0.1, normal="coupler", approach=1e-3),
     "elements.new.normal", "between the same two bodies"),
    (add(kind="bushing", at=[9.5, 0, 0.7], cubic_stiffness=[1e9, -1.0, 0.0]), "elements.new.cubic_stiffness.1", "-1"),
    (add(kind="bushing", at=[9.5, 0, 0.7]), "elements.new", "expected one of stiffness"),
    (add(kind="traction_rod", at=[9.5, 0, 0.6], stiffness=5e6), "elements.new.at", "two points at least 1 mm apart"),
    (add(kind="damper", at=[9.5, 0, 0.6], direction="line", damping=5e3), "elements.new.at", "two points"),
    # characteristics
    (set_in("secondary_lateral_damper_1", damping=None, characteristic=FALLING),
     "elements.secondary_lateral_damper_1.characteristic.force", "do not fall"),
    (set_in("lateral_bump_stop_1", characteristic={"displacement": [0.0, 0.1, 0.1], "force": [0, 1, 2]}),
     "elements.lateral_bump_stop_1.characteristic.displacement", "strictly rising"),
    (set_in("lateral_bump_stop_1", characteristic={"displacement": [0.0, 0.1], "force": [0, 1, 2]}),
     "elements.lateral_bump_stop_1.characteristic", "got 3 and 2"),
    (set_in("lateral_bump_stop_1", characteristic={"velocity": [0.0, 0.1], "force": [0, 1]}),
     "elements.lateral_bump_stop_1.characteristic.velocity", "displacement, force"),
    (set_in("secondary_lateral_damper_1", damping=None, characteristic={"velocity": [0, 1], "force": [2, 2]}),
     "elements.secondary_lateral_damper_1.characteristic.force", "rise somewhere"),
    # bodies of an element
    (set_in("coupler", bodies=["car_body", "track"]), "elements.coupler.bodies", "one of frame, car_body"),
    (set_in("coupler", bodies=["frame", "car_body"]), "elements.coupler.bodies", "frame as the second"),
    (set_in("coupler", bodies=["car_body"]), "elements.coupler.bodies", "two body names"),
    (set_in("coupler", bodies=["car_body", "car_body"]), "elements.coupler.bodies", "two different bodies"),
    (add(kind="spring_damper", bodies=["wheelset_1", "axle_box_1_left"], at=[10.78, 1, 0.46], stiffness=[1, 1, 1]),
     "elements.new.bodies", "two different bodies"),
    # wheelsets turn
    (add(**{**CAR_ON_WHEELSET, "at": [10.5, 1.0, 0.46]}, kind="spring_damper", stiffness=[1e3, 0, 0]),
     "elements.new.at", "on the axle of wheelset_1, x = 10.78 and z = 0.46"),
    (set_in("primary_spring_1_left", at=[10.48, 1.0, 0.46]), "elements.primary_spring_1_left.at", "on the axle"),
    (add(**CAR_ON_WHEELSET, kind="spring_damper", rotation_stiffness=[0, 1e3, 0]),
     "elements.new.rotation_stiffness", "in which the wheelset turns"),
    (add(**CAR_ON_WHEELSET, kind="spring_damper", rotation_damping=[0, 1e3, 0]),
     "elements.new.rotation_damping", "in which the wheelset turns"),
    (add(kind="spring_damper", bodies=["wheelset_1", "wheelset_2"], at=[10.78, 1.0, 0.46], stiffness=[1e3, 0, 0]),
     "elements.new", "between two wheelsets"),
    # names
    (set_in("coupler", name="traction_rod_1"), "elements.traction_rod_1", "a name of its own"),
    (set_in("coupler", name=None), "elements.32.name", "the key is missing"),
    (lambda data: data["bodies"].update(CarBody=data["bodies"]["car_body"]), "bodies", "lower-case letters"),
    # bodies
    (set_body("car_body", rolling_radius=0.46), "bodies.car_body.rolling_radius", "unknown for kind body"),
    (set_body("wheelset_2", rolling_radius=0.45), "bodies.wheelset_2.rolling_radius", "0.46 as for wheelset_1"),
    (set_body("wheelset_2", position=[8.22, 0.0, 0.42]), "bodies.wheelset_2.position", "of the rolling radius"),
    (set_body("axle_box_1_left", wheelset="bogie_1"), "bodies.axle_box_1_left.wheelset", "expected a wheelset"),
    (set_body("bogie_1", inertia={"roll": 1.0, "pitch": 1.0}), "bodies.bogie_1.inertia.yaw", "the key is missing"),
    # nothing carries a body
    (lambda data: data.update(elements=[e for e in data["elements"] if not e["name"].startswith("secondary_spring")]),
     "bodies.car_body", "springs or joints that carry"),
    (lambda data: data["bodies"].update(toilet={**data["bodies"]["bogie_1"], "position": [0.0, 0.0, 1.0]}),
     "bodies.toilet", "springs or joints that carry"),
    # joints
    (with_joint(bodies=["car_body", "bogie_1"]), "joints.pivot", "'at'"),
    (with_joint(bodies=["car_body", "bogie_3"], at=[9.5, 0, 0.6]), "joints.pivot.bodies", "one of frame, "),
    (with_joint(kind="hinge", bodies=["car_body", "bogie_1"]), "joints.pivot.kind", "'spherical'"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("change", "field", "expected"), BAD, ids=[f"{field}-{k}" for k, (_, field, _) in enumerate(BAD)]
)
def test_bad_vehicle_files_get_one_line_that_names_the_element(scene_of, trailer, capsys, change, field, expected):
    change(trailer)
    assert main(["simulate", str(scene_of(trailer))]) == 2
    printed = capsys.readouterr().err
    assert printed.count("\n") == 1 and "vehicle.yaml" in printed
    assert f" {field}:" in printed and expected in printed


@pytest.mark.parametrize(
    ("inertia", "told"),
    [
        ({"roll": 1.0, "pitch": 112.0, "yaw": 1120.0}, True),
        ({"roll": 1120.0, "pitch": 112.0, "yaw": 1120.0}, False),
        ({"roll": 1120.0, "pitch": 9e3, "yaw": 1120.0}, False),  # a rotor, by the gear ratio squared
    ],
)
def test_moments_of_inertia_that_no_mass_has_are_told(capsys, inertia, told):
    load_scene(ELLIPTIC / "suspended_wheelset.yaml", {"vehicle.bodies.wheelset.inertia": inertia})
    assert ("bodies.wheelset.inertia: no mass has a moment" in capsys.readouterr().err) == told


def test_a_body_may_have_no_moment_above_the_sum_of_the_others(capsys):
    load_scene(ELLIPTIC / "trailer_vehicle.yaml", {"vehicle.bodies.car_body.inertia.yaw": 9e6})
    assert "car_body.inertia: no mass has a moment of 9e+06 kg m^2" in capsys.readouterr().err
