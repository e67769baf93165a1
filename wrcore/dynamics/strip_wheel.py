"""Wrench of the rails on wheelsets with the real patch: contact on strips in place of an ellipse.

``exact`` solves the normal and the rolling problem on Galerkin strips; ``strips`` takes the shape-corrected virtual
penetration for the normal one and the creep law at the ellipse of equal moments of pressure. The rigid slip is that of
the wheel's over the rail's surface, strip by strip, or follows one set of creepages. Where strips do not converge a
uniform grid takes over (counted).

The damping factor acts as on an ellipse: the half-space sees the elastic approach c_d^(2/3) delta, and the wheel is
lifted along the contact normal by the rest.
"""

import math

import numpy as np

from wrcore.contact import reduction
from wrcore.contact.creepage import creepages
from wrcore.contact.detection import AUTO, SPATIAL, find_patches, planar_error_bound
from wrcore.contact.normal import damping_factor, inverse_cube_root
from wrcore.contact.patch.gap import creepage_slip, frame_of_overlaps, group_end, rigid_slip
from wrcore.contact.patch.grid import GridPatch, grid_normal, grid_rolling
from wrcore.contact.patch.rolling import AUTO as ANY_METHOD
from wrcore.contact.patch.rolling import rolling_force
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
    PEAK,
    WHEEL_HEIGHT,
    WIDTH,
    publish,
    solve_patch,
)  # fmt: skip
from wrcore.contact.patch.surfaces import ContactPlane, Motion, plane_slip, surface_slip
from wrcore.contact.patch.windows import MORE
from wrcore.contact.reduction import ANGLE, COSINE, MOMENT, PATCH_COLUMNS, PENETRATION, SINE, X, Y, Z
from wrcore.contact.strip import make_pose
from wrcore.creep.laws import creep_force_at
from wrcore.dynamics.wheel import FRICTION, contact_of, falling, wheel_wrenches
from wrcore.kernels.handles import call_address
from wrcore.kernels.jit import FUSED, jit

SLENDER = 3.0
"""Length over width from which strips get more panels along rolling."""

FELL_BACK = 2
"""Counter of patches that the grid has solved."""

FORCES, KEPT = 9, 12
"""What a solution gives in ``work.force``, and where it is kept while another one is found."""

GRID, GRID_TOLERANCE = 32, 1e-3
"""Elements along and across the patch of that grid, and the tolerance of its tractions."""


@jit
def solve_on_grid(model, motion, place):
    """Fallback: a patch on a uniform grid; a kernel of its own that may allocate.

    Parameters
    ----------
    model : ContactModel
    motion : numpy.ndarray, shape (MOTION_COLUMNS,)
    place : numpy.ndarray
        y and z of the wheelset (m), whether detection is spatial, the frame's cosine, sine, x, ur and z, and the
        creepages, and the coefficient of friction. Overwritten: Fx, Fs, Mn about the origin, N, means over the
        pressure of x and s, semi-axes of the ellipse of equal moments, greatest pressure.
    """
    side, y, z, cosine, sine = motion[0], place[0], place[1], place[3], motion[0] * place[4]
    pose = make_pose(side, y, z, side * motion[3], side * motion[4], side * motion[5], place[2] > 0.0)
    plane = ContactPlane(place[5], side * (place[6] + model.geometry.rail_distance), place[7], cosine, sine)
    modulus = model.shear_modulus / (1.0 - model.poisson_ratio)
    grid = grid_normal(model.geometry, pose, plane, modulus, GRID, GRID)
    wx, ws = np.empty(grid.gap.shape), np.empty(grid.gap.shape)
    if model.strips.surfaces == 0:
        plane_slip(place[8], place[9], place[10], grid.x, grid.s, wx, ws)
    else:
        speed = max(abs(motion[6]), model.least_speed)
        turning = Motion(motion[6], motion[7], motion[8], motion[9], motion[10], motion[11], speed)
        surface_slip(pose, plane, turning, grid.x, grid.s, grid.height, wx, ws)
    ahead, rolling = 1.0, grid
    if motion[6] < 0.0:  # rolling is always towards x: the mirror image of a wheel that rolls back
        ahead, x, pressure = -1.0, -grid.x[::-1].copy(), grid.pressure[::-1].copy()
        rolling = GridPatch(x, grid.s, grid.dx, grid.ds, grid.gap, grid.height, pressure)
        wx, ws = wx[::-1].copy(), -ws[::-1].copy()
    found = grid_rolling(rolling, wx, ws, place[11], model.shear_modulus, model.poisson_ratio, GRID_TOLERANCE)
    load = xm = sm = xx = ss = top = 0.0
    for i in range(grid.x.size):
        for j in range(grid.s.size):
            p = grid.pressure[i, j]
            load, top = load + p, max(top, p)
            xm, sm = xm + p * grid.x[i], sm + p * grid.s[j]
            xx, ss = xx + p * grid.x[i] ** 2, ss + p * grid.s[j] ** 2
    load = max(load, 1e-30)
    xm, sm = xm / load, sm / load
    place[0], place[1], place[2], place[3] = found.fx, ahead * found.fs, found.mn, load * grid.dx * grid.ds
    place[4], place[5], place[8] = xm, sm, top
    place[6] = math.sqrt(5.0 * max(xx / load - xm * xm, 1e-14))
    place[7] = math.sqrt(5.0 * max(ss / load - sm * sm, 1e-14))


