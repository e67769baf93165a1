"""Keys that have no effect beside the value of another key: refused where stated, left out where a change does it."""

import copy

import pytest

import wrcore as wr
from tests.conftest import SCENES
from wrcore.creep.table import DEFAULT_TOLERANCE
from wrcore.errors import InputError
from wrcore.errors.checked_yaml import read_yaml
from wrcore.scene import void_keys
from wrcore.scene.changes import set_at
from wrcore.scene.void_keys import VOID_KEYS
from wrcore.sweep.batch import _changed

SCENE = SCENES / "suspended_wheelset.yaml"

TABLE = "pyproject.toml"
"""A file that stands for a creep table, which loading a scene does not read."""

FALLING = "contact.friction.falling"
ACROSS = {"angle": [0.2, 0.5], "factor": [1.0, 0.3]}
TANGENT = {"track.path": "tangent"}
CANTED = {"track.path": [{"tangent": 50.0}, {"transition": 60.0}, {"curve": 100.0, "radius": 600.0, "cant": 0.1}]}
WIDENED = {"track.path": [{"tangent": 50.0}, {"transition": 60.0}, {"curve": 100.0, "radius": 200.0, "widening": 0.01}]}

CASES = [
    ("track.rounding", WIDENED, 3.0, TANGENT),
    ("track.cant_about", CANTED, "centreline", TANGENT),
    ("track.rail_climb", CANTED, False, TANGENT),
    ("track.widened", WIDENED, "left", TANGENT),
    ("vehicle.spacing", {"vehicle.count": 2}, 10.0, {"vehicle.count": 1}),
    ("contact.resolution", {"contact.patch": "exact"}, "coarse", {"contact.patch": "moment"}),
    ("contact.slip", {"contact.patch": "tabulated"}, "creepages", {"contact.patch": "maximum"}),
    ("contact.detection_tolerance", {"contact.detection": "auto"}, 1e-6, {"contact.detection": "planar"}),
    ("contact.normal.damping.v0", {"contact.normal.damping.c_e": 0.7}, 0.1, {"contact.normal.damping.c_e": 1.0}),
    (f"{FALLING}.decay", {f"{FALLING}.ratio": 0.7}, 0.4, {f"{FALLING}.ratio": 1.0}),
    (f"{FALLING}.ratio", {f"{FALLING}.decay": 0.4}, 0.7, {f"{FALLING}.decay": 0.0}),
    ("contact.friction.across", {"contact.patch": "exact"}, ACROSS, {"contact.patch": "tabulated"}),
    ("contact.creep.k_A", {"contact.creep.model": "polach"}, 0.5, {"contact.creep.model": "linear"}),
    ("contact.creep.k_S", {"contact.creep.model": "polach"}, 0.5, {"contact.creep.model": "table"}),
    ("contact.creep.planes", {"contact.creep.model": "table"}, "sdec", {"contact.creep.model": "she"}),
    ("contact.creep.tolerance", {"contact.creep.model": "table"}, 0.02, {"contact.creep.model": "she"}),
    ("contact.creep.tolerance", {"contact.creep.model": "table"}, 0.02, {"contact.patch": "tabulated"}),
    ("contact.creep.tolerance", {"contact.creep.model": "table"}, 0.02, {"contact.patch": "exact"}),
    ("contact.creep.planes", {"contact.creep.model": "table"}, "sdec", {"contact.patch": "maximum"}),
    ("contact.creep.table", {"contact.creep.model": "table"}, TABLE, {"contact.creep.model": "fastsim"}),
    ("contact.creep.table", {"contact.creep.model": "table"}, TABLE, {"contact.patch": "tabulated"}),
    ("contact.creep.table", {"contact.creep.model": "table"}, TABLE, {"contact.patch": "exact"}),
    ("contact.creep.planes", {"contact.creep.model": "table"}, "sdec", {"contact.creep.table": TABLE}),
    ("contact.creep.tolerance", {"contact.creep.model": "table"}, 0.02, {"contact.creep.table": TABLE}),
    ("integration.step", {"integration.method": "rk4"}, 1e-4, {"integration.method": "scipy_rk45"}),
    ("integration.rtol", {"integration.step": 0.0}, 1e-6, {"integration.step": 1e-4}),
    ("integration.atol", {"integration.step": 0.0}, 1e-8, {"integration.step": 1e-4}),
    ("integration.longest_step", {"integration.step": 0.0}, 0.01, {"integration.step": 1e-4}),
]  # fmt: skip
"""Key, what it has an effect beside, a value, and what makes it void."""

