"""What a flexible track adds to the contacts' part of the Jacobian: its states' columns, and the rows of its rates.

A wheel meets its rail displaced by q and moving at q'. The wrench on it changes by these as by its own displacement and
velocity, with the other sign, and the forces f on the rail are that wrench's, with the other sign. With masses this
gives what q'' = f/m changes by. Without, q' follows from C q' + K q = f: with df what f changes by while q' is held,
and F what it changes by the wheel's velocities,

    (C + F) dq' = df - K dq,

and all slopes of the wrench are those with q' held and what dq' makes of them.

Between the beginning and the end of a step that balance need not be found. A Rosenbrock method for q' = v, 0 = f - C v
- K q, with v a state like others, solves the same linear system. Its v of a stage is a linear function of the
increments of q (`wrcore.integrate.tableaus.implied_speeds`), and what it wants of the stage is one step of Newton's
method from there, with the derivatives of the step's start. That is a fourth of the work, and v is smooth: contact
damping goes from one extreme to the other over 0.05 m/s, and a stage whose q is 1 um off is in balance at another
0.05 m/s.
"""

import math

from wrcore.contact.search.moved import ACROSS, MOVES
from wrcore.jacobian.hertzian_wheel import SLOPES
from wrcore.kernels.jit import FUSED, jit
from wrcore.track.flexible_track import RAILS, first_state_index
from wrcore.wheels.motion import MOTION

PLACES, SPEEDS = SLOPES, SLOPES + 2
"""Rows of slopes by a rail's displacements, and by its velocities; a pair each, lateral and vertical."""

RATES = 6
"""First of two columns of slopes: rates of a rail's velocities, or of its displacements where it has no mass."""

BALANCED = 1e-4
"""What a step of Newton's method may move rails that are in balance, m/s."""

SHORT = 20.0
"""Speeds of rails jump where patches do. Steps are not to grow ever shorter on that: times a step's length, what a
speed errs by is no more than 1/20 of what a displacement may. Chosen."""


@jit(allocates=False)
def over_rails(model, state, rate, motions):
    """Turn motions over rails at rest into those over the rails, displaced as in a ``state`` of that ``rate``."""
    for k in range(motions.shape[0]):
        for i in range(RAILS):
            at, motion = first_state_index(model, k) + i, motions[k, i // 2]
            motion[MOTION.y + i % 2] -= state[at]
            motion[MOTION.vy + i % 2] -= rate[at]


@jit(allocates=False, inline="always")
def _inverse(track, wheel, slopes):
    """(C + F)^-1 of a wheel's rail."""
    a, b = track.damping[2 * wheel, 2 * wheel] + slopes[SPEEDS, 1], slopes[SPEEDS + 1, 1]
    c, d = slopes[SPEEDS, 2], track.damping[2 * wheel + 1, 2 * wheel + 1] + slopes[SPEEDS + 1, 2]
    scale = 1.0 / (a * d - b * c)
    return (scale * d, -scale * b), (-scale * c, scale * a)


@jit(allocates=False, fastmath=FUSED)
def give_way(track, wheel, slopes):
    """Add rows and columns of its rail to a wheel's ``slopes``; of one without mass they become those of a wheel whose
    rail gives way."""
    for i in range(2):
        for column in range(RATES):
            slopes[PLACES + i, column] = -slopes[ACROSS + i, column]
            slopes[SPEEDS + i, column] = -slopes[MOVES + 1 + i, column]
    if track.mass[0] != 0.0:
        for row in range(slopes.shape[0]):
            for i in range(2):
                slopes[row, RATES + i] = -slopes[row, 1 + i] / track.mass[2 * wheel + i]
        return
    by_y, by_z, first = slopes[SPEEDS], slopes[SPEEDS + 1], 2 * wheel
    (yy, yz), (zy, zz) = _inverse(track, wheel, slopes)
    for row in range(SPEEDS):
        fy, fz = -slopes[row, 1], -slopes[row, 2]
        if row >= PLACES:
            held = track.stiffness[first + row - PLACES, first + row - PLACES]
            fy, fz = fy - (held if row == PLACES else 0.0), fz - (0.0 if row == PLACES else held)
        vy, vz = yy * fy + yz * fz, zy * fy + zz * fz
        slopes[row, RATES], slopes[row, RATES + 1] = vy, vz
        for column in range(RATES):
            slopes[row, column] += by_y[column] * vy + by_z[column] * vz


@jit(allocates=False, inline="always")
def without_mass(model):
    """Whether track is flexible and rails have no mass."""
    return model.flexible_track.mass.shape[0] > 0 and model.flexible_track.mass[0] == 0.0


@jit(allocates=False)
def in_balance(rate, model, work):
    """Whether the rails' speeds in the work are those in a ``rate``, or nearly so."""
    for k in range(work.flexible_track.speeds.shape[0]):
        for i in range(RAILS):
            if not abs(work.flexible_track.speeds[k, i] - rate[first_state_index(model, k) + i]) < BALANCED:
                return False
    return True


@jit(allocates=False)
def hold_speeds(slopes, rate, model, work):
    """Let the work have what `SPEEDS_GIVEN` needs: of the wheels' ``slopes``, and the speeds in the ``rate`` of where
    these are."""
    scratch = work.flexible_track
    for k in range(slopes.shape[0]):
        for i in range(RAILS):
            scratch.speeds[k, i] = rate[first_state_index(model, k) + i]
        for wheel in range(2):
            inverse = _inverse(model.flexible_track, wheel, slopes[k, wheel])
            for i in range(2):
                for j in range(2):
                    scratch.inverse[k, wheel, i, j] = inverse[i][j]
                for j in range(RATES):
                    scratch.by_speed[k, 2 * wheel + i, j] = slopes[k, wheel, SPEEDS + i, j]


@jit(allocates=False)
def _implied(at, begun, weights, step, rate, drift, stages):
    """What the increments of the ``stages`` of a step (s) imply for the speed of a rail whose place is ``at``, by a
    method's ``begun`` and ``weights`` of them; ``rate``: where the step began."""
    speed = begun * (rate[at] - drift[at])
    for j in range(weights.shape[0]):
        speed += weights[j] / step * stages[j, at]
    return speed


@jit(allocates=False)
def imply_speeds(begun, weights, step, rate, drift, stages, model, work):
    """Write the rails' speeds in a stage into the work; arguments as for `_implied`."""
    for k in range(work.flexible_track.speeds.shape[0]):
        for i in range(RAILS):
            at = first_state_index(model, k) + i
            speed = rate[at] + _implied(at, begun, weights, step, rate, drift, stages)
            work.flexible_track.speeds[k, i] = speed


@jit(allocates=False)
def speeds_error(begun, weights, step, rate, drift, stages, tolerances, pace, model):
    """Error of the rails' speeds in a step, root mean square over what a velocity is allowed; in short steps over more,
    `SHORT`."""
    total, wheelsets, allowed = 0.0, model.bodies.wheelsets.shape[0], pace * tolerances[0, first_state_index(model, 0)]
    for k in range(wheelsets):
        for i in range(RAILS):
            at = first_state_index(model, k) + i
            total += (_implied(at, begun, weights, step, rate, drift, stages) / allowed) ** 2
    return min(1.0, SHORT * pace * step) * math.sqrt(total / (RAILS * wheelsets))
