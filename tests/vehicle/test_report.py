"""What reports/vehicle_files.md tells a reader to write is what the package reads."""

import re

import pytest
import yaml

from tests.conftest import ROOT
from wrcore.errors.checked_yaml import parse_value
from wrcore.forces.kinds import KINDS
from wrcore.vehicle.description import build_vehicle

TEXT = (ROOT / "reports" / "vehicle_files.md").read_text(encoding="utf-8")
VEHICLE, *EXAMPLES = (parse_value(block) for block in re.findall(r"```yaml\n(.*?)```", TEXT, re.DOTALL))
BOLSTER = {"kind": "body", "mass": 500.0, "inertia": {"roll": 1.0, "pitch": 1.0, "yaw": 1.0}, "position": [0, 0, 0.9]}


@pytest.mark.parametrize(
    "item", [item for block in EXAMPLES if isinstance(block, list) for item in block], ids=lambda item: item["name"]
)
def test_each_example_is_a_part_of_a_vehicle(item, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, text in re.findall(r"```python\n# file: (\S+)\n(.*?)```", TEXT, re.DOTALL):
        (tmp_path / name).write_text(text)
    data = yaml.safe_load(yaml.safe_dump(VEHICLE))
    if item["kind"] in KINDS:
        data["elements"].append(item)
    else:
        data["bodies"]["bolster"] = BOLSTER
        data["joints"] = [item]
    assert build_vehicle(data, "report", axle_boxes=False).body_names


def test_each_kind_and_each_of_its_keys_is_in_the_report():
    for kind, said in KINDS.items():
        heading = re.search(rf"^### {kind}:.*?(?=^##|\Z)", TEXT, re.DOTALL | re.MULTILINE)
        assert heading, kind
        for key in said.keys:
            assert key == "at" or f"`{key}`" in heading.group(), (kind, key)