EACH = pytest.mark.parametrize(
    ("key", "valid", "value", "voider"), CASES, ids=[f"{key} beside {''.join(voider)}" for key, _, _, voider in CASES]
)


def scene_with(changes):
    """Content of a scene with the patch model moment, and values by key path."""
    data = copy.deepcopy(read_yaml(SCENE))
    data["vehicle"]["parameters"] = read_yaml(SCENES.parent / data["vehicle"]["parameters"])
    data["integration"].pop("rtol")
    data["contact"]["friction"] = {"mu": 0.3}
    for key, value in ({"contact.patch": "moment"} | changes).items():
        set_at(data, key, value, "test")
    return data


def test_each_void_key_has_a_case_here():
    assert {(rule.key, rule.by) for rule in VOID_KEYS} == {(key, *voider) for key, _, _, voider in CASES}


@EACH
def test_key_stated_beside_what_makes_it_void_is_refused(key, valid, value, voider):
    (by, other), *_ = voider.items()
    for asked in (lambda: wr.load_scene(scene_with({**voider, key: value})),
                  lambda: wr.load_scene(scene_with(voider), {key: value}),
                  lambda: wr.load_scene(scene_with({}), {**voider, key: value})):  # fmt: skip
        with pytest.raises(InputError, match=f"^(scene|changes): {key}: expected no such key beside {by} '?{other}"):
            asked()


@EACH
def test_key_of_the_scene_made_void_by_a_change_is_left_out(key, valid, value, voider, monkeypatch):
    said = []
    monkeypatch.setattr(void_keys, "tell", said.append)
    scene = wr.load_scene(scene_with({**valid, key: value}))
    assert not said
    default = wr.load_scene(scene_with(voider)).data
    for source in (scene, scene_with({**valid, key: value})):
        assert wr.load_scene(source, voider).data == default
    assert len(said) == 2 and all(f"{key} {value!r} is left out" in line and "\n" not in line for line in said)


@EACH
def test_scene_with_all_defaults_is_read_again(key, valid, value, voider):
    data = wr.load_scene(scene_with(voider)).data
    assert wr.load_scene(data).data == data


def test_scene_of_a_sweep_keeps_keys_that_some_of_its_runs_use():
    plan = {
        "name": "s", "scene": scene_with({}), "sampling": {"kind": "grid"}, "set": {"contact.resolution": "coarse"},
        "keys": {"contact.patch": {"values": ["exact", "moment"]}},
    }  # fmt: skip
    assert wr.load_sweep(plan).scene.data["contact"]["resolution"] == "coarse"
    with pytest.raises(InputError, match="contact.resolution: expected no such key beside contact.patch 'moment'"):
        wr.load_sweep(plan | {"keys": {"speed": {"values": [20.0]}}})
    with pytest.raises(InputError, match="keys.contact.slip: .*contact.slip: expected no such key"):
        wr.load_sweep(plan | {"set": {}, "keys": {"contact.slip": {"values": ["creepages"]}}})


def test_run_of_a_sweep_reads_the_table_that_a_single_run_reads():
    plan = {
        "name": "s", "scene": scene_with({}), "sampling": {"kind": "grid"}, "set": {"contact.creep.tolerance": 0.05},
        "keys": {"contact.patch": {"values": ["moment", "tabulated"]}},
    }  # fmt: skip
    sweep = wr.load_sweep(plan)
    made = [_changed(sweep.scene, values).data["contact"]["creep"] for values in sweep.runs.to_dict("records")]
    assert [creep["tolerance"] for creep in made] == [0.05, DEFAULT_TOLERANCE]


@pytest.mark.parametrize(("key", "value", "path"), [("widened", "left", CANTED), ("cant_about", "centreline", WIDENED)])
def test_key_of_cant_or_widening_beside_the_other_is_refused(key, value, path):
    with pytest.raises(InputError, match=f"track.{key}: expected no such key beside track.path .*, which has no "):
        wr.load_scene(scene_with(path), {f"track.{key}": value})
