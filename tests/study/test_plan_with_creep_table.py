"""The study's creep table goes to the scenes of a wear plan whose contact reads one, and to no others."""

import pytest

from study.creep_table import plan_with_creep_table
from study.wear.influences import variant_changes
from tests.conftest import ELLIPTIC
from wrcore.analysis.wear.evolve import load_wear_plan

RUN = {"integration.duration": 2.0}
PLAN = {
    "name": "p", "scene": str(ELLIPTIC / "suspended_wheelset.yaml"), "distance": 1e5,
    "scenes": [{"share": 1.0, "set": {**RUN, "speed": 20}}, {"share": 1.0, "set": {**RUN, "speed": 30}}],
}  # fmt: skip


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    path = tmp_path_factory.mktemp("table") / "creep.h5"
    path.write_bytes(b"")
    return str(path)


def tables_of(plan, changes):
    return [scene.data["contact"]["creep"].get("table") for scene in load_wear_plan(plan, changes)[1]]


@pytest.mark.parametrize(
    ("values", "is_read"),
    [
        ({}, True),
        ({"contact.patch": "maximum"}, True),
        ({"contact.patch": "exact"}, False),
        ({"contact.patch": "tabulated"}, False),
        ({"contact.creep.model": "polach"}, False),
        ({"contact.creep.tolerance": 0.05}, False),
    ],
)
def test_plan_gets_the_table_where_its_contact_reads_one(table, values, is_read):
    changes = plan_with_creep_table(PLAN, {"set": values}, table)
    assert tables_of(PLAN, changes) == [table if is_read else None] * 2


def test_scenes_of_one_plan_get_the_table_one_by_one(table):
    scenes = [PLAN["scenes"][0], {"share": 1.0, "set": {**RUN, "contact.patch": "exact"}}]
    assert tables_of(PLAN, plan_with_creep_table(PLAN, {"scenes": scenes}, table)) == [table, None]


def test_set_of_a_variant_stands_beside_that_of_its_plan():
    variant = {"plan": {"rate": 200.0, "set": {"speed": 20, "initial.y": 0.001}}, "set": {"speed": 30}}
    assert variant_changes(variant, 5e4) == {
        "distance": 5e4, "rate": 200.0, "set": {"speed": 30, "initial.y": 0.001}
    }  # fmt: skip
