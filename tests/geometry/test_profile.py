"""ProfileCurve: interpolation, curvature average, points, pose."""

import re

import numpy as np
import pytest

from wrcore.errors import InputError
from wrcore.geometry.profiles.profile import ProfileCurve, averaged_second_derivative
from wrcore.geometry.profiles.sections import Arc, Line, Polynomial, evaluate, incline, usable_span
from wrcore.geometry.profiles.standards import RAIL_HEADS, named_profile, rail_sections, s1002_sections

R13 = 0.013


def circle_points(radius, half_width, count):
    u = np.linspace(-half_width, half_width, count)
    return u, np.sqrt(radius**2 - u**2) - radius


# --- interpolation ---------------------------------------------------------------------------------------------------


def test_nodes_are_exact_in_value_and_slope():
    """Node values of the circle R = 0.3 m in closed form."""
    rail = named_profile("circle:0.3", "rail")
    root = np.sqrt(0.09 - rail.u**2)
    assert np.allclose(rail.f, root - 0.3, rtol=0.0, atol=1e-16)
    assert np.allclose(rail.df, -rail.u / root, rtol=1e-13, atol=1e-16)


def test_nodes_are_uniform_hold_zero_and_are_frozen():
    wheel = named_profile("S1002", "wheel")
    assert np.allclose(np.diff(wheel.u), wheel.spacing, rtol=1e-9)
    assert 0.0 in wheel.u
    for array in (wheel.u, wheel.f, wheel.df, wheel.d2f):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


@pytest.mark.parametrize("slope", [1.0, 5.0])
def test_hermite_error_stays_below_its_bound_on_the_gauge_corner(slope):
    """Bound h^4/384 max|f''''|, for a circle f'''' = -3 R^2 (R^2 + 4 x^2) (R^2 - x^2)^(-7/2); h = 0.05 mm."""
    corner = ProfileCurve.from_sections("corner", "rail", (Arc(0.0, -R13, R13, -1.5, 1.5),))
    edge = R13 * np.sin(np.arctan(slope))
    u = np.linspace(-edge, edge, 20011)
    error = np.max(np.abs(corner(u) - (np.sqrt(R13**2 - u**2) - R13)))
    x = edge + corner.spacing
    bound = corner.spacing**4 / 384 * 3 * R13**2 * (R13**2 + 4 * x**2) * (R13**2 - x**2) ** -3.5
    assert error < bound
    assert bound < 0.2e-6  # DESIGN 7
    assert error > 0.1 * bound  # the bound is that of this interpolation, not of a coarser one


def test_hermite_error_falls_with_the_fourth_power_of_the_spacing():
    errors = []
    u = np.linspace(-0.01, 0.01, 4001)
    for h in (4e-4, 2e-4, 1e-4):
        curve = ProfileCurve.from_sections("corner", "rail", (Arc(0.0, -R13, R13, -1.5, 1.5),), spacing=h)
        errors.append(np.max(np.abs(curve(u) - (np.sqrt(R13**2 - u**2) - R13))))
    assert np.diff(np.log2(errors)) == pytest.approx([-4.0, -4.0], abs=0.2)


@pytest.mark.parametrize("kind", ["wheel", "rail"])
def test_position_is_within_0_2_um_of_the_exact_sections(kind):
    """DESIGN 7; includes cells that hold a section border. Slopes up to 5."""
    sections = s1002_sections() if kind == "wheel" else incline(rail_sections(RAIL_HEADS["60E1"]), 1 / 40)
    curve = ProfileCurve.from_sections("exact", kind, sections)
    u = np.linspace(curve.u[0], curve.u[-1], 400001)
    f, df = evaluate(usable_span(sections, 10.0)[2], u)
    working = np.abs(df) <= 5.0
    assert np.max(np.abs(curve(u) - f)[working]) < 0.2e-6
    assert np.max(np.abs(curve(u, 1) - df)[working]) < 0.01


def test_slope_is_the_derivative_of_the_value():
    wheel = named_profile("S1002", "wheel")
    u = np.linspace(-0.06, 0.055, 997)
    step = 1e-7
    assert np.allclose((wheel(u + step) - wheel(u - step)) / (2 * step), wheel(u, 1), rtol=0.0, atol=1e-5)


