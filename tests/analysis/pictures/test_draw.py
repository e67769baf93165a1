"""Pictures for users: everything of a vehicle file is in its drawing, a run moves as its channels say, no network."""

import dataclasses
import json
import re
from html.parser import HTMLParser
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest
import yaml

import wrcore as wr
from tests.conftest import ELLIPTIC, ROOT, SCENES
from tests.synthetic import hunting_run
from wrcore.analysis.legible import findings
from wrcore.analysis.pictures.plot_vehicle import box_of
from wrcore.analysis.wear.wear_folder import claim, write_rows
from wrcore.cli import main
from wrcore.errors.checked_yaml import schema_of
from wrcore.forces import kinds as elements

VEHICLES = sorted(path.stem for path in ELLIPTIC.glob("*.yaml"))


@pytest.mark.parametrize("name", VEHICLES)
def test_a_drawing_holds_everything_of_the_vehicle_file_in_both_views(name, tmp_path):
    figure = wr.draw(ELLIPTIC / f"{name}.yaml")
    assert findings(figure) == []
    figure.savefig(tmp_path / "vehicle.svg")
    root = ElementTree.parse(tmp_path / "vehicle.svg").getroot()
    drawn = {element.get("id") for element in root.iter() if element.get("id")}
    scene = yaml.safe_load((ELLIPTIC / f"{name}.yaml").read_text())
    data = yaml.safe_load((ELLIPTIC.parent / scene["vehicle"]["parameters"]).read_text())
    parts = [f"body:{body}" for body in data["bodies"]]
    parts += [f"{kind}:{item['name']}" for kind in ("element", "joint") for item in data.get(f"{kind}s", [])]
    views = {f"{part}:{view}" for part in parts for view in ("side", "plan")}
    assert {view for view in views if view not in drawn and not view.startswith("body:wheelset")} == set()
    assert {f"body:{body}:side" for body in data["bodies"]} <= drawn
    texts = " ".join(text.get_text() for text in figure.axes[2].texts)
    assert all(item["name"] in texts for item in data.get("elements", []) + data.get("joints", []))


KINDS = schema_of("vehicle")["properties"]
ELEMENTS = {
    "spring_damper": {"stiffness": [1e5, 1e5, 1e5]}, "bushing": {"stiffness": [1e5, 1e5, 1e5]},
    "shear_spring": {"stiffness": [1e5, 1e5, 1e6]}, "air_spring": {"effective_area": 0.2, "volume": 0.05},
    "damper": {"damping": [1e3, 1e3, 1e3]}, "friction": {"direction": "x", "force": 1e3, "series_stiffness": 1e6},
    "bump_stop": {"direction": "y", "gap": 0.02, "stiffness": 1e6}, "anti_roll_bar": {"stiffness": 1e6},
    "traction_rod": {"stiffness": 1e6, "at": [[0.0, 0.0, 0.5], [1.0, 0.0, 0.5]]},
    "own_law": {"direction": "x", "law": "tests/forces/own_laws.py:dashpot", "parameters": [1.0]},
    "actuator": {"direction": "y"},
}  # fmt: skip
JOINTS = {
    "coordinate": {"axis": "x"}, "spherical": {"at": [0.0, 0.0, 0.5]}, "rigid": {"at": [0.0, 0.0, 0.5]},
    "revolute": {"axis": "y", "at": [0.0, 0.0, 0.5]}, "rigid_link": {"at": [[0.0, 0.0, 0.5], [1.0, 0.0, 0.5]]},
}  # fmt: skip


@pytest.mark.parametrize("kind", elements.KINDS)
def test_every_kind_of_element_is_drawn(tmp_path, kind):
    item = {"name": "new", "kind": kind, "bodies": ["wheelset", "frame"]}
    at = {} if kind == "anti_roll_bar" else {"at": [0.0, 0.3, 0.5]}
    assert "element:new:side" in drawn_of(tmp_path, "elements", item | at | ELEMENTS[kind])


@pytest.mark.parametrize("kind", KINDS["joints"]["items"]["properties"]["kind"]["enum"])
def test_every_kind_of_joint_is_drawn(tmp_path, kind):
    bodies = ["wheelset", "frame"] if kind == "coordinate" else ["wheelset", "wheelset"]
    item = {"name": "new", "kind": kind, "bodies": bodies}
    assert "joint:new:plan" in drawn_of(tmp_path, "joints", item | JOINTS[kind])


