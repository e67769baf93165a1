"""Check rails: rails beside running rails that hold wheels by the backs of their flanges, past crossings say.

A wheel's back is a plane across its axle, bounded by a circle; a check rail's face is upright, up to a height over the
running surface. They overlap, where they do, between the two points of that circle at that height, ahead of the axle
and behind it. Half of the force acts at either point,

    N = K/2 max(0, penetration there),   friction mu N u/sqrt(u^2 + v0^2) against the sliding velocity u in the face,

so that a wheel that yaws is touched ahead or behind, and nothing steps where it does not. The rail stands on the
ground: what it takes does not bend a flexible track.
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
"""Of a check rail: 1 beside the left, -1 beside the right running rail; arc lengths (m); distance of its face from the
middle of the track; length of its flares, and how far they open (m); distance of the wheels' backs from the middle of
the axle; how far ahead of the axle, and below it, the circle of a back crosses its upper edge (m); stiffness (N/m) and
coefficient of friction."""
COLUMNS = 11

SLIDING = 0.02
"""Sliding velocity at which friction has 71 % of what it can have, m/s. Chosen."""

STRIDE = 0.05
"""Longest step of a run beside a check rail, m."""


class CheckRails(NamedTuple):
    """Check rails, for kernels."""

    rows: np.ndarray  # (k, n, COLUMNS), of each wheelset


def no_check_rails():
    """`CheckRails` where there are none."""
    return CheckRails(np.zeros((0, 0, COLUMNS)))


@jit(allocates=False)
def face_at(row, s):
    """Distance of a check rail's face from the middle of the track at an arc length, m; far off where there is none."""
    if not row[BEGIN] < s < row[END]:
        return -1e3
    into = min(s - row[BEGIN], row[END] - s)
    return row[FACE] - row[OPENING] * max(0.0, 1.0 - into / row[FLARE])


@jit(allocates=False)
def check_force(row, s, aside, motion, wrench):
    """Normal force of a check rail on a wheel with a motion in its rail's frame, N, where that rail has moved ``aside``
    (m); adds what acts on the wheelset to its ``wrench`` about its centre."""
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
    """Add what check rails do to the wrenches of the rails on all wheels, for their motions in ``work``."""
    rows = model.check_rails.rows
    for k in range(work.rail_wrenches.shape[0]):
        s = arc_length_at(model, state, work, k)
        for wheel in range(2):
            aside, _ = displacement(model, state, k, wheel)
            for j in range(rows.shape[1]):
                check_force(rows[k, j], s, aside, work.motions[k, wheel], work.rail_wrenches[k, wheel])


@jit(allocates=False)
def shorten_near_check_rails(model, state, work, clock, at):
    """As `shorten_step`, and for wheelsets that come to a check rail or are beside one."""
    shorten_step(model, state, work, clock, at)
    for k in range(work.motions.shape[0]):
        speed, s = abs(work.motions[k, 0, MOTION.vx]), arc_length_at(model, state, work, k)
        for j in range(model.check_rails.rows.shape[1]):
            row = model.check_rails.rows[k, j]
            left = max(row[BEGIN] - row[CHORD] - s, s - row[END] - row[CHORD], STRIDE)
            if speed * clock[at] > left:
                clock[at] = left / speed
