"""The Test Set's problem "Wheelset" as a study: how well the constrained equations are solved, and what that costs.

The equations of `study.ivp.wheelset` are stabilised as everywhere else, by Baumgarte's feedback of Eq. (8),
and integrated by an explicit pair in a compiled loop. Besides, each step can be projected onto the constraints, and
scipy's solvers run for comparison.
"""

import time
from typing import NamedTuple

import numpy as np
from scipy.integrate import RK45, solve_ivp

from study.ivp.problem import CONTACT, MULTIPLIERS, STATE, UNITS, workspace
from study.ivp.wheelset import right_hand_side, run_pair

ATOL_OVER_RTOL = 1e-3
TABLEAUS = {"rk45": (np.hstack([RK45.A, np.zeros((RK45.n_stages, 1))]), RK45.B, RK45.E)}
"""Square matrix of stages, weights, weights of the error: Dormand and Prince's 5(4) pair."""
PROJECTED = "_projected"
"""Ending of the methods that project each step."""
SCIPY = {"scipy_rk45": "RK45", "scipy_dop853": "DOP853", "scipy_lsoda": "LSODA", "scipy_radau": "Radau"}


class Run(NamedTuple):
    """A run of the benchmark: its last state, and what it cost."""

    status: str
    """completed or failed."""
    state: np.ndarray
    """(11,)"""
    contact: np.ndarray
    """(2, 2), as of `study.ivp.problem.Problem`."""
    multipliers: np.ndarray
    """(2,), N."""
    violation: np.ndarray
    """(2,): the larger |Phi| (m) and the larger |Phi'| (m/s) at the last state."""
    history: np.ndarray
    """(n, 2): largest violation over the steps up to each time; NaN for scipy's solvers."""
    steps: int
    rejected: float
    """Rejected attempts; NaN for scipy's solvers, which do not count them."""
    evaluations: int
    seconds: float


def solve(problem, method, rtol, alpha=0.0, beta=0.0, times=None):
    """Integrate the benchmark up to the last of the times (n,), s (the reference's if not given), by a pair of
    `TABLEAUS`, alone or with the ending `PROJECTED`, or one of `SCIPY`; the absolute tolerance is `ATOL_OVER_RTOL`
    times ``rtol``. With Baumgarte's alpha and beta (1/s) of zero the constraints hold as accelerations only.
    """
    wheelset, work = problem.wheelset._replace(alpha=float(alpha), beta=float(beta)), workspace(problem)
    times = np.array([0.0, problem.reference.time]) if times is None else np.asarray(times, float)
    function, history = right_hand_side(wheelset, work), np.full((len(times), 2), np.nan)
    run = _scipy_run if method in SCIPY else _compiled_run
    started = time.perf_counter()
    completed, state, steps, rejected = run(function, wheelset, work, problem.state, method, rtol, times, history)
    seconds, evaluations = time.perf_counter() - started, int(work.counters[0])
    function(times[-1], state)
    return Run(
        "completed" if completed else "failed", state, work.contact, work.multipliers,
        np.array([abs(work.phi).max(), abs(work.phi_rate).max()]), history, steps, rejected, evaluations, seconds,
    )  # fmt: skip


def _compiled_run(function, wheelset, work, state, method, rtol, times, history):
    stages, weights, error = TABLEAUS[method.removesuffix(PROJECTED)]
    state = state.copy()
    steps, rejected = run_pair(
        stages, weights, error, wheelset, work, state, times, history, rtol, ATOL_OVER_RTOL * rtol,
        method.endswith(PROJECTED),
    )  # fmt: skip
    return steps >= 0, state, steps, float(rejected)


def _scipy_run(function, wheelset, work, state, method, rtol, times, history):
    try:
        with np.errstate(over="ignore", invalid="ignore"):  # a wild trial step is rejected by its error estimate
            path = solve_ivp(function, times[[0, -1]], state, SCIPY[method], rtol=rtol, atol=ATOL_OVER_RTOL * rtol)
    except ValueError:  # implicit solvers refuse a Jacobian that is not finite
        return False, np.full_like(state, np.nan), 0, np.nan
    return path.success, path.y[:, -1], len(path.t) - 1, np.nan