def drawn_of(folder, key, item):
    """Groups in the drawing of the suspended wheelset with one more part, as its file would say it."""
    scene = wr.load_scene(ELLIPTIC / "suspended_wheelset.yaml")
    data = {**scene.vehicle.data, key: [*scene.vehicle.data[key], item]}
    figure = wr.draw(dataclasses.replace(scene, vehicle=dataclasses.replace(scene.vehicle, data=data)))
    figure.savefig(folder / "vehicle.svg")
    return {part.get("id") for part in ElementTree.parse(folder / "vehicle.svg").getroot().iter()}


def test_no_name_breaks_a_drawing(tmp_path):
    item = {"name": "$\\frac$", "kind": "bushing", "bodies": ["wheelset", "frame"], "at": [0.0, 0.3, 0.5]}
    assert "element:$\\frac$:side" in drawn_of(tmp_path, "elements", item | ELEMENTS["bushing"])


def test_a_box_has_the_moments_of_its_body():
    body = yaml.safe_load((ROOT / "config/vehicles/trailer_vehicle.yaml").read_text())["bodies"]["bogie_1"]
    length, width, height = box_of(body)
    mass, inertia = body["mass"], body["inertia"]
    assert mass / 12 * (width**2 + height**2) == pytest.approx(inertia["roll"])
    assert mass / 12 * (length**2 + height**2) == pytest.approx(inertia["pitch"])
    assert mass / 12 * (length**2 + width**2) == pytest.approx(inertia["yaw"])


def test_of_a_train_one_vehicle_is_drawn():
    train = wr.load_scene(ELLIPTIC / "suspended_wheelset.yaml", vehicle__count=3, vehicle__spacing=10.0)
    figure = wr.draw(train)
    assert "one of 3" in figure.axes[0].get_title(loc="left") and len(figure.axes[2].texts) == 2


class Page(HTMLParser):
    """Tags that open and close, and all addresses."""

    def __init__(self, text):
        super().__init__()
        self.open, self.addresses, self.scripts, self.title = [], [], [], ""
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.addresses += [value for name, value in attributes if name in ("src", "href", "action", "data")]
        if tag not in ("meta", "input", "!doctype", "option"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        if tag != "option":
            assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] == "script":
            self.scripts.append(data)
        if self.open and self.open[-1] == "title":
            self.title += data


@pytest.fixture(scope="module")
def run():
    return hunting_run(flange_at=2.0)


def test_an_animation_moves_as_the_run_does(run, tmp_path):
    moving = wr.draw(run, SCENES / "wheelset.yaml", factor=40.0, begin=1.0, end=3.0)
    moving.write(tmp_path / "run.html")
    page = Page((tmp_path / "run.html").read_text("utf-8"))
    assert page.open == [] and page.addresses == []
    assert re.search(r"https?:|//[a-z]+\.|@import|url\(", moving.html) is None
    data = json.loads(page.scripts[0])
    assert data == json.loads(json.dumps(moving.data))
    at = np.searchsorted(run.t, np.array(data["t"]) - 1e-9)
    np.testing.assert_allclose(run.t[at], data["t"], atol=1e-9)
    assert data["t"][0] == 1.0 and data["t"][-1] <= 3.0 and len(at) == 101
    (body,), (wheelset,) = data["bodies"], data["wheelsets"]
    np.testing.assert_allclose(body["y"], 40.0 * run["wheelset"].y_m[at], atol=1e-5)
    np.testing.assert_allclose(body["yaw"], 40.0 * run["wheelset"].yaw_rad[at], atol=1e-6)
    np.testing.assert_allclose(wheelset["y"], run["wheelset"].y_m[at], atol=1e-6)
    left = run["wheelset/left"]
    for frame, k in enumerate(at):
        patches = wheelset["wheels"][0]["patches"][frame]
        assert [patch[4] for patch in patches] == left.N_N[k][~np.isnan(left.y_m[k])].tolist()
    assert len(patches) == 1 + (run.t[k] >= 2.0) or np.isnan(left.y_m[k, 1])


