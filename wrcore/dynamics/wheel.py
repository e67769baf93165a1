"""Wrench of the rails on a wheelset: detection, Hertz, creepages and creep force put together."""

import math
from typing import NamedTuple

from wrcore.contact.creepage import creepages
from wrcore.contact.detection import AUTO, SPATIAL, find_patches, planar_error_bound
from wrcore.contact.geometry import ContactGeometry
from wrcore.contact.normal import HertzTable, damping_factor, hertz_shape_at, inverse_cube_root
from wrcore.contact.patch.model import StripModel
from wrcore.contact.reduction import (
    COSINE,
    CURVATURE_X,
    CURVATURE_Y,
    ETA,
    FX,
    FY,
    MZ,
    NORMAL,
    PENETRATION,
    PHI,
    SEMI_A,
    SEMI_B,
    SINE,
    XI,
    X,
    Y,
    Z,
)
from wrcore.creep.laws import LAWS, CreepData, creep_force_at
from wrcore.dynamics.modes import FRESH, PATCHES_HELD
from wrcore.kernels.handles import member_of
from wrcore.kernels.jit import FUSED, jit

MOTION_COLUMNS = 15
FRICTION = 14
"""Column of a wheel's motion with the coefficient of friction of the rail under it."""


class ContactModel(NamedTuple):
    """Everything that turns a wheelset's motion into contact forces, for kernels."""

    geometry: ContactGeometry
    hertz: HertzTable
    law: int
    """Creep law, see wrcore.creep.laws.LAWS."""
    creep: CreepData
    detection: int
    """PLANAR, SPATIAL or AUTO of wrcore.contact.detection."""
    detection_tolerance: float
    """AUTO: normal penetration that planar detection may miss, m."""
    reduction: int
    """MAXIMUM or MOMENT of wrcore.contact.reduction."""
    shear_modulus: float
    """G, Pa."""
    poisson_ratio: float
    friction: float
    """Coulomb's mu at no slip; of rails that differ, or along which it changes, the largest one."""
    damping: float
    """c_e of Eq. (7)'s damping factor; 1 means none."""
    damping_speed: float
    """v0 of the damping factor, m/s."""
    least_speed: float
    """Rolling speed is not taken smaller than this in creepages, m/s."""
    strips: StripModel
    """Patches on strips, if the scene asks for them."""
    friction_ratio: float = 1.0
    """A: friction at large slip velocity over that at none; 1: it does not fall."""
    friction_decay: float = 0.0
    """B: rate at which friction falls with slip velocity, s/m."""
    geometries: tuple = ()
    """Where wheels or rails differ: the `ContactGeometry` of each wheel, left and right of wheelset after wheelset."""
    wheels: tuple = ()
    """The same as contact models, see `wrcore.dynamics.system.with_kernels`."""


@jit(allocates=False, inline="always")
def contact_of(model, wheelset, wheel):
    """The contact model of a wheel (0 left, 1 right): its own where wheels or rails differ, else that of all."""
    return member_of(model, "wheels", 2 * wheelset + wheel)


def shaped(contact):
    """Whether a `ContactModel` asks for the shape numbers of its patches."""
    return contact.law == LAWS["table"] and contact.creep.table.axes.n_psi > 1 and not contact.strips.strips


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _normal_contact(model, penetration, curvature_x, curvature_y, approach_speed):
    """`normal_contact`, and a/b and its logarithm."""
    stiffness, a, b, log_axis_ratio = hertz_shape_at(model.hertz, curvature_x, curvature_y)
    factor = damping_factor(approach_speed, model.damping, model.damping_speed)
    root = math.sqrt(penetration)
    modulus = model.shear_modulus / (1.0 - model.poisson_ratio)
    force = factor * modulus * stiffness * penetration * root
    # The ellipse belongs to the force, that is to the elastic approach c_d^(2/3) delta.
    inverse = inverse_cube_root(factor)
    root *= factor * inverse * inverse
    return force, a * root, b * root, a / b, log_axis_ratio


@jit(allocates=False, fastmath=FUSED)
def normal_contact(model, penetration, curvature_x, curvature_y, approach_speed):
    """Normal force (N) by Eq. (7) and the semi-axes (m) of the Hertz ellipse that carries it."""
    force, a, b, _, _ = _normal_contact(model, penetration, curvature_x, curvature_y, approach_speed)
    return force, a, b


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def detect_patches(model, side, y, z, ex, ey, ez, rows):
    """Patches of a wheel by the model's detection: their number, AUTO's bound of planar detection's error, and whether
    detection was spatial."""
    bound, spatial = 0.0, model.detection == SPATIAL
    if model.detection == AUTO:
        bound = planar_error_bound(model.geometry, side, y, z, side * ex, side * ey, side * ez)
        spatial = bound > model.detection_tolerance
    ex, ey, ez = side * ex, side * ey, side * ez
    return find_patches(model.geometry, side, y, z, ex, ey, ez, spatial, model.reduction, rows), bound, spatial


