"""Flexible track in the contacts' part of the Jacobian: columns of its states and rows of its rates.

The rail under a wheel is displaced by q and moves at q'. Derivatives of the wheel's forces with respect to q and q' are
those with respect to the wheel's displacement and velocity, with opposite sign. The forces f on the rail are opposite
to those on the wheel. With masses, the derivatives of q'' = f/m follow directly. Without mass, q' follows from
C q' + K q = f. With df the change of f at constant q', and F the derivative of f with respect to the wheel's velocity,

    (C + F) dq' = df - K dq,

and derivatives of the wheel's forces are those at constant q' plus the effect of dq'.

Within a step this equation need not be solved exactly. A Rosenbrock method for q' = v, 0 = f - C v - K q, with v as a
state, solves the same linear system. Its v in a stage is a linear function of the increments of q
(`wrcore.integrate.tableaus.implied_speeds`). From this v, the stage needs one Newton step with the derivatives of the
step's start. This is a fourth of the work, and v is smooth. An exact solution is not smooth: contact damping changes
from one extreme to the other over 0.05 m/s, and in a stage an error of 1 µm in q changes the solution by 0.05 m/s.
"""

import math

from wrcore.contact.search.moved import ACROSS, MOVES
from wrcore.jacobian.hertzian_wheel import SLOPES
from wrcore.kernels.jit import FUSED, jit
from wrcore.track.flexible_track import RAILS, first_state_index
from wrcore.wheels.motion import MOTION

PLACES, SPEEDS = SLOPES, SLOPES + 2
"""First rows of derivatives with respect to a rail's displacements and velocities; two each, lateral and vertical."""

RATES = 6
"""First of two columns of derivatives: those of the rates of a rail's velocities, or of its displacements if massless.
"""

BALANCED = 1e-4
"""Maximum Newton step of the speeds of rails that count as solved, m/s."""

SHORT = 20.0
"""Factor that limits the weight of errors of rails' speeds in short steps. The speeds jump where patches jump, which
would make steps shorter and shorter. The speed's error times the step need not be less than 1/20 of a displacement's
tolerance. Chosen."""


@jit(allocates=False)
def over_rails(model, state, rate, motions):
    """Change wheels' motions relative to rails at rest into those relative to the moving rails, in place.

    Displacements and velocities of the rails are those of ``state`` and its ``rate``."""
    for k in range(motions.shape[0]):
        for i in range(RAILS):
            at, motion = first_state_index(model, k) + i, motions[k, i // 2]
            motion[MOTION.y + i % 2] -= state[at]
            motion[MOTION.vy + i % 2] -= rate[at]


@jit(allocates=False, inline="always")
def _inverse(track, wheel, slopes):
    """Return the inverse (C + F)^-1 (2, 2) for a wheel's rail without mass."""
    a, b = track.damping[2 * wheel, 2 * wheel] + slopes[SPEEDS, 1], slopes[SPEEDS + 1, 1]
    c, d = slopes[SPEEDS, 2], track.damping[2 * wheel + 1, 2 * wheel + 1] + slopes[SPEEDS + 1, 2]
    scale = 1.0 / (a * d - b * c)
    return (scale * d, -scale * b), (-scale * c, scale * a)


@jit(allocates=False, fastmath=FUSED)
def give_way(track, wheel, slopes):
    """Fill the rows and columns of its rail in a wheel's derivatives ``slopes``.

    For a massless rail all derivatives are changed to those with the rail's speed in equilibrium with the forces."""
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
    """Whether the track is flexible and its rails have no mass."""
    return model.flexible_track.mass.shape[0] > 0 and model.flexible_track.mass[0] == 0.0


@jit(allocates=False)
def in_balance(rate, model, work):
    """Whether the rails' speeds in the workspace agree with those in ``rate`` within `BALANCED`."""
    for k in range(work.flexible_track.speeds.shape[0]):
        for i in range(RAILS):
            if not abs(work.flexible_track.speeds[k, i] - rate[first_state_index(model, k) + i]) < BALANCED:
                return False
    return True


@jit(allocates=False)
def hold_speeds(slopes, rate, model, work):
    """Store the data for the mode `SPEEDS_GIVEN` in the workspace.

    These are the rails' speeds in ``rate``, and derivatives from the wheels' ``slopes`` at the same state."""
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
    """Change of a rail's speed (m/s) in a step (s) that the increments of the ``stages`` imply.

    ``at`` is the index of the rail's displacement in the state, ``rate`` the rate at the start of the step; ``begun``
    and ``weights`` are coefficients of the method (`wrcore.integrate.tableaus.implied_speeds`)."""
    speed = begun * (rate[at] - drift[at])
    for j in range(weights.shape[0]):
        speed += weights[j] / step * stages[j, at]
    return speed


@jit(allocates=False)
def imply_speeds(begun, weights, step, rate, drift, stages, model, work):
    """Write the implied speeds of all rails in a stage to the workspace; arguments are those of `_implied`."""
    for k in range(work.flexible_track.speeds.shape[0]):
        for i in range(RAILS):
            at = first_state_index(model, k) + i
            speed = rate[at] + _implied(at, begun, weights, step, rate, drift, stages)
            work.flexible_track.speeds[k, i] = speed


@jit(allocates=False)
def speeds_error(begun, weights, step, rate, drift, stages, tolerances, pace, model):
    """Error norm of the rails' speeds in a step: root mean square relative to a velocity's tolerance.

    In short steps it is reduced, see `SHORT`."""
    total, wheelsets, allowed = 0.0, model.bodies.wheelsets.shape[0], pace * tolerances[0, first_state_index(model, 0)]
    for k in range(wheelsets):
        for i in range(RAILS):
            at = first_state_index(model, k) + i
            total += (_implied(at, begun, weights, step, rate, drift, stages) / allowed) ** 2
    return min(1.0, SHORT * pace * step) * math.sqrt(total / (RAILS * wheelsets))