@pytest.mark.parametrize("name", ["DATA", "TITLE", "<!--<script>", "</script><script>", "a & b \u2028"])
def test_no_name_breaks_a_page(run, name):
    run = dataclasses.replace(run, scene={**run.scene, "name": name})
    page = Page(wr.draw(run, SCENES / "wheelset.yaml", end=1.0).html)
    assert page.open == [] and len(page.scripts) == 2 and json.loads(page.scripts[0])["name"] == name
    assert page.title == name


def test_profiles_of_an_animation_are_those_of_the_scene(run):
    scene = wr.load_scene(SCENES / "wheelset.yaml")
    left, right = wr.draw(run, scene).data["wheelsets"][0]["wheels"]
    distance = scene.track.rail_distance(scene.rail)
    y, z = np.array(left["wheel"])
    np.testing.assert_allclose(z, scene.wheel(np.clip(y - 0.75, *scene.wheel.u[[0, -1]])) - 0.46, atol=3e-5)
    y, z = np.array(right["rail"])
    np.testing.assert_allclose(z, scene.rail(np.clip(-y - distance, *scene.rail.u[[0, -1]])), atol=3e-5)


def test_the_factor_is_round_and_shows_the_motion(run):
    data = wr.draw(run, SCENES / "wheelset.yaml").data
    assert data["factor"] == 100.0  # 3 mm at most, to be seen as up to half a metre
    assert f"{data['factor']:g}" == "100" and np.abs(data["bodies"][0]["y"]).max() < 0.5


def test_in_a_curve_the_factor_shows_the_wheelsets(run):
    """A car of 19 m between its bogies lies 0.15 m inside a curve of 300 m: that is no motion to be enlarged."""
    path = [{"tangent": 10.0}, {"transition": 30.0}, {"curve": 200.0, "radius": 300.0, "cant": 0.1}]
    scene = wr.load_scene(ELLIPTIC / "trailer_vehicle.yaml", {"track.path": path})
    s, x = 60.0 + 15.0 * run.t, dict(zip(scene.vehicle.body_names, scene.vehicle.positions[:, 0], strict=True))
    wheels = [d for name, d in x.items() if name in scene.vehicle.wheelset_names]
    inside = {"car_body": np.mean(np.square(wheels)) / 600.0, "bogie_1": 1.28**2 / 600.0, "bogie_2": 1.28**2 / 600.0}
    groups = {}
    for name, at in x.items():
        y = inside.get(name, 0.0) + 0.004 * np.sin(run.t)
        groups[name] = {**run.groups["wheelset"], "y_m": y, "s_m": s + at, "x_m": s + at}
    groups |= {
        f"{name}/{side}": run.groups[f"wheelset/{side}"]
        for name in scene.vehicle.wheelset_names for side in ("left", "right")
    }  # fmt: skip
    curved = dataclasses.replace(run, scene=scene.data, groups=groups)
    data = wr.draw(curved, scene).data
    assert data["factor"] == 100.0
    at = np.searchsorted(run.t, np.array(data["t"]) - 1e-9)
    for body in data["bodies"]:
        np.testing.assert_allclose(body["y"], 0.4 * np.sin(run.t[at]), atol=1e-3)


def test_profiles_over_distance(tmp_path):
    u = 2.5e-4 * np.arange(-40, 41)
    for step in range(2):
        f = 1e-4 * step * np.exp(-((u / 4e-3) ** 2))
        pd.DataFrame({"u_m": u, "f_m": f}).to_csv(tmp_path / f"profile_{step:03d}.csv", index=False)
    zero = {"worn_m": 0.0, "rate_max": 1e-10, "volume_m3_per_m": 6e-12, "worn_volume_m3": 0.0, "Sh_m": 0.028,
            "Sd_m": 0.0325, "qR_m": 0.0108, "equivalent_conicity": 0.18}  # fmt: skip
    rows = [
        {"step": 0, "distance_m": 0.0, "step_m": 1e6, **zero},
        {"step": 1, "distance_m": 1e6, "step_m": 0.0, **zero},
    ]
    pd.DataFrame(rows).to_csv(tmp_path / "steps.csv", index=False)
    for use in (wr.draw, lambda folder: claim(folder, "mark", {})):
        with pytest.raises(wr.InputError, match=r"plan.json: expected the plan of this folder"):  # anybody's numbers
            use(tmp_path)
    (tmp_path / "steps.csv").unlink()
    claim(tmp_path, "mark", {})
    write_rows(tmp_path, rows)
    figure = wr.draw(tmp_path)
    assert findings(figure) == [] and len(figure.axes) == 6
    assert figure.axes[1].lines[1].get_ydata().max() == pytest.approx(0.1)
    assert main(["draw", str(tmp_path), "--out", str(tmp_path / "worn.svg")]) == 0


