"""Windows of strips, one per sub-patch: first guesses from the overlaps, and repairs after a solution.

Without a memory of the last solution the windows start from the overlaps and depend only on the position and attitude.
With a memory they are kept if several sets of windows fit (`wrcore.contact.normal.solve.solve_patch`).
"""

import math

from wrcore.contact.hertz import hertz_ellipse
from wrcore.contact.normal.gap import CREST, GAP, NODE_CREST, NODE_GAP, NODE_SHAPE, NODE_SHARE, NODE_SQUARE, UR, S, U
from wrcore.contact.normal.newton import FAINT, NEGLIGIBLE, top_squares
from wrcore.contact.normal.strips import (
    GUESS,
    MAX_RUNS,
    MAX_STRIPS,
    MAX_WINDOWS,
    WEIGHT,
    WIDENED,
    gap_under_load,
    lay_out_strips,
)
from wrcore.contact.search.reduction import CURVATURE_X, CURVATURE_Y
from wrcore.kernels.jit import FUSED, jit

FEWEST_STRIPS, SLENDER_WINDOW = 8, 4.0
"""Minimum number of strips of a slender window, and the ratio of length to width from which a window is slender."""

_USUAL = 16
"""Resolution above which slender windows have more than FEWEST_STRIPS strips: for rails with sharp edges."""

BLENDING_RATIO = 1.05
"""Factor of a window's width: if the wider window would have more strips, the result is the mean of both solutions."""

_STEPS = (1.0 / SLENDER_WINDOW, 1.2, 1.8)
"""Ratios of width to length at which the number of strips changes."""

_SADDLE = 0.02
"""Minimum height of the saddle between two sub-patches, over the maximum penetration."""

_MERGE = 0.3
"""Distance of two windows, over the width of a strip, below which they are merged."""


@jit(allocates=False, fastmath=FUSED)
def guess_squares(hertz, patches, first, work, stretches):
    """Fill the first guess of c and Q at the nodes, from the shape-corrected virtual penetration of every sub-patch.

    For a sub-patch of depth d, c = (k_a/k_b) (k_b d - (g - min g))/A with k_a = A a^2/d, k_b = B b^2/d of Hertz's
    ellipse of the overlap, and Q of that ellipse. This is exact for an ellipse."""
    nodes = work.nodes
    begin = 0
    for k in range(stretches):
        end, row = work.ends[k], patches[first + k]
        stiffness, a, b = hertz_ellipse(hertz, row[CURVATURE_X], row[CURVATURE_Y])
        k_a, k_b = row[CURVATURE_X] * a * a, row[CURVATURE_Y] * b * b
        least = 0.0
        for i in range(begin, end):
            least = min(least, nodes[NODE_GAP, i])
        share = 1.5 * stiffness / (math.pi * math.pi * a * a * b)
        i = begin
        while i < end:  # for each sub-patch: down to its minimum gap, then up until the gap falls again after a saddle
            start = i
            bottom = top = nodes[NODE_GAP, i]
            top_at = i
            while i < end:
                g = nodes[NODE_GAP, i]
                if g < bottom and top < bottom - _SADDLE * least:
                    bottom = top = g
                    top_at = i
                if g > top:
                    top, top_at = g, i
                if top > bottom - _SADDLE * least and g < top + _SADDLE * least:
                    break
                bottom = min(bottom, g)
                if g <= bottom:
                    top, top_at = g, i
                i += 1
            stop = end if i >= end else top_at + 1
            for j in range(start, stop):
                depth = max(-bottom, 0.0)
                v = -nodes[NODE_GAP, j] - (1.0 - k_b) * depth
                nodes[NODE_SQUARE, j], nodes[NODE_SHARE, j] = k_a / k_b * v / nodes[NODE_SHAPE, j], share
            i = max(stop, start + 1)
        begin = end


