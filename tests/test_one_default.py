"""What is said in several places is the same in all of them."""

import json

from tests.conftest import ROOT, SCENES
from wrcore.analysis.assessment.assess import STANDARDS
from wrcore.analysis.contact.loaded import GRIDS, MODELS
from wrcore.analysis.to_accuracy import QUANTITIES
from wrcore.cli import parser
from wrcore.contact.patch.model import PATCHES, RESOLUTIONS, SLIPS
from wrcore.contact.search.detection import DETECTIONS
from wrcore.creep.table import DEFAULT_TOLERANCE
from wrcore.errors.checked_yaml import read_yaml
from wrcore.integrate.integrator import METHODS, REFERENCES
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


def test_words_of_schemas_and_commands_are_those_of_the_code():
    keys = read_yaml(ROOT / "wrcore" / "scene" / "schemas" / "scene.yaml")["properties"]
    contact, method = keys["contact"]["properties"], keys["integration"]["properties"]["method"]
    known = {"patch": PATCHES, "resolution": RESOLUTIONS, "slip": SLIPS, "detection": DETECTIONS}
    assert {name: contact[name]["enum"] for name in known} == {name: [*words] for name, words in known.items()}
    assert sorted(method["enum"]) == sorted(["auto", *METHODS, *REFERENCES])
    commands = next(action for action in parser()._actions if hasattr(action, "add_parser")).choices
    options = {name: {a.dest: a for a in command._actions} for name, command in commands.items()}
    asked = {name: [*options["contact"][name].choices] for name in known}
    wanted = {"patch": MODELS, "resolution": GRIDS, "slip": SLIPS, "detection": ("planar", "spatial")}
    assert asked == {name: [*words] for name, words in wanted.items()}
    assert options["simulate"]["accuracy_of"].metavar == "|".join(QUANTITIES)
    assert options["assess"]["standard"].metavar == "|".join(map(repr, STANDARDS))
