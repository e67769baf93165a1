"""Wrench of the rails on a wheel with exact contact, looked up in a `PairTable`; solved where that has no answer, and
where the rail is not the plain one.

Most wheels have one lobe. Those that are apart are in :mod:`wrcore.wheels.table_force_apart`, compiled when they are
met.
"""

import math
from typing import NamedTuple

from wrcore.contact.creepage import creepages
from wrcore.contact.hertz import contact_modulus
from wrcore.contact.normal import solve
from wrcore.contact.normal.gap import add_force, frame_of_rows
from wrcore.contact.patch.model import KERNEL, LOAD, LOBES, MODEL
from wrcore.contact.patch.solution import NOTHING, Solution, fill_row
from wrcore.contact.search import reduction
from wrcore.contact.search.approach import LEVEL, pressed_together
from wrcore.contact.search.reduction import MAX_PATCHES
from wrcore.contact.search.strip import changed_here, make_pose
from wrcore.kernels.handles import call_address, call_c
from wrcore.kernels.jit import FUSED, jit
from wrcore.wheels.contact_model import OUT_OF_RANGE, SOLVED
from wrcore.wheels.exact_force import ROWLESS, UNSOLVED, copy_deepest
from wrcore.wheels.force import falling
from wrcore.wheels.normal_damping import lift_of
from wrcore.wheels.table import lookup as columns
from wrcore.wheels.table.cells import locate
from wrcore.wheels.table.coupled_lobes import CELL, END, NORMAL, SLIP_ETA, SLIP_XI
from wrcore.wheels.table.lookup import (
    APART,
    FAR,
    SADDLE,
    Slip,
    lobe_end,
    log_depth_of,
    look_modes_up,
    look_shares_up,
    look_up,
    tabulated_force,
    weigh,
)

UNKNOWN = NOTHING._replace(load=-1.0)

UNLISTED = -1.0
"""Cell of the first of several lobes if one of them is in no lattice."""


@jit(allocates=False, fastmath=FUSED, nogil=True)
def tabulated_wrench(model, m, spatial, rows, first, last, out, wrench, counters, work):
    """As `group_wrench`, looked up; UNKNOWN where the table has no answer."""
    if not spatial or changed_here(model.geometry):  # the lattices are of spatial detection on plain rails
        counters[SOLVED] += 1
        return UNKNOWN
    frame, ahead = frame_of_rows(rows, first, last), -1.0 if m.vx < 0.0 else 1.0
    pose = make_pose(1.0, m.y, m.z, m.ex, m.ey, m.ez, True)
    pressed = pressed_together(model.geometry, pose, True, LEVEL, rows, first, last, work.moments)
    lift, lobes = lift_of(model, m, pressed), -1
    if lift.share < 1.0:
        pose, place = lifted_place(m, pressed, lift)
        lobes = _look_lobes_up(model, m, pose, pressed, lift, place, ahead, rows, first, last, counters, work)
    if lobes < 0:
        out[reduction.NORMAL] = 0.0
        return NOTHING
    if lobes == 0:
        counters[SOLVED] += 1
        return UNKNOWN
    if work.flags[ROWLESS] == 0.0:
        copy_deepest(rows, first, last, out)
    work.wrench[:] = 0.0
    y, z = frame.ur + model.geometry.rail_distance - pose.y, frame.z - pose.z
    found = _roll_lobes(model, m, frame, y, z, ahead, lobes, counters, work)
    out[reduction.NORMAL] = found.load
    if work.flags[ROWLESS] == 0.0:
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
    found = tabulated_wrench(model, m, spatial, rows, first, last, out, wrench, counters, work)
    if found.load < 0.0 and work.flags[UNSOLVED] > 0.0:
        out[reduction.NORMAL] = -1.0
    elif found.load < 0.0:
        late = model.strips.late
        if late[KERNEL] == 0:
            call_c(late[LOAD], KERNEL)
        if late[KERNEL] == 0:  # interrupted
            out[reduction.NORMAL] = wrench[:] = math.nan
            return
        call_address(late[KERNEL], late[MODEL], m, spatial, rows, first, last, out, wrench, counters, memory, work)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def place_with_depth(pressed, lift):
    """What the place of overlaps on the wheel's profile changes by with ln D where the wheel is lifted, m."""
    u = pressed.moment / pressed.square
    across, up = pressed.moment_across - u * pressed.across, pressed.moment_up - u * pressed.up
    return lift.depth * (lift.sine * across - lift.cosine * up) / pressed.square


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def lifted_place(m, pressed, lift):
    """Pose of a lifted wheel, and ln D and place on the wheel's profile of its overlaps if they are one lobe."""
    height, (log_depth, u), less = lift.share * lift.depth, log_depth_of(pressed), math.log(1.0 - lift.share)
    pose = make_pose(1.0, m.y - height * lift.sine, m.z + height * lift.cosine, m.ex, m.ey, m.ez, True)
    return pose, (log_depth + less, u + less * place_with_depth(pressed, lift))


