"""The creep table: accuracy, symmetry, limits, smoothness, and its life on disk."""

import os
from dataclasses import replace
from itertools import product

import h5py
import numpy as np
import pytest

from wrcore.contact.rolling.ellipse import RollingContact
from wrcore.creep import table as table_module
from wrcore.creep.axes import _atan2, _stretch, creepages_at, node_distances, table_lookup
from wrcore.creep.build import RESOLUTIONS, Resolution, axis_values, build_data, count_cases, random_errors, table_axes
from wrcore.creep.kalker import kalker_coefficients, kalker_data
from wrcore.creep.table import (
    DEFAULT_TOLERANCE,
    SHIPPED,
    build_table,
    ensure_table,
    load_table,
    table_info,
    table_path,
    write_table,
)
from wrcore.errors import InputError
from wrcore.kernels.jit import jit

TINY = Resolution(4, 4, 6, 8, 4, 6)


@jit
def look_up(table, g, psi, creepages, forces):
    outside = 0
    for i in range(g.size):
        xi, eta, phi = creepages[i]
        forces[i, 0], forces[i, 1], forces[i, 2], flag = table_lookup(table, np.log(g[i]), g[i], psi[i], xi, eta, phi)
        outside += flag
    return outside


def look(table, g, psi, creepages):
    """Forces (n, 3) for broadcast patches and creepages, and how many were out of range."""
    creepages = np.atleast_2d(np.asarray(creepages, float))
    forces, one = np.empty_like(creepages), np.ones(len(creepages))
    return forces, look_up(table, g * one, psi * one, creepages, forces)


@pytest.fixture(params=["ellipse", "sdec"])
def any_table(request):
    return request.getfixturevalue(f"{request.param}_table")


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """An empty cache, and one tiny resolution that is expected to be as good as can be."""
    monkeypatch.setenv("WRCORE_CACHE", str(tmp_path))
    tiny = {planes: ((1e-9, TINY),) for planes in RESOLUTIONS}
    monkeypatch.setattr(table_module, "RESOLUTIONS", tiny)
    monkeypatch.setattr(table_module, "CHECK_LEVEL", 6)
    return tmp_path


@pytest.mark.parametrize(
    "table, cases, median, quantile_99",
    [
        ("ellipse_table", "ellipse_cases", 0.001, 0.011),
        ("sdec_table", "ellipse_cases", 0.0015, 0.011),
        ("sdec_table", "sdec_cases", 0.002, 0.014),
    ],
)
def test_agrees_with_contact(request, table, cases, median, quantile_99):
    """Force error over mu N against CONTACT (itself about 0.1 %): the bounds the tables are designed for."""
    cases = request.getfixturevalue(cases)
    forces, outside = look(request.getfixturevalue(table), cases.g, cases.psi, cases.creepages)
    force, moment = cases.errors(forces)
    assert outside == 0
    assert np.median(force) <= median and np.percentile(force, 99) <= quantile_99
    assert np.median(moment) <= median and np.percentile(moment, 99) <= quantile_99


def test_five_inputs_are_counted(sdec_table, ellipse_table):
    assert count_cases(sdec_table.axes) == 75231
    assert sdec_table.coefficients.nbytes < 15e6 and ellipse_table.coefficients.nbytes < 4e6


