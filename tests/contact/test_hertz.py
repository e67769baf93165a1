"""Hertz and the damping factor against published tables and exact limits."""

import math

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipe, ellipk

from tests.conftest import DATA
from wrcore.contact.hertz import (
    contact_modulus,
    damping_factor,
    hertz_ellipse,
    hertz_shape,
    hertz_shape_at,
    hertz_table,
    inverse_cube_root,
)

# Classical coefficients m, n, r over cos(theta) = (B - A)/(A + B), three decimals (Hertz).
MNR = [
    (80, 1.128, 0.893, 0.993), (70, 1.285, 0.800, 0.973), (60, 1.486, 0.717, 0.938), (50, 1.754, 0.641, 0.887),
    (40, 2.136, 0.567, 0.818), (30, 2.731, 0.493, 0.726), (20, 3.816, 0.412, 0.604), (10, 6.612, 0.311, 0.428),
]  # fmt: skip
# Goldsmith's stiffness factor q_k over A/B, from the elliptic integrals.
GOLDSMITH = [(1.0, 0.3183), (0.7041, 0.3216), (0.4903, 0.3318), (0.2174, 0.3812), (0.0718, 0.5142), (0.00765, 1.1370)]


@pytest.mark.parametrize(("theta", "m", "n", "r"), MNR)
def test_semi_axes_match_the_classical_table(theta, m, n, r):
    cosine = math.cos(math.radians(theta))
    stiffness, a, b = hertz_ellipse(hertz_table(), 0.5 * (1 - cosine), 0.5 * (1 + cosine))  # A + B = 1
    ours_r = (0.75 * stiffness) ** (-2 / 3)
    assert a * math.sqrt(ours_r) == pytest.approx(m, abs=6e-4)  # half of the table's last digit
    assert b * math.sqrt(ours_r) == pytest.approx(n, abs=6e-4)
    assert ours_r == pytest.approx(r, abs=6e-4)


@pytest.mark.parametrize(("ratio", "q"), GOLDSMITH)
def test_stiffness_matches_goldsmith(ratio, q):
    # K = (4/3) q / ((h_w + h_r) sqrt(A + B)) with h = (1 - nu^2)/(pi E), so h_w + h_r = 1/(pi E*)
    curvature = 1.0 + ratio
    stiffness, _, _ = hertz_ellipse(hertz_table(), ratio, 1.0)
    assert stiffness == pytest.approx(4 / 3 * q * math.pi / math.sqrt(curvature), rel=5e-4)


@pytest.mark.parametrize("ratio", [1.0, 1.0 + 1e-9, 1.5, 37.0, 1e3, 1e5])
def test_table_reproduces_the_exact_solution(ratio):
    p_large, p_small, k = hertz_shape(ratio)
    for A, B, (p_x, p_y) in ((1.0, ratio, (p_large, p_small)), (ratio, 1.0, (p_small, p_large))):
        stiffness, a, b = hertz_ellipse(hertz_table(), A, B)
        root = math.sqrt(A + B)
        assert stiffness * root == pytest.approx(4 / 3 * k, rel=2e-8)
        assert a * root == pytest.approx(p_x, rel=2e-8)
        assert b * root == pytest.approx(p_y, rel=2e-8)


def test_shape_satisfies_hertz_equations():
    # Johnson (1985) Eqs. (4.28)-(4.32), put in directly: curvature ratio, total curvature and approach.
    for ratio in (2.0, 30.0, 900.0):
        p, q, k = hertz_shape(ratio)
        flat = (q / p) ** 2
        big_k, big_e = ellipk(1 - flat), ellipe(1 - flat)
        assert (big_e / flat - big_k) / (big_k - big_e) == pytest.approx(ratio, rel=1e-9)
        force = 4 / 3 * k  # E* = 1, A + B = 1, delta = 1
        p0 = 3 * force / (2 * math.pi * p * q)
        assert p0 * q * big_k == pytest.approx(1.0, rel=1e-12)  # delta = (p0/E*) b K(e)


