"""Transitions, cant axes and gradients against their integrals, worked out by hand or by quadrature."""

import math

import numpy as np
import pytest

from tests.geometry.test_path import fourth_order, frame, vector
from wrcore.errors import InputError
from wrcore.geometry.path import arc_length_of, centreline
from wrcore.geometry.ramps import STEEPEST
from wrcore.geometry.track import build_track

LENGTH, RADIUS, CANT = 90.0, 300.0, 0.12
TURNED = {  # integral of the shape up to u, exactly
    "linear": lambda u: u**2 / 2.0,
    "bloss": lambda u: u**3 - u**4 / 2.0,
    "cosine": lambda u: u / 2.0 - np.sin(np.pi * u) / (2.0 * np.pi),
}
BLEND = {
    "linear": lambda u: u,
    "bloss": lambda u: 3.0 * u**2 - 2.0 * u**3,
    "cosine": lambda u: 0.5 - 0.5 * np.cos(np.pi * u),
}
RATE = {
    "linear": lambda u: 1.0,
    "bloss": lambda u: 6.0 * u * (1.0 - u),
    "cosine": lambda u: 0.5 * np.pi * np.sin(np.pi * u),
}
ERROR = {"linear": 1e-12, "bloss": 1e-12, "cosine": 3e-9}
"""Of the change: the cosine is a spline."""
SHAPES = tuple(TURNED)


def built(path, **track):
    return build_track({"path": path, **track}, "test").path


def transition(shape, about="lower_rail"):
    curve = {"curve": 50.0, "radius": RADIUS, "cant": CANT, "widening": 0.01}
    return built([{"transition": LENGTH, "shape": shape}, curve], cant_about=about)


@pytest.mark.parametrize("shape", SHAPES)
def test_a_transition_turns_and_ends_where_the_integrals_of_its_shape_say(shape):
    # heading = L/R times the shape's integral; x + i y = integral of e^(i heading), Gauss-Legendre on 40 points. The
    # plan of a line that climbs by 0.06 m is shorter, so this one is level.
    path = built([{"transition": LENGTH, "shape": shape}, {"curve": 50.0, "radius": RADIUS}])
    nodes, weights = np.polynomial.legendre.leggauss(40)
    for s in (11.0, 45.0, 77.7, LENGTH):
        v = 0.5 * s * (nodes + 1.0)
        end = np.sum(0.5 * s * weights * np.exp(1j * LENGTH / RADIUS * TURNED[shape](v / LENGTH)))
        station, u = centreline(path, s), s / LENGTH
        assert station.curvature * RADIUS == pytest.approx(BLEND[shape](u), abs=ERROR[shape])
        assert station.heading == pytest.approx(LENGTH / RADIUS * TURNED[shape](u), abs=0.1 * ERROR[shape])
        assert (station.x, station.y) == pytest.approx((end.real, end.imag), abs=max(1e-11, ERROR[shape] * 3.0))
    assert centreline(path, LENGTH).heading == pytest.approx(0.5 * LENGTH / RADIUS, abs=1e-14)


@pytest.mark.parametrize("shape", SHAPES)
def test_curvature_cant_and_widening_run_alike_and_their_rates_are_the_shapes(shape):
    path = transition(shape)
    for u in (0.11, 0.5, 0.83):  # away from rounded corners
        station = centreline(path, u * LENGTH)
        bound = {"linear": 1e-12, "bloss": 1e-12, "cosine": 3e-7}[shape]
        assert station.curvature * RADIUS == pytest.approx(BLEND[shape](u), abs=ERROR[shape])
        assert -station.sin_roll * 1.5 / CANT == pytest.approx(BLEND[shape](u), abs=ERROR[shape])
        assert station.widening / 0.01 == pytest.approx(BLEND[shape](u), abs=ERROR[shape])
        assert station.curvature_rate * RADIUS * LENGTH == pytest.approx(RATE[shape](u), abs=bound)
        rate = -station.roll_rate * station.cos_roll * 1.5 * LENGTH / CANT
        assert rate == pytest.approx(RATE[shape](u), abs=bound)
        assert station.slope * 2.0 * LENGTH / CANT == pytest.approx(RATE[shape](u), abs=bound)
        assert station.widening_rate * LENGTH / 0.01 == pytest.approx(RATE[shape](u), abs=bound)
    steepest = max(RATE[shape](u) for u in np.linspace(0.0, 1.0, 101))
    assert steepest == pytest.approx(STEEPEST[shape], rel=1e-12)