def test_a_profile_with_the_points_of_its_file(tmp_path):
    u = np.linspace(-30.0, 30.0, 121)
    x, y = np.append(u, [30.01, 30.02, 30.01]), np.append(-(u**2) / 50, [-19.0, -21.0, -23.0])
    (tmp_path / "rail.ban").write_text("ColumnDef=X,Y\n\n" + "".join(f"{a} {b}\n" for a, b in zip(x, y, strict=True)))
    figure = wr.draw(wr.named_profile(tmp_path / "rail.ban", "rail"))
    curve, followed, left_out, gauge = figure.axes[0].lines
    assert len(followed.get_xdata()) + len(left_out.get_xdata()) == 124
    assert left_out.get_ydata().min() == pytest.approx(-23.0) and 3 <= len(left_out.get_xdata()) < 10
    on_curve = np.interp(followed.get_xdata(), *curve.get_data())
    assert np.max(np.abs(on_curve - followed.get_ydata())) < 1e-3
    assert gauge.get_xdata()[0] == pytest.approx(-np.sqrt(14.0 * 50.0), abs=0.01)
    assert findings(figure) == []
    named = wr.draw(wr.named_profile("S1002", "wheel"))
    assert [text.get_text() for text in named.axes[0].get_legend().get_texts()] == ["curve", "tape circle"]
    assert findings(named) == []


def pose_only():
    run = hunting_run()
    del run.groups["wheelset"]["yaw_rad"]
    return run


@pytest.mark.parametrize(
    ("source", "options", "message"),
    [
        (ELLIPTIC / "absent.yaml", {}, "absent.yaml: expected a readable file"),
        (SCENES / "wheelset.yaml", {"factor": 2.0}, "draw: factor: expected this with a run only"),
        (SCENES / "wheelset.yaml", {"begin": 2.0}, "draw: begin: expected this with a run only"),
        (ELLIPTIC, {}, "expected a folder of evolve, with steps.csv"),
        (hunting_run(), {"scene": ELLIPTIC / "trailer_vehicle.yaml"}, "scene: expected that of the run, with wheelset"),
        (hunting_run(), {}, "draw: scene: expected that of the run, as its files are not here"),
        (hunting_run(), {"scene": SCENES / "wheelset.yaml", "begin": 9.0}, "draw: begin: expected 0 <= begin < end"),
        (hunting_run(), {"scene": SCENES / "wheelset.yaml", "factor": 0.1}, "factor: expected a number, at least 1"),
        (pose_only(), {"scene": SCENES / "wheelset.yaml"}, "draw: wheelset: expected a run with the output channels"),
    ],
)  # fmt: skip
def test_what_cannot_be_drawn_is_refused(source, options, message):
    with pytest.raises(wr.InputError, match=re.escape(message)):
        wr.draw(source, **options)


def test_command(tmp_path, capsys, run):
    run.save(tmp_path / "run.h5")
    scene, page = str(SCENES / "wheelset.yaml"), tmp_path / "run.html"
    assert main(["draw", str(tmp_path / "run.h5"), "--scene", scene, "--out", str(page)]) == 0
    assert page.read_text("utf-8").startswith("<!DOCTYPE html>")
    assert main(["draw", scene, "--out", str(tmp_path / "vehicle.png")]) == 0
    assert (tmp_path / "vehicle.png").read_bytes().startswith(b"\x89PNG")
    for words, message in (
        ([scene, "--out", "vehicle.html"], "expected a name that ends in .svg or .png"),
        ([scene, "--factor", "3", "--out", str(tmp_path / "x.svg")], "wrcore draw: --factor: expected this with a run"),
        ([str(tmp_path / "none.h5"), "--out", str(tmp_path / "x.html")], "none.h5: expected"),
    ):
        assert main(["draw", *words]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert message in line
