"""Scenes: defaults, overrides, and one clear line for every kind of bad input."""

import json
import shutil

import numpy as np
import pytest
import yaml

from tests.conftest import ELLIPTIC, ROOT, SCENES
from wrcore.cli import main
from wrcore.contact.search.reduction import ANGLE, FY, NORMAL
from wrcore.equations.equations_of_motion import Equations
from wrcore.equations.model import workspace
from wrcore.errors import InputError
from wrcore.errors.checked_yaml import read_yaml
from wrcore.geometry.profiles.standards import named_profile
from wrcore.scene import compile as scene_compile
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene
from wrcore.vehicle.description import GRAVITY


@pytest.fixture
def scene_file(tmp_path):
    """Write a scene in its own folder, changed by a function, and return its path."""
    (tmp_path / "vehicles").mkdir()
    for name in ("wheelset", "suspended_wheelset"):
        shutil.copy(ROOT / "config" / "vehicles" / f"{name}.yaml", tmp_path / "vehicles")

    def write(change=lambda data: None, vehicle=None):
        data = read_yaml(ELLIPTIC / "suspended_wheelset.yaml")
        change(data)
        path = tmp_path / "scene.yaml"
        path.write_text(yaml.safe_dump(data))
        if vehicle is not None:
            content = read_yaml(tmp_path / "vehicles" / "suspended_wheelset.yaml")
            vehicle(content)
            (tmp_path / "vehicles" / "suspended_wheelset.yaml").write_text(yaml.safe_dump(content))
        return path

    return write


def put(path, value):
    """A change that sets one key."""

    def change(data):
        *parents, last = path.split(".")
        for part in parents:
            data = data.setdefault(part, {}) if not isinstance(data, list) else data[int(part)]
        data[last] = value

    return change


BAD_SCENES = [
    ("contact.frction", 0.3, "contact.frction", "unknown key"),
    ("speed", -3.0, "speed", "m/s, above 0"),
    ("speed", "fast", "speed", "expected a speed"),
    ("speed", True, "speed", "expected a speed"),
    ("speed", float("nan"), "speed", "finite"),
    ("contact.friction", 0.0, "contact.friction", "above 0"),
    ("contact.detection", "3d", "contact.detection", "'planar', 'spatial' or 'auto'"),
    ("wheel.profile", "S1003", "wheel.profile", "S1002"),
    ("wheel.profile", "UIC60-MBench", "wheel.profile", "expected a wheel profile"),
    ("wheel.profile", {"points": "missing.csv"}, "wheel.profile.points", "existing file"),
    ("wheel.profile", "missing.csv", "wheel.profile", "existing file"),
    ("rail.inclination", "1:40", "rail.inclination", "ratio"),
    ("rail.inclination", 40, "rail.inclination", "within 1/5"),
    ("vehicle.parameters", "nowhere.yaml", "vehicle.parameters", "existing file"),
    ("track.gauge", 1435, "track.gauge", "in m"),
    ("integration.duration", 0, "integration.duration", "above 0"),
    ("contact.creep.table", "nowhere.h5", "contact.creep.table", "existing file"),
    ("initial", [1], "initial", "mapping"),
    ("output.channels", ["pose", "colour"], "output.channels.1", "pose, velocity, acceleration, contact"),
]


@pytest.mark.parametrize(("key", "value", "field", "expected"), BAD_SCENES)
def test_bad_scenes_get_one_line_with_file_and_field(scene_file, capsys, key, value, field, expected):
    path = scene_file(put(key, value))
    assert main(["simulate", str(path), "--out", str(path.parent / "run.h5")]) == 2
    printed = capsys.readouterr().err
    assert printed.count("\n") == 1
    assert "scene.yaml" in printed and f" {field}:" in printed and expected in printed
    assert not (path.parent / "run.h5").exists()


BAD_VEHICLES = [
    ("bodies.wheelset.mass", -1.0, "bodies.wheelset.mass", "kg, above 0"),
    ("bodies.wheelset.inertia.yz", 2.0, "bodies.wheelset.inertia.yz", "xz alone"),
    ("bodies.wheelset.rolling_radius", 460, "bodies.wheelset.rolling_radius", "in m"),
    ("elements.0.bodies", ["wheelset", "bogie"], "elements.axle_box_left.bodies", "one of frame, wheelset"),
    ("elements.0.at", [0.1, 1.0, 0.46], "elements.axle_box_left.at", "axle"),
    ("elements.0.stiffness", [1.0, 2.0], "elements.axle_box_left.stiffness", "N/m"),
    ("elements.0.preload", [0, 0, 2e5], "vehicle", "pressed onto the rails"),
    ("joints", [{"name": "j", "kind": "coordinate", "bodies": ["wheelset", "frame"]}], "joints.j", "axis"),
]


