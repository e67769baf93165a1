"""Residual and Jacobian of the normal problem on Galerkin strips."""

import math
from typing import NamedTuple

import numpy as np

from wrcore.contact.normal.gap import (
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
    unroll,
)
from wrcore.contact.normal.grading import spread
from wrcore.contact.normal.influence import edges_of, influence_of
from wrcore.contact.search.reduction import MAX_PATCHES
from wrcore.kernels.jit import FUSED, jit

MAX_STRIPS = 64
MAX_WINDOWS = 4
MAX_RUNS = 16
"""Maximum number of runs of strips in contact, that of 32 fixed strips; sub-patches may outnumber the windows."""

MAX_UNKNOWNS = 3 * MAX_STRIPS + 2 * MAX_WINDOWS

POINTS = np.cos((np.arange(4) + 0.5) * math.pi / 4.0)
"""Gauss-Chebyshev points of a strip over its half length; without yaw, by symmetry, the first two are sufficient."""

COMPENSATION = 0.0125
"""Fraction of the second difference of the gap over the strips that is added to the gap. It offsets the error of a
pressure that is constant across each strip. With this value N has the smallest error with 8 to 16 strips, from round to
slender patches (without it +0.25 % with 8 strips on the tread)."""

SMOOTHING = 0.006
"""Weight of the third differences of c in the conditions, which keeps c smooth in slender patches."""

BEND = float(np.sum(((4.0 * POINTS**2 - 2.0) * POINTS**2)[:2]))
"""Value of the second of Galerkin's conditions for a parabola t^2."""


MEMORY = 9 + 3 * MAX_WINDOWS + 3 * MAX_STRIPS
"""Length of the memory of a solution for a warm start.

It holds the number of windows (0: no solution; < 0: no windows were found), x, ur, z of the frame's origin; for each
window the end of its strips and both tips; the number of guessed windows, and the change of the usual number of strips;
y, z of the wheel and angle of the frame; Q, c and X of each strip. If no windows were found, it holds the windows of
fixed strips, with their number in place of the change, and the load in place of Q."""

TIPS_FROM = 4
GUESSED = TIPS_FROM + 3 * MAX_WINDOWS
EXTRA = KEPT = GUESSED + 1
WHEEL_POSITION = EXTRA + 1
STRIPS_FROM = WHEEL_POSITION + 3
"""First indices of the parts of a memory: tips, guessed windows, change of the number of strips (or number of windows
of fixed strips), wheel position, strips."""


STEPS = 250
"""Number of Newton steps of a patch after which fixed strips replace further sets of windows. Of 100 patches with a
solution, 99 take at most 30 to 50 steps in all; one on a flange under 230 kN took 231. Patches without a solution
would take up to 450."""

WIDENED, WEIGHT, GUESS, FIXED = range(4)
"""Indices of `NormalWork.more`."""


