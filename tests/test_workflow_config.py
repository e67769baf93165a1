"""The study's configuration: what is wrong stops before any job, what can be set is described."""

import ast
import inspect
import re
import subprocess
import sys

import pytest
import yaml

from study.hard_cases.study import FAMILIES
from tests.conftest import ROOT

SCHEMA = yaml.safe_load((ROOT / "workflow/schemas/config.schema.yaml").read_text())


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"paper": {"timing": {"repetitions": "five"}}}, "paper.timing.repetitions: 'five' is not of type 'integer'"),
        ({"paper": {"timing": {"repetition": 5}}}, "'repetition' was unexpected"),
        ({"creep": {"shown": "absent"}}, "creep.shown: expected a name under tables, got 'absent'"),
        (
            {"paper": {"timing": {"cases": ["absent"]}}},
            "paper.timing.cases: expected a name under paper.cases, got 'absent'",
        ),
        ({"paper": {"twins": {"rtol": "1e-9"}}}, "paper.twins.rtol: '1e-9' is not of type 'number'"),
        (
            {"paper": {"cases": {"wheelset_v20": {"scene": "absent.yaml"}}}},
            "paper.cases.wheelset_v20: absent.yaml: expected a readable file",
        ),
        (
            {"paper": {"cases": {"wheelset_v20": {"set": {"sped": 20.0}}}}},
            "paper.cases.wheelset_v20: changes: sped: unknown key",
        ),
    ],
)
def test_wrong_configuration_stops_before_any_job(tmp_path, change, message):
    (tmp_path / "wrong.yaml").write_text(yaml.safe_dump(change))
    command = [sys.executable, "-m", "snakemake", "--cores", "1", "--configfile", str(tmp_path / "wrong.yaml")]
    command += ["--config", f"pathvars={{results: {tmp_path}/r}}"]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert run.returncode != 0
    assert message in run.stdout + run.stderr
    assert not (tmp_path / "r").exists()


def test_every_key_of_the_study_is_described_and_smoke_adds_none():
    def undescribed(part, key):
        if "$ref" in part:
            part = SCHEMA["$defs"][part["$ref"].rpartition("/")[2]]
        missing = [key] if part.get("type") != "object" and "description" not in part else []
        return missing + [
            m for name, inner in part.get("properties", {}).items() for m in undescribed(inner, f"{key}.{name}")
        ]

    def keys(data, prefix=""):
        for key, value in data.items():
            yield from keys(value, f"{prefix}{key}.") if isinstance(value, dict) else [prefix + key]

    assert undescribed(SCHEMA, "") == []
    study, smoke = (yaml.safe_load((ROOT / f"config/{name}.yaml").read_text()) for name in ("study", "smoke"))
    del smoke["pathvars"]
    assert set(keys(smoke)) <= set(keys(study))


RANGES = {"start", "stop", "num"}
"""Keys of equally spaced numbers, which go to ``numpy.linspace``."""
WHOLE = {"integrators", "longest_step"}
"""Keys of mappings of the accuracy study that programs go through, whatever the names in them."""


def keys_below(part):
    """Names of the keys of a part of the schema, at any depth."""
    if "$ref" in part:
        part = SCHEMA["$defs"][part["$ref"].rpartition("/")[2]]
    for name, inner in part.get("properties", {}).items():
        yield name
        yield from keys_below(inner)
    for inner in (part.get("additionalProperties"), part.get("items")):
        if isinstance(inner, dict):
            yield from keys_below(inner)


def names_in(path):
    """Texts and parameters that a program takes, its arguments and fields, and the files of modules that it imports."""
    tree = ast.parse(path.read_text())
    docstrings = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    texts, arguments, modules = set(), set(), set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docstrings:
            texts.add(node.value)
        elif isinstance(node, ast.arg):
            arguments.add(node.arg)
        elif isinstance(node, ast.Attribute) and ast.unparse(node.value).endswith("params"):
            texts.add(node.attr)
        elif isinstance(node, ast.AnnAssign):
            arguments.add(getattr(node.target, "id", ""))
        elif isinstance(node, ast.Import):
            modules.update(one.name for one in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            modules.update([node.module, *(f"{node.module}.{one.name}" for one in node.names)])
    places = [(ROOT / ("workflow" if name.startswith("study.") else ""), name) for name in modules]
    files = [base / f"{name.replace('.', '/')}.py" for base, name in places if name.startswith(("study.", "wrcore."))]
    return texts, arguments, [path for path in files if path.is_file()]


def names_of_section(section):
    """Names that the rules of a section and the study's programs for it take, and arguments of what these call."""
    lines = [line for name in (section, "common") for line in (ROOT / f"workflow/rules/{name}.smk").open()
             if (name == section and not line.lstrip().startswith("#")) or f'config["{section}"]' in line]  # fmt: skip
    found = set(re.findall(r"""["'](\w+)["']""", "".join(lines)))
    waiting = [path for part in ("scripts", "study") for path in (ROOT / "workflow" / part / section).glob("*.py")]
    seen = set(waiting)
    while waiting:
        path = waiting.pop()
        texts, arguments, modules = names_in(path)
        found |= arguments
        if ROOT / "workflow" in path.parents:
            found |= texts
            waiting += [one for one in modules if one not in seen]
            seen.update(modules)
    return found


@pytest.mark.parametrize("section", [name for name in SCHEMA["properties"] if name != "pathvars"])
def test_key_of_a_section_is_taken_by_its_rules_or_programs(section):
    assert {section, *keys_below(SCHEMA["properties"][section])} - names_of_section(section) - RANGES <= WHOLE


FUNCTIONS = [(family, name) for family, functions in FAMILIES.items() for name in functions]


@pytest.mark.parametrize(("family", "name"), FUNCTIONS)
def test_setting_of_a_hard_case_is_an_argument_in_use(family, name):
    function = FAMILIES[family][name]
    (tree,) = ast.parse(inspect.getsource(function)).body
    arguments = {one.arg for one in ast.walk(tree.args) if isinstance(one, ast.arg)}
    used = {one.id for line in tree.body for one in ast.walk(line) if isinstance(one, ast.Name)}
    for config in ("study", "smoke"):
        given = yaml.safe_load((ROOT / f"config/{config}.yaml").read_text())["hard_cases"]["families"][family][name]
        assert set(given) - {"vehicles"} <= arguments <= used