@pytest.mark.parametrize(("key", "value", "field", "expected"), BAD_VEHICLES)
def test_bad_vehicles_name_the_element(scene_file, capsys, key, value, field, expected):
    path = scene_file(vehicle=put(key, value))
    assert main(["simulate", str(path)]) == 2
    printed = capsys.readouterr().err
    assert printed.count("\n") == 1 and f" {field}:" in printed and expected in printed


@pytest.mark.parametrize("text", ["", "- 1\n", "a: [", "speed: 1\nspeed: 2\n", "\x00", "? {a: 1}: 2"])
def test_files_that_are_no_scene(tmp_path, capsys, text):
    path = tmp_path / "scene.yaml"
    path.write_text(text)
    assert main(["simulate", str(path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_profile_in_millimetres_and_unordered_points(scene_file, capsys):
    path = scene_file(put("wheel.profile", {"points": "wheel.csv"}))
    u = np.linspace(-60, 60, 121)
    for content, expected in (
        ("u_m,f_m\n" + "\n".join(f"{x},{-0.05 * x}" for x in u), "mm"),
        ("u_m,f_m\n" + "\n".join(f"{1e-3 * x},0.0" for x in [0, 1, 3, 2, 4, 5, 6, 7, 8, 9]), "monotone"),
    ):
        (path.parent / "wheel.csv").write_text(content)
        assert main(["simulate", str(path)]) == 2
        printed = capsys.readouterr().err
        assert printed.count("\n") == 1 and "wheel.csv" in printed and expected in printed


def test_table_for_another_material_is_refused(scene_file, tmp_path, capsys):
    from wrcore.creep.table import ensure_table, write_table

    write_table(tmp_path / "table.h5", ensure_table(0.28, "ellipse"))

    def change(data):
        data["contact"] |= {"creep": {"table": "table.h5"}, "material": {"poisson_ratio": 0.3}}

    path = scene_file(change)
    assert main(["simulate", str(path)]) == 2
    printed = capsys.readouterr().err
    assert "contact.creep.table" in printed and "0.3" in printed and "0.28" in printed


def test_overrides_and_defaults():
    scene = load_scene(SCENES / "wheelset.yaml", ["speed=30", "contact.detection=planar", "integration.rtol=1e-7"])
    assert scene.data["speed"] == 30 and scene.detection == "planar"
    assert scene.data["integration"]["rtol"] == 1e-7  # YAML 1.1 would read 1e-7 as text
    assert scene.data["contact"]["material"] == {"shear_modulus": 8.2e10, "poisson_ratio": 0.28}
    json.dumps(scene.data)
    for bad in ("speed", "=3", "speed.x=3"):
        with pytest.raises(InputError, match="--set"):
            load_scene(SCENES / "wheelset.yaml", [bad])


@pytest.mark.parametrize("name", ["wheelset", "suspended_wheelset"])
def test_a_scene_starts_in_vertical_equilibrium(name):
    scene = load_scene(ELLIPTIC / f"{name}.yaml", ["contact.creep.model=linear"])
    model, state = compile_scene(scene)
    work = workspace(model)
    Equations(model, work)(0.0, state)
    # static wheel load of Manchester vehicle 1: 54 546 N (derived there); the free wheelset's own: 1813 kg g/2
    load = {"wheelset": 1813 * GRAVITY / 2, "suspended_wheelset": 45653 + 1813 * GRAVITY / 2}[name]
    rows = work.patches[0, :, 0]
    vertical = rows[:, NORMAL] * np.cos(rows[:, ANGLE]) + rows[:, FY] * np.sin(rows[:, ANGLE])
    np.testing.assert_allclose(vertical.sum(), 2 * load, rtol=1e-5)
    # off the centre lateral creep forces roll the wheelset: about a wheel's load times their height over the gauge
    np.testing.assert_allclose(vertical, load, rtol=0.05)
    assert load == pytest.approx({"wheelset": 8893, "suspended_wheelset": 54546}[name], rel=1e-4)


def test_rails_named_like_numbers_stay_names_and_numbers_numbers():
    # a person writes 60E1 without quotes; YAML's own rules would make it 600
    changes = ["rail.profile=60E1", "integration.rtol=1e-5", "integration.atol=1E-8"]
    scene = load_scene(SCENES / "wheelset.yaml", changes)
    assert scene.data["rail"]["profile"] == "60E1" and scene.rail.name == "60E1"
    assert (scene.data["integration"]["rtol"], scene.data["integration"]["atol"]) == (1e-5, 1e-8)


def test_the_wheel_on_its_rail_of_a_side():
    worn = "wheel.wheelsets={wheelset_2: {right: {rolling_radius: 0.45}}}"
    scene = load_scene(ELLIPTIC / "trailer_vehicle.yaml", [worn])
    radii = [[scene.pair(side, k).rolling_radius for side in ("left", "right")] for k in range(4)]
    assert radii[1][1] == 0.45 and [left for left, _ in radii] == 4 * [scene.vehicle.rolling_radius]
    assert scene.pair("right", 1).rail_distance == scene.track.rail_distance(scene.rail)
    wrong = {("rihgt",): "did you mean 'right'", ("left", 4): "wheelset", ("left", -1): "wheelset"}
    for arguments, expected in wrong.items():
        with pytest.raises(InputError, match=expected):
            scene.pair(*arguments)


@pytest.mark.parametrize("patch", ["exact", "tabulated"])
@pytest.mark.parametrize("law", ["polach", "linear", "fastsim"])
def test_creep_laws_are_refused_where_contact_has_forces_of_its_own(patch, law):
    expected = "expected 'table' with contact.patch .*; set contact.patch to maximum or moment"
    with pytest.raises(InputError, match=expected) as error:
        load_scene(SCENES / "wheelset.yaml", {"contact.patch": patch, "contact.creep.model": law})
    assert error.value.field == "contact.creep.model"


def test_a_rail_that_ends_above_the_gauge_depth_is_named(tmp_path):
    u = np.linspace(-0.03, 0.03, 61)
    path = tmp_path / "narrow.csv"
    np.savetxt(path, np.column_stack([u, -2.0 * u**2]), delimiter=",", header="u_m,f_m", comments="")
    with pytest.raises(InputError, match="expected a rail down to 0.014 m") as error:
        load_scene(SCENES / "wheelset.yaml", {"rail.profile": str(path), "rail.inclination": 0})
    assert (error.value.source, error.value.field) == (str(path), "gauge")


@pytest.fixture
def upright(tmp_path):
    """File of points of an upright rail, not inclined."""
    curve, path = named_profile("60E1", "rail", 0), tmp_path / "upright.csv"
    np.savetxt(path, np.column_stack([curve.u, curve.f]), delimiter=",", header="u_m,f_m", comments="")
    return str(path)


def test_inclination_beside_points_in_track_pose_is_refused(upright):
    for changes, field in (
        ({"rail": {"profile": upright, "inclination": "1/40"}}, "rail.inclination"),
        ({"rail.profile": upright}, "rail.inclination"),  # beside the inclination of the scene's file
        ({"rail": {"profile": {"points": upright, "inclined": True}, "inclination": "1/40"}}, "rail.inclination"),
        ({"rail.left": {"profile": upright}}, "rail.left.inclination"),  # that of both
        (
            {"rail.left": {"profile": {"points": upright, "inclined": True}, "inclination": 0.05}},
            "rail.left.inclination",
        ),
    ):
        with pytest.raises(InputError, match="inclined: false") as caught:
            load_scene(SCENES / "wheelset.yaml", changes)
        assert caught.value.field == field


def test_inclination_turns_points_that_are_said_to_be_upright(upright):
    turned = {"rail.profile": {"points": upright, "inclined": False}, "rail.inclination": "1/20"}
    named = {"rail": {"profile": "60E1", "inclination": "1/20"}}
    one, other = (load_scene(SCENES / "wheelset.yaml", changes).rail for changes in (turned, named))
    u = np.linspace(-0.02, 0.02, 41)
    np.testing.assert_allclose(one(u), other(u), rtol=0.0, atol=1e-6)
    said = {"rail.left": {"profile": {"points": upright, "inclined": True}}, "track.gauge_depth": 0.01}
    left, right = (pair.rail for pair in load_scene(SCENES / "wheelset.yaml", said).pairs)
    assert abs(left(0.02) - right(0.02)) > 1e-4


def test_null_takes_a_key_out():
    scene = load_scene(SCENES / "crossing.yaml", ["track.support=null", "integration.rtol=null"])
    assert "support" not in scene.data["track"] and scene.data["integration"]["rtol"] == 1e-4  # the default
    assert load_scene(SCENES / "crossing.yaml", track__support=None).data == scene.data
    for key, expected in (("track.suport", "that the scene has"), ("speed", "the key is missing")):
        with pytest.raises(InputError, match=f"{key}.*{expected}"):
            load_scene(SCENES / "crossing.yaml", [f"{key}=null"])


def test_actuator_and_motor_of_one_name_are_refused(tmp_path):
    vehicle = read_yaml(ELLIPTIC.parent / "vehicles" / "suspended_wheelset.yaml")
    actuator = {"kind": "actuator", "bodies": ["wheelset", "frame"], "at": [0, 0, 0.46], "direction": "y", "force": 9.0}
    motor = {"bodies": ["wheelset", "frame"], "force": 50.0}
    for one, kind, field in (("a", "motors", "drive.motors.a"), ("b", "brakes", "drive.brakes.b")):
        vehicle["elements"] = [*vehicle["elements"][:-1], vehicle["elements"][-1], {"name": one, **actuator}]
        changes = {"vehicle.parameters": vehicle, "drive": {kind: [{"name": one, **motor}]}}
        with pytest.raises(
            InputError, match=f"another name, as elements.{one} of the vehicle is an actuator"
        ) as caught:
            load_scene(ELLIPTIC / "suspended_wheelset.yaml", changes)
        assert caught.value.field == field
        load_scene(ELLIPTIC / "suspended_wheelset.yaml", {**changes, "drive": {kind: [{"name": "c", **motor}]}})


def test_a_control_law_has_a_name_of_letters():
    with pytest.raises(InputError, match="a control law's name in letters, digits and underscores"):
        load_scene(
            ELLIPTIC / "suspended_wheelset.yaml", {"control": {"a/b": {"law": "a:b", "inputs": [], "outputs": ["m"]}}}
        )


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"level": "fra_4"}, "FRA track classes 5 and 6 only), got 'fra_4'"),
        ({"level": "hihg"}, "did you mean 'high'?"),
        ({"shortest": 0.05}, "expected the shortest wavelength in m, at least 0.1, got 0.05"),
        ({"longest": 2000.0}, "expected the longest wavelength in m, at most 1000, got 2000.0"),
        ({"length": 1.0}, "expected the length of disturbed track in m, 10 to 1e5, got 1.0"),
    ],
)
def test_a_spectrum_beyond_its_bounds_is_told_them(changes, says):
    spectrum = {"level": "low", "seed": 1, "length": 200.0, **changes}
    with pytest.raises(InputError) as caught:
        load_scene(ELLIPTIC / "suspended_wheelset.yaml", {"track.irregularity.spectrum": spectrum})
    assert str(caught.value).endswith(says)


