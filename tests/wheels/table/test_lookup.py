"""Exact contact, looked up: against the exact solver, its symmetries, and the same bits however full the table is."""

import math
import signal
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from types import SimpleNamespace

import numpy as np
import pytest

import wrcore as wr
from wrcore.analysis.contact.loaded import LoadedWheels, Rolling
from wrcore.contact.creepage import creepages
from wrcore.contact.patch.model import ELLIPSES, KERNEL, LOBE_COLUMNS, LOBES, MODES, NODES, NUMBERS
from wrcore.contact.rigid.wheel_on_rail import WheelOnRail
from wrcore.contact.search import reduction
from wrcore.contact.search.detection import find_patches
from wrcore.contact.search.reduction import MAX_PATCHES, PATCH_COLUMNS
from wrcore.creep.laws import LAWS, creep_forces
from wrcore.equations.equations_of_motion import Equations
from wrcore.geometry.profiles.profile import ProfileCurve
from wrcore.geometry.profiles.standards import named_profile
from wrcore.integrate.integrator import integrate
from wrcore.run.checks.validity import LOOK_UP_ERRORS, look_up_errors
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene
from wrcore.wheels import kernels as patch_kernels
from wrcore.wheels import modes
from wrcore.wheels.motion import WheelMotion
from wrcore.wheels.table import cells as pair_cells
from wrcore.wheels.table import coupled_lobes
from wrcore.wheels.table import lookup as pair_table
from wrcore.wheels.table import node as pair_node
from wrcore.wheels.table import store as pair_store
from wrcore.wheels.table.cells import YAW, YAWS, Place
from wrcore.wheels.table.creep_modes import creep_modes
from wrcore.wheels.table.lookup import look_up
from wrcore.wheels.table_force import tabulated_wrench

METRES = pair_table.PLACE_X, pair_table.PLACE_Y, pair_table.PLACE_Z

SPEED, Z = 20.0, 0.45973
"""Rolling speed, m/s, and height of the wheelset, m."""


@pytest.fixture
def own_cache(tmp_path, monkeypatch):
    """Tables in a folder of their own, none in memory, and none of the package."""
    monkeypatch.setattr(pair_store, "table_folder", lambda: tmp_path)
    monkeypatch.setattr(pair_store, "_PAIRS", {})
    monkeypatch.setattr(pair_store.Pair, "_take_shipped", lambda _: None)
    return tmp_path


def known_numbers(i, j, k, turn=3):
    """Two numbers of a node: one with all powers that a cell gives exactly, one with what yaw adds."""
    x, y, z, w = i - 300, j - 200, k - 9, turn - 3
    return x * x - 3.0 * y * y + 0.5 * z * z + x * y * z + 2.0 * y, x + 4.0 * w * y + 2.0 * w * w * z


def pair_of_known_numbers(lost=()):
    """A `Pair` as far as its cells go; the ``lost`` have no solution."""

    def numbers(nodes):
        rows = np.zeros((len(nodes), NUMBERS), np.float32)
        for row, (_, _, turn, *corner) in zip(rows, nodes, strict=True):
            row[:2] = (math.nan,) * 2 if (turn, *corner) in lost else known_numbers(*corner, turn)
        return rows

    return SimpleNamespace(_numbers=numbers)


@pytest.mark.parametrize("first", [(300, 200, 9), (301, 199, 10)])
def test_what_a_cell_gives_exactly(first):
    """Squares along each axis, what is linear in all, and what depends on yaw as a parabola; also from odd corners."""
    key, pair, numbers = pair_cells.key_of(1, 71, 1, *first), pair_of_known_numbers(), np.empty(NUMBERS)
    assert pair_cells.corner_of(key) == (1, 71, 1, *first)
    rows = pair_store.Pair._rows_of(pair, key)
    assert pair_store.Pair._add_yaw(pair, key, rows)
    part = np.array([0.3, 0.6, 0.9])
    weights = np.empty(NODES)
    pair_table.weigh(Place(1, *part, *0.5 * (part + np.array(first) % 2), 0.4, 1.0, 1.0, 1.0), weights)
    look_up(rows, weights, numbers)
    x, y, z = part + first - (300, 200, 9)
    expected = known_numbers(300 + x, 200 + y, 9 + z)[0], x + 4.0 * 0.4 * y + 2.0 * 0.4**2 * z
    np.testing.assert_allclose(numbers[:2], expected, rtol=1e-6)


def test_modes_leave_the_slopes_at_rest():
    """Near no creepage the remainder is the one stored there, to second order."""
    numbers = np.zeros(NUMBERS)
    numbers[pair_table.LINEAR] = 1.0
    numbers[pair_table.FORCE : pair_table.FORCE + 3] = 0.1, 0.2, 0.3
    numbers[pair_table.MODE :][:MODES] = 1.0
    near, far = (pair_table.remainder(creep_modes(0.3).values, numbers, x, 0.0) for x in (1e-4, 0.5))
    np.testing.assert_allclose(near, [0.1, 0.2, 0.3], atol=1e-5)
    assert max(map(abs, np.subtract(far, near))) > 1e-3


@pytest.mark.parametrize(("angle", "linear", "again"), [(0.05, 1.0, 0.03), (0.3, 0.5, 0.7), (1.1, 0.0, 0.03)])
def test_what_modes_leave_is_what_kernels_lack(angle, linear, again):
    """A node's remainder less what is looked up of it, at the creepages where it was solved. What modes
    hold is told, but for little; between both families, which tell the whole each, less well."""
    modes, numbers = creep_modes(0.3), np.zeros(NUMBERS)
    numbers[[pair_table.ANGLE, pair_table.LINEAR]] = angle, linear
    numbers[pair_table.FORCE : pair_table.FORCE + 3] = 0.01, -0.02, 0.005
    given = np.random.default_rng(3).normal(0.0, 0.02, (len(modes.points), 3))
    numbers[pair_table.MODE :], left = modes.fit(numbers, given)
    told = np.array([pair_table.remainder(modes.values, numbers, *point) for point in modes.points])
    lacks = np.hypot(*(given - told)[:, :2].T).max()
    assert left == pytest.approx(lacks, rel=1e-3) and left > 1e-3
    coefficients = np.random.default_rng(1).normal(0.0, 1.0, 2 * MODES)
    numbers[pair_table.MODE :] = coefficients * np.tile(0.2 / np.arange(1.0, MODES + 1.0), 2)
    held = np.array([pair_table.remainder(modes.values, numbers, *point) for point in modes.points])
    assert modes.fit(numbers, held)[1] < again * np.hypot(*held[:, :2].T).max()


def test_each_family_of_modes_has_its_contact_angles():
    """Of little spin up to 0.2 rad, of much from 0.4 rad on, half of both in between, on either side."""
    little, much = np.zeros(NUMBERS), np.zeros(NUMBERS)
    little[pair_table.MODE :][:MODES], much[pair_table.MODE :][MODES : 2 * MODES] = 0.1, 0.1
    table = creep_modes(0.3).values

    def at(numbers, angle):
        numbers[pair_table.ANGLE] = angle
        return np.array(pair_table.remainder(table, numbers, 0.7, -0.4))

    for numbers, whole, none in ((little, 0.1, 0.5), (much, 0.5, 0.1)):
        assert abs(at(numbers, whole)).max() > 1e-3
        np.testing.assert_allclose(at(numbers, 0.3), 0.5 * at(numbers, whole), rtol=1e-6)
        np.testing.assert_array_equal(at(numbers, -whole), at(numbers, whole))
        np.testing.assert_array_equal(at(numbers, none), 0.0)


