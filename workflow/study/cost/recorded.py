"""Evaluations of the equations of motion at the states of a run: what a right-hand side costs where it is needed."""

import time
from functools import partial
from typing import NamedTuple

import numpy as np

from study.cost.timing import Contender
from wrcore.bodies.body import STATE_SIZE
from wrcore.equations.equations_of_motion import Equations, fill_many
from wrcore.equations.model import Model
from wrcore.errors import InputError
from wrcore.integrate.integrator import integrate
from wrcore.scene.compile import compile_scene

LASTING = 5e-3
"""Processor time of a timed call, s: a thousand times what a call from Python into compiled code costs."""


class Recorded(NamedTuple):
    """A model and states that one of its runs went through, each moved back along the track to where it began."""

    model: Model
    states: np.ndarray
    """(n, size)."""


def record(scene, duration, count):
    """States at equal intervals of a run of a duration (s) on tangent, perfect track, which looks the same at every
    place and time; InputError for another track.
    """
    if not scene.track.tangent:
        raise InputError(scene.source, "track", "expected a tangent, perfect track where evaluations are timed")
    model, start = compile_scene(scene)
    run = integrate(model, start, np.linspace(0.0, duration, count + 1))
    states = run.states[1:].copy()
    bodies = STATE_SIZE * len(model.bodies.mass)
    states[:, 0:bodies:STATE_SIZE] -= model.speed * run.t[1:, None]
    return Recorded(model, states)


def lasting(label, call, arrays, units):
    """Contender that calls with so many copies of arrays, repeated along their first axis, that it can be timed;
    ``units`` are those of one pass over the arrays.
    """
    call(*arrays)
    started = time.process_time()
    call(*arrays)
    turns = max(1, int(LASTING / max(time.process_time() - started, 1e-6)))
    copies = [np.ascontiguousarray(np.concatenate([array] * turns)) for array in arrays]
    return Contender(label, partial(call, *copies), units * turns)


def evaluation(label, recorded):
    """Contender that evaluates the right-hand side at all recorded states, over and over; its units are evaluations."""
    equations, model, work = Equations(recorded.model).arguments

    def evaluate(states, rates):
        fill_many(equations, 0.0, states, model, work, rates)

    return lasting(label, evaluate, (recorded.states, np.empty_like(recorded.states)), len(recorded.states))
