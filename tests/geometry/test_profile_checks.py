"""Profiles in a wrong direction, from a wrong origin or of the other kind: read as they are meant, or refused."""

import re

import numpy as np
import pytest

from wrcore.errors import InputError
from wrcore.geometry.profiles.files import read_profile
from wrcore.geometry.profiles.profile import ProfileCurve
from wrcore.geometry.profiles.standards import RAIL_HEADS, named_profile

S1002 = named_profile("S1002", "wheel")
SPANS = [(-67, 59), (-60, 55), (-55, 55), (-50, 55), (-45, 50), (-42, 50), (-38, 50), (-54.5, 12), (-45, 12), (-60, 30)]
FLANGELESS = [(-34, 50), (-30, 50), (-20, 50), (-20, 20)]
TURNS = {"as is": (1, 1), "u": (-1, 1), "f": (1, -1), "both": (-1, -1)}


def shapes(low, high):
    """Points of wheels by name, m: the standard one, hollow, chamfered, a tram's, one of a scaled rig."""
    u = np.arange(1e-3 * low, 1e-3 * high + 1e-9, 2e-4)
    f = S1002(u)
    hollow = f + 3e-3 * (np.exp(-(((u - 0.01) / 0.015) ** 2)) - np.exp(-((0.01 / 0.015) ** 2)))
    wheels = {"S1002": (u, f), "hollow": (u, hollow), "chamfer": (u, f + np.maximum(0.0, u - 0.045))}
    return wheels | {"tram": (0.9 * u, 0.8 * f)}


def written(folder, u, f, turn=(1, 1)):
    u, f = turn[0] * u, turn[1] * f
    path = folder / "profile.csv"
    path.write_text("u_mm,f_mm\n" + "".join(f"{1e3 * a:.5f},{1e3 * b:.5f}\n" for a, b in zip(u, f, strict=True)))
    return path


def is_read(path, kind, u, f, **keys):
    """Whether a file is read as the points are meant; False where it is refused."""
    try:
        curve = read_profile({"points": str(path), **keys}, kind)
    except InputError as error:
        assert "\n" not in str(error)
        return False
    inside = slice(5, -5)
    assert np.nanmax(np.abs(curve(u[inside]) - f[inside])) < 2e-6, "read, but otherwise than it is meant"
    return True


def advised(path, kind):
    """Keys that the message advises."""
    with pytest.raises(InputError) as caught:
        read_profile(str(path), kind)
    return {key: value == "true" for key, value in re.findall("(mirrored|downwards): (true|false)", str(caught.value))}


@pytest.mark.parametrize("span", SPANS)
@pytest.mark.parametrize("shape", ["S1002", "hollow", "chamfer", "tram"])
def test_turned_wheel_is_read_with_the_advised_keys(tmp_path, span, shape):
    u, f = shapes(*span)[shape]
    for turn in TURNS.values():
        path = written(tmp_path, u, f, turn)
        if turn == (1, 1):
            assert is_read(path, "wheel", u, f)
        else:
            assert is_read(path, "wheel", u, f, **advised(path, "wheel"))


@pytest.mark.parametrize("span", FLANGELESS)
def test_tread_without_flange_needs_stated_directions(tmp_path, span):
    u, f = shapes(*span)["S1002"]
    for turn in TURNS.values():
        path = written(tmp_path, u, f, turn)
        with pytest.raises(InputError, match="of a wheel without one, state mirrored and downwards"):
            read_profile(str(path), "wheel")
    assert is_read(written(tmp_path, u, f), "wheel", u, f, mirrored=False, downwards=False)


@pytest.mark.parametrize("slope", [0.0, 1 / 40, 1 / 10])
def test_cones_and_cylinders_are_wheels(tmp_path, slope):
    u = np.arange(-0.06, 0.06, 5e-4)
    assert is_read(written(tmp_path, u, slope * u), "wheel", u, slope * u)


@pytest.mark.parametrize("aside", [70.0, 55.0, 45.0, 30.0, -25.0, -60.0])
def test_tape_circle_off_the_tread_is_refused_with_keys(tmp_path, aside):
    u, f = shapes(-67, 59)["S1002"]
    with pytest.raises(InputError, match="tape_circle, flange_back or shift says where"):
        read_profile(str(written(tmp_path, u + 1e-3 * aside, f)), "wheel")
    path = written(tmp_path, u + 1e-3 * aside, f)
    assert is_read(path, "wheel", u, f, tape_circle=1e-3 * aside)


