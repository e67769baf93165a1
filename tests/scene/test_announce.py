"""One line on stderr before work that takes long, terminal or not."""

import time

import pytest

from tests.conftest import ELLIPTIC
from wrcore.errors.messages import _say_once, say_if_long, tell
from wrcore.kernels.jit import jit
from wrcore.scene import compile as scene_compile
from wrcore.scene.description import load_scene
from wrcore.scene.parts import creep
from wrcore.scene.parts.creep import creep_of


@pytest.fixture
def scene():
    return load_scene(ELLIPTIC / "suspended_wheelset.yaml")


@pytest.mark.parametrize(("there", "lines"), [(True, 0), (False, 1)])
def test_a_table_that_must_be_built_is_announced(scene, there, lines, monkeypatch, capsys):
    class Known(Exception):
        pass

    def ensure(*_):
        raise Known

    monkeypatch.delenv("WRCORE_PROGRESS", raising=False)
    monkeypatch.setattr(creep, "kept_tables", lambda *_: ["a table"] if there else [])
    monkeypatch.setattr(creep, "ensure_table", ensure)
    _say_once.cache_clear()
    with pytest.raises(Known):
        creep_of(scene, None)
    said = capsys.readouterr().err.splitlines()
    assert len(said) == lines and all("creep table" in line for line in said)


def test_compiling_is_told_once_when_it_takes_long(monkeypatch, capsys):
    monkeypatch.delenv("WRCORE_PROGRESS", raising=False)
    monkeypatch.setattr("wrcore.errors.messages.PATIENCE", 0.0)
    _say_once.cache_clear()
    for factor in (2.0, 3.0):
        assert jit(lambda x, factor=factor: factor * x + 1.0, cache=False)(1.0) == factor + 1.0
    (said,) = capsys.readouterr().err.splitlines()
    assert "compiling" in said


def test_no_line_where_none_is_wanted(monkeypatch, capsys):
    monkeypatch.setenv("WRCORE_PROGRESS", "0")
    monkeypatch.setattr("wrcore.errors.messages.PATIENCE", 0.0)
    _say_once.cache_clear()
    tell("work")
    with say_if_long("work that takes long"):
        time.sleep(0.05)
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(("detection", "lines"), [("spatial", 0), ("planar", 1), ("auto", 1)])
def test_contact_that_cannot_be_looked_up_is_announced(detection, lines, monkeypatch):
    class Known(Exception):
        pass

    def known(*_):
        raise Known

    said = []
    monkeypatch.setattr(scene_compile, "tell", said.append)
    monkeypatch.setattr(scene_compile, "_kept", known)
    changes = {"contact.patch": "tabulated", "contact.detection": detection}
    with pytest.raises(Known):
        scene_compile.compile_scene(load_scene(ELLIPTIC / "suspended_wheelset.yaml", changes))
    assert len(said) == lines and all("contact.patch to moment" in line for line in said)


@pytest.mark.parametrize(
    ("least", "patch", "lines"), [(0.1, "tabulated", 1), (0.28, "tabulated", 0), (0.1, "moment", 0)]
)
def test_friction_that_falls_along_a_rail_is_announced_where_contact_is_looked_up(least, patch, lines, monkeypatch):
    said = []
    monkeypatch.setattr(scene_compile, "tell", said.append)
    friction = {"left": 0.3, "right": {"arc_length": [10, 20], "mu": [0.3, least]}}
    changes = {"contact.patch": patch, "contact.friction": friction}
    scene_compile.compile_scene(load_scene(ELLIPTIC / "suspended_wheelset.yaml", changes))
    assert len(said) == lines and all("half" in line for line in said)
