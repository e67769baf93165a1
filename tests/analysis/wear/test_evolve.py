"""Profiles over a distance: flange numbers of S1002, books that balance, resumption, refusals."""

import math
import os
import shutil
from contextlib import contextmanager

import numpy as np
import pandas as pd
import pytest
import yaml

from tests.conftest import ELLIPTIC, SCENES
from wrcore.analysis.wear import evolve as ev
from wrcore.analysis.wear import wear_folder
from wrcore.analysis.wear.worn_profiles import (
    POINTS,
    file_of,
    flange,
    hollow,
    limits_reached,
    read_points,
    smooth,
    smooth_along,
    write_points,
)
from wrcore.analysis.wear.worn_rails import (
    FACE_SLOPE,
    filled,
    lay_rails,
    next_rails,
    rail_file,
    rails_of_step,
    softened,
    worn_down,
)
from wrcore.analysis.wear.worn_rails import POINTS as RAIL_POINTS
from wrcore.cli import main
from wrcore.errors import InputError
from wrcore.errors.messages import warnings_suppressed
from wrcore.geometry.profiles.profile import ProfileCurve
from wrcore.scene.description import load_scene

PLAN = {
    "name": "short", "scene": str(ELLIPTIC / "suspended_wheelset.yaml"), "distance": 3e5, "largest_step": 1e5,
    "begin": 0.2, "rate": 100.0,
    "scenes": [
        {"share": 3.0, "set": {"speed": 30, "integration.duration": 0.6, "initial.y": 0.002}},
        {"share": 1.0, "set": {"speed": 20, "integration.duration": 0.5, "initial.y": 0.004}},
    ],
}  # fmt: skip


VEHICLE = ELLIPTIC.parent / "vehicles" / "suspended_wheelset.yaml"
OFF = {"speed": 140, "integration.duration": 3.0, "initial.y": 0.015}
"""Far above the critical speed."""
RUN = {"speed": 20, "integration.duration": 0.5}
ARCHARD = {"archard": {"hardness": 2e9, "coefficients": [[1e-4]]}}