def test_calls_take_any_shape_and_are_nan_outside():
    wheel = named_profile("S1002", "wheel")
    grid = np.array([[0.0, -0.055], [0.061, np.nan]])
    for nu in (0, 1, 2):
        value = wheel(grid, nu)
        assert value.shape == (2, 2)
        assert np.array_equal(np.isnan(value), [[False, False], [True, True]])
    assert np.isnan(wheel(np.inf)) and np.isnan(wheel(-1.0))
    assert wheel(wheel.u[-1]) == pytest.approx(wheel.f[-1], abs=1e-16)
    assert wheel(wheel.u[0], 1) == wheel.df[0]


def test_only_three_derivatives_exist():
    with pytest.raises(ValueError, match="0, 1 or 2"):
        named_profile("cone:1/20", "wheel")(0.0, 3)


def test_second_derivative_is_linear_between_nodes():
    wheel = named_profile("S1002", "wheel")
    middle = 0.5 * (wheel.u[1:] + wheel.u[:-1])
    assert np.allclose(wheel(middle, 2), 0.5 * (wheel.d2f[1:] + wheel.d2f[:-1]), rtol=1e-9)


# --- curvature -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("window", [2e-4, 1e-3, 4e-3])
@pytest.mark.parametrize(("radius", "slope"), [(0.3, 0.3), (0.013, 3.0)])
def test_average_curvature_is_exact_inside_an_arc_however_steep(radius, slope, window):
    """Curvature -1/R; f'' = -(1 + f'^2)^(3/2) / R."""
    arc = (Arc(0.0, -radius, radius, -1.4, 1.4),)
    curve = ProfileCurve.from_sections("arc", "rail", arc, window=window)
    inside = np.abs(curve.df) <= slope
    kappa = (curve.d2f / (1.0 + curve.df**2) ** 1.5)[inside]
    assert np.allclose(kappa, -1.0 / radius, rtol=1e-9)


def test_average_curvature_spans_a_border_by_arc_length():
    """At the tangent point of R300 and R80 half of the window lies on each: kappa = -(1/300 + 1/80) / 2 per mm."""
    sections = rail_sections(RAIL_HEADS["UIC60-MBench"])
    rail = ProfileCurve.from_sections("upright", "rail", sections, window=1e-3)
    at = 0.0105
    assert at in np.round(rail.u, 12)
    kappa = rail(at, 2) / (1.0 + rail(at, 1) ** 2) ** 1.5
    assert kappa == pytest.approx(-0.5 * (1 / 0.3 + 1 / 0.08), rel=2e-3)  # the border cell is bridged linearly
    away = np.array([at - 0.6e-3, at + 0.6e-3])
    assert np.allclose(rail(away, 2) / (1.0 + rail(away, 1) ** 2) ** 1.5, [-1 / 0.3, -1 / 0.08], rtol=1e-6)


def test_average_curvature_of_a_polynomial_tends_to_its_second_derivative():
    """f = 5 u^2 + 100 u^3: f'' = 10 + 600 u, small slopes; the mean over a symmetric window is f'' itself."""
    u = np.arange(-200, 201) * 5e-5
    d2f = averaged_second_derivative(u, 5 * u**2 + 100 * u**3, 10 * u + 300 * u**2, 2e-4)
    assert np.allclose(d2f[10:-10], (10 + 600 * u)[10:-10], rtol=1e-4)


def test_average_curvature_is_cut_off_at_the_ends():
    """Straight line, then an arc of R = 0.1 m: the last node sees the arc only, the first one the line only."""
    sections = (Line(-0.02, 0.0, 0.0, 0.0), Arc(0.0, -0.1, 0.1, 0.0, 0.2))
    curve = ProfileCurve.from_sections("line and arc", "rail", sections, window=1e-3)
    assert curve.d2f[0] == 0.0
    assert curve.d2f[-1] == pytest.approx(-10.0 * (1.0 + curve.df[-1] ** 2) ** 1.5, rel=1e-9)