@jit(allocates=False, fastmath=FUSED)
def _look_lobes_up(model, m, pose, pressed, lift, place, ahead, rows, first, last, counters, work):
    """Fill ``work.numbers`` and ``work.lobes`` of the lobes of a wheel with a `lifted_place`; ``rows`` are its overlaps
    where it is not lifted. Returns how many there are, 0 if one of them is in no lattice, -1 if it hangs in the air."""
    lobes, late = work.lobes, model.strips.late
    lobes[:] = 0.0
    if lobe_end(model.geometry, pose, rows, first, last, (APART, FAR, SADDLE)) == last:
        return 1 if look_only_lobe_up(model, m, pose, ahead, place, work) else 0
    if late[LOBES] == 0:
        call_c(late[LOAD], LOBES)
    if late[LOBES] == 0:  # interrupted
        return 0
    ends = rows[first, reduction.OUTSIDE], rows[last - 1, reduction.BEYOND]
    call_address(late[LOBES], model, m, pressed, lift, ends, ahead, counters, work)
    if lobes[0, CELL] == UNLISTED:
        return 0
    count = 0
    while count < MAX_PATCHES and lobes[count, END] > 0.0:
        count += 1
    return count if count > 0 else -1


@jit(allocates=False, fastmath=FUSED)
def look_only_lobe_up(model, m, pose, ahead, place, work):
    """Look up the only lobe of a wheel with a `lifted_place`; False if it is in no lattice."""
    t, (log_depth, u) = pose.y + model.geometry.half_distance * m.ey - model.geometry.rail_distance, place
    return look_lobe_up(model, work.numbers[0], work.lobes[0], u, False, t, m.ez, log_depth, ahead * m.ex, True, work)


@jit(allocates=False, fastmath=FUSED)
def look_lobe_up(model, numbers, lobe, u, apart, t, slope, log_depth, yaw, modes, work):
    """Look a lobe with ln D up, or only what is no coefficient of ``modes``; False if it is in no lattice."""
    table = model.strips.table
    at = locate(table, u, apart, t, slope, log_depth, yaw, work.shares)
    if at.cell == 0:
        return False
    if at.own < 1.0:
        look_shares_up(table, at, work.shares, work.weights, numbers)
    else:
        weigh(at, work.weights)
        look_up(table.cells[at.cell], work.weights, numbers)
        if modes:
            look_modes_up(table.cells[at.cell], work.weights, numbers)
    modulus = contact_modulus(model.shear_modulus, model.poisson_ratio)
    lobe[NORMAL] = modulus * math.exp(numbers[columns.LOG_NORMAL] + 1.5 * log_depth)
    lobe[CELL] = at.cell
    return True


@jit(allocates=False, fastmath=FUSED)
def _roll_lobes(model, m, frame, y, z, ahead, count, counters, work):
    """`Solution` of the lobes together, their load alone where no rows are wanted; adds what acts on them to
    ``work.wrench``. ``y``, ``z``: of the frame's origin from the wheelset's centre. A wheel that rolls back is the
    mirror image, along x, of one that rolls ahead."""
    extent, modulus, bare = work.sums, contact_modulus(model.shear_modulus, model.poisson_ratio), work.flags[ROWLESS]
    load = x = s = xx = ss = xi = eta = phi = phi_x = peak = power = 0.0
    x_min = s_min = 1.0
    x_max = s_max = -1.0
    for q in range(count):
        normal, numbers = work.lobes[q, NORMAL], work.numbers[q]
        if normal <= 0.0:
            continue
        r = roll_lobe(model, m, ahead, q, counters, work)
        add_force(r.px, r.py, r.pz, 0.0, -normal * r.sine, normal * r.cosine, work.wrench[0])
        fy, fz = r.f2 * r.cosine - r.fn * r.sine, r.f2 * r.sine + r.fn * r.cosine
        add_force(r.px, r.py, r.pz, r.f1, fy, fz, work.wrench[1])
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
    fn: float
    """What friction has along the lobe's normal, N."""


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
    f1, f2, m3, missed, fn = tabulated_force(model, model.strips.table.modes, numbers, slip, limit, turning)
    counters[OUT_OF_RANGE] += missed
    return Rolled(px, py, pz, cosine, sine, xi, eta, phi, ahead * f1, f2, ahead * m3, fn)
