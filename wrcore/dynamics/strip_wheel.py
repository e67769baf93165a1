"""Wrench of the rails on wheelsets with the real patch: contact on strips in place of an ellipse.

The normal and the rolling problem are solved on Galerkin strips. The rigid slip is that of the wheel's over the rail's
surface, strip by strip, or follows one set of creepages. Where strips do not converge a uniform grid takes over
(counted).

Pressure and friction act in each strip's own plane, on the wheel's material points, where the slip is taken: friction
takes from the wheelset what it dissipates. A right wheel is solved as the mirror image of a left one: no choice can
tell them apart.

The damping factor acts as on an ellipse: the half-space sees the elastic approach c_d^(2/3) delta, and the wheel is
lifted along the contact normal by the rest; how deep, along which normal and how fast: :mod:`wrcore.contact.approach`.
"""

import math
from typing import NamedTuple

import numpy as np

from wrcore.contact import reduction
from wrcore.contact.approach import approach_of, pressed_together
from wrcore.contact.creepage import creepages
from wrcore.contact.detection import SPATIAL, find_patches
from wrcore.contact.normal import damping_factor, inverse_cube_root
from wrcore.contact.patch import rolling, solve
from wrcore.contact.patch.gap import frame_of_rows, group_end, lean_of, rigid_slip
from wrcore.contact.patch.gap import strip_wrenches as wrenches_of_strips
from wrcore.contact.patch.grid import GridPatch, grid_normal, grid_rolling
from wrcore.contact.patch.model import ELLIPSES as WITH_ELLIPSES
from wrcore.contact.patch.model import LOAD
from wrcore.contact.patch.strips import FIXED, WEIGHT, WIDENED
from wrcore.contact.patch.surfaces import ContactPlane, Motion, plane_slip, strip_planes, surface_slip
from wrcore.contact.patch.windows import MORE
from wrcore.contact.strip import AHEAD, LIFT, leaning, make_pose, upright, with_rail_along
from wrcore.dynamics.modes import BARE, ELLIPSES, FRESH, PATCHES_ONLY, WARM
from wrcore.dynamics.motion import as_left, motion_of
from wrcore.dynamics.vector import copy_into
from wrcore.dynamics.wheel import ON_FIXED, ON_GRID, contact_of, detect_patches, falling, leaning_motion
from wrcore.kernels.handles import call_address, call_c
from wrcore.kernels.jit import FUSED, jit

SLENDER = 3.0
"""Length over width from which strips get more panels along rolling."""

UNSOLVED, STOOD_IN, ROWLESS = range(3)
"""Places of `StripWork.flags`: not 0 where what a table does not have is not to be solved; once ellipses have stood in;
where no rows are wanted (`BARE`)."""

GRID, GRID_TOLERANCE = 32, 1e-3
"""Elements along and across the patch of the grid, and the tolerance of its tractions."""


class Solution(NamedTuple):
    """What is known of a patch beside its wrench."""

    xi: float
    eta: float
    phi: float
    """Mean creepages."""
    load: float
    """Force of the pressure, N."""
    x: float
    s: float
    """Means over the pressure, m."""
    a: float
    b: float
    """Semi-axes of the ellipse of equal moments, m."""
    p_max: float
    """Pa."""
    power: float
    """Of friction, over V, N."""


NOTHING = Solution(*[0.0] * 10)


