"""Windows from fixed strips over the overlaps: slower than a guess, and safe."""

import math

from wrcore.contact.patch.gap import CREST, GAP, NODE_GAP, NODE_SHARE, NODE_SQUARE, SHAPE, UR, S, U
from wrcore.contact.patch.newton import solve_linear
from wrcore.contact.patch.strips import BEND, MAX_WINDOWS, assemble, place_strips
from wrcore.contact.patch.windows import take_fresh
from wrcore.kernels.jit import FUSED, jit

COARSE = 32
"""Fixed strips over the overlaps, where the first guess of the windows has failed."""

_SWEEPS = 4


@jit(allocates=False, fastmath=FUSED)
def windows_from_fixed(geometry, pose, frame, values, work, stretches, resolution):
    """Windows from fixed strips over all overlaps: loads by an active set at given half lengths, these from the loads.

    Leaves c and Q of the fixed strips at the nodes as the next guesses. Returns the number of windows.
    """
    nodes, count = work.nodes, work.ends[stretches - 1]
    low, high = 1e9, -1e9
    for i in range(count):
        if nodes[NODE_GAP, i] < 0.0:
            low, high = min(low, nodes[S, i]), max(high, nodes[S, i])
    if not high > low:
        return 0
    work.low[0], work.high[0], work.start[0], work.start[1] = low, high, 0, COARSE
    w = (high - low) / COARSE
    work.gap[0, U], work.gap[0, UR] = frame.u + low * frame.cosine, frame.ur + low * frame.cosine
    place_strips(geometry, pose, frame, work, 1)
    active, load, matrix = work.active, work.load, work.matrix
    for i in range(COARSE):
        active[i] = work.gap[i, GAP] < 0.0
        work.square[i] = max(-work.gap[i, GAP] / work.gap[i, SHAPE], 0.05 * w * w)
        work.middle[i], work.share[i] = work.gap[i, CREST], 0.0
    offset = 2 * COARSE + 2
    for _ in range(_SWEEPS):
        for i in range(COARSE):
            work.share[i] = 0.0
        n = assemble(values, work, 1, 2)
        for _ in range(12):
            used = 0
            for i in range(COARSE):
                if active[i]:
                    column = 0
                    row = offset + used
                    for j in range(COARSE):
                        if active[j]:
                            matrix[row, column] = matrix[2 * i, 2 * j] / work.square[j]
                            column += 1
                    matrix[row, column] = matrix[2 * i, n]
                    used += 1
            if used == 0 or not _solve_below(matrix, offset, used):
                return 0
            used, dropped = 0, False
            for i in range(COARSE):
                load[i] = 0.0
                if active[i]:
                    load[i] = matrix[offset + used, column]
                    used += 1
                    if load[i] <= 0.0:
                        active[i], dropped, load[i] = False, True, 0.0
            if dropped:
                continue
            added = False
            for i in range(COARSE):
                if not active[i]:
                    gap = -matrix[2 * i, n]
                    for j in range(COARSE):
                        gap += matrix[2 * i, 2 * j] / work.square[j] * load[j]
                    if gap < 0.0:
                        active[i] = added = True
            if not added:
                break
        largest = 0.0
        for i in range(COARSE):
            bend = 0.0
            for j in range(COARSE):
                bend -= matrix[2 * i + 1, 2 * j] / work.square[j] * load[j]
            matrix[offset, i] = bend / (work.gap[i, SHAPE] * BEND)
            largest = max(largest, matrix[offset, i])
        for i in range(COARSE):
            new = max(matrix[offset, i], 0.02 * largest, 0.02 * w * w)
            work.square[i] = min(max(new, 0.3 * work.square[i]), 4.0 * work.square[i])
    total, squares = 0.0, 1e-300
    for i in range(COARSE):
        if active[i]:
            total, squares = total + load[i], squares + work.square[i]
    mean = total / squares
    for k in range(count):
        position = (nodes[S, k] - low) / w
        i = min(max(int(position), 0), COARSE - 1)
        nodes[NODE_SQUARE, k], nodes[NODE_SHARE, k] = 0.0, mean
        if active[i] and 0.0 <= position <= COARSE:
            nodes[NODE_SQUARE, k], nodes[NODE_SHARE, k] = work.square[i], load[i] / work.square[i]
    return _runs(work, low, w, resolution)


@jit(allocates=False)
def _solve_below(matrix, offset, n):
    """`solve_linear` for the n equations that begin at row ``offset``."""
    return solve_linear(matrix[offset:], n)


@jit(allocates=False)
def _runs(work, low, w, resolution):
    """Windows of the runs of active coarse strips."""
    found, inside, largest = 0, False, 0.0
    for i in range(COARSE):
        if work.active[i]:
            largest = max(largest, work.square[i])
            if not inside and found < MAX_WINDOWS:
                work.fresh[0, found], inside = low + i * w, True
            if inside:
                work.fresh[1, found] = low + (i + 1) * w
        elif inside:
            found, inside = found + 1, False
    if inside:
        found += 1
    return take_fresh(work, found, math.sqrt(largest), resolution)
