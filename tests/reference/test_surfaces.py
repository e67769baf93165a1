"""Rail surfaces, Eqs. (1)-(3): unchanged on a tangent track, swept along the path elsewhere."""

import numpy as np
import pytest

from wrcore.geometry.irregularity import irregularity_at
from wrcore.geometry.path import centreline, rail_direction, track_frame
from wrcore.geometry.profiles.profile import GAUGE_DEPTH
from wrcore.geometry.profiles.standards import named_profile
from wrcore.geometry.track import SIDES, Track, build_track
from wrcore.reference.surfaces import rail_surface

CURVE = [
    {"tangent": 50.0},
    {"transition": 80.0},
    {"curve": 100.0, "radius": 300.0, "cant": 0.15, "widening": 0.012},
    {"transition": 80.0},
    {"tangent": 50.0},
]
ROUGH = {"spectrum": {"level": "high", "seed": 2, "length": 350.0}}


@pytest.fixture(scope="module")
def uic60():
    return named_profile("UIC60-MBench", "rail", 1 / 40)


@pytest.fixture(scope="module")
def round_head():
    """A rail head of radius 20 mm: 14 mm below its top it is 19 mm wide to each side, slope 3."""
    return named_profile("circle:0.02", "rail")


@pytest.mark.parametrize("side", ["left", "right"])
def test_tangent_track_gives_the_extruded_profile_bit_by_bit(uic60, side, monkeypatch):
    def forbidden(*arguments):
        raise AssertionError("code of curved tracks ran on a tangent track")

    monkeypatch.setattr("wrcore.reference.surfaces.track_frame", forbidden)
    monkeypatch.setattr("wrcore.reference.surfaces.irregularity_at", forbidden)
    u, x = np.linspace(-0.03, 0.025, 7), np.linspace(-2.0, 5.0, 4)[:, None]
    points = rail_surface(uic60, Track(1.435), side, u, x)
    assert points.shape == (4, 7, 3)
    assert (points[..., 0] == x).all()
    assert (points[..., 1] == SIDES[side] * (0.5 * 1.435 + uic60.gauge_offset(GAUGE_DEPTH) + u)).all()
    assert (points[..., 2] == uic60(u)).all()


def test_straight_path_written_as_segments_agrees_with_the_tangent(uic60):
    u, s = np.linspace(-0.03, 0.025, 7), np.linspace(-20.0, 150.0, 9)[:, None]
    straight = build_track({"path": [{"tangent": 100.0}]}, "test")
    for side in SIDES:
        expected = rail_surface(uic60, Track(1.435), side, u, s)
        assert rail_surface(uic60, straight, side, u, s) == pytest.approx(expected, abs=1e-13)


@pytest.mark.parametrize("s", [-10.0, 90.0, 180.0, 250.0])
def test_gauge_measured_on_the_surfaces_is_gauge_plus_widening(round_head, s):
    # the innermost points within 14 mm of the tops, in the canted cross-section
    track = build_track({"path": CURVE}, "test")
    u = np.linspace(-0.0195, 0.0195, 40001)
    matrix = np.empty((3, 3))
    station = track_frame(track.path, s, matrix)
    inner = []
    for side, sign in SIDES.items():
        local = (rail_surface(round_head, track, side, u, s) - [station.x, station.y, station.z]) @ matrix
        near = local[:, 2] >= local[:, 2].max() - GAUGE_DEPTH
        inner.append((sign * local[near, 1]).min())
    ramp = np.interp(s, [50.0, 130.0, 230.0, 310.0], [0.0, 0.012, 0.012, 0.0])
    assert sum(inner) == pytest.approx(1.435 + ramp, abs=2e-6)  # two steps of u


def test_rails_in_a_curve_lie_on_circles_and_the_outer_one_is_higher(uic60):
    track = build_track({"path": CURVE}, "test")
    s = np.linspace(140.0, 220.0, 9)
    station = centreline(track.path, 180.0)
    centre = np.array([station.x, station.y]) + 300.0 * np.array([-station.ty, station.tx])
    left, right = (rail_surface(uic60, track, side, 0.0, s) for side in ("left", "right"))
    reach = (track.rail_distance(uic60) + 0.006) * np.sqrt(1.0 - 0.1**2)
    assert np.hypot(*(left[:, :2] - centre).T) == pytest.approx(300.0 - reach, abs=1e-10)
    assert np.hypot(*(right[:, :2] - centre).T) == pytest.approx(300.0 + reach, abs=1e-10)
    # 0.15 m over 1.5 m: the tops lie 2 (d + w/2) apart
    assert right[:, 2] - left[:, 2] == pytest.approx(0.1 * 2.0 * (track.rail_distance(uic60) + 0.006), abs=1e-12)


@pytest.mark.parametrize("path", ["tangent", CURVE])
def test_irregularity_moves_each_rail_in_the_cross_section(uic60, path):
    plain, rough = (build_track({"path": path, **extra}, "test") for extra in ({}, {"irregularity": ROUGH}))
    matrix, values = np.empty((3, 3)), np.zeros((3, 4))
    for s in (60.0, 177.7):
        track_frame(plain.path, s, matrix)
        irregularity_at(rough.irregularity, s, values)
        assert np.abs(values[0]).min() > 1e-5
        for side, first in (("left", 0), ("right", 2)):
            moved = rail_surface(uic60, rough, side, 0.01, s) - rail_surface(uic60, plain, side, 0.01, s)
            assert moved @ matrix == pytest.approx([0.0, *values[0, first : first + 2]], abs=1e-12)


@pytest.mark.parametrize("side", ["left", "right"])
def test_rail_top_runs_in_the_rails_direction(uic60, side):
    track = build_track({"path": CURVE, "irregularity": ROUGH}, "test")
    matrix, values = np.empty((3, 3)), np.zeros((3, 4))
    first = 0 if side == "left" else 2
    for s in (70.3, 131.1, 200.2):
        station = track_frame(track.path, s, matrix)
        irregularity_at(track.irregularity, s, values)
        y = SIDES[side] * (track.rail_distance(uic60) + 0.5 * station.widening) + values[0, first]
        dy = SIDES[side] * 0.5 * station.widening_rate + values[1, first]
        lateral, vertical, stretch = rail_direction(station, y, values[0, first + 1], dy, values[1, first + 1])
        h = 1e-3
        before, after = rail_surface(uic60, track, side, 0.0, np.array([s - h, s + h]))
        # truncation h^2 / 6 of the irregularity's third derivative (3e-3 1/m^2): 5e-10
        expected = np.array([1.0, lateral, vertical]) * stretch
        assert (after - before) / (2 * h) @ matrix == pytest.approx(expected, abs=2e-9)
