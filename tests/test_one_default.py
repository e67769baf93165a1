"""What is said in several places is the same in all of them."""

import json

from tests.conftest import ROOT, SCENES
from wrcore.cli import parser
from wrcore.creep.table import DEFAULT_TOLERANCE
from wrcore.errors.checked_yaml import read_yaml
from wrcore.scene.description import load_scene


def test_there_is_one_table_tolerance():
    study = read_yaml(ROOT / "config" / "study.yaml")["creep"]
    named = {entry["name"]: entry["tolerance"] for entry in study["tables"]}
    assert study["table"]["tolerance"] == named["ellipse_default"] == named["sdec_default"] == DEFAULT_TOLERANCE
    assert load_scene(SCENES / "trailer_vehicle.yaml").data["contact"]["creep"]["tolerance"] == DEFAULT_TOLERANCE
    assert parser().parse_args(["table", "build", "--out", "x.h5"]).tolerance is None  # then the default
    schema = read_yaml(ROOT / "wrcore" / "scene" / "schemas" / "scene.yaml")
    tolerance = schema["properties"]["contact"]["properties"]["creep"]["properties"]["tolerance"]
    assert "default" not in tolerance and tolerance["description"].endswith(f"left out: {DEFAULT_TOLERANCE:g}")
    for notebook in (ROOT / "notebooks").glob("*.ipynb"):
        lines = [line for cell in json.loads(notebook.read_text())["cells"] for line in cell["source"]]
        assert not [line for line in lines if "tolerance=" in line.split("#")[0] and "table" in line], notebook
