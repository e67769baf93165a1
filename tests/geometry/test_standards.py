"""Named profiles against their published sections, landmarks and exported files."""

import csv
import os
from pathlib import Path

import numpy as np
import pytest

from wrcore.errors import InputError
from wrcore.geometry.profiles import files as profile_files
from wrcore.geometry.profiles import sections as profile_sections
from wrcore.geometry.profiles.standards import (
    RAIL_HEADS,
    circle_sections,
    list_profiles,
    named_profile,
    rail_sections,
    s1002_sections,
)

ROOT = Path(__file__).parents[2]
SHARED = Path(os.environ.get("WRCORE_SHARED", ROOT.parent / "shared"))
LANDMARKS = ROOT / "tests/data/profiles/rail_landmarks.csv"


def shared_file(*parts):
    path = SHARED.joinpath(*parts)
    if not path.exists():
        pytest.skip(f"{path.name} is not ours to distribute; set WRCORE_SHARED to the folder that holds it")
    return path


def landmarks():
    rows = csv.DictReader(line for line in LANDMARKS.read_text().splitlines() if not line.startswith("#"))
    return [(r["profile"], r["point"], float(r["y_mm"]) * 1e-3, float(r["z_mm"]) * 1e-3) for r in rows]


# --- S1002 -----------------------------------------------------------------------------------------------------------


def test_s1002_flange_tip_lies_28_mm_below_the_tape_circle_at_minus_55_mm():
    wheel = named_profile("S1002", "wheel")
    assert wheel(-0.055) == pytest.approx(-0.028, abs=1e-12)
    assert wheel(-0.055, 1) == pytest.approx(0.0, abs=1e-12)
    assert np.nanmin(wheel.f) == wheel(-0.055)


def test_s1002_flange_angle_is_70_degrees():
    """Steepest part of the flange: the straight section, 70.0 degrees (EN 13715)."""
    wheel = named_profile("S1002", "wheel")
    front = wheel.u > -0.055
    assert np.degrees(np.arctan(wheel.df[front].max())) == pytest.approx(70.0, abs=1e-6)


def test_s1002_tape_circle_and_flange_thickness():
    """f(0) = 0, slope 0.03358537058 (coefficient of the standard); 32.5 mm from the back, z = 10 mm at y = -37.5."""
    wheel = named_profile("S1002", "wheel")
    assert wheel(0.0) == 0.0
    assert wheel(0.0, 1) == pytest.approx(0.03358537058, abs=1e-12)
    assert wheel(-0.0375) == pytest.approx(-0.010, abs=2e-7)


def test_s1002_published_coefficients_jump_and_the_correction_closes_the_jumps():
    """Jumps of 0.1183283 um at -35 mm and 0.0365479 um at -26 mm: the published coefficients in 40-digit arithmetic.

    (FACTS: 0.119 and 0.037 um.) Closing them moves section C by less than 0.2 um.
    """
    sections = s1002_sections()
    for left, right in zip(sections, sections[1:], strict=False):
        (_, (u, f)), ((u_next, f_next), _) = left.ends, right.ends
        assert u == pytest.approx(u_next, abs=1e-15)
        assert f == pytest.approx(f_next, abs=2e-10)
    c = np.polynomial.Polynomial([-4320.221063, -1038.384026, -106.5501873, -6.051367875, -0.2054332446,
                                  -4.169739389e-3, -4.687195829e-5, -2.252755540e-7])  # fmt: skip
    wheel = named_profile("S1002", "wheel")
    assert abs(wheel(-0.035) * 1e3 + c(-35.0)) == pytest.approx(1.183283e-4, abs=2e-9)
    assert abs(wheel(-0.026) * 1e3 + c(-26.0)) == pytest.approx(3.65479e-5, abs=2e-9)
    y = np.linspace(-35.0, -26.0, 181)
    assert np.max(np.abs(wheel(y * 1e-3) + c(y) * 1e-3)) < 0.2e-6


def test_s1002_slopes_agree_at_section_borders():
    """FACTS: to 1e-4 at every border."""
    sections = s1002_sections()
    for left, right in zip(sections, sections[1:], strict=False):
        border = np.array([right.ends[0][0]])
        assert left.evaluate(border)[1] == pytest.approx(right.evaluate(border)[1], abs=1e-4)


def test_s1002_agrees_with_the_benchmark_file_within_0_2_um():
    path = shared_file("reference", "MBench_S1002_v3.prw")
    u, f, _ = profile_files.read_simpack(path, path.read_text())
    wheel = named_profile("S1002", "wheel")
    inside = (u >= -0.062) & (u <= 0.060)
    assert inside.sum() > 300
    assert np.max(np.abs(wheel(u[inside]) - f[inside])) < 0.2e-6