def test_hermite_is_another_name_of_bloss():
    assert (transition("hermite").pieces == transition("bloss").pieces).all()


MIXED = [
    {"tangent": 20.0}, {"transition": 40.0, "shape": "bloss", "radius": 800.0, "cant": 0.05},
    {"transition": 30.0, "radius": 500.0, "cant": 0.08, "widening": 0.004},
    {"transition": 50.0, "shape": "cosine"}, {"curve": 100.0, "radius": 300.0, "cant": 0.12, "widening": 0.01},
    {"transition": 80.0, "shape": "bloss"}, {"curve": 60.0, "radius": -400.0, "cant": 0.06},
    {"transition": 60.0, "shape": "cosine", "radius": 600.0, "cant": 0.04}, {"transition": 40.0}, {"tangent": 30.0},
]  # fmt: skip
GRADIENTS = [
    {"gradient": 0.0, "length": 90.0}, {"gradient": 0.03, "radius": 2000.0, "length": 200.0},
    {"gradient": -0.02, "radius": 1500.0, "length": 150.0}, {"gradient": -0.005, "radius": 3000.0},
]  # fmt: skip


@pytest.fixture(scope="module", params=["lower_rail", "inner_rail", "centreline"])
def mixed(request):
    return built(MIXED, cant_about=request.param, gradients=GRADIENTS)


def test_any_sequence_is_continuous_from_end_to_end(mixed):
    # but for what jumps by definition: the curvature's rate, and second derivatives at the ends of Bloss and cosine
    for s in mixed.starts[1:]:
        before, after = centreline(mixed, np.nextafter(s, -np.inf)), centreline(mixed, s)
        for name in set(before._fields) - {"curvature_rate", "slope_rate", "roll_rate_rate"}:
            assert getattr(before, name) == pytest.approx(getattr(after, name), abs=1e-12), (s, name)
    # headings add up: each transition is antisymmetric about its middle
    turned = 20.0 / 800 + 15.0 * (1 / 800 + 1 / 500) + 25.0 * (1 / 500 + 1 / 300) + 100.0 / 300
    turned += 40.0 * (1 / 300 - 1 / 400) - 60.0 / 400 + 30.0 * (1 / 600 - 1 / 400) + 20.0 / 600
    assert centreline(mixed, 510.0).heading == pytest.approx(turned, abs=1e-13)


@pytest.mark.parametrize("s", [30.3, 71.0, 77.7, 105.0, 121.0, 170.0, 277.0, 281.3, 330.0, 420.0, 455.0, 530.0, 700.0])
def test_tangent_and_rates_are_the_derivatives_on_all_of_it(mixed, s):
    station, matrix = frame(mixed, s)
    assert fourth_order(lambda v: vector(centreline(mixed, v)), s, 0.01) == pytest.approx(matrix[:, 0], abs=1e-10)
    pairs = {"heading": "curvature", "curvature": "curvature_rate", "z": "slope", "slope": "slope_rate",
             "widening": "widening_rate"}  # fmt: skip
    for name, rate in pairs.items():
        difference = fourth_order(lambda v, name=name: getattr(centreline(mixed, v), name), s, 0.01)
        assert difference == pytest.approx(getattr(station, rate), abs=1e-10), name
    assert np.linalg.norm(matrix[:, 0]) == pytest.approx(1.0, abs=1e-12)
    point = vector(station) + matrix @ np.array([0.0, 0.5, 0.46])
    assert arc_length_of(mixed, *point, s + 3.0) == pytest.approx(s, abs=1e-10)


def rails(path, s):
    """Heights of the running circles of the left and the right rail."""
    station, matrix = frame(path, s)
    return tuple(station.z + side * 0.75 * matrix[2, 1] for side in (1.0, -1.0))


