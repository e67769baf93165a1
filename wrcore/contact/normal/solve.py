"""Exact non-Hertzian normal contact of a wheel on a rail: Galerkin strips in windows that end at the tips of contact.

Across the patch, strips of width w carry a pressure that is semi-elliptic along x,

    p = p0 sqrt(1 - ((x - X)/a)^2),   p0 = pi E* Q a,

with unknown Q, half length a and (with yaw) middle X. Galerkin's conditions make the loaded gap vanish in the mean and
in its second and first moment along the strip; the tips of a window lie where a^2, linear there, vanishes. All strips
of a patch, whichever window they belong to, act on each other through the half-space
(:mod:`wrcore.contact.normal.influence`).

References
----------
Johnson, Contact Mechanics (1985), chapters 3 and 4. Kalker, Three-Dimensional Elastic Bodies in Rolling Contact (1990).
"""

import math

import numpy as np

from wrcore.contact.normal.fixed_strips import solve_fixed, windows_from_fixed
from wrcore.contact.normal.gap import HEIGHT, TILT, UR, S, U, frame_of_overlaps, look_over_overlaps, unroll
from wrcore.contact.normal.grading import grade
from wrcore.contact.normal.newton import CONVERGED, CROSSED, LOST, newton, solve_shares
from wrcore.contact.normal.strips import (
    EXTRA,
    FIXED,
    GUESSED,
    KEPT,
    STRIPS_FROM,
    TIPS_FROM,
    WEIGHT,
    WHEEL_POSITION,
    WIDENED,
    lay_out_strips,
)
from wrcore.contact.normal.windows import (
    count_again,
    drop_starved,
    guess_squares,
    guess_windows,
    merge_close,
    newborn,
    overlooked,
    start_strips,
)
from wrcore.contact.search.reduction import BEYOND, OUTSIDE
from wrcore.contact.search.strip import changes_along
from wrcore.kernels.jit import FUSED, jit

_ROUNDS = 5
"""Sets of windows that are tried for one patch."""

_BORN, _HARDLY = 1e-3, 1e-2
"""Shares of the deepest penetration by which loaded surfaces interpenetrate where a lobe is born. The second is for
lobes that barely touch: they are born with the first and starve, again and again."""

_OVERLOOKED = 0.02
"""Largest share of the deepest penetration that strips may overlook: smooth profiles leave up to 0.013, under 160 kN;
N is off by 1 to 29 % of waves that leave more, and fixed strips stand in."""

_OTHER_NUMBERS = 0, 4, -1, 2
"""Strips by which a window's number differs in turn, where no solution was found."""

_IN_VAIN = -1.0
"""First number of a memory where no windows were found."""

_REACH = 0.5
"""A window's tips may lie this share of its width beyond all overlaps for a solution to start from."""

_NEARBY, _AROUND = 1.5e-5, 1e-4
"""Windows are sought anew where the wheel lies so far, m, from where none were found; the second where they are sought
from the first guess alone."""

_TURNED, _SHIFTED = 0.05, 1e-3
"""Or where the frame has turned (rad) or moved (m) by so much: places in it are others then."""

_STEPS = 24
"""Of Newton's iteration for one set of windows; see also `strips.STEPS`."""

_TOLERANCE = 1e-4
"""Newton's iteration ends when no step is longer, as a share of the unknown."""

TIP_SHARE, TIP_GROWTH = 0.13, 0.04
"""By which a window's last strips are too long for their area: the share, and its growth with ln(a/width) there."""

# Rows of the strip array, and of the sums over a patch.
CENTRE, WIDTH, HALF_LENGTH, MIDDLE, PEAK, WINDOW, WHEEL_HEIGHT, STRIP_TILT, STRIP_LOAD, OWN_PLACE, OWN_WIDTH = range(11)
STRIP_ROWS = 11
LOAD, LARGEST, MEAN_X, MEAN_S, MEAN_XX, MEAN_SS, X_MIN, X_MAX, S_MIN, S_MAX = range(10)
SUMS = 10


