"""Coefficients of the one-step methods against their order conditions, and against scipy's where it has the method."""

import numpy as np
import pytest
from scipy.integrate import RK23, RK45

from wrcore.integrate.tableaus import EXPLICIT, ROSENBROCK

ORDERS = {"rk45": (5, 4), "tsit5": (5, 4), "rk23": (3, 2), "rk4": (4, 3), "rodas5": (5, 4), "rodas4": (4, 3),
          "rodas4p2": (4, 3), "ros34pw2": (3, 2)}  # fmt: skip
"""Orders of the method and of its embedded one."""


def explicit_order(a, weights, theta=1.0):
    """Order (at most 5) of weights at theta: Butcher's conditions by rooted trees (Hairer, Norsett, Wanner, II.2)."""
    c = a.sum(axis=1)
    ac, acc, aac = a @ c, a @ c**2, a @ (a @ c)
    trees = {
        1: [(np.ones_like(c), 1)],
        2: [(c, 2)],
        3: [(c**2, 3), (ac, 6)],
        4: [(c**3, 4), (c * ac, 8), (acc, 12), (aac, 24)],
        5: [(c**4, 5), (c**2 * ac, 10), (ac**2, 20), (c * acc, 15), (c * aac, 30), (a @ c**3, 20),
            (a @ (c * ac), 40), (a @ acc, 60), (a @ aac, 120)],
    }  # fmt: skip
    return reached(weights, trees, theta)


def rosenbrock_order(alpha, gamma, weights, theta=1.0, exact=True):
    """Order (at most 5; 3 with any matrix for J) of weights at theta (Hairer and Wanner, IV.7)."""
    a, g, one = alpha.sum(axis=1), gamma.sum(axis=1), np.ones(len(alpha))
    beta, b = alpha + gamma, (alpha + gamma).sum(axis=1)
    if exact:
        trees = {
            1: [(one, 1)],
            2: [(b, 2)],
            3: [(a**2, 3), (beta @ b, 6)],
            4: [(a**3, 4), (a * (alpha @ b), 8), (beta @ a**2, 12), (beta @ beta @ b, 24)],
            5: [(a**4, 5), (a**2 * (alpha @ b), 10), ((alpha @ b) ** 2, 20), (a * (alpha @ a**2), 15),
                (a * (alpha @ beta @ b), 30), (beta @ a**3, 20), (beta @ (a * (alpha @ b)), 40),
                (beta @ beta @ a**2, 60), (beta @ beta @ beta @ b, 120)],
        }  # fmt: skip
    else:
        none = np.inf  # what the matrix contributes must vanish
        trees = {
            1: [(one, 1)],
            2: [(a, 2), (g, none)],
            3: [(a**2, 3), (alpha @ a, 6), (alpha @ g, none), (gamma @ a, none), (gamma @ g, none)],
        }
    return reached(weights, trees, theta)


def reached(weights, trees, theta):
    """Highest order whose conditions, and those of all orders below, hold to rounding."""
    scale = np.abs(weights).sum()
    for order, conditions in trees.items():
        if any(abs(weights @ tree - theta**order / density) > 2e-14 * scale * 10 for tree, density in conditions):
            return order - 1
    return max(trees)


def dense_weights(tableau, theta):
    return tableau.dense @ theta ** np.arange(1, tableau.dense.shape[1] + 1)


def original_form(tableau):
    """alpha, gamma and the matrix that turns weights of u into weights of the stages' slopes."""
    gamma = np.linalg.inv(np.eye(len(tableau.nodes)) / tableau.gamma - tableau.couplings)
    return tableau.stages @ gamma, gamma, gamma


@pytest.mark.parametrize("name", EXPLICIT)
def test_explicit_pairs_have_their_orders(name):
    t = EXPLICIT[name]
    weights = t.stages[-1]
    order = explicit_order(t.stages, weights), explicit_order(t.stages, weights - t.error)
    assert order == ORDERS[name]
    assert t.exponent == order[1] + 1
    np.testing.assert_allclose(t.stages.sum(axis=1), t.nodes, atol=1e-15)
    assert t.nodes[-1] == 1.0 and t.error[-1] != 0.0  # the last stage is the next step's first, and judges this one


@pytest.mark.parametrize(("name", "order"), [("rk45", 4), ("tsit5", 4), ("rk23", 3), ("rk4", 3)])
def test_dense_output_of_explicit_pairs(name, order):
    t = EXPLICIT[name]
    for theta in (0.1, 0.35, 0.7):
        assert explicit_order(t.stages, dense_weights(t, theta), theta) == order
    np.testing.assert_allclose(dense_weights(t, 1.0), t.stages[-1], atol=1e-14)


@pytest.mark.parametrize(("name", "theirs"), [("rk45", RK45), ("rk23", RK23)])
def test_pairs_that_scipy_has_too(name, theirs):
    t = EXPLICIT[name]
    np.testing.assert_allclose(t.stages[:-1, :-1][:, : theirs.A.shape[1]], theirs.A, atol=1e-16)
    np.testing.assert_allclose(t.stages[-1, :-1], theirs.B, atol=1e-16)
    np.testing.assert_allclose(-t.error, theirs.E, atol=1e-16)  # scipy: embedded less main weights
    np.testing.assert_allclose(t.dense, theirs.P, atol=1e-14)