def test_a_remainder_has_no_poles():
    """Between nodes the number that tells how exact slopes are falls below 0."""
    numbers = np.zeros(NUMBERS)
    numbers[pair_table.FORCE : pair_table.FORCE + 3] = 0.1, 0.2, 0.3
    numbers[pair_table.MODE :][:MODES] = 0.1

    def largest(linear):
        numbers[pair_table.LINEAR] = linear
        places = np.geomspace(1e-3, 1.0, 3000)
        return max(max(map(abs, pair_table.remainder(creep_modes(0.3).values, numbers, x, 0.0))) for x in places)

    assert largest(-0.04) == pytest.approx(largest(0.0), rel=1e-12)


@pytest.mark.parametrize("remainder", [(3.0, -4.0), (0.0, 0.2)])
def test_no_more_force_than_friction_bears(benchmark_pair, remainder):
    """In the direction that it has: 3 to -4 where the remainder is far too large beside a creepage of nothing."""
    contact, numbers = LoadedWheels(benchmark_pair, "tabulated")._at_work(0.3).value, np.zeros(NUMBERS)
    numbers[[pair_table.LOG_A, pair_table.LOG_B]] = np.log([6e-3, 4e-3])
    numbers[[pair_table.SLOPE_XI, pair_table.SLOPE_ETA, pair_table.LINEAR]] = 1.0
    numbers[pair_table.FORCE : pair_table.FORCE + 2] = remainder
    table = creep_modes(0.3).values
    force = pair_table.tabulated_force(contact, table, numbers, pair_table.Slip(*np.zeros(8)), 15e3, 0.0)[:2]
    size = math.hypot(*remainder)
    assert force == pytest.approx(15e3 * np.array(remainder) / max(size, 1.0), rel=1e-6, abs=1e-3)


def test_both_parts_of_a_lobe_roll_as_contacts_of_their_own(benchmark_pair):
    """Each with the creepages of a rigid wheel at its own place, in its own plane, on its own ellipse."""
    model = LoadedWheels(benchmark_pair, "tabulated")._at_work(0.3).value
    normal, place, angle, load = 6e4, np.array([1e-3, 0.72, -0.46]), 0.2, 0.4
    apart, turned, sizes = np.array([1e-3, -8e-3, -1.5e-3]), 0.15, ((5e-3, 1.5e-3), (6e-3, 4e-3))
    velocity, turning = np.array([20.02, -0.015, 0.003]), np.array([0.4, -43.2, 0.1])
    turning[1] = (velocity[0] - turning[2] * place[1]) / -place[2]
    whole, forces, moments = np.log([6e-3, 7e-3]), np.zeros(3), np.zeros(3)
    rest = load / (1.0 - load)
    for share, at, plane, (a, b) in zip(
        (load, 1.0 - load),
        (place + apart, place - rest * apart),
        (angle + turned, angle - rest * turned),
        sizes,
        strict=True,
    ):
        cosine, sine, c, limit = math.cos(plane), math.sin(plane), math.sqrt(a * b), 0.3 * share * normal
        xi, eta, phi, _ = creepages(*velocity, *turning, *at, cosine, sine, 20.0)
        scaled = model.shear_modulus * a * b / limit * np.array([[xi, eta, c * phi]])
        out = np.zeros((1, 3))
        creep_forces(LAWS["table"], model.creep, np.array([a / b]), np.zeros(1), scaled, out)
        force = limit * np.array([out[0, 0], out[0, 1] * cosine, out[0, 1] * sine])
        forces += force
        moments += limit * c * out[0, 2] * np.array([0.0, -sine, cosine]) + np.cross(at - place, force)
    numbers, cosine, sine = np.zeros(NUMBERS), math.cos(angle), math.sin(angle)
    numbers[[pair_table.ANGLE, pair_table.LOG_A, pair_table.LOG_B]] = angle, *whole
    numbers[pair_table.ROOT : pair_table.ROOT_A] = load, *load * apart, load * turned
    numbers[pair_table.ROOT_A : pair_table.REST_A] = load * (np.log(sizes[0]) - whole)
    numbers[pair_table.PARTED] = load * (1.0 - load)
    numbers[pair_table.REST_A : pair_table.REST_A + 2] = (1.0 - load) * (np.log(sizes[1]) - whole)
    speed = (velocity + np.cross(turning, place)) / 20.0
    xi, eta, phi, _ = creepages(*velocity, *turning, *place, cosine, sine, 20.0)
    slip = pair_table.Slip(xi, eta, phi, *speed[1:], *turning / 20.0)
    f1, f2, m3, _, c, fn = pair_table.base_force(model, numbers, slip, xi, eta, 0.3 * normal)
    expected = forces[0], forces[1] * cosine + forces[2] * sine, (moments[2] * cosine - moments[1] * sine) / c
    assert min(map(abs, expected)) > 200.0
    expected = *expected, forces[2] * cosine - forces[1] * sine
    np.testing.assert_allclose(np.array([f1, f2, m3, fn]) * 0.3 * normal, expected, rtol=2e-3)
    assert abs(expected[3]) > 20.0


TREAD_AND_ROOT = 16.54e-3, 4e-4, 5e-5, 0.0, -0.028, pair_table.WIDE
BENT = 29.64e-3, 7e-4, 1e-4, -8.4e-3, -0.0343, pair_table.WIDE
"""Places: tread and root carry in one overlap; a flange root lies in a gauge corner, bent by 0.85 rad."""

DISK = np.outer([0.1, 0.4, 1.0, 2.5, 8.0], np.exp(1j * (0.2 + 0.25 * math.pi * np.arange(8)))).ravel()
"""Creepages over those of saturation, as complex numbers."""


@pytest.mark.parametrize(("place", "root", "bound"), [(TREAD_AND_ROOT, 0.5, 0.06), (BENT, 0.8, 0.13)])
def test_two_ellipses_stand_for_a_lobe_that_turns(own_cache, place, root, bound):
    """The creep force at two ellipses is the exact one within some percent of mu N, all over the disk of creepages; at
    one ellipse of equal moments it is far off."""
    model, _ = compile_scene(load_scene(wr.example("trailer_vehicle"), {"contact.patch": "exact"}))
    strips = model.contact.strips._replace(looked_up=model.contact.friction)
    pair = pair_store.Pair(model.contact._replace(strips=strips), "two")
    points = np.stack([DISK.real, DISK.imag]).T
    numbers, remainder = pair.solve(place, points)
    assert abs(numbers[pair_table.ROOT] - root) < 0.1
    assert np.hypot(*remainder.T[:2]).max() < bound
    one, forces = numbers.copy(), np.zeros((2, len(points), 3))
    one[pair_table.ROOT] = 0.0
    normal = pair_node.contact_modulus(model.contact.shear_modulus, model.contact.poisson_ratio) * place[2] ** 1.5
    normal *= math.exp(numbers[pair_table.LOG_NORMAL])
    for row, force in zip((numbers, one), forces, strict=True):
        creeps = 1e-3 * points
        pair_node.base_forces(pair._solvable, row, place[1], place[3], creeps, np.ones(2), 0.3 * normal, force)
    assert np.hypot(*(forces[1] - forces[0]).T[:2]).max() > 0.1


