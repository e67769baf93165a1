"""Files of profile meters and of Vampire, by formula in every dialect; CONTACT's own where somebody has them."""

import os
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares

from wrcore.errors import InputError
from wrcore.geometry.profiles.files import read_profile
from wrcore.geometry.profiles.standards import named_profile

U = np.linspace(-0.0690, 0.0590, 1281)
SEEN = U[20:-20]
TAPE = 0.070
RAIL = np.linspace(-0.0425, 0.0275, 701)  # to where it is steep
KEYS = "ProgramName=Some meter\nStock=%X\nXoffset=0.0000\nYoffset=\nColumnDef={}\nXYPoints={}\n"


def wheel(u):
    return named_profile("S1002", "wheel")(u)


def rail(u):
    return named_profile("UIC60-MBench", "rail", 1 / 40)(u)


def with_sides(u, f, inner, outer):
    """Points (mm) with faces ``inner`` and ``outer`` (mm) high at the ends."""
    u, f = 1e3 * u, 1e3 * f
    at = [np.linspace(0.5, height, 20) * np.sign(height) for height in (inner, outer)]
    return (
        np.concatenate([u[0] + 0.02 * np.sin(at[0]), u, u[-1] + 0.02 * np.sin(at[1])]),
        np.concatenate([f[0] + np.sign(inner) * at[0][::-1], f, f[-1] + np.sign(outer) * at[1]]),
    )


def rows(x, y, more=""):
    return "".join(f"{a:.6f} {b:.6f}{more}\n" for a, b in zip(x, y, strict=True))


def wheel_points():
    """As a meter has them, mm: from the flange back, flange up; with the flange's back face and the rim's face."""
    u, f = with_sides(U, wheel(U), 25.0, 20.0)
    return u + 1e3 * TAPE, -f


def rail_points():
    """As a meter has them, mm: gauge side at positive abscissae, up; with side faces that lean in again."""
    u, f = with_sides(RAIL, rail(RAIL), -20.0, -20.0)
    u[:20] += np.linspace(1.0, 0.0, 20)
    return -u, f


def file_of(folder, name, text):
    path = folder / name
    path.write_text(text)
    return str(path)


def off(curve, u=SEEN, exact=wheel):
    """Largest distance normal to the profile, m."""
    slope = (exact(u + 1e-7) - exact(u - 1e-7)) / 2e-7
    return np.nanmax(np.abs(curve(u) - exact(u)) / np.hypot(1.0, slope))


ON_RAIL = np.linspace(-0.040, 0.025, 651)


def aligned(curve):
    """The curve moved to where it is as low as the rail at -35 mm: the place of a flat highest point is uncertain."""
    aside = np.interp(rail(-0.035), curve.f[curve.u < -0.02], curve.u[curve.u < -0.02]) + 0.035
    assert abs(aside) < 1e-4
    return lambda u: curve(u + aside)


OLD = "MINIPROF 1 2 1999 1 2\nx.prd\nStock.......:\n32.58 37.11 14.71\n(Sd/Sh/qR)\n\n"
QUOTED = '#MINIWHEELPROF\nx_T(R).whl\nMINIPROF 2020\n" 32.58 37.11 14.71\n(Sd/Sh/qR)\n\n'


@pytest.mark.parametrize(
    ("head", "more"),
    [
        (OLD, " 0.000"),
        (QUOTED, ""),
        (KEYS.format("X,Y", 1321), ""),
        (KEYS.format("X,Y,A,C", 1321) + "\n", " 0.1 0.2   a remark"),
        (KEYS.format("X,Y", 1321) + '"RefPoint1="\nUOF1=#title\n\n" 1.0 2.0\n', ""),
    ],
    ids=["old", "old with comments", "keys", "four columns", "quoted keys"],
)
def test_wheels_of_meters_in_every_dialect(tmp_path, capsys, head, more):
    x, y = wheel_points()
    path = file_of(tmp_path, "w.whl", head + rows(x, y, more))
    curve = read_profile(path, "wheel")
    assert off(curve) < 1e-6
    assert curve.u[0] < -0.0685 and curve.u[-1] > 0.0585
    first = 1 + head.count("\n")
    assert "downwards, tape circle 70 mm from the file's origin (assumed), 1321 points" in curve.source
    assert f"left out (side faces, too deep, stepping back, equal, not within): lines {first}-" in curve.source
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "of 1321 points left out, tape_circle assumed" in said


