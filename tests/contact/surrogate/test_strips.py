"""Strips of a patch: those of wide overlaps, of which some nodes are left out, beside all of them one by one."""

import math

import numpy as np
import pytest

from tests.conftest import SCENES
from wrcore.bodies.vector import copy_into
from wrcore.contact.search.approach import LEVEL, Pressed, pressed_together
from wrcore.contact.search.detection import find_patches
from wrcore.contact.search.moved import smooth_nodes
from wrcore.contact.search.reduction import BEYOND, MAX_PATCHES, MOMENT, OUTSIDE, PATCH_COLUMNS, PENETRATION
from wrcore.contact.search.strip import make_pose
from wrcore.contact.surrogate.descriptors import N_DESCRIPTORS, describe
from wrcore.contact.surrogate.strips import (
    ENOUGH,
    _add_end,
    _Depths,
    _fill_one_by_one,
    _with_end,
    close_strips,
    fill_strips,
    lift_strips,
    new_strips,
    press_strips,
)
from wrcore.kernels.handles import Handle
from wrcore.kernels.jit import jit
from wrcore.scene.description import load_scene

YAW = 2e-3


@jit(allocates=False)
def both(geometry, y, z, rows, row, strips, every, out):
    """Fill descriptors of the first overlap with the strips that are taken, and with those at all of its nodes; returns
    the numbers of nodes."""
    along = math.sqrt(1.0 - YAW * YAW)
    pose = make_pose(1.0, y, z, -YAW, along, 0.0, True)
    if find_patches(geometry, 1.0, y, z, -YAW, along, 0.0, True, MOMENT, rows) != 1:
        return 0, 0
    copy_into(row, rows[0])
    n, _ = fill_strips(geometry, pose, row, rows[0, OUTSIDE], rows[0, BEYOND], strips)
    count = close_strips(strips, n)
    describe(strips, count, n, geometry.rolling_radius, 0.0, 0.3, out[0])
    nodes, _, _ = smooth_nodes(geometry, pose, row)
    total = _fill_one_by_one(geometry, nodes, 0, 1, pose, (-1.0, 1.0), every)
    every.arc[0] = 0.0
    for k in range(1, total):
        width = every.lateral[k] - every.lateral[k - 1]
        every.arc[k] = every.arc[k - 1] + 0.5 * width * (1.0 / every.cosine[k] + 1.0 / every.cosine[k - 1])
    for k in range(1, total - 1):
        depth = min(every.gap[k], 0.0) * every.cosine[k]
        every.weight[k] = depth * depth * 0.5 * (every.lateral[k + 1] - every.lateral[k - 1]) / every.cosine[k]
    every.weight[0] = every.weight[total - 1] = 0.0
    count = total
    for k in range(total - 1):
        if (every.gap[k] < 0.0) != (every.gap[k + 1] < 0.0):
            _add_end(every, k, count)
            count += 1
    describe(every, count, total, geometry.rolling_radius, 0.0, 0.3, out[1])
    return n, total


@pytest.mark.parametrize("y", [-4e-3, -2e-3, 0.0, 1.5e-3])
def test_strips_of_a_wide_overlap_give_the_descriptors_of_all_its_nodes(y):
    geometry = load_scene(SCENES / "suspended_wheelset.yaml").alike.geometry
    handle = Handle(geometry)
    rows, out = np.zeros((MAX_PATCHES, PATCH_COLUMNS)), np.zeros((2, N_DESCRIPTORS))
    row, strips, every, n, total, z = np.zeros(PATCH_COLUMNS), new_strips(), new_strips(), 0, 0, 0.47
    while not rows[0, PENETRATION] > 6e-5 and z > 0.4:
        z -= 1e-5
        n, total = both(handle, y, z, rows, row, strips, every, out)
    assert 0 < n <= total
    if total > ENOUGH:
        assert n <= ENOUGH + 1
    np.testing.assert_allclose(out[0], out[1], rtol=3e-4, atol=3e-4)


def parabola_with_end_of_rail(beyond):
    """Strips over a parabolic overlap of 4 mm; the rail's profile ends ``beyond`` nodes after the first one outside."""
    n, step, strips = 24, 2e-4, new_strips()
    place = step * (np.arange(n) - 11.3)
    strips.gap[:n], strips.lateral[:n], strips.arc[:n] = 15.0 * (place**2 - 2e-3**2), place, place
    strips.cosine[:n] = 1.0
    outside = np.flatnonzero(strips.gap[:n] < 0.0)[-1] + 1
    strips.gap[outside + beyond : n] = 1.0
    return strips, n, step, outside


def test_end_of_the_rail_beside_an_overlap_adds_nothing():
    strips, n, step, outside = parabola_with_end_of_rail(0)
    nothing = _Depths(*[0.0] * len(_Depths._fields))
    assert _with_end(strips, n, outside - 1, step, nothing) == nothing
    count = close_strips(strips, n)
    assert count == n + 2 and strips.weight[n] != 0.0 and strips.weight[n + 1] == 0.0


