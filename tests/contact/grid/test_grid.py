"""Reference contact on a grid: normal problem against Hertz and CONTACT."""

import math

import numpy as np
import pytest

from tests.contact.patch import contact_reference as contact
from wrcore.contact.grid.grid import contact_window, grid_normal
from wrcore.contact.grid.pressure import solve_pressure
from wrcore.contact.hertz import contact_modulus, hertz_ellipse, hertz_table
from wrcore.contact.search.strip import make_pose
from wrcore.contact.search.surfaces import contact_plane, surface_gap, surface_slip

MODULUS = contact_modulus(contact.SHEAR_MODULUS, contact.POISSON_RATIO)


def hertz(A, B, delta, n, margin=1.12):
    """Grid solution of a parabolic gap: x, s, element sizes, pressure, and Hertz's force, p0, a, b."""
    stiffness, a, b = hertz_ellipse(hertz_table(), A, B)
    a, b = a * math.sqrt(delta), b * math.sqrt(delta)
    dx, ds = 2 * margin * a / n, 2 * margin * b / n
    x, s = ((np.arange(n) + 0.5) * step - margin * half for step, half in ((dx, a), (ds, b)))
    pressure = np.empty((n, n))
    steps = solve_pressure(A * x[:, None] ** 2 + B * s**2 - delta, dx, ds, MODULUS, 1e-7, pressure)
    assert steps > 0
    force = MODULUS * stiffness * delta**1.5
    return x, s, dx, ds, pressure, force, 1.5 * force / (math.pi * a * b), a, b


@pytest.mark.parametrize(("A", "B"), [(1.1, 1.1), (1.1, 3.0), (1.1, 25.0), (30.0, 1.1)])
def test_hertz_force_and_pressure(A, B):
    # measured: force 8.7e-5, pressure 4e-4 (the average over an element)
    x, s, dx, ds, pressure, force, p0, a, b = hertz(A, B, 5e-5, 48)
    assert pressure.sum() * dx * ds == pytest.approx(force, rel=2e-4)
    assert pressure.max() == pytest.approx(p0, rel=6e-4)
    inside = (x[:, None] / a) ** 2 + (s / b) ** 2
    exact = p0 * np.sqrt(np.maximum(1.0 - inside, 0.0))
    np.testing.assert_allclose(pressure[inside < 0.8], exact[inside < 0.8], rtol=3e-3)
    assert np.all(pressure[inside > 1.1] == 0.0)


def test_force_converges_faster_than_linearly():
    # elements at the edge belong to the contact or not: between first and second order, not smoothly
    errors = []
    for n in (12, 24, 48, 96):
        _, _, dx, ds, pressure, force, *_ = hertz(1.0, 2.0, 5e-5, n)
        errors.append(abs(pressure.sum() * dx * ds / force - 1.0))
    order = math.log2(errors[0] / errors[3]) / 3
    assert order > 1.1 and errors[3] < 1e-4


def test_conditions_of_contact_hold_with_a_gap_between_lobes():
    x, s = np.linspace(-4e-3, 4e-3, 24), np.linspace(-8e-3, 8e-3, 64)
    gap = x[:, None] ** 2 + 4e4 * (s**2 - 25e-6) ** 2 * 25.0 - 2e-5
    pressure = np.empty(gap.shape)
    assert solve_pressure(gap, x[1] - x[0], s[1] - s[0], MODULUS, 1e-8, pressure) > 0
    assert np.all(pressure >= 0.0) and np.all(pressure[gap > 0.0] == 0.0)
    touching = np.flatnonzero(pressure.any(axis=0))
    assert np.diff(touching).max() > 5  # two lobes
    np.testing.assert_allclose(pressure, pressure[:, ::-1], atol=1e-5 * pressure.max())


def test_nothing_where_nothing_overlaps(benchmark_pair):
    pressure = np.ones((4, 4))
    assert solve_pressure(np.full((4, 4), 1e-6), 1e-4, 1e-4, MODULUS, 1e-6, pressure) == 0
    assert not pressure.any()
    pose = make_pose(1.0, 0.0, 0.461, 0.0, 1.0, 0.0, True)
    patch = grid_normal(benchmark_pair, pose, contact_plane(0.0, 0.75, 0.0, 0.03), MODULUS, 16, 16)
    assert not patch.pressure.any()


def grid_solver(nx, ns, with_height=False):
    """A solver for `contact.compare`."""

    def solve(case, geometry):
        patch = grid_normal(geometry, case.pose, case.plane, MODULUS, nx, ns)
        z = contact.height_at_normal(lambda z: force_at(case, geometry, z, nx, ns), case) if with_height else math.nan
        return contact.Outcome(force(patch), patch.pressure.max(), contact_window(patch, 0.0)[0], z_equal=z)

    return solve


def force(patch):
    return patch.pressure.sum() * patch.dx * patch.ds