# --- rails -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "point", "y", "z"), landmarks())
def test_upright_rail_has_its_published_transition_points(name, point, y, z):
    order = {"R1_R2": 3, "R2_R3": 2, "R3_side": 1}[point]  # index of the section, from the gauge side
    sections = rail_sections(RAIL_HEADS[name])
    assert np.allclose(sections[order].ends[0], (-y, -z), rtol=0.0, atol=1e-12)
    assert np.allclose(sections[-1 - order].ends[1], (y, -z), rtol=0.0, atol=1e-12)


def test_60e2_head_is_72_mm_wide_14_3_mm_below_the_crown():
    """Radii and widths end tangent to the 1:20 face where 72 mm width at 14.3 mm are, as for 60E1."""
    corner = rail_sections(RAIL_HEADS["60E2"])[1].ends[0]
    assert np.allclose(corner, (-0.036, -0.0143), rtol=0.0, atol=0.5e-6)


@pytest.mark.parametrize("name", RAIL_HEADS)
def test_rail_sections_are_continuous_and_tangent(name):
    sections = profile_sections.incline(rail_sections(RAIL_HEADS[name]), 1 / 40)
    for left, right in zip(sections, sections[1:], strict=False):
        assert np.allclose(left.ends[1], right.ends[0], rtol=0.0, atol=1e-15)
    angles = [a for s in sections[1:-1] for a in (s.first, s.last)]
    assert np.allclose(angles[1:-1:2], angles[2::2], rtol=0.0, atol=1e-14)


def test_upright_rail_is_symmetric():
    rail = named_profile("60E1", "rail", 0)
    u = np.linspace(0.0, 0.034, 171)
    assert np.allclose(rail(u), rail(-u), rtol=0.0, atol=1e-15)


@pytest.mark.parametrize("inclination", [0.0, 1 / 40, 1 / 20])
@pytest.mark.parametrize("name", RAIL_HEADS)
def test_inclined_rail_has_its_origin_at_the_highest_point(name, inclination):
    rail = named_profile(name, "rail", inclination)
    assert rail(0.0) == pytest.approx(0.0, abs=1e-15)
    assert rail(0.0, 1) == pytest.approx(0.0, abs=1e-14)
    assert rail.f.max() <= 1e-15


def test_inclined_rail_turns_about_the_crown_to_the_gauge_side():
    """Axis point of the crown: R300 arc turned by t = atan(1/40) gives (-300 sin t, -300 (1 - cos t)) mm.

    FACTS 1.2 reads (-7.4917, -0.0937) mm from the benchmark file, whose origin is 6.0 um beside the highest point.
    """
    t = np.arctan(1 / 40)
    rail = named_profile("UIC60-MBench", "rail", 1 / 40)
    assert rail(-0.3 * np.sin(t)) == pytest.approx(-0.3 * (1.0 - np.cos(t)), abs=1e-15)
    assert rail(-0.3 * np.sin(t), 1) == pytest.approx(1 / 40, abs=1e-11)  # between nodes
    assert -300.0 * np.sin(t) == pytest.approx(-7.4917, abs=0.0061)
    assert -300.0 * (1.0 - np.cos(t)) == pytest.approx(-0.0937, abs=1e-4)


def test_arcs_stay_arcs_when_inclined():
    """Circle through three points on either side of the origin: R = 300 mm."""
    rail = named_profile("UIC60-MBench", "rail", 1 / 40)
    u = np.array([-0.017, -0.004, 0.002])
    f = rail(u)
    a, b, c = np.hypot(u[1] - u[0], f[1] - f[0]), np.hypot(u[2] - u[1], f[2] - f[1]), np.hypot(u[2] - u[0], f[2] - f[0])
    area = 0.5 * abs((u[1] - u[0]) * (f[2] - f[0]) - (u[2] - u[0]) * (f[1] - f[0]))
    assert a * b * c / (4.0 * area) == pytest.approx(0.3, rel=1e-7)


def test_rail_curve_reaches_contact_angles_of_76_degrees_on_both_sides():
    for name in RAIL_HEADS:
        rail = named_profile(name, "rail", 1 / 40)
        assert rail.df[0] > np.tan(np.radians(76.0))
        assert rail.df[-1] < -np.tan(np.radians(76.0))


def test_uic60_agrees_with_the_benchmark_file_within_0_2_um():
    """File of 1:40 rail; its origin lies 6.0 um to the gauge side of the highest point (FACTS 1.2: -7.4917 mm).

    The distance is measured along the normal, as FACTS does: where the slope is 5, 0.03 um of rounding in the file's
    lateral coordinate are 0.15 um in f.
    """
    path = shared_file("reference", "MBench_UIC60_v3.prr")
    u, f, _ = profile_files.read_simpack(path, path.read_text())
    rail = named_profile("UIC60-MBench", "rail", 1 / 40)
    u = u - (0.3 * np.sin(np.arctan(1 / 40)) - 7.4917e-3)
    slope = rail(u, 1)
    inside = np.abs(slope) <= 5.0
    assert inside.sum() > 200
    assert np.max(np.abs(rail(u) - f)[inside] / np.hypot(1.0, slope[inside])) < 0.2e-6
    assert np.max(np.abs(rail(u) - f)[np.abs(slope) <= 2.0]) < 0.2e-6