def test_rise_at_the_end_of_an_overlap_does_not_see_the_end_of_the_rail_behind():
    nothing = _Depths(*[0.0] * len(_Depths._fields))
    (near, n, step, outside), (far, *_) = parabola_with_end_of_rail(1), parabola_with_end_of_rail(9)
    expected = _with_end(far, n, outside - 1, step, nothing)
    assert expected.depth != 0.0
    assert _with_end(near, n, outside - 1, step, nothing).depth == pytest.approx(expected.depth, rel=0.1)


AT = {"tread": -2e-3, "crown": 0.0, "root": 5.6e-3, "flange": 7.2e-3}
"""Lateral displacements of a left wheel, m."""
LIFT = 1.5e-6, 4e-6
"""Distance across the track and up by which strips are moved, m."""


@jit(allocates=False)
def fill_at(geometry, y, z, rows, row, strips):
    """Fill strips of the first overlap, if there is only one; returns their number, spacing, and the pose."""
    along = math.sqrt(1.0 - YAW * YAW)
    pose = make_pose(1.0, y, z, -YAW, along, 0.0, True)
    if find_patches(geometry, 1.0, y, z, -YAW, along, 0.0, True, MOMENT, rows) != 1:
        return 0, 0.0, pose
    copy_into(row, rows[0])
    n, step = fill_strips(geometry, pose, row, rows[0, OUTSIDE], rows[0, BEYOND], strips)
    return n, step, pose


@jit(allocates=False)
def press_both(geometry, y, z, rows, row, strips, sums, out):
    """Fill ``out`` with what the strips have pressed, and with the same by the sums of the search."""
    n, step, pose = fill_at(geometry, y, z, rows, row, strips)
    if n > 0:
        one = press_strips(geometry, pose, LEVEL, strips, n, step)
        other = pressed_together(geometry, pose, True, LEVEL, rows, 0, 1, sums)
        for k in range(len(one)):
            out[0, k], out[1, k] = one[k], other[k]
    return n


@jit(allocates=False)
def move_both(geometry, y, z, dy, dz, rows, row, strips, moved):
    """Fill strips that are moved, and those of the moved wheel; returns their numbers."""
    n, _, _ = fill_at(geometry, y, z, rows, row, strips)
    if n == 0:
        return 0, 0
    lift_strips(strips, n, dy, dz)
    copy_into(row, rows[0])
    pose = make_pose(1.0, y + dy, z + dz, -YAW, math.sqrt(1.0 - YAW * YAW), 0.0, True)
    return n, fill_strips(geometry, pose, row, rows[0, OUTSIDE], rows[0, BEYOND], moved)[0]


def lowered(fill):
    """Height of the wheelset's centre at which the first overlap is 60 um deep, by a function of the height."""
    z = 0.47
    while z > 0.4 and not (fill(z) and fill.rows[0, PENETRATION] > 6e-5):
        z -= 1e-5
    return z


class Filled:
    """Strips of a left wheel of the example wheelset at a lateral displacement."""

    def __init__(self, y):
        self.handle, self.y = Handle(load_scene(SCENES / "suspended_wheelset.yaml").alike.geometry), y
        self.rows, self.row = np.zeros((MAX_PATCHES, PATCH_COLUMNS)), np.zeros(PATCH_COLUMNS)
        self.strips, self.moved, self.sums = new_strips(), new_strips(), np.zeros((3, 5))

    def __call__(self, z):
        return fill_at(self.handle, self.y, z, self.rows, self.row, self.strips)[0]


@pytest.mark.parametrize("place", AT)
def test_strips_press_as_the_search_does(place):
    filled, out = Filled(AT[place]), np.zeros((2, len(Pressed._fields)))
    z = lowered(filled)
    assert press_both(filled.handle, filled.y, z, filled.rows, filled.row, filled.strips, filled.sums, out) > 0
    found, expected = (Pressed(*row) for row in out)
    size = math.hypot(expected.across, expected.up)
    assert found.square == pytest.approx(expected.square, rel=3e-4)
    assert (found.across, found.up) == pytest.approx((expected.across, expected.up), abs=1e-3 * size)
    turned = found.about_x, found.about_y, found.about_z
    expected = expected.about_x, expected.about_y, expected.about_z
    assert turned == pytest.approx(expected, abs=1e-3 * max(abs(one) for one in expected))
    assert abs(expected[1]) > 1e-3 * size * 0.75 * YAW


@pytest.mark.parametrize("place", AT)
def test_moved_strips_are_those_of_the_moved_wheel(place):
    filled = Filled(AT[place])
    z = lowered(filled)
    numbers = move_both(filled.handle, filled.y, z, *LIFT, filled.rows, filled.row, filled.strips, filled.moved)
    assert numbers[0] == numbers[1] > 0
    n = numbers[0]
    inside = filled.moved.gap[:n] < 0.0
    for name, within in (("gap", 1e-9), ("lateral", 1e-9), ("height", 1e-9), ("angle", 1e-5)):
        one, other = getattr(filled.strips, name)[:n], getattr(filled.moved, name)[:n]
        np.testing.assert_allclose(one[inside], other[inside], rtol=0.0, atol=within, err_msg=name)
