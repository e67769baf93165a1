"""Keys of profiles, slices and crossings, and numbers in files of slices, have an effect or are refused."""

import numpy as np
import pytest

import wrcore as wr
from tests.conftest import ELLIPTIC
from wrcore.errors import InputError
from wrcore.geometry.changing_rails import files as slice_files
from wrcore.geometry.changing_rails.files import read_slices
from wrcore.geometry.changing_rails.slices import TURN
from wrcore.geometry.profiles import files as profile_files
from wrcore.geometry.profiles.files import read_profile
from wrcore.geometry.profiles.standards import named_profile


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


ENDINGS = {"rail": "slcs", "wheel": "slcw"}
PLACES = {"rail": np.arange(12) * 0.1, "wheel": np.arange(12) * TURN / 12}
"""Places of the slices: along the rail, m, or round the wheel, rad."""


def sections(folder, kind, sign=1.0):
    """Write two sections in mm, ordinates times a sign: a.txt, and b.txt with a groove."""
    curve = named_profile("S1002", "wheel") if kind == "wheel" else named_profile("60E1", "rail", 0)
    for name, drop in (("a", 0.0), ("b", 2e-4)):
        f = curve.f - drop * np.exp(-(((curve.u - 0.004) / 0.005) ** 2))
        np.savetxt(folder / f"{name}.txt", 1e3 * np.column_stack([curve.u, sign * f])[::4])


def table_of_slices(folder, kind, places=None, grooved=5, cut=20.0):
    """Path of a table of slices whose section is b.txt at one place, with a feature line at a chord length (mm)."""
    rows = [f"{place:.6f},{'b' if k == grooved else 'a'}.txt,{1e-3 * cut:.6f}"
            for k, place in enumerate(PLACES[kind] if places is None else places)]  # fmt: skip
    column = "s_m" if kind == "rail" else "angle_rad"
    (folder / "slices.csv").write_text("\n".join([f"{column},profile,cut_1_m", *rows]) + "\n")
    return str(folder / "slices.csv")


def surface(spec, kind):
    """Heights of a rail or wheel of slices between the slices, NaN where there is none."""
    u = np.linspace(-0.02, 0.03, 51)
    return read_slices(spec, kind).heights(PLACES[kind][:-1] + 0.3 * PLACES[kind][1], u)[0].tobytes()


@pytest.mark.parametrize("kind", ENDINGS)
@pytest.mark.parametrize("key", SLICE_KEYS)
def test_key_of_slices_changes_the_surface(key, kind, tmp_path):
    sections(tmp_path, kind)
    plain = {"slices": table_of_slices(tmp_path, kind), "unit": "mm"}
    other = plain | {key: SLICE_KEYS[key]}
    if key == "unit":  # sections in mm, read as inches, are metres wide
        with pytest.raises(InputError, match="expected a profile within 0.5 m"):
            surface(other, kind)
    else:
        assert surface(other, kind) != surface(plain, kind)


@pytest.mark.parametrize("kind", ENDINGS)
@pytest.mark.parametrize("change", ["places", "grooved", "cut"])
def test_column_of_slices_changes_the_surface(change, kind, tmp_path):
    sections(tmp_path, kind)
    value = {"places": 0.99 * PLACES[kind], "grooved": 6, "cut": 30.0}[change]
    before = surface({"slices": table_of_slices(tmp_path, kind), "unit": "mm"}, kind)
    other = table_of_slices(tmp_path, kind, **{change: value})
    assert surface({"slices": other, "unit": "mm"}, kind) != before


def contact_file(folder, kind, offset=0.0, scale=1.0, method=1, stretch=1.0, grooved=5, cut=20.0):
    """Path of CONTACT's file of slices, with a feature line at a chord length (mm)."""
    places = (1e3 if kind == "rail" else 1.0) * stretch * PLACES[kind]
    lines = [f"{offset} {scale}", f"{places.size}", "3 0 0", f"{method}"]
    lines += [f"{place:.6f} '{'b' if k == grooved else 'a'}.txt'" for k, place in enumerate(places)]
    lines += [f"{place:.6f} 0.0 {cut} 999.0" for place in places]
    (folder / f"slices.{ENDINGS[kind]}").write_text("\n".join(lines) + "\n")
    return str(folder / f"slices.{ENDINGS[kind]}")


NUMBERS = [(kind, *one) for kind in ENDINGS for one in (("offset", 0.05), ("stretch", 0.99), ("grooved", 6),
                                                        ("cut", 30.0))]  # fmt: skip


@pytest.mark.parametrize(("kind", "number", "value"), [*NUMBERS, ("rail", "scale", 1.01), ("wheel", "method", 2)])
def test_number_of_a_contact_file_changes_the_surface(kind, number, value, tmp_path):
    sections(tmp_path, kind, -1.0)
    before = surface(contact_file(tmp_path, kind), kind)
    assert surface(contact_file(tmp_path, kind, **{number: value}), kind) != before


@pytest.mark.parametrize("key", SLICE_KEYS)
@pytest.mark.parametrize("slices", ["crossing:1/12", "switch:500", "joint:0.01"])
def test_key_beside_a_crossing_by_formula_is_refused(key, slices):
    crossing = {"slices": {"slices": slices, key: SLICE_KEYS[key]}, "at": 9.0, "rail": "right"}
    changes = {"rail": {"profile": "60E1", "inclination": 0}, "track.crossing": crossing}
    with pytest.raises(InputError, match=f"track.crossing.slices.{key}: expected no such key beside {slices}, made by"):
        wr.load_scene(ELLIPTIC / "suspended_wheelset.yaml", changes)
