"""Wrench of the rails on a wheelset: detection, Hertz, creepages and creep force put together."""

import math

from wrcore.contact.creepage import creepages
from wrcore.contact.hertz import loaded_ellipse
from wrcore.contact.search import reduction
from wrcore.contact.search.strip import changes_along, lean_at, leaning, upright
from wrcore.creep.laws import creep_force_at
from wrcore.kernels.jit import FUSED, jit
from wrcore.wheels.contact_model import OUT_OF_RANGE, contact_of
from wrcore.wheels.force import detect_patches, falling, leaning_motion
from wrcore.wheels.modes import FRESH, PATCHES_HELD, PATCHES_ONLY
from wrcore.wheels.motion import MOTION, motion_of


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def normal_ellipse(model, penetration, curvature_x, curvature_y, approach_speed):
    """`normal_contact`, and a/b and its logarithm."""
    return loaded_ellipse(
        model.hertz, model.shear_modulus / (1.0 - model.poisson_ratio), model.damping, model.damping_speed, penetration,
        curvature_x, curvature_y, approach_speed,
    )  # fmt: skip


@jit(allocates=False, fastmath=FUSED)
def normal_contact(model, penetration, curvature_x, curvature_y, approach_speed):
    """Normal force (N) by Eq. (7) and the semi-axes (m) of the Hertz ellipse that carries it."""
    force, a, b, _, _ = normal_ellipse(model, penetration, curvature_x, curvature_y, approach_speed)
    return force, a, b


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def patch_wrench(model, m, bend_y, bend_z, row, psi):
    """Wrench of one patch about the wheelset's centre, and whether the creep law's range was left.

    The rail bends by the curvatures ``bend_y`` and ``bend_z``, if the patch does not know yet; ``psi`` is its shape
    number, 0 for an ellipse; see `wrcore.wheels.shaped_force`. Creep laws and tables are
    those of a wheel that rolls forward; one that rolls back is the mirror image of one that rolls forward with the
    opposite spin. Below the least speed spin goes to and fro through zero, so that nothing jumps at standstill.
    """
    px, py, pz = row[reduction.X], row[reduction.Y] - m.y, row[reduction.Z] - m.z
    cosine, sine = row[reduction.COSINE], row[reduction.SINE]
    speed = max(abs(m.vx), model.least_speed)
    xi, eta, phi, approach = creepages(m.vx, m.vy, m.vz, m.wx, m.wy, m.wz, px, py, pz, cosine, sine, speed)
    row[reduction.CURVATURE_X] += 0.5 * (bend_y * sine - bend_z * cosine)  # rail bending away from the wheel
    normal, a, b, axis_ratio, log_axis_ratio = normal_ellipse(
        model, row[reduction.PENETRATION], row[reduction.CURVATURE_X], row[reduction.CURVATURE_Y], approach
    )
    limit = falling(model, m.friction, xi, eta, speed) * normal
    forward = 1.0 if m.vx >= speed else m.vx / speed
    square = a * b
    c = math.sqrt(square)
    scale, aside = model.shear_modulus * square / limit, 0.25 * psi * b
    f1, f2, m3, missed = creep_force_at(
        model.law, model.creep, log_axis_ratio, axis_ratio, forward * psi if psi != 0.0 else 0.0,
        (xi - phi * aside) * scale, eta * scale, forward * phi * scale * c,
    )  # fmt: skip
    f1, f2, m3 = limit * f1, limit * f2, forward * limit * c * m3
    m3 -= aside * f1
    gy, gz = f2 * cosine - normal * sine, f2 * sine + normal * cosine
    row[reduction.SEMI_A], row[reduction.SEMI_B], row[reduction.NORMAL] = a, b, normal
    row[reduction.FX], row[reduction.FY], row[reduction.MZ] = f1, f2, m3
    row[reduction.XI], row[reduction.ETA], row[reduction.PHI] = xi, eta, phi
    mx, my, mz = py * gz - pz * gy, pz * f1 - px * gz - m3 * sine, px * gy - py * f1 + m3 * cosine
    return f1, gy, gz, mx, my, mz, missed


@jit(allocates=False, forceinline=True)
def leaning_wrench(contact, m, bend_y, bend_z, row, psi):
    """As `patch_wrench`, of a wheel's own contact model, with a patch that leans as the rail does under it."""
    if not changes_along(contact.geometry):
        return patch_wrench(contact, m, bend_y, bend_z, row, psi)
    x, z = row[reduction.X], row[reduction.Z]
    lean = lean_at(contact.geometry, row[reduction.U_RAIL], z - m.z)
    px, pz = leaning(contact.geometry, lean, x, z - m.z)
    row[reduction.X], row[reduction.Z] = px, pz + m.z
    moving = leaning_motion(contact.geometry, m, lean)
    fx, fy, fz, mx, my, mz, missed = patch_wrench(contact, moving, bend_y, bend_z, row, psi)
    row[reduction.X], row[reduction.Z] = x, z
    fx, fz = upright(contact.geometry, lean, fx, fz)
    mx, mz = upright(contact.geometry, lean, mx, mz)
    return fx, fy, fz, mx, my, mz, missed


@jit(allocates=False, fastmath=FUSED)
def wheel_wrenches(model, motions, patches, counts, bounds, wrenches, counters, work, mode=FRESH):
    """Force and moment of the rails on all wheels, and the wheels' patches, in frames in which the rail runs along x.

    A row of ``motions`` (k, 2, 15), left and right, is a `WheelMotion`. Fills ``patches`` (k, 2, MAX_PATCHES,
    PATCH_COLUMNS), rows beyond their ``counts`` keep old content; AUTO's ``bounds`` of planar detection's error (m);
    ``wrenches`` (k, 2, 6), force (N) and moment about the wheelset's centre (N m). The ``mode`` is one of
    `wrcore.wheels.modes`; ``work`` is for patches on strips.

    One wheel's arithmetic is a chain in which each step waits for the one before: with all wheels in one call the
    chains of neighbours overlap.
    """
    held = mode & PATCHES_HELD
    if not held:
        for i in range(motions.shape[0]):
            for wheel in range(2):
                m, contact = motion_of(motions[i, wheel]), contact_of(model, i, wheel)
                count, bound, _ = detect_patches(contact, m, patches[i, wheel])
                counts[i, wheel], bounds[i, wheel] = count, bound
    if mode & PATCHES_ONLY:
        return
    for i in range(motions.shape[0]):
        for wheel in range(2):
            row, wrench, bend_y, bend_z = motions[i, wheel], wrenches[i, wheel], 0.0, 0.0
            if not held:  # else the patches have it already
                bend_y, bend_z = row[MOTION.bend_y], row[MOTION.bend_z]
            fx = fy = fz = mx = my = mz = 0.0
            for k in range(counts[i, wheel]):
                gx, gy, gz, nx, ny, nz, missed = leaning_wrench(
                    contact_of(model, i, wheel), motion_of(row), bend_y, bend_z, patches[i, wheel, k], 0.0
                )
                fx, fy, fz = fx + gx, fy + gy, fz + gz
                mx, my, mz = mx + nx, my + ny, mz + nz
                counters[OUT_OF_RANGE] += missed
            wrench[0], wrench[1], wrench[2], wrench[3], wrench[4], wrench[5] = fx, fy, fz, mx, my, mz
