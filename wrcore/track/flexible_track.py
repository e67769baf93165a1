"""Flexible track: a co-moving piece of track under each wheelset, on springs and dampers to the ground.

Under each wheelset a piece of track carries both rails. Its degrees of freedom q are

    left rail lateral, vertical; right rail lateral, vertical; sleeper lateral, vertical, roll

(m and rad; left and up positive, in the axes of the rails' frames); those of the sleeper exist only in models with a
sleeper. With the forces f of the wheels on the rails, the equation of motion is

    M q'' + C q' + K q = B f,   or, for rails without mass,   C q' + K q = f.

The piece moves with its wheelset: neighbouring positions of the track are not coupled. The rail is displaced by q and
moves at q'; in the rail's frame these are subtracted from the wheelset's position and velocity.

Without mass, q' follows from forces that depend on q' by creepages and contact damping. The faster a rail yields, the
smaller is the force on it, so that the solution is unique. Newton's method solves for all rails at once and halves
steps that do not reduce the residual. Derivatives by differences cost as much as two steps. They are computed in the
first step, and again if a step reduces the residual too little; otherwise Broyden's update (Math. Comp. 19 (1965) 577)
is used. The iteration always starts from q' = 0, so that the rate depends on the state only.

If friction falls with slip, the force can grow with q'. With a weak damper there can then be no solution, or several.
Evaluations without a solution are counted.
"""

import math
from typing import NamedTuple

import numpy as np

from wrcore.bodies.body import STATE_SIZE
from wrcore.bodies.vector import copy_into
from wrcore.contact.rail_friction import friction_at
from wrcore.contact.search.reduction import COSINE, ETA, FX, FY, NORMAL, SINE, Y, Z
from wrcore.kernels.jit import jit
from wrcore.wheels.contact_model import COUNTERS, contact_of
from wrcore.wheels.force import press_wheels
from wrcore.wheels.modes import BARE, ELLIPSES, PATCHES_HELD, SPEEDS_GIVEN, WRENCHES_HELD
from wrcore.wheels.motion import MOTION

RAILS = 4
"""Number of degrees of freedom of both rails; those of the sleeper follow them."""

DIFFERENCE, LAST_STEP, MOST_STEPS = 1e-7, 1e-8, 60
"""Newton's method for rails without mass: velocity difference for derivatives (m/s), step length at which it ends (m/s;
the remaining error is a small fraction of it), and maximum number of steps."""

LEAST_GAIN, LARGEST_LEFT = 0.1, 0.5
"""Minimum relative reduction of the residual by a full step; maximum ratio of residuals at which derivatives are kept.
"""

SLIDING = 0.9
"""Ratio of tangential force to friction times normal force above which a wheel is treated as sliding."""

UNBALANCED = 1e-4
"""Residual, relative to the forces on a rail, above which an evaluation counts as one without a solution."""


class FlexibleTrack(NamedTuple):
    """Track under each wheelset, for kernels; all arrays are empty for rigid track."""

    mass: np.ndarray  # (d,): kg, and kg m^2 in roll; zeros for rails without mass
    stiffness: np.ndarray  # (d, d): K
    damping: np.ndarray  # (d, d): C
    first: int
    """Index of its first state among the internal states. For each wheelset these are q, then q' if it has mass."""


class FlexibleTrackWork(NamedTuple):
    """Scratch arrays for each wheelset and degree of freedom of its rails (k, 4); empty for rigid track."""

    ground: np.ndarray  # (k, 4): velocities of the wheelset's centre over the ground, m/s
    speeds: np.ndarray  # (k, 4): q', m/s
    forces: np.ndarray  # (k, 4): f, N
    known: np.ndarray  # (k, 4): f before the difference in q' is added, N
    residuals: np.ndarray  # (k, 4): C q' + K q - f, N
    began: np.ndarray  # (k, 4): residuals at the start of the step, N
    steps: np.ndarray  # (k, 4): steps of q' in Newton's method, m/s
    slopes: np.ndarray  # (k, 4, 2): derivatives of f with respect to both q' of its rail (last index), N s/m
    matrix: np.ndarray  # (k, 2, 2, 2): derivatives of a rail's residuals with respect to its q' (last index), N s/m
    inverse: np.ndarray  # (k, 2, 2, 2): inverse of such a matrix, held for `SPEEDS_GIVEN`, m/(N s)
    by_speed: np.ndarray  # (k, 4, 6): derivatives of the wheels' forces and moments with respect to q', held as well
    left: np.ndarray  # (k, 2): norm of a rail's residuals, N
    parts: np.ndarray  # (k, 2): fractions of Newton's full steps
    power: np.ndarray  # (1,): f q', summed over all rails, W; 0 for a rigid track
    unbalanced: np.ndarray  # (1,) int: number of evaluations without a solution for rails without mass
    counted: np.ndarray  # (COUNTERS,) int: the wheels' counters at the start of an evaluation


def rigid_track():
    """Return an empty `FlexibleTrack`, for rigid track."""
    return FlexibleTrack(np.zeros(0), np.zeros((0, 0)), np.zeros((0, 0)), 0)


def track_size(track):
    """Return the number of states of the track under one wheelset."""
    return len(track.mass) * (2 if np.any(track.mass) else 1)


