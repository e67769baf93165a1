"""Wheels by the surrogate: beside exact contact and Hertz's, bounded whatever the motion, smooth along a path."""

import math

import numpy as np
import pytest

from tests.conftest import SCENES
from wrcore.analysis.contact.loaded import LoadedWheels, Rolling
from wrcore.contact.search import reduction as columns
from wrcore.equations.equations_of_motion import Equations
from wrcore.kernels.jit import jit
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene
from wrcore.wheels.force import press_wheels
from wrcore.wheels.motion import MOTION
from wrcore.wheels.surrogate_patch import bounded, without_power

MU, SPEED = 0.3, 40.0
POSES = [(-5e-3, 1e-3, 9e4), (-2e-3, 0.0, 5e4), (0.0, 3e-3, 6e4), (2e-3, -2e-3, 8e4), (3.5e-3, 1e-3, 4e4),
         (4.6e-3, 2e-3, 9e4)]  # fmt: skip
"""Lateral displacement (m), yaw (rad) and load (N) of a left wheel."""


def total(patches):
    """Normal force, and creep force along x, y and z, of patches."""
    rows = np.array([one.row for one in patches])
    cosine, sine, across = np.cos(rows[:, columns.ANGLE]), np.sin(rows[:, columns.ANGLE]), rows[:, columns.FY]
    force = np.array([rows[:, columns.FX].sum(), (across * cosine).sum(), (across * sine).sum()])
    return rows[:, columns.NORMAL].sum(), force


@pytest.mark.parametrize("rail", ["UIC60-MBench", "54E1"])
def test_forces_are_those_of_exact_contact(rail):
    geometry = load_scene(SCENES / "suspended_wheelset.yaml", {"rail": {"profile": rail}}).alike.geometry
    exact, surrogate = (LoadedWheels(geometry, name, "middle") for name in ("exact", "surrogate"))
    rolling = Rolling(SPEED, rate=SPEED / 0.46 * 1.0005, vy=0.02)
    for y, yaw, load in POSES:
        z = surrogate.height("left", y, load, 0.0, yaw)
        (n, f), (n_exact, f_exact) = (
            total(wheels.at_height("left", y, z, 0.0, yaw, rolling, MU)) for wheels in (surrogate, exact)
        )
        assert n == pytest.approx(n_exact, rel=4e-3), y
        np.testing.assert_allclose(f, f_exact, rtol=0.0, atol=0.012 * MU * n_exact)


@pytest.fixture(scope="module")
def wheels():
    model, start = compile_scene(load_scene(SCENES / "suspended_wheelset.yaml", {"contact.patch": "surrogate"}))
    equations = Equations(model)
    equations(0.0, start)
    return equations


@jit(allocates=False)
def copy_all(values, out):
    for i in range(values.shape[0]):
        for j in range(values.shape[1]):
            out[i, j] = values[i, j]


@jit(allocates=False)
def press_all(equations, motions, model, work, wrenches, patches, counts):
    for i in range(len(motions)):
        copy_all(motions[i], work.motions[0])
        press_wheels(model, work, 0)
        copy_all(work.rail_wrenches[0], wrenches[i])
        for side in range(2):
            copy_all(work.patches[0, side], patches[i, side])
            counts[i, side] = work.counts[0, side]


def pressed(equations, motions):
    """Wrenches (n, 2, 6), patches and counts of wheels in ``motions`` (n, 2, fields)."""
    n, work = len(motions), equations.work
    found = np.zeros((n, 2, 6)), np.zeros((n, *work.patches.shape[1:])), np.zeros((n, 2), np.int64)
    press_all(equations.arguments[0], motions, *equations.arguments[1:], *found)
    return found


def random_motions(equations, n, wild):
    """Motions of wheels pressed up to 0.3 mm into the rails, anywhere across them, creeping at random; ``wild``: with
    any velocities and friction."""
    random, motions = np.random.default_rng(11), np.tile(equations.work.motions[0], (n, 1, 1))
    yaw, roll = random.normal(0.0, 8e-3, n), random.normal(0.0, 2e-3, n)
    y, z = random.uniform(-9e-3, 9e-3, n), random.uniform(-3e-4, 0.0, n)
    speed = np.where(random.random(n) < 0.8, 40.0, random.uniform(-2.0, 2.0, n))
    creep = 10.0 ** random.uniform(-6.0, 0.0 if wild else -3.0, n)
    for side in range(2):
        row = motions[:, side]
        row[:, MOTION.y], row[:, MOTION.z] = row[:, MOTION.y] + y, row[:, MOTION.z] + z
        row[:, MOTION.ex], row[:, MOTION.ez] = -yaw, roll
        row[:, MOTION.ey] = np.sqrt(1.0 - yaw**2 - roll**2)
        row[:, MOTION.vx] = speed
        row[:, MOTION.wy] = speed / 0.46 * (1.0 + creep * random.normal(size=n))
        row[:, MOTION.vy] = creep * speed * random.normal(size=n)
        row[:, MOTION.wz] = 0.05 * random.normal(size=n)
        row[:, MOTION.friction] = random.uniform(0.01, 0.8, n) if wild else MU
    return motions


