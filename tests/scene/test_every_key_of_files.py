"""Every key of wear plans, wear laws, profiles, slice files and the study's configuration is used or refused.

Profiles and slices are read with another value of each key. Plans and the configuration are long to run: a key counts
as used where the program text that works on them names it.
"""

import pickle
import re
from pathlib import Path

import numpy as np
import pytest
import yaml

from tests.scene.test_every_key import leaves
from wrcore.errors import InputError
from wrcore.geometry import profile_files, slice_files
from wrcore.geometry.profile_files import read_profile
from wrcore.geometry.slice_files import read_slices
from wrcore.geometry.standards import named_profile

ROOT = Path(__file__).parents[2]


def texts(*patterns):
    return "\n".join(path.read_text() for pattern in patterns for path in sorted(ROOT.glob(pattern)))


def is_named(key, text):
    """Whether a program names a key, as text, as an argument or as a part of a path of keys."""
    return re.search(rf"(?<![A-Za-z0-9_]){re.escape(key)}(?![A-Za-z0-9_])", text) is not None


@pytest.mark.parametrize("schema", ["wear", "wear_law"])
def test_wear_key_is_read_where_plans_are_worked_on(schema):
    text = texts("wrcore/analysis/wear/*.py", "wrcore/sweep/*.py")
    missing = [key for key in leaves(schema) if not is_named(key.rpartition(".")[2].removesuffix("[]"), text)]
    assert not missing


def properties(part):
    """Names of the keys of a JSON schema, at any depth."""
    if isinstance(part, dict):
        if isinstance(part.get("properties"), dict):
            yield from part["properties"]
        for inner in part.values():
            yield from properties(inner)
    elif isinstance(part, list):
        for inner in part:
            yield from properties(inner)


BY_LIBRARIES = {"num", "pathvars"}
"""Keys that go to numpy.linspace and to Snakemake itself."""


def test_key_of_the_study_is_read_by_a_rule_or_program():
    schema = yaml.safe_load((ROOT / "workflow/schemas/config.schema.yaml").read_text())
    text = texts("workflow/Snakefile", "workflow/rules/*.smk", "workflow/scripts/**/*.py", "workflow/study/**/*.py")
    text += texts("wrcore/**/*.py")  # settings that are passed on by their names
    found = set(properties(schema))
    assert len(found) > 100
    assert {key for key in found if not is_named(key, text)} == BY_LIBRARIES


def columns(path, kind):
    """Points of a profile without a header, in mm."""
    curve = named_profile("S1002", "wheel") if kind == "wheel" else named_profile("60E1", "rail", 0)
    np.savetxt(path, 1e3 * np.column_stack([curve.u, curve.f])[::4])
    return str(path)


PROFILE_KEYS = {
    "unit": ("wheel", {}, "inch"), "inclined": ("rail", {}, False), "smoothing": ("wheel", {}, 2e-5),
    "mirrored": ("wheel", {"tape_circle": 0.0}, True), "downwards": ("wheel", {}, True),
    "shift": ("wheel", {}, [0.002, 0.0]), "tape_circle": ("wheel", {}, 0.002), "flange_back": ("wheel", {}, 0.07),
    "within": ("wheel", {}, [-0.05, 0.05]), "part": ("wheel", {}, 1), "side": ("wheel", {}, "left"),
}  # fmt: skip
"""Key of a profile mapping: kind of profile, keys beside it, and a value that is not its default."""


def curve_of(spec, kind):
    curve = read_profile(spec, kind, 1 / 40) if kind == "rail" else read_profile(spec, kind)
    return np.concatenate([curve.u, curve.f]).tobytes()


def test_each_key_of_a_profile_has_a_case_here():
    assert set(PROFILE_KEYS) == profile_files._KEYS - {"points"}


@pytest.mark.parametrize("key", PROFILE_KEYS)
def test_profile_key_changes_the_curve_or_is_refused(key, tmp_path):
    kind, beside, value = PROFILE_KEYS[key]
    plain = {"points": columns(tmp_path / "points.txt", kind), "unit": "mm", **beside}
    before = curve_of(plain, kind)
    try:
        assert curve_of(plain | {key: value}, kind) != before
    except InputError as error:
        assert "\n" not in str(error)


@pytest.mark.parametrize(
    ("name", "kind"), [("w.prw", "wheel"), ("w.whe", "wheel"), ("r.prr", "rail"), ("r.rai", "rail")]
)
def test_unit_beside_a_file_with_a_unit_of_its_own_is_refused(name, kind):
    with pytest.raises(InputError, match="unit: expected no such key: SIMPACK and Vampire files have a unit"):
        read_profile({"points": name, "unit": "mm"}, kind)


def test_inclined_is_refused_of_wheels(tmp_path):
    with pytest.raises(InputError, match="inclined: expected this of rails only"):
        read_profile({"points": columns(tmp_path / "points.txt", "wheel"), "unit": "mm", "inclined": True}, "wheel")


SLICE_KEYS = {"unit": "inch", "mirrored": True, "downwards": True, "wavelength": 0.02}


def test_each_key_of_slices_has_a_case_here():
    assert set(SLICE_KEYS) == slice_files._KEYS - {"slices"}


@pytest.mark.parametrize("key", SLICE_KEYS)
def test_key_of_slices_changes_the_surface_or_is_refused(key, tmp_path):
    for name, drop in (("a", 0.0), ("b", 2e-4)):
        curve = named_profile("60E1", "rail", 0)
        f = curve.f - drop * np.exp(-((curve.u / 0.005) ** 2))
        np.savetxt(tmp_path / f"{name}.txt", 1e3 * np.column_stack([curve.u, f])[::4])
    rows = "".join(f"{s:.2f},{'b' if k == 5 else 'a'}.txt\n" for k, s in enumerate(np.arange(12) * 0.1))
    (tmp_path / "slices.csv").write_text(f"s_m,profile\n{rows}")
    plain = {"slices": str(tmp_path / "slices.csv"), "unit": "mm"}

    def surface(spec):
        return pickle.dumps(read_slices(spec, "rail"))

    before = surface(plain)
    try:
        assert surface(plain | {key: SLICE_KEYS[key]}) != before
    except InputError as error:
        assert "\n" not in str(error)
