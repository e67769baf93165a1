"""The scan against strip by strip, and the bounds by which it leaves blocks out."""

import numpy as np
import pytest

from wrcore.contact.rigid.wheel_on_rail import WheelOnRail
from wrcore.contact.search.geometry import LANES, LARGEST_OFFSET, RAIL_COSINE, RAIL_RESERVE, SMALL_SHARE, WHEEL_RESERVE
from wrcore.contact.search.reduction import _arc_sine, _arc_tangent
from wrcore.contact.search.scan import (
    blocks_with_planar_errors,
    cell_offset,
    deepest_strip,
    first_zone,
    leaves_cells,
    make_window,
    near_blocks,
    scan,
    strip_gap,
)
from wrcore.contact.search.strip import make_pose
from wrcore.geometry.profiles.standards import named_profile
from wrcore.kernels.jit import jit


@jit
def look(geometry, side, y, z, axle, spatial, gaps):
    """Gaps of all strips; the window, bits of near blocks, and how far the pose may stray."""
    pose = make_pose(side, y, z, axle[0], axle[1], axle[2], spatial)
    window = make_window(geometry, pose)
    for k in range(len(gaps)):
        gaps[k] = strip_gap(window.grid, geometry.scan_wheel, geometry.scan_rail, k)
    near, misses = near_blocks(geometry, window), blocks_with_planar_errors(geometry, window, axle[0] ** 2)
    return window.grid.node, window.reserves, near, misses, cell_offset(pose) if not leaves_cells(pose) else np.inf


@jit
def scanned(geometry, side, y, z, axle, begin, end):
    """Sums of the scan over some strips, and the deepest one between the ends of the overlap."""
    window = make_window(geometry, make_pose(side, y, z, axle[0], axle[1], axle[2], True))
    wheel, rail = geometry.scan_wheel, geometry.scan_rail
    m0, m1, m2, overlap, close = scan(window, wheel, rail, begin, end)
    deepest = -1
    if overlap.count > 0:
        deepest = deepest_strip(window.grid, wheel, rail, begin + overlap.first, begin + overlap.last)
    return (m0, m1, m2), overlap, close, deepest


@jit
def zones(bits):
    """First two runs of bits and what is left."""
    first, end, rest = first_zone(bits, 8)
    return first, end, first_zone(rest, 16)