@jit
def solve_on_grid(model, m, pose, frame, creepage, friction, row):
    """Fallback: a patch of a left wheel on a uniform grid; a kernel of its own that may allocate. Fills ``row``, about
    the frame's origin and in its plane: friction (MZ about n), NORMAL, X and Y (means over the pressure of x and s),
    semi-axes, greatest pressure, and as ANGLE the mean slope of the strips.
    """
    x = frame.x
    if len(model.geometry.over) == 0:  # the grid knows no more than the section
        x = with_rail_along(model.geometry, AHEAD, frame.ur, -1.0, x)
    plane = ContactPlane(x, frame.ur + model.geometry.rail_distance, frame.z, frame.cosine, frame.sine)
    modulus = model.shear_modulus / (1.0 - model.poisson_ratio)
    grid = grid_normal(model.geometry, pose, plane, modulus, GRID, GRID)
    wx, ws = np.empty(grid.gap.shape), np.empty(grid.gap.shape)
    low, tilt = strip_planes(grid.s, grid.gap, grid.height)
    if model.strips.surfaces == 0:
        plane_slip(creepage[0], creepage[1], creepage[2], grid.x, grid.s, wx, ws)
    else:
        speed = max(abs(m.vx), model.least_speed)
        surface_slip(pose, plane, Motion(m.vx, m.vy, m.vz, m.wx, m.wy, m.wz, speed), grid.x, grid.s, low, tilt, wx, ws)
    sign, rolled = 1.0, grid
    if m.vx < 0.0:  # rolling is always towards x: the mirror image of a wheel that rolls back
        sign, x, pressure = -1.0, -grid.x[::-1].copy(), grid.pressure[::-1].copy()
        rolled = GridPatch(x, grid.s, grid.dx, grid.ds, grid.gap, grid.height, pressure)
        wx, ws = wx[::-1].copy(), -ws[::-1].copy()
    found = grid_rolling(rolled, wx, ws, friction, model.shear_modulus, model.poisson_ratio, GRID_TOLERANCE)
    load = xm = sm = xx = ss = top = rise = 0.0
    for i in range(grid.x.size):
        for j in range(grid.s.size):
            p = grid.pressure[i, j]
            load, top = load + p, max(top, p)
            xm, sm = xm + p * grid.x[i], sm + p * grid.s[j]
            xx, ss, rise = xx + p * grid.x[i] ** 2, ss + p * grid.s[j] ** 2, rise + p * tilt[j]
    load = max(load, 1e-30)
    xm, sm = xm / load, sm / load
    row[reduction.FX], row[reduction.FY], row[reduction.MZ] = found.fx, sign * found.fs, found.mn
    row[reduction.NORMAL], row[reduction.P_MAX] = load * grid.dx * grid.ds, top
    row[reduction.X], row[reduction.Y], row[reduction.ANGLE] = xm, sm, rise / load
    row[reduction.SEMI_A] = math.sqrt(5.0 * max(xx / load - xm * xm, 1e-14))
    row[reduction.SEMI_B] = math.sqrt(5.0 * max(ss / load - sm * sm, 1e-14))


class Lift(NamedTuple):
    """What the damping lifts a wheel by: a share of the depth (m) along the normal."""

    share: float
    depth: float
    cosine: float
    sine: float


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def lift_share(model, approach):
    """Share of its depth by which the damping lifts a wheel."""
    factor = damping_factor(approach, model.damping, model.damping_speed)
    return 1.0 - factor * inverse_cube_root(factor)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def lift_of(model, m, pressed):
    """`Lift` of a wheel whose overlaps have ``pressed``."""
    depth, cosine, sine, approach = approach_of(pressed, m)
    return Lift(lift_share(model, approach), depth, cosine, sine)


@jit(allocates=False, fastmath=FUSED)
def _overlaps_above(model, m, height, lift, spatial, ends, rows):
    """Pose of a wheel lifted by a ``height``, and which of its overlaps lie between two ends on its profile."""
    low, y, z = 0, m.y - height * lift.sine, m.z + height * lift.cosine
    pose = make_pose(1.0, y, z, m.ex, m.ey, m.ez, spatial)
    high = count = find_patches(model.geometry, 1.0, y, z, m.ex, m.ey, m.ez, spatial, reduction.MOMENT, rows)
    while low < count and not ends[0] < rows[low, reduction.U_WHEEL] < ends[1]:
        low += 1
    while high > low and not ends[0] < rows[high - 1, reduction.U_WHEEL] < ends[1]:
        high -= 1
    return pose, low, high


@jit(allocates=False, fastmath=FUSED)
def lifted(model, m, lean, pressed, lift, spatial, ends, work):
    """Overlaps of a lifted wheel between two ``ends`` on its profile (m), into ``work.rows``: (pose, first, last).

    M0^0.4 of what has ``pressed`` falls by the share of the lift: the first of two steps is right for a parabola."""
    rest, height = 1.0 - lift.share, lift.share * lift.depth
    pose, low, high = _overlaps_above(model, m, height, lift, spatial, ends, work.rows)
    if high > low:
        now = pressed_together(model.geometry, pose, spatial, lean, work.rows, low, high, work.moments)
        height += ((now.square / pressed.square) ** 0.4 - rest) * lift.depth
        pose, low, high = _overlaps_above(model, m, height, lift, spatial, ends, work.rows)
    return pose, low, high


