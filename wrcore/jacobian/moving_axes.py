"""Rotating axes, which turn with a vehicle in a curve, for methods that keep a Jacobian for more than a moment.

In a curve all forces turn with the vehicle. In resting axes the Jacobian of what is stiff is wrong after a turn of
1 mrad, and a method that holds on to it must follow that turn with short steps although nothing moves in the vehicle.
Increments of a step are therefore counted in axes that rotate about the vertical at the constant rate omega, from a
motion in which each body goes round a circle with its own velocity, the ``drift`` d, and all else changes at a
constant rate in these axes, its own drift. With Q(t) the turn since the
Jacobian was taken, the state at a time t after the step's start (subscript 0) is

    r = r0 + D(t) d + Q u,   p = q(t) p0 + q (t d_p + u_p),   v = Q(t)/Q(0) v0 + Q (t d_v + u_v),   w likewise,

where D is the integral of Q, q the turn of Euler parameters, and u are increments:

    u' = Q^T v - d - omega x u,   u_p' = q^T (p' - omega p / 2) - d_p,   u_v' = Q^T (v' - omega x v) - d_v.

This is exact for any omega: the order of a method does not rest on it. In steady curving u stays zero, and a step costs
what it costs on straight track, where omega is zero.
"""

import math

from wrcore.bodies.body import STATE_SIZE
from wrcore.kernels.jit import jit

RATE, ANGLE = range(2)
"""Places in ``turn``: turn rate (rad/s), turn since the Jacobian was taken (rad)."""


@jit(allocates=False, inline="always")
def turn_of(jacobian):
    """Turn rate and angle of a Jacobian's axes."""
    return jacobian.turn[RATE], jacobian.turn[ANGLE]


@jit(allocates=False, inline="always")
def _turned(c, s, x, y):
    """A pair of components, turned by the angle of a cosine and a sine."""
    return c * x - s * y, s * x + c * y


VECTORS, EULER_PAIRS = ((7, 8), (10, 11)), ((3, 6), (4, 5))
"""Components of a body's state that a turn about the vertical mixes: as a vector, and with half the angle."""


@jit(allocates=False, inline="always")
def _circle(turn, t):
    """Cosine and sine parts of D, the way along a circle that starts with a velocity of 1 m/s."""
    half = 0.5 * turn[RATE] * t
    length = t if half == 0.0 else t * math.sin(half) / half
    return length * math.cos(turn[ANGLE] + half), length * math.sin(turn[ANGLE] + half)


@jit(allocates=False)
def carry(bodies, turn, drift, t, start, trial):
    """Turn increments in ``trial`` (size,) into the state that they lead to, t (s) after the step's ``start``. ``turn``
    is rate and angle at the step's start."""
    turned, whole = turn[RATE] * t, turn[ANGLE] + turn[RATE] * t
    c0, s0, c, s = math.cos(turned), math.sin(turned), math.cos(whole), math.sin(whole)
    hc0, hs0, hc, hs = math.cos(0.5 * turned), math.sin(0.5 * turned), math.cos(0.5 * whole), math.sin(0.5 * whole)
    dc, ds = _circle(turn, t)
    for b in range(bodies):
        at = STATE_SIZE * b
        dx, dy = _turned(dc, ds, drift[at], drift[at + 1])
        ux, uy = _turned(c, s, trial[at], trial[at + 1])
        trial[at], trial[at + 1] = start[at] + dx + ux, start[at + 1] + dy + uy
        trial[at + 2] += start[at + 2] + t * drift[at + 2]
        for i, j in EULER_PAIRS:
            x, y = _turned(hc0, hs0, start[at + i], start[at + j])
            ux, uy = _turned(hc, hs, trial[at + i] + t * drift[at + i], trial[at + j] + t * drift[at + j])
            trial[at + i], trial[at + j] = x + ux, y + uy
        for i, j in VECTORS:
            x, y = _turned(c0, s0, start[at + i], start[at + j])
            ux, uy = _turned(c, s, trial[at + i] + t * drift[at + i], trial[at + j] + t * drift[at + j])
            trial[at + i], trial[at + j] = x + ux, y + uy
            trial[at + j + 1] += start[at + j + 1] + t * drift[at + j + 1]
    for i in range(STATE_SIZE * bodies, trial.shape[0]):
        trial[i] += start[i] + t * drift[i]


@jit(allocates=False)
def rates_of_increments(bodies, turn, drift, t, start, trial, slope):
    """Turn the rate of a state (``slope``, overwritten) into that of the increments; all else as for `carry`."""
    rate, whole = turn[RATE], turn[ANGLE] + turn[RATE] * t
    c, s, hc, hs = math.cos(whole), math.sin(whole), math.cos(0.5 * whole), math.sin(0.5 * whole)
    dc, ds = _circle(turn, t)
    for b in range(bodies):
        at = STATE_SIZE * b
        dx, dy = _turned(dc, ds, drift[at], drift[at + 1])
        x, y = trial[at] - start[at] - dx, trial[at + 1] - start[at + 1] - dy
        ux, uy = _turned(c, -s, slope[at] + rate * y, slope[at + 1] - rate * x)
        slope[at], slope[at + 1] = ux - drift[at], uy - drift[at + 1]
        slope[at + 2] -= drift[at + 2]
        for i, j in EULER_PAIRS:
            x, y = slope[at + i] + 0.5 * rate * trial[at + j], slope[at + j] - 0.5 * rate * trial[at + i]
            ux, uy = _turned(hc, -hs, x, y)
            slope[at + i], slope[at + j] = ux - drift[at + i], uy - drift[at + j]
        for i, j in VECTORS:
            x, y = slope[at + i] + rate * trial[at + j], slope[at + j] - rate * trial[at + i]
            ux, uy = _turned(c, -s, x, y)
            slope[at + i], slope[at + j] = ux - drift[at + i], uy - drift[at + j]
            slope[at + j + 1] -= drift[at + j + 1]
    for i in range(STATE_SIZE * bodies, trial.shape[0]):
        slope[i] -= drift[i]
