"""Hard cases of the integration: tolerances, steps, Baumgarte's parameters, long runs, restarts."""

from dataclasses import replace
from itertools import product

import numpy as np
from scipy.optimize import brentq

from study.hard_cases.cases import Check, prepare, rows, run, sound
from wrcore.analysis.stability.stability import LARGEST_RESIDUAL, straight_ahead
from wrcore.balance.linear import steady_running
from wrcore.bodies.body import STATE_SIZE
from wrcore.bodies.joint import evaluate_joints
from wrcore.bodies.joint_forces import constraint_workspace
from wrcore.equations.equations_of_motion import Equations
from wrcore.integrate.integrator import integrate
from wrcore.integrate.tableaus import EXPLICIT, ROSENBROCK
from wrcore.integrate.tolerances import LENGTH, SHARE
from wrcore.run.simulate import output_times

LARGEST_ERROR = 30.0
"""Maximum global error of a run of 1 s, relative to the accepted error of one step (rtol times 1 cm)."""

TO_FLANGE = 4e-3
"""Distance to flange contact at 6 mm of a wheelset released at 2 mm, m. A run may derail if the accepted error of a
step is larger. For rk4 (`SHARE` 5) it is 5 mm at rtol 0.1. The steps of 3 to 6 ms are then longer than the stable
2.1 ms, and all six runs that start at 1.8 to 2.01 mm derail. At rtol 0.05 no run derails."""

OVER_THE_FLANGE = "one step may have a larger error than the travel to the flange: a run can derail"

STABILITY_MATCH = 0.15
"""Maximum difference between found and predicted stable step, relative to the predicted one. They differ because
friction is nonlinear."""

SEARCH = 1.04
"""Ratio of the bounds at which the search for the maximum stable step ends."""

GROWS = "above the critical speed the motion grows of itself, with steps of metres by an old Jacobian faster"

BOUNDED = "below 0.3 m/s trials settle at creepages where friction is softer than the linear one: longer steps pass"
"""Reason for stable steps above the predicted ones, from the suspended wheelset at 0.1 m/s. Trials deviate by up to
3.6e-5 m/s, a creepage of 3.6e-4. Derivatives of the creep force, as difference quotients over 1e-4 m/s, are 3 to 13 %
smaller than at rest. With 1.1 times the predicted step, ``rk45`` stays within this deviation for 400 steps. With 1.2
times this step it deviates by 4e-4 m/s, and at times is again below the 4e-5 m/s that a trial may have."""

DISTURBANCE = 1e-8
"""Disturbance of velocities at the start of a trial, m/s and rad/s. It is so small that friction is linear at
0.1 m/s."""

GROWTH = 1e3
"""Growth of the difference between two runs above which a trial is unstable. Hunting needs seconds for such growth."""

UNSTEADY, SETTLING = 1e-4, 3e-5
"""Bounds of the deviation of velocities from steady running: part of the speed, and absolute value (m/s, rad/s). A
trial beyond their sum is unstable too: both runs may have the same oscillation, which friction bounds at creepages of
some 1e-3. The second number allows for settling, because computed steady states are less accurate at low speed."""

LONGEST_TRIAL = 1.0
"""Maximum duration of a trial, s."""

VIOLATION = 1e-5
"""Maximum violation of a joint, m or rad: a tenth of the bushes' play."""


