"""FMUs of scenes: valid, and in a master's hands the trajectory of a session; reports/fmi.md works as written."""

import json
import os
import shutil
import subprocess
import sys
from importlib.util import find_spec

import numpy as np
import pytest

import wrcore as wr
from tests.conftest import ELLIPTIC, ROOT
from tests.run.test_session import active, scene_of, stepped
from wrcore.cli import main
from wrcore.run.fmu import _pack_scene

LACKING = [name for name in ("pythonfmu", "pythonfmu3", "fmpy") if find_spec(name) is None]
NEEDS = pytest.mark.skipif(
    bool(LACKING), reason=f"pip install pythonfmu pythonfmu3 fmpy: {', '.join(LACKING)} not installed"
)
SCENE = str(ELLIPTIC / "suspended_wheelset.yaml")


@pytest.fixture(scope="module", params=[2, 3])
def unit(request, tmp_path_factory):
    """A unit of a wheelset with actuators, and its scene; the vehicle's file is gone."""
    folder = tmp_path_factory.mktemp("unit")
    changes = active(folder) | {"speed": 60}
    scene = wr.load_scene(SCENE, changes)
    path = folder / f"active_{request.param}.fmu"
    given = [word for key, value in changes.items() for word in ("--set", f"{key}={value}")]
    named = ("wheelset.y_m", "wheelset.yaw_rad", "wheelset/left.Q_N", "wheelset/left.N_N.0")
    outputs = [word for name in named for word in ("--output", name)]
    assert main(["fmu", SCENE, *given, *outputs, "--fmi", str(request.param), "--out", str(path)]) == 0
    os.unlink(changes["vehicle.parameters"])
    return str(path), scene


@pytest.mark.parametrize("name", ["wheel.csv", "wheel.slcw"])
def test_a_scene_with_slices_takes_their_profiles_along(tmp_path, name):
    """They are among its files, whose content is known, and a unit has them under names of its own."""
    u, wheel = np.linspace(-0.02, 0.03, 60), wr.named_profile("S1002", "wheel")
    (tmp_path / "sections").mkdir()
    for k in range(2):
        points = np.column_stack([u, wheel(u) + 1e-4 * k])
        file = tmp_path / "sections" / f"{k}.csv"
        np.savetxt(file, points, fmt="%.12g", delimiter=",", header="u_m,f_m", comments="")
    places = [(angle, f"sections/{k}.csv") for angle, k in ((-0.2, 0), (0.0, 1), (0.2, 0))]
    lines = ["angle_rad,profile", *(f"{angle},{file}" for angle, file in places)]
    if name.endswith("slcw"):
        lines = ["% a wheel", "0.0 1.0", "3", "0 0 0", "1", *(f"{angle} '{file}'" for angle, file in places)]
    (tmp_path / name).write_text("\n".join(lines))
    how = {"slices": str(tmp_path / name), "unit": "m", "downwards": False}
    scene = wr.load_scene(SCENE, {"wheel.left.out_of_round.slices": how})
    sections = [str(tmp_path / "sections" / f"{k}.csv") for k in range(2)]
    assert set(sections) < set(scene.files)
    edited = tmp_path / "sections" / "1.csv"
    edited.write_text(edited.read_text() + "0.0301,0.0\n")
    again = wr.load_scene(SCENE, {"wheel.left.out_of_round.slices": how})
    assert [scene.files[path] == again.files[path] for path in sections] == [True, False]
    (tmp_path / "unit").mkdir()
    _pack_scene(again, tmp_path / "unit")
    shutil.rmtree(tmp_path / "sections")
    packed = wr.load_scene(tmp_path / "unit" / "scene.yaml")
    angles = np.linspace(-0.3, 0.3, 7)
    one, other = (each.out_of_round[0][0].slices.heights(angles, u[1:-1]) for each in (again, packed))
    np.testing.assert_array_equal(one, other)


@NEEDS
def test_the_unit_is_valid_and_says_what_it_has(unit):
    import fmpy
    from fmpy.validation import validate_fmu

    assert validate_fmu(unit[0]) == []
    described = fmpy.read_model_description(unit[0])
    of = {kind: {v.name for v in described.modelVariables if v.causality == kind} for kind in ("input", "output")}
    assert of["input"] == {"left.force", "right.force"}
    assert of["output"] == {"wheelset.y_m", "wheelset.yaw_rad", "wheelset/left.Q_N", "wheelset/left.N_N.0"}
    assert described.coSimulation.canGetAndSetFMUstate


MASTER = """
import json, os, sys
import fmpy, numpy
path, out, options = sys.argv[1], sys.argv[2], json.loads(sys.argv[3])
if "input" in options:
    names, *rows = options["input"]
    options["input"] = numpy.array(list(map(tuple, rows)), list(map(tuple, names)))
fmpy.simulate_fmu(path, stop_time=0.1)  # a unit may be loaded again
numpy.save(out, fmpy.simulate_fmu(path, stop_time=0.5, step_size=0.01, output_interval=0.01, **options))
os._exit(0)  # reports/fmi.md: PythonFMU3's binary uses freed memory at exit
"""

