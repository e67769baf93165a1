"""Time integration: scipy's explicit Runge-Kutta pairs over the compiled right-hand side, with counters.

``rk45`` is the Dormand-Prince 5(4) pair that MATLAB's ode45 uses. Failure is a value, never an exception: the states
reached so far are kept.
"""

import time
from dataclasses import dataclass

import numpy as np
from scipy.integrate import DOP853, RK23, RK45

METHODS = {"rk45": RK45, "rk23": RK23, "dop853": DOP853}


@dataclass(frozen=True)
class Trajectory:
    """States at the output times, and what they cost.

    Attributes
    ----------
    t : numpy.ndarray, shape (n,)
        Output times reached, s.
    states : numpy.ndarray, shape (n, size)
    status : {"completed", "derailed", "failed"}
    reason : str
        Empty for a completed run.
    steps, rejected, rhs_evaluations : int
        Accepted steps, rejected attempts, right-hand sides in all.
    wall_s : float
        Seconds spent in the integration.
    """

    t: np.ndarray
    states: np.ndarray
    status: str
    reason: str
    steps: int
    rejected: int
    rhs_evaluations: int
    wall_s: float


def integrate(function, state, times, method="rk45", rtol=1e-6, atol=1e-9, stop=None, progress=None):
    """Integrate from ``times[0]`` and sample at ``times``.

    Parameters
    ----------
    function : callable
        ``function(t, state) -> rate``; must return a new array.
    state : numpy.ndarray, shape (size,)
        Initial state.
    times : numpy.ndarray, shape (n,)
        Increasing output times, s; the last one ends the run.
    method : {"rk45", "rk23", "dop853"}
    rtol, atol : float
        Relative and absolute tolerance of scipy's step control.
    stop : callable, optional
        ``stop(t, state) -> str``: a reason to end the run, or an empty string. Called after each step.
    progress : callable, optional
        Called with the time reached after each step.

    Returns
    -------
    Trajectory
    """
    started = time.perf_counter()
    times = np.asarray(times, float)
    solver = METHODS[method](function, times[0], np.array(state, float), times[-1], rtol=rtol, atol=atol)
    first_cost = solver.nfev
    states = np.empty((len(times), len(state)))
    states[0] = state
    reached, steps, attempt_cost = 1, 0, solver.n_stages
    status, reason = "completed", ""
    while solver.status == "running":
        with np.errstate(over="ignore", invalid="ignore"):  # a wild trial step is rejected by its error estimate
            message = solver.step()
        if solver.status == "failed":
            status, reason = "failed", f"step size fell below the resolution of time at t = {solver.t:.6g} s: {message}"
            break
        steps += 1
        if not np.all(np.isfinite(solver.y)):
            status, reason = "failed", f"the state is not finite at t = {solver.t:.6g} s"
            break
        upto = np.searchsorted(times, solver.t, side="right")
        if upto > reached:
            states[reached:upto] = solver.dense_output()(times[reached:upto]).T
            reached = upto
        if stop is not None and (reason := stop(solver.t, solver.y)):
            status = "derailed"
            break
        if progress is not None:
            progress(solver.t)
    attempts = (solver.nfev - first_cost) // attempt_cost if method != "dop853" else steps
    return Trajectory(
        times[:reached], states[:reached], status, reason, steps, attempts - steps, solver.nfev,
        time.perf_counter() - started,
    )  # fmt: skip