def test_60e1_and_the_benchmark_rail_differ_by_up_to_0_04_mm():
    """FACTS 1.2: up to 0.040 mm in z, upright."""
    u = np.linspace(-0.0345, 0.0345, 691)
    difference = named_profile("60E1", "rail", 0)(u) - named_profile("UIC60-MBench", "rail", 0)(u)
    assert np.max(np.abs(difference[np.abs(u) < 0.031])) == pytest.approx(0.04e-3, abs=0.01e-3)


# --- gauge -----------------------------------------------------------------------------------------------------------


def outline_polygon(name, inclination, count=200001):
    """Dense points on the inclined rail, laid without the code under test: arcs by angle, then turned."""
    points = []
    for s in rail_sections(RAIL_HEADS[name])[1:-1]:
        b = np.linspace(s.first, s.last, count)
        points.append(np.column_stack((s.uc + s.radius * np.sin(b), s.fc + s.radius * np.cos(b))))
    t = np.arctan(inclination)
    u, f = (np.concatenate(points) @ np.array([[np.cos(t), np.sin(t)], [-np.sin(t), np.cos(t)]])).T
    top = np.argmax(f)
    return u - u[top], f - f[top]


@pytest.mark.parametrize("inclination", [1 / 40, 1 / 20])
@pytest.mark.parametrize("name", ["UIC60-MBench", "60E1", "60E2", "54E1"])
def test_gauge_offset_is_the_innermost_point_within_14_mm(name, inclination):
    u, f = outline_polygon(name, inclination)
    expected = -u[f >= -0.014].min()
    assert named_profile(name, "rail", inclination).gauge_offset() == pytest.approx(expected, abs=0.4e-6)


def test_gauge_offset_of_the_benchmark_rail():
    """CONTACT places the benchmark rail's origin at 760.53 mm for 717.5 mm half gauge: 43.03 mm."""
    rail = named_profile("UIC60-MBench", "rail", 1 / 40)
    assert rail.gauge_offset_m == pytest.approx(0.04303, abs=1e-5)


def test_gauge_offset_lies_on_the_exact_gauge_corner():
    """At 14 mm the inclined 60E1 is still on its R13 arc: the distance from the arc's centre is 13 mm to 1e-9 m."""
    t = np.arctan(1 / 40)
    u, f = -0.02301603041666667, -0.014949147044725608  # centre of R13 (FACTS 1.2), upright
    offset = named_profile("60E1", "rail", 1 / 40).gauge_offset()
    top = (0.3 * np.sin(t), 0.3 - 0.3 * np.cos(t))  # highest point of the turned R300 arc, centre (0, -300)
    turned = (u * np.cos(t) - f * np.sin(t), u * np.sin(t) + f * np.cos(t))
    arc = (turned[0] - top[0], turned[1] - top[1])
    assert np.hypot(-offset - arc[0], -0.014 - arc[1]) == pytest.approx(0.013, abs=1e-9)


@pytest.mark.parametrize("radius", [0.06, 0.3])
def test_gauge_offset_of_a_circular_head(radius):
    """sqrt(R^2 - (R - 14 mm)^2)."""
    rail = named_profile(f"circle:{radius}", "rail")
    assert rail.gauge_offset() == pytest.approx(np.sqrt(radius**2 - (radius - 0.014) ** 2), abs=1e-12)


def test_gauge_offset_finds_an_undercut():
    """Turned beyond its side face the leftmost point is the vertical tangent of the R13 arc, above the depth."""
    steep = profile_sections.incline(rail_sections(RAIL_HEADS["UIC60-MBench"]), 0.15)
    arc = steep[1]
    assert profile_sections.innermost(steep, 0.024) == pytest.approx(arc.uc - 0.013, abs=1e-15)


def test_gauge_offset_is_nan_where_the_rail_ends_too_high():
    assert np.isnan(profile_sections.innermost(circle_sections(0.3), 0.05))


# --- analytic forms and the entrance ---------------------------------------------------------------------------------


def test_cone_has_the_larger_radius_on_the_flange_side():
    wheel = named_profile("cone:1/20", "wheel")
    assert wheel(-0.03) == pytest.approx(-0.0015, abs=1e-15)
    assert np.allclose(wheel.df, 0.05, rtol=1e-12)
    assert np.allclose(wheel.d2f, 0.0, atol=1e-9)


