"""Numbers in another unit, and numbers that cannot be, are refused with one line; nothing computed is no result."""

import math

import numpy as np
import pytest

import wrcore as wr
from tests.conftest import ELLIPTIC, SCENES
from wrcore.cli import main

PAIR = ["--wheel", "S1002", "--rail", "60E1", "--inclination", "1/40"]
POSES = "pose_id,y_m,yaw_rad\n1,0.001,0\n"


@pytest.mark.parametrize("command, options, says", [
    ("contact", ["--gauge", "1435"], "gauge: expected 0.5 to 2 m, got 1435"),
    ("contact", ["--rolling-radius", "460"], "rolling_radius: expected 0.05 to 2 m"),
    ("contact", ["--tape-circle-half-distance", "750"], "half_distance: expected 0.2 to 1.5 m"),
    ("contact", ["--wheel-load", "5e7"], "wheel_load: expected"), ("contact", ["--wheel-load", "-1"], "wheel_load"),
    ("contact", ["--wheel-load", "nan"], "wheel_load"), ("contact", ["--shear-modulus", "82"], "shear_modulus"),
    ("contact", ["--poisson-ratio", "28"], "poisson_ratio"),
    ("contact", ["--inclination", "40"], "a ratio such as 1/40"),
    ("contact", ["--gauge", "1.7"], "a pose in which a wheel touches its rail, got none"),
    ("conicity", ["--gauge", "1435"], "gauge: expected 0.5 to 2 m"),
    ("conicity", ["--rolling-radius", "460"], "rolling_radius: expected 0.05 to 2 m"),
    ("conicity", ["--right-rolling-radius", "460"], "rolling_radius"),
    ("conicity", ["--tape-circle-half-distance", "750"], "half_distance"),
    ("conicity", ["--amplitudes-from", "1", "--to", "8", "--step", "1"], "--amplitudes-from"),
])  # fmt: skip
def test_another_unit_is_one_line_and_no_file(tmp_path, capsys, command, options, says):
    poses, out = tmp_path / "poses.csv", tmp_path / "out.csv"
    poses.write_text(POSES)
    own = ["--poses", str(poses), "--wheel-load", "54500"] if command == "contact" else []
    assert main([command, *own, *PAIR, "--out", str(out), *options]) == 2
    said = capsys.readouterr().err
    assert says in said and said.count("\n") == 1 and not out.exists()


@pytest.mark.parametrize("command", [["contact", "--poses", "POSES", "--wheel-load", "54500"], ["conicity"]])
def test_a_named_rail_needs_its_inclination(tmp_path, capsys, command):
    (tmp_path / "poses.csv").write_text(POSES)
    words = [str(tmp_path / "poses.csv") if word == "POSES" else word for word in command]
    assert main([*words, *PAIR[:4], "--out", str(tmp_path / "out.csv")]) == 2
    assert "inclination: expected a ratio for 60E1, such as 1/40, 1/20 or 0 (upright)" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["contact", "conicity", "profiles"])
def test_inclination_without_effect_on_a_file_is_refused(tmp_path, capsys, command):
    (tmp_path / "poses.csv").write_text(POSES)
    rail, out = tmp_path / "rail.csv", str(tmp_path / "out.csv")
    rail.write_text("u_m,f_m\n" + "".join(f"{u},{-2 * u * u}\n" for u in np.linspace(-0.036, 0.036, 73)))
    pair = ["--wheel", "S1002", "--rail", str(rail), "--out", out]
    words = {"contact": ["--poses", str(tmp_path / "poses.csv"), "--wheel-load", "54500", *pair], "conicity": pair,
             "profiles": [str(rail), "--kind", "rail"]}[command]  # fmt: skip
    assert main([command, *words, "--inclination", "1/40"]) == 2
    said = capsys.readouterr().err
    assert "inclination" in said and "inclined: false" in said and said.count("\n") == 1


