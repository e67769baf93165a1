"""Values of a vehicle that a scene changes: what is asked for and nothing else, or one line with the nearest name."""

import copy
import re

import pytest
import yaml

import wrcore as wr
from tests.conftest import ELLIPTIC, ROOT
from wrcore.errors.checked_yaml import parse_value
from wrcore.errors.schema_keys import unit_of_key

TRAILER, VEHICLE = ELLIPTIC / "trailer_vehicle.yaml", ROOT / "config/vehicles/trailer_vehicle.yaml"


def content(*overrides, **changes):
    """What the trailer vehicle is with changes: its checked content, elements by name."""
    data = copy.deepcopy(wr.load_scene(TRAILER, overrides, **changes).vehicle.data)
    return data | {group: {item["name"]: item for item in data[group]} for group in ("elements", "joints")}


PLAIN = content()


def differing(changed):
    """Keys by their paths that are not those of the file."""
    found = {}
    for group in ("bodies", "elements", "joints"):
        for name, item in changed[group].items():
            found |= {f"{group}.{name}.{key}": v for key, v in item.items() if v != PLAIN[group][name].get(key)}
    return found


def test_one_number_by_name():
    assert differing(content("vehicle.bodies.car_body.mass=40000")) == {"bodies.car_body.mass": 40000}
    one = "vehicle.elements.primary_spring_1_left.stiffness"
    name = one.removeprefix("vehicle.")
    assert differing(content(f"{one}=[1e7, 2e6, 3e6]")) == {name: [1e7, 2e6, 3e6]}
    x, y, _ = PLAIN["elements"]["primary_spring_1_left"]["stiffness"]
    assert differing(content(f"{one}.z=3e6")) == differing(content(f"{one}.2=3e6")) == {name: [x, y, 3e6]}
    inertia = PLAIN["bodies"]["car_body"]["inertia"]
    assert differing(content("vehicle.bodies.car_body.inertia.roll.factor=2")) == {
        "bodies.car_body.inertia": inertia | {"roll": 2 * inertia["roll"]}
    }


def test_a_pattern_and_a_factor():
    """All primary springs, their vertical stiffness alone; a name comes after the pattern that it belongs to."""
    springs = [f"primary_spring_{k}_{side}" for k in range(1, 5) for side in ("left", "right")]
    x, y, z = PLAIN["elements"][springs[0]]["stiffness"]
    found = differing(content("vehicle.elements.primary_spring_*.stiffness.z.factor=1.5"))
    assert found == {f"elements.{name}.stiffness": [x, y, 1.5 * z] for name in springs}
    found = differing(content("vehicle.elements.primary_spring_*.stiffness.factor=2"))
    assert found == {f"elements.{name}.stiffness": [2 * x, 2 * y, 2 * z] for name in springs}
    both = ["vehicle.elements.primary_spring_4_right.stiffness.factor=3", "vehicle.elements.*spring_*.stiffness.z=1e6"]
    assert content(*both)["elements"]["primary_spring_4_right"]["stiffness"] == [3 * x, 3 * y, 3e6]
    assert content(*both[::-1]) == content(*both)
    dampers = [name for name, item in PLAIN["elements"].items() if "damping" in item]
    assert {key.split(".")[1] for key in differing(content("vehicle.elements.*.damping.factor=0.9"))} == set(dampers)


def test_a_changed_scene_says_so_and_is_read_again_as_it_is():
    changes = {"elements": {"primary_spring_*": {"stiffness": {"factor": 1.5}}}}
    scene = wr.load_scene(TRAILER, vehicle=changes)
    assert scene.data["vehicle"]["elements"] == changes["elements"]
    again = wr.load_scene(scene, vehicle__parameters=str(VEHICLE))
    assert again.vehicle.data == scene.vehicle.data != wr.load_scene(TRAILER).vehicle.data


def test_a_vehicle_as_content():
    given = yaml.safe_load(VEHICLE.read_text())
    scene = wr.load_scene(TRAILER, {"vehicle.parameters": given})
    assert scene.vehicle.data == wr.load_scene(TRAILER).vehicle.data
    lighter = wr.load_scene(scene, vehicle__bodies__car_body__mass__factor=0.5)
    assert lighter.vehicle.data["bodies"]["car_body"]["mass"] == 16000.0
    given["bodies"]["car_body"]["mass"] = -1.0
    with pytest.raises(wr.InputError, match=r"vehicle.parameters: bodies.car_body.mass: expected a mass in kg"):
        wr.load_scene(TRAILER, {"vehicle.parameters": given})


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("vehicle.elements.primary_sprin_1_left.stiffness=3", "did you mean 'primary_spring_1_left'?"),
        ("vehicle.elements.primary_sprin_*.stiffness=3", "primary_sprin_*: expected one of primary_spring_1_left, "),
        ("vehicle.elements.primary_*.stifness=3", "primary_*.stifness: expected one of at, bodies, damping,"),
        ("vehicle.elements.primary_*.stifness=3", "did you mean 'stiffness'?"),
        ("vehicle.elements.primary_spring_1_left.stifness=3", "did you mean 'stiffness'?"),
        ("vehicle.bodies.car_body.mas=3", "bodies.car_body.mas: unknown key"),
        ("vehicle.bodies.car_body.mass=-3", "vehicle.bodies.car_body.mass: expected a mass in kg, above 0"),
        ("vehicle.bodies.car_body.mass.factor=heavy", "mass.factor: expected -1e+06 to 1e+06, got 'heavy'"),
        ("vehicle.bodies.car_body.kind.factor=2", "kind.factor: expected numbers to multiply in the file, got 'body'"),
        ("vehicle.bodies.car_body.masses.factor=2", "expected numbers to multiply in the file, got None"),
        ("vehicle.bodies.car_body.position.w=2", "position.w: expected one of x, y, z of three numbers"),
        ("vehicle.elemnts.x.stiffness=3", "did you mean 'elements'?"),
        ("vehicle.elements.primary_spring_1_left=3", "elements.primary_spring_1_left: expected"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_one_line(override, message):
    with pytest.raises(wr.InputError) as caught:
        wr.load_scene(TRAILER, [override])
    assert str(caught.value).startswith("--set: vehicle.") and message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_units_of_changes():
    for path, unit in (
        ("vehicle.bodies.car_body.mass", "kg"), ("vehicle.bodies.car_body.inertia.yaw", "kg m^2"),
        ("vehicle.bodies.car_body.position.z", "m"), ("vehicle.elements.spring_*.preload", "N"),
        ("vehicle.elements.spring_*.stiffness.factor", "1"), ("vehicle.elements", ""), ("vehicle.bodies.a.nothing", ""),
    ):  # fmt: skip
        assert unit_of_key(path) == unit, path


def test_a_scene_with_changes_is_read_as_the_page_writes_it():
    text = (ROOT / "reports" / "vehicle_files.md").read_text("utf-8")
    (block,) = re.findall(r"## Changes in a scene.*?```yaml\n(.*?)```", text, re.DOTALL)
    scene = wr.load_scene(TRAILER, parse_value(block))
    plain = wr.load_scene(TRAILER).vehicle
    body = scene.vehicle.data["bodies"]["car_body"]
    assert body["mass"] == 40000.0 and body["position"] == [0.0, 0.0, 1.9]
    springs = [(a, b) for a, b in zip(scene.vehicle.data["elements"], plain.data["elements"], strict=True) if a != b]
    assert len(springs) == 8 and springs[0][0]["stiffness"][2] == 1.2 * springs[0][1]["stiffness"][2]