def test_what_a_file_states_is_not_assumed(tmp_path, capsys):
    x, y = wheel_points()
    inside = (x > 1.5) & (x < 128.5)
    head = KEYS.format("Y,X", inside.sum()) + "WheelDiameterTaperline=72.0\n\n"
    curve = read_profile(file_of(tmp_path, "w.whl", head + rows(y[inside], x[inside] + 2.0)), "wheel")
    assert off(curve, SEEN[40:-40]) < 1e-6
    assert "assumed" not in curve.source and "72 mm" in curve.source
    assert capsys.readouterr().err == ""


def test_a_count_that_differs_and_offsets_are_said(tmp_path, capsys):
    x, y = wheel_points()
    head = KEYS.format("X,Y", 9).replace("Xoffset=0.0000", "Xoffset=2.5").replace("Yoffset=", "Yoffset=1.0") + "\n"
    curve = read_profile(file_of(tmp_path, "w.whl", head + rows(x - 2.5, y)), "wheel")
    assert off(curve) < 1e-6
    assert "MiniProf, moved by 2.5 and 1 mm" in curve.source and ", 1321 points, 9 by its header, left" in curve.source
    assert "1321 points, 9 by its header left out, tape_circle assumed" in capsys.readouterr().err


FLANGE_BACK = 1e-3 * (1e3 * TAPE - wheel_points()[0].min())


@pytest.mark.parametrize(
    ("change", "spec"),
    [
        (lambda x, y: (x, -y), {}),
        (lambda x, y: (-x, y), {}),
        (lambda x, y: (x / 25.4, y / 25.4), {"unit": "inch"}),
        (lambda x, y: (x + 5.0, y), {"tape_circle": 0.075}),
        (lambda x, y: (x + 5.0, y), {"flange_back": FLANGE_BACK}),
        (lambda x, y: (x + 5.0, y), {"shift": [-0.075, 0.3]}),
        (lambda x, y: (-x, -y), {"mirrored": True, "downwards": False}),
    ],
    ids=["flange down", "mirrored", "inch", "tape circle", "flange back", "shift", "said"],
)
def test_directions_units_and_origins_of_wheels(tmp_path, change, spec):
    x, y = change(*wheel_points())
    curve = read_profile({"points": file_of(tmp_path, "w.whl", OLD + rows(x, y)), **spec}, "wheel")
    assert off(curve) < 1e-6


def test_a_wheel_without_its_flange_back(tmp_path, capsys):
    x, y = wheel_points()
    seen = x > x[np.argmax(y)] - 0.5  # from the flange's tip on
    path = file_of(tmp_path, "w.whl", OLD + rows(x[seen], y[seen]))
    with pytest.raises(InputError, match="flange_back: expected points up to the flange back, got none that lie 5 mm"):
        read_profile({"points": path, "flange_back": 0.07}, "wheel")
    assert off(read_profile(path, "wheel")) < 1e-6
    assert "tape_circle assumed, no flange back among the points" in capsys.readouterr().err
    read_profile(file_of(tmp_path, "whole.whl", OLD + rows(x, y)), "wheel")
    assert "no flange back" not in capsys.readouterr().err


@pytest.mark.parametrize("up", [1.0, -1.0], ids=["up", "down"])
def test_rails_of_meters(tmp_path, up):
    x, y = rail_points()
    path = file_of(tmp_path, "r.ban", KEYS.format("X,Y", x.size) + "\n" + rows(x, up * y))
    curve = read_profile(path, "rail")
    assert off(aligned(curve), ON_RAIL, rail) < 1e-6
    assert ("downwards" in curve.source) == (up < 0.0) and "mirrored (assumed)" in curve.source
    other = read_profile({"points": path, "mirrored": False}, "rail")
    assert np.max(np.abs(other(-ON_RAIL) - curve(ON_RAIL))) < 1e-8


