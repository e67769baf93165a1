"""Force and moment of the rails on wheelsets from Hertzian ellipses: detection, normal force, creepage, creep force."""

import math

from wrcore.contact.creepage import creepages
from wrcore.contact.hertz import loaded_ellipse
from wrcore.contact.rail_friction import friction_at
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
    """Return normal force (N), semi-axes a and b (m) of the Hertz ellipse, a/b and ln(a/b); see `normal_contact`."""
    return loaded_ellipse(
        model.hertz, model.shear_modulus / (1.0 - model.poisson_ratio), model.damping, model.damping_speed, penetration,
        curvature_x, curvature_y, approach_speed,
    )  # fmt: skip


@jit(allocates=False, fastmath=FUSED)
def normal_contact(model, penetration, curvature_x, curvature_y, approach_speed):
    """Return the normal force (N) by Eq. (7) and the semi-axes (m) of its Hertz ellipse."""
    force, a, b, _, _ = normal_ellipse(model, penetration, curvature_x, curvature_y, approach_speed)
    return force, a, b


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def patch_wrench(model, m, bend_y, bend_z, row, psi):
    """Force (N) and moment about the wheelset's centre (N m) of one patch, and whether the creep law's range was left.

    The curvatures ``bend_y`` and ``bend_z`` (1/m) of the rail's line are 0 if ``row`` already includes them. The shape
    number ``psi`` is 0 for an ellipse, see `wrcore.wheels.shaped_force`. Creep laws and tables are those of a wheel
    that rolls forward; a wheel that rolls backward is the mirror image of this with the opposite spin. Below the least
    speed, spin is scaled by v / (least speed), so that forces are continuous at standstill.
    """
    px, py, pz = row[reduction.X], row[reduction.Y] - m.y, row[reduction.Z] - m.z
    cosine, sine = row[reduction.COSINE], row[reduction.SINE]
    speed = max(abs(m.vx), model.least_speed)
    xi, eta, phi, approach = creepages(m.vx, m.vy, m.vz, m.wx, m.wy, m.wz, px, py, pz, cosine, sine, speed)
    row[reduction.CURVATURE_X] += 0.5 * (bend_y * sine - bend_z * cosine)  # rail bending away from the wheel
    normal, a, b, axis_ratio, log_axis_ratio = normal_ellipse(
        model, row[reduction.PENETRATION], row[reduction.CURVATURE_X], row[reduction.CURVATURE_Y], approach
    )
    friction = friction_at(model.friction_across, m.friction, cosine, m.side * sine)
    limit = falling(model, friction, xi, eta, speed) * normal
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
    """Force and moment of one patch as by `patch_wrench`, in axes inclined along the track as the rail under the patch.

    ``contact`` is the contact model of this wheel."""
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
    """Fill the forces and moments of the rails on all wheels, and the wheels' patches, in frames with x along the rail.

    A row of ``motions`` (k, 2, 15), left and right, is a `WheelMotion`. Fills ``patches`` (k, 2, MAX_PATCHES,
    PATCH_COLUMNS), in which rows beyond ``counts`` (k, 2) keep old content; ``bounds`` (k, 2) of the error of planar
    detection (m; detection AUTO only); ``wrenches`` (k, 2, 6), force (N) and moment about the wheelset's centre (N m).
    The ``mode`` is one of `wrcore.wheels.modes`; ``work`` is for patches on strips.

    The arithmetic of one wheel is a chain of dependent operations. One call for all wheels lets the processor overlap
    the chains of neighbouring wheels.
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
            if not held:  # patches of the last evaluation already include the rail's curvature
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
