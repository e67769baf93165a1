"""Non-Hertzian normal contact of a wheel on a rail: Galerkin strips in windows that end at the tips of contact.

Across the patch, strips of width w carry a pressure that is semi-elliptic along x,

    p = p0 sqrt(1 - ((x - X)/a)^2),   p0 = pi E* Q a,

with unknown Q, half length a and (with yaw) middle X. Galerkin's conditions set the mean, the second and the first
moment of the loaded gap along the strip to 0. A window is a run of strips in contact, one per sub-patch. Its tips lie
where a^2, linear there, is 0. All strips of all windows of a patch act on each other through the half-space
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
"""Maximum number of sets of windows that are tried for one patch."""

_BORN, _HARDLY = 1e-3, 1e-2
"""Remaining overlap of the loaded surfaces, over the maximum penetration, at which a window is added. The second is for
sub-patches that barely touch: with the first they would be added and removed in alternate iterations."""

_OVERLOOKED = 0.02
"""Maximum deviation of the gap between strips, over the maximum penetration. Smooth profiles have up to 0.013, under
160 kN. For waves with larger deviations N has errors of 1 to 29 %, and fixed strips are used instead."""

_OTHER_NUMBERS = 0, 4, -1, 2
"""Changes of the number of strips of a window, tried in this order while no solution is found."""

_IN_VAIN = -1.0
"""First number of a memory if no windows were found."""

_REACH = 0.5
"""Maximum distance of a window's tips beyond all overlaps, over its width, for the last solution to be a start."""

_NEARBY, _AROUND = 1.5e-5, 1e-4
"""Distance of the wheel (m) from the position of a failed search for windows from which the search is repeated. The
second holds where the search starts from the first guess only."""

_TURNED, _SHIFTED = 0.05, 1e-3
"""Rotation (rad) and displacement (m) of the frame from which the search is repeated too: positions in the frame have
then changed."""

_STEPS = 24
"""Maximum number of Newton steps for one set of windows; see also `strips.STEPS`."""

_TOLERANCE = 1e-4
"""Newton's iteration has converged when all steps are below this fraction of the unknown."""

TIP_SHARE, TIP_GROWTH = 0.13, 0.04
"""Relative excess of the half length of a window's last strips over that with their area: at a = width, and its growth
with ln(a/width)."""

# Rows of the strip array, and of the sums over a patch.
CENTRE, WIDTH, HALF_LENGTH, MIDDLE, PEAK, WINDOW, WHEEL_HEIGHT, STRIP_TILT, STRIP_LOAD, OWN_PLACE, OWN_WIDTH, BOUND = (
    range(12)
)
STRIP_ROWS = 12
LOAD, LARGEST, MEAN_X, MEAN_S, MEAN_XX, MEAN_SS, X_MIN, X_MAX, S_MIN, S_MAX = range(10)
SUMS = 10


@jit(allocates=False)
def solve_patch(geometry, pose, hertz, values, patches, first, last, resolution, memory, work):
    """Solve the normal problem of one patch, which consists of the overlaps ``first`` to ``last`` - 1 of ``patches``.

    Fills ``work``; returns the number of windows (0 if there is no solution) and their `Frame`. `find_patches` fills
    ``patches`` by moments. ``resolution`` is the number of strips of a window; ``values`` is the `influence_table`.

    ``memory`` (MEMORY,) holds the last solution (first number 0: none), from which the iteration starts if it fits; the
    new solution replaces it. If only one set of windows fits, the memory changes the result by the square of the
    iteration's tolerance. If several sets fit, as between sub-patches of worn wheels, the previous set is kept. N then
    differs by up to 2 % from the result without memory, and has smaller jumps. Near a position without windows the
    search is not repeated; fixed strips are used."""
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
                left = 0 if windows == guessed else work.left[1]  # other windows may have smaller deviations
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
    if work.more[WIDENED] == 1.0:  # not for the second of two blended solutions
        memory[0], memory[1], memory[2], memory[3], memory[GUESSED] = _IN_VAIN, frame.x, frame.ur, frame.z, guessed
        memory[KEPT], (memory[WHEEL_POSITION], memory[WHEEL_POSITION + 1]) = 0.0, _wheel_position(geometry, pose)
        memory[WHEEL_POSITION + 2] = math.atan2(frame.sine, frame.cosine)
    windows = solve_fixed(geometry, pose, frame, values, work, stretches, kinds, memory)
    return _on_overlaps(patches, first, last, work, windows, memory), frame


