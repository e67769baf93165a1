"""Lobes that are apart, looked up one by one and balanced (:mod:`wrcore.wheels.table.coupled_lobes`).

Few wheels stand so: the kernel is compiled when the first one does.
"""

import math

from wrcore.contact.search.approach import LEVEL
from wrcore.kernels.jit import FUSED, jit
from wrcore.wheels.normal_damping import lifted
from wrcore.wheels.table import lookup as columns
from wrcore.wheels.table.coupled_lobes import (
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
from wrcore.wheels.table.lookup import APART, FAR, SADDLE, lobe_end
from wrcore.wheels.table_force import UNLISTED, lifted_place, look_lobe_up, look_only_lobe_up, roll_lobe

TURNS, ROLLS = 2, 3
"""Lobes are looked up so many times, balanced between, and rolled so many times."""


@jit(allocates=False, fastmath=FUSED)
def look_lobes_up(model, m, pressed, lift, ends, ahead, counters, work):
    """Fill ``work.numbers`` and ``work.lobes`` of the lobes of a lifted wheel, see `lifted`. None has an end where it
    hangs in the air; the first one's cell is `UNLISTED` if one of them is in no lattice."""
    pose, low, high = lifted(model, m, LEVEL, pressed, lift, True, ends, work)
    count, last = 0, low
    while last < high:
        last = lobe_end(model.geometry, pose, work.rows, last, high, (APART, FAR, SADDLE))
        work.lobes[count, END] = last
        count += 1
    if count == 1:
        pose, place = lifted_place(m, pressed, lift)
        if not look_only_lobe_up(model, m, pose, ahead, place, work):
            work.lobes[0, CELL] = UNLISTED
    elif count > 1:
        _look_apart_up(model, m, pose, ahead, low, count, counters, work)


@jit(allocates=False, fastmath=FUSED)
def _look_apart_up(model, m, pose, ahead, low, count, counters, work):
    """Fill in several lobes, whose ends are there."""
    geometry, lobes = model.geometry, work.lobes
    axle_y = geometry.half_distance * m.ey
    t = pose.y + axle_y - geometry.rail_distance
    guess_lobes(model, pose, axle_y, geometry.half_distance * m.ez, low, count, work)
    for left in range(TURNS - 1, -1, -1):
        first = low
        for q in range(count):
            last, lobe, numbers = int(lobes[q, END]), lobes[q], work.numbers[q]
            depth, u = depth_left(work.rows, first, last, lobe, pose.y + axle_y + numbers[columns.PLACE_Y])
            tilt, aside = lobe[TILT], lobe[TILT] * (geometry.rolling_radius - numbers[columns.PLACE_Z])
            lobe[NORMAL] = 0.0
            if depth > 0.0:
                place = t - aside, m.ez + tilt, math.log(depth), ahead * m.ex
                if not look_lobe_up(model, numbers, lobe, u, True, *place, left == 0, work):
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
