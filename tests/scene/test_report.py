"""What reports/scenes.md tells a reader to write is what the package reads, and it says every key."""

import re

import pytest

import wrcore as wr
from tests.conftest import ROOT, SCENES
from wrcore.errors.checked_yaml import parse_value, read_yaml, schema_of
from wrcore.scene.compile import compile_scene

TEXT = (ROOT / "reports" / "scenes.md").read_text(encoding="utf-8")
BLOCKS = [parse_value(block) for block in re.findall(r"```yaml\n(.*?)```", TEXT, re.DOTALL)]


def scene_with(block):
    """The locomotive's scene with the keys of a block in place of its own."""
    content = read_yaml(SCENES / "locomotive.yaml")
    content["vehicle"]["parameters"] = str(ROOT / "config" / "vehicles" / "locomotive.yaml")
    for key, value in block.items():
        content[key] = {**content[key], **value} if key == "contact" else value
    return wr.load_scene({**content, "speed": 10.0})


@pytest.mark.parametrize("block", BLOCKS, ids=lambda block: str(block)[:60])
def test_each_block_is_a_part_of_a_scene_that_runs(block):
    scene = scene_with(block)
    model, state = compile_scene(scene)
    assert len(model.drive.rows) == sum(len(scene.data["drive"][group]) for group in ("motors", "brakes"))
    found = wr.simulate(wr.load_scene(scene, {"integration.duration": 0.05}))
    assert found.status == "completed"


def test_each_key_is_in_the_report():
    drive = schema_of("scene")["properties"]["drive"]["properties"]
    initial = schema_of("scene")["properties"]["initial"]["properties"]
    keys = {
        *initial,
        "k_A",
        "k_S",
        *initial["bodies"]["additionalProperties"]["properties"],
        *drive,
        *drive["controller"]["properties"],
        *drive["motors"]["items"]["properties"],
    }
    assert [key for key in sorted(keys) if not re.search(rf"\b{key}\b", TEXT)] == []