@pytest.fixture(scope="module")
def rolling_wheels(benchmark_pair):
    """Poses about one, rolled over by both models: rows of each."""
    models = {name: LoadedWheels(benchmark_pair, name) for name in ("exact", "tabulated")}
    random, rows = np.random.default_rng(4), {name: [] for name in models}
    for _ in range(12):
        y, yaw, depth = random.uniform(-1.5e-3, -1.45e-3), random.uniform(-3e-3, 3e-3), random.uniform(0.0, 5e-6)
        drift, spin = random.uniform(-3e-3, 3e-3, 2)
        rolling = Rolling(SPEED, SPEED / 0.46 * (1.0 + spin), SPEED * (yaw + drift))
        for name, wheels in models.items():
            (found,) = wheels.at_height("left", y, Z - depth, yaw=yaw, rolling=rolling)
            rows[name].append(found.row)
    return models, {name: np.array(found) for name, found in rows.items()}


def test_against_the_exact_solver(rolling_wheels):
    models, rows = rolling_wheels
    exact, table = rows["exact"], rows["tabulated"]
    assert models["tabulated"]._counters[3] == 0  # nothing was solved in place of being looked up
    normal = exact[:, reduction.NORMAL]
    assert np.ptp(normal) > 2e3
    assert abs(table[:, reduction.NORMAL] / normal - 1.0).max() < 0.002
    force = np.hypot(*(table - exact)[:, [reduction.FX, reduction.FY]].T) / (0.3 * normal)
    assert force.max() < 0.005
    np.testing.assert_allclose(table[:, reduction.P_MAX], exact[:, reduction.P_MAX], rtol=0.015)
    np.testing.assert_allclose(table[:, [reduction.X, reduction.Y]], exact[:, [reduction.X, reduction.Y]], atol=5e-5)
    np.testing.assert_allclose(table[:, reduction.ANGLE], exact[:, reduction.ANGLE], atol=2e-4)


def test_moment_and_creepages_of_the_exact_solver(rolling_wheels):
    """The moment over mu N c, and creepages over V: of the same motion at nearly the same point."""
    exact, table = rolling_wheels[1]["exact"], rolling_wheels[1]["tabulated"]
    bound = 0.3 * exact[:, reduction.NORMAL] * np.sqrt(exact[:, reduction.SEMI_A] * exact[:, reduction.SEMI_B])
    assert (abs(exact[:, reduction.MZ]) / bound).max() > 0.05
    assert (abs(table[:, reduction.MZ] - exact[:, reduction.MZ]) / bound).max() < 0.005
    for column, unit in ((reduction.XI, 1e-4), (reduction.ETA, 1e-4), (reduction.PHI, 1e-3)):
        assert abs(exact[:, column]).max() > 10.0 * unit
        np.testing.assert_allclose(table[:, column], exact[:, column], atol=unit)


@pytest.mark.parametrize("vx", [SPEED, -SPEED])
def test_power_of_the_wrench_is_that_of_the_patch(rolling_wheels, vx):
    """Of all six velocities: V (Fx xi + Fy eta + Mz phi), less N times the rate at which wheel and rail approach."""
    wheels, contact, axle = rolling_wheels[0]["tabulated"], rolling_wheels[0]["tabulated"]._rolling[0.3], (2e-3, 1e-3)
    ex, ez = axle
    z = Z - wheels.geometry.half_distance * ez
    velocity = np.array([vx, 0.07, 0.003, 0.02, vx / 0.459, 0.015])
    m = WheelMotion(1.0, -1.5e-3, z, ex, math.sqrt(1.0 - ex * ex - ez * ez), ez, *velocity, 0.0, 0.0, 0.3)
    rows, row, wrench = np.zeros((MAX_PATCHES, PATCH_COLUMNS)), np.zeros(PATCH_COLUMNS), np.zeros(6)
    count = find_patches(wheels.geometry, *m[:6], True, reduction.MOMENT, rows)
    tabulated_wrench(contact, m, True, rows, 0, count, row, wrench, wheels._counters, wheels._work_handle)
    place = row[[reduction.X, reduction.Y, reduction.Z]] - [0.0, m.y, m.z]
    drift = velocity[:3] + np.cross(velocity[3:], place)
    approach = drift[1] * row[reduction.SINE] - drift[2] * row[reduction.COSINE]
    creep = row[[reduction.FX, reduction.FY, reduction.MZ]] @ row[[reduction.XI, reduction.ETA, reduction.PHI]]
    assert wheels._counters[3] == 0 and abs(creep * SPEED) > 100.0
    expected = SPEED * creep - row[reduction.NORMAL] * approach
    assert wrench @ velocity == pytest.approx(expected, abs=1e-3 * abs(creep * SPEED))


def test_lobes_that_are_apart():
    """A wheel that stands on both edges of its hollow, 30 mm apart: each lobe is looked up, with what the other's
    pressure and friction do to it."""
    new, rail = named_profile("S1002", "wheel"), named_profile("60E1", "rail", 1 / 40)
    u = np.linspace(-0.06, 0.055, 1151)
    hollow = ProfileCurve.from_points(u, new(u) + 1e-3 * (np.exp(-((u / 0.015) ** 2)) - 1.0), "wheel")
    models = {name: LoadedWheels(WheelOnRail(hollow, rail).geometry, name) for name in ("exact", "tabulated")}
    for y, yaw, drift in ((0.3e-3, 2e-3, 2e-3), (0.5e-3, -1e-3, -1e-3), (0.7e-3, 0.0, 3e-3)):
        roll, _ = models["exact"].settled(y, 6e4)
        z = models["exact"].height("left", y, 6e4, roll, yaw)
        rolling = Rolling(SPEED, SPEED / 0.459, SPEED * (yaw + drift))
        (exact,), (table,) = (models[name].at_height("left", y, z, roll, yaw, rolling) for name in models)
        exact, table = exact.row, table.row
        normal = exact[reduction.NORMAL]
        assert exact[reduction.SEMI_B] > 0.02  # of both lobes together
        assert table[reduction.NORMAL] == pytest.approx(normal, rel=7e-4)
        limit, c = 0.3 * normal, math.sqrt(exact[reduction.SEMI_A] * exact[reduction.SEMI_B])
        assert math.hypot(*(table - exact)[[reduction.FX, reduction.FY]]) < 5e-3 * limit
        assert table[reduction.MZ] == pytest.approx(exact[reduction.MZ], abs=0.01 * limit * c)
        assert table[reduction.P_MAX] == pytest.approx(exact[reduction.P_MAX], rel=2e-3)
        np.testing.assert_allclose(table[[reduction.X, reduction.Y]], exact[[reduction.X, reduction.Y]], atol=2e-4)
        for column, unit in ((reduction.XI, 2e-5), (reduction.ETA, 2e-5), (reduction.PHI, 3e-3)):
            assert table[column] == pytest.approx(exact[column], abs=unit)
    assert models["tabulated"]._counters[3] == 0
    assert models["tabulated"]._rolling[0.3].value.strips.late[LOBES] != 0


