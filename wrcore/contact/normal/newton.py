"""Newton's iteration for the pressure on strips and for the tips of contact, which are the ends of windows."""

import math

from wrcore.contact.normal.gap import CREST
from wrcore.contact.normal.strips import assemble, lay_out_strips
from wrcore.kernels.jit import FUSED, jit


@jit(allocates=False, fastmath=FUSED)
def _factorise_panel(matrix, n, begin, end):
    """Eliminate below the diagonal in columns ``begin`` to ``end`` - 1, with exchange of whole rows; False if
    singular."""
    for k in range(begin, end):
        pivot, largest = k, abs(matrix[k, k])
        for i in range(k + 1, n):
            if abs(matrix[i, k]) > largest:
                pivot, largest = i, abs(matrix[i, k])
        if not largest > 1e-300:
            return False
        if pivot != k:
            one, other = matrix[k], matrix[pivot]
            for j in range(n + 1):
                one[j], other[j] = other[j], one[j]
        inverse = 1.0 / matrix[k, k]
        for i in range(k + 1, n):
            factor = matrix[i, k] * inverse
            matrix[i, k] = factor
            for j in range(k + 1, end):
                matrix[i, j] -= factor * matrix[k, j]
    return True


@jit(allocates=False, fastmath=FUSED)
def _subtract_four(row, one, two, three, four, a, b, c, d):
    for j in range(row.size):
        row[j] -= a * one[j] + b * two[j] + c * three[j] + d * four[j]


@jit(allocates=False, fastmath=FUSED)
def solve_linear(matrix, n):
    """Solve a linear system (n, n + 1), with its right side in column n, in place; False if the matrix is singular.

    Gaussian elimination with partial pivoting, four columns at a time. The solution replaces column n."""
    for begin in range(0, n, 4):
        end = min(begin + 4, n)
        if not _factorise_panel(matrix, n, begin, end):
            return False
        for k in range(begin + 1, end):  # the panel's own rows
            for r in range(begin, k):
                factor, row, other = matrix[k, r], matrix[k], matrix[r]
                for j in range(end, n + 1):
                    row[j] -= factor * other[j]
        if end == begin + 4:
            one, two = matrix[begin, end : n + 1], matrix[begin + 1, end : n + 1]
            three, four = matrix[begin + 2, end : n + 1], matrix[begin + 3, end : n + 1]
            for i in range(end, n):
                row = matrix[i]
                _subtract_four(row[end : n + 1], one, two, three, four, row[begin], row[begin + 1], row[begin + 2],
                               row[begin + 3])  # fmt: skip
    for k in range(n - 1, -1, -1):
        row, total = matrix[k], matrix[k, n]
        for j in range(k + 1, n):
            total -= row[j] * matrix[j, n]
        matrix[k, n] = total / row[k]
    return True


@jit(allocates=False)
def _copy(source, n, out):
    for i in range(n):
        for j in range(n + 1):
            out[i, j] = source[i, j]


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _limited(value, low, high):
    return min(max(value, low), high)


@jit(allocates=False, fastmath=FUSED)
def _tips_too_fast(work, windows, kinds, bold):
    """Limit the steps of the tips to a strip's width, and to half of the last step where the direction reverses.

    A tip whose direction reverses again and again lies at a kink of the gap, where the tip's condition has no zero. If
    ``bold``, its step then follows only the sign of the condition: outwards while c does not decrease fast enough.

    Returns whether a step was limited. The steps of the strips must then be solved again."""
    tips, cut = kinds * work.start[windows], False
    n = tips + 2 * windows
    for k in range(windows):
        for side in range(2):
            w = work.width[work.start[k]] if side == 0 else work.width[work.start[k + 1] - 1]
            step, before = work.matrix[tips + 2 * k + side, n], work.stride[side, k]
            limit = min(w, 0.5 * abs(before)) if step * before < 0.0 else w
            work.stride[side, k] = min(max(step, -limit), limit)
            if step * before < 0.0 and abs(step) > limit and bold:
                end = work.start[k] if side == 0 else work.start[k + 1] - 1
                inner = end + 1 - 2 * side
                outwards = 2.0 * side - 1.0 if 3.0 * work.square[end] > work.square[inner] else 1.0 - 2.0 * side
                work.stride[side, k] = 0.5 * w * outwards
            cut = cut or work.stride[side, k] != step
    return cut


CONVERGED, STARVED, CROSSED, LOST = 0, 1, 2, 3

_RESTLESS = 6
"""Number of steps after which a tip that reverses its direction is treated as trapped at a kink."""

_PATIENCE = 3
"""Number of successive steps with a strip losing its pressure, or two windows overlapping, after which Newton's
iteration stops."""


