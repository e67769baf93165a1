"""Contact windows by an active set on strips of fixed width: the fallback when Newton's iteration fails.

References
----------
Anderson, Iterative procedures for nonlinear integral equations, J. ACM 12 (1965) 547-560.
"""

import math

from wrcore.contact.normal.gap import CREST, GAP, GAP_ROWS, NODE_GAP, NODE_SHARE, NODE_SQUARE, SHAPE, UR, S, U
from wrcore.contact.normal.newton import solve_linear
from wrcore.contact.normal.strips import BEND, KEPT, MAX_WINDOWS, STRIPS_FROM, TIPS_FROM, assemble, lay_out_strips
from wrcore.contact.normal.windows import active_runs, newborn, take_fresh
from wrcore.kernels.jit import FUSED, jit

FIXED = 32
"""Number of fixed strips of a patch."""

_SWEEPS, _AGAIN = 16, 8
"""Maximum number of sweeps over half lengths and loads: from the overlaps, and from the last solution."""

_KEPT = 3
"""Number of sweeps whose half lengths are combined for the next sweep."""

_ALLOWED_OVERLAP = 0.01
"""Maximum overlap of the loaded surfaces outside strips taken from the last solution, over the maximum penetration."""

_SETTLED, _CONVERGED = 0.02, (0.05, 0.002)
"""Limits of the largest change of c over the maximum c: for a usable solution, and for the end of sweeps. The first of
two limits holds before the strips are refined, the second for the final strips."""


@jit(allocates=False, fastmath=FUSED)
def _fixed_strips(geometry, pose, frame, values, work, stretches, kinds):
    """Solve for loads on fixed strips over all overlaps, then on finer strips around the runs that carry load.

    Returns the number of windows (0 if no loads were found) and of runs, the maximum c (m^2), and the last change of c
    over this maximum."""
    nodes, count = work.nodes, work.ends[stretches - 1]
    low, high, found, largest, moved = 1e9, -1e9, 0, 0.0, -1.0
    for i in range(count):
        if nodes[NODE_GAP, i] < 0.0:
            for k in (max(i - 1, 0), min(i + 1, count - 1)):  # the overlap's end lies before a node beyond
                part = nodes[NODE_GAP, i] / (nodes[NODE_GAP, i] - max(nodes[NODE_GAP, k], 0.0))
                end = nodes[S, i] + part * (nodes[S, k] - nodes[S, i])
                low, high = min(low, end), max(high, end)
    if not high > low:
        return 0, found, largest, moved
    work.low[0], work.high[0], windows = low, high, 1
    for refined in range(2):
        work.start[0] = 0
        for k in range(windows):
            work.start[k + 1] = work.start[k] + FIXED // windows
        work.gap[0, U], work.gap[0, UR] = frame.u + work.low[0] * frame.cosine, frame.ur + work.low[0] * frame.cosine
        lay_out_strips(geometry, pose, frame, work, windows)
        _press(work, windows)
        moved = _carry(values, work, windows, kinds, _SWEEPS, _CONVERGED[refined])
        if moved < 0.0:
            return 0, found, largest, moved
        found, largest = active_runs(work, windows)
        if refined == 0:
            windows = _widened(work, found, low, high, work.width[0])
    return windows, found, largest, moved


@jit(allocates=False, fastmath=FUSED)
def windows_from_fixed(geometry, pose, frame, values, work, stretches, resolution):
    """Create windows from the solution on fixed strips; return their number.

    Writes c and Q of the fixed strips to the nodes as the next guesses. If more than MAX_WINDOWS sub-patches carry
    load, returns 0 and ends the search (``work.left``)."""
    nodes, count = work.nodes, work.ends[stretches - 1]
    windows, found, largest, _ = _fixed_strips(geometry, pose, frame, values, work, stretches, 2)
    if found > MAX_WINDOWS:
        work.left[0] = 0
    if windows == 0 or found > MAX_WINDOWS:
        return 0
    total, squares = 0.0, 1e-300
    for i in range(work.start[windows]):
        if work.active[i]:
            total, squares = total + work.load[i], squares + work.square[i]
    mean = total / squares
    for k in range(count):
        nodes[NODE_SQUARE, k], nodes[NODE_SHARE, k] = 0.0, mean
        for i in range(work.start[windows]):
            if work.active[i] and abs(nodes[S, k] - work.centre[i]) <= 0.5 * work.width[i]:
                nodes[NODE_SQUARE, k], nodes[NODE_SHARE, k] = work.square[i], work.load[i] / work.square[i]
    return take_fresh(work, found, largest, resolution)


