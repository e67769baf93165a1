"""What reports/tracks.md tells a reader to write is what the package reads and runs."""

import re

import pytest
import yaml

from tests.conftest import ELLIPTIC, ROOT
from wrcore.errors.checked_yaml import parse_value
from wrcore.run.simulate import simulate
from wrcore.scene.description import load_scene

TEXT = (ROOT / "reports" / "tracks.md").read_text(encoding="utf-8")
BLOCKS = [parse_value(block) for block in re.findall(r"```yaml\n(.*?)```", TEXT, re.DOTALL)]


@pytest.mark.parametrize("track", BLOCKS, ids=lambda track: ",".join(track))
def test_each_example_runs(track):
    scene = load_scene(ELLIPTIC / "suspended_wheelset.yaml", {"track": track, "integration.duration": 1.0})
    run = simulate(scene)
    assert run.status == "completed" and run["wheelset"].s_m[-1] > 19.0


def test_each_key_is_on_the_page():
    schema = yaml.safe_load((ROOT / "wrcore" / "scene" / "schemas" / "track.yaml").read_text(encoding="utf-8"))

    def keys(part):
        for key, inner in part.get("properties", {}).items():
            yield key
            yield from keys(inner)
            yield from keys(inner.get("items", {}))

    for key in keys(schema):
        assert f"`{key}`" in TEXT or f"{key}:" in TEXT, key
