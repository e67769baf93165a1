"""The Test Set's "Wheelset": its formulas as published against the kernels, and its reference solution at 10 s."""

import json
import math

import numpy as np
import pytest

from study.ivp.figures import METHOD_STYLES, fig_ivp_constraints, fig_ivp_work_precision
from study.ivp.problem import read_problem, workspace
from study.ivp.runs import PROJECTED, error_of, solve, stabilisation_table, value_table, violation_history
from study.ivp.runs import work_precision as work_precision_table
from study.ivp.wheelset import project, right_hand_side
from tests.conftest import ROOT
from wrcore.errors import InputError

FILE = ROOT / "config" / "benchmarks" / "ivp_wheelset.json"
BAR = 1e-6  # m, error of x at 10 s
ADAPTER = "scipy_dop853"
MOVING = np.array([4e-3, 5e-6, -4e-5, 0.011, -1.3e-3, 0.06, 2e-4, -3e-3, 0.21, 0.017, 0.3])


@pytest.fixture(scope="module")
def problem():
    return read_problem(FILE)


def evaluated(problem, state, **feedback):
    """Rate at a state, and what the evaluation leaves behind."""
    work = workspace(problem)
    return right_hand_side(problem.wheelset._replace(**feedback), work)(0.0, state), work


def wheel_published(p, k, state, contact):
    """Contact conditions, gap, its gradient and the angle of the contact plane, in the Test Set's own terms."""
    x, y, _, theta, phi = state[:5]
    psi, xi = contact
    st, ct, sp, cp, s, c = (f(angle) for angle in (theta, phi, psi) for f in (math.sin, math.cos))
    tangent = math.tan(p.cone_angle)
    radius, taper = p.radius + tangent * (p.half_distance - abs(xi)), -np.sign(xi) * tangent
    lateral = x + xi * ct * cp + radius * (ct * sp * c - st * s)
    a = abs(lateral) - p.half_distance - p.rail_radius * math.sin(p.cone_angle)
    root = math.sqrt(p.rail_radius**2 - a**2)
    g, g1 = root - p.radius - p.rail_radius * math.cos(p.cone_angle), -np.sign(lateral) * a / root
    conditions = (
        g1 * (taper * sp + cp * c) + taper * ct * cp - ct * sp * c + st * s,
        taper * st * cp - st * sp * c - ct * s,
    )
    gap = g - y - xi * sp + radius * cp * c
    gradient = np.array([
        g1, -1.0, 0.0, g1 * (radius * (-ct * s - c * sp * st) - cp * st * xi),
        -radius * c * sp - xi * cp + g1 * (radius * cp * c * ct - xi * ct * sp),
    ])  # fmt: skip
    below = (-taper * sp - cp * c) if k == 0 else (taper * sp + cp * c)
    angle = math.atan(((taper * cp - sp * c) * ct + st * s) / below)
    return conditions, gap, gradient, angle, (radius, taper, g1, -(p.rail_radius**2) / root**3)


def creep_published(p, k, state, contact, angle, profile, normal):
    """Force of wheel k on x, y, z, theta, phi, beta."""
    _, _, _, theta, phi, vx, vy, vz, yaw, roll, beta = state
    (psi, xi), (radius, taper, g1, g2) = contact, profile
    side, spin = 1.0 - 2.0 * k, p.speed / p.radius + beta
    st, ct = math.sin(theta / math.cos(angle)), math.cos(theta / math.cos(angle))
    sp, cp, s, c, sd, cd = (f(value) for value in (phi, psi, angle) for f in (math.sin, math.cos))
    k1 = (
        -spin * radius * (st * c + ct * sp * s) + vx - yaw * (radius * (st * sp * c + ct * s) + xi * st * cp)
        - roll * ct * (xi * sp - radius * cp * c)
    )  # fmt: skip
    k2 = spin * radius * cp * s + vy + roll * (xi * cp + radius * sp * c)
    k3 = (
        -spin * radius * (ct * c - st * sp * s) + p.speed + vz
        - yaw * (xi * ct * cp + radius * (ct * sp * c - st * s)) + roll * st * (xi * sp - radius * cp * c)
    )  # fmt: skip
    rolling = 0.5 * math.sqrt((k1 - 2 * vx) ** 2 + (k2 - 2 * vy) ** 2 + (k3 - 2 * vz - 2 * p.speed) ** 2)
    long, lat = (st * k1 + ct * k3) / rolling, (ct * cd * k1 + side * sd * k2 - st * cd * k3) / rolling
    turn = (-side * sd * spin + cd * yaw) / rolling
    a, b = 1 / (2 * radius * math.sqrt(1 + taper**2)), -0.5 * g2 / (1 + g1**2) ** 1.5
    size = 3 * normal * (1 - p.poisson_ratio) * p.hertz_e
    size = (size / (2 * p.pi * (a + b) * p.shear_modulus * math.sqrt(p.hertz_g))) ** (1 / 3)
    limit = p.friction * normal
    t1 = -limit * math.tanh(p.shear_modulus * size**2 * p.c11 * long / limit)
    t2 = -limit * math.tanh(p.shear_modulus * size**2 * (p.c22 * lat + size * p.c23 * turn) / limit)
    t1, t2 = np.array([t1, t2]) * min(1.0, limit / math.hypot(t1, t2))
    fx, fy, fz = st * t1 + ct * cd * t2, side * sd * t2, ct * t1 - st * cd * t2
    st, ct = math.sin(theta), math.cos(theta)
    about_y = -(xi * st + radius * s * ct * cp) * fx - radius * s * sp * fy + (-xi * ct + radius * s * st * cp) * fz
    about_z = (
        -(xi * ct * sp - radius * c * ct * cp) * fx + (xi * cp + radius * c * sp) * fy
        + (xi * st * sp - radius * c * st * cp) * fz
    )  # fmt: skip
    about_axle = -radius * (c * st + s * ct * sp) * fx + radius * s * cp * fy - radius * (c * ct - s * st * sp) * fz
    return np.array([fx, fy, fz, about_y, about_z, about_axle])