@jit(allocates=False, forceinline=True)
def solve_overlaps(model, pose, low, high, memory, work):
    """Number of windows, 0 where strips find no solution, and frame of the overlaps of a lifted wheel."""
    settings = model.strips
    return solve.solve_patch(
        model.geometry, pose, model.hertz, settings.values, work.rows, low, high, settings.strips, memory,
        work.normal,
    )  # fmt: skip


@jit(allocates=False, forceinline=True)
def library_of(settings, work):
    """The library whose ellipses have as many strips as the patch that is solved, and the scratch arrays with it."""
    count, slender, windows = work.solved
    if slender:
        return settings.slender, work.slender
    if windows == 1 and count == settings.wider.level.strips:
        return settings.wider, work.rolling
    if windows == 1 and count == settings.widest.level.strips:
        return settings.widest, work.rolling
    return settings.library, work.rolling


@jit(allocates=False, fastmath=FUSED)
def _roll(model, friction, strips, slip, force, work):
    """Creep force on the strips."""
    count, (library, own) = work.solved[0], library_of(model.strips, work)
    rolling.rolling_force(
        strips[solve.OWN_PLACE, :count], strips[solve.OWN_WIDTH, :count], strips[solve.HALF_LENGTH, :count],
        strips[solve.MIDDLE, :count], strips[solve.PEAK, :count], slip[0, :count], slip[1, :count], slip[2, :count],
        slip[3, :count], model.shear_modulus, friction, library, own, rolling.AUTO,
    )  # fmt: skip
    rolling.read_forces(count, own, force)


@jit(allocates=False)
def _turn_round(strips, slip, force, count):
    """Turn a patch round: x points back, and slips and forces across change their sign."""
    for i in range(count):
        strips[solve.MIDDLE, i], slip[1, i], slip[2, i] = -strips[solve.MIDDLE, i], -slip[1, i], -slip[2, i]
        force[1, i] = -force[1, i]


@jit(allocates=False, fastmath=FUSED)
def _mean_slip(strips, slip, load, x, count):
    """Creepages at the pressure's centroid: means of the rigid slip over the pressure."""
    xi = eta = phi = 0.0
    for i in range(count):
        share = strips[solve.STRIP_LOAD, i] / load
        xi += share * slip[0, i]
        eta += share * (slip[2, i] + slip[3, i] * (x - strips[solve.MIDDLE, i]))
        phi += share * slip[3, i]
    return xi, eta, phi


@jit(allocates=False, fastmath=FUSED)
def _add_wrenches(geometry, pose, frame, count, share, work):
    """Add ``share`` of what acts on the strips to ``work.wrench``; returns the power of friction over V."""
    strips, slip, force = work.strips, work.slip, work.friction
    wrenches_of_strips(
        geometry, pose, frame, strips[solve.CENTRE, :count], strips[solve.MIDDLE, :count],
        strips[solve.WHEEL_HEIGHT, :count], strips[solve.STRIP_TILT, :count], strips[solve.STRIP_LOAD, :count], force,
        share, work.wrench[0], work.wrench[1],
    )  # fmt: skip
    power = 0.0
    for i in range(count):
        power += force[0, i] * slip[0, i] + force[1, i] * slip[2, i] + force[2, i] * slip[3, i]
    return power