def tolerance_ladder(vehicles, names, speed, rtols, methods, detections, duration):
    """Run every method with loose to tight tolerances at a speed (m/s) for a duration (s).

    Each run must complete, and errors must decrease with the tolerance. Returns rows of the table, and curve of error_m
    (maximum in y), steps and wall_s over rtol.
    """
    found, curve = [], []
    for name, detection in product(names, detections):
        base = {"speed": speed, "contact.detection": detection, "initial.y": 0.002}
        tight = {"integration.method": "tsit5", "integration.rtol": 1e-11, "integration.atol": 1e-14}
        exact = run(prepare(vehicles, name, base | tight), duration).states
        for method, rtol in product(methods, rtols):
            changes = {"integration.method": method, "integration.rtol": rtol, "integration.atol": 1e-3 * rtol}
            setting = prepare(vehicles, name, base | changes)
            trajectory = run(setting, duration)
            size = STATE_SIZE * int(setting.model.bodies.wheelsets[0]) + 1
            y, reference = trajectory.states[:, size], exact[: len(trajectory.t), size]
            error = float(np.max(np.abs(y - reference)))
            label = {"vehicle": name, "detection": detection, "integrator": method, "rtol": rtol}
            curve.append(label | {"error_m": error, "steps": trajectory.steps, "wall_s": trajectory.wall_s})
            limit = LARGEST_ERROR * rtol * LENGTH + 1e-10
            loose = OVER_THE_FLANGE if SHARE.get(method, 1.0) * rtol * LENGTH > TO_FLANGE else ""
            source = f"{LARGEST_ERROR:g} times what a step may err by"
            checks = [
                *sound(setting, trajectory)[:1],
                Check("error of y", error, limit, "m", source, known_limit=loose),
            ]
            condition = f"{speed:g} m/s, rtol {rtol:g}"
            found += rows("integration", "tolerances", condition, setting, trajectory, checks, known_limit=loose)
    return found, curve


def amplification(method, z):
    """Return the stability function R(z) of a method: the factor of a step for y' = lambda y, with z = h lambda.

    ``z`` is an array of any shape.
    """
    z = np.asarray(z, complex)
    if method in EXPLICIT:
        weights, terms = EXPLICIT[method].stages, []
        total = np.ones_like(z)
        for i in range(len(weights)):
            stage = np.ones_like(z) + sum((z * weights[i, j] * terms[j] for j in range(i)), np.zeros_like(z))
            terms.append(stage)
            total = stage  # the last stage is evaluated at the new state
        return total
    table, gamma = ROSENBROCK[method], ROSENBROCK[method].gamma
    increments = []
    for i in range(len(table.weights)):
        inner = 1.0 + sum((table.stages[i, j] * increments[j] for j in range(i)), np.zeros_like(z))
        right = z * inner + sum((table.couplings[i, j] * increments[j] for j in range(i)), np.zeros_like(z))
        increments.append(right / (1.0 / gamma - z))
    return 1.0 + sum(w * u for w, u in zip(table.weights, increments, strict=True))


def predicted_step(method, eigenvalues, longest):
    """Return the maximum fixed step (s) at which a method damps all decaying motions; ``longest`` if unbounded."""
    decaying = eigenvalues[eigenvalues.real < -1e-6]

    def excess(step):
        return float(np.max(np.abs(amplification(method, step * decaying)))) - 1.0

    steps = np.geomspace(1e-8, longest, 400)
    over = np.flatnonzero([excess(step) > 1e-9 for step in steps])
    if not over.size:
        return longest
    first, last = steps[over[0] - 1], steps[over[0]]
    return float(brentq(excess, first, last)) if over[0] and excess(first) < 0.0 else float(last)


def stability_map(vehicles, names, speeds, methods, longest):
    """Compare the maximum stable fixed step of every method over speed (m/s) with that of the linearised motion.

    Steps are limited to ``longest`` (s). Returns rows of the table, and curve of predicted_s and found_s.
    """
    found, curve = [], []
    for name, speed in product(names, speeds):
        setting = prepare(vehicles, name, {"speed": speed, "initial.y": 0.0})
        model, state = straight_ahead(setting.scene)
        values = np.linalg.eigvals(steady_running(model, state).matrix)
        setting = replace(setting, model=model, state=state)
        for method in methods:
            predicted = predicted_step(method, values, longest)
            largest, trajectory = _largest_step(setting, method, predicted, longest)
            curve.append({"vehicle": name, "integrator": method, "speed_m_per_s": speed, "predicted_s": predicted,
                          "found_s": largest})  # fmt: skip
            off = abs(largest / predicted - 1.0)
            checks = [Check("largest stable step off the linear one's, of it", off, STABILITY_MATCH + SEARCH - 1.0, "1",
                            "|R(h lambda)| <= 1 for all eigenvalues of the linearised motion",
                            known_limit=step_limit(speed, values, largest > predicted))]  # fmt: skip
            control = replace(trajectory, method=method)
            found += rows("integration", "largest stable step", f"{speed:g} m/s", setting, control, checks)
    return found, curve