def force_at(case, geometry, z, nx, ns):
    return force(grid_normal(geometry, case.pose_at(z), case.plane, MODULUS, nx, ns))


def some_cases(name, every=1):
    """Cases of a set that are heavy and not blended, or a skip."""
    found = [c for c in contact.cases(name) if c.name not in contact.BLENDED and not c.subset.startswith("light")]
    if not found or contact.geometry(name) is None:
        pytest.skip(f"{name}.csv or its profiles are not distributed with the project and not present here")
    return found[::every]


@pytest.mark.parametrize(("name", "height"), [("mbench_contact", 1.2e-7), ("loaded_partial_slip", 1.5e-7)])
def test_normal_contact_of_s1002_on_uic60_agrees_with_contact(benchmark_pair, name, height):
    # 32 x 48 elements. Measured: heights 5 nm (median), 116 nm (flange: 46 nm with its own profile points); force at
    # CONTACT's height 0.02 %, 0.2 % (95 %); greatest pressure 0.7 % (95 %, two lobes, sharp crests), 0.16 % at 10 kN
    table = contact.compare(grid_solver(32, 48, with_height=True), some_cases(name), benchmark_pair)
    found = contact.summary(table)
    assert found.loc["height", "median"] < 1e-8 and found.loc["height", "max"] < height
    assert found.loc["normal", "median"] < 4e-4 and found.loc["normal", "max"] < 5e-3
    assert found.loc["p_max", "median"] < 1e-3 and found.loc["p_max", "q95"] < 1e-2
    assert found.loc[["x_min", "x_max", "s_min", "s_max"], "max"].max() < 5e-4  # CONTACT's and our elements


def test_heights_agree_to_nanometres_with_the_profiles_that_contact_was_given():
    # measured: 4 nm (median), 46 nm (max)
    cases, geometry = some_cases("loaded_partial_slip", every=4), contact.geometry("loaded_partial_slip", True)
    if geometry is None:
        pytest.skip("MBench_*.prw and .prr are not distributed with the project and not present here")
    found = contact.summary(contact.compare(grid_solver(32, 48, with_height=True), cases, geometry))
    assert found.loc["height", "median"] < 8e-9 and found.loc["height", "max"] < 6e-8


def test_normal_contact_of_a_worn_wheel_agrees_with_contact():
    cases = some_cases("worn_on_uic60")
    table = contact.compare(grid_solver(32, 48, with_height=True), cases, contact.geometry("worn_on_uic60"))
    found = contact.summary(table)
    assert found.loc["height", "max"] < 2e-8 and found.loc["normal", "max"] < 5e-4
    assert found.loc["p_max", "median"] < 1e-3 and found.loc["p_max", "max"] < 2e-2


def test_gap_lies_between_points_of_both_surfaces(benchmark_pair, s1002, uic60):
    # points of the wheel's own definition and of the rail, at random places of a plane
    case = next(c for c in contact.cases("mbench_contact") if c.yaw != 0.0 and abs(c.y) > 5.5e-3 and c.side == "right")
    x, s = np.linspace(-6e-3, 6e-3, 5), np.linspace(-2e-3, 2e-3, 4)
    gap, height = np.empty((5, 4)), np.empty((5, 4))
    plane, pose = case.plane, case.pose
    surface_gap(benchmark_pair, pose, plane, x, s, gap, height)
    for n, kind in ((height, "wheel"), (height - gap, "rail")):
        px = plane.x + x[:, None] + 0.0 * s
        py = plane.y + s * plane.cosine - n * plane.sine
        pz = plane.z + s * plane.sine + n * plane.cosine
        if kind == "rail":
            u = pose.side * py - benchmark_pair.rail_distance
            np.testing.assert_allclose(pz, uic60(u), atol=1e-11)
            continue
        r = np.stack([px, py - pose.y, pz - pose.z], axis=-1)
        along = r @ np.array([pose.ex, pose.ey, pose.ez])
        radius = np.sqrt((r**2).sum(axis=-1) - along**2)
        np.testing.assert_allclose(radius, 0.46 - s1002(along - 0.75), atol=1e-11)


def test_creepages_of_contact_are_the_slip_of_the_wheels_surface():
    # the wheel's undeformed surface at the reference point lies lower than the rail's by the approach
    cases = contact.cases("loaded_partial_slip") + contact.cases("worn_on_uic60") or some_cases("mbench_contact")
    if math.isnan(cases[0].xi):
        pytest.skip("loaded_partial_slip.csv is not distributed with the project and not present here")
    origin = np.zeros(1)
    for case in cases:
        wx, ws = np.empty((1, 1)), np.empty((1, 1))
        height = np.full(1, -case.approach)
        surface_slip(case.pose, case.plane, case.motion, origin, origin, height, 0.0 * height, wx, ws)
        assert (wx[0, 0], ws[0, 0]) == pytest.approx((case.xi, case.eta), abs=2e-10)
