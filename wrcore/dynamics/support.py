"""Rails that give: a track under each wheelset that runs along with it, on springs and dampers to the ground.

Under each wheelset a piece of track carries both rails. Its freedoms q are

    left rail lateral, vertical; right rail lateral, vertical; sleeper lateral, vertical, roll

(m and rad; left and up positive, in the axes of the rails' frames), the sleeper's only where there is one. With the
forces f of the wheels on the rails, q obeys

    M q'' + C q' + K q = B f,   or, for rails without mass,   C q' + K q = f.

The piece runs along with its wheelset: nothing is handed on from one place of the track to the next. The wheel meets a
rail that is displaced by q and moves at q': in the rail's frame the wheelset's place and velocity are less by these.

Without mass, q' follows from forces that depend on it, by creepages and contact damping. The more a rail gives way, the
less it is pushed, so that there is one solution; Newton's method finds it for all rails at once, with steps that are
halved where they do not come closer. Derivatives by differences cost as much as two steps: they are taken at the first
one, and again where a step does not do what it should; else Broyden's update (Math. Comp. 19 (1965) 577) follows the
last step. It starts from rest each time: a state has one rate, whatever was before.

A friction that falls with slip can push more the more a rail gives way, and leave a weak damper no balance, or several.
Evaluations that end without one are counted.
"""

import math
from typing import NamedTuple

import numpy as np

from wrcore.contact.reduction import Y, Z
from wrcore.dynamics.body import STATE_SIZE
from wrcore.dynamics.modes import ELLIPSES, PATCHES_HELD
from wrcore.kernels.handles import call_address
from wrcore.kernels.jit import jit

RAILS = 4
"""Freedoms of both rails; those of the sleeper come after them."""

DIFFERENCE, LAST, ENOUGH, WELL, MOST = 1e-7, 1e-8, 0.1, 0.5, 60
"""Newton's method for rails without mass: difference of velocities (m/s), length of its last step (m/s; the error left
is a small part of it), part of what is left that a full step has to take off, largest part left with which derivatives
are kept, and most steps."""

UNBALANCED = 1e-4
"""Part of the forces on a rail that is left where there is no balance."""


class Support(NamedTuple):
    """The track under each wheelset, for kernels; of a rigid one all arrays are empty."""

    mass: np.ndarray
    """(d,): kg, and kg m^2 in roll; zeros for rails without mass."""
    stiffness: np.ndarray
    """(d, d): K."""
    damping: np.ndarray
    """(d, d): C."""
    first: int
    """Place of the first of its states among the own states: wheelset after wheelset, q, then q' where there are
    masses."""


class SupportWork(NamedTuple):
    """Scratch arrays of rails that give, for each wheelset and rail, lateral and vertical; none for a rigid track."""

    ground: np.ndarray
    """(k, 2, 2): velocities of the wheelset's centre over the ground, m/s."""
    speeds: np.ndarray
    """(k, 2, 2): q', m/s."""
    forces: np.ndarray
    """(k, 2, 2): f, N."""
    known: np.ndarray
    """(k, 2, 2): f without a difference in q', N."""
    slopes: np.ndarray
    """(k, 2, 2, 2): derivatives of f (last index) by q' (the one before), N s/m."""
    matrix: np.ndarray
    """(k, 2, 2, 2): derivatives of C q' + K q - f (the index before the last) by q' (the last), N s/m."""
    residuals: np.ndarray
    """(k, 2, 2): C q' + K q - f, N."""
    began: np.ndarray
    """(k, 2, 2): the same where the step began, N."""
    steps: np.ndarray
    """(k, 2, 2): of Newton's method, m/s."""
    left: np.ndarray
    """(k, 2): its size, N."""
    parts: np.ndarray
    """(k, 2): of Newton's full steps."""
    power: np.ndarray
    """(1,): f q', summed over all rails, W; 0 for a rigid track."""
    unbalanced: np.ndarray
    """(1,) int: counts evaluations in which rails without mass found no balance."""


def no_support():
    """A `Support` of a rigid track."""
    return Support(np.zeros(0), np.zeros((0, 0)), np.zeros((0, 0)), 0)


def support_size(support):
    """Number of states of the track under one wheelset."""
    return len(support.mass) * (2 if np.any(support.mass) else 1)


