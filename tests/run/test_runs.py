"""Whole runs against exact kinematics, against themselves mirrored, and through the command line."""

import csv
import json
import math

import numpy as np
import pytest

from tests.conftest import ELLIPTIC, SCENES
from wrcore.cli import main
from wrcore.contact.search.detection import detect
from wrcore.equations.equations_of_motion import Equations
from wrcore.equations.model import workspace
from wrcore.run.output.files import load_run
from wrcore.run.simulate import simulate
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene


def test_conical_wheelset_follows_klingel():
    """Cone 1:20 on circular rail heads, 3 m/s, 0.5 mm: Klingel's wavelength 2 pi sqrt(r b / gamma) within 1 %.

    The wheelset's roll shifts the contact on a rail head of radius R, which makes the effective conicity
    gamma b / (b - R gamma): roll gamma y/b moves the contact by R gamma y/b, which adds to y: within 0.1 %.
    """
    gamma, radius = 0.05, 0.3
    overrides = [
        "wheel.profile=cone:1/20", f"rail.profile=circle:{radius}", "rail.inclination=0", "speed=3.0",
        "initial.y=0.0005", "integration.duration=14", "integration.rtol=1e-7", "contact.creep.model=linear",
        "output.channels=[pose]",
    ]  # fmt: skip
    scene = load_scene(SCENES / "wheelset.yaml", overrides)
    model, state = compile_scene(scene)
    patch = detect(model.contact.geometry, 0.0, state[2])[0]
    half, r = abs(patch.y_m), 0.46 - float(scene.wheel(patch.u_wheel_m))
    wheelset = simulate(scene)["wheelset"]
    y, x = wheelset.y_m, wheelset.x_m
    cross = np.flatnonzero(np.diff(np.sign(y)))
    zeros = x[cross] - y[cross] * np.diff(x)[cross] / np.diff(y)[cross]
    wavelength = 2 * np.diff(zeros).mean()
    assert len(zeros) >= 4
    assert wavelength == pytest.approx(2 * math.pi * math.sqrt(r * half / gamma), rel=0.01)
    assert wavelength == pytest.approx(2 * math.pi * math.sqrt(r * (half - radius * gamma) / gamma), rel=1e-3)


def test_mirrored_start_gives_the_mirrored_run():
    # Before the first flange contact (afterwards neighbouring runs separate). Every operation is mirrored; the runs
    # differ by rounding, and once rounding has made one of them reject a step that the other accepts, by as much as
    # either differs from the exact motion, which a tighter run stands for.
    def run(y, rtol):
        overrides = [f"initial.y={y}", f"integration.rtol={rtol}", "integration.duration=0.8"]
        overrides.append("contact.patch=moment")
        return simulate(load_scene(SCENES / "wheelset.yaml", overrides))

    left, right, tight = run(0.002, 1e-6), run(-0.002, 1e-6), run(0.002, 1e-9)
    error = np.abs(left["wheelset"].y_m - tight["wheelset"].y_m).max()
    assert np.ptp(left["wheelset"].y_m) > 0.003 and error < 1e-5  # it does move, and accurately
    assert np.abs(left["wheelset"].y_m + right["wheelset"].y_m).max() <= 3.0 * error
    assert left["wheelset/left"].N_N[0, 0] == pytest.approx(right["wheelset/right"].N_N[0, 0], rel=1e-12)


def test_the_right_hand_side_has_no_memory():
    scene = load_scene(SCENES / "wheelset.yaml", ["contact.creep.model=she"])
    model, state = compile_scene(scene)
    function = Equations(model, workspace(model))
    first = function(0.0, state)
    function(0.3, state + 1e-4)
    np.testing.assert_array_equal(function(0.0, state.copy()), first)


@pytest.mark.parametrize("detection", ["planar", "spatial"])
def test_suspended_wheelset_decays_at_20_and_hunts_at_60(detection):
    # a rough prototype found decay at 20 m/s and a limit cycle of 2-3 mm at 60 m/s
    amplitude = {}
    for speed, duration in ((20.0, 1.0), (60.0, 3.0)):
        overrides = [f"speed={speed}", f"integration.duration={duration}", f"contact.detection={detection}"]
        run = simulate(load_scene(ELLIPTIC / "suspended_wheelset.yaml", [*overrides, "output.channels=[pose]"]))
        assert run.status == "completed"
        amplitude[speed] = np.abs(run["wheelset"].y_m[-100:]).max()
    assert amplitude[20.0] < 1e-3
    assert 2e-3 < amplitude[60.0] < 3.5e-3


def test_vertical_force_carries_the_weight_on_average():
    run = simulate(load_scene(SCENES / "wheelset.yaml", ["integration.duration=1.0", "output.rate=2000"]))
    total = 0.0
    for side in ("left", "right"):
        c = run[f"wheelset/{side}"]
        total = total + np.nansum(c.N_N * np.cos(c.contact_angle_rad) + c.Fy_N * np.sin(c.contact_angle_rad), axis=1)
    # momentum balance: mean force less weight is m (vz(1) - vz(0)) per second
    expected = 1813 * (9.81 + run["wheelset"].vz_m_per_s[-1] - run["wheelset"].vz_m_per_s[0])
    assert np.trapezoid(total, run.t) == pytest.approx(expected, rel=5e-4)  # sampled at 2 kHz