class NormalWork(NamedTuple):
    """Work arrays of one solution; lateral coordinates are positive outwards, strips are sorted by increasing s."""

    nodes: np.ndarray
    """(NODE_ROWS, n): s, gap, A, x of the minimum gap and first guesses of c and Q at nodes over the overlaps."""
    ends: np.ndarray
    """Number of nodes up to the end of each overlap."""
    low: np.ndarray
    high: np.ndarray
    """(MAX_WINDOWS,) tips of the windows, m."""
    start: np.ndarray
    """(MAX_WINDOWS + 1,) first strip of each window."""
    guessed: np.ndarray
    """(MAX_WINDOWS + 1,): number of windows of the first guess (0: not usable), and their numbers of strips."""
    fresh: np.ndarray
    """(2, MAX_RUNS + 1): tips of new windows, m."""
    tops: np.ndarray
    """(MAX_WINDOWS,): largest c of each window, m^2."""
    measure: np.ndarray
    """(n,): integral over s, at the nodes, of the density rho of strips, see `grading`."""
    looked: np.ndarray
    """(1,): number of nodes."""
    stride: np.ndarray
    """(2, MAX_WINDOWS): last step of the tips, m."""
    window: np.ndarray
    """Window of each strip."""
    centre: np.ndarray
    width: np.ndarray
    """Position s of the middle and width of the strips, m."""
    rates: np.ndarray
    """(4, MAX_STRIPS): derivatives of centre and width with respect to the lower and upper tip of the window."""
    place: np.ndarray
    own: np.ndarray
    """Position and width of the strips over the unrolled surface, m, see `gap.unroll`."""
    share: np.ndarray
    """Q: p = pi E* Q sqrt(c - (x - X)^2), 1/m."""
    square: np.ndarray
    """c = a^2, m^2."""
    middle: np.ndarray
    """X, m."""
    gap: np.ndarray
    """(MAX_STRIPS, GAP_ROWS), see `strip_gap`."""
    logs: np.ndarray
    """(2, MAX_STRIPS): ln c and 1/a of the strips."""
    sums: np.ndarray
    """(4, 4): loaded gap at the points of one strip, and its derivatives over x and s."""
    matrix: np.ndarray
    """(MAX_UNKNOWNS, MAX_UNKNOWNS + 1): Jacobian and residual."""
    kept: np.ndarray
    """Copy of ``matrix`` before its solution."""
    active: np.ndarray
    load: np.ndarray
    """Whether a fixed strip is in contact, and the load of each fixed strip."""
    more: np.ndarray
    """(4,). WIDENED: factor of a window's width where its strips are counted, 1 or `windows.BLENDING_RATIO`. WEIGHT:
    weight of the solution with the larger factor in the mean of both solutions (found with 1). GUESS: this weight for
    the first guess. FIXED: not 0 if strips are fixed because no tips were found."""
    left: np.ndarray
    """(2,): remaining Newton steps of a patch (the search ends at 0), and their number at the beginning."""


def normal_work():
    """Return a `NormalWork` for the solution of one patch at a time."""
    n, m = MAX_STRIPS, MAX_WINDOWS
    return NormalWork(
        np.zeros((NODE_ROWS, MAX_PATCHES * NODES)), np.zeros(MAX_PATCHES, np.int64), np.zeros(m), np.zeros(m),
        *(np.zeros(m + 1, np.int64) for _ in range(2)), np.zeros((2, MAX_RUNS + 1)), np.zeros(m),
        np.zeros(MAX_PATCHES * NODES), np.zeros(1, np.int64), np.zeros((2, m)), np.zeros(n, np.int64),
        *np.zeros((2, n)), np.zeros((4, n)), *np.zeros((2, n)), *np.zeros((3, n)), np.zeros((n, GAP_ROWS)),
        np.zeros((2, n)), np.zeros((4, 4)),
        *(np.zeros((MAX_UNKNOWNS, MAX_UNKNOWNS + 1)) for _ in range(2)), np.zeros(n, np.bool_), np.zeros(n),
        np.array([1.0, 0.0, 0.0, 0.0]), np.array([0, STEPS]),
    )  # fmt: skip


@jit(allocates=False, fastmath=FUSED)
def lay_out_strips(geometry, pose, frame, work, windows):
    """Fill centres, widths and gaps of the strips between the tips of the windows."""
    u, ur = work.gap[0, U], work.gap[0, UR]
    for k in range(windows):
        first, last = work.start[k], work.start[k + 1]
        spread(work, k)
        for i in range(first, last):
            row = work.gap[i]
            found = strip_gap(geometry, pose, frame, work.centre[i], u, ur)
            for q in range(GAP_ROWS):
                row[q] = found[q]
            u, ur = row[U], row[UR]
        for column in (GAP, GAP_SLOPE):
            _compensate(work, column, first, last)
    unroll(work.centre[: work.start[windows]], work.width, work.gap[:, TILT], work.place, work.own)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _compensate(work, column, first, last):
    """Add a fraction of the second difference over the strips to a gap column, see `COMPENSATION`."""
    gap, centre, width = work.gap, work.centre, work.width
    before, here = gap[first, column], gap[first + 1, column]
    bend = 0.0
    for i in range(first + 1, last - 1):
        after = gap[i + 1, column]
        behind, ahead = centre[i] - centre[i - 1], centre[i + 1] - centre[i]
        bend = 2.0 * ((after - here) / ahead - (here - before) / behind) / (ahead + behind)
        if i == first + 1:
            gap[first, column] += COMPENSATION * bend * width[first] * width[first]
        before, here = here, after
        gap[i, column] += COMPENSATION * bend * width[i] * width[i]
    gap[last - 1, column] += COMPENSATION * bend * width[last - 1] * width[last - 1]


