"""Which method ``auto`` takes: the fastest rate bounds an explicit step, the motion that of a Rosenbrock method.

Measured on wheelsets, coach and metro car at 10 to 80 m/s, straight and in curves: where something excites motion on
and on, Rodas4P2 takes six or seven steps per metre (nine on a flexible track), where wheelsets hunt from flange to
flange many more, else few more than the longest step asks for. Whether lone wheelsets hunt on smooth straight track
their equations tell, linearised where they begin. Where a light part on a stiff spring follows the motion of others,
as many do not keep Rodas4 accurate: there its order drops. A step costs as much as six of Kutta's method, and more
where the whole Jacobian is renewed each time. Where stability bounds the steps Kutta's method takes two thirds of the
evaluations of Tsit5, and errs less.
`python -m tests.integrate.auto` compares what comes of it with the cheapest choice of equal error.
"""

import math
from contextlib import contextmanager

import numpy as np

from wrcore.dynamics.body import EULER, OMEGA, STATE_SIZE, VELOCITY
from wrcore.dynamics.contact_blocks import contacts_alone
from wrcore.dynamics.contract import places
from wrcore.dynamics.crossing import BEGIN, LAST, PERIOD, STEP, STRIDE
from wrcore.dynamics.drive import lowest_speed
from wrcore.dynamics.modes import ELLIPSES
from wrcore.integrate.jacobian import plan_sweep
from wrcore.integrate.tolerances import pace, step_tolerances

STABLE = 2.0
"""Length of the steps of Kutta's method where stability bounds them, times the fastest rate as it is found here."""

EXPLICIT, STIFF, JACOBIAN = 4.0, 13.0, 11.0
"""Cost in evaluations: a step of Kutta's method; one of Rodas4P2, six evaluations and their linear systems; its
Jacobian, of which a step renews the contacts' part. Where it renews all, that costs the evaluations that it takes on
top."""

STEPS_PER_METRE, ON_FLEXIBLE_TRACK, HUNTING = 6.5, 9.0, 40.0
"""Of Rodas4P2, on irregular rails or with wheelsets that may hunt; and with those that do so from flange to flange."""

DAMPED, HARDLY_DAMPED = 0.23, 0.02
"""Damping ratios of lateral motion above which it dies away, and below which it grows to the flanges."""

LONG_WAVE, DRIFT = 3.0, 0.01
"""Of lateral motion angular frequency over the speed at most, rad/m (hunting is a wave of metres, a wheel on its
contact vibrates faster), and growth without oscillation at least, 1/s."""

ACROSS = [1, 2, EULER + 1, EULER + 3, VELOCITY + 1, VELOCITY + 2, OMEGA, OMEGA + 2]
"""Lateral and vertical motion, roll and yaw, and their rates, among a body's states on straight track."""

PASSAGE, PER_METRE_ON_CHANGING_RAILS = 130.0, 45.0
"""The same where a wheelset passes rails that change, a crossing or a switch: steps of its impact, and on its way."""

PASSES, SETTLED, DISTURBANCE = 30, 10, 1e-8
"""Evaluations for the fastest rate, those that count, and the size of the disturbance in m (velocities, angles: as in
the tolerances)."""


def fastest_rate(model, equations, t, state):
    """Largest absolute eigenvalue (1/s) of the equations of motion at a state, roughly, by the power method; NaN where
    the state's rate is not finite. Counters and places of ``equations`` stay as they are."""
    unit, direction, growths = _disturbances(model, state), np.random.default_rng(0).normal(size=len(state)), []
    with _undisturbed(equations.work):
        base = equations(t, state, ELLIPSES)
        size = math.sqrt(direction.dot(direction) / len(state))
        for _ in range(PASSES):
            direction *= unit / (size or 1.0)
            direction = (equations(t, state + direction, ELLIPSES) - base) / unit
            size = math.sqrt(direction.dot(direction) / len(state))
            growths.append(size)
    return float(np.exp(np.mean(np.log(np.maximum(growths[-SETTLED:], 1e-300)))))


