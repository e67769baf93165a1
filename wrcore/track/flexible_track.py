"""Flexible track: a piece of track under each wheelset that runs along with it, on springs and dampers to the ground.

Under each wheelset a piece of track carries both rails. Its freedoms q are

    left rail lateral, vertical; right rail lateral, vertical; sleeper lateral, vertical, roll

(m and rad; left and up positive, in the axes of the rails' frames), the sleeper's only where there is one. With the
forces f of the wheels on the rails, q obeys

    M q'' + C q' + K q = B f,   or, for rails without mass,   C q' + K q = f.

The piece runs along with its wheelset: nothing is handed on from one place of the track to the next. The wheel meets a
rail that is displaced by q and moves at q': in the rail's frame the wheelset's place and velocity are less by these.

Without mass, q' follows from forces that depend on it, by creepages and contact damping. The faster a rail gives way,
the less it is pushed, so that there is one solution; Newton's method finds it for all rails at once, with steps that
are halved where they do not come closer. Derivatives by differences cost as much as two steps: they are taken at the
first one, and again where a step does not do what it should; else Broyden's update (Math. Comp. 19 (1965) 577) follows
the last step. It starts from rest each time: a state has one rate, whatever was before.

A friction that falls with slip can push more the faster a rail gives way, and leave a weak damper no balance, or
several. Evaluations that end without one are counted.
"""

import math
from typing import NamedTuple

import numpy as np

from wrcore.bodies.body import STATE_SIZE
from wrcore.bodies.vector import copy_into
from wrcore.contact.search.reduction import COSINE, ETA, FX, FY, NORMAL, SINE, Y, Z
from wrcore.kernels.jit import jit
from wrcore.wheels.contact_model import COUNTERS
from wrcore.wheels.force import press_wheels
from wrcore.wheels.modes import BARE, ELLIPSES, PATCHES_HELD, SPEEDS_GIVEN, WRENCHES_HELD
from wrcore.wheels.motion import MOTION

RAILS = 4
"""Freedoms of both rails; those of the sleeper come after them."""

DIFFERENCE, LAST_STEP, MOST_STEPS = 1e-7, 1e-8, 60
"""Newton's method for rails without mass: difference of velocities (m/s), length of its last step (m/s; the error left
is a small part of it), and most steps."""

LEAST_GAIN, LARGEST_LEFT = 0.1, 0.5
"""Part of what is left that a full step has to take off, and largest part left with which derivatives are kept."""

SLIDING = 0.9
"""Part of friction beyond which a wheel slides."""

UNBALANCED = 1e-4
"""Part of the forces on a rail that is left where there is no balance."""


class FlexibleTrack(NamedTuple):
    """The track under each wheelset, for kernels; of a rigid one all arrays are empty."""

    mass: np.ndarray  # (d,): kg, and kg m^2 in roll; zeros for rails without mass
    stiffness: np.ndarray  # (d, d): K
    damping: np.ndarray  # (d, d): C
    first: int
    """Place of the first of its states among the internal states: wheelset after wheelset, q, then q' where there are
    masses."""


class FlexibleTrackWork(NamedTuple):
    """Scratch arrays for each wheelset and freedom of its rails (k, 4); none for a rigid track."""

    ground: np.ndarray  # (k, 4): velocities of the wheelset's centre over the ground, m/s
    speeds: np.ndarray  # (k, 4): q', m/s
    forces: np.ndarray  # (k, 4): f, N
    known: np.ndarray  # (k, 4): f without a difference in q', N
    residuals: np.ndarray  # (k, 4): C q' + K q - f, N
    began: np.ndarray  # (k, 4): the same where the step began, N
    steps: np.ndarray  # (k, 4): of Newton's method, m/s
    slopes: np.ndarray  # (k, 4, 2): derivatives of f by both q' of its rail (last index), N s/m
    matrix: np.ndarray  # (k, 2, 2, 2): derivatives of a rail's residuals by its q' (last index), N s/m
    inverse: np.ndarray  # (k, 2, 2, 2): of it, as held for `SPEEDS_GIVEN`
    by_speed: np.ndarray  # (k, 4, 6): derivatives of the wheels' wrenches by q', held with it
    left: np.ndarray  # (k, 2): size of a rail's residuals, N
    parts: np.ndarray  # (k, 2): of Newton's full steps
    power: np.ndarray  # (1,): f q', summed over all rails, W; 0 for a rigid track
    unbalanced: np.ndarray  # (1,) int: counts evaluations in which rails without mass found no balance
    counted: np.ndarray  # (COUNTERS,) int: the wheels' counters where an evaluation began