def test_parts_of_a_file_are_chosen(tmp_path):
    x, y = rail_points()
    parts = "".join(
        f"[Profile{k}Info]\nColumnDef=X,Y,A\n\n[Profile{k}Points]\n{rows(x, y + k, ' 0.1')}\n" for k in (1, 2)
    )
    path = file_of(tmp_path, "two.mpt", "[FileInfo]\nProgramName=Some meter\n\n" + parts)
    one, two = (read_profile({"points": path, "part": k}, "rail") for k in (1, 2))
    assert np.allclose(one.f, two.f, atol=1e-8) and "part 2 of 1, 2" in two.source
    for part, got in ((None, "none"), (3, "3")):
        with pytest.raises(InputError, match=f"part: expected 1 or 2, got {got}"):
            read_profile({"points": path} | ({"part": part} if part else {}), "rail")


def test_another_head_beside_the_rail_is_cut_off_by_request(tmp_path):
    x, y = rail_points()
    beside = np.linspace(80.0, 120.0, 81)
    text = (
        KEYS.format("X,Y", 0) + "\n" + rows(np.append(x[::-1], beside), np.append(y[::-1], -((beside - 100) ** 2) / 80))
    )
    path = file_of(tmp_path, "guard.ban", text)
    with pytest.raises(InputError, match="expected one rail head"):
        read_profile(path, "rail")
    alone = read_profile({"points": path, "within": [-0.05, 0.05]}, "rail")
    assert np.array_equal(alone.f, read_profile(file_of(tmp_path, "r.ban", OLD + rows(x[::-1], y[::-1])), "rail").f)
    first = text.count("\n") - 80
    assert f"-{first + 80}" in alone.source  # the other head's lines are among those left out
    with pytest.raises(InputError, match="within: expected a part of -0.0275[0-9]* to 0.12 m, got 0.5 to 0.6"):
        read_profile({"points": path, "within": [0.5, 0.6]}, "rail")


def test_points_that_step_back_where_passes_meet_are_left_out_and_said(tmp_path):
    x, y = wheel_points()
    k = int(np.argmin(np.abs(x - 16.0)))
    x, y = np.insert(x, k, x[k - 1] - 0.4), np.insert(y, k, y[k - 1] + 0.15)
    curve = read_profile(file_of(tmp_path, "w.whl", OLD + rows(x, y)), "wheel")
    assert f", {k + 7}, " in curve.source
    assert off(curve) < 1e-6


def vampire(folder, name, left, right, head):
    text = head + "".join("{:.6f} {:.6f} {:.6f} {:.6f}\n".format(*p) for p in zip(*left, *right, strict=True))
    return file_of(folder, name, text)


@pytest.mark.parametrize(
    ("datum", "distance"),
    [("EUROPEAN", 70.0), ("US1", (2 + 27 / 32) * 25.4), ("US2", (3 + 1 / 16) * 25.4), ("CUSTOM 71.5", 71.5)],
)
def test_vampire_wheels(tmp_path, datum, distance):
    u, f = with_sides(U, wheel(U), 25.0, 20.0)
    worn = f + 0.5 * np.exp(-((u / 10.0) ** 2))  # mm; f = r0 - r: a hollow
    y = u + 680.0 + distance
    head = f"WHEELPROFILE\na title\nTREADDATUM {datum}\nFLANGEBACK 1360.0\n! y z y z\n"
    path = vampire(tmp_path, "pair.whe", (-y, -worn), (y, -f), head)
    right, left = read_profile(path, "wheel"), read_profile({"points": path, "side": "left"}, "wheel")
    assert off(right) < 1e-6 and f"{distance:.2f} mm from the flange back" in right.source
    hollow = left(SEEN) - wheel(SEEN)
    lost = hollow[np.abs(SEEN).argmin()] - hollow.min()
    assert lost == pytest.approx(0.5e-3, rel=1e-3) == np.ptp(hollow) and "left side" in left.source