@jit(allocates=False, fastmath=FUSED)
def roll_patch(model, m, pose, frame, windows, depth, speed, friction, share, work):
    """`Solution` with friction of a solution of the normal problem; adds ``share`` of it to ``work.wrench``."""
    settings, strips, slip, sums = model.strips, work.strips, work.slip, work.sums
    count = solve.publish(model.shear_modulus / (1.0 - model.poisson_ratio), work.normal, windows, strips, sums)
    load, x, s = sums[solve.LOAD], sums[solve.MEAN_X], sums[solve.MEAN_S]
    if settings.surfaces == 0:  # one set of creepages is the slip of a plane, where the undeformed wheel is deepest
        tilt = 0.0
        for i in range(count):
            tilt += strips[solve.STRIP_LOAD, i] / load * strips[solve.STRIP_TILT, i]
        for i in range(count):
            strips[solve.WHEEL_HEIGHT, i] = tilt * (strips[solve.CENTRE, i] - s) - depth
            strips[solve.STRIP_TILT, i] = tilt
    rigid_slip(
        model.geometry, pose, frame, (m.vx, m.vy, m.vz, m.wx, m.wy, m.wz, speed), strips[solve.CENTRE, :count],
        strips[solve.MIDDLE, :count], strips[solve.WHEEL_HEIGHT, :count], strips[solve.STRIP_TILT, :count],
        slip[:, :count],
    )  # fmt: skip
    a = math.sqrt(5.0 * max(sums[solve.MEAN_XX] - x * x, 1e-14))
    b = math.sqrt(5.0 * max(sums[solve.MEAN_SS] - s * s, 1e-14))
    xi, eta, phi = _mean_slip(strips, slip, load, x, count)
    back = m.vx < 0.0  # rolling is always towards x
    if back:
        _turn_round(strips, slip, work.friction, count)
    work.solved[0], work.solved[1], work.solved[2] = count, a > SLENDER * b, windows
    _roll(model, friction, strips, slip, work.friction, work)
    if back:
        _turn_round(strips, slip, work.friction, count)
    power = _add_wrenches(model.geometry, pose, frame, count, share, work)
    return Solution(xi, eta, phi, load, x, s, a, b, sums[solve.LARGEST], power)


@jit(allocates=False, fastmath=FUSED)
def _roll_on_grid(model, m, pose, frame, depth, creepage, friction, row, work):
    """As `roll_patch`, on a grid: it acts on one strip at the pressure's centroid. ``row`` is overwritten."""
    strips, slip, force = work.strips, work.slip, work.friction
    call_address(model.strips.fallback, model, m, pose, frame, creepage, friction, row)
    (xi, eta, phi), x, s, load = creepage, row[reduction.X], row[reduction.Y], row[reduction.NORMAL]
    strips[solve.CENTRE, 0], strips[solve.MIDDLE, 0], strips[solve.WHEEL_HEIGHT, 0] = s, x, -depth
    strips[solve.STRIP_TILT, 0], strips[solve.STRIP_LOAD, 0] = row[reduction.ANGLE], load
    force[0, 0], force[1, 0] = row[reduction.FX], row[reduction.FY]
    force[2, 0] = row[reduction.MZ] - x * row[reduction.FY] + s * row[reduction.FX]
    xi, eta = xi - phi * s, eta + phi * x
    slip[0, 0], slip[2, 0], slip[3, 0] = xi, eta, phi
    power = _add_wrenches(model.geometry, pose, frame, 1, 1.0, work)
    a, b, p_max = row[reduction.SEMI_A], row[reduction.SEMI_B], row[reduction.P_MAX]
    return Solution(xi, eta, phi, load, x, s, a, b, p_max, power)


@jit(allocates=False, fastmath=FUSED)
def _deepest_slip(model, m, pose, frame, depth):
    """Creepages of a patch's deepest material point, and coefficient of friction. The motion ``m`` is in axes that lean
    as the patch does."""
    speed = max(abs(m.vx), model.least_speed)
    py = frame.ur + model.geometry.rail_distance + depth * frame.sine - m.y
    pz = with_rail_along(model.geometry, LIFT, frame.ur, 1.0, frame.z - depth * frame.cosine - m.z)
    px, pz = leaning(model.geometry, lean_of(model.geometry, pose, frame), frame.x, pz)
    xi, eta, phi, _ = creepages(m.vx, m.vy, m.vz, m.wx, m.wy, m.wz, px, py, pz, frame.cosine, frame.sine, speed)
    return (xi, eta, phi), falling(model, m.friction, xi, eta, speed)


@jit(allocates=False, forceinline=True)
def copy_deepest(rows, first, last, out):
    """Fill ``out`` with the deepest of the rows."""
    deepest = first
    for k in range(first + 1, last):
        deepest = k if rows[k, reduction.PENETRATION] > rows[deepest, reduction.PENETRATION] else deepest
    copy_into(out, rows[deepest])


