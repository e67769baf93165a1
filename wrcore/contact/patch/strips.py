"""Galerkin strips: residual and Jacobian of the normal problem."""

import math
from typing import NamedTuple

import numpy as np

from wrcore.contact.patch.gap import (
    CREST,
    CREST_RATE,
    GAP,
    GAP_ROWS,
    GAP_SLOPE,
    NODE_ROWS,
    NODES,
    SHAPE,
    SHAPE_RATE,
    TILT,
    UR,
    U,
    strip_gap,
)
from wrcore.contact.patch.normal_influence import edges_of, influence_of
from wrcore.contact.reduction import MAX_PATCHES
from wrcore.kernels.jit import FUSED, jit

MAX_STRIPS = 64
MAX_WINDOWS = 4
MAX_UNKNOWNS = 3 * MAX_STRIPS + 2 * MAX_WINDOWS

POINTS = np.cos((np.arange(4) + 0.5) * math.pi / 4.0)
"""Gauss-Chebyshev points of a strip over its half length; without yaw the first two do."""

COMPENSATION = 0.0125
"""Share of the second difference of the gap over the strips that offsets pressures constant across each strip: N of 8
to 16 strips then errs least, from round to slender patches (without it by +0.25 % with 8 strips on the tread)."""

SMOOTHING = 0.006
"""Weight that holds down third differences of c along slender patches."""

THIRD = np.array([1.0, -3.0, 3.0, -1.0])

BEND = float(np.sum(((4.0 * POINTS**2 - 2.0) * POINTS**2)[:2]))
"""What the second of Galerkin's conditions makes of a parabola t^2."""


MEMORY = 4 + 3 * MAX_WINDOWS + 3 * MAX_STRIPS
"""Numbers that a warm start wants of a solution: windows (0: none), x, ur, z of its frame's origin; ends in strips and
tips of its windows; Q, c and X of its strips."""


WIDENED, WEIGHT, GUESS = range(3)
"""Places of a workspace's ``more``."""


class NormalWork(NamedTuple):
    """Arrays that a solution works in; lateral coordinates count outwards, strips by increasing s."""

    nodes: np.ndarray
    """(NODE_ROWS, n): s, gap, A and first guesses of c and Q where the overlaps are looked at."""
    ends: np.ndarray
    """Number of nodes up to the end of each overlap."""
    low: np.ndarray
    high: np.ndarray
    """(MAX_WINDOWS,) tips of the windows, m."""
    start: np.ndarray
    """(MAX_WINDOWS + 1,) first strip of each window."""
    guessed: np.ndarray
    """(MAX_WINDOWS + 1,): number of windows of the first guess, 0: of no use, and their numbers of strips."""
    fresh: np.ndarray
    """(2, MAX_WINDOWS + 1): tips of windows to be, m."""
    tops: np.ndarray
    """(MAX_WINDOWS,): largest c of each window, m^2."""
    stretch: np.ndarray
    """(MAX_WINDOWS,): mean width of each window's strips along their own planes, over that in the frame."""
    stride: np.ndarray
    """(2, MAX_WINDOWS): last step of the tips, m."""
    window: np.ndarray
    """Window of each strip."""
    centre: np.ndarray
    width: np.ndarray
    """Place and width of the strips, m."""
    share: np.ndarray
    """Q: p = pi E* Q sqrt(c - (x - X)^2), 1/m."""
    square: np.ndarray
    """c = a^2, m^2."""
    middle: np.ndarray
    """X, m."""
    gap: np.ndarray
    """(MAX_STRIPS, GAP_ROWS), see `strip_gap`."""
    logs: np.ndarray
    """(3, MAX_STRIPS): ln(k + 1/2), and ln c and 1/a of the strips."""
    sums: np.ndarray
    """(4, 4): what the points of one strip gather."""
    matrix: np.ndarray
    """(MAX_UNKNOWNS, MAX_UNKNOWNS + 1): Jacobian and residual."""
    kept: np.ndarray
    """The same before it is solved."""
    active: np.ndarray
    load: np.ndarray
    """Fixed strips in contact and their loads."""
    more: np.ndarray
    """(3,): widths of windows count this many times where strips are counted, 1 or `windows.MORE`; the weight that the
    solution with MORE has in the mean of both (found with 1); and this weight of the first guess."""


def normal_work():
    """`NormalWork` for the solution of one patch at a time."""
    n, m = MAX_STRIPS, MAX_WINDOWS
    return NormalWork(
        np.zeros((NODE_ROWS, MAX_PATCHES * NODES)), np.zeros(MAX_PATCHES, np.int64), np.zeros(m), np.zeros(m),
        *(np.zeros(m + 1, np.int64) for _ in range(2)), np.zeros((2, m + 1)), *np.zeros((2, m)), np.zeros((2, m)),
        np.zeros(n, np.int64),
        *(np.zeros(n) for _ in range(5)), np.zeros((n, GAP_ROWS)),
        np.stack([np.log(np.arange(n) + 0.5), np.zeros(n), np.zeros(n)]), np.zeros((4, 4)),
        *(np.zeros((MAX_UNKNOWNS, MAX_UNKNOWNS + 1)) for _ in range(2)), np.zeros(n, np.bool_), np.zeros(n),
        np.array([1.0, 0.0, 0.0]),
    )  # fmt: skip