@pytest.fixture(scope="module")
def worn(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wear") / "short"
    return folder, ev.evolve(PLAN, folder)


def test_flange_of_s1002(s1002):
    """28 mm high, 32.5 mm thick, qR 10.8 mm: EN 13715 and the drawings of UIC 510-2 (recalled)."""
    found = flange(s1002)
    assert found["Sh_m"] == pytest.approx(28e-3, abs=5e-5) and found["Sd_m"] == pytest.approx(32.5e-3, abs=5e-5)
    assert found["qR_m"] == pytest.approx(10.8e-3, abs=5e-5)


def test_steps_add_up_to_the_distance_and_the_volume(worn):
    folder, table = worn
    assert table["step_m"].sum() == pytest.approx(3e5) and table["step_m"].iloc[-1] == 0.0
    np.testing.assert_allclose(table["distance_m"], np.concatenate([[0.0], np.cumsum(table["step_m"])[:-1]]))
    new, now = (read_points(file_of(folder, "profile", step))[1] for step in (0, len(table) - 1))
    radius = 0.46  # of the wheels; their centres keep this height to 0.1 %
    assert np.sum(now - new) * POINTS * 2 * np.pi * radius == pytest.approx(table["worn_volume_m3"].sum(), rel=2e-3)
    assert (now - new).min() >= -1e-15 and table["worn_m"].iloc[-1] == pytest.approx((now - new).max())
    assert table["worn_m"].is_monotonic_increasing


def test_rails_lose_what_wheels_lose(worn):
    """Per passage of the vehicle both rails lose the volume of its wheels per metre, in each scene."""
    folder, table = worn
    rails = ev.rail_wear(folder)
    assert rails["scene"].tolist() == [0, 1] * 3 and rails["share"].tolist() == [0.75, 0.25] * 3
    _, scenes = ev.load_wear_plan(PLAN)
    mass = 2 * scenes[0].vehicle.nominal_wheel_load(scenes[0].vehicle.bodies.wheelsets[0]) / 9.81
    area = (rails["left_m2_per_Mt"] + rails["right_m2_per_Mt"]) * rails["share"] * mass / 1e9
    lost = area.groupby(rails["step"]).sum()
    np.testing.assert_allclose(lost, 2 * table["volume_m3_per_m"].iloc[:-1], rtol=1e-9)


def test_what_changes_set_stands_beside_what_the_plan_sets():
    plan = PLAN | {"set": {"contact.patch": "maximum", "contact.friction": 0.25}}
    data, scenes = ev.load_wear_plan(plan, {"set": {"contact.friction": 0.2}, "distance": 2e5})
    assert data["set"] == {"contact.patch": "maximum", "contact.friction": 0.2} and data["distance"] == 2e5
    assert [(scene.data["contact"]["patch"], scene.data["contact"]["friction"]) for scene in scenes] == [
        ("maximum", 0.2)
    ] * 2


def test_threads_and_cost(worn, tmp_path):
    """Scenes at the same time give the same numbers; what the runs and their wear cost is told."""
    folder, table = worn
    spent = {}
    twice = ev.evolve(PLAN, tmp_path, threads=2, spent=spent)
    pd.testing.assert_frame_equal(twice, table, check_exact=True)
    assert (tmp_path / "profile_003.csv").read_bytes() == (folder / "profile_003.csv").read_bytes()
    assert spent["simulate"] > 0.0 and spent["wear"] > 0.0


class Killed(BaseException):
    """Nobody catches it."""


@pytest.fixture(scope="module")
def killed(tmp_path_factory):
    """A folder whose plan was killed after its first step."""

    def kill(_):
        raise Killed

    folder = tmp_path_factory.mktemp("wear") / "killed"
    with pytest.raises(Killed):
        ev.evolve(PLAN, folder, kill)
    return folder


@pytest.mark.parametrize("at", ["its row", "the digests"])
def test_going_on_changes_nothing(worn, killed, tmp_path, monkeypatch, at):
    """Whoever is killed goes on after the last row that counts."""
    folder, table = worn
    partly = shutil.copytree(killed, tmp_path / "partly")
    name = "steps.csv" if at == "its row" else "plan.json"

    @contextmanager
    def until(path, original=wear_folder.appearing):
        if path.name == name:
            raise Killed
        with original(path) as file:
            yield file

    monkeypatch.setattr(wear_folder, "appearing", until)
    with pytest.raises(Killed):
        ev.evolve(PLAN, partly)
    monkeypatch.undo()
    assert len(pd.read_csv(partly / "steps.csv")) == (1 if at == "its row" else 2)
    pd.testing.assert_frame_equal(ev.evolve(PLAN, partly), table, rtol=1e-12)
    assert (partly / "profile_003.csv").read_bytes() == (folder / "profile_003.csv").read_bytes()


def cell(path, name, value):
    table = pd.read_csv(path)
    table.loc[table.index[-1], name] = value
    table.to_csv(path, index=False)


def text(path, change):
    path.write_text(change(path.read_text()))


DAMAGE = {
    "a cut last row": ("steps.csv", lambda p: text(p, lambda t: t[: t.rindex(",") - 2])),
    "no last row": ("steps.csv", lambda p: text(p, lambda t: t[: t.rindex("\n", 0, -1) + 1])),
    "no row": ("steps.csv", lambda p: text(p, lambda t: t.partition("\n")[0] + "\n")),
    "a step of 1e300 m": ("steps.csv", lambda p: cell(p, "step_m", 1e300)),
    "no table": ("steps.csv", lambda p: p.unlink()),
    "an edited profile": ("profile_001.csv", lambda p: text(p, lambda t: t.replace("0.0000", "0.0010", 1))),
    "an edited first profile": ("profile_000.csv", lambda p: text(p, lambda t: t[:-3] + "9\n")),
    "no profile": ("profile_001.csv", lambda p: p.unlink()),
    "a pipe": ("profile_001.csv", lambda p: (p.unlink(), os.mkfifo(p))),
    "edited rails": ("rails_000.csv", lambda p: text(p, lambda t: t.replace("0.75", "0.25"))),
    "no plan": ("plan.json", lambda p: p.unlink()),
    "a deep plan": ("plan.json", lambda p: p.write_text("[" * 200_000)),
    "no digests": ("plan.json", lambda p: text(p, lambda t: t.replace('"files"', '"others"'))),
}


@pytest.mark.parametrize(("name", "damage"), DAMAGE.values(), ids=DAMAGE)
@pytest.mark.parametrize("of", ["killed", "worn"])
def test_a_damaged_folder_is_refused(request, tmp_path, name, damage, of):
    folder = request.getfixturevalue(of)
    folder = shutil.copytree(folder[0] if of == "worn" else folder, tmp_path / "damaged")
    damage(folder / name)
    for read in (
        lambda: ev.evolve(PLAN, folder),
        lambda: ev.profiles_over_distance(folder),
        lambda: ev.rail_wear(folder),
    ):
        with pytest.raises(InputError, match=f"{name}: expected"):
            read()


def test_a_plan_of_other_files_does_not_go_on(tmp_path, uic60):
    """A rail that was edited between two steps made two wear rates in one table."""
    rail = tmp_path / "rail.csv"
    rows = [f"{a:.9f},{b:.9f}" for a, b in zip(uic60.u[::10], uic60.f[::10], strict=True)]
    rail.write_text("\n".join(["u_m,f_m", *rows]))
    scene = load_scene(PLAN["scene"]).data
    scene["rail"], scene["vehicle"] = {"profile": "rail.csv"}, scene["vehicle"] | {"parameters": str(VEHICLE)}
    (tmp_path / "scene.yaml").write_text(yaml.safe_dump(scene))
    plan = PLAN | {"scene": str(tmp_path / "scene.yaml"), "scenes": PLAN["scenes"][:1]}

    def edit(_):
        rail.write_text(rail.read_text() + "\n# ")

    with pytest.raises(InputError, match="rail.csv: expected the content with which this began"):
        ev.evolve(plan, tmp_path / "wear", edit)
    assert len(pd.read_csv(tmp_path / "wear" / "steps.csv")) == 1
    with pytest.raises(InputError, match="expected a folder of this plan, of the same input files"):
        ev.evolve(plan, tmp_path / "wear")


def test_two_processes_do_not_wear_one_wheel(tmp_path):
    """Both computed all of it."""
    found = []

    def second(_):
        with pytest.raises(InputError) as caught:
            ev.evolve(PLAN, tmp_path / "wear")
        found.append(str(caught.value))
        raise Killed

    with pytest.raises(Killed):
        ev.evolve(PLAN, tmp_path / "wear", second)
    assert len(found) == 1 and "no other process is writing" in found[0]


def test_a_scene_that_does_not_end_is_named(tmp_path):
    """A wheelset released far off on a smooth track leaves the rails."""
    plan = PLAN | {"scenes": [PLAN["scenes"][0], {"share": 1.0, "set": OFF}]}
    with pytest.raises(InputError, match=r"profile_\d+.csv: scenes.1: expected a run to its end .*, got derailed"):
        ev.evolve(plan, tmp_path)


def test_hollow_is_the_height_of_the_false_flange():
    f = np.array([0.0, -0.02, -0.028, -0.01, 0.0, 0.003, 0.002, 0.0005, 0.001, 0.004])
    assert hollow(f) == pytest.approx(0.0025) and hollow(f[:6]) == 0.0


def test_limits():
    row = {"Sh_m": 0.0362, "Sd_m": 0.030, "qR_m": 0.0064, "hollow_m": 0.001}
    limits = {"Sh": 0.036, "Sd": 0.022, "qR": 0.0065, "hollow": 0.002}
    assert limits_reached(limits, row) == ["Sh", "qR"] and limits_reached({}, row) == []


@pytest.fixture(scope="module")
def limit(worn):
    """A flange height that the wheel of the plan has reached at its last step but not before."""
    heights = worn[1]["Sh_m"].to_numpy()
    return {"Sh": 0.5 * (heights[-1] + heights[-2])}


def test_a_wheel_ends_at_its_limit(worn, limit, tmp_path):
    """The same steps up to there, and none from there."""
    table, said = ev.evolve(PLAN | {"limits": limit, "distance": 9e5}, tmp_path, None), []
    assert table["at_limit"].tolist() == [0] * (len(worn[1]) - 1) + [1] and table["step_m"].iloc[-1] == 0.0
    np.testing.assert_allclose(table["distance_m"], worn[1]["distance_m"])
    ev.evolve(PLAN | {"limits": limit, "distance": 9e5}, tmp_path, said.append)
    assert said == []  # it stays ended


def test_a_turned_wheel_is_new_and_goes_on(worn, limit, tmp_path):
    table = ev.evolve(PLAN | {"limits": limit, "turning": True, "distance": 4.5e5}, tmp_path)
    turned = int(np.flatnonzero(table["at_limit"])[0])
    assert turned == len(worn[1]) - 1 and table["step_m"].sum() == pytest.approx(4.5e5)
    again, first = table.iloc[turned + 1], table.iloc[0]
    assert again["worn_m"] == 0.0 and again["distance_m"] == table["distance_m"].iloc[turned]
    assert again["rate_max"] == first["rate_max"] and again["Sh_m"] == first["Sh_m"]


def test_smoothing_keeps_the_sum():
    values = np.zeros(400)
    values[[3, 200, 397]] = 1.0
    assert smooth(values, 3e-3).sum() == pytest.approx(3.0)
    np.testing.assert_array_equal(smooth(values, 0.0), values)


@pytest.mark.parametrize("wave", [1.0e-3, 1.5e-3, 2.0e-3, 2.5e-3, 4e-3, 8e-3])
def test_smoothing_turns_no_wave_over(wave):
    """What is worn on ridges must not be taken from valleys."""
    u = POINTS * np.arange(400)
    ridges = np.cos(2.0 * np.pi * u / wave)
    inside = slice(100, 300)
    assert np.dot(smooth(ridges, 3e-3)[inside], ridges[inside]) > -1e-9


@pytest.mark.parametrize("slope", [0.0, 2.7, 8.0])
def test_smoothing_along_a_face_spreads_over_its_own_length(slope):
    """What one point of a straight face loses is spread as on level ground: as far along the face, the sum kept."""
    u = POINTS * np.arange(400)
    values = np.zeros(400)
    values[200] = 1.0
    spread = smooth_along(u, slope * u, values, 3e-3)
    along = math.hypot(1.0, slope) * (u - u[200])
    assert spread.sum() == pytest.approx(1.0) and abs((spread * along).sum()) < 1e-5
    level = math.sqrt((smooth(values, 3e-3) * (u - u[200]) ** 2).sum())
    own = math.hypot(1.0, slope) * POINTS / math.sqrt(12.0)  # a point of the face is a bin as wide as this, standard
    assert math.sqrt((spread * along**2).sum()) == pytest.approx(math.hypot(level, own), rel=0.15)


def test_smoothing_along_keeps_the_sum_at_the_ends():
    u = np.linspace(0.0, 0.03, 301)
    for place in (0, 2, 298, 300):
        loss = np.zeros(301)
        loss[place] = 1e-6
        assert smooth_along(u, 0.2 * u, loss, 2e-3).sum() == pytest.approx(1e-6, rel=1e-9)


def test_smoothing_along_keeps_a_depth_that_is_the_same_everywhere(curves):
    """Normal to the profile, over the whole of a new rail but its very ends."""
    u, f = read_points(rail_file(curves["left"][0], 0, 0, "left"))
    fall = 1e-4 * np.hypot(1.0, np.gradient(f, u))
    np.testing.assert_allclose(smooth_along(u, f, fall, 3e-3)[4:-6], fall[4:-6], rtol=0.02)


def test_a_plan_with_exact_patches_wears_what_its_runs_lose(tmp_path):
    """A step of a coarse exact run: its books balance, and its deepest place is not the ellipses'."""
    run = {"speed": 40, "integration.duration": 0.3, "initial.y": 0.003}
    exact = {"contact.patch": "exact", "contact.resolution": "coarse"}
    plan = PLAN | {"distance": 1e5, "scenes": [{"share": 1.0, "set": run}], "set": exact}
    found = {name: ev.evolve(plan | {"patches": name}, tmp_path / name) for name in ("ellipse", "exact")}
    volumes = [table["worn_volume_m3"].sum() for table in found.values()]
    assert volumes[1] == pytest.approx(volumes[0], rel=0.03)
    (_, new), (_, now) = (read_points(file_of(tmp_path / "exact", "profile", step)) for step in (0, 1))
    assert np.sum(now - new) * POINTS * 2 * np.pi * 0.46 == pytest.approx(volumes[1], rel=2e-3)
    other = read_points(file_of(tmp_path / "ellipse", "profile", 1))[1]
    assert np.abs(now - other).max() > 0.05 * (now - new).max()


def test_bad_plans_are_refused_before_any_work(worn, tmp_path, capsys):
    folder, _ = worn
    for changes, says in (
        ({"scene": "nowhere.yaml"}, "scene: expected an existing file"),
        ({"scenes": [{"share": 1.0, "set": {"sped": 3}}]}, "scenes.0.set"),
        ({"set": {"initial": {"y": 0.001}}}, "scenes.0.set.initial.y: expected this key here, or in the plan's set"),
        ({"set": {"output.rate": 400}}, "set.output.rate: expected no such key: the plan's key rate"),
        ({"patches": "exact", "set": {"output.channels": ["pose"]}}, "set.output.channels: expected no such key"),
        ({"turning": True}, "turning: expected limits beside turning"),
        ({"limits": {"Sd": 0.034}}, "limits.Sd: expected a limit that the new wheel, 0.032.* has not reached"),
        ({"limits": {"Sd": 0.022}, "set": {"wheel.profile": "cone:1/40"}}, "limits.Sd: expected no such limit"),
        ({"set": {"wheel.left.profile": "cone:1/40"}}, "scenes.0.set: expected no wheel.left.profile: all wheels wear"),
        (
            {"scenes": [PLAN["scenes"][0], {"share": 1.0, "set": {**RUN, "wheel.profile": "cone:1/40"}}]},
            "scenes.1.set.wheel.profile: expected the wheel of the first scene",
        ),
        (
            {"set": {"wheel.wheelsets": {"wheelset": {"right": {"profile": "cone:1/40"}}}}},
            "scenes.0.set: expected no wheel.wheelsets.wheelset.right.profile",
        ),
        ({"begin": 0.55}, "begin: expected less than the duration"),
        ({"law": "archard"}, "law: expected"),
        ({"patches": "strips"}, "patches: expected 'ellipse' or 'exact'"),
        (
            {"patches": "exact", "set": {"contact.patch": "maximum"}},
            "scenes.0.set: .*contact.patch: expected exact, surrogate, tab",
        ),
        ({"patches": "exact", "law": ARCHARD}, "plan: law: expected one of sheffield, energy"),
        (
            {"patches": "exact", "scene": str(SCENES / "crossing.yaml")},
            "scenes.0.set: .*crossing.yaml: expected rails and wheels that are the same everywhere",
        ),
        ({"rails": {"renewal": 1e7}}, "rails.tonnage"),
        ({"rails": {"tonnage": 1.0, "renewal": 1e7}}, "rails.renewal: expected less than the plan's distance"),
        ({"limits": {"Sd": 22.0}}, "limits.Sd: expected a length in m"),
        ({"law": {"archard": {"hardness": 2e9, "coefficients": []}}}, "law.archard.coefficients: expected a list"),
        ({"law": ARCHARD, "set": {"contact.friction": {"left": 0.3, "right": 0.2}}}, "scenes.0.set: expected contact"),
    ):
        with pytest.raises(InputError, match=says):
            ev.evolve(PLAN | changes, tmp_path / "never")
        assert not (tmp_path / "never").exists()
    with pytest.raises(InputError, match="a folder of this plan"):
        ev.evolve(PLAN | {"distance": 4e5}, folder)
    assert main(["evolve", str(tmp_path / "none.yaml"), "--out", str(tmp_path / "x")]) == 2
    assert "none.yaml" in capsys.readouterr().err


def curved(radius):
    """A curve of two steps over rails that wear; one to the right is the mirror image of one to the left."""
    path = [{"transition": 6}, {"curve": 100, "radius": radius, "cant": 0.02}]
    changes = {"speed": 12, "initial.y": 0.0, "integration.duration": 1.0, "integration.rtol": 1e-7, "track.path": path}
    rails = {"tonnage": 200.0, "renewal": 1.5e5}
    return PLAN | {"distance": 2.5e5, "rails": rails, "scenes": [{"share": 1.0, "set": changes}]}


@pytest.fixture(scope="module")
def curves(tmp_path_factory):
    folder = tmp_path_factory.mktemp("curves")
    return {side: (folder / side, ev.evolve(curved(r), folder / side)) for side, r in (("left", 400), ("right", -400))}


def rail_loss(folder, step, side, since=0):
    f = [read_points(rail_file(folder, k, 0, side))[1] for k in (since, step)]
    return f[0] - f[1]


def test_rails_lose_what_the_traffic_takes(curves):
    """The area between the stored profiles is that of the vehicle's local wear, times the tonnage."""
    folder, table = curves["left"]
    assert table["step_m"].tolist() == pytest.approx([1e5, 5e4, 1e5, 0.0])  # up to the renewal, and beyond
    for step in (0, 2):
        tonnes = 200.0 * table["step_m"].iloc[step] / 1e9  # million
        taken = ev.rail_wear(folder).iloc[step]
        for side in ("left", "right"):
            loss = rail_loss(folder, step + 1, side, step)
            assert np.sum(loss) * RAIL_POINTS == pytest.approx(taken[f"{side}_m2_per_Mt"] * tonnes, rel=1e-6)
            assert loss.min() > -1e-12 and loss.max() > 1e-7


def test_rails_that_were_stored_otherwise_are_not_gone_on_with(curves, monkeypatch):
    """As those of an earlier version, which had no gauge face."""
    folder, _ = curves["left"]
    monkeypatch.setattr(ev.worn_rails, "FACE", 0.0)
    with pytest.raises(InputError, match="a folder of this plan"):
        ev.evolve(curved(400), folder)


@pytest.mark.parametrize("kind", ["rail", "laid"])
def test_edited_rails_are_not_gone_on_with(curves, tmp_path, kind):
    folder = shutil.copytree(curves["left"][0], tmp_path / "edited")
    text(rail_file(folder, 1, 0, "left", kind), lambda t: t.replace("0.0100", "0.0101", 1))
    with pytest.raises(InputError, match=f"{kind}_0_left_001.csv.*changed since"):
        ev.evolve(curved(400), folder)


def test_renewed_rails_are_new(curves):
    folder, _ = curves["left"]
    for side in ("left", "right"):
        assert np.all(rail_loss(folder, 2, side) == 0.0) and rail_loss(folder, 1, side).max() > 0.0


def test_a_mirrored_curve_wears_mirrored_rails(curves):
    (here, table), (there, mirrored) = curves["left"], curves["right"]
    for side, other in (("left", "right"), ("right", "left")):
        loss = rail_loss(here, 3, side)
        np.testing.assert_allclose(rail_loss(there, 3, other), loss, atol=1e-3 * loss.max())
    np.testing.assert_allclose(mirrored["worn_m"], table["worn_m"], rtol=1e-3)
    assert rail_loss(here, 3, "right").sum() > 2.0 * rail_loss(here, 3, "left").sum()  # the outer rail of a left curve


def test_the_gauge_face_of_a_stored_rail_goes_on(curves, capsys):
    """Also of one that has lost 2 mm of its corner, down to a flank of 70 degrees, where a new curve has ended."""
    _, (scene,) = ev.load_wear_plan(curved(400))
    u, f = read_points(rail_file(curves["left"][0], 0, 0, "left", "laid"))
    new, gauge = scene.pair().rail, slice(0, u.size // 2)
    flank = -0.010 + 2.75 * (u - np.interp(-0.010, f[gauge], u[gauge]) - 2e-3)
    with warnings_suppressed():
        ground = softened(u, filled(u, np.minimum(f, flank)))
        stored, worn = (ProfileCurve.from_points(u, z, "rail") for z in (f, ground))
    assert capsys.readouterr().err == ""
    both = new.u[(new.u > stored.u[0]) & (new.u < stored.u[-1]) & (np.abs(new.df) < 3.0)]
    np.testing.assert_allclose(stored(both), new(both), atol=1e-6)
    assert new.f[0] > -0.0145 and stored.f[0] < -0.0155
    assert worn.f[0] < -0.019 and worn(worn.u[0], 1) == pytest.approx(2.75, abs=0.1)


def gauge_corner(flank):
    """A level rail whose gauge face falls with a slope from u = 0 to 15 mm below its top, and level ground there."""
    u = RAIL_POINTS * np.arange(-300, 300)
    return u, np.clip(flank * u, -0.015, 0.0)


def test_a_face_that_moves_on_leaves_no_groove():
    """By half a mm, five points, over a foot that loses as much: both move along their normals, as a straight face and
    level ground do, but for the corner between them."""
    u, f = gauge_corner(4.0)
    now = worn_down(u, f, 5e-4 * np.hypot(1.0, np.gradient(f, u)))
    moved = np.clip(4.0 * u - 5e-4 * math.hypot(1.0, 4.0), -0.0155, -0.0005)
    straight = (np.abs(u + 0.00375) > 8e-4) & (np.abs(u) > 8e-4)
    np.testing.assert_allclose(now[straight], moved[straight], atol=1e-9)
    assert np.diff(now).min() > -1e-12 and now.min() > -0.0155 - 1e-9


def test_what_wears_little_falls_by_just_that():
    u, f = gauge_corner(2.7)
    u, f = u[f > -0.015], f[f > -0.015]
    fall = 2e-5 * np.exp(-(((u + 0.003) / 2e-3) ** 2)) * np.hypot(1.0, np.gradient(f, u))
    np.testing.assert_allclose(f - worn_down(u, f, fall), fall, atol=1e-15)


def test_a_gauge_face_keeps_no_lip_and_is_no_steeper_than_a_curve_can_be():
    u, f = gauge_corner(6.0)
    groove = np.where((u > -0.0026) & (u < -0.0021), 5e-3, 0.0)
    now = worn_down(u, f - groove, np.zeros(u.size))
    assert np.diff(now).min() > -1e-12 and np.diff(now).max() <= FACE_SLOPE * RAIL_POINTS * (1.0 + 1e-9)
    np.testing.assert_array_equal(now[u > -0.0015], f[u > -0.0015])


def ground_down(folder, scene, low, high, steps):
    """Grind 0.1 mm a step off the left rail, between two depths below its top (m)."""
    for step in range(steps):
        u, f = read_points(rail_file(folder, step, 0, "left"))
        band = (u < 0.0) & (f < f.max() - low) & (f > f.max() - high)
        fall = smooth_along(u, f, np.where(band, 1e-4 * np.hypot(1.0, np.gradient(f, u)), 0.0), 2e-3)
        next_rails(folder, step, [{"left": fall, "right": np.zeros(fall.size)}], 1.0, False)
    return rails_of_step(folder, steps, 0, scene)


@pytest.mark.parametrize(("low", "high"), [(0.008, 0.014), (0.009, 0.015), (0.005, 0.020)])
def test_a_corner_that_is_ground_down_keeps_its_face(tmp_path, low, high):
    """Where a sharp edge was left, a spline turned too far and the curve ended, or nothing could be laid."""
    _, (scene,) = ev.load_wear_plan(curved(400))
    lay_rails(tmp_path, [scene])
    laid = ground_down(tmp_path, scene, low, high, 20)
    curve, f = load_scene(scene, laid.changes).pair("left").rail, laid.points["left"][1]
    assert curve.f[0] == pytest.approx(f[0] - f.max(), abs=5e-4) and f[0] - f.max() < -0.015
    assert np.abs(curve.df).max() < 10.0


def test_a_stored_rail_that_a_curve_cannot_follow_is_refused(tmp_path):
    _, (scene,) = ev.load_wear_plan(curved(400))
    lay_rails(tmp_path, [scene])
    path = rail_file(tmp_path, 0, 0, "left", "laid")
    u, f = read_points(path)
    depth = f.max() - f
    edge = (u < 0.0) & (depth > 0.009) & (depth < 0.013)
    write_points(path, u, np.where(edge, f.max() - 0.013, f))
    with pytest.raises(InputError, match=r"laid_0_left_000.csv.*gauge face that a curve f\(u\) follows"):
        rails_of_step(tmp_path, 0, 0, scene)


def test_worn_rails_keep_their_place(curves):
    """What wears lies lower and farther from the other rail; what does not stays where it was, to 1 um."""
    folder, _ = curves["left"]
    _, (scene,) = ev.load_wear_plan(curved(400))
    new, worn = (load_scene(scene, rails_of_step(folder, step, 0, scene).changes) for step in (0, 3))
    places = [[s.track.rail_distance(pair.rail) for pair in s.pairs[:2]] for s in (new, worn)]
    shifts = [rails_of_step(folder, step, 0, scene).shifts for step in (0, 3)]
    for k, side in enumerate(("left", "right")):
        moved = places[1][k] - shifts[1][side] - places[0][k] + shifts[0][side]
        assert abs(moved) < 1e-6
    assert places[0][0] == pytest.approx(scene.track.rail_distance(scene.rail), abs=1e-6)