@jit(allocates=False, fastmath=FUSED)
def solve_fixed(geometry, pose, frame, values, work, stretches, kinds, memory):
    """Solve the normal problem on fixed strips, if Newton's iteration has no solution; return the number of windows.

    The tips have errors of up to a strip's width. Returns 0 if c does not converge. A ``memory`` of a failed search
    (see `solve_patch`) holds the strips, from which the next solution starts."""
    windows, moved = _go_on(geometry, pose, frame, values, work, stretches, kinds, memory)
    if windows == 0:
        windows, _, _, moved = _fixed_strips(geometry, pose, frame, values, work, stretches, kinds)
    if moved > _SETTLED:
        return 0
    if memory[0] < 0.0:
        _keep(frame, work, windows, memory)
    kept = first = lobe = 0
    for k in range(windows):
        end = work.start[k + 1]
        for i in range(first, end):
            if not work.active[i]:
                continue
            lobe += int(i > 0 and (i == first or not work.active[i - 1]))  # each run of active strips has two tips
            work.centre[kept], work.width[kept], work.window[kept] = work.centre[i], work.width[i], lobe
            work.share[kept], work.square[kept] = work.load[i] / work.square[i], work.square[i]
            work.middle[kept] = work.middle[i]
            for q in range(GAP_ROWS):
                work.gap[kept, q] = work.gap[i, q]
            kept += 1
        first, work.start[k + 1] = end, kept
    return windows if kept > 2 else 0


@jit(allocates=False, fastmath=FUSED)
def _go_on(geometry, pose, frame, values, work, stretches, kinds, memory):
    """Start from the last solution on the same strips; return the number of windows and the last relative change of c.

    The change is relative to the maximum c. Returns no windows if ``memory`` has none, if the patch has grown beyond
    them, or if c does not converge."""
    if not (memory[0] < 0.0 < memory[KEPT]):
        return 0, -1.0
    windows = int(memory[KEPT])
    shift = (memory[2] - frame.ur) * frame.cosine + (memory[3] - frame.z) * frame.sine
    for k in range(windows):
        at, work.start[0] = TIPS_FROM + 3 * k, 0
        work.start[k + 1], work.low[k], work.high[k] = int(memory[at]), memory[at + 1] + shift, memory[at + 2] + shift
    work.gap[0, U], work.gap[0, UR] = frame.u + work.low[0] * frame.cosine, frame.ur + work.low[0] * frame.cosine
    lay_out_strips(geometry, pose, frame, work, windows)
    for i in range(work.start[windows]):
        at = STRIPS_FROM + 3 * i
        work.active[i] = memory[at] > 0.0
        work.square[i], work.middle[i] = memory[at + 1], memory[at + 2] + memory[1] - frame.x
    moved = _carry(values, work, windows, kinds, _AGAIN, _CONVERGED[1])
    if not 0.0 <= moved <= _SETTLED:
        return 0, -1.0
    for i in range(work.start[windows]):
        work.share[i] = work.load[i] / work.square[i]
    grown = newborn(values, work, windows, stretches, FIXED, _ALLOWED_OVERLAP) != windows
    return 0 if grown else windows, moved


@jit(allocates=False)
def _keep(frame, work, windows, memory):
    """Write the strips to ``memory`` for `_go_on`, relative to the position stored in it."""
    shift = (memory[2] - frame.ur) * frame.cosine + (memory[3] - frame.z) * frame.sine
    memory[KEPT] = windows
    for k in range(windows):
        at = TIPS_FROM + 3 * k
        memory[at], memory[at + 1], memory[at + 2] = work.start[k + 1], work.low[k] - shift, work.high[k] - shift
    for i in range(work.start[windows]):
        at = STRIPS_FROM + 3 * i
        memory[at], memory[at + 1] = work.load[i], work.square[i]
        memory[at + 2] = work.middle[i] - memory[1] + frame.x


@jit(allocates=False, fastmath=FUSED)
def _press(work, windows):
    """Fill the first guess of c and the middles, for each strip without influence of the others."""
    for i in range(work.start[windows]):
        work.active[i] = work.gap[i, GAP] < 0.0
        work.square[i] = max(-work.gap[i, GAP] / work.gap[i, SHAPE], 0.05 * work.width[i] ** 2)
        work.middle[i] = work.gap[i, CREST]