@jit(allocates=False)
def _on_overlaps(patches, first, last, work, windows, memory):
    """Return the number of windows, or 0 if a strip lies outside the overlaps.

    This happens on steep flanks, where positions in a frame are ambiguous."""
    for i in range(work.start[windows]):
        if not patches[first, OUTSIDE] < work.gap[i, U] < patches[last - 1, BEYOND]:
            memory[KEPT] = 0.0
            return 0
    return windows


@jit(allocates=False)
def _wheel_position(geometry, pose):
    """Position y, z (m) of the wheel on the rail: the point at the nominal radius below its axle."""
    out, down = geometry.half_distance, geometry.rolling_radius
    return pose.y + out * pose.ey + down * pose.y_down, pose.z + out * pose.ez + down * pose.z_down


@jit(allocates=False)
def _near(geometry, pose, frame, memory, reach):
    """Whether the wheel is within ``reach`` (m) of the position of a failed search for windows, with nearly the same
    frame."""
    y, z = _wheel_position(geometry, pose)
    near = memory[0] < 0.0 and abs(y - memory[WHEEL_POSITION]) < reach and abs(z - memory[WHEEL_POSITION + 1]) < reach
    turned = abs(math.atan2(frame.sine, frame.cosine) - memory[WHEEL_POSITION + 2])
    return near and turned < _TURNED and max(abs(frame.ur - memory[2]), abs(frame.z - memory[3])) < _SHIFTED


@jit(allocates=False)
def _solve_cold(geometry, pose, frame, values, work, stretches, windows, resolution, kinds, born):
    """Solve without memory: first from the guess, if there is one, then from fixed strips, with repairs of the windows.

    ``born`` is the argument ``least`` of `newborn`. Returns the number of windows; 0 if there is no solution; -1 if the
    solution needs more windows than allowed or the gap between strips deviates too much (`overlooked`)."""
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
    """Write the solution to ``memory``, for a warm start."""
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
    """Transfer the last solution to the new frame as the start of an iteration; return whether it fits.

    It fits if the number of guessed windows is unchanged and the windows of the solution lie near the overlaps. If
    there are as many windows as guessed, they get the strips of the guess. Else their numbers of strips must be
    unchanged."""
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
    """Minimum and maximum s of the nodes over the overlaps, m."""
    low, high, first = math.inf, -math.inf, 0
    for stretch in range(stretches):
        end = work.ends[stretch]
        low, high, first = min(low, work.nodes[S, first]), max(high, work.nodes[S, end - 1]), end
    return low, high


@jit(allocates=False)
def _tip_of(strips, end, step):
    """Tip of a window, where the parabola through a^2 of its last three strips is 0, m inwards from the window's
    end."""
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
    """Maximum pressure, Pa, between that of the ``best`` strip and the top of a parabola through p0^2.

    For an ellipse p0^2 is a parabola over s. Pressures may have a kink, so that p0^2 is the mean of that of the strip
    and of the top of the parabola over it and its neighbours."""
    place, square = strips[CENTRE], strips[PEAK, best] ** 2
    before, after = place[best] - place[best - 1], place[best + 1] - place[best]
    fall, rise = (square - strips[PEAK, best - 1] ** 2) / before, (strips[PEAK, best + 1] ** 2 - square) / after
    bend = (rise - fall) / (before + after)
    slope = rise - bend * after
    return math.sqrt(square + 0.125 * slope * slope / max(-bend, 1e-6 * square / (before * after)))


@jit(allocates=False, fastmath=FUSED)
def publish(modulus, work, windows, strips, sums):
    """Write the result to ``strips`` (STRIP_ROWS, MAX_STRIPS), by increasing s, and ``sums``; return the number of
    strips.

    ``sums`` are normal force (N), maximum pressure (Pa), means of x, s, x^2, s^2 weighted with the pressure, and
    extents (m). ``modulus`` is E* (Pa)."""
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
    """Half lengths (m) of rectangles that have the width of the strips and the area of the patch, shape (strips,).

    Galerkin's strips at the tips of a window are too long. Their relative excess grows with length over width. It is
    fitted to the area of Hertz's ellipses with a/b from 0.25 to 9 and 8 to 32 strips (within 0.3 %)."""
    even, edge = half_length.copy(), np.diff(window, prepend=-1, append=-1) != 0
    at = edge[1:] | edge[:-1]
    even[at] *= 1.0 - TIP_SHARE - TIP_GROWTH * np.log(even[at] / width[at])
    return even