@jit(allocates=False, fastmath=FUSED)
def group_wrench(model, m, spatial, rows, first, last, out, wrench, counters, memory, work):
    """Solve the overlaps from ``first`` to before ``last`` as one patch of a left wheel: its row, its share of the
    wrench, and its `Solution`; a NORMAL of 0 where the wheel hangs in the air."""
    speed, windows = max(abs(m.vx), model.least_speed), 0
    pose = make_pose(1.0, m.y, m.z, m.ex, m.ey, m.ez, spatial)
    frame = frame_of_rows(rows, first, last)
    lean = lean_of(model.geometry, pose, frame)
    m = leaning_motion(model.geometry, m, lean)
    pressed = pressed_together(model.geometry, pose, spatial, lean, rows, first, last, work.moments)
    lift = lift_of(model, m, pressed)
    copy_deepest(rows, first, last, out)
    creepage, friction = _deepest_slip(model, m, pose, frame, out[reduction.PENETRATION])
    depth = (1.0 - lift.share) * out[reduction.PENETRATION]
    if depth > 0.0:
        ends = rows[first, reduction.OUTSIDE], rows[last - 1, reduction.BEYOND]
        pose, low, high = lifted(model, m, lean, pressed, lift, spatial, ends, work)
        if high == low:
            out[reduction.NORMAL] = 0.0
            return NOTHING
        windows, frame = solve_overlaps(model, pose, low, high, memory, work)
    for k in range(6):
        work.wrench[0, k] = work.wrench[1, k] = 0.0
    if windows == 0:
        counters[ON_GRID] += 1
        found = _roll_on_grid(model, m, pose, frame, depth, creepage, friction, out, work)
    else:
        finer = work.normal.more
        share = finer[WEIGHT]
        fixed = finer[FIXED]
        found = roll_patch(model, m, pose, frame, windows, depth, speed, friction, 1.0, work)
        if share > 0.0:  # the mean with more strips
            finer[WIDENED] = MORE
            windows, frame = solve_overlaps(model, pose, low, high, memory, work)
            finer[WIDENED] = 1.0
            if windows > 0:
                for k in range(6):
                    work.wrench[0, k] *= 1.0 - share
                    work.wrench[1, k] *= 1.0 - share
                more = roll_patch(model, m, pose, frame, windows, depth, speed, friction, share, work)
                found, fixed = _mean(found, more, share), max(fixed, finer[FIXED])
        counters[ON_FIXED] += fixed > 0.0
    z = with_rail_along(model.geometry, LIFT, frame.ur, 1.0, frame.z - m.z)
    lean, total = lean_of(model.geometry, pose, frame), work.wrench[0]
    fill_row(model.geometry, lean, frame, frame.ur + model.geometry.rail_distance - m.y, z, found, work.wrench, out)
    out[reduction.Y], out[reduction.Z] = out[reduction.Y] + m.y, out[reduction.Z] + m.z
    for k in range(6):
        total[k] += work.wrench[1, k]
    for k in range(0, 6, 3):
        total[k], total[k + 2] = upright(model.geometry, lean, total[k], total[k + 2])
    for k in range(6):
        wrench[k] += total[k]
    return found


@jit(allocates=False)
def add_group(model, m, spatial, rows, first, last, out, wrench, counters, memory, work):
    """`group_wrench` for who calls it by its address."""
    group_wrench(model, m, spatial, rows, first, last, out, wrench, counters, memory, work)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _mean(one, other, share):
    """Mean of two solutions of which the other has a ``share``."""
    rest = 1.0 - share
    return Solution(
        rest * one.xi + share * other.xi, rest * one.eta + share * other.eta, rest * one.phi + share * other.phi,
        rest * one.load + share * other.load, rest * one.x + share * other.x, rest * one.s + share * other.s,
        rest * one.a + share * other.a, rest * one.b + share * other.b, rest * one.p_max + share * other.p_max,
        rest * one.power + share * other.power,
    )  # fmt: skip