@jit(allocates=False, fastmath=FUSED)
def _apply(frame, side, rail_distance, y, z, fx, fs, normal, mx, ms, mn, wrench):
    """Add a patch's force and its moment about the frame's origin (axes x, s, n) to a wheelset's wrench."""
    cosine, sine = frame.cosine, side * frame.sine
    px, py, pz = frame.x, side * (frame.ur + rail_distance) - y, frame.z - z
    gy, gz = fs * cosine - normal * sine, fs * sine + normal * cosine
    wrench[0] += fx
    wrench[1] += gy
    wrench[2] += gz
    wrench[3] += py * gz - pz * gy + mx
    wrench[4] += pz * fx - px * gz + ms * cosine - mn * sine
    wrench[5] += px * gy - py * fx + ms * sine + mn * cosine


@jit(allocates=False, fastmath=FUSED)
def _lifted(model, side, y, z, ex, ey, ez, spatial, u, rows):
    """Overlaps of a lifted wheel and, of its groups, the one nearest to wheel coordinate ``u``: (pose, first, last)."""
    pose = make_pose(side, y, z, ex, ey, ez, spatial)
    count = find_patches(model.geometry, side, y, z, ex, ey, ez, spatial, MOMENT, rows)
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
def _creep_by_law(model, friction, strips, slip, count, sums):
    """Creep force of the scene's law at the ellipse of equal moments: Fx, Fs, Mn about the origin, look-ups missed."""
    mean_x, mean_s = sums[MEAN_X], sums[MEAN_S]
    a = math.sqrt(5.0 * max(sums[MEAN_XX] - mean_x * mean_x, 1e-14))
    b = math.sqrt(5.0 * max(sums[MEAN_SS] - mean_s * mean_s, 1e-14))
    xi = eta = phi = 0.0
    for i in range(count):
        share = 0.5 * math.pi * strips[PEAK, i] * strips[HALF_LENGTH, i] * strips[WIDTH, i] / sums[LOAD]
        xi += share * slip[0, i]
        eta += share * (slip[2, i] + slip[3, i] * (mean_x - strips[MIDDLE, i]))
        phi += share * slip[3, i]
    limit, c = friction * sums[LOAD], math.sqrt(a * b)
    scale = model.shear_modulus * c * c / limit
    f1, f2, m3, missed = creep_force_at(
        model.law, model.creep, math.log(a / b), a / b, 0.0, xi * scale, eta * scale, phi * scale * c
    )
    fx, fs = limit * f1, limit * f2
    return fx, fs, limit * c * m3 + mean_x * fs - mean_s * fx, missed


@jit(allocates=False, fastmath=FUSED)
def _roll_at(model, friction, library, work, strips, slip, count):
    """Creep force on the strips at a library's resolution: Fx, Fs, Mn."""
    fx, fs, mn, _, _ = rolling_force(
        strips[CENTRE, :count], strips[WIDTH, :count], strips[HALF_LENGTH, :count], strips[MIDDLE, :count],
        strips[PEAK, :count], slip[0, :count], slip[1, :count], slip[2, :count], slip[3, :count],
        model.shear_modulus, friction, library, work, ANY_METHOD,
    )  # fmt: skip
    return fx, fs, mn