@jit(allocates=False, fastmath=FUSED)
def place_strips(geometry, pose, frame, work, windows):
    """Centres, widths and gaps of the strips between the windows' tips."""
    u, ur = work.gap[0, U], work.gap[0, UR]
    for k in range(windows):
        first, last = work.start[k], work.start[k + 1]
        w, stretch = (work.high[k] - work.low[k]) / (last - first), 0.0
        for i in range(first, last):
            s = work.low[k] + (i - first + 0.5) * w
            work.centre[i], work.width[i], work.window[i] = s, w, k
            row = work.gap[i]
            found = strip_gap(geometry, pose, frame, s, u, ur)
            for q in range(GAP_ROWS):
                row[q] = found[q]
            u, ur, stretch = row[U], row[UR], stretch + math.sqrt(1.0 + row[TILT] * row[TILT])
        work.stretch[k] = stretch / (last - first)
        for column in (GAP, GAP_SLOPE):
            _compensate(work.gap, column, first, last)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _compensate(gap, column, first, last):
    """Add a share of the second difference over the strips: what pressures constant across a strip leave in u."""
    before, here = gap[first, column], gap[first + 1, column]
    bend = gap[first + 2, column] - 2.0 * here + before
    gap[first, column] += COMPENSATION * bend
    for i in range(first + 1, last):
        if i < last - 1:
            bend = gap[i + 1, column] - 2.0 * here + before
        before, here = here, gap[min(i + 1, last - 1), column]
        gap[i, column] += COMPENSATION * bend


@jit(allocates=False, fastmath=FUSED)
def assemble(values, work, windows, kinds):
    """Residual (last column) and Jacobian of Galerkin's conditions and of the tips; kinds = 2 without yaw, else 3."""
    strips = work.start[windows]
    n = kinds * strips + 2 * windows
    matrix, tips, sums = work.matrix, kinds * strips, work.sums
    points = 2 if kinds == 2 else 4
    for i in range(n):
        for j in range(n + 1):
            matrix[i, j] = 0.0
    for j in range(strips):
        work.logs[1, j], work.logs[2, j] = math.log(work.square[j]), 1.0 / math.sqrt(work.square[j])
    for i in range(strips):
        own, k, row = work.window[i], kinds * i, work.gap[i]
        a, log_w = math.sqrt(work.square[i]), math.log(work.width[i] * work.stretch[own])
        for m in range(points):
            d = work.middle[i] + a * POINTS[m] - row[CREST]
            sums[0, m], sums[1, m] = row[GAP] + row[SHAPE] * d * d, 2.0 * row[SHAPE] * d
            sums[2, m] = sums[3, m] = 0.0
        for j in range(strips):
            c, p = work.square[j], work.share[j]
            inverse, load = work.logs[2, j], p * c
            together, stretch = work.window[j] == own, work.stretch[work.window[j]]
            distance, half = abs(work.centre[i] - work.centre[j]), 0.5 * work.width[j] * stretch
            if together:
                distance *= stretch
            low, high = (distance - half) * inverse, (distance + half) * inverse
            offset_s = aside = part = part_w = 0.0
            if together:
                apart, shift = abs(i - j), log_w - 0.5 * work.logs[1, j]
                log_low, log_high = work.logs[0, max(apart - 1, 0)] + shift, work.logs[0, apart] + shift
            else:
                log_low, log_high = math.log(max(low, 1e-9)), math.log(high)
                offset_s = work.centre[i] - work.centre[j]
                aside = inverse if offset_s > 0.0 else -inverse
                begin, end = work.start[work.window[j]], work.start[work.window[j] + 1]
                part_w = 1.0 / ((end - begin) * work.width[j])
                part = (j - begin + 0.5) / (end - begin)
            if i == j:
                low = -1.0
            edges = edges_of(low, high, log_low, log_high)
            b00 = b01 = b02 = b10 = b11 = b12 = b20 = b21 = b22 = 0.0
            for m in range(points):
                t = POINTS[m]
                offset = work.middle[i] + a * t - work.middle[j]
                xi = abs(offset) * inverse
                value, along, over, shear = influence_of(values, xi, low, high, edges)
                turn = load * along * (inverse if offset > 0.0 else -inverse)
                sums[0, m] += load * value
                sums[1, m] += turn
                if together:
                    sums[2, m] += load * over
                else:
                    shear *= load * aside
                    sums[3, m] += shear
                    wider = (load * over - shear * offset_s) * part_w
                    q0, q1 = 1.0 - t * t, 4.0 * t * t - 2.0
                    tip = tips + 2 * work.window[j]
                    low_tip, high_tip = -shear * (1.0 - part) - wider, -shear * part + wider
                    matrix[k, tip] += q0 * low_tip
                    matrix[k, tip + 1] += q0 * high_tip
                    matrix[k + 1, tip] += q1 * low_tip
                    matrix[k + 1, tip + 1] += q1 * high_tip
                    if kinds == 3:
                        matrix[k + 2, tip] += t * low_tip
                        matrix[k + 2, tip + 1] += t * high_tip
                over_q, over_c = c * value, p * (value - 0.5 * (xi * along + over))
                q0, q1 = 1.0 - t * t, 4.0 * t * t - 2.0
                b00 += q0 * over_q
                b01 += q0 * over_c
                b10 += q1 * over_q
                b11 += q1 * over_c
                if kinds == 3:
                    b02 -= q0 * turn
                    b12 -= q1 * turn
                    b20 += t * over_q
                    b21 += t * over_c
                    b22 -= t * turn
            at = kinds * j
            matrix[k, at], matrix[k, at + 1], matrix[k + 1, at], matrix[k + 1, at + 1] = b00, b01, b10, b11
            if kinds == 3:
                matrix[k, at + 2], matrix[k + 1, at + 2] = b02, b12
                matrix[k + 2, at], matrix[k + 2, at + 1], matrix[k + 2, at + 2] = b20, b21, b22
        _close_strip(work, i, kinds, points, tips, n)
    for own in range(windows):
        _smooth(work, own, kinds, points, n)
        first, last = work.start[own], work.start[own + 1]
        for side in range(2):
            k = tips + 2 * own + side
            end, inner = (first, first + 1) if side == 0 else (last - 1, last - 2)
            matrix[k, kinds * end + 1], matrix[k, kinds * inner + 1] = 3.0, -1.0
            matrix[k, n] = work.square[inner] - 3.0 * work.square[end]
    return n


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _close_strip(work, i, kinds, points, tips, n):
    """Residual of strip i and what its own half length, middle and place do to it."""
    own, k, row, matrix, sums = work.window[i], kinds * i, work.gap[i], work.matrix, work.sums
    first, last = work.start[own], work.start[own + 1]
    a, w = math.sqrt(work.square[i]), work.width[i]
    part, inverse = (i - first + 0.5) / (last - first), 1.0 / (last - first)
    for m in range(points):
        t = POINTS[m]
        d = work.middle[i] + a * t - row[CREST]
        over_s = sums[3, m] + row[GAP_SLOPE] + row[SHAPE_RATE] * d * d - 2.0 * row[SHAPE] * d * row[CREST_RATE]
        stretch = sums[2, m] * inverse / w
        for q in range(kinds):
            weight = 1.0 - t * t if q == 0 else (4.0 * t * t - 2.0 if q == 1 else t)
            matrix[k + q, n] -= weight * sums[0, m]
            matrix[k + q, k + 1] += weight * sums[1, m] * t * 0.5 / a
            matrix[k + q, tips + 2 * own] += weight * (over_s * (1.0 - part) - stretch)
            matrix[k + q, tips + 2 * own + 1] += weight * (over_s * part + stretch)
            if kinds == 3:
                matrix[k + q, k + 2] += weight * sums[1, m]


