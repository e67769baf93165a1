"""Wrench of the rails on a wheel with exact contact, looked up in a `PairTable`; solved where that has no answer.

Most wheels have one lobe. Those that are apart are in :mod:`wrcore.dynamics.lobes_apart`, compiled when they are met.
"""

import math
from typing import NamedTuple

from wrcore.contact import reduction
from wrcore.contact.creepage import creepages
from wrcore.contact.normal import contact_modulus
from wrcore.contact.patch import solve
from wrcore.contact.patch.gap import Frame, add_force, frame_of_rows
from wrcore.contact.patch.model import KERNEL, LOAD, LOBES, MODEL, NUMBERS
from wrcore.contact.strip import make_pose
from wrcore.dynamics import pair_table as columns
from wrcore.dynamics.coupled_lobes import CELL, END, NORMAL, SLIP_ETA, SLIP_XI, load_of
from wrcore.dynamics.pair_table import (
    APART,
    FAR,
    SADDLE,
    Slip,
    depth_of,
    lobe_end,
    locate,
    look_modes_up,
    look_up,
    tabulated_force,
    weigh,
)
from wrcore.dynamics.strip_wheel import (
    HOLD,
    KEEP,
    NOTHING,
    ROWLESS,
    UNSOLVED,
    USE,
    Solution,
    fill_row,
    lift_of,
    lifted,
    lifted_overlaps,
)
from wrcore.dynamics.wheel import OUT_OF_RANGE, SOLVED, falling
from wrcore.kernels.handles import call_address, call_c
from wrcore.kernels.jit import FUSED, jit

UNKNOWN = NOTHING._replace(load=-1.0)

UNLISTED = -1.0
"""Cell of the first of several lobes if one of them is in no lattice."""


KEPT, DEEPEST, LIFTED, DEPTH, DEEPER, FRAME = range(6)
KEPT_ROW = 12
"""Places in what is kept of a wheel: whether it is, its deepest overlap, what the damping lifts it by and its depth D
(m), what D changes by that; the six numbers of its frame; its row, and what that changes by the lift."""

FARTHER = 1e-9
"""Difference of the lift, m."""


@jit(allocates=False, fastmath=FUSED)
def _keep(model, m, frame, lift, low, high, kept, work):
    """Keep a wheel's only lobe, just looked up, and what it changes by the lift."""
    rows, one, other, ahead = work.rows, work.numbers[0], work.numbers[1], -1.0 if m.vx < 0.0 else 1.0
    depth, u = depth_of(rows, low, high)
    pose, low, high = lifted(model, m, frame, lift + FARTHER, True, u, rows)
    if high == low:
        return
    further, u = depth_of(rows, low, high)
    t = pose.y + model.geometry.half_distance * m.ey - model.geometry.rail_distance
    cell, fx, fy, fz, gx, gy, gz, turn = locate(model.strips.table, u, False, t, m.ez, further, ahead * m.ex)
    if cell == 0 or further <= 0.0:
        return
    weigh(fx, fy, fz, gx, gy, gz, turn, work.weights)
    look_up(model.strips.table.cells[cell], work.weights, other)
    look_modes_up(model.strips.table.cells[cell], work.weights, other)
    kept[LIFTED], kept[DEPTH], kept[DEEPER] = lift, depth, (further - depth) / FARTHER
    kept[FRAME], kept[FRAME + 1], kept[FRAME + 2] = frame.cosine, frame.sine, frame.x
    kept[FRAME + 3], kept[FRAME + 4], kept[FRAME + 5] = frame.ur, frame.z, frame.u
    for k in range(NUMBERS):
        kept[KEPT_ROW + k], kept[KEPT_ROW + NUMBERS + k] = one[k], (other[k] - one[k]) / FARTHER
    kept[KEPT] = 1.0


@jit(allocates=False, fastmath=FUSED)
def _add_kept(model, m, kept, wrench, counters, work):
    """Add the wrench of a wheel whose only lobe was kept, for other velocities."""
    frame = Frame(kept[FRAME], kept[FRAME + 1], kept[FRAME + 2], kept[FRAME + 3], kept[FRAME + 4], kept[FRAME + 5])
    pose = make_pose(1.0, m.y, m.z, m.ex, m.ey, m.ez, True)
    more = lift_of(model, m, pose, frame, kept[DEEPEST])[0] - kept[LIFTED]
    numbers, modulus = work.numbers[0], contact_modulus(model.shear_modulus, model.poisson_ratio)
    for k in range(NUMBERS):
        numbers[k] = kept[KEPT_ROW + k] + more * kept[KEPT_ROW + NUMBERS + k]
    work.lobes[:] = 0.0
    work.lobes[0, NORMAL] = load_of(modulus, numbers, kept[DEPTH] + more * kept[DEEPER])
    work.wrench[:] = 0.0
    y, z = frame.ur + model.geometry.rail_distance - m.y, frame.z - m.z
    _roll_lobes(model, m, frame, y, z, -1.0 if m.vx < 0.0 else 1.0, 1, counters, work)
    for k in range(6):
        wrench[k] += work.wrench[0, k] + work.wrench[1, k]


