"""The built wheel in an empty folder: what it carries, without the checkout."""

import importlib.util
import os
import subprocess
import sys

import pytest

from tests.conftest import ROOT

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