def step_limit(speed, values, longer):
    """Return the reason for which the maximum stable step may differ from that of the linearised motion, or "".

    The speed is in m/s, the eigenvalues ``values`` in 1/s. ``longer`` is True if the step found is longer."""
    if values.real.max() > 1.0:
        return GROWS
    return BOUNDED if longer and UNSTEADY * speed < SETTLING else ""


def _nudged(model, state):
    """Return a copy of a state with all velocities disturbed by `DISTURBANCE`."""
    state = state.copy()
    for body in range(len(model.bodies.mass)):
        at = STATE_SIZE * body
        state[at + 7 : at + 13] += DISTURBANCE * np.array([1.0, 1.0, 0.3, 0.5, 1.0, 0.5])
    return state


def _largest_step(setting, method, guess, longest):
    """Return the maximum stable step (s) near a guess, and the run with it.

    The step is bracketed by factors, then bisected on its logarithm.
    """

    twin = _nudged(setting.model, setting.state)

    def stable(step):
        times = np.linspace(0.0, int(np.clip(LONGEST_TRIAL / step, 20, 400)) * step, 11)
        one, other = (integrate(setting.model, state, times, method, step=step) for state in (setting.state, twin))
        if one.status != "completed" or other.status != "completed":
            return False, one
        places = _velocities(setting.model)
        apart = np.max(np.abs(other.states[-1] - one.states[-1])[places])
        moved = np.max(np.abs(one.states[-1] - setting.state)[places])
        still = UNSTEADY * setting.model.speed + SETTLING + LARGEST_RESIDUAL * times[-1]
        return bool(apart < GROWTH * DISTURBANCE and moved < still), one

    low, high = guess / 1.5, min(guess * 1.5, longest)
    fine, best = stable(low)
    while not fine and low > 1e-9:
        low, high = low / 2.0, low
        fine, best = stable(low)
    if high >= longest:
        fine, trial = stable(longest)
        if fine:
            return longest, trial
    while high / low > SEARCH:
        middle = np.sqrt(low * high)
        fine, trial = stable(middle)
        if fine:
            low, best = middle, trial
        else:
            high = middle
    return float(low), best


def _velocities(model):
    """Return the indices of the velocities in the state vector."""
    return np.concatenate([STATE_SIZE * body + np.arange(7, 13) for body in range(len(model.bodies.mass))])


def violations(model, times, states):
    """Return the maximum violation of the joints' equations at each time, m or rad, shape (n,)."""
    equations, work = Equations(model), constraint_workspace(model.joints)
    largest = np.zeros(len(times))
    for i, (t, state) in enumerate(zip(times, states, strict=True)):
        equations(t, np.ascontiguousarray(state))
        evaluate_joints(model.joints, t, model.speed, state, equations.work.rotations, work.joints)
        largest[i] = np.max(np.abs(work.joints.phi))
    return largest


