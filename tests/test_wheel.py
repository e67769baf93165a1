"""The built wheel in an empty folder: what it carries, without the checkout."""

import importlib.util
import json
import os
import re
import subprocess
import sys
import zipfile
from email import message_from_string

import pytest
import yaml

from tests.conftest import ROOT
from wrcore import __version__

PIP = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet"]
LOADED = """
import wrcore as wr
print(wr.__file__)
for name in ("wheelset", "suspended_wheelset", "trailer_vehicle", "metro_car", "locomotive"):
    wr.load_scene(wr.example(name))
    wr.load_scene(f"start/scenes/{name}.yaml")
"""


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """A folder with nothing but the wheel's content."""
    if importlib.util.find_spec("hatchling") is None:
        pytest.skip("hatchling, which builds the wheel, is not installed: pip install wrcore[test]")
    place = tmp_path_factory.mktemp("wheel")
    build = [*PIP, "wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", place / "built", ROOT]
    subprocess.run(build, check=True, cwd=place)
    (wheel,) = (place / "built").glob("wrcore-*.whl")
    subprocess.run([*PIP, "install", "--no-deps", "--target", place / "site", wheel], check=True, cwd=place)
    return place


def test_a_stranger_starts_from_the_wheel_alone(installed):
    environment = {**os.environ, "PYTHONPATH": str(installed / "site")}
    python = {"cwd": installed, "env": environment, "check": True, "capture_output": True, "text": True}
    told = subprocess.run([sys.executable, "-m", "wrcore", "init", "start"], **python).stdout
    assert "wrcore simulate" in told
    where = subprocess.run([sys.executable, "-c", LOADED], **python).stdout
    assert where.startswith(str(installed / "site"))


def test_the_package_alone_pulls_no_snakemake_and_no_jupyter(installed):
    """What `pip install wrcore` asks for is what computes and draws; the rest belongs to extras."""
    (wheel,) = (installed / "built").glob("wrcore-*.whl")
    with zipfile.ZipFile(wheel) as content:
        (name,) = (name for name in content.namelist() if name.endswith(".dist-info/METADATA"))
        metadata = message_from_string(content.read(name).decode("utf-8"))
    needs = [re.match(r"([\w.-]+)([^;]*);?(.*)", line).groups() for line in metadata.get_all("Requires-Dist")]
    always = {name for name, _, marker in needs if "extra" not in marker}
    assert always == {"numpy", "scipy", "numba", "h5py", "pandas", "matplotlib", "pyyaml", "jsonschema", "tqdm"}
    extras = {
        extra: {name for name, _, marker in needs if re.search(f"extra == .{extra}.", marker)}
        for extra in ("notebooks", "study")
    }
    assert extras["notebooks"] == {"ipykernel", "jupyterlab"}
    assert extras["study"] == extras["notebooks"] | {"snakemake", "nbclient", "nbconvert"}
    assert metadata["Version"] == __version__


def test_versions_and_dates_are_one():
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
    described = json.loads((ROOT / "codemeta.json").read_text("utf-8"))
    released = re.findall(r"^## (\d\S*) - (\d{4}-\d\d-\d\d)$", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.MULTILINE)
    assert {cited["version"], described["version"], released[0][0]} == {__version__}
    assert {str(cited["date-released"]), described["dateModified"]} == {released[0][1]}


def test_what_is_claimed_of_pythons_is_what_runs():
    """Classifiers, the least version, the matrix of the hosted tests and their command are the README's."""
    import tomllib

    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    claimed = [c.rpartition(" ")[2] for c in project["classifiers"] if re.search(r"Python :: \d\.\d", c)]
    jobs = yaml.safe_load((ROOT / ".github/workflows/tests.yml").read_text("utf-8"))["jobs"]
    assert jobs["test"]["strategy"]["matrix"]["python"] == claimed
    assert project["requires-python"] == f">={claimed[0]}"
    commands = [step["run"] for job in jobs.values() for step in job["steps"] if "run" in step]
    assert [command for command in commands if command.startswith("make ")] == ["make test", "make lint"]
    assert "    make test " in (ROOT / "README.md").read_text("utf-8")
    needs = json.loads((ROOT / "codemeta.json").read_text("utf-8"))["softwareRequirements"]
    assert needs == [re.match(r"[\w.-]+", line)[0] for line in project["dependencies"]]