@jit(allocates=False, fastmath=FUSED)
def guess_at(work, count, s):
    """First guess of c (m^2, interpolated linearly between nodes) and Q (1/m) at ``s``."""
    nodes = work.nodes
    for i in range(1, count):
        if nodes[S, i] >= s and nodes[S, i] > nodes[S, i - 1]:
            part = (s - nodes[S, i - 1]) / (nodes[S, i] - nodes[S, i - 1])
            return nodes[NODE_SQUARE, i - 1] * (1.0 - part) + nodes[NODE_SQUARE, i] * part, nodes[NODE_SHARE, i]
    return 0.0, nodes[NODE_SHARE, 0]


@jit(allocates=False, fastmath=FUSED)
def count_strips(width, length, resolution, more):
    """Number of strips of a window: few if it is slender, more if it is wide and may have several pressure maxima.

    Just below a width at which the number changes, the weight of the solution with more strips rises from 0 to 1, so
    that forces are continuous. ``more`` (see `NormalWork`) gets the maximum of this weight over the windows."""
    ratio = more[WIDENED] * width / length
    for step in _STEPS:
        t = (BLENDING_RATIO * ratio / step - 1.0) / (BLENDING_RATIO - 1.0)
        if 0.0 < t <= 1.0 and more[WIDENED] == 1.0 and (step >= 1.0 or resolution != FEWEST_STRIPS):
            more[WEIGHT] = max(more[WEIGHT], t * t * (3.0 - 2.0 * t))
    if ratio < _STEPS[0]:
        return max(FEWEST_STRIPS, resolution - _USUAL)
    halves = 2 if ratio <= _STEPS[1] else 3 if ratio <= _STEPS[2] else 4
    return min(resolution * halves // 2, MAX_STRIPS)


@jit(allocates=False, fastmath=FUSED)
def guess_windows(work, stretches, resolution):
    """Fill the windows where the guess of c is positive; return their number."""
    nodes, count, windows = work.nodes, work.ends[stretches - 1], 0
    inside, largest, work.more[WEIGHT] = False, 0.0, 0.0
    for i in range(count):
        c = nodes[NODE_SQUARE, i]
        fresh = i == 0
        if c > 0.0 and not inside and windows < MAX_WINDOWS:
            inside, largest = True, c
            low = nodes[S, i]
            if not fresh:
                before = nodes[NODE_SQUARE, i - 1]
                low -= (nodes[S, i] - nodes[S, i - 1]) * c / (c - before)
            work.low[windows] = low
        elif inside and (c <= 0.0 or i == count - 1):
            before = nodes[NODE_SQUARE, i - 1]
            high = nodes[S, i]
            if c < 0.0:
                high -= (nodes[S, i] - nodes[S, i - 1]) * c / (c - before)
            work.high[windows] = high
            width, length = high - work.low[windows], 2.0 * math.sqrt(largest)
            work.start[windows + 1] = count_strips(width, length, resolution, work.more)
            inside = False
            windows += 1
        if inside:
            largest = max(largest, c)
    work.guessed[0], work.more[GUESS] = windows, work.more[WEIGHT]
    for k in range(1, windows + 1):
        work.guessed[k] = work.start[k]
    _number(work, windows)
    return windows


@jit(allocates=False)
def _number(work, windows):
    """Convert numbers of strips (in ``work.start[1:]``) to first strips of the windows.

    If there are more than MAX_STRIPS in all, numbers are reduced to an equal part of MAX_STRIPS."""
    total = 0
    for k in range(windows):
        total += work.start[k + 1]
    work.start[0] = 0
    for k in range(windows):
        count = work.start[k + 1]
        if total > MAX_STRIPS:
            count = min(count, MAX_STRIPS // windows)
        work.start[k + 1] = work.start[k] + count


@jit(allocates=False, fastmath=FUSED)
def start_strips(geometry, pose, frame, work, windows, stretches):
    """Fill the strips of the windows with the guess of c (at least a positive minimum) and of Q."""
    count = work.ends[stretches - 1]
    work.gap[0, U], work.gap[0, UR] = frame.u + work.low[0] * frame.cosine, frame.ur + work.low[0] * frame.cosine
    lay_out_strips(geometry, pose, frame, work, windows)
    for k in range(windows):
        largest = 0.0
        first, last = work.start[k], work.start[k + 1]
        for i in range(first, last):
            work.square[i], work.share[i] = guess_at(work, count, work.centre[i])
            largest = max(largest, work.square[i])
        for i in range(first, last):
            t = (2.0 * (i - first) + 1.0) / (last - first) - 1.0
            least = (0.1 * largest if largest > 0.0 else work.width[i] ** 2) * (1.0 - t * t)
            work.square[i] = max(work.square[i], least)
            work.middle[i] = work.gap[i, CREST]


@jit(allocates=False)
def active_runs(work, windows):
    """Write the ends of the runs of active strips to ``work.fresh``; return their number and the maximum c (m^2)."""
    found, inside, largest = 0, False, 0.0
    for i in range(work.start[windows]):
        if inside and (not work.active[i] or work.window[i] != work.window[i - 1]):
            found, inside = found + 1, False
        if work.active[i] and found < MAX_RUNS:
            largest = max(largest, work.square[i])
            if not inside:
                work.fresh[0, found], inside = work.centre[i] - 0.5 * work.width[i], True
            work.fresh[1, found] = work.centre[i] + 0.5 * work.width[i]
    return found + int(inside), largest


@jit(allocates=False, fastmath=FUSED)
def drop_starved(work, windows, resolution):
    """Rebuild the windows from the strips that still have pressure after an iteration; return their number."""
    largest = top_squares(work, windows)
    for i in range(work.start[windows]):
        top = work.tops[work.window[i]]
        work.active[i] = work.square[i] > FAINT * top and top > NEGLIGIBLE * largest
    return take_fresh(work, min(active_runs(work, windows)[0], MAX_WINDOWS), largest, resolution)


@jit(allocates=False, fastmath=FUSED)
def merge_close(work, windows, resolution):
    """Merge windows that are closer than a fraction of a strip's width; return the number of windows."""
    lows, highs = work.fresh[0], work.fresh[1]
    found = 0
    for k in range(windows):
        w = work.width[work.start[k]]
        if k > 0:
            w = max(w, work.width[work.start[k] - 1])
        if k > 0 and work.low[k] - work.high[k - 1] < _MERGE * w:
            highs[found - 1] = work.high[k]
        else:
            lows[found], highs[found] = work.low[k], work.high[k]
            found += 1
    return windows if found == windows else take_fresh(work, found, top_squares(work, windows), resolution)


@jit(allocates=False, fastmath=FUSED)
def take_fresh(work, found, largest, resolution):
    """Create windows from the tips in ``work.fresh``; return their number.

    If there are as many windows as guessed, they get the guessed numbers of strips."""
    known, length = found == work.guessed[0], 2.0 * math.sqrt(largest)
    work.more[WEIGHT] = work.more[GUESS] if known else 0.0
    kept = 0
    for k in range(found):
        width = work.fresh[1, k] - work.fresh[0, k]
        if width > 0.0:  # a failed iteration may have exchanged the tips
            work.low[kept], work.high[kept] = work.fresh[0, k], work.fresh[1, k]
            kept += 1
            work.start[kept] = work.guessed[k + 1] if known else count_strips(width, length, resolution, work.more)
    _number(work, kept)
    return kept


@jit(allocates=False, fastmath=FUSED)
def count_again(work, windows, counts, strips, resolution):
    """Give windows the numbers of strips of their last solution; return whether these are still the right numbers.

    ``counts`` has three numbers for each window, first the end of its strips. ``strips`` has three numbers for each
    strip, c the second."""
    work.more[WEIGHT], largest = 0.0, 0.0
    for i in range(int(counts[3 * (windows - 1)])):
        largest = max(largest, strips[3 * i + 1])
    work.start[0] = 0
    for k in range(windows):
        work.start[k + 1] = int(counts[3 * k])
        wanted = count_strips(work.high[k] - work.low[k], 2.0 * math.sqrt(largest), resolution, work.more)
        if wanted != work.start[k + 1] - work.start[k]:
            return False
    return True


@jit(allocates=False, fastmath=FUSED)
def newborn(values, work, windows, stretches, resolution, least):
    """Add windows where the loaded surfaces overlap outside the windows; return the new number of windows.

    ``least`` is the minimum of this overlap over the maximum penetration. Returns -1 if there would be more than
    MAX_WINDOWS."""
    nodes, count = work.nodes, work.ends[stretches - 1]
    depth = 0.0
    for i in range(count):
        depth = max(depth, -nodes[NODE_GAP, i])
    lows, highs = work.fresh[0], work.fresh[1]
    found = windows
    for k in range(windows):
        lows[k], highs[k] = work.low[k], work.high[k]
    open_at = -1
    for i in range(count):
        s, gap = nodes[S, i], nodes[NODE_GAP, i]
        free = gap < 0.0
        for k in range(windows):
            before, after = 0.7 * work.width[work.start[k]], 0.7 * work.width[work.start[k + 1] - 1]
            free = free and not work.low[k] - before < s < work.high[k] + after
        inside = free and gap_under_load(values, work, windows, s, nodes[NODE_CREST, i], gap) < -least * depth
        if inside and open_at < 0 and found == MAX_WINDOWS:
            return -1
        if inside and open_at < 0:
            open_at = i
            lows[found] = s - 0.5 * abs(nodes[S, max(i, 1)] - nodes[S, max(i, 1) - 1])
        if open_at >= 0 and (not inside or i == count - 1):
            highs[found] = nodes[S, i - 1] + 0.5 * abs(nodes[S, i] - nodes[S, i - 1])
            found, open_at = found + 1, -1
    if found == windows:
        return windows
    for i in range(1, found):  # insertion sort by the lower tip
        low, high = lows[i], highs[i]
        j = i - 1
        while j >= 0 and lows[j] > low:
            lows[j + 1], highs[j + 1] = lows[j], highs[j]
            j -= 1
        lows[j + 1], highs[j + 1] = low, high
    return take_fresh(work, found, top_squares(work, windows), resolution)


@jit(allocates=False, fastmath=FUSED)
def overlooked(work, windows, stretches):
    """Mean deviation of the gap from its interpolation between strips, over the maximum penetration.

    At each node between two strips of a window the gap is compared with the parabola through the gaps of these strips
    and a neighbour. Slender windows are left out: they have sharp ends on flanges, and are too narrow for waves."""
    nodes, count, least, total, looked = work.nodes, work.ends[stretches - 1], -1e-300, 0.0, 1
    centre, strip, last = work.centre, 0, work.start[windows] - 1
    top_squares(work, windows)
    for k in range(count):
        s, gap = nodes[S, k], nodes[NODE_GAP, k]
        least = min(least, gap)
        while strip < last and centre[strip + 1] < s:
            strip += 1
        window = work.window[strip]
        slender = SLENDER_WINDOW * (work.high[window] - work.low[window]) < 2.0 * math.sqrt(work.tops[window])
        if strip < last and centre[strip] < s and window == work.window[strip + 1] and not slender:
            i, j = strip, strip + 1
            n = j + 1 if j < last and work.window[j + 1] == window else i - 1
            rise = (work.gap[j, GAP] - work.gap[i, GAP]) / (centre[j] - centre[i])
            bend = (work.gap[n, GAP] - work.gap[j, GAP]) / (centre[n] - centre[j]) - rise
            bend *= (s - centre[j]) / (centre[n] - centre[i])
            total += abs(gap - work.gap[i, GAP] - (s - centre[i]) * (rise + bend))
            looked += 1
    return -total / (looked * least)