def error_of(problem, run):
    """Error of x at the reference's time (m), and the largest relative error of the eleven state variables."""
    error = abs(run.state - problem.reference.state)
    return error[0], (error / abs(problem.reference.state)).max()


def value_table(problem, run):
    """All seventeen unknowns beside the reference at its time: quantity, unit, reference, found, difference."""
    import pandas as pd

    names = [*STATE, *CONTACT, *(f"lambda_{side}" for side in MULTIPLIERS)]
    reference, found = (
        np.concatenate([part.state, part.contact.ravel(), part.multipliers]) for part in (problem.reference, run)
    )
    columns = {"quantity": names, "unit": [UNITS.get(name, "N") for name in names]}
    return pd.DataFrame({**columns, "reference": reference, "found": found, "difference": found - reference})


def work_precision(problem, tolerances, repetitions, feedback=0.0):
    """Error of x against evaluations and seconds (medians over passes through all runs in turn, after a short run of
    each method that compiles) at relative tolerances of each method, with Baumgarte's alpha = beta = ``feedback``
    (1/s); error_max is relative, over all eleven state variables.
    """
    import pandas as pd

    for method in tolerances:
        solve(problem, method, 1e-3, times=[0.0, 1e-3])
    cases = [(method, rtol) for method, values in tolerances.items() for rtol in values]
    runs = [[solve(problem, *case, feedback, feedback) for case in cases] for _ in range(repetitions)]
    rows = []
    for i, (method, rtol) in enumerate(cases):
        run, seconds = runs[0][i], np.median([turn[i].seconds for turn in runs])
        errors = error_of(problem, run) if run.status == "completed" else (np.nan, np.nan)
        rows.append((method, rtol, run.status, run.steps, run.rejected, run.evaluations, seconds, *errors))
    names = ["method", "rtol", "status", "steps", "rejected", "evaluations", "seconds", "error_x_m", "error_max"]
    return pd.DataFrame(rows, columns=names)


def treatments(parameters):
    """What can be done about drift: (name, method, Baumgarte's alpha = beta), the projection last."""
    found = [("Baumgarte", "rk45", float(value)) for value in parameters]
    return [*found, ("projection", "rk45" + PROJECTED, 0.0)]


def stabilisation_table(problem, parameters, tolerances):
    """Effect of Baumgarte's alpha = beta (1/s), and of projection, on the error, the drift (phi_m and phi_rate_m_per_s:
    violation of position and velocity constraints at the end) and the cost.
    """
    import pandas as pd

    rows = []
    for rtol in tolerances:
        for treatment, method, value in treatments(parameters):
            run = solve(problem, method, rtol, value, value)
            rows.append((treatment, value, rtol, run.evaluations, *error_of(problem, run), *run.violation))
    names = ["treatment", "alpha_per_s", "rtol", "evaluations", "error_x_m", "error_max", "phi_m", "phi_rate_m_per_s"]
    return pd.DataFrame(rows, columns=names)


def violation_history(problem, parameters, rtol, points):
    """Violation of the constraints over equally spaced times, at accepted steps, by Baumgarte's alpha = beta (1/s):
    treatment, alpha_per_s, t_s, phi_m, phi_rate_m_per_s (larger of the two wheels).
    """
    import pandas as pd

    times, parts = np.linspace(0.0, problem.reference.time, points), []
    for treatment, method, value in treatments(parameters):
        history = solve(problem, method, rtol, value, value, times).history
        columns = {"t_s": times, "phi_m": history[:, 0], "phi_rate_m_per_s": history[:, 1]}
        parts.append(pd.DataFrame({"treatment": treatment, "alpha_per_s": value, **columns}))
    return pd.concat(parts, ignore_index=True)
