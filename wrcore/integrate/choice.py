"""By which method a run by ``auto`` goes on: now and then it looks at what it costs, and tries the other.

Rodas5 is for stiffness, Kutta's method for motion that wants short steps anyway: rough rails at speed, wheelsets that
hunt from flange to flange, a crossing. Where it begins no run knows what it will meet, so it begins by Rodas5. What
Kutta's method costs where stability bounds its steps is known beforehand, by the fastest rate (it takes two thirds of
the evaluations of Tsit5 then, and errs less); all else is found by going on by the other method for a while, which is
no waste: those steps are of the run. Work is counted, not timed, so that a run has the same bits on any machine, and
notes are part of a checkpoint. `python -m tests.integrate.auto` compares what comes of it with the cheapest choice of
equal error.
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
"""What ``auto`` goes by, in the beginning by the first."""

STABLE, EXPLICIT = 2.0, 4.0
"""Length of the steps of Kutta's method where stability bounds them, times the fastest rate as it is found here; and
evaluations that one takes."""

LINEAR, CONTACTS = 0.6, 3.0
"""Price of a stage's linear system, and of the contacts' part of a Jacobian, in evaluations, as timed: of six stages
with a Jacobian 4.8 for a wheelset, 6 for a coach, 8.5 for a metro car."""

BALANCE = 3.2
"""Price of the balance of rails without mass, in evaluations: explicit methods look for it in each, those that go by
implied speeds in two of a step."""

FIRST, LAST, APART = {"rodas5": 16, "rk4": 120}, {"rodas5": 320, "rk4": 1600}, {"rodas5": 2.0, "rk4": 4.0}
"""Attempts by a method, once its steps have found their length and a trial is over, before the first look, and between
two at most: there are so many times as many each time. Those by Kutta's method always try the other."""

COUNTED, TIGHT, FALLING = {"rodas5": (0.65, 1.3), "rk4": (1.0, 1.0)}, 1e-4, 0.3
"""Factors on the work of a method where the two are compared: the least one and the one at the tolerance ``TIGHT`` or a
looser one. Between them the factor falls as the tolerance to the power of ``FALLING``: the least one holds from 1e-5.
At 1e-4 the error of Kutta's method is a tenth where a wheelset hunts. With 1.3 the error of `auto` there is 1.6 um in
8 s, with 1.0 it is 8 um. At 1e-5 this accuracy is not needed: 0.65 compares evaluations alone. With 1.3 a run at 1e-5
took 1.1 to 2.2 times the evaluations of Rodas5."""

GROWING, TRIED = 8, 16
"""Attempts of a trial in which its steps find their length, and those that are judged."""

WORTH, HOPELESS = 0.9, 5.0
"""Of what the method costs the other has to promise less, and what costs so many times as much while its steps still
grow is tried no further."""

PASSES, SETTLING, DISTURBANCE = 30, 10, 1e-8
"""Evaluations for the fastest rate, those that count, and the size of the disturbance in m (velocities, angles: as in
the tolerances)."""

SETTLED, BEGINNING, ON_TRIAL = range(3)
"""Phases between two looks."""


class Note(IntEnum):
    """Places in the notes of a run by ``auto``."""

    DUE = 0
    """Attempts at which the next look is due."""
    INTERVAL = 1
    """Attempts between it and the one before, trials left out."""
    PHASE = 2
    OTHER = 3
    """What the other method was last seen to cost, evaluations per s, as `COUNTED`."""
    USED = 4
    """Of which methods the run has made use: bit k for that at place k in `CHOICES`."""
    WORK = 5
    """All that was done up to the last look, in evaluations."""
    SINCE = 6
    """Time of the last look, s, and counters then, in three more places."""


NOTES = Note.SINCE + 4


def no_notes():
    """Of a run by a method that was asked for: it never looks."""
    return np.zeros(0)


def first_notes(method, memory):
    """Notes of a run that begins by a method."""
    notes = np.zeros(NOTES)
    notes[Note.OTHER], notes[Note.INTERVAL] = np.inf, FIRST[method]
    _mark(notes, memory, method, ON_TRIAL, GROWING)
    return notes