@pytest.mark.parametrize("span", [*SPANS[:3], (-60, 30)])
@pytest.mark.parametrize("shape", ["S1002", "hollow", "chamfer", "tram"])
def test_wheel_given_as_a_rail_is_refused(tmp_path, span, shape):
    u, f = shapes(*span)[shape]
    for turn in TURNS.values():
        with pytest.raises(InputError):
            read_profile(str(written(tmp_path, u, f, turn)), "rail")


@pytest.mark.parametrize("name", RAIL_HEADS)
@pytest.mark.parametrize("inclination", [0.0, 1 / 40, 1 / 20])
def test_rails_in_all_directions(tmp_path, name, inclination):
    rail = named_profile(name, "rail", inclination)
    for low, high in ((-0.1, 0.1), (-0.1, 0.01), (-0.01, 0.1), (-0.02, 0.02)):
        seen = (rail.u >= low) & (rail.u <= high)
        u, f = rail.u[seen], rail.f[seen]
        assert is_read(written(tmp_path, u, f), "rail", u, f)  # cut at the side, too
        down = written(tmp_path, u, f, TURNS["f"])
        assert is_read(down, "rail", u, f, **advised(down, "rail"))
        if low == -0.1:
            with pytest.raises(InputError):
                read_profile(str(written(tmp_path, u, f, (1, -1))), "wheel")
    whole = written(tmp_path, rail.u, rail.f, TURNS["u"])
    if inclination:
        assert is_read(whole, "rail", rail.u, rail.f, **advised(whole, "rail"))
    for turn in TURNS.values():
        with pytest.raises(InputError):
            read_profile(str(written(tmp_path, rail.u, rail.f, turn)), "wheel")


@pytest.mark.parametrize("kind", ["wheel", "rail"])
def test_advised_smoothing_follows_the_scatter(kind, capsys):
    """Points 0.1 to 0.5 mm apart with 1 to 10 um of noise."""
    curve = S1002 if kind == "wheel" else named_profile("60E1", "rail", 1 / 40)
    for spacing in (1e-4, 2.5e-4, 5e-4):
        for noise in (1e-6, 3e-6, 1e-5):
            u = np.arange(-0.040, 0.025, spacing)
            f = curve(u) + np.random.default_rng(5).normal(scale=noise, size=u.size)
            ProfileCurve.from_points(u, f, kind, f"{kind} {noise} {spacing}", mends=False)
            smoothing = float(re.search(r"\(smoothing: (\S+) evens", capsys.readouterr().err)[1])
            assert smoothing == pytest.approx(1.1 * noise, rel=0.2)
    for decimals in (8, 6):  # 1e-5 and 1e-3 mm
        ProfileCurve.from_points(u, np.round(curve(u), decimals), kind, f"clean {decimals}", mends=False)
    assert "scatter" not in capsys.readouterr().err


@pytest.mark.parametrize(("name", "kind"), [("wheel_noise_2um.csv", "wheel"), ("rail_rounded.csv", "rail")])
def test_advised_smoothing_mends_conicity(shared_file, capsys, name, kind):
    """Or 30 % less or more of it."""
    spec = {"points": str(shared_file("cases", name))} | ({"inclined": False} if kind == "rail" else {})
    read_profile(spec, kind, 1 / 40)
    advice = float(re.search(r"\(smoothing: (\S+) evens", capsys.readouterr().err)[1])
    for share in (0.7, 1.0, 1.03, 1.3):
        curve = read_profile({**spec, "smoothing": share * advice}, kind, 1 / 40)
        assert conicity_with(kind, curve).tolist() == pytest.approx([0.353, 0.218, 0.174], abs=2e-3)


@pytest.mark.parametrize("kind", ["wheel", "rail"])
@pytest.mark.parametrize(("spacing", "noise"), [
    (1e-4, 5e-7), (1e-4, 2e-6), (1e-4, 1e-5), (4e-4, 5e-7), (4e-4, 2e-6), (4e-4, 1e-5), (1e-3, 2e-6), (1e-3, 1e-5),
])  # fmt: skip
def test_smoothing_near_the_advised_one_improves_conicity(kind, spacing, noise):
    """Root mean square error over seeds, beside points without noise; points are spaced along the profile.

    Half a micrometre on points 1 mm apart bends no curve enough for an advice."""
    whole = S1002 if kind == "wheel" else named_profile("60E1", "rail", 0.0)
    inside = whole.u > (-0.054 if kind == "wheel" else -1.0)
    length = np.append(0.0, np.cumsum(np.hypot(np.diff(whole.u[inside]), np.diff(whole.f[inside]))))
    at = np.arange(0.0, length[-1], spacing)
    u, f = np.interp(at, length, whole.u[inside]), np.interp(at, length, whole.f[inside])

    def conicity(seed, smoothing):
        noisy = f + (np.random.default_rng(seed).normal(scale=noise, size=u.size) if seed else 0.0)
        turn = 1 / 40 if kind == "rail" else 0.0
        curve = ProfileCurve.from_points(u, noisy, kind, smoothing=smoothing, mends=False, inclination=turn)
        return conicity_with(kind, curve)

    right = conicity(0, 0.0)

    def error(smoothing):
        return np.sqrt(np.mean([(conicity(seed, smoothing) - right) ** 2 for seed in (1, 2, 3)]))

    rough = error(0.0)
    for share in (0.7, 1.0, 1.3):
        assert error(1.1 * share * noise) < rough, share