def test_vampire_rails(tmp_path):
    u, f = with_sides(RAIL, rail(RAIL), -20.0, -20.0)
    y, up = u + 760.0, f + 150.0
    path = vampire(tmp_path, "pair.rai", (-y, up), (y, up), "RAILPROFILE\nt\nGAUGEPOINT US\nGAUGE 1435\n")
    sides = [read_profile({"points": path, "side": side}, "rail") for side in ("left", "right")]
    assert np.array_equal(sides[0].f, sides[1].f)
    assert off(sides[0], np.linspace(-0.038, 0.024, 621), rail) < 2e-6
    assert "gauge point US, 15.88 mm below the top (track.gauge_depth)" in sides[0].source


WHE = "WHEELPROFILE\nt\nTREADDATUM EUROPEAN\nFLANGEBACK 1360\n"
POINTS = "".join(f"{k} 0\n" for k in range(20))


@pytest.mark.parametrize(
    ("name", "text", "spec", "says"),
    [
        ("w.whl", OLD + "1 2\nx 2\n", {}, "w.whl: line 8: expected two numbers, got 'x 2'"),
        ("w.whl", OLD.replace("\n\n", "\n") + POINTS, {}, "w.whl: line 1: expected a blank line between the header"),
        ("w.whl", "ColumnDef=Y,A\n1 2\n", {}, "w.whl: ColumnDef: expected columns X and Y, got 'Y,A'"),
        ("w.whl", "Xoffset=far\n1 2\n", {}, "w.whl: xoffset: expected a number, got 'far'"),
        ("w.whl", "ColumnDef=X,A,Y\n1 2\n", {}, "w.whl: line 2: expected two numbers, got '1 2'"),
        ("w.whl", "", {}, "expected at least 8 points, got 0"),
        (
            "w.whl",
            OLD + POINTS,
            {"part": 1},
            "part: expected none, as the file has no sections [Profile1Points], got 1",
        ),
        ("w.whl", OLD + POINTS, {"side": "left"}, "side: expected this of Vampire files only"),
        ("w.whl", OLD + POINTS, {"tape_circle": 0.5}, "tape_circle, flange_back or shift says where"),
        ("w.csv", "u_mm,f_mm\n" + POINTS, {"part": 1}, "part: expected this of MiniProf files only"),
        ("r.ban", OLD + POINTS, {}, "r.ban: expected a wheel profile, got a rail"),
        ("w.whe", "WHEEL\n", {}, "w.whe: line 1: expected WHEELPROFILE or RAILPROFILE, got 'WHEEL'"),
        ("w.whe", WHE.replace("WHEELP", "RAILP"), {}, "w.whe: line 1: expected a wheel profile, got a rail"),
        ("w.whe", WHE.replace("EUROPEAN", "ASIAN"), {}, "line 3: expected TREADDATUM and one of EUROPEAN, US1, US2"),
        ("w.whe", WHE.replace("1360", ""), {}, "line 4: expected FLANGEBACK and a number of mm, got 'FLANGEBACK'"),
        ("w.whe", WHE + "1 2 3\n", {}, "line 5: expected y and z of the left and of the right side, four numbers"),
        ("w.whl", "", {"tape_circle": 0.07, "shift": [0, 0]}, "tape_circle: expected this or shift, not both"),
        ("w.whl", "", {"flange_back": 70}, "flange_back: expected a distance in m, within 1, got 70"),
        ("w.whl", "", {"within": [0.0]}, "within: expected two distances in m"),
        ("w.whl", "", {"part": 1.0}, "part: expected a whole number, got 1.0"),
        ("w.whl", "", {"side": "inner"}, "side: expected left or right, got 'inner'"),
    ],
)
def test_faults_name_file_and_line(tmp_path, name, text, spec, says):
    with pytest.raises(InputError) as caught:
        read_profile({"points": file_of(tmp_path, name, text), **spec}, "wheel")
    assert says in str(caught.value) and "\n" not in str(caught.value)