def test_lobes_that_are_apart_are_compiled_where_there_are_some(rolling_wheels):
    assert rolling_wheels[0]["tabulated"]._rolling[0.3].value.strips.late[LOBES] == 0


@pytest.mark.parametrize(("y", "load", "yaw", "spin", "drift", "most"), [
    (5.5e-3, 3.4e4, 0.0, -1.5e-3, -4e-3, 0.01), (6.0e-3, 3.4e4, -5e-3, 0.0, -3.5e-3, 0.01),
    (4.6e-3, 7.2e4, -5.7e-3, 1e-3, 1e-3, 0.02),
])  # fmt: skip
def test_in_the_root_of_the_flange(benchmark_pair, y, load, yaw, spin, drift, most):
    """Where a lobe is slender, spins and turns, and where one is about to be born beside it: its cells are finer."""
    models = {name: LoadedWheels(benchmark_pair, name) for name in ("exact", "tabulated")}
    roll, _ = models["exact"].settled(y, load)
    z = models["exact"].height("left", y, load, roll, yaw)
    rolling = Rolling(SPEED, SPEED / 0.46 * (1.0 + spin), SPEED * (yaw + drift))
    exact, table = (models[name].at_height("left", y, z, roll, yaw, rolling)[0].row for name in models)
    assert models["tabulated"]._counters[3] == 0
    assert table[reduction.NORMAL] == pytest.approx(exact[reduction.NORMAL], rel=3e-3)
    assert math.hypot(*(table - exact)[[reduction.FX, reduction.FY]]) < most * 0.3 * exact[reduction.NORMAL]


def test_a_slender_contact_on_the_flange_about_its_spin_pole(benchmark_pair):
    """Where it slips about a place within, its creep force turns round within a few parts in a thousand of the rate:
    within 0.5 % of mu N; with modes of flanges alone it is 0.4 %, with those for which moments counted more 1.0 %."""
    models = {name: LoadedWheels(benchmark_pair, name) for name in ("exact", "tabulated")}
    roll, _ = models["exact"].settled(6.5e-3, 1e4)
    z, forces = models["exact"].height("left", 6.5e-3, 1e4, roll, 0.0), {name: [] for name in models}
    for rate in np.linspace(0.955, 0.985, 16):
        rolling = Rolling(SPEED, SPEED / 0.46 * rate)
        for name, model in models.items():
            row = model.at_height("left", 6.5e-3, z, roll, rolling=rolling)[0].row
            forces[name].append(row[[reduction.FX, reduction.FY]] / (0.3 * row[reduction.NORMAL]))
    exact, table = map(np.array, forces.values())
    assert np.ptp(exact[:, 0]) > 1.0
    assert np.hypot(*(table - exact).T).max() < 0.006


def test_a_lobe_that_barely_touches_is_left_out(own_cache):
    """Without it the loaded surfaces meet where it would be, with it it bears nothing: strips find a solution still."""
    model, _ = compile_scene(load_scene(wr.example("trailer_vehicle"), {"contact.patch": "exact"}))
    strips = model.contact.strips._replace(looked_up=model.contact.friction)
    pair, found = pair_store.Pair(model.contact._replace(strips=strips), "barely"), []
    for offset in (23.205e-3, 23.337e-3, 23.462e-3):
        place = offset, 3.75e-4, 7.315235792977453e-05, -2.37037037e-3, -0.028, pair_table.WIDE
        found.append(pair.solve(place, creep_modes(0.3).points[:2])[0][pair_table.LOG_NORMAL])
    before, here, beyond = found
    assert before < here < beyond < before + 0.02


def test_what_is_left_of_a_lobe_that_is_lifted_and_tilted():
    """Depth and place of two parabolas from which a slanting plane is taken, against sums over their squares."""
    rows, lobe, y = np.zeros((2, PATCH_COLUMNS)), np.zeros(LOBE_COLUMNS), 0.01
    lobe[coupled_lobes.LIFT], lobe[coupled_lobes.TILT] = 6e-6, 3e-3
    for row, place, depth, b, angle in zip(rows, (9e-3, 13e-3), (6e-5, 4e-5), (1.5, 4.0), (0.2, 0.05), strict=True):
        row[reduction.U_WHEEL], row[reduction.Y], row[reduction.COSINE] = place - 0.05, place, math.cos(angle)
        row[reduction.PENETRATION], row[reduction.CURVATURE_Y] = depth, b
    square = moment = 0.0
    for row in rows:
        s, cosine = np.linspace(-0.01, 0.01, 40001), row[reduction.COSINE]
        plane = lobe[coupled_lobes.LIFT] + lobe[coupled_lobes.TILT] * (s + (row[reduction.Y] - y) / cosine)
        gap = np.maximum(row[reduction.PENETRATION] - row[reduction.CURVATURE_Y] * s**2 - plane, 0.0) / cosine
        square += (gap**2).sum() * 5e-7 * cosine
        moment += (gap**2 * (row[reduction.U_WHEEL] + s * cosine)).sum() * 5e-7 * cosine
    depth, u = coupled_lobes.depth_left(rows, 0, 2, lobe, y)
    assert depth == pytest.approx((0.9375 * math.sqrt(pair_table.CURVATURE) * square) ** 0.4, rel=1e-3)
    assert u == pytest.approx(moment / square, abs=2e-6)


def points_of_hertz(a, b, n=16):
    """Places (n^2, 2) in an ellipse that share its Hertz pressure alike."""
    radius = np.sqrt(1.0 - (1.0 - (np.arange(n) + 0.5) / n) ** (2.0 / 3.0))
    angle = 2.0 * math.pi * (np.arange(n) + 0.5) / n
    return np.stack([a * np.outer(radius, np.cos(angle)).ravel(), b * np.outer(radius, np.sin(angle)).ravel()], axis=1)


def points_under_a_punch(a, b, n=16):
    """The same for the pressure under a rigid punch."""
    radius = np.sqrt(1.0 - (1.0 - (np.arange(n) + 0.5) / n) ** 2.0)
    angle = 2.0 * math.pi * (np.arange(n) + 0.5) / n
    return np.stack([a * np.outer(radius, np.cos(angle)).ravel(), b * np.outer(radius, np.sin(angle)).ravel()], axis=1)