def forces_published(p, state, contact, multipliers):
    """Right-hand side of M v' = f + D^T lambda, with the normal forces by the Test Set's elimination."""
    x, _, z, theta, phi, *_, yaw, roll, beta = state
    wheels = [wheel_published(p, k, state, contact[k]) for k in range(2)]
    (_, _, left, dl, _), (_, _, right, dr, _) = wheels
    w1, w2 = (multipliers[0] * left + multipliers[1] * right)[:2]
    d = -math.sin(dl) * math.cos(dr) - math.sin(dr) * math.cos(dl)
    normals = (math.cos(dr) * w1 - math.sin(dr) * w2) / d, (-math.cos(dl) * w1 - math.sin(dl) * w2) / d
    spin, i1, i2, sp, cp = p.speed / p.radius + beta, p.inertia_axle, p.inertia_across, math.sin(phi), math.cos(phi)
    spring = 2 * p.spring_arm**2 * p.stiffness_longitudinal * theta
    total = np.array([
        -2 * p.stiffness_lateral * x, -p.mass * p.gravity, -2 * p.stiffness_longitudinal * z,
        i2 * yaw * roll * sp - i1 * spin * roll - (i1 - i2) * yaw * roll * sp - spring * cp,
        i1 * spin * yaw * cp + (i1 - i2) * yaw**2 * sp * cp, -i1 * yaw * roll * cp - spring * sp,
    ])  # fmt: skip
    for k, (_, _, gradient, angle, profile) in enumerate(wheels):
        total += creep_published(p, k, state, contact[k], angle, profile, normals[k])
        total[:5] += multipliers[k] * gradient
    return total


@pytest.mark.parametrize(("share", "saturated"), [(1.0, True), (0.03, False)])
def test_published_equations_hold(problem, share, saturated):
    """All formulas as in the Test Set: contact conditions, gaps, D, and M v' = f + D^T lambda.

    Where the two creep forces together exceed mu N they are cut back; small motions stay below that.
    """
    state = share * MOVING
    p = problem.wheelset
    rate, work = evaluated(problem, state)
    for k in range(2):
        conditions, gap, gradient, *_ = wheel_published(p, k, state, work.contact[k])
        assert conditions == pytest.approx((0.0, 0.0), abs=1e-14)
        assert work.phi[k] == pytest.approx(gap, abs=1e-16)
        assert work.jacobian[k] == pytest.approx(gradient, rel=1e-12)
    sp, cp = math.sin(state[4]), math.cos(state[4])
    mass = np.diag([p.mass] * 3 + [p.inertia_across * cp, p.inertia_across, p.inertia_axle])
    mass[5, 3] = p.inertia_axle * sp
    published = forces_published(p, state, work.contact, work.multipliers)
    assert mass @ rate[5:] == pytest.approx(published, rel=1e-10, abs=1e-10)
    assert rate[:5] == pytest.approx(state[5:10])
    n = (-work.multipliers) ** (-1 / 3)
    t1, t2 = np.tanh(work.creep[:, 0] * n), np.tanh(work.creep[:, 1] * n + work.creep[:, 2])
    assert ((np.hypot(t1, t2) > 1.0) == saturated).all()


