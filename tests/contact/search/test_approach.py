"""Depth, normal and approach of overlaps, against dense sums of the gap; nothing steps where two of them merge."""

import math

import numpy as np
import pytest

from wrcore.analysis.contact.loaded import LoadedWheels, Rolling
from wrcore.contact.rigid.wheel_on_rail import WheelOnRail
from wrcore.contact.search import reduction
from wrcore.contact.search.approach import LEVEL, approach_of, pressed_together
from wrcore.contact.search.detection import axle_direction, find_patches
from wrcore.contact.search.reduction import MAX_PATCHES, MOMENT, PATCH_COLUMNS
from wrcore.contact.search.strip import gap_at, make_pose
from wrcore.geometry.profiles.standards import named_profile
from wrcore.kernels.handles import Handle
from wrcore.kernels.jit import jit
from wrcore.wheels.motion import WheelMotion
from wrcore.wheels.normal_damping import lift_of

PLACES = [(-4e-3, 0.0), (-1e-3, 4e-3), (2e-3, -3e-3), (5.3e-3, 0.0), (5.5e-3, 2e-3), (6.2e-3, 0.0), (2e-3, 0.02)]


@jit
def pressed_at(geometry, y, z, axle, rows, sums, spatial):
    """Number of overlaps, and what they have `Pressed`."""
    count = find_patches(geometry, 1.0, y, z, *axle, spatial, MOMENT, rows)
    pose = make_pose(1.0, y, z, *axle, spatial)
    return count, pressed_together(geometry, pose, spatial, LEVEL, rows, 0, count, sums)


@jit
def dense(geometry, y, z, axle, low, high, spatial):
    """M0 and, times that, place on the wheel's profile, from strips 2 um apart."""
    pose, square, moment = make_pose(1.0, y, z, *axle, spatial), 0.0, 0.0
    for k in range(int((high - low) / 2e-6)):
        u = low + 2e-6 * k
        gap = min(gap_at(geometry, pose, u)[0], 0.0)
        square, moment = square + 2e-6 * gap * gap, moment + 2e-6 * gap * gap * u
    return square, moment


def pressed(geometry, y, z, axle, spatial=True):
    """What the overlaps of a wheel have `Pressed`, and their rows."""
    rows = np.zeros((MAX_PATCHES, PATCH_COLUMNS))
    count, found = pressed_at(geometry, y, z, axle, rows, np.zeros((3, 5)), spatial)
    return found, rows[:count]


@pytest.mark.parametrize("spatial", [True, False])
@pytest.mark.parametrize(("y", "yaw"), PLACES)
def test_what_overlaps_are_pressed_by(benchmark_pair, y, yaw, spatial):
    """M0, its place and its slopes are those of a dense sum at this pose and at poses beside it."""
    axle, step = axle_direction(1e-3, yaw), 2e-7
    z = LoadedWheels(benchmark_pair, "moment").height("left", y, 6e4, 1e-3, yaw)
    found, rows = pressed(benchmark_pair, y, z, axle, spatial)
    ends = rows[0, reduction.OUTSIDE] - 1e-3, rows[-1, reduction.BEYOND] + 1e-3

    def dense_at(move):
        axis = axle + np.cross(move[2:], axle)
        return dense(benchmark_pair, y + move[0], z + move[1], tuple(axis / np.linalg.norm(axis)), *ends, spatial)

    square, moment = dense_at(np.zeros(5))
    assert found.square == pytest.approx(square, rel=5e-4)
    assert found.moment / found.square == pytest.approx(moment / square, abs=5e-6)
    moves = step * np.eye(5)[: 5 if spatial else 2]  # in planes, turns are left out
    slopes = np.array([np.subtract(dense_at(move), dense_at(-move)) / (2.0 * step) for move in moves])
    size = math.hypot(*slopes[:2, 0])
    np.testing.assert_allclose(found[2 : 2 + len(moves)], slopes[:, 0], atol=3e-3 * size)
    about = np.subtract([found.moment_across, found.moment_up], moment / square * np.array(found[2:4]))
    np.testing.assert_allclose(about, slopes[:2, 1] - moment / square * slopes[:2, 0], atol=2e-5 * size)


@pytest.mark.parametrize("first", [-3e-3, 1.3e-3])
def test_overlaps_on_a_tread_are_pressed_as_if_their_nodes_were_dense(benchmark_pair, first):
    """The place of an overlap, what M0 changes by across, up and in roll, and what the place does across and up, while
    its ends pass from node to node of the profile. Without what the sums miss at the ends they err by more."""
    wheels, axle, step, errors = LoadedWheels(benchmark_pair, "moment"), axle_direction(0.0, 0.0), 2e-7, []
    for y in first + 13e-6 * np.arange(16):
        z = wheels.height("left", y, 6e4)
        found, rows = pressed(benchmark_pair, y, z, axle)
        ends = rows[0, reduction.OUTSIDE] - 1e-3, rows[-1, reduction.BEYOND] + 1e-3
        square, moment = dense(benchmark_pair, y, z, axle, *ends, True)

        def dense_at(dy, dz, turn, y=y, z=z, ends=ends):
            axis = axle[0], axle[1] - turn * axle[2], axle[2] + turn * axle[1]
            return np.array(dense(benchmark_pair, y + dy, z + dz, axis, *ends, True))

        changes = [(dense_at(*move) - dense_at(*-move)) / (2.0 * step) for move in step * np.eye(3)]
        (across, moved_across), (up, moved_up), (rolled, _) = changes
        u, size = moment / square, math.hypot(across, up)
        own = found.across, found.up, found.about_x
        places = found.moment_across - u * found.across, found.moment_up - u * found.up
        off = np.subtract([*own, *places], [across, up, rolled, moved_across - u * across, moved_up - u * up])
        errors.append([found.moment / found.square - u, *(off / size)])
    assert np.all(abs(np.array(errors)).max(axis=0) < [8e-9, 6e-6, 1e-5, 8e-6, 1.5e-8, 1e-7])