@pytest.mark.parametrize("shape", SHAPES)
def test_cant_turns_the_track_about_what_is_asked_for(shape):
    # a reverse curve: the cant changes sign in the middle of the transition between its curves
    reverse = [
        {"transition": 80.0, "shape": shape}, {"curve": 40.0, "radius": 400.0, "cant": 0.1},
        {"transition": 120.0, "shape": shape}, {"curve": 40.0, "radius": -500.0, "cant": 0.07},
    ]  # fmt: skip
    level = 5e-8  # the climbing line's cosine: 0.05 m times slope^2 / 2
    lower, inner, centre = (built(reverse, cant_about=about) for about in ("lower_rail", "inner_rail", "centreline"))
    for s in (40.0, 100.0, 150.0, 210.0, 260.0):
        h = -1.5 * centreline(lower, s).sin_roll
        for path in (lower, inner):
            left, right = rails(path, s)
            assert (left if h > 0.0 else right) == pytest.approx(0.0, abs=level)
            assert abs(right - left) == pytest.approx(abs(h), abs=level)
        assert centreline(centre, s).z == 0.0 and centreline(centre, s).slope == 0.0
        assert rails(centre, s) == pytest.approx((-0.5 * h, 0.5 * h), abs=1e-15)
    zero = next(s for s in np.arange(120.0, 240.0, 0.01) if centreline(lower, s).sin_roll > 0.0)
    fold = centreline(lower, zero).z  # |h|/2 rounded over 4 m: at the corner the jump of the slope times 4 m / 12
    assert fold == pytest.approx(abs(centreline(lower, zero).roll_rate) * 1.5 * 4.0 / 12.0, rel=1e-2)


def test_inner_and_lower_rail_differ_where_the_outer_one_is_the_lower():
    path = [{"transition": 60.0, "shape": "bloss"}, {"curve": 40.0, "radius": 400.0, "cant": -0.05}]
    assert rails(built(path), 90.0) == pytest.approx((0.05, 0.0), abs=1e-15)
    assert rails(built(path, cant_about="inner_rail"), 90.0) == pytest.approx((0.0, -0.05), abs=1e-15)


def test_gradients_rise_along_vertical_curves():
    # up 3 %, over the top, down 2 %: tangent lengths R/2 (difference of dz/ds), height from the tangents' polygon
    path = built("tangent", gradients=GRADIENTS)
    up, down, last = (g / math.hypot(1.0, g) for g in (0.03, -0.02, -0.005))
    assert centreline(path, 30.0)[:6] == (30.0, 0.0, 0.0, 1.0, 0.0, 0.0)
    on = centreline(path, 200.0)
    assert (on.slope, on.z) == pytest.approx((up, up * 110.0), abs=1e-13)
    assert on.slope / on.level == pytest.approx(0.03, rel=1e-14)
    reach = 0.5 * 1500.0 * (up - down)
    assert centreline(path, 290.0 - reach - 2.1).slope == pytest.approx(up, abs=1e-15)
    assert centreline(path, 290.0 + reach + 2.1).slope == pytest.approx(down, abs=1e-15)
    top = centreline(path, 290.0)
    assert top.slope_rate == pytest.approx(-1.0 / 1500.0, rel=1e-12)
    assert top.slope == pytest.approx(0.5 * (up + down), abs=1e-13)
    sag = 0.5 * reach**2 / 1500.0 + 2.0**2 / 6.0 / 1500.0  # of the parabola below the polygon, and of its rounding
    assert top.z == pytest.approx(200.0 * up - sag, abs=1e-12)
    for s in (600.0, 5000.0):
        end = centreline(path, s)
        assert (end.slope, end.z) == pytest.approx((last, 200.0 * up + 150.0 * down + last * (s - 440.0)), abs=1e-11)
    nodes, weights = np.polynomial.legendre.leggauss(20)
    pieces = np.concatenate(([0.0], path.starts[1:], [600.0]))
    run = sum(
        np.sum(0.5 * (b - a) * weights * [centreline(path, 0.5 * (a + b) + 0.5 * (b - a) * x).level for x in nodes])
        for a, b in zip(pieces[:-1], pieces[1:], strict=True)
    )
    assert centreline(path, 600.0).x == pytest.approx(run, abs=1e-11)


@pytest.mark.parametrize("after", [0.09, -0.06])
def test_a_circular_vertical_curve_keeps_its_radius_over_its_arc(after):
    # arc length R (difference of angles), half to either side of s = 100 m; height by R (cos - cos)
    radius, before = 400.0, 0.02
    gradients = [
        {"gradient": before, "length": 100.0}, {"gradient": after, "radius": radius, "vertical_curve": "circle"},
    ]  # fmt: skip
    path = built("tangent", gradients=gradients)
    first, last = math.atan(before), math.atan(after)
    sign, half = math.copysign(1.0, last - first), 0.5 * radius * abs(last - first)
    begin = centreline(path, 100.0 - half)
    for s in np.linspace(100.0 - half + 2.5, 100.0 + half - 2.5, 9):
        angle, station = first + sign * (s - 100.0 + half) / radius, centreline(path, s)
        smeared = 1.0 - (4.0 / radius) ** 2 / 24.0  # its mean over the rounding length
        assert station.slope == pytest.approx(math.sin(angle) * smeared, abs=1e-8)
        assert station.slope_rate / station.level == pytest.approx(sign / radius, rel=1e-4)
        risen = sign * radius * (math.cos(first) - math.cos(angle))
        rounding = sign * 4.0**2 / 24.0 / radius  # height that rounding adds behind the corner, and at it a half
        assert station.z - begin.z == pytest.approx(risen * smeared + 0.5 * rounding, abs=3e-7)
    end = centreline(path, 100.0 + half + 2.5)
    assert end.slope == pytest.approx(math.sin(last), abs=1e-15)
    parabola = built("tangent", gradients=[gradients[0], {"gradient": after, "radius": radius}])
    steep = 100.0 + half - 2.5
    station = centreline(parabola, steep)  # its curvature grows by one over the incline's cosine
    assert station.slope_rate / station.level == pytest.approx(sign / radius / station.level, rel=1e-9)