@pytest.mark.parametrize("name", ROSENBROCK)
def test_rosenbrock_methods_have_their_orders(name):
    t = ROSENBROCK[name]
    alpha, gamma, back = original_form(t)
    main, embedded = t.weights @ back, (t.weights - t.error) @ back
    assert (rosenbrock_order(alpha, gamma, main), rosenbrock_order(alpha, gamma, embedded)) == ORDERS[name]
    assert t.exponent == ORDERS[name][1] + 1
    rounding = 3e-13 if name == "rodas5" else 1e-14  # of coefficients up to 318 with 16 digits
    np.testing.assert_allclose(alpha.sum(axis=1), t.nodes, atol=rounding)
    np.testing.assert_allclose(gamma.sum(axis=1), t.by_time, atol=rounding)
    for theta in (0.2, 0.6):
        assert rosenbrock_order(alpha, gamma, dense_weights(t, theta) @ back, theta) == (4 if name == "rodas5" else 3)
    np.testing.assert_allclose(dense_weights(t, 1.0), t.weights, atol=1e-13)


def test_what_is_left_of_the_order_with_any_jacobian():
    for name, order in (("ros34pw2", 3), ("rodas4p2", 2), ("rodas4", 1)):
        alpha, gamma, back = original_form(ROSENBROCK[name])
        assert rosenbrock_order(alpha, gamma, ROSENBROCK[name].weights @ back, exact=False) == order
    assert ROSENBROCK["rodas4"].reuse == 1


@pytest.mark.parametrize("name", ROSENBROCK)
def test_rosenbrock_methods_are_l_stable(name):
    alpha, gamma, back = original_form(ROSENBROCK[name])
    weights, one = ROSENBROCK[name].weights @ back, np.ones(len(alpha))

    def growth(z):
        return abs(1 + z * weights @ np.linalg.solve(np.eye(len(one)) - z * (alpha + gamma), one))

    assert growth(-1e8) < 1e-6
    assert max(growth(1j * y) for y in np.logspace(-2, 4, 200)) <= 1 + 1e-12


def force_error(tableau, steps, omega=1e4):
    """Greatest error (N) of the force on 1 kg that a spring without damping (omega, rad/s) takes along sin t in 1 s."""
    matrix, h, y, worst = np.array([[0.0, 1.0], [-(omega**2), 0.0]]), 1.0 / steps, np.array([0.0, 1.0]), 0.0
    left, stages = np.eye(2) / (h * tableau.gamma) - matrix, np.zeros((len(tableau.nodes), 2))
    for k in range(steps):
        t, stages[:] = k * h, 0.0
        for i, (node, by_time) in enumerate(zip(tableau.nodes, tableau.by_time, strict=True)):
            at = t + node * h
            right = matrix @ (y + tableau.stages[i] @ stages) + [0.0, (omega**2 - 1.0) * np.sin(at)]
            right += tableau.couplings[i] @ stages / h + [0.0, h * by_time * (omega**2 - 1.0) * np.cos(t)]
            stages[i] = np.linalg.solve(left, right)
        y = y + tableau.weights @ stages
        worst = max(worst, omega**2 * abs(y[0] - np.sin(t + h)))
    return worst


@pytest.mark.parametrize(("name", "order"), [("rodas5", 0.0), ("rodas4", 0.0), ("rodas4p2", 2.0), ("ros34pw2", 1.0)])
def test_orders_on_a_light_part_that_follows_another_on_a_stiff_spring(name, order):
    """Prothero and Robinson's problem of second order. Steps of a thousand periods: the force of Rodas4 errs by a
    quarter of what it is, m a, whatever the step, of Rodas5 by 3 %."""
    coarse, fine = (force_error(ROSENBROCK[name], steps) for steps in (20, 40))
    assert np.log2(coarse / fine) == pytest.approx(order, abs=0.15 if name == "rodas5" else 0.1)  # 2.7, 2.9 %
    assert fine == pytest.approx(
        {"rodas5": 0.029, "rodas4": 0.26, "rodas4p2": 3.8e-5, "ros34pw2": 7.5e-3}[name], rel=0.02
    )


@pytest.mark.parametrize("name", ROSENBROCK)
def test_stages_imply_the_speeds_of_a_state_of_its_own(name):
    """q' = v, v' = -3 q - 2 v, increments counted from a drift of q that is not v."""
    method, matrix, start, drift, step = ROSENBROCK[name], np.array([[0, 1], [-3, -2]]), [0.3, 0.8], [0.5, 0.0], 0.1
    u = np.zeros((len(method.nodes), 2))
    for i in range(len(u)):
        there = start + method.nodes[i] * step * np.array(drift) + method.stages[i] @ u
        implied = start[1] + method.speeds[i] @ u[:, 0] / step + method.begun[i] * (start[1] - drift[0])
        assert implied == pytest.approx(there[1], rel=1e-11)
        known = matrix @ there - drift + step * method.by_time[i] * matrix @ drift + method.couplings[i] @ u / step
        u[i] = np.linalg.solve(np.eye(2) / (step * method.gamma) - matrix, known)
    assert np.abs(u[:, 1]).max() > 0.05
