"""The exact solver against CONTACT, against limits that are known, and against its own refinement."""

import numpy as np
import pytest

from wrcore.contact.rolling.ellipse import DEFAULT_LEVEL, RollingContact
from wrcore.contact.rolling.ellipse_influence import panel_counts, patch_panels, slip_matrix
from wrcore.creep.build import random_creepages
from wrcore.creep.kalker import kalker_coefficients, kalker_data

PATCHES = [(0.1, 0.0), (1.0, 0.0), (7.0, 0.0), (0.5, 0.6), (3.0, -0.9)]


def solve_reference(cases, level=DEFAULT_LEVEL):
    forces = np.empty_like(cases.forces)
    for i, (g, psi) in enumerate(zip(cases.g, cases.psi, strict=True)):
        forces[i] = RollingContact(g, psi, 0.28, level).solve_many(cases.creepages[i : i + 1])[0][0]
    return cases.errors(forces)


@pytest.mark.check
@pytest.mark.parametrize(
    "name, force_95, force_max, moment_95",
    [
        ("ellipse_cases", 0.003, 0.01, 0.003),
        ("sdec_cases", 0.003, 0.01, 0.004),
        ("extreme_cases", 0.005, 0.012, 0.004),
    ],
)
def test_agrees_with_contact(request, name, force_95, force_max, moment_95):
    """CONTACT's extrapolated values claim 0.2 % of mu N; ours at the default level add 0.1 to 0.2 %."""
    force, moment = solve_reference(request.getfixturevalue(name))
    assert np.percentile(force, 95) <= force_95
    assert force.max() <= force_max
    assert np.percentile(moment, 95) <= moment_95


def test_converges_faster_than_first_order():
    """Force error against a fine solution, mean over spin, pull and mixed cases: measured order 2.6.

    Without the shift of the slip to the load it is 1.2, so 1.9 tells the two apart.
    """
    creepages = np.array([[0.3, 0.0, 0.0], [0.2, -0.3, 0.3], [0.0, 0.1, 1.0], [-0.4, 0.2, -2.0], [0.05, 0.05, 0.05]])
    creepages = np.concatenate([creepages, creepages * [0.7, 1.3, 0.8], creepages * [-1.6, 0.6, 1.4]])
    levels = np.array([8, 11, 16, 22])
    errors = np.zeros(len(levels))
    for g, psi in ((0.4, 0.0), (1.0, 0.3), (2.5, 0.0)):
        fine = RollingContact(g, psi, 0.28, 40).solve_many(creepages, 1e-4)[0]
        for i, level in enumerate(levels):
            coarse = RollingContact(g, psi, 0.28, level).solve_many(creepages, 1e-4)[0]
            errors[i] += np.hypot(*(coarse - fine)[:, :2].T).mean()
    order = -np.polyfit(np.log(levels), np.log(errors), 1)[0]
    assert order > 1.9


DIRECTIONS = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [1, 0.2, 0.3], [-0.1, 1, 0.5]])


def saturation(g):
    """Creepages (6, 3), pure and mixed, whose linear force is about mu N."""
    c11, c22, c23, _ = kalker_coefficients(g, kalker_data(0.28))
    return DIRECTIONS / [c11, c22, c23]


@pytest.mark.parametrize("far", [1e-8, 1e-6, 1e-4])
@pytest.mark.parametrize("g", [0.1, 0.2, 0.5, 1.0, 3.0, 10.0])
def test_small_creepage_is_linear_theory(g, far):
    """Kalker's force within 0.3 % of it, his moment within 0.5 % (by creepage) and 1.5 % (by spin)."""
    c11, c22, c23, c33 = kalker_coefficients(g, kalker_data(0.28))
    expected = saturation(g) @ np.array([[-c11, 0, 0], [0, -c22, c23], [0, -c23, -c33]])
    error = RollingContact(g).solve_many(far * saturation(g))[0] / far - expected
    assert np.all(np.hypot(*error[:, :2].T) < 0.003 * np.hypot(*expected[:, :2].T))
    assert abs(error[1, 2]) < 0.005 * c23 / c22
    assert abs(error[2, 2]) < 0.015 * c33 / c23


