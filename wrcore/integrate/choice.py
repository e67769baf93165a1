"""Choice of the integration method of a run by ``auto``, which compares costs at intervals and tries the other method.

Rodas5 is efficient for stiff motion. Kutta's method is efficient for motion that needs short steps anyway: rough rails
at speed, wheelsets that hunt from flange to flange, a crossing. A run begins with Rodas5. If stability limits the steps
of Kutta's method, its cost is estimated from the fastest rate (it then needs two thirds of the evaluations of Tsit5,
with a smaller error). Otherwise the cost is measured by continuing with the other method for some steps. These steps
are part of the run, so that no work is lost. Work is counted, not timed: a run is bitwise identical on any machine.
The notes of the choice are part of a checkpoint. `python -m tests.integrate.auto` compares the result with the
cheapest method of equal error.
"""

import math
from contextlib import contextmanager
from enum import IntEnum

import numpy as np

from wrcore.equations.equations_of_motion import derivatives_at
from wrcore.equations.interface import places
from wrcore.equations.pace import pace
from wrcore.errors import InputError
from wrcore.integrate.engine import EVALUATIONS, JACOBIANS, REJECTED, STEPS, T
from wrcore.integrate.tableaus import ROSENBROCK
from wrcore.integrate.tolerances import step_tolerances
from wrcore.jacobian.flexible_track import without_mass
from wrcore.kernels.jit import jit
from wrcore.wheels.modes import ELLIPSES

CHOICES = ("rodas5", "rk4")
"""Methods of ``auto``; a run begins with the first one."""

STABLE, EXPLICIT = 2.0, 4.0
"""Step length of Kutta's method at its stability bound times the rate of `fastest_rate`; evaluations per step."""

LINEAR, CONTACTS = 0.6, 3.0
"""Cost of a stage's linear system, and of the contacts' part of a Jacobian, in evaluations. Timed costs of six stages
with a Jacobian are 4.8 for a wheelset, 6 for a coach, 8.5 for a metro car."""

BALANCE = 3.2
"""Cost of solving for the speeds of rails without mass, in evaluations. Explicit methods solve in each evaluation,
methods with implied speeds in two evaluations of a step."""

FIRST, LAST, APART = {"rodas5": 16, "rk4": 120}, {"rodas5": 320, "rk4": 1600}, {"rodas5": 2.0, "rk4": 4.0}
"""Intervals between comparisons for each method, in attempts: the first after a trial, the maximum, and the factor by
which the interval grows each time. Runs by Kutta's method try the other method at each comparison."""

COUNTED, TIGHT, FALLING = {"rodas5": (0.65, 1.3), "rk4": (1.0, 1.0)}, 1e-4, 0.3
"""Factors on the work of a method in comparisons: the minimum, and the factor at the tolerance ``TIGHT`` and looser
ones. Between them the factor is proportional to the tolerance to the power of ``FALLING`` and reaches the minimum at
1e-5. At 1e-4 the error of Kutta's method is a tenth of that of Rodas5 where a wheelset hunts. With 1.3 the error of
`auto` there is 1.6 µm in 8 s, with 1.0 it is 8 µm. At 1e-5 this accuracy is not needed: 0.65 compares only evaluations.
With 1.3 a run at 1e-5 took 1.1 to 2.2 times the evaluations of Rodas5."""

GROWING, TRIED = 8, 16
"""Attempts of a trial in which its step size settles, and attempts whose cost is then compared."""

WORTH, HOPELESS = 0.9, 5.0
"""The other method is tried if its estimated cost is below 0.9 of the present cost. While its step size settles, the
trial is stopped if it costs 5 times as much as the method before."""

PASSES, SETTLING, DISTURBANCE = 30, 10, 1e-8
"""Number of evaluations for the fastest rate, number of these that are averaged, and the size of the disturbance in m
(velocities and angles are scaled as in the tolerances)."""

SETTLED, BEGINNING, ON_TRIAL = range(3)
"""Phases between two comparisons: no trial, step size of a trial settles, cost of a trial is measured."""