@pytest.mark.parametrize(("moment", "rtol"), [(0.0, 0.015), (12.0, 0.05)])
def test_lobes_act_on_each_other_as_loads_on_a_half_space_do(moment, rtol):
    """Against Boussinesq's and Cerruti's displacements, wheel's less rail's, of spread loads, averaged over the other
    ellipse; a creepage of theirs is their fall over x, for material runs through the contact towards -x."""
    shear, nu, gap, step = 8.2e10, 0.28, 0.012, 1e-5
    forces, sizes = {"n": 4e4, "x": 7e3, "s": -3e3, "m": moment}, ((4e-3, 2e-3), (4e-3, 1e-3))
    numbers, lobes = np.zeros((2, NUMBERS)), np.zeros((2, LOBE_COLUMNS))
    for q, (a, b) in enumerate(sizes):
        numbers[q, [pair_table.LOG_A, pair_table.LOG_B]] = math.log(a), math.log(b)
    numbers[0, pair_table.PLACE_Y] = gap  # lobe 0 lies further out than the loaded lobe 1
    assert coupled_lobes.TURN + MAX_PATCHES == LOBE_COLUMNS
    lobes[:, coupled_lobes.END] = 1.0, 2.0
    places = [getattr(coupled_lobes, name) for name in ("NORMAL", "FORCE_X", "FORCE_S", "MOMENT")]
    lobes[1, places] = list(forces.values())
    rows = np.zeros((2, PATCH_COLUMNS))
    rows[:, reduction.U_WHEEL], rows[:, [reduction.CURVATURE_Y, reduction.COSINE]] = (0.0, gap), 1.0
    work = SimpleNamespace(lobes=lobes, numbers=numbers, rows=rows)
    model = SimpleNamespace(shear_modulus=shear, poisson_ratio=nu)
    twisted = (sizes[1][0] ** 2 - sizes[1][1] ** 2) / (sizes[1][0] ** 2 + sizes[1][1] ** 2)

    def displaced(moved, aside=0.0, own=points_of_hertz):
        """Mean (ux, us, un) of lobe 0, moved along x and across, over points of its own."""
        loaded = points_of_hertz(*sizes[1])[None]
        apart = own(*sizes[0])[:, None] + [moved, gap + aside] - loaded
        (x, y), r = apart.transpose(2, 0, 1), np.hypot(*apart.transpose(2, 0, 1))
        across = forces["s"] + twisted * forces["m"] * loaded[..., 0] / (loaded[..., 0] ** 2).mean()
        ux = forces["x"] * ((1.0 - nu) / r + nu * x * x / r**3) + across * nu * x * y / r**3
        us = across * ((1.0 - nu) / r + nu * y * y / r**3) + forces["x"] * nu * x * y / r**3
        return np.array([ux.mean(), us.mean(), (forces["n"] * (1.0 - nu) / r).mean()]) / (math.pi * shear)

    slope = (displaced(step) - displaced(-step)) / (2.0 * step)
    found = coupled_lobes.slip_of_others.py_func(model, 0, 2, work)
    np.testing.assert_allclose(found, -slope[:2], rtol=rtol)
    assert min(map(abs, found)) > 5e-6
    coupled_lobes.balance.py_func(model, 0.0, 0, 2, work)
    punched = [displaced(0.0, aside, points_under_a_punch)[2] for aside in (-1e-5, 0.0, 1e-5)]
    lift, tilt = (forces["n"] * lobes[0, column + 1] for column in (coupled_lobes.RISE, coupled_lobes.TURN))
    assert lift == pytest.approx(punched[1], rel=0.001)
    assert tilt == pytest.approx((punched[2] - punched[0]) / 2e-5, rel=0.03)


def test_a_corner_without_a_solution_goes_on_as_a_straight_line():
    """Beyond a cell; where one of its own corners has none, the cell has none."""
    key = pair_cells.key_of(0, 7, 1, 300, 200, 9)
    whole = pair_store.Pair._rows_of(pair_of_known_numbers(), key)
    rows = pair_store.Pair._rows_of(pair_of_known_numbers([(3, 299, 200, 9), (3, 300, 201, 11)]), key)
    changed = np.flatnonzero(abs(rows - whole).max(axis=1))
    assert len(changed) == 2
    lines = [
        2.0 * known_numbers(300, 200, 9)[0] - known_numbers(301, 200, 9)[0],
        2.0 * known_numbers(300, 201, 10)[0] - known_numbers(300, 201, 9)[0],
    ]
    np.testing.assert_allclose(sorted(rows[changed, 0]), sorted(lines))
    assert pair_store.Pair._rows_of(pair_of_known_numbers([(3, 300, 201, 10)]), key) is None


def test_where_yaw_has_no_solution_it_adds_what_it_adds_elsewhere():
    """If that is known at half of the corners at least."""
    key, empty = pair_cells.key_of(0, 7, 1, 300, 200, 9), np.zeros((pair_table.NODES, NUMBERS), np.float32)
    corners = [(4, 300 + a, 200 + b, 8 + c) for a in (0, 2) for b in (0, 2) for c in (0, 2)]
    assert pair_store.Pair._add_yaw(pair_of_known_numbers(corners[:4]), key, empty)
    rows = empty[32:].reshape(8, 2, -1)
    np.testing.assert_allclose(rows[:4], np.broadcast_to(rows[4:].mean(axis=0), (4, *rows.shape[1:])))
    assert np.ptp(rows[4:, 0, 1]) > 1.0
    assert not pair_store.Pair._add_yaw(pair_of_known_numbers(corners[:5]), key, empty.copy())


def test_planar_detection_is_solved(benchmark_pair):
    """The lattices are of spatial detection."""
    models = [LoadedWheels(benchmark_pair, name, detection="planar") for name in ("exact", "tabulated")]
    (exact,), (table,) = (model.at_height("left", -1.5e-3, Z, yaw=5e-3, rolling=Rolling(SPEED)) for model in models)
    np.testing.assert_array_equal(table.row, exact.row)


def test_a_right_wheel_is_the_mirror_image_of_a_left_one(rolling_wheels):
    wheels = rolling_wheels[0]["tabulated"]
    (left,), (right,) = (
        wheels.at_height(side, sign * -1.5e-3, Z, yaw=sign * 1e-3, rolling=Rolling(SPEED, SPEED / 0.46, sign * 0.01))
        for side, sign in (("left", 1.0), ("right", -1.0))
    )
    mirrored = [reduction.Y, reduction.ANGLE, reduction.FY, reduction.MZ, reduction.ETA, reduction.PHI]
    same = [reduction.NORMAL, reduction.FX, reduction.XI, reduction.X, reduction.SEMI_A, reduction.P_MAX]
    np.testing.assert_array_equal(right.row[same], left.row[same])
    np.testing.assert_array_equal(right.row[mirrored], -left.row[mirrored])


def test_a_wheel_that_rolls_back_is_a_mirror_image_too(rolling_wheels):
    """x and yaw change their sign, and what points along x or turns about y and z."""
    wheels = rolling_wheels[0]["tabulated"]
    (ahead,), (back,) = (
        wheels.at_height("left", -1.5e-3, Z, yaw=sign * 1e-3, rolling=Rolling(sign * SPEED, sign * SPEED / 0.459, 0.01))
        for sign in (1.0, -1.0)
    )
    mirrored = [reduction.X, reduction.FX, reduction.MZ, reduction.XI, reduction.PHI]
    same = [reduction.NORMAL, reduction.FY, reduction.ETA, reduction.Y]
    np.testing.assert_allclose(back.row[same], ahead.row[same], rtol=1e-12)
    np.testing.assert_allclose(back.row[mirrored], -ahead.row[mirrored], rtol=1e-12)


