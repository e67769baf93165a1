"""Wrench of the rails on wheelsets with the real patch: contact on strips in place of an ellipse.

``exact`` solves the normal and the rolling problem on Galerkin strips; ``strips`` takes the shape-corrected virtual
penetration for the normal one and the creep law at the ellipse of equal moments of pressure. The rigid slip is that of
the wheel's over the rail's surface, strip by strip, or follows one set of creepages. Where strips do not converge a
uniform grid takes over (counted).

Pressure and friction act in each strip's own plane, on the wheel's material points, where the slip is taken: friction
takes from the wheelset what it dissipates. A right wheel is solved as the mirror image of a left one: no choice can
tell them apart.

The damping factor acts as on an ellipse: the half-space sees the elastic approach c_d^(2/3) delta, and the wheel is
lifted along the contact normal by the rest.
"""

import math

import numpy as np

from wrcore.contact import reduction
from wrcore.contact.creepage import creepages
from wrcore.contact.detection import AUTO, SPATIAL, find_patches, planar_error_bound
from wrcore.contact.normal import damping_factor, inverse_cube_root
from wrcore.contact.patch.gap import frame_of_overlaps, group_end, rigid_slip
from wrcore.contact.patch.gap import strip_wrenches as wrenches_of_strips
from wrcore.contact.patch.grid import GridPatch, grid_normal, grid_rolling
from wrcore.contact.patch.rolling import AUTO as ANY_METHOD
from wrcore.contact.patch.rolling import read_forces, rolling_force
from wrcore.contact.patch.solve import (
    CENTRE,
    HALF_LENGTH,
    LARGEST,
    LOAD,
    MEAN_S,
    MEAN_SS,
    MEAN_X,
    MEAN_XX,
    MIDDLE,
    OWN_PLACE,
    OWN_WIDTH,
    PEAK,
    STRIP_LOAD,
    STRIP_TILT,
    WHEEL_HEIGHT,
    publish,
    solve_patch,
)  # fmt: skip
from wrcore.contact.patch.surfaces import ContactPlane, Motion, plane_slip, strip_planes, surface_slip
from wrcore.contact.patch.windows import MORE
from wrcore.contact.reduction import (
    ANGLE,
    COSINE,
    ETA,
    FX,
    FY,
    MOMENT,
    MZ,
    NORMAL,
    PATCH_COLUMNS,
    PENETRATION,
    PHI,
    S_WHEEL,
    SINE,
    XI,
    X,
    Y,
    Z,
)  # fmt: skip
from wrcore.contact.strip import make_pose
from wrcore.creep.laws import creep_force_at
from wrcore.dynamics.modes import ELLIPSES, FRESH, WARM
from wrcore.dynamics.wheel import FRICTION, contact_of, falling, wheel_wrenches
from wrcore.kernels.handles import call_address
from wrcore.kernels.jit import FUSED, jit

SLENDER = 3.0
"""Length over width from which strips get more panels along rolling."""

FELL_BACK = 2
"""Counter of patches that the grid has solved."""

FORCES, KEPT = 10, 12
"""What a solution gives in ``work.force``, and where it is kept while another one is found: mean creepages, normal
force, means over the pressure of x and s, semi-axes of the ellipse of equal moments, greatest pressure, and the power
of friction over V."""

GRID, GRID_TOLERANCE = 32, 1e-3
"""Elements along and across the patch of that grid, and the tolerance of its tractions."""