def test_a_run_that_leaves_the_rails_says_so():
    # friction 0.9 and a strong yaw at 5 m/s: the flange climbs
    overrides = ["initial.yaw=0.09", "contact.friction=0.9", "speed=10", "integration.duration=3"]
    run = simulate(load_scene(SCENES / "wheelset.yaml", overrides))
    assert run.status == "derailed" and "off the track's centre" in run.reason
    assert run.t[-1] < 3.0 and np.all(np.isfinite(run["wheelset"].y_m))


def test_simulate_command_prints_json_and_writes_the_run(tmp_path, capsys):
    out = tmp_path / "run.h5"
    arguments = [
        "simulate",
        str(SCENES / "wheelset.yaml"),
        "--set",
        "integration.duration=0.1",
        "--out",
        str(out),
        "--json",
    ]
    assert main(arguments) == 0
    summary = json.loads(capsys.readouterr().out.strip().splitlines()[-1])
    keys = {"status", "simulated_s", "wall_s", "real_time_factor", "steps", "rejected", "rhs_evaluations", "compile_s"}
    assert keys <= summary.keys()
    assert summary["status"] == "completed" and summary["simulated_s"] == 0.1
    run = load_run(out)
    assert run.t[-1] == 0.1 and run["wheelset"].y_m[0] == 0.002
    # six evaluations an attempt and one to start with (rk45): the counters fit together
    assert summary["rhs_evaluations"] == 1 + 6 * (summary["steps"] + summary["rejected"])


def test_contact_command_solves_poses(tmp_path, capsys):
    poses, out = tmp_path / "poses.csv", tmp_path / "out.csv"
    poses.write_text(
        "pose_id,y_m,yaw_rad,roll_rad,z_m\nfree,0,0,,\nrolled,0.003,-0.0072,0.0001803,\nfixed,0,0,0,0.4598\n"
    )
    options = ["--wheel", "S1002", "--rail", "UIC60-MBench", "--inclination", "1/40", "--gauge", "1.435"]
    assert main(["contact", "--poses", str(poses), *options, "--wheel-load", "10000", "--out", str(out)]) == 0
    rows = list(csv.DictReader(out.open()))
    assert {(r["pose_id"], r["side"]) for r in rows} == {
        (p, s) for p in ("free", "rolled", "fixed") for s in ("left", "right")
    }
    for row in rows:
        if row["pose_id"] != "fixed":
            assert float(row["N_N"]) * math.cos(float(row["contact_angle_rad"])) == pytest.approx(1e4, rel=1e-6)
    free = next(r for r in rows if r["pose_id"] == "free")
    assert float(free["roll_rad"]) == pytest.approx(0.0, abs=1e-9)
    assert 0.46 - float(free["z_wheelset_m"]) == pytest.approx(0.1981e-3, abs=2.5e-6)  # CONTACT, A-2.2 case 1


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("pose_id,y_m\na,0\n", "yaw_rad"),
        ("pose_id,y_m,yaw_rad\na,0,x\n", "row 1"),
        ("pose_id,y_m,yaw_rad\na,inf,0\n", "row 1"),
        ("pose_id,y_m,yaw_rad\na,3,0\n", "within 0.1"),  # millimetres
        ("pose_id,y_m,yaw_rad,roll_kg\na,0,0,1\n", "unknown column"),
        ("", "CSV"),
    ],
)
def test_bad_poses_are_refused(tmp_path, capsys, text, expected):
    poses, out = tmp_path / "poses.csv", tmp_path / "out.csv"
    poses.write_text(text)
    options = ["--wheel", "S1002", "--rail", "UIC60-MBench", "--inclination", "1/40", "--wheel-load", "10000"]
    options += ["--out", str(out)]
    assert main(["contact", "--poses", str(poses), *options]) == 2
    printed = capsys.readouterr().err
    assert printed.count("\n") == 1 and "poses.csv" in printed and expected in printed
    assert not out.exists()


def test_profiles_command_lists_the_named_profiles(capsys):
    assert main(["profiles"]) == 0
    printed = capsys.readouterr().out
    assert all(name in printed for name in ("S1002", "UIC60-MBench", "60E1", "54E1"))


def test_a_collapsed_step_size_is_said_early():
    # creepages over 10 um/s make a scene so stiff that an explicit method would need half an hour for 0.5 s
    creep = {"creep": {"model": "she", "least_speed": 1e-5}}
    settings = {"duration": 0.5, "method": "tsit5", "rtol": 1e-6}
    run = simulate(ELLIPTIC / "suspended_wheelset.yaml", contact=creep, speed=1e-5, integration=settings)
    assert run.status == "stalled" and run.reason.startswith("the step size collapsed: 20000 steps")
    assert run.counters["steps"] + run.counters["rejected"] == 20_000