def test_what_lies_outside_is_solved(rolling_wheels):
    models = rolling_wheels[0]
    rolling = Rolling(SPEED, SPEED / 0.46)
    (table,), (exact,) = (
        models[name].at_height("left", -1.5e-3, Z, yaw=1.02 * YAWS * YAW, rolling=rolling)
        for name in ("tabulated", "exact")
    )
    np.testing.assert_array_equal(table.row, exact.row)
    models["tabulated"]._counters[:] = 0


def simulated(duration=0.05):
    settings = {"integration.duration": duration, "contact.patch": "tabulated"}
    run = wr.simulate(wr.example("suspended_wheelset"), **settings)
    return np.column_stack([run["wheelset"].y_m, load(run), run["wheelset/right"].Fx_N[:, 0]])


def load(run):
    """Normal force of the left wheel, N."""
    return np.nansum(run["wheelset/left"].N_N, axis=1)


def test_the_same_bits_on_an_empty_a_full_and_a_damaged_table(own_cache, capsys):
    empty = simulated()
    for pair in list(pair_store._PAIRS.values()):
        pair.write()
    (path,) = own_cache.glob("pair_*.h5")
    pair_store._PAIRS.clear()
    full = simulated()
    solved = [pair._new for pair in pair_store._PAIRS.values()]
    np.testing.assert_array_equal(full, empty)
    assert solved == [0] and len(empty) > 3 and np.ptp(empty[:, 0]) > 1e-5
    pair_store._PAIRS.clear()
    path.write_bytes(path.read_bytes()[:-100])
    np.testing.assert_array_equal(simulated(), empty)
    assert "solved anew" in capsys.readouterr().err


def test_what_went_wrong_while_solving_is_not_kept(own_cache, monkeypatch, capsys):
    """A cell whose solution failed is solved anew the next time: the same bits as if nothing had happened."""

    def fail(*_):
        raise MemoryError("no more")

    with monkeypatch.context() as patched:
        patched.setattr(pair_store.Pair, "solve", fail)
        simulated()
    assert capsys.readouterr().err.count("no more") == 1
    for pair in list(pair_store._PAIRS.values()):
        assert not pair.cells
    assert not list(own_cache.iterdir())


def test_a_full_table_is_left_as_it_is(own_cache, monkeypatch, capsys):
    """What has no room is solved: not more than once for the table."""
    calls = []
    monkeypatch.setattr(pair_store, "CELLS", 2)
    solved = pair_store.Pair._solved
    monkeypatch.setattr(pair_store.Pair, "_solved", lambda pair, key: calls.append(key) or solved(pair, key))
    simulated()
    assert capsys.readouterr().err.count("no room") == 1
    assert len(calls) == len(set(calls))
    (pair,) = pair_store._PAIRS.values()
    assert pair._full()
    pair.write()


def contact_for_a_table():
    contact = compile_scene(load_scene(wr.example("suspended_wheelset"), {"contact.patch": "exact"}))[0].contact
    return contact._replace(strips=contact.strips._replace(looked_up=0.271))


def test_threads_that_meet_a_new_pair_share_its_table(own_cache, monkeypatch):
    made, barrier = [], threading.Barrier(4)

    class Slow(pair_store.Pair):
        def __init__(self, *given):
            made.append(given)
            time.sleep(0.2)
            super().__init__(*given)

    contact = contact_for_a_table()
    monkeypatch.setattr(pair_store, "Pair", Slow)

    def pair(_):
        barrier.wait()
        return pair_store.pair_of(contact)

    with ThreadPoolExecutor(4) as pool:
        assert len(set(map(id, pool.map(pair, range(4))))) == len(made) == 1


def test_a_pair_that_is_dropped_at_exit_says_nothing(monkeypatch):
    """Modules are being taken apart then; what it knows has been written before."""

    class Dropped(pair_store.Pair):
        def __init__(self, new):
            self._new = new

        def write(self):
            written.append(self._new)

    written: list[int] = []
    with monkeypatch.context() as patched:
        patched.setattr(sys, "is_finalizing", lambda: True)
        Dropped(3).__del__()
    assert written == []
    pair = Dropped(4)
    pair.__del__()
    assert written == [4]
    pair._new = 0
    pair_store.Pair.__new__(pair_store.Pair).__del__()  # one that was never made


def test_what_is_said_of_solving_says_how_far_the_run_is(own_cache, monkeypatch):
    said = []
    monkeypatch.setattr(pair_store, "tell", said.append)
    pair = pair_store.Pair(contact_for_a_table(), "told")
    pair._next_told = 0.0
    pair._reached = lambda: "the run is at t = 0.4 of 10 s"
    with pair._told():
        pass
    (text,) = said
    assert text.startswith("pair_told.h5 has ") and text.endswith("s of solving; the run is at t = 0.4 of 10 s")


def test_an_interrupt_is_handed_on_after_the_call():
    handler = signal.signal(signal.SIGINT, signal.default_int_handler)  # what runs in the background ignores it
    try:
        with pair_store.handed_on(""):  # as in a call from a kernel, where it would be lost
            raise KeyboardInterrupt
        with pytest.raises(KeyboardInterrupt):
            time.sleep(10.0)
    finally:
        signal.signal(signal.SIGINT, handler)


def test_an_interrupt_while_equilibrium_is_sought_is_no_lack_of_one(monkeypatch):
    """What a cell leaves unanswered then is no number of the vehicle."""

    def interrupted(pair, key):
        raise KeyboardInterrupt

    handler = signal.signal(signal.SIGINT, signal.default_int_handler)
    monkeypatch.setattr(pair_store.Pair, "_solved", interrupted)
    monkeypatch.setattr(pair_store, "_PAIRS", {})
    try:
        with pytest.raises(KeyboardInterrupt):
            wr.simulate(wr.example("suspended_wheelset"), contact__friction=0.23, contact__patch="tabulated")
    finally:
        signal.signal(signal.SIGINT, handler)


def test_implicit_steps_are_those_of_ellipses():
    """Jacobians are of the table itself."""
    steps, settings = {}, {"integration.method": "rodas4", "integration.rtol": 1e-4, "integration.duration": 0.5}
    for patch in ("moment", "tabulated"):
        run = wr.simulate(wr.example("suspended_wheelset"), **settings, **{"contact.patch": patch, "speed": 40.0})
        steps[patch] = run.counters["steps"]
    assert steps["tabulated"] < 1.2 * steps["moment"]


def test_what_is_solved_has_the_jacobian_of_the_exact_solver():
    """Where ellipses stand in, they do so for the rate that the derivative by time starts from, too."""
    settings = {"integration.method": "rodas5", "contact.detection": "planar", "integration.duration": 0.02}
    table, exact = (
        wr.simulate(wr.example("suspended_wheelset"), **settings, **{"contact.patch": patch})
        for patch in ("tabulated", "exact")
    )
    np.testing.assert_array_equal(table["wheelset"].y_m, exact["wheelset"].y_m)
    assert table.counters["steps"] == exact.counters["steps"] > 2