@pytest.mark.parametrize("g, psi", [(0.1, 0.0), (1.0, 0.0), (10.0, 0.0), (0.5, 0.6)])
def test_error_is_relative_to_the_force(g, psi):
    """From 1e-8 to 1e3 of saturation within 0.3 % of the force of a solution thirty times as tight, and rising.

    Up to 1e-4 of it the solution is that of adhesion everywhere.
    """
    patch, last = RollingContact(g, psi, 0.28, 14), 0.0
    for far in (1e-8, 1e-6, 1e-5, 1e-4, 1e-3, 0.01, 0.03, 0.1, 0.3, 1.0, 10.0, 1e3):
        creepages = far * saturation(g)
        found, tight = (patch.solve_many(creepages, tolerance)[0] for tolerance in (1e-3, 3e-5))
        size = np.hypot(*tight[:, :2].T)
        assert np.all(np.hypot(*(found - tight)[:, :2].T) < 0.003 * size), far
        if far <= 1e-4:
            linear = creepages @ patch.linear_response().T
            assert np.all(np.hypot(*(found - linear)[:, :2].T) < 0.001 * size), far
        pull = np.hypot(*found[[0, 1, 3], :2].T)
        assert np.all(pull > last * (1 - 1e-5))
        last = pull


def test_number_of_iterations():
    """The start from adhesion saves a sixth of the iterations that one from slip needs (15 instead of 13, mean)."""
    for g in (0.1, 1.0, 5.0):
        rows = random_creepages(g, 200, kalker_data(0.28), np.random.default_rng(0))
        assert RollingContact(g, 0.0, 0.28, 16).solve_many(rows)[1].mean() < 14.5


@pytest.mark.parametrize("g, psi", PATCHES)
def test_fast_slip_is_coulomb(g, psi):
    """abs(F) = mu N, against the slip, and the spin moment is that of the rigid slip alone."""
    patch = RollingContact(g, psi, 0.28, 14)
    fx, fy, _ = patch.solve(3e6, -4e6, 0.0)
    assert (fx, fy) == pytest.approx((-0.6, 0.8), abs=1e-4)
    fx, fy, mz = patch.solve(0.0, 0.0, 1e8)
    op = patch.operator
    radius = np.hypot(op.x_force.astype(float), op.y.astype(float))
    assert mz == pytest.approx(-(op.bound * radius).sum(), abs=1e-3)


def test_joins_the_fast_slip_asymptote_without_a_step():
    """Beyond the largest creepage that is iterated the force continues (1e-4) and stays within mu N."""
    patch = RollingContact(1.0, 0.2, 0.28, 14)
    below, above = patch.solve(99.9999, 20.0, 30.0), patch.solve(100.0001, 20.0, 30.0)
    assert below == pytest.approx(above, abs=1e-4)
    assert np.hypot(*patch.solve(400.0, 80.0, 120.0)[:2]) <= 1 + 1e-6


@pytest.mark.parametrize("g, psi", PATCHES)
def test_symmetries(g, psi):
    """Turning all creepages round turns the force; mirroring y mirrors it (panels are the same, so only rounding)."""
    patch, mirror = RollingContact(g, psi, 0.28, 10), RollingContact(g, -psi, 0.28, 10)
    fx, fy, mz = patch.solve(0.21, -0.13, 0.4)
    assert patch.solve(-0.21, 0.13, -0.4) == pytest.approx((-fx, -fy, -mz), abs=2e-4)
    assert mirror.solve(0.21, 0.13, -0.4) == pytest.approx((fx, -fy, -mz), abs=2e-4)


def test_mirror_halves_equal_the_whole():
    """psi = 0 by halves and a vanishing psi through the whole matrix: one number by two routes."""
    halves, whole = RollingContact(0.6, 0.0, 0.3, 12), RollingContact(0.6, 1e-12, 0.3, 12)
    creepages = np.array([[0.2, 0.1, 0.3], [-0.3, 0.5, -1.0], [0.01, 0.0, 0.02]])
    assert halves.solve_many(creepages)[0] == pytest.approx(whole.solve_many(creepages)[0], abs=2e-4)