def test_the_origin_of_a_rail_is_its_gauge_point(tmp_path):
    with pytest.raises(InputError, match=r"tape_circle: expected this of wheels only: the gauge point \(track.gauge"):
        read_profile({"points": file_of(tmp_path, "r.ban", POINTS), "tape_circle": 0.07}, "rail")


CHOICES = {
    "guard_rail_test.ban": {"within": [-0.07, 0.0001]},
    "left-roller-v1-pre-dry.ban": {"mirrored": False},
    "right-roller-v1-pre-dry.ban": {"mirrored": False},
    "rail_left_iter288.ban": {"smoothing": 5e-5},
    "SNX00500.mpt": {"part": 1, "smoothing": 1e-6},
}
"""What CONTACT's files do not say themselves."""

MARKS = {
    "Car7216_0001r.whl": (210, 329, 435, 531),
    "Car7358_0001r.whl": (206, 329, 435, 537),
    "Car7422_0001r.whl": (210, 344, 439, 533),
    "Car7813_0001r.whl": (203, 339, 440, 541),
    "MBench_UIC60_v3.ban": (385, 307, 250, 170),
    "SNX00500.mpt": (5662, 5912, 6321, 7032),
    "avg_HR.BAN": (67, 96, 137, 168),
    "avg_low2.ban": (219, 335, 435, 475),
    "avg_wheel.whl": (78, 218, 383, 543),
    "guard_rail_test.ban": (67, 144, 266, 298),
    "left-roller-v1-pre-dry.ban": (90, 166, 263, 320),
    "left-wheel-v1-pre-dry.whl": (619, 502, 323, 165),
    "rail_left_iter288.ban": (179, 279, 375, 434),
    "rail_left_iter795.ban": (179, 279, 361, 402),
    "right-roller-v1-pre-dry.ban": (93, 168, 263, 319),
    "right-wheel-v1-pre-dry.whl": (622, 513, 332, 173),
    "whl_left_iter288.whl": (153, 248, 373, 473),
    "whl_left_iter795.whl": (155, 252, 385, 487),
}
"""Lines of CONTACT's files: flange, flange root, tread, field side; four along the head of rails."""

DOWN = {"left-roller-v1-pre-dry.ban": (1, -1), "right-roller-v1-pre-dry.ban": (1, -1), "MBench_UIC60_v3.ban": (-1, -1)}
"""Signs of the two columns of rails that are not as meters have them."""


def contacts_files():
    folder = Path(os.environ.get("WRCORE_CONTACT", "/nowhere"))
    found = [*(folder / "testbank/profiles").glob("*"), folder / "examples/MBench_UIC60_v3.ban"]
    return sorted(p for p in found if p.suffix.lower() in (".whl", ".ban", ".mpt") and p.is_file())


def test_files_that_contact_ships():
    """All 18 are read. Points on four of their lines, turned by hand, lie on the curve: of wheels in their place, of
    rails but for where the highest point is."""
    files = contacts_files()
    if not files:
        pytest.skip("set WRCORE_CONTACT to a copy of github.com/eve70a/CONTACT")
    assert {path.name for path in files} == set(MARKS)
    for path in files:
        choices = CHOICES.get(path.name, {})
        kind = "wheel" if path.suffix == ".whl" else "rail"
        curve = read_profile({"points": str(path), **choices}, kind)
        lines = path.read_text().splitlines()
        raw = 1e-3 * np.array([lines[k - 1].split()[:2] for k in MARKS[path.name]], dtype=float)
        u, f = (raw * (DOWN.get(path.name, (-1, 1)) if kind == "rail" else (1, -1))).T
        within = 2e-6 + 3.0 * choices.get("smoothing", 0.0)
        if kind == "wheel":
            gap = curve(u - 0.07) - f
            assert np.ptp(gap) < within, path.name
        else:
            start = (-u[np.argmax(f)], -f.max())
            moved = least_squares(lambda by, u=u, f=f, c=curve: np.nan_to_num(c(u + by[0]) - f - by[1], nan=1.0), start)
            assert np.max(np.abs(moved.fun)) < within, path.name
        assert f"{path.name}: MiniProf" in curve.source