@jit
def solve_on_grid(model, motion, place):
    """Fallback: a patch on a uniform grid; a kernel of its own that may allocate. ``motion`` is a left wheel's.

    ``place``: y and z of the wheelset (m), whether detection is spatial, the frame's cosine, sine, x, ur and z, the
    creepages, the coefficient of friction. Overwritten: Fx, Fs, Mn about the origin, N, means over the pressure of x
    and s, semi-axes of the ellipse of equal moments, greatest pressure, mean slope of the strips.
    """
    y, z, cosine, sine = place[0], place[1], place[3], place[4]
    pose = make_pose(1.0, y, z, motion[3], motion[4], motion[5], place[2] > 0.0)
    plane = ContactPlane(place[5], place[6] + model.geometry.rail_distance, place[7], cosine, sine)
    modulus = model.shear_modulus / (1.0 - model.poisson_ratio)
    grid = grid_normal(model.geometry, pose, plane, modulus, GRID, GRID)
    wx, ws = np.empty(grid.gap.shape), np.empty(grid.gap.shape)
    low, tilt = strip_planes(grid.s, grid.gap, grid.height)
    if model.strips.surfaces == 0:
        plane_slip(place[8], place[9], place[10], grid.x, grid.s, wx, ws)
    else:
        speed = max(abs(motion[6]), model.least_speed)
        turning = Motion(motion[6], motion[7], motion[8], motion[9], motion[10], motion[11], speed)
        surface_slip(pose, plane, turning, grid.x, grid.s, low, tilt, wx, ws)
    ahead, rolling = 1.0, grid
    if motion[6] < 0.0:  # rolling is always towards x: the mirror image of a wheel that rolls back
        ahead, x, pressure = -1.0, -grid.x[::-1].copy(), grid.pressure[::-1].copy()
        rolling = GridPatch(x, grid.s, grid.dx, grid.ds, grid.gap, grid.height, pressure)
        wx, ws = wx[::-1].copy(), -ws[::-1].copy()
    found = grid_rolling(rolling, wx, ws, place[11], model.shear_modulus, model.poisson_ratio, GRID_TOLERANCE)
    load = xm = sm = xx = ss = top = rise = 0.0
    for i in range(grid.x.size):
        for j in range(grid.s.size):
            p = grid.pressure[i, j]
            load, top = load + p, max(top, p)
            xm, sm = xm + p * grid.x[i], sm + p * grid.s[j]
            xx, ss, rise = xx + p * grid.x[i] ** 2, ss + p * grid.s[j] ** 2, rise + p * tilt[j]
    load = max(load, 1e-30)
    xm, sm = xm / load, sm / load
    place[0], place[1], place[2], place[3] = found.fx, ahead * found.fs, found.mn, load * grid.dx * grid.ds
    place[4], place[5], place[8], place[9] = xm, sm, top, rise / load
    place[6] = math.sqrt(5.0 * max(xx / load - xm * xm, 1e-14))
    place[7] = math.sqrt(5.0 * max(ss / load - sm * sm, 1e-14))


@jit(allocates=False, fastmath=FUSED)
def _lifted(model, y, z, ex, ey, ez, spatial, u, rows):
    """Overlaps of a lifted wheel and, of its groups, the one nearest to wheel coordinate ``u``: (pose, first, last)."""
    pose = make_pose(1.0, y, z, ex, ey, ez, spatial)
    count = find_patches(model.geometry, 1.0, y, z, ex, ey, ez, spatial, MOMENT, rows)
    best, low, high, first = 1e9, 0, 0, 0
    while first < count:
        last = group_end(rows, count, first)
        for k in range(first, last):
            distance = abs(rows[k, reduction.U_WHEEL] - u)
            if distance < best:
                best, low, high = distance, first, last
        first = last
    return pose, low, high


@jit(allocates=False, fastmath=FUSED)
def _creep_by_law(model, limit, f, strips, slip, force, count):
    """Creep force of the scene's law at the ellipse of equal moments, spread as the pressure; look-ups missed."""
    a, b = f[6], f[7]
    c = math.sqrt(a * b)
    scale = model.shear_modulus * c * c / limit
    f1, f2, m3, missed = creep_force_at(
        model.law, model.creep, math.log(a / b), a / b, 0.0, f[0] * scale, f[1] * scale, f[2] * scale * c
    )
    for i in range(count):
        share = strips[STRIP_LOAD, i] / f[3] * limit
        force[0, i], force[1, i] = share * f1, share * f2
        force[2, i] = share * (c * m3 + (f[4] - strips[MIDDLE, i]) * f2)
    return missed


@jit(allocates=False, fastmath=FUSED)
def _roll_at(model, friction, library, work, strips, slip, force, count):
    """Creep force on the strips at a library's resolution."""
    rolling_force(
        strips[OWN_PLACE, :count], strips[OWN_WIDTH, :count], strips[HALF_LENGTH, :count], strips[MIDDLE, :count],
        strips[PEAK, :count], slip[0, :count], slip[1, :count], slip[2, :count], slip[3, :count],
        model.shear_modulus, friction, library, work, ANY_METHOD,
    )  # fmt: skip
    read_forces(count, work, force)


@jit(allocates=False, fastmath=FUSED)
def _roll(model, friction, settings, strips, slip, force, count, slender, windows, work):
    """Creep force on the strips with the library whose ellipses have as many."""
    library = settings.library
    if slender:
        _roll_at(model, friction, settings.slender, work.slender, strips, slip, force, count)
    elif windows == 1 and count == settings.wider.level.strips:
        _roll_at(model, friction, settings.wider, work.rolling, strips, slip, force, count)
    elif windows == 1 and count == settings.widest.level.strips:
        _roll_at(model, friction, settings.widest, work.rolling, strips, slip, force, count)
    else:
        _roll_at(model, friction, library, work.rolling, strips, slip, force, count)