def test_many_at_once_equal_one_by_one():
    """The batch refills its rows; each case must come out as if alone, in its place."""
    creepages = np.random.default_rng(3).normal(size=(700, 3))
    patch = RollingContact(1.5, 0.4, 0.28, 8)
    together = patch.solve_many(creepages)[0]
    alone = np.array([patch.solve_many(row[None])[0][0] for row in creepages[::50]])
    assert together[::50] == pytest.approx(alone, abs=1e-4)


def test_all_cases_converge(extreme_cases):
    for g, psi, creepage in zip(extreme_cases.g, extreme_cases.psi, extreme_cases.creepages, strict=True):
        assert RollingContact(g, psi, 0.28, 12).solve_many(creepage[None])[1][0] > 0


def test_missed_tolerance_is_reported():
    assert RollingContact(1.0, 0.0, 0.28, 8).solve_many(np.array([[0.3, 0.2, 0.1]]), tolerance=1e-12)[1][0] < 0


@pytest.mark.parametrize("g, psi", PATCHES)
def test_panels_carry_the_load(g, psi):
    """Bounds sum to mu N; their first moments are those of the SDEC pressure, by quadrature."""
    panels = patch_panels(g, psi, 9, 12)
    b = 1 / np.sqrt(g)
    y = np.linspace(-b, b, 200001)
    t = y + psi * b
    load = np.maximum(1 - (t / (b * (1 + psi * np.sign(t)))) ** 2, 0)
    assert panels.bound.sum() == pytest.approx(1, abs=1e-12)
    assert panels.bound @ panels.y == pytest.approx(np.sum(load * y) / np.sum(load), abs=1e-8)
    assert panels.bound @ panels.x_force == pytest.approx(0, abs=1e-12)


def test_influence_matrix_is_the_kernel_far_away():
    """A distant panel acts like a point force: u_x = 1/pi (1/R - nu y^2/R^3), here as a slip difference (1 %)."""
    panels, nu = patch_panels(0.05, 0.0, 12, 24), 0.3
    axx, ayy, axy = slip_matrix(panels, nu)
    row, column = 4, 20 * 12 + 7
    x, y = panels.x_slip[row] - panels.x_force[column], panels.y[row] - panels.y[column]
    radius = np.hypot(x, y)
    gradient_xx = (-x / radius**3 + 3 * nu * y**2 * x / radius**5) / np.pi
    gradient_yy = (-x / radius**3 - 2 * nu * x / radius**3 + 3 * nu * x**3 / radius**5) / np.pi
    gradient_xy = nu * (y / radius**3 - 3 * x**2 * y / radius**5) / np.pi
    found = axx[row, column], ayy[row, column], axy[row, column]
    assert found == pytest.approx((-gradient_xx, -gradient_yy, -gradient_xy), rel=0.01)


def test_field_adds_up_and_obeys_friction():
    field = RollingContact(1.0, 0.3, 0.28, 14).field(0.2, 0.1, 0.4)
    area = (-np.diff(field.x_edges, axis=1) * np.diff(field.y_edges)[:, None]).ravel()
    assert (field.px * area).sum() == pytest.approx(field.fx, abs=1e-5)
    assert (field.py * area).sum() == pytest.approx(field.fy, abs=1e-5)
    assert (area * (field.x * field.py - field.y * field.px)).sum() == pytest.approx(field.mz, abs=1e-5)
    assert area.sum() == pytest.approx(np.pi, rel=0.02)  # strips of root-mean-square length are a little too long
    assert np.all(np.hypot(field.px, field.py) <= field.bound * (1 + 1e-5))
    assert 0.05 < field.stick.mean() < 0.95
    slip = np.hypot(field.sx, field.sy)
    assert slip[field.stick].max() < 1e-3 * slip.max()
    power = field.px * field.sx + field.py * field.sy
    assert np.all(power[~field.stick] < 0)
    cosine = power[~field.stick] / (np.hypot(field.px, field.py) * slip)[~field.stick]
    assert np.percentile(cosine, 90) < -0.999


@pytest.mark.parametrize("g", [0.03, 0.4, 1.0, 30.0])
def test_panel_counts_follow_the_level(g):
    """About level^2 panels, and an even number of strips, which the mirror needs."""
    for level in range(8, 40):
        n, ny = panel_counts(g, level)
        assert ny % 2 == 0 and n * ny == pytest.approx(level**2, rel=0.1)