@jit(allocates=False, fastmath=FUSED)
def fill_row(geometry, lean, frame, y, z, found, wrenches, out):
    """Row of a patch about the pressure's centroid, from the wrenches of pressure and friction, in axes that ``lean``.

    The pressure's resultant is the normal; the force along it holds what friction in the strips' planes has there.
    Creepages are the means of the rigid slip, moved by the least with which the forces do on them what friction does on
    the slip. ``y``, ``z``: of the frame's origin from the wheelset's centre.
    """
    pressure, friction, a, b = wrenches[0], wrenches[1], found.a, found.b
    normal = math.sqrt(pressure[1] * pressure[1] + pressure[2] * pressure[2])
    cosine, sine = pressure[2] / normal, -pressure[1] / normal
    px, py, pz = frame.x + found.x, y + found.s * frame.cosine, z + found.s * frame.sine
    out[reduction.X], out[reduction.Y], out[reduction.Z] = px, py, pz
    px, pz = leaning(geometry, lean, px, pz)
    fx, fy, fz = friction[0], friction[1], friction[2]
    fs = fy * cosine + fz * sine
    turn_y, turn_z = friction[4] - pz * fx + px * fz, friction[5] - px * fy + py * fx
    mn = turn_z * cosine - turn_y * sine
    out[reduction.ANGLE], out[reduction.COSINE], out[reduction.SINE] = math.atan2(sine, cosine), cosine, sine
    out[reduction.SEMI_A], out[reduction.SEMI_B], out[reduction.P_MAX], out[reduction.CELL] = a, b, found.p_max, 0.0
    out[reduction.NORMAL] = normal + fz * cosine - fy * sine
    out[reduction.FX], out[reduction.FY], out[reduction.MZ] = fx, fs, mn
    size = fx * fx + fs * fs + mn * mn / (a * b)
    rest = (found.power - fx * found.xi - fs * found.eta - mn * found.phi) / size if size > 0.0 else 0.0
    out[reduction.XI], out[reduction.ETA] = found.xi + rest * fx, found.eta + rest * fs
    out[reduction.PHI] = found.phi + rest * mn / (a * b)


@jit(allocates=False)
def mirror(rows, count, wrench):
    """Patches and wrench of a left wheel as those of a right one."""
    for k in (1, 3, 5):
        wrench[k] = -wrench[k]
    for i in range(count):
        for column in (
            reduction.S_WHEEL, reduction.Y, reduction.ANGLE, reduction.SINE, reduction.FY, reduction.MZ, reduction.ETA,
            reduction.PHI,
        ):  # fmt: skip
            rows[i, column] = -rows[i, column]


@jit(allocates=False)
def _press_ellipses(model, motions, patches, counts, bounds, wrenches, counters, work, mode):
    """`wheel_wrenches`, called by its address: few runs need it."""
    late, work.flags[STOOD_IN] = model.strips.late, 1.0
    if late[WITH_ELLIPSES] == 0:
        call_c(late[LOAD], WITH_ELLIPSES)
    if late[WITH_ELLIPSES] == 0:  # interrupted
        wrenches[:] = math.nan
        return
    call_address(late[WITH_ELLIPSES], model, motions, patches, counts, bounds, wrenches, counters, work, mode)


@jit(allocates=False, fastmath=FUSED)
def strip_wrenches(model, motions, patches, counts, bounds, wrenches, counters, work, mode=FRESH):
    """As `wheel_wrenches`, with patches on strips; arguments as there. Ellipses stand in for what is solved, not for
    what a table has."""
    rough = mode & ELLIPSES > 0
    if rough and not (model.strips.looked_up > 0.0 and model.detection == SPATIAL):
        _press_ellipses(model, motions, patches, counts, bounds, wrenches, counters, work, mode)
        return
    work.flags[UNSOLVED], work.flags[ROWLESS] = 1.0 if rough else 0.0, 1.0 if mode & BARE else 0.0
    for i in range(motions.shape[0]):
        for wheel in range(2):
            rows, wrench, contact = patches[i, wheel], wrenches[i, wheel], contact_of(model, i, wheel)
            seen = motion_of(motions[i, wheel])
            m = as_left(seen)
            for k in range(6):
                wrench[k] = 0.0
            count, bound, spatial = detect_patches(contact, m, rows)
            if mode & PATCHES_ONLY:
                counts[i, wheel], bounds[i, wheel] = count, bound
                continue
            first = kept = group = 0
            while first < count:
                last = group_end(contact.geometry, rows, count, first)
                memory = work.memory[i, wheel, group] if mode & WARM else work.spare
                work.spare[0] = 0.0
                call_address(
                    contact.strips.group, contact, m, spatial, rows, first, last, work.out, wrench, counters, memory,
                    work,
                )  # fmt: skip
                if rough and work.out[reduction.NORMAL] < 0.0:
                    _press_ellipses(model, motions, patches, counts, bounds, wrenches, counters, work, ELLIPSES)
                    return
                group += 1
                if work.out[reduction.NORMAL] > 0.0:
                    copy_into(rows[kept], work.out)
                    kept += 1
                first = last
            if seen.side < 0.0:
                mirror(rows, kept, wrench)
            counts[i, wheel], bounds[i, wheel] = kept, bound