def rigid_track():
    """A `FlexibleTrack` of a rigid track."""
    return FlexibleTrack(np.zeros(0), np.zeros((0, 0)), np.zeros((0, 0)), 0)


def track_size(track):
    """Number of states of the track under one wheelset."""
    return len(track.mass) * (2 if np.any(track.mass) else 1)


def track_work(track, wheelsets):
    """Scratch arrays for a `FlexibleTrack` and a number of wheelsets."""
    k = wheelsets if len(track.mass) else 0
    shapes = [(k, RAILS)] * 7 + [(k, RAILS, 2), (k, 2, 2, 2), (k, 2, 2, 2), (k, RAILS, 6), (k, 2), (k, 2), (1,)]
    counts = (np.zeros(size, np.int64) for size in (1, COUNTERS))
    return FlexibleTrackWork(*(np.zeros(shape) for shape in shapes), *counts)


def track_places(model):
    """Places of the track's states in the state, wheelset by wheelset: (k, size)."""
    size, first = track_size(model.flexible_track), STATE_SIZE * len(model.bodies.mass) + model.flexible_track.first
    return first + size * np.arange(len(model.bodies.wheelsets))[:, None] + np.arange(size)


def rails_at(model, state, k):
    """Displacements of the rails under the k-th wheelset: left and right, lateral and vertical (m), shape (2, 2)."""
    if not len(model.flexible_track.mass):
        return np.zeros((2, 2))
    return state[track_places(model)[k, :RAILS]].reshape(2, 2)


@jit(allocates=False, forceinline=True)
def first_state_index(model, k):
    """Place of the first state of the track under the k-th wheelset in the state."""
    track = model.flexible_track
    size = track.mass.shape[0] * (1 if track.mass[0] == 0.0 else 2)
    return STATE_SIZE * model.bodies.mass.shape[0] + track.first + size * k


@jit(allocates=False, forceinline=True)
def displacement(model, state, k, wheel):
    """How far the rail under a wheel is displaced to the left and up, m."""
    if model.flexible_track.mass.shape[0] == 0:
        return 0.0, 0.0
    at = first_state_index(model, k) + 2 * wheel
    return state[at], state[at + 1]


@jit(allocates=False)
def flexible_wrenches(model, state, work, rate, mode):
    """Wrenches of the rails on all wheels, as by the kernel of the wheels, and the rates of the track's states, written
    into ``rate``; the motions in ``work``, over rails at rest, become those over the rails as they move. While wrenches
    are held, the rates alone, by the forces found last."""
    if not mode & WRENCHES_HELD:
        _find_wrenches(model, state, work, mode)
    _write_rates(model, state, work, rate)


