"""Path: exact curves, frames by finite differences, joints, the inverse, and every kind of bad description."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.special import fresnel

from wrcore.errors import InputError
from wrcore.geometry.path import (
    arc_length_of,
    centreline,
    frame_turn,
    path_data,
    rail_direction,
    segment_at,
    tangent_path,
    track_frame,
)
from wrcore.geometry.path_pieces import CANT_BASE, _cosine_series
from wrcore.geometry.ramps import rounded_ramp
from wrcore.geometry.track import Track, build_track

# An S of two curves to the left and right with cant, widening and transitions between all parts.
WINDING = [
    {"tangent": 50.0},
    {"transition": 100.0},
    {"curve": 300.0, "radius": 300.0, "cant": 0.15, "widening": 0.01},
    {"transition": 100.0},
    {"curve": 200.0, "radius": -200.0, "cant": 0.1, "widening": 0.02},
    {"transition": 60.0},
    {"tangent": 150.0},
]
JOINTS = [0.0, 50.0, 150.0, 450.0, 550.0, 750.0, 810.0, 960.0]


@pytest.fixture(scope="module")
def winding():
    return build_track({"path": WINDING}, "test").path


def vector(station):
    return np.array([station.x, station.y, station.z])


def frame(path, s):
    matrix = np.empty((3, 3))
    return track_frame(path, s, matrix), matrix


def test_clothoid_ends_where_the_fresnel_integrals_say():
    # curvature s / (R L): x + i y = a (C + i S)(s / a), a = sqrt(pi R L); 1000 m with R = 300 m turns by 95 degrees
    length, radius = 1000.0, 300.0
    path = path_data([0.0, length], [0.0, 1.0 / radius], [0.0, 0.0], [0.0, 0.0], 4.0)
    scale = math.sqrt(math.pi * radius * length)
    for s in np.linspace(0.0, length, 37):
        sine, cosine = fresnel(s / scale)
        station = centreline(path, s)
        assert abs(station.x - scale * cosine) < 1e-11
        assert abs(station.y - scale * sine) < 1e-11
        assert station.heading == pytest.approx(s**2 / (2.0 * radius * length), abs=1e-14)


@pytest.mark.parametrize("radius", [20.0, -150.0, 4000.0])
def test_a_circle_closes_on_itself_within_and_beyond_the_path(radius):
    turn = 2.0 * math.pi * abs(radius)
    path = build_track({"path": [{"transition": 60.0}, {"curve": 1.5 * turn, "radius": radius}]}, "test").path
    for s in (60.0, 60.0 + 0.7 * turn):  # the second ends beyond the path; 4e-15: 20 roundings of the size
        here, there = centreline(path, s), centreline(path, s + turn)
        assert np.allclose(vector(here), vector(there), rtol=0.0, atol=4e-15 * turn + 1e-12)
        assert there.heading - here.heading == pytest.approx(math.copysign(2.0 * math.pi, radius), abs=1e-12)


def test_plan_of_a_canted_transition_is_the_integral_of_the_inclined_tangent(winding):
    # r' = (cos i cos h, cos i sin h, sin i): the line climbs, so its plan is shorter than s
    def plan(s):
        station = centreline(winding, s)
        return math.cos(math.asin(station.slope)) * math.cos(station.heading)

    x, error = quad(plan, 50.0, 150.0, points=[52.0, 148.0], epsabs=1e-12)
    assert error < 1e-11
    assert centreline(winding, 150.0).x - centreline(winding, 50.0).x == pytest.approx(x, abs=1e-11)


def test_before_the_path_it_is_straight(winding):
    station = centreline(winding, -123.4)
    assert vector(station) == pytest.approx([-123.4, 0.0, 0.0], abs=1e-12)
    assert (station.tx, station.ty, station.slope, station.curvature) == (1.0, 0.0, 0.0, 0.0)
    assert segment_at(winding, -123.4) == 0


def test_cant_ramp_at_the_very_beginning_reaches_back_by_half_the_rounding_only():
    path = build_track({"path": [{"transition": 60.0}, {"curve": 10.0, "radius": 300.0, "cant": 0.1}]}, "test").path
    assert centreline(path, -2.0).roll_rate == 0.0
    assert centreline(path, -2.5).x == -2.5
    assert centreline(path, -1.0).roll_rate < 0.0


def test_after_the_path_curvature_cant_and_widening_stay():
    path = build_track(
        {"path": [{"transition": 60.0}, {"curve": 1.0, "radius": 500.0, "cant": 0.1, "widening": 0.005}]}, "test"
    ).path
    for s in (65.0, 2000.0):
        station, matrix = frame(path, s)
        assert station.curvature == pytest.approx(1 / 500.0, rel=1e-14)
        assert -station.sin_roll * CANT_BASE == pytest.approx(0.1, abs=1e-15)
        assert (station.z, station.widening) == pytest.approx((0.05, 0.005), abs=1e-15)
        assert matrix.T @ matrix == pytest.approx(np.eye(3), abs=1e-13)


def test_frame_is_orthonormal_and_right_handed(winding):
    for s in np.linspace(-20.0, 1100.0, 1501):
        _, matrix = frame(winding, s)
        assert np.abs(matrix.T @ matrix - np.eye(3)).max() < 1e-13
        assert np.linalg.det(matrix) == pytest.approx(1.0, abs=1e-13)


def fourth_order(function, s, h):
    """Central difference with error h^4."""
    return (8.0 * (function(s + h) - function(s - h)) - function(s + 2 * h) + function(s - 2 * h)) / (12.0 * h)


# Away from joints and from the ends of the roundings, where a third derivative jumps.
PLACES = [20.0, 49.0, 51.0, 100.3, 149.2, 300.0, 480.0, 509.0, 511.0, 530.0, 600.0, 751.2, 780.0, 811.0, 900.0, 1000.0]


@pytest.mark.parametrize("s", PLACES)
def test_tangent_curvature_and_turn_are_the_derivatives(winding, s):
    # steps of 1 cm: rounding 1e-13 / 1e-2 = 1e-11, truncation h^4 below
    station, matrix = frame(winding, s)
    assert fourth_order(lambda v: vector(centreline(winding, v)), s, 0.01) == pytest.approx(matrix[:, 0], abs=1e-10)
    assert fourth_order(lambda v: centreline(winding, v).heading, s, 0.01) == pytest.approx(
        station.curvature, abs=1e-11
    )
    rates = {
        "curvature": station.curvature_rate, "slope": station.slope_rate, "widening": station.widening_rate,
        "roll_rate": station.roll_rate_rate, "sin_roll": station.roll_rate * station.cos_roll,
        "z": station.slope,
    }  # fmt: skip
    for name, rate in rates.items():
        difference = fourth_order(lambda v, name=name: getattr(centreline(winding, v), name), s, 0.01)
        assert difference == pytest.approx(rate, abs=1e-11), name
    turn = matrix @ np.array(frame_turn(station))
    derivative = fourth_order(lambda v: frame(winding, v)[1], s, 0.01)
    assert derivative == pytest.approx(np.cross(turn, matrix.T).T, abs=1e-10)


def test_everything_is_continuous_over_joints(winding):
    # all but the rates of curvature and widening rate's own rate; the second derivative of roll included
    names = [name for name in centreline(winding, 0.0)._fields if name != "curvature_rate"]
    for s in winding.starts[1:]:
        before, after = centreline(winding, np.nextafter(s, -np.inf)), centreline(winding, s)
        for name in names:
            assert getattr(before, name) == pytest.approx(getattr(after, name), abs=1e-12), (s, name)


def test_lookup_finds_the_piece_that_a_search_finds(winding):
    for s in np.concatenate((np.linspace(-5.0, 1200.0, 4001), winding.starts[1:])):
        assert segment_at(winding, s) == np.searchsorted(winding.starts, s, side="right") - 1


def test_short_segments_far_apart_are_found_too():
    path = build_track(
        {"path": [{"tangent": 1e5}, {"transition": 1.0}, {"curve": 0.5, "radius": 300.0}, {"transition": 1.0},
                  {"tangent": 1e5}]}, "test",
    ).path  # fmt: skip
    for s in (1e5 + 0.5, 1e5 + 1.2, 1e5 + 2.0, 1.5e5):
        assert segment_at(path, s) == np.searchsorted(path.starts, s, side="right") - 1


def test_cant_raises_the_outer_rail_and_leaves_the_inner_one(winding):
    # left curve, h = 0.15: the right running circle is at 0.15 m, the left one at 0; right curve, h = 0.1: mirrored
    for s, low, high in ((300.0, 0.75, -0.75), (650.0, -0.75, 0.75)):
        station, matrix = frame(winding, s)
        outer = vector(station) + high * matrix[:, 1]
        inner = vector(station) + low * matrix[:, 1]
        assert inner[2] == pytest.approx(0.0, abs=1e-15)
        assert outer[2] == pytest.approx(0.15 if s < 500.0 else 0.1, abs=1e-15)
    assert centreline(winding, 300.0).sin_roll < 0.0 < centreline(winding, 650.0).sin_roll


@pytest.mark.parametrize("s", [100.0, 480.0, 530.0])
def test_inner_rail_keeps_its_height_in_transitions_too(winding, s):
    # also where the cant changes sign (s = 510 m); the climbing line's cosine leaves 0.0375 m * 3e-7
    station, matrix = frame(winding, s)
    lowest = station.z - 0.75 * abs(matrix[2, 1])
    assert abs(matrix[2, 1]) > 0.03
    assert lowest == pytest.approx(0.0, abs=5e-8)


def test_cant_and_widening_ramp_linearly_with_the_curvature(winding):
    # a quarter of the way into the first transition
    station = centreline(winding, 75.0)
    assert station.curvature == pytest.approx(0.25 / 300.0, abs=1e-15)
    assert -station.sin_roll * CANT_BASE == pytest.approx(0.25 * 0.15, abs=1e-15)
    assert station.widening == pytest.approx(0.25 * 0.01, abs=1e-15)
    assert station.z == pytest.approx(0.125 * 0.15, abs=1e-15)


def test_corner_is_rounded_by_the_hat_weighted_mean():
    # mean of max(x + v, 0) with weight (half - |v|) / half^2; at the corner itself half / 6
    half = 2.0
    assert rounded_ramp(0.0, half)[0] == pytest.approx(half / 6.0, rel=1e-15)
    for x in (-1.9, -0.6, 0.3, 1.7):
        mean, _ = quad(lambda v, x=x: max(x + v, 0.0) * (half - abs(v)) / half**2, -half, half, points=[-x, 0.0])
        assert rounded_ramp(x, half)[0] == pytest.approx(mean, abs=1e-12)


def test_series_of_the_cosine_of_the_incline():
    # a rounded corner of the steepest ramp: m (1 + v)^2 / 8 on -1 < v < 1 with m = 0.005; left out are the terms of
    # m^4 (1 + v)^8 / 2^15 from v^7 on, 9 m^4 / 2^15 = 1.7e-13
    slope = 0.005 / 8.0 * np.array([1.0, 2.0, 1.0])
    for d in (-1.0, -0.4, 1.0):
        exact = math.sqrt(1.0 - np.polynomial.polynomial.polyval(d, slope) ** 2)
        assert np.polynomial.polynomial.polyval(d, _cosine_series(slope)) == pytest.approx(exact, abs=2e-13)


@settings(max_examples=200, deadline=None)
@given(s=st.floats(-30.0, 1200.0), y=st.floats(-3.0, 3.0), z=st.floats(-0.5, 4.0), off=st.floats(-20.0, 20.0))
def test_arc_length_of_is_the_inverse(winding, s, y, z, off):
    station, matrix = frame(winding, s)
    point = vector(station) + matrix @ np.array([0.0, y, z])
    assert arc_length_of(winding, *point, s + off) == pytest.approx(s, abs=1e-11)


def test_arc_length_of_finds_its_own_start():
    # 270 degrees of a circle: from a far start, Newton's iteration would end in the opposite cross-section
    winding = build_track({"path": [{"transition": 50.0}, {"curve": 1400.0, "radius": 300.0}]}, "test").path
    for s in np.linspace(-50.0, 1440.0, 91):
        station, matrix = frame(winding, s)
        point = vector(station) + matrix @ np.array([0.0, 0.5, 0.46])
        assert arc_length_of(winding, *point, math.nan) == pytest.approx(s, abs=1e-11)


def test_arc_length_of_says_nan_for_the_impossible(winding):
    assert math.isnan(arc_length_of(winding, math.nan, 0.0, 0.0, 10.0))


def test_tangent_path_is_the_x_axis():
    path = tangent_path()
    station, matrix = frame(path, 17.25)
    assert vector(station).tolist() == [17.25, 0.0, 0.0]
    assert matrix.tolist() == np.eye(3).tolist()
    assert arc_length_of(path, 3.5, 0.1, 0.2, math.nan) == 3.5
    assert frame_turn(station) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("s", PLACES)
def test_rail_direction_is_the_derivative_of_the_rails_line(winding, s):
    y, z = 0.7535, 0.01

    def line(v):
        station, matrix = frame(winding, v)
        return vector(station) + matrix @ np.array([0.0, y + 0.5 * station.widening, z + 1e-4 * math.sin(v)])

    station, matrix = frame(winding, s)
    rail = y + 0.5 * station.widening, z + 1e-4 * math.sin(s)
    lateral, vertical, stretch = rail_direction(station, *rail, 0.5 * station.widening_rate, 1e-4 * math.cos(s))
    expected = matrix.T @ fourth_order(line, s, 0.01)
    assert np.array([1.0, lateral, vertical]) * stretch == pytest.approx(expected, abs=1e-10)


def test_description_gives_joints_in_order(winding):
    assert set(JOINTS) <= set(winding.starts[1:].tolist())
    assert Track().tangent and not build_track({"path": WINDING}, "test").tangent
    assert build_track({}, "test").tangent and build_track({"path": "tangent"}, "test").gauge == 1.435


CURVE = {"curve": 100.0, "radius": 300.0}
BAD_PATHS = [
    ([], "track.path", "list of segments"),
    ("curved", "track.path", "'tangent' or a list"),
    (3, "track.path", "'tangent' or a list"),
    ([[1.0]], "track.path.0", "a segment"),
    ([{}], "track.path.0", "one of tangent, transition, curve"),
    ([{"tangent": 1.0, "curve": 2.0}], "track.path.0", "one of tangent, transition, curve"),
    ([{"tangent": 10.0}, {"tangent": 0.0}], "track.path.1.tangent", "above 0"),
    ([{"tangent": -1.0}], "track.path.0.tangent", "above 0"),
    ([{"tangent": "long"}], "track.path.0.tangent", "a length in m"),
    ([{"tangent": math.nan}], "track.path.0.tangent", "finite"),
    ([{"tangent": True}], "track.path.0.tangent", "a length in m"),
    ([{"tangent": 1.0, "radius": 300.0}], "track.path.0.radius", "no such key in a tangent"),
    ([{"transition": 50.0, "cant": 0.1}, CURVE], "track.path.0.cant", "no such key in a transition"),
    ([{"bend": 1.0}], "track.path.0.bend", "unknown key"),
    ([CURVE], "track.path.0.curve", "a transition before"),
    ([{"tangent": 5.0}, CURVE], "track.path.1.curve", "a transition before"),
    ([{"transition": 50.0}, CURVE, {"tangent": 5.0}], "track.path.2.tangent", "a transition before"),
    ([{"transition": 50.0}, CURVE, {**CURVE, "cant": 0.1}], "track.path.2.curve", "a transition before"),
    ([{"transition": 50.0}, CURVE, {**CURVE, "widening": 0.01}], "track.path.2.curve", "a transition before"),
    ([{"tangent": 5.0}, {"transition": 50.0}], "track.path.1.transition", "tangent or a curve after"),
    ([{"transition": 5.0}, {"transition": 50.0}, CURVE], "track.path.0.transition", "tangent or a curve after"),
    ([{"transition": 50.0}, {"curve": 100.0}], "track.path.1.radius", "the key is missing"),
    ([{"transition": 50.0}, {"curve": 100.0, "radius": 0.3}], "track.path.1.radius", "20 m or more"),
    ([{"transition": 50.0}, {"curve": 100.0, "radius": -19.0}], "track.path.1.radius", "20 m or more"),
    ([{"transition": 50.0}, {**CURVE, "cant": 150.0}], "track.path.1.cant", "within 0.3"),
    ([{"transition": 50.0}, {**CURVE, "widening": 10}], "track.path.1.widening", "gauge widening in m"),
    ([{"transition": 3.0}, {**CURVE, "widening": 0.01}], "track.path.0.transition", "rounding length of 4 m"),
    ([{"transition": 9.0}, {**CURVE, "cant": 0.1}], "track.path.0.transition", "at most 0.01 m/m"),
]


def test_two_transitions_between_opposite_curves_meet_in_an_inflection():
    left, right = {**CURVE, "cant": 0.12}, {"curve": 50.0, "radius": -472.0, "cant": 0.12}
    path = [{"transition": 68.0}, right, {"transition": 68.0}, {"transition": 65.0}, left]
    line = [{"transition": 68.0}, right, {"transition": 68.0, "radius": -1e12}, {"transition": 65.0}, left]
    found, wanted = (build_track({"path": one}, "test").path for one in (path, line))
    for s in np.linspace(0.0, 300.0, 61):
        np.testing.assert_allclose(centreline(found, s), centreline(wanted, s), rtol=0.0, atol=1e-8)
    assert centreline(found, 186.0).curvature == pytest.approx(0.0, abs=1e-18)
    assert centreline(found, 170.0).curvature < 0.0 < centreline(found, 200.0).curvature


@pytest.mark.parametrize("between", [CURVE, {"tangent": 20.0}, {"curve": 50.0, "radius": 472.0}])
def test_two_transitions_without_an_inflection_are_refused(between):
    path = [{"transition": 68.0}, CURVE, {"transition": 68.0}, {"transition": 65.0}, between]
    with pytest.raises(InputError, match=r"track.path.2.transition: .*in an inflection"):
        build_track({"path": path}, "test")


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("about", ["lower_rail", "inner_rail", "centreline"])
def test_cant_ramp_on_straight_track_raises_the_outer_rail_of_the_curve(sign, about):
    ramp = {"transition": 30.0, "cant": 0.05}
    curve = {"curve": 100.0, "radius": 500.0 * sign, "cant": 0.15}
    back = [{"transition": 60.0, "cant": 0.04}, {"transition": 9.0}, {"tangent": 9.0}]
    path = [{"tangent": 50.0}, ramp, {"transition": 60.0}, curve, *back]
    found = build_track({"path": path, "cant_about": about}, "test").path
    high = 0.5 if about != "centreline" else 0.0
    for s, cant in ((65.0, 0.025), (110.0, 0.1), (200.0, 0.15), (270.0, 0.095), (304.5, 0.02)):
        here = centreline(found, s)
        assert here.sin_roll == pytest.approx(-sign * cant / CANT_BASE, abs=1e-12)
        assert here.z == pytest.approx(high * cant, abs=1e-9)
    assert centreline(found, 79.0).curvature == 0.0 == centreline(found, 301.0).curvature


def test_a_tangent_with_cant_is_told_how_a_ramp_is_written():
    path = [{"tangent": 50.0}, {"tangent": 30.0, "cant": 0.05}, {"transition": 60.0}, {**CURVE, "cant": 0.15}]
    with pytest.raises(InputError, match=r"track.path.1.cant: .*{transition: LENGTH, cant: CANT}"):
        build_track({"path": path}, "test")


def test_a_large_radius_without_transition_is_told_how_to_write_it():
    path = [{"tangent": 18.0}, {"curve": 10.0, "radius": 30e3}, {"tangent": 50.0}]
    with pytest.raises(InputError, match=r"track.path.1.curve: .*write {transition: 4}"):
        build_track({"path": path}, "test")
    build_track({"path": [path[0], {"transition": 4}, path[1], {"transition": 4}, path[2]]}, "test")


@pytest.mark.parametrize(("path", "field", "expected"), BAD_PATHS)
def test_bad_paths_name_segment_and_field(path, field, expected):
    with pytest.raises(InputError) as caught:
        build_track({"path": path}, "scene.yaml")
    assert (caught.value.source, caught.value.field) == ("scene.yaml", field)
    assert expected in caught.value.expected


@pytest.mark.parametrize(
    ("data", "field"),
    [({"gauge": 1435}, "track.gauge"), ({"rounding": 0.0}, "track.rounding"), ({"cant": 0.1}, "track.cant"),
     ([], "track")],
)  # fmt: skip
def test_bad_track_keys(data, field):
    with pytest.raises(InputError) as caught:
        build_track(data, "scene.yaml")
    assert caught.value.field == field