@jit(allocates=False)
def _turn_round(strips, slip, force, f, count):
    """Turn a patch round: x points back, and slips and forces across change their sign."""
    f[1], f[4] = -f[1], -f[4]
    for i in range(count):
        strips[MIDDLE, i], slip[1, i], slip[2, i] = -strips[MIDDLE, i], -slip[1, i], -slip[2, i]
        force[1, i] = -force[1, i]


@jit(allocates=False, fastmath=FUSED)
def _mean_slip(strips, slip, f, count):
    """Creepages at the pressure's centroid into the first of ``f``: means of the rigid slip over the pressure."""
    f[0] = f[1] = f[2] = 0.0
    for i in range(count):
        share = strips[STRIP_LOAD, i] / f[3]
        f[0] += share * slip[0, i]
        f[1] += share * (slip[2, i] + slip[3, i] * (f[4] - strips[MIDDLE, i]))
        f[2] += share * slip[3, i]


@jit(allocates=False, fastmath=FUSED)
def _add_wrenches(geometry, pose, frame, count, share, work):
    """Add ``share`` of what acts on the strips to ``work.wrench``; the power of friction over V into ``work.force``."""
    strips, slip, force = work.strips, work.slip, work.friction
    wrenches_of_strips(
        geometry, pose, frame, strips[CENTRE, :count], strips[MIDDLE, :count], strips[WHEEL_HEIGHT, :count],
        strips[STRIP_TILT, :count], strips[STRIP_LOAD, :count], force, share, work.wrench[0], work.wrench[1],
    )  # fmt: skip
    power = 0.0
    for i in range(count):
        power += force[0, i] * slip[0, i] + force[1, i] * slip[2, i] + force[2, i] * slip[3, i]
    work.force[9] = power


@jit(allocates=False, fastmath=FUSED)
def _roll_patch(model, m, pose, frame, windows, depth, speed, friction, share, counters, work):
    """Friction on a solution of the normal problem; fills ``work.force``, and adds to ``work.wrench``."""
    settings, strips, slip, sums, f = model.strips, work.strips, work.slip, work.sums, work.force
    count = publish(model.shear_modulus / (1.0 - model.poisson_ratio), work.normal, windows, strips, sums)
    f[3], f[4], f[5], f[8] = sums[LOAD], sums[MEAN_X], sums[MEAN_S], sums[LARGEST]
    if settings.surfaces == 0:  # one set of creepages is the slip of a plane, where the undeformed wheel is deepest
        tilt = 0.0
        for i in range(count):
            tilt += strips[STRIP_LOAD, i] / f[3] * strips[STRIP_TILT, i]
        for i in range(count):
            strips[WHEEL_HEIGHT, i], strips[STRIP_TILT, i] = tilt * (strips[CENTRE, i] - f[5]) - depth, tilt
    velocity = m[6], m[7], m[8], m[9], m[10], m[11], speed
    rigid_slip(
        model.geometry, pose, frame, velocity, strips[CENTRE, :count], strips[MIDDLE, :count],
        strips[WHEEL_HEIGHT, :count], strips[STRIP_TILT, :count], slip[:, :count],
    )  # fmt: skip
    f[6] = math.sqrt(5.0 * max(sums[MEAN_XX] - f[4] * f[4], 1e-14))
    f[7] = math.sqrt(5.0 * max(sums[MEAN_SS] - f[5] * f[5], 1e-14))
    _mean_slip(strips, slip, f, count)
    if m[6] < 0.0:  # rolling is always towards x
        _turn_round(strips, slip, work.friction, f, count)
    if settings.rolling == 0:
        counters[1] += _creep_by_law(model, friction * f[3], f, strips, slip, work.friction, count)
    else:
        work.solved[0], work.solved[1] = count, f[6] > SLENDER * f[7]
        _roll(model, friction, settings, strips, slip, work.friction, count, work.solved[1] == 1, windows, work)
    if m[6] < 0.0:
        _turn_round(strips, slip, work.friction, f, count)
    _add_wrenches(model.geometry, pose, frame, count, share, work)


