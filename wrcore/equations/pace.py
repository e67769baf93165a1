"""Ratio of the tolerance of velocities to that of positions, from the vehicle's speed.

It is used in :mod:`wrcore.integrate.tolerances`."""

from wrcore.bodies.body import EULER, STATE_SIZE, VELOCITY
from wrcore.bodies.vector import load
from wrcore.kernels.jit import jit

HALF_GAUGE = 0.75
"""Half of the distance between the tape circles in standard gauge, m."""

RATE = 30.0
"""Maximum ratio of the velocities' tolerance to that of positions, 1/s. Above 100, forces oscillate by several per cent
with explicit methods at their stability bound; far below 30, only the error of velocities controls the step."""


@jit(allocates=False, inline="always")
def _forward_speed(state, at):
    """Magnitude of the velocity along the body's x axis (m/s), for the body whose state starts at ``at``."""
    e0, (e1, e2, e3), (vx, vy, vz) = state[at + EULER], load(state, at + EULER + 1), load(state, at + VELOCITY)
    return abs(vx + 2.0 * ((e1 * e2 + e0 * e3) * vy + (e1 * e3 - e0 * e2) * vz - (e2 * e2 + e3 * e3) * vx))


@jit(allocates=False)
def pace(wheelsets, least_speed, old, new):
    """Ratio of the velocities' tolerance to that of positions in a step between two states, 1/s.

    It is determined by the slowest of the ``wheelsets`` (body indices); speeds below ``least_speed`` (m/s), the lower
    bound in creepages, are replaced by it."""
    rate = RATE
    for wheelset in wheelsets:
        at = STATE_SIZE * wheelset
        speed = max(min(_forward_speed(old, at), _forward_speed(new, at)), least_speed)
        rate = min(rate, speed / HALF_GAUGE)
    return rate