class Note(IntEnum):
    """Indices in the notes of a run by ``auto``."""

    DUE = 0
    """Number of attempts at which the next comparison is due."""
    INTERVAL = 1
    """Attempts between the last two comparisons, without trials."""
    PHASE = 2
    """`SETTLED`, `BEGINNING` or `ON_TRIAL`."""
    OTHER = 3
    """Last measured cost of the other method, evaluations per s, with the factor `COUNTED`."""
    USED = 4
    """Methods that the run has used: bit k for the method at index k in `CHOICES`."""
    WORK = 5
    """Work up to the last comparison, in evaluations."""
    SINCE = 6
    """Time of the last comparison, s, followed by three counters at this time."""


NOTES = Note.SINCE + 4
"""Number of notes."""


def no_notes():
    """Return the empty notes of a run by a given method, which never compares methods."""
    return np.zeros(0)


def first_notes(method, memory):
    """Return the notes of a run that begins with ``method``."""
    notes = np.zeros(NOTES)
    notes[Note.OTHER], notes[Note.INTERVAL] = np.inf, FIRST[method]
    _mark(notes, memory, method, ON_TRIAL, GROWING)
    return notes


def checked_notes(checkpoint):
    """Return a copy of the notes of a checkpoint; raise an InputError if they are not valid notes of a run."""
    notes = no_notes() if checkpoint.notes is None else np.asarray(checkpoint.notes)
    if notes.shape == (0,):
        return no_notes()
    expected = f"expected {NOTES} notes of a run by auto"
    if notes.shape != (NOTES,) or notes.dtype != float or checkpoint.method not in CHOICES:
        raise InputError("start", "checkpoint", f"{expected}, got {notes.dtype} {notes.shape} by {checkpoint.method}")
    sane = notes[Note.PHASE] in (SETTLED, BEGINNING, ON_TRIAL) and notes[Note.USED] in (1.0, 2.0, 3.0)
    sane = sane and notes[Note.INTERVAL] >= 1.0 and notes[Note.OTHER] >= 0.0
    if not (sane and np.isfinite(np.delete(notes, Note.OTHER)).all()):
        raise InputError("start", "checkpoint", f"{expected}, got {notes}")
    return notes.copy()


def used(notes, method):
    """Return the names of the methods that a run has used, separated by commas."""
    return ", ".join(m for k, m in enumerate(CHOICES) if int(notes[Note.USED]) >> k & 1) if len(notes) else method


def attempts(counters):
    """Return the number of attempted steps: accepted and rejected ones."""
    return int(counters[STEPS] + counters[REJECTED])


def work(model, method, evaluations, tried, jacobians):
    """Return the work of a method, in evaluations of the right-hand side.

    It includes the cost of linear systems in ``tried`` attempts, of ``jacobians``, and of the speeds of massless rails.
    """
    stages = len(ROSENBROCK[method].nodes) if method in ROSENBROCK else 0
    balances = 2 * tried if method in ROSENBROCK and ROSENBROCK[method].reuse == 1 else evaluations
    return evaluations + LINEAR * stages * tried + CONTACTS * jacobians + _balance(model) * balances


def _balance(model):
    """Return the cost of solving for the speeds of massless rails, in evaluations; 0 for other tracks."""
    return BALANCE if without_mass.py_func(model) else 0.0


def counted(method, tolerance):
    """Return the factor on the work of a method at a relative tolerance, see `COUNTED`."""
    least, largest = COUNTED[method]
    return max(least, largest * min(1.0, tolerance / TIGHT) ** FALLING)


def work_of(model, checkpoint):
    """Return the work of a run by ``auto`` up to its checkpoint, in evaluations, without that of comparisons."""
    notes = checkpoint.notes
    return notes[Note.WORK] + work(model, checkpoint.method, *(_reached(checkpoint.memory) - notes[Note.SINCE :])[1:])


