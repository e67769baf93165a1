"""The study's creep table goes to the scenes whose contact reads one, and to no others."""

import pytest

import wrcore as wr
from study.creep_table import with_creep_table
from study.hard_cases.cases import prepare
from tests.conftest import SCENES

SCENE = str(SCENES / "suspended_wheelset.yaml")


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    path = tmp_path_factory.mktemp("table") / "creep.h5"
    path.write_bytes(b"")
    return str(path)


@pytest.mark.parametrize("kind", [list, dict])
@pytest.mark.parametrize(
    ("changes", "is_read"),
    [
        ({"contact.patch": "moment"}, True),
        ({"contact.patch": "maximum"}, True),
        ({"contact.patch": "exact"}, False),
        ({"contact.patch": "tabulated"}, False),
        ({"contact.patch": "moment", "contact.creep.model": "polach"}, False),
        ({"contact.patch": "moment", "contact.creep.planes": "sdec"}, False),
        ({"contact.patch": "moment", "contact.creep.tolerance": 0.05}, False),
    ],
)
def test_table_is_given_where_the_contact_reads_one(table, changes, is_read, kind):
    asked = changes if kind is dict else [f"{key}={value}" for key, value in changes.items()]
    found = with_creep_table(SCENE, asked, table)
    assert type(found) is kind and ("table" in wr.load_scene(SCENE, found).data["contact"]["creep"]) == is_read


def test_hard_case_with_another_creep_law_reads_no_table(table):
    vehicles = {"wheelset": {"scene": SCENE, "set": {"contact.patch": "moment"}, "table": table}}
    scene = prepare(vehicles, "wheelset", {"contact.creep.model": "linear"}).scene
    assert "table" not in scene.data["contact"]["creep"]


def test_table_that_a_scene_names_is_kept(table, tmp_path):
    (tmp_path / "another.h5").write_bytes(b"")
    asked = {"contact.patch": "moment", "contact.creep.table": str(tmp_path / "another.h5")}
    assert with_creep_table(SCENE, asked, table) == asked
