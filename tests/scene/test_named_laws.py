"""A scene is data: laws that it names lie beside it, are read with it, and run when it is simulated and trusted."""

import os
import subprocess
import sys
from importlib.metadata import EntryPoint
from pathlib import Path

import numpy as np
import pytest
import yaml

import wrcore as wr
from tests.conftest import ELLIPTIC, ROOT
from wrcore.cli import main
from wrcore.errors import InputError
from wrcore.errors.checked_yaml import read_yaml
from wrcore.kernels.named_laws import GROUP
from wrcore.scene.compile import compile_scene

MARKED = (
    "from pathlib import Path\nPath(__file__).with_name('ran').touch()\n\n\ndef law(s):\n    return {mu} + 0.0 * s\n"
)
SPRING = "\n\ndef spring(stretch, speed, states, parameters, rates):\n    return 1e3 * stretch\n"
GRID = {"length": 40.0, "spacing": 1.0}


def write(folder, law="law.py:law", element="", mu=0.3, **changes):
    """A scene with a law of friction, and of an element, in a folder; each module leaves a file ``ran`` beside it."""
    folder.mkdir(exist_ok=True)
    vehicle, scene = (read_yaml(ELLIPTIC.parent / f"{kind}/suspended_wheelset.yaml") for kind in ("vehicles", "scenes"))
    if element:
        vehicle["elements"].append({"name": "mine", "kind": "own_law", "direction": "y", "at": [0, 0, 0.46],
                                    "bodies": ["wheelset", "frame"], "law": element})  # fmt: skip
    vehicle["elements"].append({"name": "push", "kind": "actuator", "direction": "y", "at": [0, 0, 0.46],
                                "bodies": ["wheelset", "frame"]})  # fmt: skip
    (folder / "v.yaml").write_text(yaml.safe_dump(vehicle))
    scene |= {"vehicle": {"parameters": "v.yaml"}, "speed": 30.0, "initial": {"y": 0.003}}
    scene["integration"] = {"duration": 0.1}
    scene["contact"] |= {"patch": "moment", "friction": {"law": law, **GRID}} | changes
    (folder / "s.yaml").write_text(yaml.safe_dump(scene))
    (folder / "law.py").write_text(MARKED.format(mu=mu) + SPRING)
    return folder / "s.yaml"


FOREIGN = ["sys:exit", "os:_exit", "builtins:input", "antigravity:geohash", "numpy:cos", "wrcore.cli:main", "this.py:d"]


@pytest.mark.parametrize("law", [*FOREIGN, "../outside.py:law", "/usr/lib/python3/os.py:law", "link.py:law"])
@pytest.mark.parametrize("where", ["friction", "element", "creep", "control", "irregularity"])
def test_law_elsewhere_is_refused_before_any_import(tmp_path, law, where):
    path = write(tmp_path / "scene", **({"element": law} if where == "element" else {}))
    (tmp_path / "outside.py").write_text(MARKED.format(mu=0.1))
    (path.parent / "link.py").symlink_to(tmp_path / "outside.py")
    data = read_yaml(path)
    if where == "friction":
        data["contact"]["friction"]["law"] = law
    if where == "creep":
        data["contact"]["creep"] = {"model": law}
    if where == "control":
        data["control"] = {"c": {"law": law, "rate": 50, "inputs": [], "outputs": ["push"]}}
    if where == "irregularity":
        data["track"]["irregularity"] = {"own": {"law": law, **GRID}}
    path.write_text(yaml.safe_dump(data))
    before = set(sys.modules)
    with pytest.raises(InputError) as caught:
        wr.load_scene(path)
    assert "\n" not in str(caught.value) and "file" in caught.value.expected
    assert not {"antigravity", "this"} & (set(sys.modules) - before)
    assert not (tmp_path / "ran").exists()


def test_module_is_imported_by_no_command(tmp_path, capsys):
    path = write(tmp_path, "antigravity:geohash")
    assert (
        main(["simulate", str(path)]) == 2
        and "contact.friction.law: expected file.py:function" in capsys.readouterr().err
    )
    assert "antigravity" not in sys.modules


def test_reading_and_drawing_run_nothing(tmp_path):
    path = write(tmp_path, element="law.py:spring")
    scene = wr.load_scene(path)
    wr.draw(scene)
    assert main(["draw", str(path), "--out", str(tmp_path / "x.svg")]) == 0
    assert not (tmp_path / "ran").exists()
    assert scene.laws.digests.keys() == {"law.py:law", "law.py:spring"}
    assert wr.simulate(scene, progress=False).status == "completed" and (tmp_path / "ran").exists()


