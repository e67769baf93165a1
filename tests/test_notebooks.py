"""Notebooks are kept as a person opens them: no outputs, no numerics of their own; the workflow executes them."""

import ast
import json

import pytest

from tests.conftest import ROOT

NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))
SUBJECTS = {"contact_geometry", "creep_table", "wheelset_hunting", "trailer_vehicle", "speed_against_error"}


def code(path):
    return [cell for cell in json.loads(path.read_text())["cells"] if cell["cell_type"] == "code"]


def test_all_are_there():
    assert {path.stem for path in NOTEBOOKS} == SUBJECTS | {"first_light"}


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_kept_without_outputs_and_with_lines_to_change(path):
    assert all(cell["outputs"] == [] and cell["execution_count"] is None for cell in code(path))
    if path.stem != "first_light":
        assert sum("change" in line for cell in code(path) for line in cell["source"]) >= 3


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_what_it_takes_is_said_before_anything_runs(path):
    first = json.loads(path.read_text())["cells"][0]
    assert first["cell_type"] == "markdown" and "seconds" in "".join(first["source"])


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_none_needs_the_study_to_have_run(path):
    assert "results/" not in "".join("".join(cell["source"]) for cell in code(path))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_no_numerics_of_their_own(path):
    source = "\n".join("".join(cell["source"]) for cell in code(path)).replace("%matplotlib inline", "")
    tree = ast.parse(source)
    assert not [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.While | ast.Lambda)]
    modules = {node.module.split(".")[0] for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.module}
    modules |= {name.name.split(".")[0] for n in ast.walk(tree) if isinstance(n, ast.Import) for name in n.names}
    assert modules <= {"wrcore", "numpy", "pandas", "os", "pathlib"}
