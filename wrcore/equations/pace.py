"""How fast a vehicle runs, for what velocities may err by over what positions may
(:mod:`wrcore.integrate.tolerances`).
"""

from wrcore.bodies.body import EULER, STATE_SIZE, VELOCITY
from wrcore.bodies.vector import load
from wrcore.kernels.jit import jit

HALF_GAUGE = 0.75
"""m."""

RATE = 30.0
"""Velocities' tolerance over that of positions, 1/s. Above 100 explicit methods at their stability bound let forces
swing by per cents; much below 30 it is velocities alone that count."""


@jit(allocates=False, inline="always")
def _forward_speed(state, at):
    """Speed (m/s) of the body whose state starts at ``at`` along its own x axis, either way."""
    e0, (e1, e2, e3), (vx, vy, vz) = state[at + EULER], load(state, at + EULER + 1), load(state, at + VELOCITY)
    return abs(vx + 2.0 * ((e1 * e2 + e0 * e3) * vy + (e1 * e3 - e0 * e2) * vz - (e2 * e2 + e3 * e3) * vx))


@jit(allocates=False)
def pace(wheelsets, least_speed, old, new):
    """Velocities' tolerance over that of positions in a step between two states, by the slowest of the ``wheelsets``
    (bodies), 1/s; ``least_speed`` as creepages have it, m/s."""
    rate = RATE
    for wheelset in wheelsets:
        at = STATE_SIZE * wheelset
        speed = max(min(_forward_speed(old, at), _forward_speed(new, at)), least_speed)
        rate = min(rate, speed / HALF_GAUGE)
    return rate