@jit(allocates=False, fastmath=FUSED)
def _roll(model, friction, settings, strips, slip, count, slender, windows, work):
    """Creep force on the strips with the library whose ellipses have as many."""
    if slender:
        return _roll_at(model, friction, settings.slender, work.slender, strips, slip, count)
    if windows == 1 and count == settings.wider.level.strips:
        return _roll_at(model, friction, settings.wider, work.rolling, strips, slip, count)
    if windows == 1 and count == settings.widest.level.strips:
        return _roll_at(model, friction, settings.widest, work.rolling, strips, slip, count)
    return _roll_at(model, friction, settings.library, work.rolling, strips, slip, count)


@jit(allocates=False)
def _mirror(strips, slip, sums, count):
    """Turn a patch round: x points back, and slips across change their sign, as forces across do."""
    sums[MEAN_X] = -sums[MEAN_X]
    for i in range(count):
        strips[MIDDLE, i], slip[1, i], slip[2, i] = -strips[MIDDLE, i], -slip[1, i], -slip[2, i]


@jit(allocates=False, fastmath=FUSED)
def _roll_patch(model, m, pose, frame, windows, creepage, speed, friction, counters, work):
    """Creep force on a solution of the normal problem; fills ``work.force`` as `solve_on_grid` does."""
    settings, strips, slip, sums, f = model.strips, work.strips, work.slip, work.sums, work.force
    modulus = model.shear_modulus / (1.0 - model.poisson_ratio)
    count = publish(model.geometry, pose, frame, modulus, work.normal, windows, strips, sums)
    mean_x, mean_s = sums[MEAN_X], sums[MEAN_S]
    if settings.surfaces == 0:
        xi, eta, phi = creepage
        creepage_slip(xi, eta, phi, strips[CENTRE, :count], strips[MIDDLE, :count], slip[:, :count])
    else:
        velocity = m[6], m[7], m[8], m[9], m[10], m[11], speed
        rigid_slip(
            model.geometry, pose, frame, velocity, strips[CENTRE, :count], strips[MIDDLE, :count],
            strips[WHEEL_HEIGHT, :count], slip[:, :count],
        )  # fmt: skip
    f[3], f[4], f[5], f[8] = sums[LOAD], mean_x, mean_s, sums[LARGEST]
    f[6] = a = math.sqrt(5.0 * max(sums[MEAN_XX] - mean_x * mean_x, 1e-14))
    f[7] = b = math.sqrt(5.0 * max(sums[MEAN_SS] - mean_s * mean_s, 1e-14))
    if m[6] < 0.0:  # rolling is always towards x
        _mirror(strips, slip, sums, count)
    if settings.rolling == 0:
        fx, fs, mn, missed = _creep_by_law(model, friction, strips, slip, count, sums)
        counters[1] += missed
    else:
        fx, fs, mn = _roll(model, friction, settings, strips, slip, count, a > SLENDER * b, windows, work)
    f[0], f[1], f[2] = fx, -fs if m[6] < 0.0 else fs, mn