def test_law_that_a_person_names_lies_anywhere(tmp_path):
    write(tmp_path)
    law = {"law": f"{tmp_path}/law.py:law", **GRID}
    scene = wr.load_scene(ELLIPTIC / "suspended_wheelset.yaml", {"contact.friction": law, "contact.patch": "moment"})
    assert compile_scene(scene)[0].contact.friction == pytest.approx(0.3)
    vehicle = {"parameters": str(ELLIPTIC.parent / "vehicles/suspended_wheelset.yaml")}
    with pytest.raises(InputError, match="beside the one that names it"):
        wr.load_scene({**scene.data, "vehicle": vehicle})


def test_function_itself_is_a_law():
    law = {"law": constant, **GRID}
    scene = wr.load_scene(ELLIPTIC / "suspended_wheelset.yaml", {"contact.friction": law, "contact.patch": "moment"})
    assert compile_scene(scene)[0].contact.friction == pytest.approx(0.27)


def constant(s):
    return 0.27 + 0.0 * s


def test_installed_law_is_found_by_its_entry_point(monkeypatch):
    entries = [EntryPoint("leaves", f"{__name__}:constant", GROUP), EntryPoint("lost", "no_such_module:law", GROUP)]
    monkeypatch.setattr("importlib.metadata.entry_points", lambda group: entries if group == GROUP else [])
    changes = {"contact.friction": {"law": "leaves", **GRID}, "contact.patch": "moment"}
    assert compile_scene(wr.load_scene(ELLIPTIC / "suspended_wheelset.yaml", changes))[0].contact.friction == 0.27
    with pytest.raises(InputError, match=r"contact\.friction\.law: .*ModuleNotFoundError"):
        wr.load_scene(ELLIPTIC / "suspended_wheelset.yaml", {"contact.friction": {"law": "lost", **GRID}})


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    """A run file in the folder of its scene, whose laws have run."""
    folder = tmp_path_factory.mktemp("stored")
    path = write(folder, element="law.py:spring")
    scene = wr.load_scene(path, {"output.channels": ["pose", "velocity", "contact", "wheel_motion"]})
    wr.simulate(scene, progress=False).save(folder / "r.h5")
    return folder


@pytest.fixture
def folder(stored, monkeypatch):
    monkeypatch.chdir(stored)
    (stored / "law.py").write_text(MARKED.format(mu=0.3) + SPRING)
    (stored / "ran").unlink(missing_ok=True)
    return stored


def test_run_file_runs_no_law_unasked(folder, capsys):
    run = wr.load_run("r.h5")
    wr.draw("r.h5")
    assert main(["draw", "r.h5", "--out", "x.html"]) == 0
    wr.local_wear(run)
    wr.load_scene(run.scene)
    asked = (
        lambda: wr.simulate(run.scene, progress=False),
        lambda: wr.patch_in_run(run, 0.05, "wheelset"),
        lambda: wr.local_wear(run, patches="exact"),
        lambda: wr.start(run.scene),
    )
    for ask in asked:
        with pytest.raises(InputError, match=r"trust=True \(--trust\)") as caught:
            ask()
        assert "\n" not in str(caught.value) and "law.py:law" in str(caught.value)
    assert not (folder / "ran").exists()


def test_run_file_that_is_trusted_runs_its_laws(folder):
    run = wr.load_run("r.h5")
    again = wr.simulate(wr.load_scene(run.scene, trust=True), progress=False)
    np.testing.assert_array_equal(again["wheelset"].y_m, run["wheelset"].y_m)
    assert wr.patch_in_run(run, 0.05, "wheelset", trust=True)


def test_wear_of_a_run_is_that_of_its_own_friction(folder):
    run = wr.load_run("r.h5")
    first = wr.local_wear(run)[("wheelset", "left")]
    (folder / "law.py").write_text(MARKED.format(mu=0.05))
    assert wr.local_wear(run)[("wheelset", "left")].volume == first.volume
    with pytest.raises(InputError, match="hold something else now|changed since"):
        wr.local_wear(run, patches="exact", trust=True)
    (folder / "law.py").unlink()
    assert wr.local_wear(run)[("wheelset", "left")].volume == first.volume


def test_run_of_a_function_that_changed_is_refused(monkeypatch):
    """A function of a module has no file among those of the scene."""
    channels = ["pose", "velocity", "contact", "wheel_motion"]
    changes = {"contact.friction": {"law": constant, **GRID}, "contact.patch": "moment", "output.channels": channels}
    scene = wr.load_scene(ELLIPTIC / "suspended_wheelset.yaml", changes, integration__duration=0.05)
    run = wr.simulate(scene, progress=False)
    assert wr.patch_in_run(run, 0.02, "wheelset")
    monkeypatch.setitem(wr.errors.checked_yaml.GIVEN, f"{__name__}:constant", lambda s: 0.1 + 0.0 * s)
    with pytest.raises(InputError, match="changed since"):
        wr.patch_in_run(run, 0.02, "wheelset")