def track_work(track, wheelsets):
    """Allocate the scratch arrays for a `FlexibleTrack` and a number of wheelsets."""
    k = wheelsets if len(track.mass) else 0
    shapes = [(k, RAILS)] * 7 + [(k, RAILS, 2), (k, 2, 2, 2), (k, 2, 2, 2), (k, RAILS, 6), (k, 2), (k, 2), (1,)]
    counts = (np.zeros(size, np.int64) for size in (1, COUNTERS))
    return FlexibleTrackWork(*(np.zeros(shape) for shape in shapes), *counts)


def track_places(model):
    """Return the indices of the track's states in the state vector, one row for each wheelset: (k, size)."""
    size, first = track_size(model.flexible_track), STATE_SIZE * len(model.bodies.mass) + model.flexible_track.first
    return first + size * np.arange(len(model.bodies.wheelsets))[:, None] + np.arange(size)


def rails_at(model, state, k):
    """Return the displacements of the rails under the k-th wheelset, m, shape (2, 2): rows left and right rail, columns
    lateral and vertical."""
    if not len(model.flexible_track.mass):
        return np.zeros((2, 2))
    return state[track_places(model)[k, :RAILS]].reshape(2, 2)


@jit(allocates=False, forceinline=True)
def first_state_index(model, k):
    """Index in the state vector of the first state of the track under the k-th wheelset."""
    track = model.flexible_track
    size = track.mass.shape[0] * (1 if track.mass[0] == 0.0 else 2)
    return STATE_SIZE * model.bodies.mass.shape[0] + track.first + size * k


@jit(allocates=False, forceinline=True)
def displacement(model, state, k, wheel):
    """Return the displacement of the rail under a wheel to the left and up, m; zeros on rigid track."""
    if model.flexible_track.mass.shape[0] == 0:
        return 0.0, 0.0
    at = first_state_index(model, k) + 2 * wheel
    return state[at], state[at + 1]


@jit(allocates=False)
def flexible_wrenches(model, state, work, rate, mode):
    """Compute forces and moments of the rails on all wheels, and write the rates of the track's states to ``rate``.

    The motions in ``work``, relative to rails at rest, become those relative to the moving rails. In the mode
    `WRENCHES_HELD` only the rates are computed, from the last forces."""
    if not mode & WRENCHES_HELD:
        _find_wrenches(model, state, work, mode)
    _write_rates(model, state, work, rate)


@jit(allocates=False)
def _find_wrenches(model, state, work, mode):
    """Compute the forces and moments on all wheels, the forces on the rails, and the rails' speeds."""
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
    """Advance speeds of rails without mass, and forces on the wheels, by one Newton step with held derivatives."""
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
    """Write the rates of the track's states to ``rate``: from the forces on the rails, or their speeds without mass."""
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
    """Compute the forces and moments on all wheels and the forces on the rails at the rails' speeds.

    `DIFFERENCE` is added to the speeds in the direction ``faster`` (0 lateral, 1 vertical, < 0 none)."""
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
    """Set the initial speed of rails under sliding wheels to that without slip; return whether a wheel slides.

    In full sliding the creep force is constant, so that Newton's method has no direction. The speed without slip is in
    the steep range of the creep force, from which Newton's steps do not overshoot."""
    scratch, contact, sliding = work.flexible_track, model.contact, False
    for k in range(scratch.speeds.shape[0]):
        for wheel in range(2):
            motion, load, slip, cosine, sine = work.motions[k, wheel], 0.0, 0.0, 0.0, 0.0
            across = contact_of(contact, k, wheel).friction_across
            for patch in range(work.counts[k, wheel]):
                row = work.patches[k, wheel, patch]
                normal, tangential = row[NORMAL], math.hypot(row[FX], row[FY])
                friction = friction_at(across, motion[MOTION.friction], row[COSINE], motion[MOTION.side] * row[SINE])
                if tangential > SLIDING * friction * normal:
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
    """Compute the derivatives of the forces on the rails with respect to the rails' speeds, at constant patches.

    Ellipses replace patches on strips, as in a Jacobian: the derivatives affect only the convergence."""
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
    """Update the derivatives of one rail's residuals a and b: by differences (``slopes``), or by Broyden's update."""
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
    """Do a Newton step of one rail, or halve the last step if it did not reduce the residual enough.

    Returns whether the next step needs derivatives by differences."""
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
    """Fill the residuals of all rails; return whether the residual of a rail is too large (`UNBALANCED`)."""
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
    """Whether the last Newton step of a rail exceeds `LAST_STEP`, so that another step is needed."""
    return abs(scratch.steps[k, 2 * wheel]) > LAST_STEP or abs(scratch.steps[k, 2 * wheel + 1]) > LAST_STEP


@jit(allocates=False)
def _give_way(model, state, work, mode):
    """Solve for the speeds of rails without mass, with forces and moments at the solution.

    Before each evaluation the wheels' counters are reset to ``counted``, so that only the last one is counted."""
    track, scratch, differences = model.flexible_track, work.flexible_track, True
    scratch.left[:] = math.inf
    for n in range(MOST_STEPS):
        _find_residuals(model, state, scratch)
        if differences:
            _find_slopes(model, work, mode)
        fresh, differences, moving = differences, False, False
        for k in range(scratch.speeds.shape[0]):
            for wheel in range(2):
                if n == 0 or _moves(scratch, k, wheel):  # else this rail has converged
                    differences |= _step(track, scratch, k, wheel, fresh)
                    moving |= _moves(scratch, k, wheel)
        for k in range(COUNTERS):
            work.counters[k] = scratch.counted[k]
        _press(model, work, -1, mode | PATCHES_HELD)
        if not moving:
            break
    scratch.unbalanced[0] += _find_residuals(model, state, scratch)