def baumgarte(vehicles, name, pairs, duration, methods):
    """Measure drift of joints and number of steps with Baumgarte's feedback, from none to very stiff.

    ``pairs`` are alpha and beta (1/s); runs take a duration (s). Returns rows of the table, and curve of violation_m,
    steps, smallest_step_s and fastest_root_per_s.
    """
    found, curve = [], []
    for method, (alpha, beta) in product(methods, pairs):
        changes = {"integration.method": method, "integration.baumgarte.alpha": alpha, "initial.y": 0.004}
        setting = prepare(vehicles, name, changes | {"integration.baumgarte.beta": beta})
        trajectory = run(setting, duration, 100.0)
        drift = float(np.max(violations(setting.model, trajectory.t, trajectory.states)))
        root = float(np.max(np.abs(np.roots([1.0, 2.0 * alpha, beta**2])))) if alpha or beta else 0.0
        curve.append({"integrator": method, "alpha_per_s": alpha, "beta_per_s": beta, "violation_m": drift,
                      "steps": trajectory.steps, "smallest_step_s": trajectory.smallest_step,
                      "fastest_root_per_s": root})  # fmt: skip
        checks = [
            *sound(setting, trajectory)[:1],
            Check("largest violation of a joint", drift, VIOLATION, "m", "1e-5 m, if there is feedback",
                  known_limit="" if alpha and beta else "without damped feedback errors of joints accumulate"),
        ]  # fmt: skip
        found += rows("integration", "Baumgarte", f"alpha {alpha:g}, beta {beta:g} 1/s", setting, trajectory, checks)
    return found, curve


def long_run(vehicles, names, duration, changes, rate, methods):
    """Check that joints, Euler parameters and amplitude do not drift over hunting for a long duration (s).

    Outputs are at a rate (1/s). Returns rows of the table, and curve of violation_m and norm over t_s.
    """
    found, curve = [], []
    for name, method in product(names, methods):
        setting = prepare(vehicles, name, {**changes[name], "integration.method": method})
        trajectory = run(setting, duration, rate)
        y = trajectory.states[:, STATE_SIZE * int(setting.model.bodies.wheelsets[0]) + 1]
        tenth = len(trajectory.t) // 10
        early, late = np.std(y[4 * tenth : 7 * tenth]), np.std(y[-3 * tenth :])
        checks = [
            *sound(setting, trajectory),
            Check("change of the amplitude of y", abs(late / early - 1.0), 0.01, "1", "a limit cycle is steady: 1 %"),
        ]
        drift = np.zeros(len(trajectory.t))
        if setting.model.joints.equations:
            drift = violations(setting.model, trajectory.t, trajectory.states)
            growth = np.max(drift[-tenth:]) / max(np.max(drift[tenth : 2 * tenth]), 1e-12)
            checks += [
                Check("largest violation of a joint", float(np.max(drift)), VIOLATION, "m", "1e-5 m"),
                Check("last over first tenth's violation", float(growth), 2.0, "1", "bounded drift does not grow"),
            ]
        found += rows("integration", "long run", f"{duration:g} s of hunting", setting, trajectory, checks)
        shown = slice(None, None, max(tenth // 20, 1))
        label = {"vehicle": name, "integrator": trajectory.method}
        curve += [label | {"t_s": t, "violation_m": d} for t, d in zip(trajectory.t[shown], drift[shown], strict=True)]
    return found, curve


def restarts(vehicles, names, duration, pause, methods, detections):
    """Check that a run that is paused and continued is bitwise identical to the uninterrupted run."""
    found = []
    for name, method, detection in product(names, methods, detections):
        setting = prepare(vehicles, name, {"integration.method": method, "contact.detection": detection})
        whole = run(setting, duration)
        first = run(setting, pause)
        times = output_times(first.end.t, duration - pause, 200.0)
        control = {key: value for key, value in setting.control.items() if key != "method"}
        second = integrate(setting.model, first.end, times, **control)
        both = np.concatenate([first.states, second.states[1:]])
        same = both.shape == whole.states.shape and bool(np.array_equal(both, whole.states))
        checks = [Check("numbers that differ", float(not same), 0.0, "1", "same operations in the same order")]
        condition = f"{pause:g} s of {duration:g} s"
        found += rows("integration", "restart", condition, setting, replace(whole, status=second.status), checks)
    return found
