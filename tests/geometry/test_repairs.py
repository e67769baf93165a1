"""What measured files lack or hold twice: every repair is said, and one that nobody can believe is refused."""

import re

import numpy as np
import pytest

from wrcore.errors import InputError
from wrcore.errors.messages import _say_once
from wrcore.geometry.irregularity import read_irregularity
from wrcore.geometry.profiles.files import read_profile
from wrcore.geometry.profiles.standards import named_profile

U = np.linspace(-0.060, 0.055, 1151)
POINTS = 1e3 * U, 1e3 * named_profile("S1002", "wheel")(U)
RAIL = named_profile("UIC60-MBench", "rail", 1 / 40)


@pytest.fixture
def said(capsys):
    """What has been said on standard error since the last time."""
    _say_once.cache_clear()
    return lambda: capsys.readouterr().err


def written(folder, rows, name="wheel.csv"):
    (folder / name).write_text("\n".join(rows) + "\n")
    return folder / name


def rows_of(separator, decimal=".", header="u_mm{0}f_mm", more=""):
    rows = [f"{u:.4f}{separator}{f:.6f}{more}".replace(".", decimal) for u, f in zip(*POINTS, strict=True)]
    return [header.format(separator), *rows] if header else rows


@pytest.mark.parametrize("rows", [
    rows_of(";", ","), rows_of(" ; ", ","), rows_of(";"), rows_of(","), rows_of(", "), rows_of("\t"), rows_of("  "),
    rows_of(";", ",", "", "; 1,5"), rows_of(",", ".", "", ",1"), rows_of(",", ".", "", " 1.0"),
    rows_of(";", ",", more=";"),
    rows_of("\t", ","), rows_of("\t", ",", "", "\t1,5"), rows_of(",\t"), rows_of("\t\t", ","),
    rows_of(" ", ","), rows_of(" ", ",", ""), rows_of(" ", ",", "", " 0,5"),
])  # fmt: skip
def test_every_way_to_write_the_same_points(tmp_path, rows, said):
    """Decimal commas beside semicolons, tabs and blanks are read."""
    curve = read_profile({"points": written(tmp_path, rows), "unit": "mm"}, "wheel")
    assert np.abs(curve(U[5:-5]) - 1e-3 * POINTS[1][5:-5]).max() < 1e-8 and said() == ""


@pytest.mark.parametrize("rows", [
    rows_of(",", ","), rows_of("\t", ",", "", ",5"), rows_of(",", ",", ""), rows_of(" ", ",", "", ", 1.5"),
    rows_of(";", ".")[:5] + ["-59.6;1.234,5"] + rows_of(";")[6:], rows_of(",")[:3] + ["-59.8,26,7"],
    ["-60,5,-26,9", "-50,2,-20,1", "-40,3,-10,2"], ["-6,05e1,-2,69e1", "-5,02e1,-2,01e1", "-4,03e1,-1,02e1"],
    ["u_mm f_mm w", "-60 -26,9", "-50 -20,1"],
], ids=["commas", "tabs", "no header", "blanks and commas", "thousands", "one row", "whole", "powers",
        "a column short"])  # fmt: skip
def test_decimal_commas_that_may_be_read_in_two_ways_are_refused(tmp_path, rows):
    with pytest.raises(
        InputError, match=r"wheel.csv: line \d+: expected .*; decimal commas are read beside semicolons"
    ):
        read_profile({"points": written(tmp_path, rows), "unit": "mm"}, "wheel")


def without(low, high):
    """Rows of the wheel without the points between two abscissas, mm."""
    return ["u_mm,f_mm", *(f"{u:.4f},{f:.6f}" for u, f in zip(*POINTS, strict=True) if not low < u < high)]


@pytest.mark.parametrize("gap", [(-50, -30), (-40, -28), (-10, 10), (-62, -40), (-41, -33), (-38, -32)])
def test_a_gap_whose_shape_nobody_knows_is_refused(tmp_path, gap):
    """The first one was filled 3.95 mm off the wheel."""
    path = written(
        tmp_path, [*without(*gap)[:1], "-60.1,-20.0", *without(*gap)[1:]] if gap[0] == -62 else without(*gap)
    )
    with pytest.raises(InputError, match=r"wheel.csv: line \d+: expected points at most .* got a gap of 0.0"):
        read_profile(path, "wheel")


def test_a_gap_that_is_bridged_is_said(tmp_path, said):
    curve = read_profile(written(tmp_path, without(-30, -27)), "wheel")
    assert np.abs(curve(U[5:-5]) - 1e-3 * POINTS[1][5:-5]).max() < 1e-4
    assert re.fullmatch(
        r"wrcore: .*wheel.csv: line 303: a gap of 0.0032 m at u = -0.03 m, .* bridged by a spline\n", said()
    )