def test_profiles_with_nodes_of_different_spacing(uic60):
    """Their overlaps are summed over the nodes of the search: no parabola stands for them."""
    found = []
    for spacing in (5e-5, 4e-5):
        geometry = WheelOnRail(named_profile("S1002", "wheel", spacing=spacing), uic60).geometry
        z = LoadedWheels(geometry, "moment").height("left", 1.3e-3, 6e4)
        own, _ = pressed(geometry, 1.3e-3, z, axle_direction(0.0, 0.0))
        place = own.moment / own.square
        found.append([own.square, place, (own.moment_up - place * own.up) / own.up])
    assert found[1][0] == pytest.approx(found[0][0], rel=1e-3)
    assert found[1][1] == pytest.approx(found[0][1], abs=5e-6)
    assert found[1][2] == pytest.approx(found[0][2], abs=2e-5) and abs(found[0][2]) > 1e-4


def test_a_parabola_is_as_deep_as_it_is():
    """A cone on a circular rail head: depth, normal, and the speed at which its deepest point comes nearer."""
    geometry = WheelOnRail(named_profile("cone:1/20", "wheel"), named_profile("circle:0.3", "rail")).geometry
    axle = axle_direction(0.0, 0.0)
    z = LoadedWheels(geometry, "moment").height("left", 0.0, 5e4)
    found, rows = pressed(geometry, 0.0, z, axle)
    (row,) = rows
    velocity = 20.0, 0.01, -0.02, 0.03, 20.0 / 0.46, 0.002
    m = WheelMotion(1.0, 0.0, z, *axle, *velocity, 0.0, 0.0, 0.3)
    depth, cosine, sine, speed = approach_of(found, m)
    assert depth == pytest.approx(row[reduction.PENETRATION], rel=4e-3)  # G from two dozen strips
    np.testing.assert_allclose([cosine, sine], row[[reduction.COSINE, reduction.SINE]], atol=2e-5)
    place = row[[reduction.X, reduction.Y, reduction.Z]] - [0.0, 0.0, z]
    drift = np.array(velocity[:3]) + np.cross(velocity[3:], place)
    assert speed == pytest.approx(drift[1] * sine - drift[2] * cosine, abs=2e-5)
    assert approach_of(found, m._replace(vz=-0.03))[3] > speed  # downwards is nearer


def merger(wheels):
    """Height of a wheel, and the place at which its tread's and its root's overlap become one there."""
    z = wheels.height("left", 5.4e-3, 5e4)
    counts = [len(pressed(wheels.geometry, y, z, axle_direction(0.0, 0.0))[1]) for y in 1e-6 * np.arange(5e3, 6e3)]
    (places,) = np.nonzero(np.diff(counts) == -1)
    return z, 1e-6 * (5e3 + places[-1] + 0.5)


@pytest.mark.parametrize("merging", [True, False])
def test_damping_does_not_step_where_overlaps_change(benchmark_pair, merging):
    """ln D of a lifted wheel over steps of 1 um, at heights and speeds at which its tread's and its root's overlap
    become one, and where one has got so wide that its strips might be looked up otherwise."""
    wheels, axle, counts = LoadedWheels(benchmark_pair, "exact"), axle_direction(0.0, 0.0), set()
    contact = wheels._still._replace(damping=0.8, damping_speed=0.05)
    z, middle = merger(wheels) if merging else (wheels.height("left", 6e-3, 5e4), 6.03e-3)
    for vy in (0.0, 0.02, -0.03):
        logs = []
        for y in middle + 1e-6 * np.arange(-6.0, 7.0):
            found, rows = pressed(benchmark_pair, y, z, axle)
            counts.add(len(rows))
            m = WheelMotion(1.0, y, z, *axle, 20.0, vy, 0.0, 0.0, 20.0 / 0.46, 0.0, 0.0, 0.0, 0.3)
            logs.append(0.4 * math.log(found.square) + math.log(1.0 - lift_of(contact, m, found).share))
        steps = np.diff(logs)
        assert abs(np.diff(steps)).max() < 0.02 * abs(steps).mean()
    assert counts == ({1, 2} if merging else {1})


@pytest.mark.parametrize("vy", [0.0, -0.03])
@pytest.mark.parametrize(("model", "friction"), [("exact", 0.0), ("tabulated", 0.3)])
def test_damped_force_does_not_step_where_overlaps_merge(benchmark_pair, vy, model, friction):
    """The normal force, solved and looked up, over steps of 1 um."""
    wheels = LoadedWheels(benchmark_pair, model)
    wheels._rolling[friction] = Handle(wheels._at_work(friction).value._replace(damping=0.8, damping_speed=0.05))
    (z, middle), forces = merger(wheels), []
    for y in middle + 1e-6 * np.arange(-2.5, 3.0):
        found = wheels.at_height("left", y, z, rolling=Rolling(20.0, 20.0 / 0.46, vy), friction=0.3)
        forces.append(sum(one.row[reduction.NORMAL] for one in found))
    steps = np.diff(forces)
    assert abs(np.diff(steps)).max() < 0.02 * abs(steps).mean()
