"""The scene of a run file names no law that is run unasked, whatever the scene is put into."""

import copy
import pickle
from itertools import count

import pytest

import wrcore as wr
from tests.conftest import ROOT, SCENES
from wrcore.errors import InputError
from wrcore.scene.stored import StoredScene

LAW = "from pathlib import Path\nPath(__file__).with_name('ran').touch()\nraise RuntimeError\n"
VEHICLE = ROOT / "config" / "vehicles" / "suspended_wheelset.yaml"
FRICTION = {"law": "law.py:law", "length": 40.0, "spacing": 1.0}
NUMBERS = count()


@pytest.fixture
def stored(tmp_path, monkeypatch):
    """Content of a scene whose law leaves a file when it is run."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "law.py").write_text(f"# {next(NUMBERS)}\n{LAW}")
    scene = wr.load_scene(SCENES / "suspended_wheelset.yaml", contact__friction=0.3)
    vehicle = {**scene.data["vehicle"], "parameters": str(VEHICLE)}
    contact = {**scene.data["contact"], "friction": FRICTION}
    return StoredScene({**scene.data, "vehicle": vehicle, "contact": contact})


def a_sweep(scene):
    sampling = {"kind": "grid"}
    return {"name": "s", "scene": scene, "sampling": sampling, "keys": {"speed": {"values": [20.0]}}}


WAYS = {
    "as it is": lambda scene: wr.simulate(scene, progress=False),
    "copied": lambda scene: wr.simulate(scene.copy(), progress=False),
    "copied by module": lambda scene: wr.simulate(copy.copy(scene), progress=False),
    "copied deeply": lambda scene: wr.simulate(copy.deepcopy(scene), progress=False),
    "pickled": lambda scene: wr.simulate(pickle.loads(pickle.dumps(scene)), progress=False),
    "joined": lambda scene: wr.simulate(scene | {"speed": 30.0}, progress=False),
    "joined to": lambda scene: wr.simulate({"speed": 30.0} | scene, progress=False),
    "changed": lambda scene: wr.simulate(scene, progress=False, speed=30.0),
    "changed twice": lambda scene: wr.simulate(wr.load_scene(wr.load_scene(scene), speed=30.0), progress=False),
    "its law named": lambda scene: wr.simulate(scene, {"contact.friction.law": "law.py:law"}, progress=False),
    "one of many": lambda scene: wr.simulate_many([scene], progress=False),
    "in a sweep": lambda scene: wr.run_sweep(a_sweep(scene)),
    "in a sweep that is copied": lambda scene: wr.run_sweep(copy.deepcopy(a_sweep(scene))),
    "in a sweep that is read": lambda scene: wr.run_sweep(wr.load_sweep(a_sweep(scene), ["speed=30"])),
}


@pytest.mark.parametrize("way", WAYS)
def test_stored_scene_is_not_run_in_any_dress(way, stored, tmp_path):
    with pytest.raises(InputError, match=r"trust=True \(--trust\)"):
        WAYS[way](stored)
    assert not (tmp_path / "ran").exists()


@pytest.mark.parametrize("value", [3, None, [1]])
def test_vehicle_that_is_no_mapping_is_refused(value):
    with pytest.raises(InputError, match="vehicle: expected a mapping|but the key is missing"):
        wr.load_scene(SCENES / "suspended_wheelset.yaml", {"vehicle": value})
    with pytest.raises(InputError, match="vehicle"):
        sweep = {"name": "s", "scene": SCENES / "suspended_wheelset.yaml", "sampling": {"kind": "grid"}}
        wr.load_sweep({**sweep, "keys": {"vehicle": {"values": [value]}}})