def test_planar_detection_beside_a_lookup_table_is_told_what_to_set(monkeypatch):
    class Told(Exception):
        pass

    def tell(text):
        raise Told(text)

    monkeypatch.setattr(scene_compile, "tell", tell)
    changes = {"contact.patch": "tabulated", "contact.detection": "planar"}
    with pytest.raises(Told, match="set contact.patch to moment, or contact.detection to spatial"):
        compile_scene(load_scene(ELLIPTIC / "suspended_wheelset.yaml", changes))


def test_overrides_from_a_generator_are_those_of_a_list():
    scene = ELLIPTIC / "suspended_wheelset.yaml"
    made = load_scene(scene, (f"{key}={value}" for key, value in {"speed": 31, "initial.y": 0.001}.items()))
    assert (made.data["speed"], made.data["initial"]["y"]) == (31, 0.001)
    for wrong in (3, None, ("speed", 30), b"speed=30", np.array(["speed=30"])):
        with pytest.raises(InputError, match="--set: .*expected key.path=value"):
            load_scene(scene, (text for text in [wrong]))


def test_changes_that_contain_themselves_are_one_line():
    deep: dict = {}
    deep["a"] = deep
    for changes in ({"initial": deep}, {"initial": [deep]}):
        with pytest.raises(InputError, match="^changes: "):
            load_scene(ELLIPTIC / "suspended_wheelset.yaml", changes)
