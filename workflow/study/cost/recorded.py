"""Timing of evaluations of the equations of motion at states of a run."""

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
"""Minimum processor time of a timed call, s; a thousand times the cost of a call from Python into compiled code."""


class Recorded(NamedTuple):
    """A model and states of one of its runs, each shifted along the track back to the starting point."""

    model: Model
    states: np.ndarray
    """State vectors, shape (n, size)."""


def record(scene, duration, count):
    """Run a scene for a duration (s) and return its model and ``count`` states at equal intervals.

    The track must be tangent and without irregularity, so that it is equal at all positions; InputError otherwise.
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
    """Return a `Contender` with arrays repeated along their first axis until a call takes about `LASTING`.

    ``units`` is the number of units in one pass over the original arrays.
    """
    call(*arrays)
    started = time.process_time()
    call(*arrays)
    turns = max(1, int(LASTING / max(time.process_time() - started, 1e-6)))
    copies = [np.ascontiguousarray(np.concatenate([array] * turns)) for array in arrays]
    return Contender(label, partial(call, *copies), units * turns)


def evaluation(label, recorded):
    """Return a `Contender` that repeatedly evaluates the right-hand side at all recorded states, in evaluations."""
    equations, model, work = Equations(recorded.model).arguments

    def evaluate(states, rates):
        fill_many(equations, 0.0, states, model, work, rates)

    return lasting(label, evaluate, (recorded.states, np.empty_like(recorded.states)), len(recorded.states))
