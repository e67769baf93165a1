"""Lobes that are apart, looked up one by one and balanced (:mod:`wrcore.dynamics.coupled_lobes`).

Few wheels stand so: the kernel is compiled when the first one does.
"""

from wrcore.dynamics import pair_table as columns
from wrcore.dynamics.coupled_lobes import (
    CELL,
    END,
    FORCE_S,
    FORCE_X,
    MOMENT,
    NORMAL,
    SLIP_ETA,
    SLIP_XI,
    TILT,
    balance,
    depth_left,
    guess_lobes,
    slip_of_others,
    tilt_back,
)
from wrcore.dynamics.pair_table import depth_of
from wrcore.dynamics.tabulated_wheel import UNLISTED, look_lobe_up, roll_lobe
from wrcore.kernels.jit import FUSED, jit

TURNS, ROLLS = 2, 3
"""Lobes are looked up so many times, balanced between, and rolled so many times."""


@jit(allocates=False, fastmath=FUSED)
def look_apart_up(model, m, pose, ahead, low, count, counters, work):
    """Fill ``work.numbers`` and ``work.lobes`` of ``count`` lobes, whose ends are there; the first one's cell is
    `UNLISTED` if one of them is in no lattice."""
    geometry, lobes = model.geometry, work.lobes
    axle_y = geometry.half_distance * m.ey
    t = pose.y + axle_y - geometry.rail_distance
    guess_lobes(model, pose, axle_y, geometry.half_distance * m.ez, low, count, work)
    for left in range(TURNS - 1, -1, -1):
        first = low
        for q in range(count):
            last, lobe, numbers = int(lobes[q, END]), lobes[q], work.numbers[q]
            tilt, (_, u) = lobe[TILT], depth_of(work.rows, first, last)
            depth = depth_left(work.rows, first, last, lobe, pose.y + axle_y + numbers[columns.PLACE_Y])
            aside = tilt * (geometry.rolling_radius - numbers[columns.PLACE_Z])
            lobe[NORMAL] = 0.0
            if depth > 0.0:
                yaw, last_time = ahead * m.ex, left == 0
                if not look_lobe_up(model, numbers, lobe, u, True, t - aside, m.ez + tilt, depth, yaw, last_time, work):
                    lobes[0, CELL] = UNLISTED
                    return
                tilt_back(numbers, tilt, geometry.rolling_radius)
            first = last
        if left > 0:
            balance(model, pose.y + axle_y, low, count, work)
    _rub(model, m, ahead, count, counters, work)


@jit(allocates=False, fastmath=FUSED)
def _rub(model, m, ahead, count, counters, work):
    """Find what lobes slip by each other's friction."""
    for turn in range(ROLLS):
        for q in range(count):
            lobe = work.lobes[q]
            if lobe[NORMAL] > 0.0:
                lobe[SLIP_XI], lobe[SLIP_ETA] = slip_of_others(model, q, count, work)
                if turn < ROLLS - 1:
                    rolled = roll_lobe(model, m, ahead, q, counters, work)
                    lobe[FORCE_X], lobe[FORCE_S], lobe[MOMENT] = ahead * rolled.f1, rolled.f2, ahead * rolled.m3