def random_poses(count, seed, roll=0.012, yaw=0.015):
    """Side, y, z and axle of wheels around contact, from tiny to large angles."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        size = rng.choice([0.05, 0.3, 1.0])
        r, p = size * rng.uniform(-roll, roll), size * rng.uniform(-yaw, yaw)
        side, y = rng.choice([-1.0, 1.0]), rng.uniform(-0.012, 0.012)
        z = 0.46 + side * 0.75 * -r + rng.uniform(-1e-3, 3e-3)
        yield side, y, z, side * np.array([-np.sin(p) * np.cos(r), np.cos(p) * np.cos(r), np.sin(r)])


@pytest.fixture(scope="module")
def wide_pair():
    """A cone on a circle of 0.3 m radius: a rail so wide that its blocks must be larger to be bits of one word."""
    return WheelOnRail(named_profile("cone:1/20", "wheel"), named_profile("circle:0.3", "rail")).geometry


@pytest.mark.parametrize("pair", ["benchmark_pair", "wide_pair"])
@pytest.mark.parametrize("spatial", [False, True])
def test_no_strip_of_a_far_block_is_close(request, pair, spatial):
    """The bounds leave nothing out that the scan would call close, and most of what it would not."""
    geometry = request.getfixturevalue(pair)
    assert (geometry.block == LANES) == (pair == "benchmark_pair") and geometry.zone_gaps.shape[1] < 64
    gaps = np.empty(geometry.scan_rail.shape[1])
    seen, near_count, needed_count = [0, 0], 0, 0
    lower = 0.0 if pair == "benchmark_pair" else 3.5e-3  # the cone touches its rail that much deeper
    for side, y, z, axle in random_poses(3000, 0):
        node, reserves, near, misses, strayed = look(geometry, side, y, z - lower, axle, spatial, gaps)
        if strayed > LARGEST_OFFSET:
            continue
        reserve = geometry.scan_wheel[WHEEL_RESERVE, node : node + len(gaps)] + geometry.scan_rail[RAIL_RESERVE]
        is_near = np.array([bool(near >> b & 1) for b in range(len(gaps) // geometry.block)])
        needed = (gaps < reserves * reserve).reshape(-1, geometry.block).any(axis=1)
        assert not np.any(needed & ~is_near)
        assert near & ~misses == 0
        calm = strayed < SMALL_SHARE * LARGEST_OFFSET
        seen[calm] += 1
        near_count += calm * is_near.sum()
        needed_count += calm * needed.sum()
    assert min(seen) > 400
    assert needed_count > 100 and near_count < 2 * needed_count


def test_bounds_hold_at_the_limits_of_roll_and_yaw(benchmark_pair):
    """Poses that stray as far as is allowed, by roll alone and by yaw alone, with a wheel close to its rail."""
    gaps = np.empty(benchmark_pair.scan_rail.shape[1])
    for limit in (0.999 * SMALL_SHARE * LARGEST_OFFSET, 0.999 * LARGEST_OFFSET):
        for roll, yaw in ((limit / 0.03, 0.0), (-limit / 0.03, 0.0), (0.0, np.sqrt(limit / 1.5))):
            for y in np.linspace(-0.012, 0.012, 97):
                z = 0.4605 - 0.75 * roll
                axle = np.array([-np.sin(yaw) * np.cos(roll), np.cos(yaw) * np.cos(roll), np.sin(roll)])
                node, reserves, near, _, strayed = look(benchmark_pair, 1.0, y, z, axle, True, gaps)
                assert strayed == pytest.approx(limit, rel=1e-3)
                reserve = benchmark_pair.scan_wheel[WHEEL_RESERVE, node : node + len(gaps)]
                close = gaps < reserves * (reserve + benchmark_pair.scan_rail[RAIL_RESERVE])
                assert all(near >> (k // LANES) & 1 for k in np.flatnonzero(close))


def test_sums_are_those_of_the_strips(benchmark_pair):
    """One zone over all of the rail: more strips than a word has bits."""
    geometry = benchmark_pair
    gaps = np.empty(geometry.scan_rail.shape[1])
    several = 0
    for side, y, z, axle in random_poses(300, 1):
        z -= 1e-3
        node, reserves, _, _, strayed = look(geometry, side, y, z, axle, True, gaps)
        if strayed > LARGEST_OFFSET:
            continue
        begin, end = (0, len(gaps)) if several % 2 else (LANES, len(gaps) - LANES)
        sums, overlap, close, deepest = scanned(geometry, side, y, z, axle, begin, end)
        part = slice(begin, end)
        negative, index = np.minimum(gaps[part], 0.0), np.arange(end - begin)
        assert sums == pytest.approx([(negative**2 * index**p).sum() for p in range(3)], rel=1e-9)
        reserve = geometry.scan_wheel[WHEEL_RESERVE, node : node + len(gaps)] + geometry.scan_rail[RAIL_RESERVE]
        for strips, member in ((overlap, negative < 0), (close, gaps[part] < reserves * reserve[part])):
            places = np.flatnonzero(member)
            assert strips.count == len(places)
            if len(places):
                assert (strips.first, strips.last) == (places[0], places[-1])
        if overlap.count > 0 and overlap.count == overlap.last - overlap.first + 1:
            assert deepest == begin + np.argmax(-gaps[part] * geometry.scan_rail[RAIL_COSINE, part])
            several += 1
    assert several > 100


def test_zones_are_runs_of_bits():
    assert zones(np.uint64(0b1110011000)) == (24, 40, (112, 160, 0))
    assert zones(np.uint64(0b11))[:2] == (0, 16)


@pytest.mark.parametrize("x", [0.0, 1e-9, -0.003, 0.05, -0.0999, 0.1001, 0.4, -0.9])
def test_series_of_small_angles(x):
    assert _arc_sine(x) == pytest.approx(np.arcsin(x), rel=3e-16, abs=0)
    assert _arc_tangent(x) == pytest.approx(np.arctan(x), rel=3e-16, abs=0)
    assert _arc_tangent(5 * x) == pytest.approx(np.arctan(5 * x), rel=3e-16, abs=0)