@jit(allocates=False, fastmath=FUSED)
def _smooth(work, own, kinds, points, n):
    """Where strips are narrow a wiggle of the edge is hardly felt: third differences of c (and X) are held down."""
    first, last, matrix = work.start[own], work.start[own + 1], work.matrix
    largest = 0.0
    for i in range(first, last):
        largest = max(largest, work.square[i])
    a = math.sqrt(largest)
    slender = 10.0 * work.width[first] / a
    factor = SMOOTHING * 0.25 * points * work.gap[(first + last) // 2, SHAPE] / (1.0 + slender * slender)
    for i in range(first, last - 3):
        for r in range(4):
            for c in range(4):
                f = factor * THIRD[r] * THIRD[c]
                row, column = kinds * (i + r), kinds * (i + c)
                matrix[row + 1, column + 1] += f
                matrix[row + 1, n] -= f * work.square[i + c]
                if kinds == 3:
                    matrix[row + 2, column + 2] += 2.0 * a * f
                    matrix[row + 2, n] -= 2.0 * a * f * work.middle[i + c]


@jit(allocates=False, fastmath=FUSED)
def gap_under_load(values, work, windows, s, x, gap):
    """Gap (m) between the loaded surfaces at (x, s) where the undeformed one is ``gap``."""
    for j in range(work.start[windows]):
        inverse = 1.0 / math.sqrt(work.square[j])
        stretch = work.stretch[work.window[j]]
        distance, w = abs(s - work.centre[j]) * stretch, work.width[j] * stretch
        low, high = (distance - 0.5 * w) * inverse, (distance + 0.5 * w) * inverse
        xi = abs(x - work.middle[j]) * inverse
        if low > 1e-9:
            value = influence_of(values, xi, low, high, edges_of(low, high, math.log(low), math.log(high)))[0]
        else:  # inside the strip: twice the half of it
            half = 0.5 * w * inverse
            value = influence_of(values, xi, -1.0, half, edges_of(-1.0, half, 0.0, math.log(half)))[0]
        gap += work.share[j] * work.square[j] * value
    return gap
