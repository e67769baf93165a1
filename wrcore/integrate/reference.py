"""Independent reference integrators: scipy's solvers and SUNDIALS' CVODE, with the right-hand side of wrcore."""

import time
from dataclasses import replace

import numpy as np
from scipy import integrate as scipy_integrate

from wrcore.equations.equations_of_motion import Equations
from wrcore.equations.interface import places, why_outside
from wrcore.errors import InputError
from wrcore.integrate.trajectory import Trajectory

SOLVERS = {
    "scipy_rk45": "RK45", "scipy_rk23": "RK23", "scipy_dop853": "DOP853", "scipy_radau": "Radau", "scipy_bdf": "BDF",
    "scipy_lsoda": "LSODA",
}  # fmt: skip
"""Names of scipy's solver classes by method name."""

LEAST_RTOL = 3e-14
"""Tolerance relative to the size of a component, the minimum of scipy: the absolute tolerances control the error."""


def integrate_by_reference(model, state, times, method, tolerances, longest_step, derailed_y, progress=None, halt=None,
                           most_steps=0):  # fmt: skip
    """Integrate a model by a solver of another library and return its `Trajectory`.

    Arguments are those of `integrator.integrate`, except for ``tolerances`` (size,) of the components. Raises an
    InputError for ``cvode`` if scikit-sundae is not installed."""
    function = Equations(model)

    def stop(t, state):
        return why_outside(model, t, state, places(function.work)[0], derailed_y)

    bounded = stop if np.isfinite(derailed_y) else None
    found = integrate_function(
        function, state, times, method, LEAST_RTOL, tolerances, longest_step, bounded, progress, halt, most_steps
    )
    return replace(found, status="failed", reason=f"{function.fault}; {found.reason}") if function.fault else found


def integrate_function(
    function, state, times, method="scipy_rk45", rtol=1e-6, atol=1e-9, longest_step=np.inf, stop=None, progress=None,
    halt=None, most_steps=0,
):  # fmt: skip
    """Integrate a right-hand side ``function(t, state)`` by a solver of another library and return its `Trajectory`.

    The function must return a new array. ``method`` is a key of `SOLVERS` or ``cvode``; ``rtol`` and ``atol`` (a
    number, or one for each component) are the library's tolerances. After each step ``progress`` is called with the
    time reached. ``stop(t, state)`` and, with scipy's solvers, ``halt()`` return a reason to end the run or an empty
    string; a run ended by ``halt`` is stalled. ``most_steps`` limits the accepted steps (0: no limit).
    """
    evaluations = 0

    def counted(t, y):
        nonlocal evaluations
        evaluations += 1
        return function(t, y)

    times, started = np.asarray(times, float), time.perf_counter()
    run = _by_cvode if method == "cvode" else _by_scipy
    start = np.array(state, float)
    reached, states, status, reason, counts = run(
        counted, start, times, method, rtol, atol, longest_step, stop, progress, halt, most_steps
    )
    if method in ("scipy_rk45", "scipy_rk23"):  # two evaluations at the start, one per stage in each attempt
        counts["rejected"] = (evaluations - 2) // (6 if method == "scipy_rk45" else 3) - counts["steps"]
    return Trajectory(
        method, times[:reached], states[:reached], status, reason, rhs_evaluations=evaluations,
        wall_s=time.perf_counter() - started, end_t=float(times[reached - 1]), end_state=np.array(states[reached - 1]),
        **counts,
    )  # fmt: skip


@np.errstate(over="ignore", invalid="ignore")  # an overflow in a trial step is rejected by its error estimate
def _by_scipy(function, state, times, method, rtol, atol, longest_step, stop, progress, halt, most_steps):
    states = np.full((len(times), len(state)), np.nan)
    states[0] = state
    reached, steps, smallest, status, reason = 1, 0, np.inf, "completed", ""
    try:
        solver = getattr(scipy_integrate, SOLVERS[method])(
            function, times[0], state, times[-1], rtol=rtol, atol=atol, max_step=longest_step
        )
    except (ValueError, ArithmeticError) as error:  # a Jacobian that is not finite
        counts = {"steps": 0, "jacobians": 0, "factorisations": 0, "smallest_step": smallest}
        return reached, states, "failed", f"{error} at t = {times[0]:.6g} s", counts
    while solver.status == "running":
        try:
            message = solver.step()
        except (ValueError, ArithmeticError) as error:
            status, reason = "failed", f"{error} at t = {solver.t:.6g} s"
            break
        if solver.status == "failed":
            status, reason = "failed", f"step size fell below the resolution of time at t = {solver.t:.6g} s: {message}"
            break
        steps += 1
        smallest = min(smallest, abs(solver.t - solver.t_old))
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
        if halt is not None and (reason := halt()):
            status = "stalled"
            break
        if most_steps and steps >= most_steps and solver.status == "running":
            status = "stalled"
            reason = f"{steps} steps, as many as integration.most_steps allows, at t = {solver.t:.6g} s"
            break
    counts = {"steps": steps, "jacobians": solver.njev, "factorisations": solver.nlu, "smallest_step": smallest}
    return reached, states, status, reason, counts


def _by_cvode(function, state, times, method, rtol, atol, longest_step, stop, progress, halt, most_steps):
    try:
        from sksundae.cvode import CVODE
    except ImportError:
        raise InputError(
            "integration.method", method, "expected scikit-sundae to be installed: pip install wrcore[sundials]"
        ) from None
    limit = {} if np.isinf(longest_step) else {"max_step": longest_step}

    def fill(t, y, rate):
        rate[:] = function(t, np.array(y))

    def stopped(t, y, events):
        events[0] = -1.0 if stop(t, np.array(y)) else 1.0

    if stop is not None:
        limit |= {"eventsfn": stopped, "num_events": 1}
    solution = CVODE(fill, rtol=rtol, atol=atol, max_num_steps=most_steps or 10**7, **limit).solve(times, state)
    counts = {"jacobians": int(solution.njev)}
    if not solution.success:
        reason = f"{solution.message} at t = {solution.t[-1]:.6g} s"
        return len(solution.t), solution.y, "failed", reason, counts
    if solution.t[-1] < times[-1]:  # the event ended the run; its own time is the last one
        return len(solution.t) - 1, solution.y, "derailed", stop(solution.t[-1], solution.y[-1]), counts
    return len(solution.t), solution.y, "completed", "", counts