def test_benchmark_value_at_contacts_own_point(s1002):
    # Facts 4.2: curvatures of S1002 and R300 at y_w = 1.873 mm, 9997 N: Hertz delta 0.01619 mm and p_max 322 MPa.
    slope, second = s1002(1.873e-3, 1), s1002(1.873e-3, 2)
    radius = 0.46 - s1002(1.873e-3)
    A = 0.5 / (radius * math.hypot(1.0, slope))
    B = 0.5 * (second / math.hypot(1.0, slope) ** 3 + 1 / 0.3)
    stiffness, a, b = hertz_ellipse(hertz_table(), A, B)
    delta = (9997 / (contact_modulus(8.2e10, 0.28) * stiffness)) ** (2 / 3)
    assert delta == pytest.approx(0.01619e-3, rel=1e-3)
    assert 1.5 * 9997 / (math.pi * a * b * delta) == pytest.approx(322e6, rel=2e-3)


def test_shipped_examples_of_contact():
    # CONTACT solves them on elements of a twentieth to a fiftieth of the patch: 0.1 % in the approach, 0.2 % in p_max.
    table = pd.read_csv(DATA / "contact" / "contact_hertz.csv", comment="#")
    assert len(table) == 6
    for row in table.itertuples():
        stiffness, a, b = hertz_ellipse(hertz_table(), row.A_per_m, row.B_per_m)
        approach = (row.N_N / (contact_modulus(row.G_Pa, row.nu) * stiffness)) ** (2 / 3)
        assert approach == pytest.approx(row.approach_m, rel=1.2e-3), row.example
        assert 1.5 * row.N_N / (math.pi * a * b * approach) == pytest.approx(row.p_max_Pa, rel=2e-3), row.example
        if row.a_m == row.a_m:  # printed
            assert (a * math.sqrt(approach), b * math.sqrt(approach)) == pytest.approx((row.a_m, row.b_m), rel=5e-4)


def test_damping_factor_is_smooth_and_never_pulls():
    speed = np.linspace(-0.2, 0.2, 4001)
    factor = np.array([damping_factor(s, 0.6, 0.05) for s in speed])
    assert factor.min() == pytest.approx(0.6) and factor.max() == pytest.approx(1.0)
    assert damping_factor(0.0, 0.6, 0.05) == pytest.approx(0.8)  # (1 + c_e)/2
    slope = np.gradient(factor, speed)
    # C1: the slope changes between neighbours by no more than its Lipschitz constant 1.5 (1 - c_e)/v0^2 * spacing
    assert np.abs(np.diff(slope)).max() < 1.05 * 1.5 * 0.4 / 0.05**2 * (speed[1] - speed[0])


@pytest.mark.parametrize("c_e", [0.5, 0.7, 0.9])
def test_restitution_of_a_fast_impact(c_e):
    # A mass on K delta^1.5 c_d with v0 much smaller than the impact speed: restitution sqrt(c_e).
    K, mass, v0, impact = 1e9, 50.0, 1e-4, 0.5

    def motion(t, state):
        delta, rate = state
        return [rate, -K * max(delta, 0.0) ** 1.5 * damping_factor(rate, c_e, v0) / mass]

    def leaves(t, state):
        return state[0]

    leaves.terminal, leaves.direction = True, -1
    run = solve_ivp(motion, (0, 1), [0.0, impact], events=leaves, rtol=1e-10, atol=1e-12, max_step=1e-5)
    assert -run.y[1, -1] / impact == pytest.approx(math.sqrt(c_e), abs=2e-3)


def test_inverse_cube_root_is_exact_to_rounding():
    for x in [1.0, 0.9999999, *np.linspace(0.2, 1.0, 401), 0.1999999, 0.05, 1e-6]:
        assert inverse_cube_root(x) == pytest.approx(x ** (-1 / 3), rel=5e-16)


@pytest.mark.parametrize("ratio", [1.0, 1.7, 37.0, 1e4])
def test_tabulated_log_of_the_axis_ratio(ratio):
    # 1e-9: what the tables' interpolation leaves
    for A, B in ((1.0, ratio), (ratio, 1.0)):
        _, a, b, log_axis_ratio = hertz_shape_at(hertz_table(), A, B)
        assert log_axis_ratio == pytest.approx(math.log(a / b), abs=1e-9)