@pytest.mark.parametrize("window", [0.0, -1e-3, float("nan")])
def test_a_window_without_length_is_refused(window):
    with pytest.raises(ValueError, match="window: expected a number, at least 1e-06"):
        named_profile("S1002", "wheel", window=window)


# --- sections --------------------------------------------------------------------------------------------------------


def test_an_arc_turns_rigidly():
    """Every point keeps its distance to the origin, and the normal angle of the turned arc gives its slope."""
    arc = Arc(0.01, -0.2, 0.2, -0.1, 0.15)
    turned = arc.rotated(0.05)
    for before, after in zip(arc.ends, turned.ends, strict=True):
        assert np.hypot(*before) == pytest.approx(np.hypot(*after), rel=1e-15)
    u = np.array([turned.point(0.05)[0]])
    f, df = turned.evaluate(u)
    assert f[0] == pytest.approx(turned.point(0.05)[1], abs=1e-15)
    assert df[0] == pytest.approx(-np.tan(0.05), abs=1e-14)


def test_a_polynomial_is_published_in_mm():
    """z = 2 + 3 y + 4 y^2 in mm at y = 2 mm: 24 mm, slope 19."""
    f, df = Polynomial(0.0, 0.005, (2.0, 3.0, 4.0)).evaluate(np.array([0.002]))
    assert f[0] == pytest.approx(0.024, abs=1e-15)
    assert df[0] == pytest.approx(19.0, abs=1e-12)


def test_the_curve_ends_at_a_vertical_face():
    """A 1:20 side face (slope 20) is outside the curve; the R13 corner ends at slope 10."""
    rail = named_profile("54E1", "rail", 0)
    assert np.abs(rail.df).max() <= 10.0
    assert np.abs(rail.df).max() > 5.0


# --- points ----------------------------------------------------------------------------------------------------------


def test_points_on_a_circle_give_its_curve():
    """R = 0.3 m, points every 0.5 mm: a cubic spline's error is 5/384 h^4 f'''' < 1e-13 m away from the ends."""
    u, f = circle_points(0.3, 0.03, 121)
    curve = ProfileCurve.from_points(u, f, "rail")
    inside = np.linspace(-0.025, 0.025, 333)
    assert np.allclose(curve(inside), np.sqrt(0.09 - inside**2) - 0.3, rtol=0.0, atol=1e-11)
    assert np.allclose(curve(inside, 2), -0.09 / (0.09 - inside**2) ** 1.5, rtol=1e-4)


def test_points_of_a_rail_are_followed_round_the_steep_gauge_corner():
    """Exact 60E1 sections sampled every 0.1 mm along the rail: back within 0.2 um (normal distance) up to slope 5."""
    sections = incline(rail_sections(RAIL_HEADS["60E1"]), 1 / 40)
    points = [s.point(b) for s in sections[1:-1] for b in np.arange(s.first, s.last, 1e-4 / s.radius)]
    points = np.array(sections[0].ends[:1] + tuple(points) + sections[-1].ends)
    curve = ProfileCurve.from_points(*points.T, "rail")
    exact = named_profile("60E1", "rail", 1 / 40)
    u = exact.u[np.abs(exact.df) <= 5.0]
    assert np.max(np.abs(curve(u) - exact(u)) / np.hypot(1.0, exact(u, 1))) < 0.2e-6
    assert curve.gauge_offset() == pytest.approx(exact.gauge_offset(), abs=0.2e-6)


def test_points_may_come_in_falling_order():
    u, f = circle_points(0.3, 0.03, 61)
    rising, falling = (ProfileCurve.from_points(u[::k], f[::k], "rail") for k in (1, -1))
    assert np.allclose(rising.f, falling.f, rtol=0.0, atol=1e-15)


def test_a_rail_moves_to_its_highest_point():
    """A circle drawn 3 mm off and 1 mm up comes back to the origin."""
    u, f = circle_points(0.3, 0.03, 121)
    curve = ProfileCurve.from_points(u + 0.003, f + 0.001, "rail")
    inside = np.linspace(-0.02, 0.02, 41)
    assert np.allclose(curve(inside), np.sqrt(0.09 - inside**2) - 0.3, rtol=0.0, atol=1e-10)
    assert curve(0.0) == pytest.approx(0.0, abs=1e-15)