def lateral_damping(model, equations, t, state):
    """Least damping ratio of the lateral motion of lone wheelsets on smooth straight track, in long waves, by their
    equations linearised at a state; 1 where none is left to oscillate."""
    unit, columns = _disturbances(model, state), []
    across = (STATE_SIZE * model.bodies.wheelsets[:, None] + ACROSS).ravel()
    with _undisturbed(equations.work):
        base = equations(t, state, ELLIPSES)
        for i in across:
            moved = state.copy()
            moved[i] += unit[i]
            columns.append((equations(t, moved, ELLIPSES) - base)[across] / unit[i])
    if not np.isfinite(columns).all():
        return -1.0
    rates = np.linalg.eigvals(columns)
    rates = rates[(np.abs(rates.imag) < LONG_WAVE * model.speed) & (np.abs(rates) > DRIFT)]
    return float(min(-rates.real / np.abs(rates), default=1.0))


def _disturbances(model, state):
    """Of each component of a state, by which its rates are differenced."""
    unit = step_tolerances(model, 0.0, DISTURBANCE)
    return unit[0] + pace(model.bodies.wheelsets, model.contact.least_speed, state, state) * unit[1]


@contextmanager
def _undisturbed(work):
    """Leave counters and places of ``work`` as they are."""
    kept = [(array, array.copy()) for array in (*places(work), work.counters)]
    yield
    for array, before in kept:
        array[:] = before


def steps_on_changing_rails(model, start, distance):
    """Steps of Rodas4P2 per metre over a distance (m), or, where it is infinite, up to where all wheelsets have passed,
    for rails that change and wheels out of round."""
    strides, passages, after = 0.0, 0.0, 0.0
    for k, tables in enumerate(model.crossing.tables):
        s, steps = start[STATE_SIZE * model.bodies.wheelsets[k]], [0.0, 0.0]
        for (wheel, i), table in np.ndenumerate(tables):
            laid = model.crossing.laid[k, wheel, i]
            end = min(laid[BEGIN] + laid[STEP] * laid[LAST], s + distance)
            if table >= 0 and laid[PERIOD] > 0.0:
                strides = max(strides, 1.0 / laid[STRIDE])
            elif table >= 0 and end > max(laid[BEGIN], s):
                steps[wheel] += PASSAGE + PER_METRE_ON_CHANGING_RAILS * (end - max(laid[BEGIN], s))
                after = max(after, end - s)
        passages += max(steps)
    over = distance if math.isfinite(distance) else after
    return strides + (passages / over if passages > 0.0 else 0.0)


def cheaper_method(model, equations, t, state, longest_step, end=math.inf):
    """``rodas4p2`` or ``rk4``, whichever takes less for a run from a state at a time to its ``end`` (s), if that is
    known, with steps up to ``longest_step`` (s)."""
    bodies, slowest = model.bodies, min(lowest_speed(model), model.speed)
    if not slowest > 0.0:  # creep gets ever stiffer towards standstill, wherever the run begins
        return "rodas4p2"
    rough, cost = model.track.irregularity.coefficients.shape[0] > 0, STIFF + JACOBIAN
    lone = len(bodies.wheelsets) == len(bodies.mass)
    changing = steps_on_changing_rails(model, state, model.speed * (end - t))
    per_metre = STEPS_PER_METRE if rough or lone else 0.0
    if rough and len(model.flexible_track.mass):
        per_metre = ON_FLEXIBLE_TRACK
    elif lone and not rough and model.track.tangent:
        damping = lateral_damping(model, equations, t, state)
        if damping > HARDLY_DAMPED:
            per_metre = 0.0 if damping > DAMPED else STEPS_PER_METRE
        else:
            per_metre = HUNTING
    steps = 1.0 / longest_step + (per_metre + changing) * model.speed
    if (rough or changing) and not contacts_alone.py_func(model):  # on smooth rails wheelsets may take far fewer steps
        cost += len(plan_sweep(model).starts)
    rate = fastest_rate(model, equations, t, state) * model.speed / slowest
    return "rk4" if EXPLICIT * rate / STABLE < cost * steps else "rodas4p2"