STATES = """
import sys
import fmpy
from fmpy.fmi2 import FMU2Slave
path, folder = sys.argv[1:]
described, folder = fmpy.read_model_description(path), fmpy.extract(path, folder)
slave = FMU2Slave(guid=described.guid, unzipDirectory=folder, instanceName="kept",
                  modelIdentifier=described.coSimulation.modelIdentifier)
of = {variable.name: variable.valueReference for variable in described.modelVariables}
slave.instantiate()
slave.setupExperiment(startTime=0.0)
slave.enterInitializationMode()
slave.exitInitializationMode()

def go(first, force):
    for k in range(first, first + 10):
        slave.setReal([of["left.force"]], [force])
        slave.doStep(0.01 * k, 0.01)
    return slave.getReal([of["wheelset.y_m"], of["wheelset/left.Q_N"]])

go(0, 1e3)
state = slave.getFMUState()
first = go(10, 0.0)
assert go(20, 2e3) != first
slave.setFMUState(state)
assert go(10, 0.0) == first
print("the same")
"""


def by_master(path, folder, **options):
    """What a master makes of a unit, in a process of its own: what it loads is not wrcore's."""
    out = folder / "result.npy"
    subprocess.run([sys.executable, "-c", MASTER, path, str(out), json.dumps(options)], check=True, cwd=ROOT)
    return np.load(out)


@NEEDS
def test_a_master_gets_the_trajectory_of_a_session_to_the_bit(unit, tmp_path):
    path, scene = unit
    result, run = by_master(path, tmp_path, start_values={"left.force": 2e3}), stepped(scene, 50, left__force=2e3).run()
    assert len(result) == len(run.t) == 51
    np.testing.assert_array_equal(result["wheelset.y_m"], run["wheelset"].y_m)
    np.testing.assert_array_equal(result["wheelset.yaw_rad"], run["wheelset"].yaw_rad)
    np.testing.assert_allclose(result["wheelset/left.Q_N"], run["wheelset/left"].Q_N, rtol=1e-12)
    free = stepped(scene, 50).run()
    assert np.abs(run["wheelset"].yaw_rad - free["wheelset"].yaw_rad).max() > 1e-5


@NEEDS
def test_inputs_that_change_are_felt_when_they_change(unit, tmp_path):
    path, scene = unit
    names = [["time", "f8"], ["left.force", "f8"], ["right.force", "f8"]]
    signals = [names, (0.0, 0, 0), (0.194, 0, 0), (0.195, 3e3, -3e3), (1.0, 3e3, -3e3)]
    result, session = by_master(path, tmp_path, input=signals), wr.start(scene)
    for k in range(50):
        session.step(0.01, {"left.force": 3e3 * (k >= 20), "right.force": -3e3 * (k >= 20)})
    y = session.run()["wheelset"].y_m
    np.testing.assert_array_equal(result["wheelset.y_m"][:21], y[:21])
    # the master interpolates 3000 N with rounding, which begins steps anew: two runs of rtol 1e-4
    free = stepped(scene, 50).run()["wheelset"].y_m
    assert np.abs(result["wheelset.y_m"] - y).max() < 0.01 * np.abs(free - y).max()


@NEEDS
def test_a_state_that_a_master_keeps_is_one_to_return_to(unit, tmp_path):
    if not unit[0].endswith("2.fmu"):
        pytest.skip("the same lines of wrcore stand behind both versions; the master's calls here are those of FMI 2")
    folder = str(tmp_path / "unit")
    done = subprocess.run([sys.executable, "-c", STATES, unit[0], folder], capture_output=True, text=True, cwd=ROOT)
    assert done.stdout.split() == ["the", "same"], done.stderr


@NEEDS
def test_an_unknown_output_is_one_line(tmp_path, capsys):
    assert main(["fmu", SCENE, "--output", "wheelset.y", "--out", str(tmp_path / "x.fmu")]) == 2
    assert "no channel 'y' in 'wheelset'" in capsys.readouterr().err and not (tmp_path / "x.fmu").exists()


@NEEDS
def test_the_page_works_as_written(tmp_path):
    code = "from tests.pages import run_blocks; import os, sys; os.chdir(sys.argv[1]); run_blocks('fmi.md')"
    done = subprocess.run([sys.executable, "-c", code, tmp_path], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    session = wr.start(tmp_path / "mine/scenes/locomotive.yaml")
    for _ in range(200):
        session.step(0.01, {"controller.limit": 1e5})
    (speed,) = session.channels("car_body.vx_m_per_s").values()
    assert float(done.stdout.split()[-1]) == speed
    assert (tmp_path / "wheelset.fmu").stat().st_size > 1e5


def test_without_the_library_the_command_says_what_to_install(tmp_path, monkeypatch, capsys):
    import wrcore.run.fmu

    monkeypatch.setitem(wrcore.run.fmu.LIBRARIES, 2, ("a_library_that_there_is_not", "", "", ""))
    assert main(["fmu", SCENE, "--out", str(tmp_path / "x.fmu")]) == 2
    assert "pip install pythonfmu pythonfmu3" in capsys.readouterr().err
    assert scene_of().data["name"] == "suspended_wheelset" and not (tmp_path / "x.fmu").exists()