def checked_notes(checkpoint):
    """Notes of a checkpoint, a copy; an InputError where no run has left them so."""
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
    """Methods that a run has made use of, by name."""
    return ", ".join(m for k, m in enumerate(CHOICES) if int(notes[Note.USED]) >> k & 1) if len(notes) else method


def attempts(counters):
    """Steps that were tried so far."""
    return int(counters[STEPS] + counters[REJECTED])


def work(model, method, evaluations, tried, jacobians):
    """What was done, in evaluations of the right-hand side: so many, attempts, and Jacobians."""
    stages = len(ROSENBROCK[method].nodes) if method in ROSENBROCK else 0
    balances = 2 * tried if method in ROSENBROCK and ROSENBROCK[method].reuse == 1 else evaluations
    return evaluations + LINEAR * stages * tried + CONTACTS * jacobians + _balance(model) * balances


def _balance(model):
    """Price of a balance, 0 where rails are rigid or have masses."""
    return BALANCE if without_mass.py_func(model) else 0.0


def counted(method, tolerance):
    """Factor on the work of a method at a relative tolerance, see `COUNTED`."""
    least, largest = COUNTED[method]
    return max(least, largest * min(1.0, tolerance / TIGHT) ** FALLING)


def work_of(model, checkpoint):
    """What a run by ``auto`` that ended with a checkpoint did in all but its looks, in evaluations."""
    notes = checkpoint.notes
    return notes[Note.WORK] + work(model, checkpoint.method, *(_reached(checkpoint.memory) - notes[Note.SINCE :])[1:])


def method_after(notes, method, model, equations, memory, tolerance):
    """The method by which a run of a relative ``tolerance`` goes on at a look; notes the look."""
    other = CHOICES[1 - CHOICES.index(method)]
    gone = _reached(memory) - notes[Note.SINCE :]
    done, phase, interval = work(model, method, *gone[1:]), int(notes[Note.PHASE]), notes[Note.INTERVAL]
    spent = counted(method, tolerance) * done / gone[0] if gone[0] > 0.0 else np.inf
    later = min(APART[method] * interval, LAST[method])
    notes[Note.WORK] += done
    if phase != SETTLED and spent > notes[Note.OTHER] * (HOPELESS if phase == BEGINNING else 1.0):
        notes[Note.OTHER] = spent
        _mark(notes, memory, other, SETTLED, interval)  # where it came from
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
    """Evaluations per s, as `COUNTED`, that a method may take from here on, at least."""
    if method in ROSENBROCK:
        return 0.0
    rate = fastest_rate(model, equations, memory.clock[T], memory.state)
    return counted(method, tolerance) * EXPLICIT * (1.0 + _balance(model)) * rate / STABLE


def _reached(memory):
    counters = memory.counters
    return np.array([memory.clock[T], counters[EVALUATIONS], attempts(counters), counters[JACOBIANS]])


def _mark(notes, memory, method, phase, ahead):
    """Note where a run by a method is, and that the next look is due so many attempts ahead."""
    if phase == SETTLED:
        notes[Note.INTERVAL] = ahead
    notes[Note.PHASE], notes[Note.DUE] = phase, attempts(memory.counters) + ahead
    notes[Note.USED] = int(notes[Note.USED]) | 1 << CHOICES.index(method)
    notes[Note.SINCE :] = _reached(memory)


def fastest_rate(model, equations, t, state):
    """Largest absolute eigenvalue (1/s) of the equations of motion at a state, roughly, by the power method; NaN where
    the state's rate is not finite. Counters and places of ``equations`` stay as they are."""
    grow, arguments = power_method(model, equations, t, state)
    with _undisturbed(equations.work):
        grow(*arguments)
    return float(np.exp(np.mean(np.log(np.maximum(arguments[0][-SETTLING:], 1e-300)))))


def power_method(model, equations, t, state):
    """The kernel of `fastest_rate`, and its arguments, the first of which it fills with the growth of each pass."""
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
    """Root of the mean square."""
    total = 0.0
    for value in vector:
        total += value * value
    return math.sqrt(total / vector.shape[0])


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