def method_after(notes, method, model, equations, memory, tolerance):
    """Compare the methods at a relative ``tolerance``, update the notes and return the method for the next steps."""
    other = CHOICES[1 - CHOICES.index(method)]
    gone = _reached(memory) - notes[Note.SINCE :]
    done, phase, interval = work(model, method, *gone[1:]), int(notes[Note.PHASE]), notes[Note.INTERVAL]
    spent = counted(method, tolerance) * done / gone[0] if gone[0] > 0.0 else np.inf
    later = min(APART[method] * interval, LAST[method])
    notes[Note.WORK] += done
    if phase != SETTLED and spent > notes[Note.OTHER] * (HOPELESS if phase == BEGINNING else 1.0):
        notes[Note.OTHER] = spent
        _mark(notes, memory, other, SETTLED, interval)  # back to the method before the trial
        return other
    if phase == BEGINNING:
        _mark(notes, memory, method, ON_TRIAL, TRIED)
    elif phase == ON_TRIAL:
        _mark(notes, memory, method, SETTLED, FIRST[method])
    elif min(notes[Note.OTHER], _promised(other, model, equations, memory, tolerance)) < WORTH * spent:
        notes[Note.OTHER], notes[Note.INTERVAL] = spent, later
        _mark(notes, memory, other, BEGINNING, GROWING)
        return other
    else:
        _mark(notes, memory, method, SETTLED, later)
    return method


def _promised(method, model, equations, memory, tolerance):
    """Return a lower bound of a method's cost from the present state on, evaluations per s with factor `COUNTED`."""
    if method in ROSENBROCK:
        return 0.0
    rate = fastest_rate(model, equations, memory.clock[T], memory.state)
    return counted(method, tolerance) * EXPLICIT * (1.0 + _balance(model)) * rate / STABLE


def _reached(memory):
    counters = memory.counters
    return np.array([memory.clock[T], counters[EVALUATIONS], attempts(counters), counters[JACOBIANS]])


def _mark(notes, memory, method, phase, ahead):
    """Write time, counters and phase to the notes; the next comparison is due after ``ahead`` further attempts."""
    if phase == SETTLED:
        notes[Note.INTERVAL] = ahead
    notes[Note.PHASE], notes[Note.DUE] = phase, attempts(memory.counters) + ahead
    notes[Note.USED] = int(notes[Note.USED]) | 1 << CHOICES.index(method)
    notes[Note.SINCE :] = _reached(memory)


def fastest_rate(model, equations, t, state):
    """Estimate the maximum absolute eigenvalue (1/s) of the equations of motion at a state by the power method.

    The result is NaN if the state's rate is not finite. Counters and starting values of searches in ``equations`` are
    not changed."""
    grow, arguments = power_method(model, equations, t, state)
    with _undisturbed(equations.work):
        grow(*arguments)
    return float(np.exp(np.mean(np.log(np.maximum(arguments[0][-SETTLING:], 1e-300)))))


def power_method(model, equations, t, state):
    """Return the kernel of `fastest_rate` and its arguments; it fills the first one with the growth of each pass."""
    direction, scratch = np.random.default_rng(0).normal(size=len(state)), np.empty((3, len(state)))
    return _grow, (np.empty(PASSES), _disturbances(model, state), direction, scratch, t, state, *equations.arguments)


@jit(allocates=False, nogil=True)
def _grow(growths, unit, direction, scratch, t, state, equations, model, work):
    base, there, rate = scratch[0], scratch[1], scratch[2]
    derivatives_at(equations, t, state, model, work, base, ELLIPSES)
    size = _mean_size(direction)
    for k in range(growths.shape[0]):
        for i in range(state.shape[0]):
            direction[i] *= unit[i] / (size or 1.0)
            there[i] = state[i] + direction[i]
        derivatives_at(equations, t, there, model, work, rate, ELLIPSES)
        for i in range(state.shape[0]):
            direction[i] = (rate[i] - base[i]) / unit[i]
        growths[k] = size = _mean_size(direction)


@jit(allocates=False)
def _mean_size(vector):
    """Root mean square of the components of a vector."""
    total = 0.0
    for value in vector:
        total += value * value
    return math.sqrt(total / vector.shape[0])


def _disturbances(model, state):
    """Return the disturbance of each component of a state for differences of rates."""
    unit = step_tolerances(model, 0.0, DISTURBANCE)
    return unit[0] + pace(model.bodies.wheelsets, model.contact.least_speed, state, state) * unit[1]


@contextmanager
def _undisturbed(work):
    """Restore counters and starting values of searches in ``work`` on exit."""
    kept = [(array, array.copy()) for array in (*places(work), work.counters)]
    yield
    for array, before in kept:
        array[:] = before