def test_circle_has_its_radius_everywhere():
    rail = named_profile("circle:0.3", "rail", 1 / 40)
    assert rail(0.05) == pytest.approx(np.sqrt(0.3**2 - 0.05**2) - 0.3, abs=1e-12)


def test_every_listed_profile_can_be_built():
    rows = list_profiles()
    assert {r["name"] for r in rows} >= {"S1002", "UIC60-MBench", "60E1", "54E1", "50E6", "49E1"}
    for row in rows:
        curve = named_profile(row["name"], row["kind"], 1 / 40 if row["kind"] == "rail" else 0.0)
        assert curve.source == row["source"]
        assert np.all(np.isfinite([curve.f, curve.df, curve.d2f]))


def test_a_path_may_hold_a_name(tmp_path, monkeypatch):
    assert np.array_equal(named_profile(Path("S1002"), "wheel").f, named_profile("S1002", "wheel").f)
    with pytest.raises(InputError, match="inclination: expected a ratio for 60E1"):
        named_profile(Path("60E1"), "rail")
    monkeypatch.chdir(tmp_path)
    Path("worn").write_text("u_m,f_m\n" + "".join(f"{u},{0.05 * u}\n" for u in np.linspace(-0.03, 0.03, 61)))
    assert named_profile(Path("worn"), "wheel").source == "measured points, worn: columns, 61 points"


@pytest.mark.parametrize(
    ("spec", "kind", "says"),
    [
        ("S1003", "wheel", "one of S1002"),
        (Path("S1003"), "wheel", "a point file or one of S1002, cone:1/20, got 'S1003'; did you mean 'S1002'?"),
        ("60E9", "rail", "UIC60-MBench, 60E1"),
        ("S1002", "rail", "which is a wheel"),
        ("60E1", "wheel", "which is a rail"),
        ("circle:0.3", "wheel", "which is a rail"),
        ("cone:1/20", "rail", "which is a wheel"),
        ("cone:", "wheel", "one of S1002"),
        ("cone:steep", "wheel", "after the colon"),
        ("cone:1/0", "wheel", "after the colon"),
        ("cone:3", "wheel", "-0.5 to 0.5"),
        ("circle:nan", "rail", "after the colon"),
        ("circle:300", "rail", "0.01 to 100"),
        (["S1002"], "wheel", "spec: expected text or a Path or a mapping"),
        (None, "rail", "spec: expected text or a Path or a mapping"),
        ("", "rail", "one of UIC60-MBench"),
        ("absent.csv", "rail", "absent.csv"),
    ],
)
def test_a_bad_name_is_one_clear_line(spec, kind, says):
    with pytest.raises(InputError) as caught:
        named_profile(spec, kind)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("inclination", [40, float("nan"), "1/40"])
def test_a_bad_inclination_is_refused(inclination):
    with pytest.raises(InputError, match="ratio like 1/40"):
        named_profile("60E1", "rail", inclination)


def test_a_named_rail_has_no_silent_inclination(tmp_path):
    """0.135 instead of 0.356: what an inclination of 1/40 or none makes of the conicity at 1 mm."""
    with pytest.raises(InputError, match="inclination: expected a ratio for 60E1, such as 1/40"):
        named_profile("60E1", "rail")
    path = str(tmp_path / "rail.csv")
    (tmp_path / "rail.csv").write_text(
        "u_m,f_m\n" + "".join(f"{u},{-5 * u * u}\n" for u in np.linspace(-0.03, 0.03, 61))
    )
    with pytest.raises(InputError, match="inclination: expected a ratio for"):
        named_profile({"points": path, "inclined": False}, "rail")
    assert named_profile(path, "rail", 0.0).gauge_offset(1e-4) == named_profile(path, "rail").gauge_offset(1e-4)


@pytest.mark.parametrize(
    ("spec", "kind", "says"),
    [
        ("FILE", "rail", "inclination: expected none or 0, as the points of FILE lie in the track pose already"),
        ({"points": "FILE", "inclined": True}, "rail", "points of FILE, inclined: true, lie in the track pose"),
        ({"points": "FILE", "smoothing": 1e-5}, "rail", "write {points: FILE, inclined: false}"),
        ("S1002", "wheel", "inclination: expected none for the wheel S1002"),
    ],
)
def test_inclination_without_effect_is_refused(tmp_path, spec, kind, says):
    """0.127 instead of 0.353: the conicity at 1 mm on upright points whose inclination is passed over."""
    path = tmp_path / "rail.csv"
    path.write_text("u_m,f_m\n" + "".join(f"{u},{-5 * u * u}\n" for u in np.linspace(-0.03, 0.03, 61)))
    spec = {**spec, "points": str(path)} if isinstance(spec, dict) else spec.replace("FILE", str(path))
    with pytest.raises(InputError) as caught:
        named_profile(spec, kind, 1 / 40)
    assert says.replace("FILE", str(path)) in str(caught.value)