def test_inclination_beside_a_rail_of_slices_or_a_wheel_is_refused(tmp_path, capsys):
    (tmp_path / "slices.csv").write_text("s_m,profile\n0,a.csv\n1,a.csv\n")
    (tmp_path / "poses.csv").write_text(POSES)
    rail = ["--rail", str(tmp_path / "slices.csv"), "--out", str(tmp_path / "out.csv"), "--inclination", "1/40"]
    words = ["contact", "--poses", str(tmp_path / "poses.csv"), "--wheel-load", "54500", "--wheel", "S1002", *rail]
    assert main(words) == 2
    assert "--inclination: expected none or 0 beside a rail of slices" in capsys.readouterr().err
    with pytest.raises(wr.InputError, match="only rails have one"):
        wr.named_profile("S1002", "wheel", 1 / 40)


def test_a_scene_with_a_named_rail_needs_its_inclination():
    data = dict(wr.load_scene(SCENES / "wheelset.yaml").data, rail={"profile": "60E1"})
    data["vehicle"]["parameters"] = str(ELLIPTIC.parent / "vehicles" / "wheelset.yaml")
    with pytest.raises(wr.InputError, match=r"rail.inclination: expected a ratio for 60E1"):
        wr.load_scene(data)
    assert wr.load_scene(data, {"rail.profile": "circle:0.3"}).rail.name == "circle:0.3"


@pytest.mark.parametrize("arguments, field", [
    ({"psi": 2.0}, "psi"), ({"psi": -1.0}, "psi"), ({"nu": 3.0}, "nu"), ({"g": -1.0}, "g"), ({"g": 0.0}, "g"),
    ({"g": math.nan}, "g"), ({"g": "1"}, "g"), ({"level": 1}, "level"), ({"level": 10_000}, "level"),
])  # fmt: skip
def test_the_exact_solver_checks_its_patch(arguments, field):
    with pytest.raises(wr.InputError, match=f"RollingContact: {field}: expected"):
        wr.RollingContact(**{"g": 1.0, "level": 8, **arguments})


def test_the_exact_solver_checks_its_creepages():
    patch = wr.RollingContact(1.0, level=8)
    for call in (patch.solve, patch.field):
        with pytest.raises(wr.InputError, match=r"RollingContact\.\w+: eta: expected a.* number.*, finite, got nan"):
            call(0.1, np.nan, 0.0)
    with pytest.raises(wr.InputError, match="creepages"):
        patch.solve_many([[0.1, np.inf, 0.0]])


@pytest.mark.parametrize("speeds", [[], [20.0, 10.0], [-20.0], [0.0, 10.0], [200.0], [math.nan], ["20"]])
def test_speeds_of_stability(speeds):
    scene = wr.load_scene(ELLIPTIC / "suspended_wheelset.yaml")
    for call in (
        lambda: wr.critical_speeds({"any": scene}, speeds),
        lambda: wr.limit_cycles(scene, speeds, None, [0.006], 1.0),
    ):
        with pytest.raises(wr.InputError, match="speeds: expected"):
            call()
    with pytest.raises(wr.InputError, match="speeds: expected"):
        wr.modes(scene, -20.0)


def test_conicity_follows_the_standard_unless_asked_to_roll(tmp_path):
    out = tmp_path / "out.csv"
    found = []
    for options in ([], ["--no-roll"], ["--roll"]):
        assert main(["conicity", *PAIR, "--to", "0.006", "--out", str(out), *options]) == 0
        found.append(np.loadtxt(out, delimiter=",", skiprows=1)[:, 1])
    assert (found[0] == found[1]).all() and (found[2] > 1.005 * found[0])[:2].all()


def test_a_run_beyond_the_end_of_the_irregularity_says_so(capsys):
    spectrum = "track.irregularity={spectrum: {level: low, seed: 1, length: 60.0, begin: -20.0}}"
    command = ["simulate", str(ELLIPTIC / "suspended_wheelset.yaml"), "--set", spectrum, "--set", "speed=30"]
    assert main([*command, "--set", "integration.duration=1.0"]) == 0
    assert "past the end of the irregularity" not in capsys.readouterr().out
    assert main([*command, "--set", "integration.duration=1.5"]) == 0
    assert "34 wheelsets past the end of the irregularity" in capsys.readouterr().out