@jit(allocates=False, fastmath=FUSED)
def assemble(values, work, windows, kinds):
    """Fill the Jacobian and (last column) the residual of the conditions for strips and tips; return their number.

    ``kinds`` is the number of unknowns of a strip: 2 without yaw, else 3."""
    strips = work.start[windows]
    n = kinds * strips + 2 * windows
    matrix, tips, sums = work.matrix, kinds * strips, work.sums
    points = 2 if kinds == 2 else 4
    for i in range(n):
        for j in range(n + 1):
            matrix[i, j] = 0.0
    for j in range(strips):
        work.logs[0, j], work.logs[1, j] = math.log(work.square[j]), 1.0 / math.sqrt(work.square[j])
    for i in range(strips):
        k, row, a = kinds * i, work.gap[i], math.sqrt(work.square[i])
        for m in range(points):
            d = work.middle[i] + a * POINTS[m] - row[CREST]
            sums[0, m], sums[1, m] = row[GAP] + row[SHAPE] * d * d, 2.0 * row[SHAPE] * d
            sums[2, m] = 0.0
        for j in range(strips):
            c, p = work.square[j], work.share[j]
            inverse, load, toward = work.logs[1, j], p * c, 1.0 if i > j else -1.0
            distance, half = toward * (work.place[i] - work.place[j]), 0.5 * work.own[j]
            low, high = (distance - half) * inverse, (distance + half) * inverse
            log_low, log_high = math.log(max(low, 1e-9)), math.log(high)
            if i == j:
                low = -1.0
            edges = edges_of(low, high, log_low, log_high)
            b00 = b01 = b02 = b10 = b11 = b12 = b20 = b21 = b22 = 0.0
            s0 = s1 = s2 = w0 = w1 = w2 = 0.0
            for m in range(points):
                t = POINTS[m]
                offset = work.middle[i] + a * t - work.middle[j]
                xi = abs(offset) * inverse
                value, along, over, shear = influence_of(values, xi, low, high, edges)
                turn = load * along * (inverse if offset > 0.0 else -inverse)
                shear *= inverse * load
                sums[0, m] += load * value
                sums[1, m] += turn
                sums[2, m] += toward * shear
                over_q, over_c = c * value, p * (value - 0.5 * (xi * along + over))
                wider = load * over - shear * distance
                q0, q1 = 1.0 - t * t, 4.0 * t * t - 2.0
                b00 += q0 * over_q
                b01 += q0 * over_c
                b10 += q1 * over_q
                b11 += q1 * over_c
                s0 += q0 * shear
                s1 += q1 * shear
                w0 += q0 * wider
                w1 += q1 * wider
                if kinds == 3:
                    b02 -= q0 * turn
                    b12 -= q1 * turn
                    b20 += t * over_q
                    b21 += t * over_c
                    b22 -= t * turn
                    s2 += t * shear
                    w2 += t * wider
            at, tip = kinds * j, tips + 2 * work.window[j]
            matrix[k, at], matrix[k, at + 1], matrix[k + 1, at], matrix[k + 1, at + 1] = b00, b01, b10, b11
            moved, widened = -toward * work.own[j] / work.width[j], 1.0 / work.width[j]
            for side in range(2):
                by_place, by_width = moved * work.rates[side, j], widened * work.rates[2 + side, j]
                matrix[k, tip + side] += s0 * by_place + w0 * by_width
                matrix[k + 1, tip + side] += s1 * by_place + w1 * by_width
                if kinds == 3:
                    matrix[k + 2, tip + side] += s2 * by_place + w2 * by_width
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
            ratio = 2.0 + work.width[inner] / work.width[end]
            matrix[k, kinds * end + 1], matrix[k, kinds * inner + 1] = ratio, -1.0
            matrix[k, n] = work.square[inner] - ratio * work.square[end]
    return n


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _close_strip(work, i, kinds, points, tips, n):
    """Fill the residual of strip i and add its derivatives with respect to half length, middle and position of strip
    i."""
    own, k, row, matrix, sums = work.window[i], kinds * i, work.gap[i], work.matrix, work.sums
    a, stretch = math.sqrt(work.square[i]), work.own[i] / work.width[i]
    for m in range(points):
        t = POINTS[m]
        d = work.middle[i] + a * t - row[CREST]
        over_s = stretch * sums[2, m] + row[GAP_SLOPE]
        over_s += row[SHAPE_RATE] * d * d - 2.0 * row[SHAPE] * d * row[CREST_RATE]
        for q in range(kinds):
            weight = 1.0 - t * t if q == 0 else (4.0 * t * t - 2.0 if q == 1 else t)
            matrix[k + q, n] -= weight * sums[0, m]
            matrix[k + q, k + 1] += weight * sums[1, m] * t * 0.5 / a
            matrix[k + q, tips + 2 * own] += weight * over_s * work.rates[0, i]
            matrix[k + q, tips + 2 * own + 1] += weight * over_s * work.rates[1, i]
            if kinds == 3:
                matrix[k + q, k + 2] += weight * sums[1, m]


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _third(work, i, r):
    """Weight of the r-th of the strips i to i + 3 in their third difference, for a mean distance of 1."""
    s, product = work.centre, 1.0
    for q in range(4):
        if q != r:
            product *= s[i + r] - s[i + q]
    mean = (s[i + 3] - s[i]) / 3.0
    return 6.0 * mean * mean * mean / product