@pytest.mark.parametrize("y", [0.0, 5e-3, 6.2e-3])  # the last one runs on tread and flange
def test_within_a_step_wrenches_are_those_of_outputs(y):
    """No rows are filled there: wrenches and counts are the same bits, and rows are what they were."""
    model, state = compile_scene(
        load_scene(wr.example("suspended_wheelset"), **{"contact.patch": "tabulated", "initial.y": y})
    )
    whole, bare = Equations(model), Equations(model)
    whole(0.0, state), bare(0.0, state, modes.STAGE)
    assert whole.work.counts.sum() >= 2 and whole.work.rail_wrenches.any()
    for name in ("rail_wrenches", "counts"):
        np.testing.assert_array_equal(getattr(bare.work, name), getattr(whole.work, name))
    assert whole.work.patches[..., reduction.P_MAX].any() and not bare.work.patches[..., reduction.P_MAX].any()


def shipped_pair(**changes):
    """The `Pair` of an example, as it comes with the package."""
    model, _ = compile_scene(load_scene(wr.example("suspended_wheelset"), **{"contact.patch": "tabulated", **changes}))
    return pair_store.pair_of(model.contact)


def test_nodes_of_the_package_are_those_of_today(own_cache, monkeypatch):
    monkeypatch.undo()
    monkeypatch.setattr(pair_store, "table_folder", lambda: own_cache)
    monkeypatch.setattr(pair_store, "_PAIRS", {})
    pair, random, compared = shipped_pair(), np.random.default_rng(3), 0
    assert len(pair._known) > 100
    places = list(pair._solved_at)
    for k in random.integers(len(places), size=12):
        own, kept = pair._at(places[k]), pair._solved_at[places[k]]
        scales = np.where(np.isin(np.arange(NUMBERS), METRES), 1e-6, 1e-3)
        np.testing.assert_array_less(abs(own - kept)[np.isfinite(kept)], scales[np.isfinite(kept)])
        np.testing.assert_array_equal(np.isnan(own), np.isnan(kept))
        compared += np.isfinite(kept[0])
    assert compared > 6
    assert not shipped_pair(**{"contact.friction": 0.29})._known


def test_cells_of_the_package_count_as_no_time_of_solving(own_cache, monkeypatch):
    """However many are put together, no line says that any is solved."""
    monkeypatch.undo()
    monkeypatch.setattr(pair_store, "table_folder", lambda: own_cache)
    monkeypatch.setattr(pair_store, "_PAIRS", {})
    pair = shipped_pair()
    for key in [key for key, (_, state) in pair._known.items() if state > 0][:20]:
        pair._fill(key)
    assert pair._ready >= 10 and pair._spent == 0.0


def test_how_far_solving_has_come_is_told_ever_more_seldom(own_cache, monkeypatch, capsys):
    monkeypatch.undo()
    monkeypatch.delenv("WRCORE_PROGRESS", raising=False)
    monkeypatch.setattr(pair_store, "table_folder", lambda: own_cache)
    monkeypatch.setattr(pair_store, "_PAIRS", {})
    monkeypatch.setattr(pair_store, "say_if_long", lambda *_: nullcontext())
    pair, said = shipped_pair(), []
    for seconds in (0.0, 31.0, 59.0, 61.0, 100.0, 119.0):
        pair._spent = seconds
        with pair._told():
            pass
        said.append(len(capsys.readouterr().err.splitlines()))
    assert said == [0, 1, 0, 1, 0, 0]


@pytest.mark.parametrize("name, speed", [
    ("suspended_wheelset", 60.0), ("trailer_vehicle", 50.0), ("freight_wagon_empty", 20.0),
    ("freight_wagon_laden", 20.0), ("metro_car", 30.0),
])  # fmt: skip
def test_an_example_solves_nothing(own_cache, monkeypatch, name, speed):
    """What they meet comes with the package: not even the solver is compiled."""
    monkeypatch.undo()
    monkeypatch.setattr(pair_store, "table_folder", lambda: own_cache)
    monkeypatch.setattr(pair_store, "_PAIRS", {})
    monkeypatch.setattr(pair_store.Pair, "solve", None)
    asked = []
    monkeypatch.setattr(patch_kernels.LateKernels, "find", lambda _, which: asked.append(which))
    run = wr.simulate(wr.example(name), **{"contact.patch": "tabulated", "speed": speed, "integration.duration": 0.5})
    assert run.counters["patches_not_tabulated"] == 0 and not asked
    assert not list(own_cache.iterdir())