def support_work(support, wheelsets):
    """Scratch arrays for a `Support` and a number of wheelsets."""
    k = wheelsets if len(support.mass) else 0
    shapes = [(k, 2, 2)] * 4 + [(k, 2, 2, 2)] * 2 + [(k, 2, 2)] * 3 + [(k, 2)] * 2 + [(1,)]
    return SupportWork(*(np.zeros(shape) for shape in shapes), np.zeros(1, np.int64))


def support_places(model):
    """Places in the state of the track's own states, wheelset by wheelset: (k, size)."""
    size, first = support_size(model.support), STATE_SIZE * len(model.bodies.mass) + model.support.first
    return first + size * np.arange(len(model.bodies.wheelsets))[:, None] + np.arange(size)


def rails_at(model, state, k):
    """Displacements of the rails under the k-th wheelset: left and right, lateral and vertical (m), shape (2, 2)."""
    if not len(model.support.mass):
        return np.zeros((2, 2))
    return state[support_places(model)[k, :RAILS]].reshape(2, 2)


@jit(allocates=False)
def support_wrenches(model, state, work, rate, mode):
    """Wrenches of rails that give on all wheels, as by the kernel of the wheels, and the rates of the track's states,
    written into ``rate``; the motions in ``work``, over rails at rest, become those over rails that give."""
    support, own = model.support, work.support
    d, massless = support.mass.shape[0], support.mass[0] == 0.0
    size = d if massless else 2 * d
    first = STATE_SIZE * model.bodies.mass.shape[0] + support.first
    for k in range(own.speeds.shape[0]):
        for wheel in range(2):
            for i in range(2):
                at = first + size * k + 2 * wheel + i
                work.motions[k, wheel, 1 + i] -= state[at]
                own.ground[k, wheel, i] = work.motions[k, wheel, 7 + i]
                own.speeds[k, wheel, i] = 0.0 if massless else state[at + d]
    missed, on_grid = work.counters[1], work.counters[2]
    _press(model, work, -1, mode)
    if massless:
        _give_way(model, state, work, first, missed, on_grid, mode)
    own.power[0] = 0.0
    for k in range(own.speeds.shape[0]):
        at = first + size * k
        for i in range(RAILS):
            own.power[0] += own.forces[k, i // 2, i % 2] * own.speeds[k, i // 2, i % 2]
            rate[at + i] = own.speeds[k, i // 2, i % 2]
        for i in range(0 if massless else d):
            total = own.forces[k, i // 2, i % 2] if i < RAILS else 0.0
            for j in range(d):
                total -= support.stiffness[i, j] * state[at + j] + support.damping[i, j] * state[at + d + j]
            rate[at + i], rate[at + d + i] = state[at + d + i], total / support.mass[i]
        for wheel in range(2):
            for patch in range(work.counts[k, wheel]):
                work.patches[k, wheel, patch, Y] += state[at + 2 * wheel]
                work.patches[k, wheel, patch, Z] += state[at + 2 * wheel + 1]


@jit(allocates=False)
def _press(model, work, faster, mode):
    """Find the wrenches and the forces on the rails at the rails' speeds, in one direction (< 0: none) a bit faster."""
    own = work.support
    for k in range(own.speeds.shape[0]):
        for wheel in range(2):
            for i in range(2):
                speed = own.speeds[k, wheel, i] + (DIFFERENCE if i == faster else 0.0)
                work.motions[k, wheel, 7 + i] = own.ground[k, wheel, i] - speed
    call_address(
        model.wheels, model.contact, work.motions, work.patches, work.counts, work.bounds, work.rail_wrenches,
        work.counters, work.strips, mode,
    )  # fmt: skip
    for k in range(own.speeds.shape[0]):
        for wheel in range(2):
            for i in range(2):
                own.forces[k, wheel, i] = -work.rail_wrenches[k, wheel, 1 + i]


@jit(allocates=False)
def _find_slopes(model, work, mode):
    """Derivatives of the forces on the rails by the rails' speeds, where forces are known; patches stay. For patches on
    strips ellipses stand in, as in a Jacobian: the derivatives only lead to the solution."""
    own, rough = work.support, mode | ELLIPSES
    if model.contact.strips.strips > 0:
        _press(model, work, -1, rough)
    for k in range(own.speeds.shape[0]):
        for wheel in range(2):
            for i in range(2):
                own.known[k, wheel, i] = own.forces[k, wheel, i]
    for faster in range(2):
        _press(model, work, faster, rough | PATCHES_HELD)
        for k in range(own.speeds.shape[0]):
            for wheel in range(2):
                for i in range(2):
                    change = own.forces[k, wheel, i] - own.known[k, wheel, i]
                    own.slopes[k, wheel, faster, i] = change / DIFFERENCE


@jit(allocates=False)
def _renew_matrix(support, own, k, wheel, a, b, differences):
    """Derivatives of one rail's residuals a and b: by differences, or those before with Broyden's update."""
    matrix, step = own.matrix[k, wheel], own.steps[k, wheel]
    if differences:
        for i in range(2):
            for j in range(2):
                matrix[i, j] = -own.slopes[k, wheel, j, i]
            matrix[i, i] += support.damping[2 * wheel + i, 2 * wheel + i]
        return
    rest, scale = 1.0 - own.parts[k, wheel], 1.0 / (step[0] * step[0] + step[1] * step[1])
    a, b = scale * (a - rest * own.began[k, wheel, 0]), scale * (b - rest * own.began[k, wheel, 1])
    for j in range(2):
        matrix[0, j] += a * step[j]
        matrix[1, j] += b * step[j]


@jit(allocates=False)
def _step(support, own, k, wheel, differences):
    """Newton's step of one rail, or half of the last one, back, where that came no closer. Returns whether the next
    step wants derivatives by differences."""
    a, b = own.residuals[k, wheel, 0], own.residuals[k, wheel, 1]
    step, left, before = own.steps[k, wheel], math.sqrt(a * a + b * b), own.left[k, wheel]
    if left > (1.0 - ENOUGH * own.parts[k, wheel]) * before:
        own.parts[k, wheel] *= 0.5
        for i in range(2):
            step[i] *= 0.5
            own.speeds[k, wheel, i] -= step[i]
        return True
    _renew_matrix(support, own, k, wheel, a, b, differences)
    own.left[k, wheel], own.parts[k, wheel] = left, 1.0
    own.began[k, wheel, 0], own.began[k, wheel, 1] = a, b
    matrix = own.matrix[k, wheel]
    scale = -1.0 / (matrix[0, 0] * matrix[1, 1] - matrix[0, 1] * matrix[1, 0])
    step[0] = scale * (matrix[1, 1] * a - matrix[0, 1] * b)
    step[1] = scale * (matrix[0, 0] * b - matrix[1, 0] * a)
    for i in range(2):
        own.speeds[k, wheel, i] += step[i]
    return left > WELL * before and before < math.inf


@jit(allocates=False)
def _find_residuals(support, own, state, first):
    """Fill the residuals of all rails; whether one is out of balance."""
    out = False
    for k in range(own.speeds.shape[0]):
        for i in range(RAILS):
            wheel, j = i // 2, i % 2
            spring = support.stiffness[i, i] * state[first + RAILS * k + i]
            damper, force = support.damping[i, i] * own.speeds[k, wheel, j], own.forces[k, wheel, j]
            left = spring + damper - force
            own.residuals[k, wheel, j] = left
            out |= abs(left) > UNBALANCED * (abs(spring) + abs(damper) + abs(force))
    return out


@jit(allocates=False)
def _give_way(model, state, work, first, missed, on_grid, mode):
    """Find the speeds of rails without mass, with all wrenches there; ``missed`` and ``on_grid`` restore counters."""
    support, own, differences, moving = model.support, work.support, True, True
    own.left[:] = math.inf
    for n in range(MOST):
        _find_residuals(support, own, state, first)
        if differences:
            _find_slopes(model, work, mode)
        fresh, differences, moving = differences, False, False
        for k in range(own.speeds.shape[0]):
            for wheel in range(2):
                step = own.steps[k, wheel]
                if n == 0 or abs(step[0]) > LAST or abs(step[1]) > LAST:  # else it has arrived
                    differences |= _step(support, own, k, wheel, fresh)
                    moving |= abs(step[0]) > LAST or abs(step[1]) > LAST
        work.counters[1], work.counters[2] = missed, on_grid
        _press(model, work, -1, mode | PATCHES_HELD)
        if not moving:
            break
    own.unbalanced[0] += _find_residuals(support, own, state, first)