def test_a_line_may_be_on_a_gradient_all_along_and_turn_there():
    path = built(MIXED, gradients=[{"gradient": -0.025}], cant_about="centreline")
    for s in (-200.0, 0.0, 130.0, 2000.0):
        station = centreline(path, s)
        assert station.slope == pytest.approx(-0.025 / math.hypot(1.0, 0.025), abs=1e-15)
        assert station.z == pytest.approx(station.slope * s, abs=1e-12)
    ring = built([{"transition": 60.0}, {"curve": 10.0, "radius": 300.0}], gradients=[{"gradient": 0.025}])
    around = 600.0 * math.pi  # headings turn with the arc length in space, so the spiral closes in plan
    here, there = (vector(centreline(ring, s)) for s in (80.0, 80.0 + around))
    assert there - here == pytest.approx([0.0, 0.0, around * 0.025 / math.hypot(1.0, 0.025)], abs=1e-9)


CURVE = {"curve": 100.0, "radius": 300.0}
BAD = [
    ({"path": [{"transition": 9.0, "shape": "sine"}, CURVE]}, "track.path.0.shape", "'bloss'"),
    ({"path": [{"tangent": 9.0, "shape": "bloss"}]}, "track.path.0.shape", "no such key in a tangent"),
    ({"path": [{"transition": 9.0, "radius": 300.0}, CURVE]}, "track.path.0.radius", "no such key in a transition"),
    ({"path": [{"transition": 9.0, "cant": 0.05}, {"transition": 9.0}, {"tangent": 9.0}]}, "track.path.0.cant",
     "a curve before or after"),
    ({"path": [{"transition": 9.0, "shape": "bloss"}, {**CURVE, "cant": 0.08}]}, "track.path.0.transition", "0.01 m/m"),
    ({"cant_about": "outer_rail"}, "track.cant_about", "'inner_rail'"),
    ({"gauge_depth": 14}, "track.gauge_depth", "in m"),
    ({"gradients": [{"gradient": 20}]}, "track.gradients.0.gradient", "as a ratio"),
    ({"gradients": [{"length": 20.0}]}, "track.gradients.0.gradient", "the key is missing"),
    ({"gradients": [{"gradient": 0.0}, {"gradient": 0.01, "radius": 2e3}]}, "track.gradients.0.length", "but the last"),
    ({"gradients": [{"gradient": 0.0, "length": 9.0}]}, "track.gradients.0.length", "all but the last"),
    ({"gradients": [{"gradient": 0.0, "radius": 2e3}]}, "track.gradients.0.radius", "all but the first"),
    ({"gradients": [{"gradient": 0.0, "length": 9.0}, {"gradient": 0.01}]}, "track.gradients.1.radius", "the first"),
    ({"gradients": [{"gradient": 0.01, "vertical_curve": "circle"}]}, "track.gradients.0.vertical_curve", "the first"),
    ({"gradients": [{"gradient": 0.0, "length": 9.0}, {"gradient": 0.01, "radius": 5e2, "vertical_curve": "arc"}]},
     "track.gradients.1.vertical_curve", "'circle'"),
    ({"gradients": [{"gradient": 0.0, "length": 50.0}, {"gradient": 0.02, "radius": 5e3, "length": 80.0},
                    {"gradient": 0.0, "radius": 5e3}]}, "track.gradients", "overlapping vertical curves"),
]  # fmt: skip


@pytest.mark.parametrize(("data", "field", "expected"), BAD)
def test_bad_descriptions_name_their_field(data, field, expected):
    with pytest.raises(InputError) as caught:
        build_track(data, "scene.yaml")
    assert (caught.value.source, caught.value.field) == ("scene.yaml", field)
    assert expected in caught.value.expected