def test_a_rail_keeps_an_origin_at_the_height_of_its_top():
    """10 um beside the top of R300 the height is 0.17 nm lower: no shift, as the top is not that well defined."""
    u, f = circle_points(0.3, 0.03, 121)
    curve = ProfileCurve.from_points(u + 1e-5, f, "rail")
    assert curve(0.0) == pytest.approx(0.0, abs=1e-15)
    assert curve(0.0, 1) == pytest.approx(1e-5 / 0.3, rel=1e-3)


def test_upright_points_can_be_inclined():
    """A circle turned about its top is the same circle, but the flat 1 mm beside it is not: compare with sections."""
    sections = rail_sections(RAIL_HEADS["UIC60-MBench"])
    u = np.linspace(-0.032, 0.032, 641)
    curve = ProfileCurve.from_points(u, evaluate(sections, u)[0], "rail", inclination=1 / 40)
    exact = named_profile("UIC60-MBench", "rail", 1 / 40)
    inside = np.linspace(-0.030, 0.018, 481)
    assert np.max(np.abs(curve(inside) - exact(inside))) < 0.2e-6


def test_a_wheel_moves_to_its_tape_circle():
    u = np.linspace(-0.06, 0.055, 1151)
    wheel = named_profile("S1002", "wheel")
    curve = ProfileCurve.from_points(u, wheel(u) + 0.002, "wheel")
    assert curve(0.0) == pytest.approx(0.0, abs=1e-15)
    assert np.nanmax(np.abs(curve(u) - wheel(u))) < 0.2e-6


def test_noise_is_told_unless_it_is_evened_out(capsys):
    """8 um of it on points of S1002 half a millimetre apart bend the curve by some 30/m; 0.1 um of rounding do not."""
    u = np.arange(-0.04, 0.03, 5e-4)
    f = named_profile("S1002", "wheel")(u)
    noisy = f + np.random.default_rng(7).normal(scale=8e-6, size=u.size)
    ProfileCurve.from_points(u, np.round(f, 7), "wheel", "rounded")
    ProfileCurve.from_points(u, noisy, "wheel", "smoothed", smoothing=1e-5)
    assert capsys.readouterr().err == ""
    ProfileCurve.from_points(u, noisy, "wheel", "noisy")
    said = capsys.readouterr().err
    told = re.fullmatch(r"wrcore: noisy: points scatter by (\S+) m, .* by (\d+)/m \(.*smoothing.*\)\n", said)
    assert float(told[1]) == pytest.approx(8e-6, rel=0.2) and float(told[2]) == pytest.approx(32.0, rel=0.3)


def test_smoothing_takes_out_noise():
    """Points of R = 0.3 m with 2 um of noise: the smoothed curve is closer to the circle than the points are."""
    u, f = circle_points(0.3, 0.03, 601)
    noise = np.random.default_rng(7).normal(scale=2e-6, size=u.size)
    smooth = ProfileCurve.from_points(u, f + noise, "rail", smoothing=2e-6)
    rough = ProfileCurve.from_points(u, f + noise, "rail")
    inside = np.linspace(-0.02, 0.02, 401)
    exact = np.sqrt(0.09 - inside**2) - 0.3

    def error(curve):
        return np.std(curve(inside) - exact)

    assert error(rough) > 1e-6
    assert error(smooth) < 0.5e-6
    assert np.std(smooth(inside, 2)) < 0.1 * np.std(rough(inside, 2))


def test_a_turning_profile_is_trimmed_on_request():
    """A full circle, walked round: the portion around its top that is not steeper than 10."""
    b = np.linspace(-3.0, 3.0, 601)
    u, f = 0.02 * np.sin(b), 0.02 * np.cos(b)
    curve = ProfileCurve.from_points(u, f, "rail", trim=True)
    limit = 0.02 * np.sin(np.arctan(10.0))
    assert curve.u[0] == pytest.approx(-limit, abs=1e-4)
    assert curve.u[-1] == pytest.approx(limit, abs=1e-4)
    assert curve.gauge_offset() == pytest.approx(np.sqrt(0.02**2 - 0.006**2), abs=1e-8)
    assert curve.gauge_offset(0.024) == pytest.approx(0.02, abs=1e-9)  # the circle's widest place lies above