def test_scene_loaded_before_an_edit_runs_the_text_it_read(tmp_path):
    path = write(tmp_path, element="law.py:spring", mu=0.3)
    scene = wr.load_scene(path)
    first = wr.simulate(scene, progress=False)
    (tmp_path / "law.py").write_text(MARKED.format(mu=0.05) + SPRING.replace("1e3", "1e7"))
    for later in (scene, wr.load_scene(scene, speed=30.0)):
        again = wr.simulate(later, progress=False)
        np.testing.assert_array_equal(again["wheelset"].y_m, first["wheelset"].y_m)
        assert again.settings["laws_sha256"] == first.settings["laws_sha256"]
    edited = wr.simulate(path, progress=False)
    assert np.abs(edited["wheelset"].y_m - first["wheelset"].y_m).max() > 1e-6
    assert edited.settings["laws_sha256"] != first.settings["laws_sha256"]


def test_machine_code_beside_a_law_is_not_loaded(tmp_path):
    """Files of numba in ``__pycache__`` may be of another text."""
    path = write(tmp_path, **{"friction": 0.3, "creep": {"model": "creep.py:law"}})
    text = "from numba import njit\n\n\n@njit(cache=True)\ndef law(ratio, psi, kalker, xi, eta, phi):\n"
    (tmp_path / "creep.py").write_text(f"{text}    return -xi, -eta, 0.0\n")
    assert wr.simulate(path, progress=False).status == "completed"
    assert not list(tmp_path.rglob("*.nb?"))


def test_plan_of_a_sweep_names_laws_beside_it_only(tmp_path):
    path = write(tmp_path / "scene")
    (tmp_path / "outside.py").write_text(MARKED.format(mu=0.1))
    sweep = {"name": "s", "scene": str(path), "sampling": {"kind": "grid"}, "measures": ["y_max_m"],
             "keys": {"contact.friction.law": {"values": ["law.py:law"]}}}  # fmt: skip
    plan = tmp_path / "plans" / "sweep.yaml"
    plan.parent.mkdir()
    for law in ("sys:exit", "../outside.py:law"):
        plan.write_text(yaml.safe_dump(sweep | {"set": {"contact.friction.law": law}}))
        with pytest.raises(InputError):
            wr.load_sweep(plan)
        plan.write_text(yaml.safe_dump(sweep | {"keys": {"contact.friction.law": {"values": [law]}}}))
        with pytest.raises(InputError):
            wr.load_sweep(plan)
    (plan.parent / "near.py").write_text(MARKED.format(mu=0.2))
    sweep["keys"]["contact.friction.law"]["values"] = ["law.py:law", "near.py:law"]
    plan.write_text(yaml.safe_dump(sweep))
    assert set(wr.run_sweep(wr.load_sweep(plan)).status) == {"completed"}


def test_fmu_takes_the_text_of_laws_along(tmp_path):
    from wrcore.run.fmu import _pack_scene

    path = write(tmp_path / "scene", element="law.py:spring", mu=0.25)
    scene = wr.load_scene(path)
    (tmp_path / "scene" / "law.py").write_text("")
    (tmp_path / "unit").mkdir()
    _pack_scene(scene, tmp_path / "unit")
    one, other = (compile_scene(each)[0] for each in (scene, wr.load_scene(tmp_path / "unit" / "scene.yaml")))
    assert one.contact.friction == other.contact.friction == 0.25
    np.testing.assert_array_equal(one.elements.own, other.elements.own)


def test_law_of_a_file_is_pickled_with_its_scene(tmp_path):
    path = write(tmp_path, element="law.py:spring")
    script = "import pickle, sys; from wrcore.scene.compile import compile_scene;"
    script += "print(compile_scene(pickle.load(open(sys.argv[1], 'rb')))[0].contact.friction)"
    import pickle

    (tmp_path / "scene.pickle").write_bytes(pickle.dumps(wr.load_scene(path)))
    os.unlink(tmp_path / "law.py")
    done = subprocess.run([sys.executable, "-c", script, tmp_path / "scene.pickle"], capture_output=True, text=True,
                          env=os.environ | {"PYTHONPATH": str(ROOT)})  # fmt: skip
    assert done.stdout.strip() == "0.3", done.stderr
    assert Path(tmp_path / "ran").exists()