@jit(allocates=False)
def _find_wrenches(model, state, work, mode):
    """Wrenches on all wheels, forces on the rails, and the rails' speeds."""
    scratch, massless, given = work.flexible_track, model.flexible_track.mass[0] == 0.0, mode & SPEEDS_GIVEN
    if massless and not given:
        mode &= ~BARE
    for k in range(scratch.speeds.shape[0]):
        for i in range(RAILS):
            at, motion = first_state_index(model, k) + i, work.motions[k, i // 2]
            motion[MOTION.y + i % 2] -= state[at]
            scratch.ground[k, i] = motion[MOTION.vy + i % 2]
            if not massless:
                scratch.speeds[k, i] = state[at + model.flexible_track.mass.shape[0]]
            elif not given:
                scratch.speeds[k, i] = 0.0
    for k in range(COUNTERS):
        scratch.counted[k] = work.counters[k]
    _press(model, work, -1, mode)
    if massless and given:
        _step_on(model, state, work)
    elif massless:
        if _follow_where_sliding(model, work):
            _press(model, work, -1, mode | PATCHES_HELD)
        _give_way(model, state, work, mode)
    scratch.power[0] = 0.0
    for k in range(scratch.speeds.shape[0]):
        at = first_state_index(model, k)
        for i in range(RAILS):
            scratch.power[0] += scratch.forces[k, i] * scratch.speeds[k, i]
        for wheel in range(0 if mode & BARE else 2):
            for patch in range(work.counts[k, wheel]):
                work.patches[k, wheel, patch, Y] += state[at + 2 * wheel]
                work.patches[k, wheel, patch, Z] += state[at + 2 * wheel + 1]


@jit(allocates=False)
def _step_on(model, state, work):
    """Lead the speeds of rails without mass, and the wrenches, on by a step with the slopes that are held."""
    scratch = work.flexible_track
    _find_residuals(model, state, scratch)
    for k in range(scratch.speeds.shape[0]):
        for i in range(RAILS):
            inverse, first, step = scratch.inverse[k, i // 2], 2 * (i // 2), 0.0
            for j in range(2):
                step -= inverse[i % 2, j] * scratch.residuals[k, first + j]
            scratch.speeds[k, i] += step
            for j in range(6):
                work.rail_wrenches[k, i // 2, j] += scratch.by_speed[k, i, j] * step


@jit(allocates=False)
def _write_rates(model, state, work, rate):
    """Rates of the track's states by the forces on the rails, or by their speeds where they have no mass."""
    track, scratch = model.flexible_track, work.flexible_track
    d, massless = track.mass.shape[0], track.mass[0] == 0.0
    for k in range(scratch.speeds.shape[0]):
        at = first_state_index(model, k)
        for i in range(RAILS if massless else 0):
            rate[at + i] = scratch.speeds[k, i]
        for i in range(0 if massless else d):
            total = scratch.forces[k, i] if i < RAILS else 0.0
            for j in range(d):
                total -= track.stiffness[i, j] * state[at + j] + track.damping[i, j] * state[at + d + j]
            rate[at + i], rate[at + d + i] = state[at + d + i], total / track.mass[i]


@jit(allocates=False)
def _press(model, work, faster, mode):
    """Find the wrenches and the forces on the rails at the rails' speeds, in one direction (< 0: none) a bit faster."""
    scratch = work.flexible_track
    for k in range(scratch.speeds.shape[0]):
        for i in range(RAILS):
            speed = scratch.speeds[k, i] + (DIFFERENCE if i % 2 == faster else 0.0)
            work.motions[k, i // 2, MOTION.vy + i % 2] = scratch.ground[k, i] - speed
    press_wheels(model, work, mode)
    for k in range(scratch.speeds.shape[0]):
        for i in range(RAILS):
            scratch.forces[k, i] = -work.rail_wrenches[k, i // 2, 1 + i % 2]


@jit(allocates=False)
def _follow_where_sliding(model, work):
    """Let rails whose wheels slide begin at the speed at which these would not: where friction saturates it does not
    tell the way, from where it is steep Newton's steps stay short of the balance. Returns whether one slides."""
    scratch, contact, sliding = work.flexible_track, model.contact, False
    for k in range(scratch.speeds.shape[0]):
        for wheel in range(2):
            motion, load, slip, cosine, sine = work.motions[k, wheel], 0.0, 0.0, 0.0, 0.0
            for patch in range(work.counts[k, wheel]):
                row = work.patches[k, wheel, patch]
                normal, tangential = row[NORMAL], math.hypot(row[FX], row[FY])
                if tangential > SLIDING * motion[MOTION.friction] * normal:
                    load, slip = load + normal, slip + normal * row[ETA]
                    cosine, sine = cosine + normal * row[COSINE], sine + normal * row[SINE]
            if load > 0.0:
                sliding = True
                speed = max(abs(motion[MOTION.vx]), contact.least_speed) * slip / (load * load)
                scratch.speeds[k, 2 * wheel] += speed * cosine
                scratch.speeds[k, 2 * wheel + 1] += speed * sine
    return sliding


@jit(allocates=False)
def _find_slopes(model, work, mode):
    """Derivatives of the forces on the rails by the rails' speeds, where forces are known; patches stay. For patches on
    strips ellipses stand in, as in a Jacobian: the derivatives only lead to the solution."""
    scratch, rough = work.flexible_track, mode | ELLIPSES
    if model.contact.strips.strips > 0:
        _press(model, work, -1, rough)
    for k in range(scratch.speeds.shape[0]):
        copy_into(scratch.known[k], scratch.forces[k])
    for faster in range(2):
        _press(model, work, faster, rough | PATCHES_HELD)
        for k in range(scratch.speeds.shape[0]):
            for i in range(RAILS):
                scratch.slopes[k, i, faster] = (scratch.forces[k, i] - scratch.known[k, i]) / DIFFERENCE


@jit(allocates=False)
def _renew_matrix(track, scratch, k, wheel, a, b, differences):
    """Derivatives of one rail's residuals a and b: by differences, or those before with Broyden's update."""
    matrix, first = scratch.matrix[k, wheel], 2 * wheel
    if differences:
        for i in range(2):
            for j in range(2):
                matrix[i, j] = -scratch.slopes[k, first + i, j]
            matrix[i, i] += track.damping[first + i, first + i]
        return
    x, y = scratch.steps[k, first], scratch.steps[k, first + 1]
    rest, scale = 1.0 - scratch.parts[k, wheel], 1.0 / (x * x + y * y)
    a, b = scale * (a - rest * scratch.began[k, first]), scale * (b - rest * scratch.began[k, first + 1])
    matrix[0, 0], matrix[0, 1] = matrix[0, 0] + a * x, matrix[0, 1] + a * y
    matrix[1, 0], matrix[1, 1] = matrix[1, 0] + b * x, matrix[1, 1] + b * y


@jit(allocates=False)
def _step(track, scratch, k, wheel, differences):
    """Newton's step of one rail, or half of the last one, back, where that came no closer. Returns whether the next
    step wants derivatives by differences."""
    first, matrix, before = 2 * wheel, scratch.matrix[k, wheel], scratch.left[k, wheel]
    a, b, step = scratch.residuals[k, first], scratch.residuals[k, first + 1], scratch.steps[k, first : first + 2]
    left = math.sqrt(a * a + b * b)
    if left > (1.0 - LEAST_GAIN * scratch.parts[k, wheel]) * before:
        scratch.parts[k, wheel] *= 0.5
        for i in range(2):
            step[i] *= 0.5
            scratch.speeds[k, first + i] -= step[i]
        return True
    _renew_matrix(track, scratch, k, wheel, a, b, differences)
    scratch.left[k, wheel], scratch.parts[k, wheel] = left, 1.0
    scratch.began[k, first], scratch.began[k, first + 1] = a, b
    scale = -1.0 / (matrix[0, 0] * matrix[1, 1] - matrix[0, 1] * matrix[1, 0])
    step[0] = scale * (matrix[1, 1] * a - matrix[0, 1] * b)
    step[1] = scale * (matrix[0, 0] * b - matrix[1, 0] * a)
    for i in range(2):
        scratch.speeds[k, first + i] += step[i]
    return left > LARGEST_LEFT * before and before < math.inf


@jit(allocates=False)
def _find_residuals(model, state, scratch):
    """Fill the residuals of all rails; whether one is out of balance."""
    track, out = model.flexible_track, False
    for k in range(scratch.speeds.shape[0]):
        for i in range(RAILS):
            spring = track.stiffness[i, i] * state[first_state_index(model, k) + i]
            damper, force = track.damping[i, i] * scratch.speeds[k, i], scratch.forces[k, i]
            left = spring + damper - force
            scratch.residuals[k, i] = left
            out |= abs(left) > UNBALANCED * (abs(spring) + abs(damper) + abs(force))
    return out


@jit(allocates=False)
def _moves(scratch, k, wheel):
    """Whether the last step of a rail was long enough for another one."""
    return abs(scratch.steps[k, 2 * wheel]) > LAST_STEP or abs(scratch.steps[k, 2 * wheel + 1]) > LAST_STEP


@jit(allocates=False)
def _give_way(model, state, work, mode):
    """Find the speeds of rails without mass, with all wrenches there; each evaluation counts from ``counted`` on."""
    track, scratch, differences = model.flexible_track, work.flexible_track, True
    scratch.left[:] = math.inf
    for n in range(MOST_STEPS):
        _find_residuals(model, state, scratch)
        if differences:
            _find_slopes(model, work, mode)
        fresh, differences, moving = differences, False, False
        for k in range(scratch.speeds.shape[0]):
            for wheel in range(2):
                if n == 0 or _moves(scratch, k, wheel):  # else it has arrived
                    differences |= _step(track, scratch, k, wheel, fresh)
                    moving |= _moves(scratch, k, wheel)
        for k in range(COUNTERS):
            work.counters[k] = scratch.counted[k]
        _press(model, work, -1, mode | PATCHES_HELD)
        if not moving:
            break
    scratch.unbalanced[0] += _find_residuals(model, state, scratch)