def test_gauge_of_points_is_nan_where_they_end_too_high():
    """R = 0.3 m, 30 mm wide: 1.5 mm deep only."""
    curve = ProfileCurve.from_points(*circle_points(0.3, 0.03, 61), "rail")
    assert np.isnan(curve.gauge_offset_m)
    assert curve.gauge_offset(0.001) == pytest.approx(np.sqrt(0.09 - 0.299**2), abs=1e-9)


def test_a_wheel_has_no_gauge_offset():
    wheel = named_profile("S1002", "wheel")
    assert np.isnan(wheel.gauge_offset_m)
    with pytest.raises(InputError, match="expected a rail"):
        wheel.gauge_offset()


def _bad(change):
    u, f = circle_points(0.3, 0.03, 61)
    return change(u.copy(), f.copy())


def _put(array, index, value):
    array[index] = value
    return array


@pytest.mark.parametrize(
    ("points", "kind", "says"),
    [
        (_bad(lambda u, f: (u[:7], f[:7])), "rail", "at least 8 points, got 7"),
        (_bad(lambda u, f: ([], [])), "rail", "at least 8"),
        (_bad(lambda u, f: (u, f[:-1])), "rail", "equal length"),
        (_bad(lambda u, f: (_put(u, 4, np.nan), f)), "rail", "line 5: expected finite"),
        (_bad(lambda u, f: (u, _put(f, 60, np.inf))), "rail", "line 61: expected finite"),
        (_bad(lambda u, f: (_put(u, 9, u[8]), f)), "rail", "line 10: expected strictly monotone"),
        (_bad(lambda u, f: (_put(u, 30, u[28]), f)), "rail", "line 31: expected strictly monotone"),
        (_bad(lambda u, f: (1e3 * u, 1e3 * f)), "rail", "looks like mm: u and f in m"),
        (_bad(lambda u, f: (1e-3 * u, 1e-3 * f)), "rail", "5 mm to 1 m wide, got numbers that span 6e-05"),
        (_bad(lambda u, f: (u, -f)), "rail", "highest point at an end"),
        (_bad(lambda u, f: (u, -10.0 * u**2)), "wheel", "falls on both sides like a rail"),
        (_bad(lambda u, f: (u + 0.05, 0.05 * u)), "wheel", "u = 0"),
        (
            _bad(lambda u, f: (u, 0.05 * u + 0.003 * (u > 0.02) - 0.01 * (u < -0.02) * (-0.02 - u) / 0.01)),
            "wheel",
            "slopes below 10, got a steeper place at u = 0.0",
        ),
        (_bad(lambda u, f: (0.1 * u, -10.0 * u**2)), "rail", "smooth profile around u = 0, got 0.00"),
        (_bad(lambda u, f: (u, -0.05 * u)), "wheel", "flange at negative u"),
    ],
)
def test_bad_points_are_one_clear_line(points, kind, says):
    with pytest.raises(InputError) as caught:
        ProfileCurve.from_points(*points, kind, name="bad.csv")
    assert says in str(caught.value)
    assert str(caught.value).startswith("bad.csv: ")


def test_smoothing_of_points_too_close_is_refused_or_kept():
    """Two points 0.2 um apart, as of a merged scan, under the largest smoothing."""
    u, f = circle_points(0.3, 0.03, 61)
    u, f = np.insert(u, 30, u[30] - 2e-7), np.insert(f, 30, f[30])
    try:
        curve = ProfileCurve.from_points(u, f, "rail", smoothing=1e-3)
    except InputError as error:
        assert "smoothing: expected less than 0.001 m of points" in str(error)
    else:
        assert abs(curve(0.0)) < 1e-4


@pytest.mark.parametrize("smoothing", [-1e-6, 1.0, float("nan")])
def test_a_bad_smoothing_is_refused(smoothing):
    with pytest.raises(InputError, match="0 to 0.001"):
        ProfileCurve.from_points(*circle_points(0.3, 0.03, 61), "rail", smoothing=smoothing)