@jit(allocates=False, fastmath=FUSED)
def tabulated_wrench(model, m, spatial, rows, first, last, out, wrench, counters, memory, work):
    """As `group_wrench`, looked up; UNKNOWN where the table has no answer. Keeps a wheel's only lobe in ``memory`` if
    ``work.spare`` asks for it."""
    frame = frame_of_rows(rows, first, last)
    pose = make_pose(1.0, m.y, m.z, m.ex, m.ey, m.ez, spatial)
    pose, low, high, left, _, _ = lifted_overlaps(model, m, pose, frame, spatial, rows, first, last, out, work)
    if high == low or left <= 0.0:
        out[reduction.NORMAL] = 0.0
        return NOTHING
    ahead = -1.0 if m.vx < 0.0 else 1.0
    lobes = _look_lobes_up(model, m, pose, ahead, low, high, counters, work) if spatial else 0
    if lobes == 0:  # the lattices are of spatial detection
        counters[SOLVED] += 1
        return UNKNOWN
    if work.spare[HOLD] == KEEP and lobes == 1:
        memory[DEEPEST] = out[reduction.PENETRATION]
        _keep(model, m, frame, memory[DEEPEST] - left, low, high, memory, work)
    work.wrench[:] = 0.0
    y, z = frame.ur + model.geometry.rail_distance - pose.y, frame.z - pose.z
    found = _roll_lobes(model, m, frame, y, z, ahead, lobes, counters, work)
    out[reduction.NORMAL] = found.load
    if work.spare[ROWLESS] == 0.0:
        fill_row(model.geometry, (1.0, 0.0), frame, y, z, found, work.wrench, out)
        out[reduction.Y], out[reduction.Z] = out[reduction.Y] + pose.y, out[reduction.Z] + pose.z
        heaviest = 0
        for q in range(1, lobes):
            heaviest = q if work.lobes[q, NORMAL] > work.lobes[heaviest, NORMAL] else heaviest
        out[reduction.CELL] = work.lobes[heaviest, CELL]
    for k in range(6):
        wrench[k] += work.wrench[0, k] + work.wrench[1, k]
    return found


@jit(allocates=False)
def add_tabulated(model, m, spatial, rows, first, last, out, wrench, counters, memory, work):
    """`tabulated_wrench`, or what the solver finds, for who calls it by its address; a normal force below 0 where that
    is not wanted."""
    if work.spare[HOLD] == USE:
        _add_kept(model, m, memory, wrench, counters, work)
        return
    found = tabulated_wrench(model, m, spatial, rows, first, last, out, wrench, counters, memory, work)
    if found.load < 0.0 and work.spare[UNSOLVED] > 0.0:
        out[reduction.NORMAL] = -1.0
    elif found.load < 0.0:
        late = model.strips.late
        if late[KERNEL] == 0:
            call_c(late[LOAD], KERNEL)
        if late[KERNEL] == 0:  # interrupted
            out[reduction.NORMAL] = wrench[:] = math.nan
            return
        call_address(late[KERNEL], late[MODEL], m, spatial, rows, first, last, out, wrench, counters, memory, work)


@jit(allocates=False, fastmath=FUSED)
def _look_lobes_up(model, m, pose, ahead, low, high, counters, work):
    """Fill ``work.numbers`` and ``work.lobes`` of the lobes of overlaps; returns how many there are, 0 if one of them
    is in no lattice."""
    lobes, late, count, last = work.lobes, model.strips.late, 0, low
    lobes[:] = 0.0
    while last < high:
        last = lobe_end(model.geometry, pose, work.rows, last, high, (APART, FAR, SADDLE))
        lobes[count, END] = last
        count += 1
    if count == 1:
        depth, u = depth_of(work.rows, low, high)
        t = pose.y + model.geometry.half_distance * m.ey - model.geometry.rail_distance
        return (
            1
            if look_lobe_up(model, work.numbers[0], lobes[0], u, False, t, m.ez, depth, ahead * m.ex, True, work)
            else 0
        )
    if late[LOBES] == 0:
        call_c(late[LOAD], LOBES)
    if late[LOBES] == 0:  # interrupted
        return 0
    call_address(late[LOBES], model, m, pose, ahead, low, count, counters, work)
    return 0 if lobes[0, CELL] == UNLISTED else count


@jit(allocates=False, fastmath=FUSED)
def look_lobe_up(model, numbers, lobe, u, apart, t, slope, depth, yaw, modes, work):
    """Look a lobe up, or only what is no coefficient of ``modes``; False if it is in no lattice."""
    table = model.strips.table
    cell, fx, fy, fz, gx, gy, gz, turn = locate(table, u, apart, t, slope, depth, yaw)
    if cell == 0:
        return False
    weigh(fx, fy, fz, gx, gy, gz, turn, work.weights)
    look_up(table.cells[cell], work.weights, numbers)
    if modes:
        look_modes_up(table.cells[cell], work.weights, numbers)
    lobe[NORMAL] = load_of(contact_modulus(model.shear_modulus, model.poisson_ratio), numbers, depth)
    lobe[CELL] = cell
    return True