@jit(allocates=False, fastmath=FUSED)
def _roll_on_grid(model, m, pose, frame, spatial, depth, creepage, friction, work):
    """As `_roll_patch`, on a grid: it acts on one strip at the pressure's centroid."""
    f, strips, slip = work.force, work.strips, work.slip
    f[0], f[1], f[2] = pose.y, pose.z, 1.0 if spatial else 0.0
    f[3], f[4], f[5], f[6], f[7] = frame.cosine, frame.sine, frame.x, frame.ur, frame.z
    f[8], f[9], f[10] = creepage
    f[11] = friction
    call_address(model.strips.fallback, model, m, f)
    xi, eta, phi = creepage
    strips[CENTRE, 0], strips[MIDDLE, 0], strips[WHEEL_HEIGHT, 0] = f[5], f[4], -depth
    strips[STRIP_TILT, 0], strips[STRIP_LOAD, 0] = f[9], f[3]
    work.friction[0, 0], work.friction[1, 0], work.friction[2, 0] = f[0], f[1], f[2] - f[4] * f[1] + f[5] * f[0]
    f[0], f[1], f[2] = slip[0, 0], slip[2, 0], slip[3, 0] = xi - phi * f[5], eta + phi * f[4], phi
    _add_wrenches(model.geometry, pose, frame, 1, 1.0, work)


@jit(allocates=False, fastmath=FUSED)
def group_wrench(model, m, spatial, rows, first, last, out, wrench, counters, memory, work):
    """Solve the overlaps from ``first`` to before ``last`` as one patch: its row, its share of the wrench."""
    settings, y, z = model.strips, m[1], m[2]
    speed = max(abs(m[6]), model.least_speed)
    pose = make_pose(1.0, y, z, m[3], m[4], m[5], spatial)
    frame = frame_of_overlaps(model.geometry, pose, rows, first, last)
    depth, u = 0.0, 0.0
    for k in range(first, last):
        if rows[k, PENETRATION] > depth:
            depth, u = rows[k, PENETRATION], rows[k, reduction.U_WHEEL]
            for column in range(PATCH_COLUMNS):
                out[column] = rows[k, column]
    # a material point of the undeformed wheel, as the surfaces' slip has it
    py = frame.ur + model.geometry.rail_distance + depth * frame.sine - y
    pz = frame.z - depth * frame.cosine - z
    xi, eta, phi, approach = creepages(
        m[6], m[7], m[8], m[9], m[10], m[11], frame.x, py, pz, frame.cosine, frame.sine, speed
    )
    friction = falling(model, m[FRICTION], xi, eta, speed)
    factor = damping_factor(approach, model.damping, model.damping_speed)
    lift = (1.0 - factor * inverse_cube_root(factor)) * depth
    windows = 0
    if lift < depth:
        pose, low, high = _lifted(
            model, y - lift * frame.sine, z + lift * frame.cosine, m[3], m[4], m[5], spatial, u, work.rows
        )
        if high == low:
            out[NORMAL] = 0.0
            return
        windows, frame = solve_patch(
            model.geometry, pose, model.hertz, settings.values, work.rows, low, high, settings.strips, settings.normal,
            memory, work.normal,
        )  # fmt: skip
    f = work.force
    for k in range(6):
        work.wrench[0, k] = work.wrench[1, k] = 0.0
    if windows == 0:
        counters[FELL_BACK] += 1
        _roll_on_grid(model, m, pose, frame, spatial, depth - lift, (xi, eta, phi), friction, work)
    else:
        more = work.normal.more
        share = more[1]
        _roll_patch(model, m, pose, frame, windows, depth - lift, speed, friction, 1.0, counters, work)
        if share > 0.0:  # the mean with more strips
            for k in range(FORCES):
                f[KEPT + k] = f[k]
            more[0] = MORE
            windows, frame = solve_patch(
                model.geometry, pose, model.hertz, settings.values, work.rows, low, high, settings.strips,
                settings.normal, memory, work.normal,
            )  # fmt: skip
            more[0] = 1.0
            if windows > 0:
                for k in range(6):
                    work.wrench[0, k] *= 1.0 - share
                    work.wrench[1, k] *= 1.0 - share
                _roll_patch(model, m, pose, frame, windows, depth - lift, speed, friction, share, counters, work)
                for k in range(FORCES):
                    f[k] = (1.0 - share) * f[KEPT + k] + share * f[k]
    _fill_row(frame, frame.ur + model.geometry.rail_distance - y, frame.z - z, f, work.wrench, out)
    out[Y], out[Z] = out[Y] + y, out[Z] + z
    for k in range(6):
        wrench[k] += work.wrench[0, k] + work.wrench[1, k]