@jit(allocates=False)
def solve_patch(geometry, pose, hertz, values, patches, first, last, resolution, memory, work):
    """Normal problem of the overlaps from ``first`` to before ``last`` of ``patches`` (as `find_patches` fills it, by
    moments), which count as one patch. Fills ``work``; returns the number of windows (0 where no solution was found)
    and their `Frame`.

    ``resolution``: strips of a window. ``values``: of `influence_table`. ``memory`` (MEMORY,): a solution to start from
    if it fits (its first number 0: none); filled with this one. It leaves the result the same to the square of the
    iteration's tolerance where one set of windows fits; where several do, as between lobes of worn wheels, it keeps its
    own: N then differs by up to 2 % from that without it, and steps less. Where none were found none are sought nearby:
    fixed strips go on.
    """
    work.more[FIXED] = 0.0
    frame = frame_of_overlaps(geometry, pose, patches, first, last)
    stretches = look_over_overlaps(geometry, pose, frame, patches, first, last, work.nodes, work.ends)
    guess_squares(hertz, patches, first, work, stretches)
    grade(work, stretches)
    guessed = windows = guess_windows(work, stretches, resolution)
    kinds = 3 if changes_along(geometry) or pose.ex != 0.0 else 2
    work.left[0] = left = work.left[1]
    if memory[GUESSED] == guessed and _near(geometry, pose, frame, memory, _NEARBY if left > 1 else _AROUND):
        work.more[WEIGHT], work.more[FIXED], work.guessed[0], work.left[0] = 0.0, 1.0, 0, 0
        windows = solve_fixed(geometry, pose, frame, values, work, stretches, kinds, memory)
        return _on_overlaps(patches, first, last, work, windows, memory), frame
    usual = resolution + int(memory[EXTRA])
    if memory[0] > 0.0 and usual != resolution:
        windows = guess_windows(work, stretches, usual)
    if _resume(frame, memory, work, guessed, stretches, usual):
        windows = int(memory[0])
        status = newton(geometry, pose, frame, values, work, windows, kinds, False, _STEPS, _TOLERANCE)
        if status == CONVERGED:
            lay_out_strips(geometry, pose, frame, work, windows)
            if newborn(values, work, windows, stretches, usual, _BORN) == windows:
                if overlooked(work, windows, stretches) <= _OVERLOOKED:
                    _remember(frame, work, windows, guessed, usual - resolution, memory)
                    return windows, frame
                left = 0 if windows == guessed else work.left[1]  # others may overlook less
    if memory[0] > 0.0:
        windows = guess_windows(work, stretches, resolution)
    memory[0], work.left[0] = 0.0, left
    for born in (_BORN, _HARDLY):
        for extra in _OTHER_NUMBERS:
            if work.left[0] <= 0:
                break
            strips = resolution + extra
            if extra != 0:
                windows = guess_windows(work, stretches, strips)
            found = _solve_cold(geometry, pose, frame, values, work, stretches, windows, strips, kinds, born)
            if found > 0:
                if born == _BORN and (extra == 0 or work.more[WIDENED] == 1.0):
                    _remember(frame, work, found, guessed, extra, memory)
                return found, frame
            if found < 0:
                break
        windows = work.guessed[0] = 0
    work.more[WEIGHT], work.more[FIXED] = 0.0, 1.0
    if work.more[WIDENED] == 1.0:  # not of the second of two solutions
        memory[0], memory[1], memory[2], memory[3], memory[GUESSED] = _IN_VAIN, frame.x, frame.ur, frame.z, guessed
        memory[KEPT], (memory[WHEEL_POSITION], memory[WHEEL_POSITION + 1]) = 0.0, _wheel_position(geometry, pose)
        memory[WHEEL_POSITION + 2] = math.atan2(frame.sine, frame.cosine)
    windows = solve_fixed(geometry, pose, frame, values, work, stretches, kinds, memory)
    return _on_overlaps(patches, first, last, work, windows, memory), frame


@jit(allocates=False)
def _on_overlaps(patches, first, last, work, windows, memory):
    """The number of windows, 0 if a strip lies off the overlaps: on steep flanks places of a frame are ambiguous."""
    for i in range(work.start[windows]):
        if not patches[first, OUTSIDE] < work.gap[i, U] < patches[last - 1, BEYOND]:
            memory[KEPT] = 0.0
            return 0
    return windows


@jit(allocates=False)
def _wheel_position(geometry, pose):
    """y, z (m) of the wheel on the rail: where the nominal radius ends below its axle."""
    out, down = geometry.half_distance, geometry.rolling_radius
    return pose.y + out * pose.ey + down * pose.y_down, pose.z + out * pose.ez + down * pose.z_down


@jit(allocates=False)
def _near(geometry, pose, frame, memory, reach):
    """Whether the wheel lies within the ``reach`` (m) of where windows were sought in vain, and the frame is the same
    but for little."""
    y, z = _wheel_position(geometry, pose)
    near = memory[0] < 0.0 and abs(y - memory[WHEEL_POSITION]) < reach and abs(z - memory[WHEEL_POSITION + 1]) < reach
    turned = abs(math.atan2(frame.sine, frame.cosine) - memory[WHEEL_POSITION + 2])
    return near and turned < _TURNED and max(abs(frame.ur - memory[2]), abs(frame.z - memory[3])) < _SHIFTED