def test_forces_are_bounded_and_produce_no_power(wheels):
    motions = random_motions(wheels, 20000, True)
    wrenches, patches, counts = pressed(wheels, motions)
    assert np.isfinite(wrenches).all() and (counts > 0).mean() > 0.5
    there = np.arange(patches.shape[2]) < counts[..., None]
    rows = patches[there]
    limit = np.broadcast_to(motions[:, :, None, MOTION.friction], there.shape)[there] * rows[:, columns.NORMAL]
    assert (rows[:, columns.NORMAL] > 0.0).all()
    assert (np.hypot(rows[:, columns.FX], rows[:, columns.FY]) <= limit * (1.0 + 1e-9)).all()
    assert (np.abs(rows[:, columns.MZ]) < 1.5 * limit * rows[:, [columns.SEMI_A, columns.SEMI_B]].max(axis=1)).all()
    alone = np.broadcast_to((counts == 1)[..., None], there.shape)[there]  # others' friction makes a patch slip, too
    power = np.sum(rows[:, [columns.FX, columns.FY, columns.MZ]] * rows[:, [columns.XI, columns.ETA, columns.PHI]], 1)
    fast = np.broadcast_to(np.abs(motions[:, :, None, MOTION.vx]) > 0.1, there.shape)[there]
    assert (power[alone & fast] <= 1e-9 * limit[alone & fast]).all()


def test_wheel_that_rolls_back_is_the_mirror_image_along_the_track(wheels):
    motions = random_motions(wheels, 500, False)
    back = motions.copy()
    for field in (MOTION.ex, MOTION.vx, MOTION.wy, MOTION.wz):
        back[:, :, field] *= -1.0
    one, other = pressed(wheels, motions)[0], pressed(wheels, back)[0]
    signs = np.array([-1.0, 1.0, 1.0, 1.0, -1.0, -1.0])
    moving = motions[:, 0, MOTION.vx] != 0.0
    np.testing.assert_allclose(other[moving] * signs, one[moving], rtol=0.0, atol=1e-6)


def straight_motions(equations, n):
    """Motions of a wheelset that runs straight, its wheels pressed 50 um deeper than under their load, (n, 2, 15)."""
    motions = np.tile(random_motions(equations, 1, False)[0], (n, 1, 1))
    motions[:, :, [MOTION.y, MOTION.z]] = equations.work.motions[0][None, :, [MOTION.y, MOTION.z]] - [0.0, 5e-5]
    motions[:, :, MOTION.ex : MOTION.ez + 1] = [-2e-3, math.sqrt(1.0 - 4e-6), 0.0]
    return motions


def test_forces_do_not_jump_where_a_wheel_stops(wheels):
    motions = straight_motions(wheels, 201)
    motions[:, :, MOTION.vx] = np.linspace(-1e-3, 1e-3, 201)[:, None]
    motions[:, :, MOTION.wy] = 0.5  # it spins on the spot
    forces = pressed(wheels, motions)[0][:, 0, :3]
    assert np.abs(forces).max() > 1e4
    assert np.abs(np.diff(forces, axis=0)).max() < 2e-3 * np.abs(forces).max()


def test_wrench_is_smooth_along_a_path(wheels):
    step, motions = 2e-6, straight_motions(wheels, 1000)
    motions[:, :, MOTION.y] += (np.arange(1000)[:, None] - 500) * step
    normal = pressed(wheels, motions)[0][:, 0, 2]
    assert np.ptp(normal) > 0.01 * normal.mean()
    assert np.abs(np.diff(normal, 2)).max() < 2e-6 * normal.mean()


def test_bounded_leaves_small_values_and_never_reaches_the_bound():
    x = np.linspace(-30.0, 30.0, 2001)
    found = np.array([bounded(one, 2.0) for one in x])
    small = np.abs(x) <= 1.0
    np.testing.assert_array_equal(found[small], x[small])
    assert np.abs(found).max() < 2.0 and np.all(np.diff(found) > 0.0)
    assert bounded(math.nan, 2.0) == 0.0


def test_no_power_is_left_of_random_forces():
    for numbers in np.random.default_rng(5).normal(size=(2000, 6)):
        f1, f2, m3 = without_power(*numbers)
        x, y, spin = numbers[3:]
        assert f1 * x + f2 * y + m3 * spin <= 1e-12
        if numbers[0] * x + numbers[1] * y + numbers[2] * spin <= 0.0:
            assert (f1, f2, m3) == tuple(numbers[:3])