@jit(allocates=False, forceinline=True)
def falling(model, friction, xi, eta, speed):
    """Coefficient of friction mu0 ((1 - A) exp(-B w) + A) at the slip velocity w of a patch (Polach, Wear 258 (2005)
    992): that of its reference point, without spin."""
    ratio = model.friction_ratio
    if ratio == 1.0:
        return friction
    slip = speed * math.sqrt(xi * xi + eta * eta)
    return friction * ((1.0 - ratio) * math.exp(-model.friction_decay * slip) + ratio)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def patch_wrench(model, y, z, vx, vy, vz, wx, wy, wz, curvature_y, curvature_z, friction, row, psi):
    """Wrench of one patch about the wheelset's centre, and whether the creep law's range was left.

    ``friction`` is the rail's coefficient at no slip, ``psi`` the patch's shape number, 0 for an ellipse; see
    `wrcore.dynamics.shaped_wheel`. Creep laws and tables are those of a wheel that rolls ahead; one that rolls back is
    the mirror image of one that rolls ahead with the opposite spin. Below the least speed spin goes to and fro through
    zero, so that nothing jumps at standstill.
    """
    px, py, pz = row[X], row[Y] - y, row[Z] - z
    cosine, sine = row[COSINE], row[SINE]
    speed = max(abs(vx), model.least_speed)
    xi, eta, phi, approach = creepages(vx, vy, vz, wx, wy, wz, px, py, pz, cosine, sine, speed)
    row[CURVATURE_X] += 0.5 * (curvature_y * sine - curvature_z * cosine)  # rail bending away from the wheel
    normal, a, b, axis_ratio, log_axis_ratio = _normal_contact(
        model, row[PENETRATION], row[CURVATURE_X], row[CURVATURE_Y], approach
    )
    limit = falling(model, friction, xi, eta, speed) * normal
    ahead = 1.0 if vx >= speed else vx / speed
    square = a * b
    c = math.sqrt(square)
    scale, aside = model.shear_modulus * square / limit, 0.25 * psi * b
    f1, f2, m3, missed = creep_force_at(
        model.law, model.creep, log_axis_ratio, axis_ratio, ahead * psi if psi != 0.0 else 0.0,
        (xi - phi * aside) * scale, eta * scale, ahead * phi * scale * c,
    )  # fmt: skip
    f1, f2, m3 = limit * f1, limit * f2, ahead * limit * c * m3
    m3 -= aside * f1
    gy, gz = f2 * cosine - normal * sine, f2 * sine + normal * cosine
    row[SEMI_A], row[SEMI_B], row[NORMAL] = a, b, normal
    row[FX], row[FY], row[MZ] = f1, f2, m3
    row[XI], row[ETA], row[PHI] = xi, eta, phi
    mx, my, mz = py * gz - pz * gy, pz * f1 - px * gz - m3 * sine, px * gy - py * f1 + m3 * cosine
    return f1, gy, gz, mx, my, mz, missed


@jit(allocates=False, fastmath=FUSED)
def wheel_wrenches(model, motions, patches, counts, bounds, wrenches, counters, work, mode=FRESH):
    """Force and moment of the rails on all wheels, and the wheels' patches, in frames in which the rail runs along x.

    A row of ``motions`` (k, 2, MOTION_COLUMNS), left and right: side (+1 left, -1 right); y and z of the wheelset's
    centre (m); axle direction, pointing left (3); velocity of the centre (m/s, 3) and angular velocity (rad/s, 3);
    curvature of the rail's line towards y and towards z (1/m; 0 on a tangent track); the rail's coefficient of friction
    at no slip. Fills ``patches`` (k, 2, MAX_PATCHES, PATCH_COLUMNS), rows beyond their ``counts`` keep old content;
    AUTO's ``bounds`` of planar detection's error (m); ``wrenches`` (k, 2, 6), force (N) and moment about the wheelset's
    centre (N m). The second of the ``counters`` counts creep look-ups out of the table's range. The ``mode`` is
    one of `wrcore.dynamics.modes`; ``work`` is for patches on strips.

    One wheel's arithmetic is a chain in which each step waits for the one before: with all wheels in one call the
    chains of neighbours overlap.
    """
    held = mode & PATCHES_HELD
    if not held:
        for i in range(motions.shape[0]):
            for wheel in range(2):
                m, own = motions[i, wheel], contact_of(model, i, wheel)
                count, bound, _ = detect_patches(own, m[0], m[1], m[2], m[3], m[4], m[5], patches[i, wheel])
                counts[i, wheel], bounds[i, wheel] = count, bound
    for i in range(motions.shape[0]):
        for wheel in range(2):
            m, w = motions[i, wheel], wrenches[i, wheel]
            bend, bend_vertical = (0.0, 0.0) if held else (m[12], m[13])  # patches that are held have it already
            fx = fy = fz = mx = my = mz = 0.0
            for k in range(counts[i, wheel]):
                gx, gy, gz, nx, ny, nz, missed = patch_wrench(
                    model, m[1], m[2], m[6], m[7], m[8], m[9], m[10], m[11], bend, bend_vertical, m[FRICTION],
                    patches[i, wheel, k], 0.0,
                )  # fmt: skip
                fx, fy, fz = fx + gx, fy + gy, fz + gz
                mx, my, mz = mx + nx, my + ny, mz + nz
                counters[1] += missed
            w[0], w[1], w[2], w[3], w[4], w[5] = fx, fy, fz, mx, my, mz