@pytest.mark.parametrize("k", [0, 1])
def test_gradient_and_gamma_are_those_of_the_gap(problem, k):
    """D against differences of the gap, the contact found anew; gamma against differences of D v along the motion."""
    _, work = evaluated(problem, MOVING)
    h = 1e-6
    for i in range(5):
        ends = [evaluated(problem, MOVING + h * sign * np.eye(11)[i])[1].phi[k] for sign in (1, -1)]
        assert work.jacobian[k, i] == pytest.approx((ends[0] - ends[1]) / (2 * h), abs=1e-8)
    step = 1e-4
    motion = np.concatenate([MOVING[5:10], np.zeros(6)])
    ends = [evaluated(problem, MOVING + step * sign * motion)[1].phi_rate[k] for sign in (1, -1)]
    assert work.gamma[k] == pytest.approx(-(ends[0] - ends[1]) / (2 * step), rel=1e-6)
    assert abs(work.gamma[k]) > 1e-3


def test_initial_multipliers_are_the_published_ones(problem):
    """The Test Set gives initial positions and multipliers to five digits."""
    _, work = evaluated(problem, problem.state)
    assert work.multipliers == pytest.approx([-83.593, -74.144], rel=1e-4)
    assert work.contact == pytest.approx(problem.contact, abs=1e-9)


@pytest.mark.parametrize(("alpha", "beta"), [(0.0, 0.0), (40.0, 40.0), (10.0, 40.0)])
def test_acceleration_of_the_gaps_is_baumgartes(problem, alpha, beta):
    """Eq. (8): D v' - gamma = -2 alpha Phi' - beta^2 Phi."""
    state = MOVING + np.array([0, 1e-6, 0, 0, 2e-6, 0, 1e-3, 0, 0, 0, 0])
    rate, work = evaluated(problem, state, alpha=alpha, beta=beta)
    feedback = -2 * alpha * work.phi_rate - beta**2 * work.phi
    assert work.jacobian @ rate[5:10] - work.gamma == pytest.approx(feedback, abs=1e-10)
    assert alpha == 0.0 or abs(feedback).min() > 1e-3


def test_feedback_lets_a_gap_fade_as_a_damped_oscillator(problem):
    """alpha = beta = a: Phi = Phi_0 (1 + a t) exp(-a t). Without feedback a gap stays; projection closes it at once."""
    lifted = problem._replace(state=problem.state + np.eye(11)[1] * 1e-5)
    times, a = np.linspace(0.0, 0.2, 5), 40.0
    free, fed = (solve(lifted, "rk45", 1e-10, value, value, times) for value in (0.0, a))
    assert free.history[:, 0] == pytest.approx(1e-5, rel=1e-3)
    last = solve(lifted, ADAPTER, 1e-11, a, a, times)
    assert last.violation[0] == pytest.approx(1e-5 * (1 + a * 0.2) * math.exp(-a * 0.2), rel=1e-3)
    assert fed.violation == pytest.approx(last.violation, rel=1e-4)
    assert solve(lifted, "rk45" + PROJECTED, 1e-8, times=times).history[1:].max() < 1e-15


def test_projection_is_orthogonal_and_hits_the_constraints(problem):
    state, work = MOVING.copy(), workspace(problem)
    project(problem.wheelset, state, work)
    state += [0, 1e-8, 0, 0, 3e-8, 0, 1e-3, 0, 0, 0, 0]  # small: D is that of the projected state
    moved = state.copy()
    project(problem.wheelset, moved, work)
    assert abs(work.phi).max() < 1e-15
    assert work.jacobian @ moved[5:10] == pytest.approx([0.0, 0.0], abs=1e-15)
    p = problem.wheelset
    mass = np.array([p.mass] * 3 + [p.inertia_across * math.cos(moved[4]), p.inertia_across])
    for part in (slice(0, 5), slice(5, 10)):
        momentum = mass * (moved - state)[part]
        across = momentum - work.jacobian.T @ np.linalg.lstsq(work.jacobian.T, momentum)[0]
        assert abs(across).max() < 1e-4 * abs(momentum).max()
    assert moved[10] == state[10]


def test_a_wild_trial_state_leaves_no_trace(problem):
    work = workspace(problem)
    function = right_hand_side(problem.wheelset, work)
    before = function(0.0, problem.state)
    assert np.isnan(function(0.0, problem.state + np.eye(11)[0])).any()  # a metre beside the rail head
    assert function(0.0, problem.state) == pytest.approx(before, rel=1e-9)