def test_nodes_are_interpolated(any_table):
    """At a node the table gives the exact solution (float32 coefficients, iteration tolerance)."""
    axes = any_table.axes
    log_g, psi, t, alpha, beta = axis_values(axes)
    level = {1: 20, 4: 14}[axes.n_psi]
    for i, j, k, m, n in ((2, 0, 3, axes.n_alpha // 2 + 3, 0), (5, axes.n_psi - 1, 9, axes.n_alpha // 2 + 1, 4)):
        g = np.exp(log_g[i])
        w = creepages_at(g, t[k : k + 1], alpha[m : m + 1], beta[n : n + 1], any_table.kalker)
        exact = RollingContact(g, psi[j], 0.28, level).solve_many(w)[0]
        assert look(any_table, g, psi[j], w)[0] == pytest.approx(exact, abs=2e-4)


@pytest.mark.parametrize("g, psi", [(0.3, 0.0), (1.7, 0.5), (6.0, -0.8)])
def test_symmetries_are_exact(any_table, g, psi):
    psi = 0.0 if any_table.axes.n_psi == 1 else psi
    w = np.random.default_rng(0).normal(size=(50, 3))
    forces = look(any_table, g, psi, w)[0]
    assert np.array_equal(look(any_table, g, psi, -w)[0], -forces)
    assert look(any_table, g, -psi, w * [1, -1, -1])[0] == pytest.approx(forces * [1, -1, -1], abs=1e-6)
    if psi == 0:
        assert look(any_table, g, 0.0, w * [-1, 1, 1])[0] == pytest.approx(forces * [-1, 1, 1], abs=1e-6)
    else:
        assert np.array_equal(look(any_table, g, -psi, w * [1, -1, -1])[0], forces * [1, -1, -1])


def test_zero_creepage_is_exactly_zero(any_table):
    assert np.array_equal(look(any_table, 0.7, 0.0, [0.0, 0.0, 0.0])[0], np.zeros((1, 3)))


@pytest.mark.parametrize("size", [1e-9, 1e-6, 1e-4])
def test_small_creepage_is_kalkers(any_table, size):
    """Relative to the linear force. The law leaves its tangent in proportion to creepage over saturation, fastest

    (10 times) for the spin moment of a wide patch: mz is near its largest value at a spin phi' of 0.05/C23.
    """
    for g in (0.06, 0.3, 1.0, 3.3, 15.0):
        c11, c22, c23, c33 = kalker_coefficients(g, kalker_data(0.28))
        matrix = np.array([[-c11, 0, 0], [0, -c22, -c23], [0, c23, -c33]])
        w = size * np.concatenate([np.eye(3), np.random.default_rng(1).normal(size=(20, 3))]) / [c11, c22, c23]
        linear = w @ matrix.T
        error = np.abs(look(any_table, g, 0.0, w)[0] - linear).max(axis=1) / np.abs(linear).max(axis=1)
        assert error.max() < 1e-6 + 15 * size


@pytest.mark.parametrize("psi", [0.35, -0.7])
def test_small_creepage_of_a_skewed_patch(sdec_table, psi):
    """Against adhesion everywhere on the exact patch; 2 % of the largest entry (C33 at this level of the solver)."""
    for g in (0.4, 2.0):
        response = RollingContact(g, psi, 0.28, 20).linear_response()
        found = look(sdec_table, g, psi, 1e-6 * np.eye(3))[0].T / 1e-6
        assert abs(found - response).max() < 0.02 * abs(response).max()


@pytest.mark.parametrize("size", [1e3, 1e6, 1e30, 1e300])
def test_fast_slip_is_coulomb(any_table, size):
    """abs(F) = mu N opposite to the slip; interpolation error 1 %."""
    for g in (0.2, 1.0, 5.0):
        angle = np.linspace(0, 2 * np.pi, 29)
        direction = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
        forces = look(any_table, g, 0.0, size * direction)[0]
        assert np.all(np.isfinite(forces))
        assert abs(forces[:, :2] + direction[:, :2]).max() < 0.01


def test_force_stays_below_the_friction_limit(any_table):
    """Anywhere in range, up to interpolation error (5 % in the worst corner, 0.5 % in 99 of 100)."""
    rng = np.random.default_rng(2)
    g = np.exp(rng.uniform(np.log(0.05), np.log(20), 20000))
    psi = rng.uniform(-0.95, 0.95, 20000) if any_table.axes.n_psi > 1 else 0.0
    w = rng.normal(size=(20000, 3)) * np.exp(rng.uniform(-4, 4, 20000))[:, None]
    size = np.hypot(*look(any_table, g, psi, w)[0][:, :2].T)
    assert size.max() < 1.05 and np.percentile(size, 99) < 1.005


def test_out_of_range_is_flagged_and_clamped(any_table):
    w = [[0.2, 0.1, 0.3]]
    for g in (0.01, 100.0):
        forces, outside = look(any_table, g, 0.0, w)
        assert outside == 1
        assert forces == pytest.approx(look(any_table, min(max(g, 0.05), 20.0), 0.0, w)[0], abs=1e-12)
    psi_max = any_table.axes.psi_max
    forces, outside = look(any_table, 1.0, 0.99, w)
    assert outside == 1 and forces == pytest.approx(look(any_table, 1.0, psi_max, w)[0], abs=1e-12)
    assert look(any_table, 1.0, psi_max, w)[1] == 0


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_not_a_number_stays_so(any_table, bad):
    for position in range(5):
        values = [1.0, 0.0, 0.1, 0.2, 0.3]
        values[position] = bad
        forces, outside = look(any_table, values[0], values[1], [values[2:]])
        assert outside == 1 and np.all(np.isnan(forces))


def largest_jump_of_slope(table, points):
    """Largest change of the slope along a line of (g, psi, w) points, in proportion to the largest slope."""
    g, psi, w = points
    slope = np.diff(look(table, g, psi, w)[0], axis=0)
    return abs(np.diff(slope, axis=0)).max() / abs(slope).max()


def test_slope_is_continuous(any_table):
    """Along lines through many cells, through beta = 0, the pole of beta and the seam of alpha.

    With a continuous slope, its change from step to step shrinks with the step; across a kink it would not.
    """
    psi_end = 0.8 if any_table.axes.n_psi > 1 else 0.0
    for start, end in (
        ((0.3, -psi_end, [-0.6, -0.31, 0.4]), (5.0, psi_end, [0.7, 0.4, -0.5])),
        ((1.0, psi_end / 2, [-1e-3, 0.0, 0.9]), (1.0, psi_end / 2, [1e-3, 0.0, 0.9])),
        ((2.0, psi_end / 2, [-0.5, -0.01, 0.1]), (2.0, psi_end / 2, [-0.5, 0.01, 0.1])),
        ((2.0, psi_end / 2, [0.3, 0.4, -0.01]), (2.0, psi_end / 2, [0.3, 0.4, 0.01])),
    ):
        jumps = []
        for count in (2001, 32001):
            s = np.linspace(0, 1, count)
            g = start[0] * (end[0] / start[0]) ** s
            w = np.outer(1 - s, start[2]) + np.outer(s, end[2])
            jumps.append(largest_jump_of_slope(any_table, (g, (1 - s) * start[1] + s * end[1], w)))
        assert jumps[1] < 0.1 * jumps[0] and jumps[1] < 1e-3


def test_slope_is_steady_beside_the_spin_axis(any_table):
    """Lines past the pole of (alpha, beta) at a thousandth of the spin, at twelve patches and spins, four directions.

    The slope within 0.5 % of the spin, without its linear trend, varies by 3 % at most (0.5 % in the median); plain
    interpolation in polar inputs makes that 75 % (4 %).
    """
    wiggles = []
    for g, phi, turn in product((0.1, 0.3, 1.3, 4.0), (0.1, 0.3, 1.0), (0.0, 0.5, 1.0, 1.57)):
        x = np.linspace(-0.005, 0.005, 801) * phi
        along, beside = np.array([np.cos(turn), np.sin(turn), 0]), np.array([-np.sin(turn), np.cos(turn), 0])
        w = np.outer(x, along) + 1e-3 * phi * beside + [0, 0, phi]
        slope = np.gradient(look(any_table, g, 0.0, w)[0][:, :2], x, axis=0)[1:-1]
        trend = np.polynomial.polynomial.polyfit(x[1:-1], slope, 1)
        rest = slope - trend[0] - np.outer(x[1:-1], trend[1])
        wiggles.append(np.ptp(rest, axis=0).max() / np.linalg.norm(slope, axis=1).max())
    assert max(wiggles) < 0.04 and np.median(wiggles) < 0.01


def test_coordinates():
    """The own atan2 is accurate, has no step at 45 degrees; the stretched distance inverts."""
    angle = np.linspace(-np.pi, np.pi, 4001)[1:-1]
    found = np.array([_atan2(np.sin(a), np.cos(a)) for a in angle])
    assert abs(found - angle).max() < 2e-8
    assert abs(_atan2(1.0, 1 + 1e-12) - _atan2(1 + 1e-12, 1.0)) < 2e-12
    positions = np.array([_stretch(t) for t in node_distances(17)])
    assert positions == pytest.approx(np.linspace(0, 1, 17), abs=1e-6)


def test_finer_table_is_better():
    """Error at points between the nodes falls with the node count at one level of the solver (interpolation alone)."""
    rng, errors = np.random.default_rng(4), []
    patches = np.exp(rng.uniform(np.log(0.1), np.log(10), 12))
    w = rng.normal(size=(40, 3)) * np.exp(rng.uniform(-2, 1, 40))[:, None]
    exact = [RollingContact(g, 0.0, 0.28, 10).solve_many(w)[0] for g in patches]
    for resolution in (Resolution(5, 1, 7, 12, 6, 10), Resolution(9, 1, 13, 24, 11, 10)):
        data = build_data(0.28, "ellipse", resolution)
        difference = [look(data, g, 0.0, w)[0] - force for g, force in zip(patches, exact, strict=True)]
        errors.append(abs(np.array(difference)).mean())
    assert errors[1] < 0.3 * errors[0]


def test_table_survives_the_disk(cache, tmp_path):
    built = build_table(0.3, "sdec", 0.5)
    write_table(tmp_path / "deep" / "t.h5", built)
    read = load_table(tmp_path / "deep" / "t.h5")
    assert np.array_equal(read.data.coefficients, built.data.coefficients)
    assert read.data.axes == built.data.axes and read.force_error == built.force_error
    assert table_info(read) == table_info(built)
    assert os.listdir(tmp_path / "deep") == ["t.h5"]


def test_a_file_is_read_once_and_anew_when_it_changes(cache, tmp_path):
    path = tmp_path / "table.h5"
    write_table(path, ensure_table(0.28))
    table, reads = load_table(path), table_module._read_table.cache_info().misses
    same, kept = load_table(path), table.data.coefficients.copy()
    assert table_module._read_table.cache_info().misses == reads
    same.data.coefficients[:] = 0.0
    np.testing.assert_array_equal(load_table(path).data.coefficients, kept)
    write_table(path, replace(table, tolerance=0.5))
    assert load_table(path).tolerance == 0.5
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(InputError, match="table.h5"):
        load_table(path)
    path.unlink()
    with pytest.raises(InputError, match="table.h5"):
        load_table(path)


def test_ensure_builds_once(cache, monkeypatch):
    first = ensure_table(0.28, "ellipse", 0.5)
    assert table_path(0.28, "ellipse", 0.5).is_file()
    monkeypatch.setattr(table_module, "build_data", None)
    again = ensure_table(0.28, "ellipse", 0.5)
    assert np.array_equal(first.data.coefficients, again.data.coefficients)


def test_the_default_table_comes_with_the_package(cache, monkeypatch):
    monkeypatch.setattr(table_module, "build_data", None)
    name = table_path(0.28, "ellipse", DEFAULT_TOLERANCE).name
    assert [path.name for path in SHIPPED.iterdir()] == [name], f"expected: wrcore table build --out {SHIPPED / name}"
    table = ensure_table()
    assert (table.nu, table.planes, table.tolerance) == (0.28, "ellipse", DEFAULT_TOLERANCE)
    assert table.resolution in [resolution for _, resolution in RESOLUTIONS["ellipse"]]
    assert not list(cache.rglob("*.h5"))


def test_the_default_table_is_that_of_the_solver():
    table = ensure_table()
    force, _ = random_errors(table.data, table.resolution.level, patches=6, per_patch=20, seed=7)
    assert np.percentile(force, 99) < DEFAULT_TOLERANCE and np.median(force) < 2.0 * table.force_error[0]


def test_entries_of_the_default_table_are_built_anew():
    """Where this fails, tables have other numbers than `FORM` says: count it up and build the default table anew."""
    table, random = ensure_table(), np.random.default_rng(5)
    axes, kalker = table.data.axes, table.data.kalker
    log_g, _, t, alpha, beta = axis_values(axes)
    for k in (1, axes.n_g // 2, axes.n_g - 2):
        g = np.exp(log_g[k])
        places = [random.choice(values, 12) for values in (t[1:-1], alpha, beta[: axes.n_beta // 2])]
        creepages = creepages_at(g, *places, kalker)
        exact, _ = RollingContact(g, 0.0, table.nu, table.resolution.level).solve_many(creepages)
        found = [table_lookup(table.data, log_g[k], g, 0.0, *creepage)[:3] for creepage in creepages]
        errors = np.abs(np.array(found) - exact)
        assert np.median(errors) < 2e-6 and errors.max() < 1e-4  # the spin axis is felt by all of a spline


def test_cache_is_keyed_by_everything(cache, monkeypatch):
    paths = {table_path(*key) for key in ((0.28, "ellipse", 0.5), (0.3, "ellipse", 0.5), (0.28, "sdec", 0.5))}
    paths |= {table_path(0.28, "ellipse", 0.4)}
    monkeypatch.setattr(table_module, "FORM", 0)
    assert len(paths | {table_path(0.28, "ellipse", 0.5)}) == 5


def test_killed_write_leaves_nothing_behind(cache, tmp_path, monkeypatch):
    """A failure while writing leaves the target as it was and no temporary file."""
    built = build_table(0.28, "ellipse", 0.5)
    write_table(tmp_path / "t.h5", built)
    before = (tmp_path / "t.h5").read_bytes()

    def fail(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(h5py.Group, "create_dataset", fail)
    with pytest.raises(KeyboardInterrupt):
        write_table(tmp_path / "t.h5", built)
    assert (tmp_path / "t.h5").read_bytes() == before and len(list(tmp_path.glob("*t.h5*"))) == 1


def test_refines_until_the_tolerance_is_met(cache, monkeypatch):
    better = Resolution(7, 1, 10, 16, 8, 6)
    monkeypatch.setattr(table_module, "RESOLUTIONS", {"ellipse": ((0.001, TINY), (0.001, better))})
    assert build_table(0.28, "ellipse", 0.9).resolution == TINY
    fine = build_table(0.28, "ellipse", 0.04)
    assert fine.resolution == better and fine.force_error[2] < 0.04


def test_hopeless_resolutions_are_skipped(cache, monkeypatch):
    better = Resolution(7, 1, 10, 16, 8, 6)
    monkeypatch.setattr(table_module, "RESOLUTIONS", {"ellipse": ((0.5, TINY), (0.001, better))})
    assert build_table(0.28, "ellipse", 0.4).resolution == better


def test_same_build_gives_the_same_numbers():
    one, two = (build_data(0.28, "sdec", TINY) for _ in range(2))
    assert np.array_equal(one.coefficients, two.coefficients)


def test_progress_sees_all_patches():
    seen = []
    build_data(0.28, "sdec", TINY, progress=lambda items: seen.extend(items) or items)
    axes = table_axes("sdec", TINY)
    assert len(seen) == axes.n_g * axes.n_psi


@pytest.mark.parametrize(
    "arguments, message",
    [
        ((0.6, "ellipse", 0.01), "nu: expected a number, at least 0 and at most 0.5, got 0.6"),
        ((0.28, "oval", 0.01), "planes: expected one of ellipse, sdec, got 'oval'"),
        ((0.28, "ellipse", 0.0), "tolerance: expected a fraction"),
        ((0.28, "ellipse", float("nan")), "tolerance: expected a number, finite, got nan"),
    ],
)
def test_impossible_tables_are_refused(cache, arguments, message):
    with pytest.raises(InputError, match=message):
        ensure_table(*arguments)


def test_foreign_files_are_refused(tmp_path):
    (tmp_path / "text.h5").write_text("no table")
    for path in (tmp_path / "text.h5", tmp_path / "absent.h5"):
        with pytest.raises(InputError, match="expected a creep table in HDF5"):
            load_table(path)


@pytest.mark.parametrize("far", [1e-8, 1e-6, 1e-5, 1e-4])
def test_small_creepage_is_linear_theory(far):
    """The package's own table within 0.5 % of Kalker's force, creepages in parts of saturation, also mixed."""
    table = ensure_table()
    directions = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [1, 0.2, 0.3], [-0.1, 1, 0.5]])
    for g in (0.1, 0.3, 1.0, 3.0, 10.0):
        c11, c22, c23, _ = kalker_coefficients(g, table.data.kalker)
        w = far * directions / [c11, c22, c23]
        expected = np.stack([-c11 * w[:, 0], -c22 * w[:, 1] - c23 * w[:, 2]], axis=1)
        error = look(table.kernel_data(), g, 0.0, w)[0][:, :2] - expected
        assert np.all(np.hypot(*error.T) < 0.005 * np.hypot(*expected.T)), g