def conicity_with(kind, curve):
    """At 1, 2 and 3 mm, of a curve beside S1002 or 60E1 at 1/40."""
    from wrcore.contact.rigid.conicity import conicity_curve
    from wrcore.contact.rigid.wheel_on_rail import WheelOnRail, WheelsetOnTrack

    pair = {"wheel": S1002, "rail": named_profile("60E1", "rail", 1 / 40)} | {kind: curve}
    side = WheelOnRail(pair["wheel"], pair["rail"])
    return conicity_curve(WheelsetOnTrack(side, side), np.array([1e-3, 2e-3, 3e-3]))["equivalent_conicity"].to_numpy()


def test_rail_head_that_is_a_wide_circle_is_read():
    """Rails of roller rigs and of test cases are circles, 300 mm wide at a radius of 300 mm."""
    u = np.linspace(-0.15, 0.15, 601)
    profile = ProfileCurve.from_points(u, np.sqrt(0.3**2 - u**2) - 0.3, "rail", "circle")
    assert abs(float(profile(0.1)) - (np.sqrt(0.3**2 - 0.01) - 0.3)) < 1e-6


@pytest.mark.parametrize("name", RAIL_HEADS)
@pytest.mark.parametrize("end", [0.002, 0.008])
def test_half_rail_head_without_gauge_side_is_told(tmp_path, name, end, capsys):
    head = named_profile(name, "rail", 1 / 40)
    u = np.arange(head.u[0] + 1e-4, end, 1e-4)
    path = written(tmp_path, u, head(u), TURNS["u"])
    read_profile(str(path), "rail")
    assert "half a rail head, without its gauge side" in (said := capsys.readouterr().err) and "mirrored: true" in said
    other = path.rename(tmp_path / "other.csv")
    assert is_read(other, "rail", u, head(u), mirrored=True)
    read_profile({"points": str(other), "mirrored": False}, "rail")
    assert "half a rail head" not in capsys.readouterr().err


@pytest.mark.parametrize(("unit", "size"), [("cm", 1e2), ("um", 1e6)])
@pytest.mark.parametrize("kind", ["wheel", "rail"])
def test_unit_of_a_file_in_cm_or_um_is_guessed_and_read(tmp_path, kind, unit, size, capsys):
    curve = S1002 if kind == "wheel" else named_profile("60E1", "rail", 0)
    path = tmp_path / "profile.txt"
    np.savetxt(path, size * np.column_stack([curve.u, curve.f])[5:-5:3], fmt="%.7g")
    with pytest.raises(InputError, match=rf"unit: expected .*, as of {unit}$"):
        read_profile(str(path), kind)
    found = read_profile({"points": str(path), "unit": unit}, kind)
    u = curve.u[40:-40]
    assert np.abs(found(u) - curve(u)).max() < 5e-6
    named = path.read_text().replace(" ", ",")
    path.write_text(f"u_{unit},f_{unit}\n{named}")
    assert np.array_equal(read_profile(str(path), kind)(u), found(u))


@pytest.mark.parametrize("kind", ["wheel", "rail"])
def test_profile_in_cm_that_is_read_in_mm_is_told(tmp_path, kind, capsys):
    curve = S1002 if kind == "wheel" else named_profile("60E1", "rail", 0)
    path = tmp_path / "profile.csv"
    np.savetxt(path, 1e2 * np.column_stack([curve.u, curve.f])[5:-5:3], fmt="%.6f", delimiter=",", header="u_mm,f_mm",
               comments="")  # fmt: skip
    try:
        read_profile(str(path), kind)
    except InputError as error:
        assert "\n" not in str(error)
    told = rf"a {kind} only \S+ mm wide; if its numbers are in cm: u_cm,f_cm in the header"
    assert re.search(told, capsys.readouterr().err)
