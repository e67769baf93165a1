"""Check rails: rails next to the running rails that guide wheels by the backs of their flanges, e.g. at crossings.

The back of a wheel is a plane normal to its axle, bounded by a circle. The face of a check rail is a vertical plane up
to a height over the running surface. Contact is evaluated at the two points of the circle at this height, one ahead of
the axle and one behind it. Half of the force acts at each point,

    N = K/2 max(0, penetration there),   friction mu N u/sqrt(u^2 + v0^2) against the sliding velocity u in the face,

so that a yawing wheel has contact ahead or behind, and the force is continuous at zero yaw. The check rail stands on
the ground: its force does not deflect a flexible track.
"""

import math
from typing import NamedTuple

import numpy as np

from wrcore.kernels.jit import jit
from wrcore.track.changing_rails import shorten_step
from wrcore.track.flexible_track import displacement
from wrcore.track.track import arc_length_at
from wrcore.wheels.motion import MOTION

SIDE, BEGIN, END, FACE, FLARE, OPENING, BACK, CHORD, DOWN, STIFFNESS, FRICTION = range(11)
"""Columns of a check rail. SIDE: 1 next to the left, -1 next to the right running rail. BEGIN, END: arc lengths (m).
FACE: distance of its face from the middle of the track (m). FLARE, OPENING: length and lateral opening of its flares
(m). BACK: distance of the wheels' backs from the middle of the axle (m). CHORD, DOWN: distances ahead of and below the
axle at which the circle of a wheel's back crosses the rail's upper edge (m). STIFFNESS (N/m), FRICTION: coefficient."""
COLUMNS = 11
"""Number of columns of a check rail."""

SLIDING = 0.02
"""Sliding velocity v0 at which friction reaches 71 % of its maximum, m/s. Chosen."""

STRIDE = 0.05
"""Maximum step of a run at a check rail, m."""


class CheckRails(NamedTuple):
    """Check rails, for kernels."""

    rows: np.ndarray  # (k, n, COLUMNS): n check rails for each of k wheelsets


def no_check_rails():
    """Return empty `CheckRails`."""
    return CheckRails(np.zeros((0, 0, COLUMNS)))


@jit(allocates=False)
def face_at(row, s):
    """Distance of a check rail's face from the middle of the track at arc length ``s``, m; -1 km outside its range."""
    if not row[BEGIN] < s < row[END]:
        return -1e3
    into = min(s - row[BEGIN], row[END] - s)
    return row[FACE] - row[OPENING] * max(0.0, 1.0 - into / row[FLARE])


@jit(allocates=False)
def check_force(row, s, aside, motion, wrench):
    """Compute the normal force of a check rail on a wheel, N, and add force and moment on the wheelset to ``wrench``.

    ``motion`` is the wheel's motion in the frame of its running rail, which is displaced laterally by ``aside`` (m).
    The moment is about the wheelset's centre."""
    side, total = row[SIDE], 0.0
    if motion[MOTION.side] != side:
        return total
    ex, ey, ez = motion[MOTION.ex], motion[MOTION.ey], motion[MOTION.ez]
    for sign in (1.0, -1.0):
        px, pz = sign * row[CHORD], -row[DOWN]
        py = (side * row[BACK] - ex * px - ez * pz) / ey
        normal = 0.5 * row[STIFFNESS] * (face_at(row, s + px) - side * (motion[MOTION.y] + aside + py))
        if not normal > 0.0:
            continue
        total += normal
        ux = motion[MOTION.vx] + motion[MOTION.wy] * pz - motion[MOTION.wz] * py
        uz = motion[MOTION.vz] + motion[MOTION.wx] * py - motion[MOTION.wy] * px
        slip = -row[FRICTION] * normal / math.sqrt(ux * ux + uz * uz + SLIDING * SLIDING)
        fx, fy, fz = slip * ux, side * normal, slip * uz
        wrench[0], wrench[1], wrench[2] = wrench[0] + fx, wrench[1] + fy, wrench[2] + fz
        wrench[3] += py * fz - pz * fy
        wrench[4] += pz * fx - px * fz
        wrench[5] += px * fy - py * fx
    return total


@jit(allocates=False)
def press_check_rails(model, state, work):
    """Add the forces and moments of check rails to those of the rails on all wheels, for the motions in ``work``."""
    rows = model.check_rails.rows
    for k in range(work.rail_wrenches.shape[0]):
        s = arc_length_at(model, state, work, k)
        for wheel in range(2):
            aside, _ = displacement(model, state, k, wheel)
            for j in range(rows.shape[1]):
                check_force(rows[k, j], s, aside, work.motions[k, wheel], work.rail_wrenches[k, wheel])


@jit(allocates=False)
def shorten_near_check_rails(model, state, work, clock, at):
    """Shorten the next step, ``clock[at]`` (s), on changing rails (`shorten_step`) and near check rails.

    A wheelset must not pass the begin of a check rail in a step, and moves at most `STRIDE` at one."""
    shorten_step(model, state, work, clock, at)
    for k in range(work.motions.shape[0]):
        speed, s = abs(work.motions[k, 0, MOTION.vx]), arc_length_at(model, state, work, k)
        for j in range(model.check_rails.rows.shape[1]):
            row = model.check_rails.rows[k, j]
            left = max(row[BEGIN] - row[CHORD] - s, s - row[END] - row[CHORD], STRIDE)
            if speed * clock[at] > left:
                clock[at] = left / speed