@jit(allocates=False, fastmath=FUSED)
def _carry(values, work, windows, kinds, sweeps, rest):
    """Solve for the loads of fixed strips by an active set, in turn with half lengths and (with yaw) middles.

    Sweeps end when the largest change of c, over the maximum c, is at most ``rest``. With ``kinds`` = 3 (yaw), middles
    change too. Returns the last change, or -1 if there are no loads."""
    strips, matrix, load = work.start[windows], work.matrix, work.load
    offset, moved, points = kinds * strips + 2 * windows, 0.0, kinds - 1.0  # twice the points with yaw
    for sweep in range(sweeps):
        for i in range(strips):
            work.share[i] = 0.0
        n = assemble(values, work, windows, kinds)
        if not _active_set(work, strips, kinds, n, offset):
            return -1.0
        left, wanted = work.kept[2 * (sweep % _KEPT)], work.kept[2 * (sweep % _KEPT) + 1]
        largest, moved = 0.0, 0.0
        for i in range(strips):
            bend = tilt = 0.0
            for j in range(strips):
                share = load[j] / work.square[j]
                bend -= matrix[kinds * i + 1, kinds * j] * share
                tilt -= matrix[kinds * i + kinds - 1, kinds * j] * share
            wanted[i] = bend / (points * work.gap[i, SHAPE] * BEND)
            largest = max(largest, wanted[i])
            left[strips + i], wanted[strips + i] = 0.0, work.middle[i]
            if kinds == 3:  # the mean of t^2 over the points is 1/2
                a = math.sqrt(work.square[i])
                shift = work.gap[i, CREST] + 0.25 * tilt / (work.gap[i, SHAPE] * a) - work.middle[i]
                left[strips + i] = min(max(shift, -0.3 * a), 0.3 * a)
                wanted[strips + i] += left[strips + i]
        for i in range(strips):
            least = max(0.02 * largest, 0.02 * work.width[i] ** 2)
            wanted[i] = min(max(wanted[i], least, 0.3 * work.square[i]), 4.0 * work.square[i])
            left[i] = (wanted[i] - work.square[i]) / largest
            left[strips + i] /= math.sqrt(largest)
            moved = max(moved, abs(left[i]), abs(left[strips + i]))
        if moved <= rest or sweep + 1 == sweeps:  # leave before c changes, so that it agrees with the loads
            break
        _mix(work, strips, min(sweep, _KEPT - 1), sweep)
    return moved


@jit(allocates=False, fastmath=FUSED)
def _mix(work, strips, others, sweep):
    """Set c and middles for the next sweep by Anderson's method (1965) from the last ``others`` + 1 sweeps.

    The combination of their results has the minimum residual if residuals are linear."""
    kept, matrix, mine = work.kept, work.matrix, 2 * (sweep % _KEPT)
    for one in range(others):
        at = 2 * ((sweep - 1 - one) % _KEPT)
        for other in range(others + 1):
            of, total = 2 * ((sweep - 1 - other) % _KEPT), 0.0
            for i in range(2 * strips):
                aside = kept[mine, i] if other == others else kept[mine, i] - kept[of, i]
                total += (kept[mine, i] - kept[at, i]) * aside
            matrix[one, other] = total
        matrix[one, one] *= 1.0 + 1e-8
    solved = others > 0 and solve_linear(matrix, others)
    for i in range(2 * strips):
        new = kept[mine + 1, i]
        for one in range(others if solved else 0):
            new -= matrix[one, others] * (kept[mine + 1, i] - kept[2 * ((sweep - 1 - one) % _KEPT) + 1, i])
        if i < strips:
            work.square[i] = min(max(new, 0.3 * work.square[i]), 4.0 * work.square[i])
        else:
            work.middle[i - strips] = new


@jit(allocates=False, fastmath=FUSED)
def _active_set(work, strips, kinds, n, offset):
    """Solve for the loads of the strips at given half lengths by an active set; False if this fails.

    All loads are positive in the active set; other strips have no load and no overlap."""
    matrix, active, load = work.matrix, work.active, work.load
    for _ in range(12):
        used = 0
        for i in range(strips):
            if active[i]:
                column = 0
                row = offset + used
                for j in range(strips):
                    if active[j]:
                        matrix[row, column] = matrix[kinds * i, kinds * j] / work.square[j]
                        column += 1
                matrix[row, column] = matrix[kinds * i, n]
                used += 1
        if used == 0 or not solve_linear(matrix[offset:], used):
            return False
        used, changed = 0, False
        for i in range(strips):
            load[i] = 0.0
            if active[i]:
                load[i] = matrix[offset + used, column]
                used += 1
                if load[i] <= 0.0:
                    active[i], changed, load[i] = False, True, 0.0
        if changed:
            continue
        for i in range(strips):
            if not active[i]:
                gap = -matrix[kinds * i, n]
                for j in range(strips):
                    gap += matrix[kinds * i, kinds * j] / work.square[j] * load[j]
                if gap < 0.0:
                    active[i] = changed = True
        if not changed:
            break
    return True


@jit(allocates=False)
def _widened(work, found, low, high, by):
    """Create windows from the runs, extended by ``by`` (m) at either end; return their number.

    Windows that touch are merged; if there are more than MAX_WINDOWS, all are merged."""
    windows = 0
    for k in range(found):
        first, last = max(work.fresh[0, k] - by, low), min(work.fresh[1, k] + by, high)
        if windows > 0 and (first <= work.high[windows - 1] or found > MAX_WINDOWS):
            work.high[windows - 1] = last
        else:
            work.low[windows], work.high[windows] = first, last
            windows += 1
    return windows
