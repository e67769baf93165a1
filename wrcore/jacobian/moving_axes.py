"""Rotating axes that turn with a vehicle in a curve, for methods that use a Jacobian for several steps.

In a curve all forces turn with the vehicle. In fixed axes the Jacobian of stiff elements is wrong after a turn of
1 mrad. A method that keeps it must then follow the turn with short steps, although the vehicle's internal motion is
steady. Increments of a step are therefore expressed in axes that rotate about the vertical at the constant rate omega.
They are relative to a motion in which each body moves on a circle with its velocity, the ``drift`` d. All other states
change at a constant rate in these axes, their drift. With Q(t) the rotation since the Jacobian was computed, the
state at a time t after the step's start (subscript 0) is

    r = r0 + D(t) d + Q u,   p = q(t) p0 + q (t d_p + u_p),   v = Q(t)/Q(0) v0 + Q (t d_v + u_v),   w likewise,

where D is the integral of Q, q the rotation of Euler parameters, and u are increments:

    u' = Q^T v - d - omega x u,   u_p' = q^T (p' - omega p / 2) - d_p,   u_v' = Q^T (v' - omega x v) - d_v.

This is exact for any omega, so the order of a method does not depend on it. In steady curving u remains zero, and a
step costs as much as on straight track, where omega is zero.
"""

import math

from wrcore.bodies.body import STATE_SIZE
from wrcore.kernels.jit import jit

RATE, ANGLE = range(2)
"""Indices in ``turn``: turning rate (rad/s), angle since the Jacobian was computed (rad)."""


@jit(allocates=False, inline="always")
def turn_of(jacobian):
    """Return turning rate (rad/s) and angle (rad) of a Jacobian's axes."""
    return jacobian.turn[RATE], jacobian.turn[ANGLE]


@jit(allocates=False, inline="always")
def _turned(c, s, x, y):
    """Return two components rotated by the angle with cosine ``c`` and sine ``s``."""
    return c * x - s * y, s * x + c * y


VECTORS, EULER_PAIRS = ((7, 8), (10, 11)), ((3, 6), (4, 5))
"""Pairs of components of a body's state that a rotation about the vertical mixes: of vectors, and, with half the angle,
of Euler parameters."""


@jit(allocates=False, inline="always")
def _circle(turn, t):
    """Return the cosine and sine parts of D (s), the displacement on a circle per initial velocity."""
    half = 0.5 * turn[RATE] * t
    length = t if half == 0.0 else t * math.sin(half) / half
    return length * math.cos(turn[ANGLE] + half), length * math.sin(turn[ANGLE] + half)


@jit(allocates=False)
def carry(bodies, turn, drift, t, start, trial):
    """Compute the state from its increments, in place in ``trial`` (size,), at a time t (s) after the step's ``start``.

    ``turn`` contains rate and angle of the axes at the step's start."""
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
    """Compute the rate of the increments from that of the state, in place in ``slope``; arguments as for `carry`."""
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