@pytest.mark.parametrize("method", ["rk45", "rk45" + PROJECTED, "scipy_dop853", "scipy_lsoda"])
def test_lateral_position_after_ten_seconds(problem, method):
    """Reference of the Test Set: 8.6355386965811e-3 m. The bar at an everyday tolerance, 1e-8 m at a tight one."""
    everyday, tight = solve(problem, method, 1e-6), solve(problem, method, 1e-9)
    assert everyday.state[0] == pytest.approx(8.6355386965811e-3, abs=BAR)
    assert tight.state[0] == pytest.approx(8.6355386965811e-3, abs=1e-8)
    assert everyday.evaluations < tight.evaluations


def test_all_unknowns_after_ten_seconds(problem):
    """Seventeen unknowns of the index-2 solution, whose own tolerance was 1e-9, relative to the size of each."""
    table = value_table(problem, solve(problem, "rk45", 1e-11)).set_index("quantity")
    assert len(table) == 17
    assert (abs(table.difference / table.reference) < 5e-6).all(), table.to_string()
    assert table.unit["lambda_left"] == "N" and table.unit["vtheta"] == "rad/s" and table.unit["xi_right"] == "m"


def test_two_solvers_agree_over_a_short_run(problem):
    times = [0.0, 0.5]
    pair, other = (solve(problem, method, 1e-12, 5.0, 5.0, times).state for method in ("rk45", ADAPTER))
    assert pair == pytest.approx(other, abs=1e-11)
    assert abs(pair - problem.state).max() > 1e-3


def test_leaving_the_rail_is_a_failed_run(problem):
    thrown = problem._replace(state=problem.state + 20.0 * np.eye(11)[5])
    for method in ("rk45", ADAPTER, "scipy_radau"):
        assert solve(thrown, method, 1e-6).status == "failed"


def test_tables_and_figures_carry_the_runs(problem):
    table = work_precision_table(problem, {"rk45": [1e-4, 1e-5, 1e-6], ADAPTER: [1e-5]}, repetitions=1)
    assert table.method.tolist() == ["rk45"] * 3 + [ADAPTER]
    assert (table.status == "completed").all() and (table.seconds > 0).all()
    assert table.evaluations.is_monotonic_increasing or table.evaluations[:3].is_monotonic_increasing
    assert table.error_x_m[0] > BAR > table.error_x_m[2]
    axes = fig_ivp_work_precision(table, problem.reference.effort, BAR).axes
    lines = {line.get_label(): line.get_xydata() for line in axes[0].get_lines()}
    drawn = lines[METHOD_STYLES["rk45"]["label"]]
    assert drawn == pytest.approx(np.stack([table.evaluations[:3], 1e6 * table.error_x_m[:3]], axis=1))
    assert [95533, 95533] == list(axes[0].get_lines()[-1].get_xdata())
    assert all("/ " in axis.get_xlabel() for axis in axes) and "µm" in axes[0].get_ylabel()
    effects = stabilisation_table(problem, [0.0, 50.0], [1e-5])
    assert effects.alpha_per_s.tolist() == [0.0, 50.0, 0.0] and effects.treatment.iloc[-1] == "projection"
    assert effects.phi_m[0] > effects.phi_m[1] > effects.phi_m[2]
    history = violation_history(problem, [0.0, 50.0], 1e-5, 11)
    assert history.groupby(["treatment", "alpha_per_s"]).size().tolist() == [11] * 3
    curves = fig_ivp_constraints(history).axes[0].get_lines()
    assert curves[1].get_ydata() == pytest.approx(1e6 * history.phi_m[history.alpha_per_s == 50.0])


def test_error_is_that_of_x_and_the_largest_of_all(problem):
    run = solve(problem, "rk45", 1e-3, times=[0.0, 1e-3])
    shifted = problem.reference.state * (1 + np.linspace(-1e-3, 2e-3, 11))
    assert error_of(problem, run._replace(state=shifted)) == pytest.approx((1e-3 * 8.6355386965811e-3, 2e-3))


@pytest.mark.parametrize(
    ("change", "field"),
    [
        (lambda data: data["parameters"].pop("GM"), "parameters.GM"),
        (lambda data: data["initial"]["state"].update(x="left"), "initial.state.x"),
        (lambda data: data["reference"]["contact"].update(xi_left=float("nan")), "reference.contact.xi_left"),
        (lambda data: data.pop("reference"), "reference"),
    ],
)
def test_wrong_file_is_one_line(tmp_path, change, field):
    data = json.loads(FILE.read_text())
    change(data)
    (tmp_path / "wrong.json").write_text(json.dumps(data))
    with pytest.raises(InputError, match=field):
        read_problem(tmp_path / "wrong.json")
    with pytest.raises(InputError, match="expected a JSON file"):
        read_problem(tmp_path / "absent.json")