@jit(allocates=False, fastmath=FUSED)
def _roll_lobes(model, m, frame, y, z, ahead, count, counters, work):
    """`Solution` of the lobes together, their load alone where no rows are wanted; adds what acts on them to
    ``work.wrench``. ``y``, ``z``: of the frame's origin from the wheelset's centre. A wheel that rolls back is the
    mirror image, along x, of one that rolls ahead."""
    extent, modulus, bare = work.sums, contact_modulus(model.shear_modulus, model.poisson_ratio), work.spare[ROWLESS]
    load = x = s = xx = ss = xi = eta = phi = phi_x = peak = power = 0.0
    x_min = s_min = 1.0
    x_max = s_max = -1.0
    for q in range(count):
        normal, numbers = work.lobes[q, NORMAL], work.numbers[q]
        if normal <= 0.0:
            continue
        r = roll_lobe(model, m, ahead, q, counters, work)
        add_force(r.px, r.py, r.pz, 0.0, -normal * r.sine, normal * r.cosine, work.wrench[0])
        add_force(r.px, r.py, r.pz, r.f1, r.f2 * r.cosine, r.f2 * r.sine, work.wrench[1])
        work.wrench[1, 4] -= r.m3 * r.sine
        work.wrench[1, 5] += r.m3 * r.cosine
        if bare > 0.0:
            load += normal
            continue
        at_x, at_s = r.px - frame.x, (r.py - y) * frame.cosine + (r.pz - z) * frame.sine
        a, b = math.exp(numbers[columns.LOG_A]), math.exp(numbers[columns.LOG_B])
        load, x, s = load + normal, x + normal * at_x, s + normal * at_s
        xx, ss = xx + normal * (at_x * at_x + 0.2 * a * a), ss + normal * (at_s * at_s + 0.2 * b * b)
        xi, eta, phi = xi + normal * r.xi, eta + normal * r.eta, phi + normal * r.phi
        phi_x, power = phi_x + normal * r.phi * at_x, power + r.f1 * r.xi + r.f2 * r.eta + r.m3 * r.phi
        peak = max(peak, modulus * math.exp(numbers[columns.LOG_PEAK]))
        x_min, x_max = min(x_min, at_x - a), max(x_max, at_x + a)
        s_min, s_max = min(s_min, at_s - b), max(s_max, at_s + b)
    if bare > 0.0:
        return Solution(0.0, 0.0, 0.0, load, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    x, s, xi, phi = x / load, s / load, xi / load, phi / load
    eta = (eta - phi_x) / load + phi * x
    a, b = math.sqrt(5.0 * max(xx / load - x * x, 1e-14)), math.sqrt(5.0 * max(ss / load - s * s, 1e-14))
    extent[solve.LOAD], extent[solve.MEAN_X], extent[solve.MEAN_S] = load, x, s
    extent[solve.X_MIN], extent[solve.X_MAX], extent[solve.S_MIN], extent[solve.S_MAX] = x_min, x_max, s_min, s_max
    return Solution(xi, eta, phi, load, x, s, a, b, peak, power)


class Rolled(NamedTuple):
    """Creep force on a lobe."""

    px: float
    py: float
    pz: float
    """Where it slips, from the wheelset's centre, m."""
    cosine: float
    sine: float
    """Of its contact angle."""
    xi: float
    eta: float
    phi: float
    f1: float
    f2: float
    m3: float


@jit(allocates=False, fastmath=FUSED)
def roll_lobe(model, m, ahead, q, counters, work):
    """`Rolled` of a lobe."""
    half, radius, numbers = model.geometry.half_distance, model.geometry.rolling_radius, work.numbers[q]
    speed, cosine, sine = (
        max(abs(m.vx), model.least_speed),
        math.cos(numbers[columns.ANGLE]),
        math.sin(numbers[columns.ANGLE]),
    )
    px = ahead * numbers[columns.PLACE_X] + half * m.ex
    py, pz = numbers[columns.PLACE_Y] + half * m.ey, numbers[columns.PLACE_Z] + half * m.ez - radius
    xi, eta, phi, _ = creepages(m.vx, m.vy, m.vz, m.wx, m.wy, m.wz, px, py, pz, cosine, sine, speed)
    limit = falling(model, m.friction, xi, eta, speed) * work.lobes[q, NORMAL]
    slowness = 1.0 / speed
    slip = Slip(
        ahead * xi + work.lobes[q, SLIP_XI], eta + work.lobes[q, SLIP_ETA], ahead * phi,
        slowness * (m.vy + m.wz * px - m.wx * pz), slowness * (m.vz + m.wx * py - m.wy * px), slowness * m.wx,
        ahead * slowness * m.wy, ahead * slowness * m.wz,
    )  # fmt: skip
    turning = ahead * m.wy * radius / speed - 1.0
    f1, f2, m3, missed = tabulated_force(model, model.strips.table.modes, numbers, slip, limit, turning)
    counters[OUT_OF_RANGE] += missed
    return Rolled(px, py, pz, cosine, sine, xi, eta, phi, ahead * f1, f2, ahead * m3)
