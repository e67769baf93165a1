"""Study of the Test Set's problem "Wheelset": accuracy and cost of the solution of the constrained equations.

The equations of `study.ivp.wheelset` are stabilised by Baumgarte's feedback of Eq. (8), as in wrcore, and integrated by
an explicit pair in a compiled loop. Optionally each step is projected onto the constraints. Scipy's solvers run for
comparison.
"""

import time
from typing import NamedTuple

import numpy as np
from scipy.integrate import RK45, solve_ivp

from study.ivp.problem import CONTACT, MULTIPLIERS, STATE, UNITS, workspace
from study.ivp.wheelset import right_hand_side, run_pair

ATOL_OVER_RTOL = 1e-3
TABLEAUS = {"rk45": (np.hstack([RK45.A, np.zeros((RK45.n_stages, 1))]), RK45.B, RK45.E)}
"""Matrix of stages, weights, and weights of the error estimate of each pair: Dormand and Prince's 5(4) pair."""
PROJECTED = "_projected"
"""Ending of the names of methods that project each step onto the constraints."""
SCIPY = {"scipy_rk45": "RK45", "scipy_dop853": "DOP853", "scipy_lsoda": "LSODA", "scipy_radau": "Radau"}


class Run(NamedTuple):
    """A run of the benchmark: its last state and its cost."""

    status: str
    """Status at the end: completed or failed."""
    state: np.ndarray
    """(11,): last state."""
    contact: np.ndarray
    """(2, 2): last contact coordinates, in the order of `study.ivp.problem.Problem`."""
    multipliers: np.ndarray
    """(2,): last multipliers, N."""
    violation: np.ndarray
    """(2,): maximum of |Phi| (m) and of |Phi'| (m/s) over both wheels at the last state."""
    history: np.ndarray
    """(n, 2): maximum violation in the steps before each time; NaN for scipy's solvers."""
    steps: int
    rejected: float
    """Number of rejected steps; NaN for scipy's solvers, which do not count them."""
    evaluations: int
    seconds: float


def solve(problem, method, rtol, alpha=0.0, beta=0.0, times=None):
    """Integrate the benchmark up to the last of the times (n,), s, or to the reference's time by default.

    ``method`` is a pair of `TABLEAUS`, optionally with the ending `PROJECTED`, or one of `SCIPY`. The absolute
    tolerance is `ATOL_OVER_RTOL` times ``rtol``. If Baumgarte's alpha and beta (1/s) are zero, only the accelerations
    satisfy the constraints.
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
        with np.errstate(over="ignore", invalid="ignore"):  # the error estimate rejects a trial step that diverges
            path = solve_ivp(function, times[[0, -1]], state, SCIPY[method], rtol=rtol, atol=ATOL_OVER_RTOL * rtol)
    except ValueError:  # implicit solvers refuse a Jacobian that is not finite
        return False, np.full_like(state, np.nan), 0, np.nan
    return path.success, path.y[:, -1], len(path.t) - 1, np.nan


def error_of(problem, run):
    """Return the error of x at the reference's time (m) and the maximum relative error of all state variables."""
    error = abs(run.state - problem.reference.state)
    return error[0], (error / abs(problem.reference.state)).max()


def value_table(problem, run):
    """Return a table of all 17 unknowns at the reference's time: quantity, unit, reference, found, difference."""
    import pandas as pd

    names = [*STATE, *CONTACT, *(f"lambda_{side}" for side in MULTIPLIERS)]
    reference, found = (
        np.concatenate([part.state, part.contact.ravel(), part.multipliers]) for part in (problem.reference, run)
    )
    columns = {"quantity": names, "unit": [UNITS.get(name, "N") for name in names]}
    return pd.DataFrame({**columns, "reference": reference, "found": found, "difference": found - reference})


def work_precision(problem, tolerances, repetitions, feedback=0.0):
    """Return the table of the error of x, evaluations and seconds at several relative tolerances of each method.

    Seconds are medians over passes through all runs in turn, after a short run of each method for compilation.
    Baumgarte's alpha = beta is ``feedback`` (1/s). The column error_max is the maximum relative error over all eleven
    state variables.
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
    """Return the treatments of drift as (name, method, Baumgarte's alpha = beta in 1/s); the last is projection."""
    found = [("Baumgarte", "rk45", float(value)) for value in parameters]
    return [*found, ("projection", "rk45" + PROJECTED, 0.0)]


def stabilisation_table(problem, parameters, tolerances):
    """Return the table of error, drift and cost for values of Baumgarte's alpha = beta (1/s) and for projection.

    The drift is the violation of the constraints at the end: phi_m for positions, phi_rate_m_per_s for velocities.
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
    """Return the violation of the constraints at accepted steps over equally spaced times, for each treatment of drift.

    Columns are treatment, alpha_per_s (Baumgarte's alpha = beta, 1/s), t_s, phi_m and phi_rate_m_per_s (maximum of the
    two wheels).
    """
    import pandas as pd

    times, parts = np.linspace(0.0, problem.reference.time, points), []
    for treatment, method, value in treatments(parameters):
        history = solve(problem, method, rtol, value, value, times).history
        columns = {"t_s": times, "phi_m": history[:, 0], "phi_rate_m_per_s": history[:, 1]}
        parts.append(pd.DataFrame({"treatment": treatment, "alpha_per_s": value, **columns}))
    return pd.concat(parts, ignore_index=True)