def test_another_profile_or_friction_is_another_table(own_cache, benchmark_pair):
    wheels = LoadedWheels(benchmark_pair, "tabulated")
    contact = wheels._at_work(0.3).value
    filed = benchmark_pair.rail.copy()
    filed[len(filed) // 2, 0] += 1e-9
    changed = contact._replace(geometry=benchmark_pair._replace(rail=filed))
    slippery = contact._replace(strips=contact.strips._replace(looked_up=0.2))
    coarse = contact._replace(strips=contact.strips._replace(strips=8))
    assert len({pair_store.pair_of(one).path for one in (contact, changed, slippery, coarse)}) == 4


def test_gauge_and_vehicle_are_not_of_the_table(own_cache, benchmark_pair):
    # a node solved with other distances from the middle of the track is the same but for rounding
    contact = LoadedWheels(benchmark_pair, "tabulated")._at_work(0.3).value
    elsewhere = benchmark_pair._replace(half_distance=0.7, rail_distance=0.73)
    shared = pair_store.pair_of(contact)
    assert pair_store.pair_of(contact._replace(geometry=elsewhere)) is shared
    moved = pair_store.Pair(shared.contact._replace(geometry=elsewhere), "elsewhere")
    codes = [code for code, numbers in shipped_pair()._solved_at.items() if np.isfinite(numbers[0])]
    for code in codes[:: len(codes) // 6]:
        own, other = (pair._at(code) for pair in (shared, moved))
        np.testing.assert_array_less(abs(own - other), np.where(np.isin(np.arange(NUMBERS), METRES), 1e-6, 1e-3))


def test_a_run_beside_the_exact_one():
    table = simulated(0.3)
    run = wr.simulate(wr.example("suspended_wheelset"), **{"integration.duration": 0.3, "contact.patch": "exact"})
    y = run["wheelset"].y_m
    assert abs(table[:, 0] - y).max() < 2e-3 * abs(y).max()
    assert np.sqrt(np.mean((table[:, 1] / load(run) - 1.0) ** 2)) < 5e-3
    assert "look_up_normal_error" not in run.counters


def beside_exact(changes, times):
    """Fx and N of both wheels of the suspended wheelset, (2, n, 2, 2), at the states of a run: looked up, and exact."""
    scene = wr.example("suspended_wheelset")
    models = [compile_scene(load_scene(scene, changes | {"contact.patch": one})) for one in ("tabulated", "exact")]
    run, equations = integrate(*models[0], times, "rodas5"), [Equations(model) for model, _ in models]
    forces = np.empty((2, len(times), 2, 2))
    for k, state in enumerate(run.states):
        for one, rows in zip(equations, forces, strict=True):
            one(times[k], state)
            rows[k] = one.work.patches[0, :, 0][:, [reduction.FX, reduction.NORMAL]]
    return forces


def test_each_rail_has_a_table_of_its_own_friction():
    """Over what friction on the wheel's own rail bears. At 0.05 modes leave 1.4 % in 95 % of treads, at 0.3 0.4 %."""
    changes = {"contact.friction": {"left": 0.3, "right": 0.05}, "initial.y": 0.003}
    forces = beside_exact(changes, np.linspace(0.0, 0.1, 21))
    own, exact = forces[..., 0] / (np.array([0.3, 0.05]) * forces[1, ..., 1])
    assert np.all(abs(own - exact).max(axis=0) < (3e-3, 1.3e-2))
    assert np.all(abs(exact).max(axis=0) > 0.1)


@pytest.mark.parametrize(
    ("speed", "least", "low", "high"), [(60.0, 0.15, 0.003, 0.03), (60.0, 0.05, 0.05, 0.2), (20.0, 0.05, 0.15, 0.2)]
)
def test_friction_that_falls_along_a_rail_errs_by_what_a_scene_says(speed, least, low, high):
    """Beyond the fall, over what friction bears there: 2 to 3 % where it is half, 14 to 19 where it is a sixth."""
    friction = {"arc_length": [10.0, 20.0], "mu": [0.3, least]}
    changes = {"contact.friction": friction, "speed": speed, "initial.y": 0.004}
    forces = beside_exact(changes, np.linspace(0.0, 60.0 / speed, 61))[:, 21:]
    own, exact = forces[..., 0] / (least * forces[1, ..., 1])
    assert low < np.percentile(abs(own - exact), 95) < high


@pytest.mark.parametrize("resolution", ["coarse", "middle", "fine"])
def test_a_cell_is_left_to_the_next_lattice_where_any_error_is_large(own_cache, monkeypatch, resolution):
    """But for what modes leave, which no lattice mends: that is told only."""
    changes = {"contact.patch": "tabulated", "contact.resolution": resolution}
    model, _ = compile_scene(load_scene(wr.example("suspended_wheelset"), changes))
    monkeypatch.setattr(pair_store.Pair, "_rows_of", lambda *_: np.zeros((48, NUMBERS), np.float32))
    monkeypatch.setattr(pair_store.Pair, "_add_yaw", lambda *_: True)
    for miss, state, coarse in (
        ((1e-3, 1e-3, 0.02, 0.2), 1, 1),
        ((4e-3, 1e-3, 0.02, 0.0), -1, 1),
        ((1e-3, 0.02, 0.02, 0.0), -1, 1),
        ((1e-3, 1e-3, 0.04, 0.0), -1, 1),
        ((0.02, 1e-3, 0.02, 0.0), -1, -1),
        ((1e-3, 0.04, 0.02, 0.0), -1, -1),
    ):
        monkeypatch.setattr(pair_store.Pair, "_miss", lambda *_, miss=miss: miss)
        pair, key = pair_store.Pair(model.contact, "any"), pair_cells.key_of(0, 25, 1, 7, 9, 11)
        assert pair._solved(key)[0] == (coarse if resolution == "coarse" else state), miss
        assert pair.misses[key] == miss


@pytest.mark.parametrize(("lattice", "peak", "state"), [(1, 0.05, -1), (2, 0.05, 1), (2, 0.12, -1), (3, 0.12, 1)])
def test_pressure_sends_few_cells_to_the_finest_lattices(own_cache, monkeypatch, benchmark_pair, lattice, peak, state):
    """On flange roots it steps by 5 to 15 % with the number of strips; what N and the creep force may miss stays."""
    pair = pair_store.Pair(LoadedWheels(benchmark_pair, "tabulated")._at_work(0.3).value, "any")
    monkeypatch.setattr(pair, "_rows_of", lambda *_: np.zeros((48, NUMBERS), np.float32))
    monkeypatch.setattr(pair, "_add_yaw", lambda *_: True)
    key = pair_cells.key_of(lattice, 25, 1, 7, 9, 11)
    for miss, found in (((1e-3, 1e-3, peak, 0.0), state), ((4e-3, 1e-3, 0.0, 0.0), -1), ((1e-3, 0.02, 0.0, 0.0), -1)):
        monkeypatch.setattr(pair, "_miss", lambda *_, miss=miss: miss)
        assert pair._solved(key)[0] == found


def test_a_run_says_how_far_its_cells_are_from_the_exact_solver():
    """The largest errors in the middles of those that it met at its output times."""
    run = wr.simulate(wr.example("suspended_wheelset"), **{"integration.duration": 0.05, "contact.patch": "tabulated"})
    errors = [run.counters[name] for name in LOOK_UP_ERRORS]
    assert (np.array(errors) > 0.0).all() and np.less(errors, pair_store.WRONG[0]).all()
    rows = np.full((2, 1, 2, MAX_PATCHES, PATCH_COLUMNS), math.nan)
    rows[:, 0, :, 0, reduction.CELL] = [[1.0, 0.0], [1.0, 0.0]]
    misses = np.array([[0.0, 0.0, 0.0, 0.0], [0.01, 0.02, 0.004, 0.005], [0.03, 0.001, 0.002, 0.004]])
    table = SimpleNamespace(misses=misses)
    wheel = SimpleNamespace(strips=SimpleNamespace(looked_up=0.3, table=table), wheels=())
    assert [*look_up_errors(wheel, rows).values()] == pytest.approx([0.01, 0.025, 0.004])
    rows[1, 0, 1, 1, reduction.CELL] = 2.0
    assert [*look_up_errors(wheel, rows).values()] == pytest.approx([0.03, 0.025, 0.004])


def test_the_solver_is_compiled_when_a_patch_needs_it(monkeypatch):
    """Where it cannot be had, nothing is computed without it."""
    settings = {"integration.duration": 0.1, "contact.patch": "tabulated", "speed": 60.0}
    asked = []
    monkeypatch.setattr(patch_kernels.LateKernels, "find", lambda _, which: asked.append(which))
    wr.simulate(wr.example("suspended_wheelset"), **settings)
    assert not asked
    with pytest.raises(wr.InputError, match="rests on its wheels"):
        wr.simulate(wr.example("suspended_wheelset"), **settings, **{"contact.detection": "planar"})
    assert {KERNEL, ELLIPSES} >= set(asked) >= {KERNEL}


@pytest.mark.parametrize("friction", [0.05, 0.3])
def test_little_friction(benchmark_pair, friction):
    """Where curvature makes much of the creepages of saturation: modes are of that friction."""
    models = {name: LoadedWheels(benchmark_pair, name) for name in ("exact", "tabulated")}
    for y, yaw in ((3.7e-3, 0.0), (4.5e-3, 0.0), (4.5e-3, -1.5e-3)):
        z = models["exact"].height("left", y, 6.3e4, 0.0, yaw)
        forces = [
            sum(one.row for one in wheels.at_height("left", y, z, 0.0, yaw, Rolling(15.0), friction))
            for wheels in models.values()
        ]
        difference = (forces[1] - forces[0])[[reduction.FX, reduction.FY]]
        assert math.hypot(*difference) < 0.008 * friction * forces[0][reduction.NORMAL]