@jit(allocates=False, fastmath=FUSED)
def _smooth(work, own, kinds, points, n):
    """Add a penalty on third differences of c (and X) of the strips of a window.

    With narrow strips, oscillations of the contact's edge hardly change the gap, so that the conditions alone do not
    exclude them."""
    first, last, matrix = work.start[own], work.start[own + 1], work.matrix
    largest = 0.0
    for i in range(first, last):
        largest = max(largest, work.square[i])
    a = math.sqrt(largest)
    for i in range(first, last - 3):
        slender = 10.0 * (work.centre[i + 3] - work.centre[i]) / (3.0 * a)
        factor = SMOOTHING * 0.25 * points * work.gap[(first + last) // 2, SHAPE] / (1.0 + slender * slender)
        for r in range(4):
            for c in range(4):
                f = factor * _third(work, i, r) * _third(work, i, c)
                row, column = kinds * (i + r), kinds * (i + c)
                matrix[row + 1, column + 1] += f
                matrix[row + 1, n] -= f * work.square[i + c]
                if kinds == 3:
                    matrix[row + 2, column + 2] += 2.0 * a * f
                    matrix[row + 2, n] -= 2.0 * a * f * work.middle[i + c]


@jit(allocates=False, fastmath=FUSED)
def gap_under_load(values, work, windows, s, x, gap):
    """Gap (m) between the loaded surfaces at (x, s), where the gap of the undeformed surfaces is ``gap`` (m)."""
    for j in range(work.start[windows]):
        inverse = 1.0 / math.sqrt(work.square[j])
        stretch = work.own[j] / work.width[j]
        distance, w = abs(s - work.centre[j]) * stretch, work.own[j]
        low, high = (distance - 0.5 * w) * inverse, (distance + 0.5 * w) * inverse
        xi = abs(x - work.middle[j]) * inverse
        if low > 1e-9:
            value = influence_of(values, xi, low, high, edges_of(low, high, math.log(low), math.log(high)))[0]
        else:  # inside the strip: twice the influence of half of it
            half = 0.5 * w * inverse
            value = influence_of(values, xi, -1.0, half, edges_of(-1.0, half, 0.0, math.log(half)))[0]
        gap += work.share[j] * work.square[j] * value
    return gap
