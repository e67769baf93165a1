"""The study's configuration: what is wrong stops before any job, what can be set is described."""

import ast
import inspect
import re
import subprocess
import sys
from types import SimpleNamespace

import pytest
import yaml
from snakemake.exceptions import WorkflowError
from snakemake.utils import update_config

from study.hard_cases.study import FAMILIES
from tests.conftest import ROOT
from wrcore.errors.checked_yaml import _validator

SCHEMA = yaml.safe_load((ROOT / "workflow/schemas/config.schema.yaml").read_text())


WRONG = [
    (
        {"hard_cases": {"families": {"track": {"curve": {"duration": "9 s"}}}}},
        "hard_cases.families.track.curve.duration: expected duration of a run (s), got '9 s'",
    ),
    (
        {"hard_cases": {"families": {"friction": {"friction_step": {"names": ["free wheelset", "cart"]}}}}},
        "hard_cases.families.friction.friction_step.names: expected one of suspended wheelset, ",
    ),
    (
        {"accuracy": {"exact": {"finer": {"contact.resolution": "finest"}}}},
        "accuracy.exact.finer with accuracy.scenes.suspended_v20: changes: contact.resolution: expected ",
    ),
    (
        {"wear": {"settings": {"distance": -1.0}}},
        "wear.plan with wear.settings: config/wear/trailer_vehicle.yaml: distance: expected the distance run in m",
    ),
    (
        {"wear": {"influences": {"variants": {"smoothing 1 mm": {"plan": {"smoothin": 1.0e-3}}}}}},
        "wear.plan with wear.influences.variants.smoothing 1 mm: config/wear/trailer_vehicle.yaml: smoothin: ",
    ),
    (
        {"contact": {"pairs": {"S1002 on UIC60, 1:40": {"wheel": "S1003"}}}},
        "contact.pairs.S1002 on UIC60, 1:40: wheel: profile: expected a point file or one of S1002, ",
    ),
    (
        {"critical_speed": {"speeds": {"start": 140.0, "stop": 20.0}}},
        "critical_speed.speeds.stop: expected more than start, 140, got 20",
    ),
    ({"speeds": {"values": [20.0, 60.0, 40.0, 75.0]}}, "speeds.values: expected rising numbers"),
    ({"cost": {"pairs": {"creep": "irregular_v60"}}}, "cost.pairs.creep: expected scenes on tangent"),
    ({"crossings": {"scene": "config/scenes/wheelset.yaml"}}, "crossings.scene: expected a scene with "),
    (
        {"hard_cases": {"families": {"profiles": {"profiles": {"entries": {"noise of 10 um": {"kind": "worn"}}}}}}},
        "hard_cases.families.profiles.profiles.entries.noise of 10 um: expected the shape ['reach', 'share']",
    ),
]
"""Changes of the configuration, and the beginning of the line that refuses each."""


@pytest.mark.parametrize(("change", "message"), WRONG)
def test_wrong_configuration_is_refused_in_one_line(tmp_path, monkeypatch, change, message):
    """By the check of the rules, without a start of Snakemake."""
    monkeypatch.chdir(ROOT)
    (tmp_path / "wrong.yaml").write_text(yaml.safe_dump(change))
    changed = yaml.safe_load((ROOT / "config/study.yaml").read_text())
    update_config(changed, change)
    common, workflow = ROOT / "workflow/rules/common.smk", SimpleNamespace(basedir=ROOT)
    workflow.overwrite_configfiles, workflow.is_main_process = [tmp_path / "wrong.yaml"], True
    source = common.read_text().partition("check_config()\n\n")[0] + "check_config()\n"
    with pytest.raises(WorkflowError) as caught:
        exec(compile(source, common, "exec"), {"workflow": workflow, "config": changed})
    said = str(caught.value)
    assert said.startswith(f"{tmp_path}/wrong.yaml: {message}") and "\n" not in said


def test_wrong_configuration_stops_before_any_job(tmp_path):
    change, message = WRONG[0]
    (tmp_path / "wrong.yaml").write_text(yaml.safe_dump(change))
    command = [sys.executable, "-m", "snakemake", "--dry-run", "--configfile", str(tmp_path / "wrong.yaml")]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert run.returncode != 0
    (line,) = [line for line in (run.stdout + run.stderr).splitlines() if "wrong.yaml: " in line]
    assert line.startswith(f"{tmp_path}/wrong.yaml: {message}")


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
    known = set(keys(study))
    assert [key for key in keys(smoke) if key not in known and not any(k.startswith(f"{key}.") for k in known)] == []


CHANGES = {"set", "track", "tracks", "start", "changes", "variants", "finer", "coarser", "plan", "settings"}
"""Keys of changes to scenes and wear plans, which are checked as what they change is loaded."""


def leaves(data, path=()):
    """Paths of the single values of nested data."""
    inner = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in inner:
        yield from leaves(value, (*path, key))
    if not isinstance(data, dict | list):
        yield path


def replaced(data, value):
    """Nested data with one value in place of all single ones; an empty mapping stays."""
    if isinstance(data, dict):
        return {key: replaced(one, value) for key, one in data.items()}
    return [replaced(one, value) for one in data] if isinstance(data, list) else value


@pytest.mark.parametrize("wrong", [None, -1.0e30, 1.0e30, 10**15])
def test_study_value_of_wrong_type_or_far_outside_its_range_is_refused(wrong):
    study = yaml.safe_load((ROOT / "config/study.yaml").read_text())
    refused = {tuple(error.absolute_path) for error in _validator()(SCHEMA).iter_errors(replaced(study, wrong))}
    accepted = [path for path in leaves(study) if not any(path[:n] in refused for n in range(1, len(path) + 1))]
    assert [path for path in accepted if not CHANGES & set(path)] == []


def test_methods_of_the_study_are_those_of_a_scene():
    scene = yaml.safe_load((ROOT / "wrcore/scene/schemas/scene.yaml").read_text())
    known = scene["properties"]["integration"]["properties"]["method"]["enum"]
    assert SCHEMA["$defs"]["method"]["enum"] == known


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
        if {ROOT / "workflow", ROOT / "wrcore/analysis/accuracy"} & set(path.parents):
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
