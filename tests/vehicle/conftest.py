"""Vehicle descriptions to change: the trailer vehicle's, and a scene that runs whatever vehicle file lies beside it."""

import copy

import pytest
import yaml

from tests.conftest import ELLIPTIC, ROOT
from wrcore.errors.checked_yaml import read_yaml

TRAILER = read_yaml(ROOT / "config" / "vehicles" / "trailer_vehicle.yaml")


@pytest.fixture
def trailer():
    """Content of the trailer vehicle's file, free to be changed."""
    return copy.deepcopy(TRAILER)


@pytest.fixture
def scene_of(tmp_path):
    """Write a vehicle's data to a file and a scene that uses it; returns the scene's path."""

    def write(data, **vehicle):
        scene = read_yaml(ELLIPTIC / "trailer_vehicle.yaml")
        scene["vehicle"] |= {"parameters": "vehicle.yaml", "axle_boxes": False, **vehicle}
        (tmp_path / "vehicle.yaml").write_text(yaml.safe_dump(data, sort_keys=False))
        (tmp_path / "scene.yaml").write_text(yaml.safe_dump(scene))
        return tmp_path / "scene.yaml"

    return write


def element(data, name):
    """The element of that name in a vehicle's data."""
    return next(item for item in data["elements"] if item["name"] == name)