@jit(allocates=False)
def _solve_cold(geometry, pose, frame, values, work, stretches, windows, resolution, kinds, born):
    """Solution without memory: from the guess if there is one, then from fixed strips, repaired where it must be;
    ``born``: see `newborn`. Returns the number of windows, 0 where no solution was found, -1 where it wants more than
    there may be or strips overlook too much."""
    bold, again = False, False
    for attempt in range(_ROUNDS):
        if work.left[0] <= 0:
            break
        if attempt == 1 or again:
            windows = windows_from_fixed(geometry, pose, frame, values, work, stretches, resolution)
        if windows == 0:
            if attempt == 0:
                continue
            break
        start_strips(geometry, pose, frame, work, windows, stretches)
        if windows > 1 or work.start[windows] > resolution:
            solve_shares(values, work, windows, kinds)
        status = newton(geometry, pose, frame, values, work, windows, kinds, bold, _STEPS, _TOLERANCE)
        again = attempt > 0 and not bold and status == LOST
        bold = bold or again
        if status == CROSSED:
            windows = merge_close(work, windows, resolution)
        elif status != CONVERGED:
            windows = drop_starved(work, windows, resolution)
        else:
            lay_out_strips(geometry, pose, frame, work, windows)
            more = newborn(values, work, windows, stretches, resolution, born)
            if more == windows and overlooked(work, windows, stretches) > _OVERLOOKED:
                more = work.left[0] = -1
            if more == windows or more < 0:
                return more
            windows = more
    return 0


@jit(allocates=False)
def _remember(frame, work, windows, guessed, extra, memory):
    """Note what a warm start wants to know of the solution."""
    memory[0], memory[1], memory[2], memory[3], memory[GUESSED] = windows, frame.x, frame.ur, frame.z, guessed
    memory[EXTRA] = extra
    for k in range(windows):
        at = TIPS_FROM + 3 * k
        memory[at], memory[at + 1], memory[at + 2] = work.start[k + 1], work.low[k], work.high[k]
    for i in range(work.start[windows]):
        at = STRIPS_FROM + 3 * i
        memory[at], memory[at + 1], memory[at + 2] = work.share[i], work.square[i], work.middle[i]


@jit(allocates=False, fastmath=FUSED)
def _resume(frame, memory, work, guessed, stretches, resolution):
    """Move the last solution to the new frame if the first guess was of as many windows as this one, and its own lie
    among the overlaps: to the guess's strips if they are as many, else if they want as many strips as they had."""
    windows = int(memory[0])
    if windows <= 0 or guessed == 0 or memory[GUESSED] != guessed:
        return False
    y, z, along = memory[2] - frame.ur, memory[3] - frame.z, memory[1] - frame.x
    shift, old_first = y * frame.cosine + z * frame.sine, 0
    first_place, last_place = _outermost(work, stretches)
    for k in range(windows):
        low, high = memory[TIPS_FROM + 1 + 3 * k] + shift, memory[TIPS_FROM + 2 + 3 * k] + shift
        reach = _REACH * (high - low)
        if low < first_place - reach or high > last_place + reach:
            return False
    for k in range(windows):
        work.low[k], work.high[k] = memory[TIPS_FROM + 1 + 3 * k] + shift, memory[TIPS_FROM + 2 + 3 * k] + shift
    if windows != guessed and not count_again(work, windows, memory[TIPS_FROM:], memory[STRIPS_FROM:], resolution):
        return False
    for k in range(windows):
        old_end, first, end = int(memory[TIPS_FROM + 3 * k]), work.start[k], work.start[k + 1]
        ratio = (old_end - old_first) / (end - first)
        for i in range(first, end):
            place = (i - first + 0.5) * ratio - 0.5
            j = min(max(int(place), 0), old_end - old_first - 2)
            at, part = STRIPS_FROM + 3 * (old_first + j), place - j
            rest = 1.0 - part
            work.share[i] = rest * memory[at] + part * memory[at + 3]
            square = rest * memory[at + 1] + part * memory[at + 4]
            work.square[i] = max(square, 0.1 * min(memory[at + 1], memory[at + 4]))
            work.middle[i] = rest * memory[at + 2] + part * memory[at + 5] + along
        old_first = old_end
    work.gap[0, U], work.gap[0, UR] = frame.u + work.low[0] * frame.cosine, frame.ur + work.low[0] * frame.cosine
    return True


@jit(allocates=False)
def _outermost(work, stretches):
    """Ends of what was looked over, m."""
    low, high, first = math.inf, -math.inf, 0
    for stretch in range(stretches):
        end = work.ends[stretch]
        low, high, first = min(low, work.nodes[S, first]), max(high, work.nodes[S, end - 1]), end
    return low, high


