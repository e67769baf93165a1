"""reports/own_physics.md works as written, and its numbers are those of the runs."""

import re

import pytest

from tests.conftest import ROOT
from tests.pages import run_blocks


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder in which all blocks were run in their order."""
    place = tmp_path_factory.mktemp("physics")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(place)
        run_blocks("own_physics.md", ("toml",))
    return place


def test_every_block_ran(folder, capfd):
    assert {"kinked.py", "damped.yaml", "mine.py"} <= {path.name for path in folder.iterdir()}


def test_control_keys_are_on_the_page():
    import yaml

    schema = yaml.safe_load((ROOT / "wrcore/scene/schemas/scene.yaml").read_text("utf-8"))
    text = (ROOT / "reports/own_physics.md").read_text("utf-8")
    control = schema["properties"]["control"]["additionalProperties"]["properties"]
    assert [key for key in control if not re.search(rf"^\| `{key}` \|", text, re.MULTILINE)] == []