@jit(allocates=False, fastmath=FUSED)
def _group_wrench(model, m, spatial, rows, first, last, out, wrench, counters, memory, work):
    """Solve the overlaps from ``first`` to before ``last`` as one patch: its row, its share of the wrench."""
    settings = model.strips
    side, y, z = m[0], m[1], m[2]
    ex, ey, ez = side * m[3], side * m[4], side * m[5]
    speed = max(abs(m[6]), model.least_speed)
    pose = make_pose(side, y, z, ex, ey, ez, spatial)
    frame = frame_of_overlaps(model.geometry, pose, rows, first, last)
    depth, u = 0.0, 0.0
    for k in range(first, last):
        if rows[k, PENETRATION] > depth:
            depth, u = rows[k, PENETRATION], rows[k, reduction.U_WHEEL]
            for column in range(PATCH_COLUMNS):
                out[column] = rows[k, column]
    # a material point of the undeformed wheel, as the surfaces' slip has it
    py = side * (frame.ur + model.geometry.rail_distance) + depth * side * frame.sine - y
    pz = frame.z - depth * frame.cosine - z
    xi, eta, phi, approach = creepages(
        m[6], m[7], m[8], m[9], m[10], m[11], frame.x, py, pz, frame.cosine, side * frame.sine, speed
    )
    friction = falling(model, m[FRICTION], xi, eta, speed)
    factor = damping_factor(approach, model.damping, model.damping_speed)
    lift = (1.0 - factor * inverse_cube_root(factor)) * depth
    windows = 0
    if lift < depth:
        pose, low, high = _lifted(
            model, side, y - lift * side * frame.sine, z + lift * frame.cosine, ex, ey, ez, spatial, u, work.rows
        )
        if high == low:
            out[reduction.NORMAL] = 0.0
            return
        windows, frame = solve_patch(
            model.geometry, pose, model.hertz, settings.values, work.rows, low, high, settings.strips, settings.normal,
            memory, work.normal,
        )  # fmt: skip
    f = work.force
    if windows == 0:
        counters[FELL_BACK] += 1
        f[0], f[1], f[2] = y - lift * side * frame.sine, z + lift * frame.cosine, 1.0 if spatial else 0.0
        f[3], f[4], f[5], f[6], f[7] = frame.cosine, frame.sine, frame.x, frame.ur, frame.z
        f[8], f[9], f[10], f[11] = xi, eta, phi, friction
        call_address(settings.fallback, model, m, f)
    else:
        more = work.normal.more
        share = more[1]
        _roll_patch(model, m, pose, frame, windows, (xi, eta, phi), speed, friction, counters, work)
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
                _roll_patch(model, m, pose, frame, windows, (xi, eta, phi), speed, friction, counters, work)
                for k in range(FORCES):
                    f[k] = (1.0 - share) * f[KEPT + k] + share * f[k]
    fx, fs, mn, normal, mean_x, mean_s, a, b, top = f[0], f[1], f[2], f[3], f[4], f[5], f[6], f[7], f[8]
    cosine, sine = frame.cosine, side * frame.sine
    out[ANGLE], out[COSINE], out[SINE] = math.atan2(sine, cosine), cosine, sine
    out[X] = frame.x + mean_x
    out[Y] = side * (frame.ur + model.geometry.rail_distance) + mean_s * cosine
    out[Z] = frame.z + mean_s * sine
    out[reduction.SEMI_A], out[reduction.SEMI_B], out[reduction.NORMAL] = a, b, normal
    out[reduction.FX], out[reduction.FY], out[reduction.MZ] = fx, fs, mn + mean_s * fx - mean_x * fs
    out[reduction.XI], out[reduction.ETA], out[reduction.PHI] = xi - phi * mean_s, eta + phi * mean_x, phi
    out[reduction.P_MAX] = top
    _apply(
        frame, side, model.geometry.rail_distance, y, z, fx, fs, normal, mean_s * normal, -mean_x * normal, mn, wrench
    )


@jit(allocates=False, fastmath=FUSED)
def strip_wrenches(model, motions, patches, counts, bounds, wrenches, counters, work):
    """As `wheel_wrenches`, with patches on strips; arguments as there.

    While ``work.cheap[0]`` is set the ellipse of equal moments of the overlap stands in: a Jacobian by differences
    wants a smooth neighbour of the model, not the model.
    """
    if work.cheap[0] != 0:
        wheel_wrenches(model, motions, patches, counts, bounds, wrenches, counters, work)
        return
    for i in range(motions.shape[0]):
        for wheel in range(2):
            m, rows, w = motions[i, wheel], patches[i, wheel], wrenches[i, wheel]
            own = contact_of(model, i, wheel)
            side, ex, ey, ez = m[0], m[3], m[4], m[5]
            bound, spatial = 0.0, model.detection == SPATIAL
            if model.detection == AUTO:
                bound = planar_error_bound(own.geometry, side, m[1], m[2], side * ex, side * ey, side * ez)
                spatial = bound > model.detection_tolerance
            count = find_patches(own.geometry, side, m[1], m[2], side * ex, side * ey, side * ez, spatial, MOMENT, rows)
            for k in range(6):
                w[k] = 0.0
            first = kept = group = 0
            while first < count:
                last = group_end(rows, count, first)
                memory = work.memory[i, wheel, group] if work.warm[0] else work.spare
                work.spare[0] = 0.0
                _group_wrench(own, m, spatial, rows, first, last, work.out, w, counters, memory, work)
                group += 1
                if work.out[reduction.NORMAL] > 0.0:
                    for column in range(PATCH_COLUMNS):
                        rows[kept, column] = work.out[column]
                    kept += 1
                first = last
            counts[i, wheel], bounds[i, wheel] = kept, bound