@jit(allocates=False)
def _tip_of(strips, end, step):
    """Zero of the parabola through a^2 of a window's last three strips, m inwards from the window's end."""
    length, width = strips[HALF_LENGTH], strips[WIDTH]
    t1 = 0.5 * width[end]
    t2 = t1 + 0.5 * (width[end] + width[end + step])
    t3 = t2 + 0.5 * (width[end + step] + width[end + 2 * step])
    c1, c2, c3 = length[end] ** 2, length[end + step] ** 2, length[end + 2 * step] ** 2
    slope, t = (c2 - c1) / (t2 - t1), 0.0
    bend = ((c3 - c2) / (t3 - t2) - slope) / (t3 - t1)
    for _ in range(3):
        rate = slope + bend * (2.0 * t - t1 - t2)
        if not rate > 0.0:
            return 0.0
        t -= (c1 + (t - t1) * (slope + bend * (t - t2))) / rate
    return min(max(t, -0.4 * width[end]), 0.4 * width[end])


@jit(allocates=False)
def _largest_pressure(strips, best):
    """Greatest pressure, Pa: from the ``best`` strip half of the way to the top of a parabola over it and its
    neighbours, which p0^2 is for an ellipse: pressures may have a kink."""
    place, square = strips[CENTRE], strips[PEAK, best] ** 2
    before, after = place[best] - place[best - 1], place[best + 1] - place[best]
    fall, rise = (square - strips[PEAK, best - 1] ** 2) / before, (strips[PEAK, best + 1] ** 2 - square) / after
    bend = (rise - fall) / (before + after)
    slope = rise - bend * after
    return math.sqrt(square + 0.125 * slope * slope / max(-bend, 1e-6 * square / (before * after)))


@jit(allocates=False, fastmath=FUSED)
def publish(modulus, work, windows, strips, sums):
    """Fill ``strips`` (STRIP_ROWS, MAX_STRIPS), by increasing s, and ``sums`` over them: normal force, largest
    pressure, means over the pressure of x, s, x^2, s^2, extents. ``modulus`` is E* (Pa). Returns the number of strips.
    """
    count, stiffness = work.start[windows], math.pi * modulus
    for q in range(SUMS):
        sums[q] = 0.0
    sums[X_MIN], sums[X_MAX] = 1e9, -1e9
    best = 0
    for i in range(count):
        a, x, w, s = math.sqrt(work.square[i]), work.middle[i], work.width[i], work.centre[i]
        peak = stiffness * work.share[i] * a
        strips[CENTRE, i], strips[WIDTH, i], strips[HALF_LENGTH, i], strips[MIDDLE, i] = s, w, a, x
        strips[PEAK, i], strips[WINDOW, i] = peak, work.window[i]
        strips[WHEEL_HEIGHT, i], strips[STRIP_TILT, i] = work.gap[i, HEIGHT], work.gap[i, TILT]
        strips[STRIP_LOAD, i] = load = 0.5 * math.pi * peak * a * w
        sums[LOAD] += load
        sums[MEAN_X] += load * x
        sums[MEAN_S] += load * s
        sums[MEAN_XX] += load * (x * x + 0.25 * a * a)
        sums[MEAN_SS] += load * s * s
        sums[X_MIN], sums[X_MAX] = min(sums[X_MIN], x - a), max(sums[X_MAX], x + a)
        if peak > strips[PEAK, best]:
            best = i
    unroll(strips[CENTRE, :count], strips[WIDTH], strips[STRIP_TILT], strips[OWN_PLACE], strips[OWN_WIDTH])
    for q in range(MEAN_X, MEAN_SS + 1):
        sums[q] /= sums[LOAD]
    sums[S_MIN] = strips[CENTRE, 0] - 0.5 * strips[WIDTH, 0] + _tip_of(strips, 0, 1)
    sums[S_MAX] = strips[CENTRE, count - 1] + 0.5 * strips[WIDTH, count - 1] - _tip_of(strips, count - 1, -1)
    inside = 0 < best < count - 1 and strips[WINDOW, best - 1] == strips[WINDOW, best + 1]
    sums[LARGEST] = _largest_pressure(strips, best) if inside else strips[PEAK, best]
    return count


def even_length(half_length, width, window):
    """Half lengths of rectangles as wide as the strips with the areas under them, m, shape (strips,).

    Galerkin's strips at the tips of a window are too long, by a share that grows with length over width: fitted to
    the area of Hertz's ellipses with a/b from 0.25 to 9 and 8 to 32 strips (within 0.3 %)."""
    even, edge = half_length.copy(), np.diff(window, prepend=-1, append=-1) != 0
    at = edge[1:] | edge[:-1]
    even[at] *= 1.0 - TIP_SHARE - TIP_GROWTH * np.log(even[at] / width[at])
    return even