def test_the_ends_of_a_straight_line_are_no_gap(tmp_path, said):
    """The outer tread of S1002 is straight from 32.16 mm on (EN 13715): two points say all of it."""
    curve = read_profile(written(tmp_path, without(36, 54)), "wheel")
    assert said() == "" and abs(float(curve(0.045)) - float(named_profile("S1002", "wheel")(0.045))) < 1e-7


def heads(depth, apart, form):
    """A rail head with another one beside it, 3 mm lower, and a groove of a depth (mm) between them."""
    u = np.linspace(-30.0, 30.0, 301)
    f = 1e3 * np.interp(1e-3 * u, RAIL.u, RAIL(RAIL.u))
    walls = np.interp(
        v := np.arange(30.2, 30.0 + apart, 0.2), [30, 31, 29 + apart, 30 + apart], [f[-1], -depth, -depth, -3]
    )
    beside = [(30.0 + apart + 0.2 * k, -3.0 - 1e-3 * (0.2 * k - 10.0) ** 2) for k in range(101)]
    points = [*zip(u, f, strict=True), *zip(v, walls, strict=True), *beside]
    if form == "csv":
        return ["u_mm,f_mm", *(f"{a:.4f},{b:.6f}" for a, b in points)]
    keys = ["header.begin", "version = 1", "type = 0", "header.end", "spline.begin", "units.len.f = 1000"]
    return [*keys, "point.begin", *(f"{a:.4f} {-b:.6f}" for a, b in points), "point.end", "spline.end"]


@pytest.mark.parametrize("form", ["csv", "prr"])
@pytest.mark.parametrize(
    ("depth", "says"),
    [
        (20.0, "points more than 15 mm beside its head, as of another head"),
        (45.0, "another one, .* m below the highest"),
    ],
)
def test_a_slice_with_two_heads_is_refused(tmp_path, depth, says, form):
    """All but the highest head was left out, without a word."""
    with pytest.raises(InputError, match=f"got {says}"):
        read_profile(written(tmp_path, heads(depth, 40.0, form), f"rail.{form}"), "rail")


def irregularity(folder, s, left):
    rows = [f"{a:.6f},{b:.9f}" for a, b in zip(s, left, strict=True)]
    return written(folder, ["s_m,left_lateral_m", *rows], "track.csv")


S = 0.25 * np.arange(400)
LEFT = 2e-3 * np.sin(2 * np.pi * S / 7.0) * np.sin(np.pi * S / S[-1])


def test_two_samples_close_together_make_no_defect(tmp_path):
    """0.1 mm between samples 1 mm apart became a defect of many millimetres."""
    s, left = np.insert(S, 201, S[200] + 1e-3), np.insert(LEFT, 201, LEFT[200] + 1e-4)
    with pytest.raises(InputError, match=r"track.csv: line 20[1-4]: expected samples that a spline can follow"):
        read_irregularity(irregularity(tmp_path, s, left))


def test_two_samples_that_agree_may_be_close_together(tmp_path, said):
    at = S[200] + 1e-3
    path = irregularity(tmp_path, np.insert(S, 201, at), np.insert(LEFT, 201, np.interp(at, S, LEFT)))
    s, values = read_irregularity(path)
    assert np.abs(values[:, 0]).max() < 1.02 * np.abs(LEFT).max() and "track.csv: samples 0.001 to 0.25 m" in said()


@pytest.mark.parametrize(("length", "refused"), [(25.0, True), (1.5, True), (1.0, False)])
def test_a_gap_between_samples_is_refused_or_said(tmp_path, said, length, refused):
    keep = (S <= 40.0) | (S >= 40.0 + length)
    path = irregularity(tmp_path, S[keep], LEFT[keep])
    if refused:
        with pytest.raises(
            InputError, match=f"line 163: expected samples at most 1.25 m apart, .* a gap of {length:g} m"
        ):
            read_irregularity(path)
    else:
        read_irregularity(path)
        assert said().count("\n") == 1


def test_uniform_samples_of_any_kind_overshoot_less_than_what_is_refused(tmp_path):
    """No spline through uniform samples is doubted: noise, a step, a single sample; with distances 10 % apart, too."""
    rng = np.random.default_rng(3)
    for left in (rng.normal(size=400), (S > 50.0).astype(float), (S == 50.0).astype(float)):
        s = S + 0.025 * rng.uniform(-1.0, 1.0, len(S))
        read_irregularity(irregularity(tmp_path, s, 1e-3 * left))
