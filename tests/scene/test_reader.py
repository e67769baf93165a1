"""Readers of a scene: each part is read once, and errors name the key of the part."""

import sys
from collections import Counter
from functools import wraps
from pathlib import Path

import pytest

from tests.conftest import ELLIPTIC
from wrcore.errors import InputError
from wrcore.kernels.named_laws import Laws
from wrcore.scene import description
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene
from wrcore.scene.reader import Reader

READERS = {name for name in vars(description) if name.startswith("read_")} | {
    "vehicle_of", "build_track", "wheel_and_rail", "differing_pairs", "check_creep", "check_bodies",
}  # fmt: skip


@pytest.mark.parametrize("name", ["guided_car", "wheel_slide"])
def test_each_part_of_a_scene_is_read_once_until_it_is_compiled(name, monkeypatch):
    counts = Counter()

    def counted(function):
        @wraps(function)
        def wrapped(*arguments, **options):
            counts[function.__name__] += 1
            return function(*arguments, **options)

        return wrapped

    for function in [getattr(description, reader) for reader in READERS]:
        wrapped = counted(function)
        for module in [module for key, module in sys.modules.items() if key.startswith("wrcore.scene")]:
            if getattr(module, function.__name__, None) is function:
                monkeypatch.setattr(module, function.__name__, wrapped)
    scene = load_scene(ELLIPTIC / f"{name}.yaml")
    compile_scene(scene)
    assert scene.friction is scene.friction
    assert {"read_drive", "read_controls", "read_friction", "read_support", "read_check_rails"} <= READERS
    assert counts == dict.fromkeys(READERS, 1)


def test_errors_of_a_part_name_its_keys():
    reader = Reader("scene.yaml", Laws(Path()), {})
    part = reader.at("wheel", "left")
    assert str(part.error("profile", "expected it")) == "scene.yaml: wheel.left.profile: expected it"
    assert part.at("flats", 2).error("", "expected it").field == "wheel.left.flats.2"
    assert reader.error("speed", "expected it").field == "speed"


def test_a_file_is_recorded_with_the_digest_at_its_first_reading(tmp_path):
    (tmp_path / "profile.csv").write_text("1 2\n")
    reader = Reader("scene.yaml", Laws(tmp_path), {})
    path = reader.at("wheel").file("profile.csv", "profile")
    before = dict(reader.files)
    path.write_text("1 3\n")
    assert reader.file("profile.csv") == path == tmp_path / "profile.csv"
    assert reader.files == before and before.keys() == {str(path)}
    with pytest.raises(InputError, match="scene.yaml: wheel.profile: expected an existing file, got 'other.csv'"):
        reader.at("wheel").file("other.csv", "profile")