FAINT, NEGLIGIBLE = 2e-3, 1e-4
"""Limits of c below which there is no pressure: of a strip over the maximum c of its window, and of the maximum of a
window over that of the patch."""


@jit(allocates=False, fastmath=FUSED)
def top_squares(work, windows):
    """Fill ``work.tops`` with the maximum c of each window; return the maximum of all windows (m^2)."""
    largest = 0.0
    for k in range(windows):
        work.tops[k] = 0.0
        for i in range(work.start[k], work.start[k + 1]):
            work.tops[k] = max(work.tops[k], work.square[i])
        largest = max(largest, work.tops[k])
    return largest


@jit(allocates=False, fastmath=FUSED)
def newton(geometry, pose, frame, values, work, windows, kinds, bold, most, tolerance):
    """Solve Galerkin's conditions by Newton's iteration from the strips in ``work``, with limited steps of each strip.

    ``most`` is the maximum number of steps; for ``bold`` see `_tips_too_fast`. Returns CONVERGED, STARVED (strips lost
    their pressure), CROSSED (windows overlap) or LOST (no convergence)."""
    strips = work.start[windows]
    starved_for = crossed_for = 0
    for k in range(windows):
        work.stride[0, k] = work.stride[1, k] = 0.0
    for step in range(most):
        work.left[0] -= 1
        lay_out_strips(geometry, pose, frame, work, windows)
        largest = top_squares(work, windows)
        if kinds == 2:
            for i in range(strips):
                work.middle[i] = work.gap[i, CREST]
        n = assemble(values, work, windows, kinds)
        _copy(work.matrix, n, work.kept)
        if not solve_linear(work.matrix, n):
            return LOST
        if _tips_too_fast(work, windows, kinds, bold and step >= _RESTLESS):
            _copy(work.kept, n, work.matrix)
            for k in range(kinds * strips, n):
                for j in range(n):
                    work.matrix[k, j] = 0.0
                work.matrix[k, k] = 1.0
                work.matrix[k, n] = work.stride[(k - kinds * strips) % 2, (k - kinds * strips) // 2]
            if not solve_linear(work.matrix, n):
                return LOST
        change, starved = 0.0, False
        for i in range(strips):
            k = kinds * i
            dq, dc = work.matrix[k, n], work.matrix[k + 1, n]
            q, c = work.share[i], work.square[i]
            if not (abs(dq) < 1e300 and abs(dc) < 1e300):
                return LOST
            change = max(change, abs(dq) / q, abs(dc) / largest)
            top = work.tops[work.window[i]]
            starved = starved or (c + dc < 0.0 and (c < FAINT * top or top < NEGLIGIBLE * largest))
            work.share[i] = _limited(q + dq, 0.5 * q, 1.5 * q)
            work.square[i] = _limited(c + dc, max(0.3 * c, 1e-9 * largest), 1.5 * c + 0.1 * top)
            if kinds == 3:
                dx, a = work.matrix[k + 2, n], math.sqrt(c)
                change = max(change, abs(dx) / math.sqrt(largest))
                work.middle[i] += _limited(dx, -0.5 * a, 0.5 * a)
        starved_for = starved_for + 1 if starved else 0
        crossed = False
        for k in range(windows):
            w, last_w = work.width[work.start[k]], work.width[work.start[k + 1] - 1]
            change = max(change, abs(work.stride[0, k]) / w, abs(work.stride[1, k]) / last_w)
            work.low[k] += work.stride[0, k]
            work.high[k] += work.stride[1, k]
            if k > 0 and work.low[k] <= work.high[k - 1]:
                crossed = True
                middle = 0.5 * (work.low[k] + work.high[k - 1])
                work.low[k], work.high[k - 1] = middle + 0.05 * w, middle - 0.05 * w
        crossed_for = crossed_for + 1 if crossed else 0
        if change < tolerance:
            return CONVERGED
        if starved_for >= _PATIENCE:
            return STARVED
        if crossed_for >= _PATIENCE:
            return CROSSED
    return LOST


@jit(allocates=False, fastmath=FUSED)
def solve_shares(values, work, windows, kinds):
    """Update Q of all strips from the first of Galerkin's conditions at fixed half lengths.

    This is a start of the iteration where Hertz's theory has none."""
    strips = work.start[windows]
    n = assemble(values, work, windows, kinds)
    matrix = work.matrix
    mean = 0.0
    for i in range(strips):
        mean += work.share[i] / strips
        matrix[i, strips] = matrix[kinds * i, n]
        for j in range(strips):
            matrix[i, j] = matrix[kinds * i, kinds * j]
    if solve_linear(matrix, strips):
        for i in range(strips):
            work.share[i] = _limited(work.share[i] + matrix[i, strips], 0.3 * mean, 3.0 * mean)