@jit(allocates=False, fastmath=FUSED)
def _fill_row(frame, y, z, f, wrenches, out):
    """Row of a patch about the pressure's centroid, from the wrenches of pressure and friction.

    The pressure's resultant is the normal; the force along it holds what friction in the strips' planes has there.
    Creepages are the means of the rigid slip, moved by the least with which the forces do on them what friction does on
    the slip. ``y``, ``z``: of the frame's origin from the wheelset's centre.
    """
    pressure, friction, a, b = wrenches[0], wrenches[1], f[6], f[7]
    normal = math.sqrt(pressure[1] * pressure[1] + pressure[2] * pressure[2])
    cosine, sine = pressure[2] / normal, -pressure[1] / normal
    px, py, pz = frame.x + f[4], y + f[5] * frame.cosine, z + f[5] * frame.sine
    fx, fy, fz = friction[0], friction[1], friction[2]
    fs = fy * cosine + fz * sine
    turn_y, turn_z = friction[4] - pz * fx + px * fz, friction[5] - px * fy + py * fx
    mn = turn_z * cosine - turn_y * sine
    out[ANGLE], out[COSINE], out[SINE] = math.atan2(sine, cosine), cosine, sine
    out[X], out[Y], out[Z] = px, py, pz
    out[reduction.SEMI_A], out[reduction.SEMI_B], out[NORMAL] = a, b, normal + fz * cosine - fy * sine
    out[FX], out[FY], out[MZ] = fx, fs, mn
    size = fx * fx + fs * fs + mn * mn / (a * b)
    rest = (f[9] - fx * f[0] - fs * f[1] - mn * f[2]) / size if size > 0.0 else 0.0
    out[XI], out[ETA], out[PHI] = f[0] + rest * fx, f[1] + rest * fs, f[2] + rest * mn / (a * b)
    out[reduction.P_MAX] = f[8]


@jit(allocates=False)
def _as_left(motion, left):
    """Motion of a wheel as that of a left one, its mirror image if it is a right one."""
    for k in range(len(left)):
        left[k] = motion[k]
    if motion[0] < 0.0:
        left[0] = 1.0
        for k in (1, 3, 5, 7, 9, 11, 12):  # y; axle to the left along x, z; vy; wx, wz; curvature towards y
            left[k] = -motion[k]


@jit(allocates=False)
def mirror(rows, count, wrench):
    """Patches and wrench of a left wheel as those of a right one."""
    for k in (1, 3, 5):
        wrench[k] = -wrench[k]
    for i in range(count):
        for column in (S_WHEEL, Y, ANGLE, SINE, FY, MZ, ETA, PHI):
            rows[i, column] = -rows[i, column]


@jit(allocates=False, fastmath=FUSED)
def strip_wrenches(model, motions, patches, counts, bounds, wrenches, counters, work, mode=FRESH):
    """As `wheel_wrenches`, with patches on strips; arguments as there."""
    if mode & ELLIPSES:
        wheel_wrenches(model, motions, patches, counts, bounds, wrenches, counters, work, mode)
        return
    m = work.motion
    for i in range(motions.shape[0]):
        for wheel in range(2):
            rows, w, own = patches[i, wheel], wrenches[i, wheel], contact_of(model, i, wheel)
            _as_left(motions[i, wheel], m)
            bound, spatial = 0.0, model.detection == SPATIAL
            if model.detection == AUTO:
                bound = planar_error_bound(own.geometry, 1.0, m[1], m[2], m[3], m[4], m[5])
                spatial = bound > model.detection_tolerance
            count = find_patches(own.geometry, 1.0, m[1], m[2], m[3], m[4], m[5], spatial, MOMENT, rows)
            for k in range(6):
                w[k] = 0.0
            first = kept = group = 0
            while first < count:
                last = group_end(rows, count, first)
                memory = work.memory[i, wheel, group] if mode & WARM else work.spare
                work.spare[0] = 0.0
                group_wrench(own, m, spatial, rows, first, last, work.out, w, counters, memory, work)
                group += 1
                if work.out[NORMAL] > 0.0:
                    for column in range(PATCH_COLUMNS):
                        rows[kept, column] = work.out[column]
                    kept += 1
                first = last
            if motions[i, wheel, 0] < 0.0:
                mirror(rows, kept, w)
            counts[i, wheel], bounds[i, wheel] = kept, bound
