"""Wrench of the rails on a wheelset: detection, Hertz, creepages and creep force put together."""

import math
from typing import NamedTuple

from wrcore._jit import jit
from wrcore.contact.creepage import creepages
from wrcore.contact.detection import AUTO, SPATIAL, find_patches, planar_error_bound
from wrcore.contact.geometry import ContactGeometry
from wrcore.contact.normal import HertzTable, damping_factor, hertz_ellipse
from wrcore.contact.reduction import (
    ANGLE,
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
    XI,
    X,
    Y,
    Z,
)
from wrcore.creep.laws import CreepData, creep_force


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
    """Coulomb's mu."""
    damping: float
    """c_e of Eq. (7)'s damping factor; 1 means none."""
    damping_speed: float
    """v0 of the damping factor, m/s."""
    least_speed: float
    """Rolling speed is not taken smaller than this in creepages, m/s."""


@jit(allocates=False)
def normal_contact(model, penetration, curvature_x, curvature_y, approach_speed):
    """Normal force (N) by Eq. (7) and the semi-axes (m) of the Hertz ellipse that carries it."""
    stiffness, a_factor, b_factor = hertz_ellipse(model.hertz, curvature_x, curvature_y)
    factor = damping_factor(approach_speed, model.damping, model.damping_speed)
    modulus = model.shear_modulus / (1.0 - model.poisson_ratio)
    force = factor * modulus * stiffness * penetration * math.sqrt(penetration)
    # The ellipse belongs to the force, that is to the elastic approach c_d^(2/3) delta.
    root = math.sqrt(penetration) * factor ** (1.0 / 3.0)
    return force, a_factor * root, b_factor * root


@jit(allocates=False)
def wheel_wrench(model, side, y, z, ex, ey, ez, vx, vy, vz, wx, wy, wz, curvature_y, curvature_z, rows):
    """Force and moment of one rail on a wheelset, and the wheel's patches, in a frame in which the rail runs along x.

    Parameters
    ----------
    model : ContactModel
    side : float
        +1 left, -1 right.
    y, z : float
        Wheelset centre, m.
    ex, ey, ez : float
        Axle direction, pointing left.
    vx, vy, vz, wx, wy, wz : float
        Velocity of the centre (m/s) and angular velocity (rad/s).
    curvature_y, curvature_z : float
        Curvature of the rail's line towards y and z, 1/m (0 on a tangent track).
    rows : numpy.ndarray, shape (MAX_PATCHES, PATCH_COLUMNS)
        Filled: the wheel's patches; rows beyond the count keep old content.

    Returns
    -------
    fx, fy, fz, mx, my, mz : float
        Force (N) and moment about the wheelset's centre (N m).
    count : int
        Number of patches.
    outside : int
        Number of creep look-ups outside the range of the creep law's table.
    bound : float
        AUTO only: bound of planar detection's error, m.
    """
    fx = fy = fz = mx = my = mz = 0.0
    outside, bound = 0, 0.0
    spatial = model.detection == SPATIAL
    if model.detection == AUTO:
        bound = planar_error_bound(model.geometry, side, y, z, side * ex, side * ey, side * ez)
        spatial = bound > model.detection_tolerance
    count = find_patches(model.geometry, side, y, z, side * ex, side * ey, side * ez, spatial, model.reduction, rows)
    speed = max(abs(vx), model.least_speed)
    modulus = model.shear_modulus
    for k in range(count):
        row = rows[k]
        px, py, pz = row[X], row[Y] - y, row[Z] - z
        xi, eta, phi, approach = creepages(vx, vy, vz, wx, wy, wz, px, py, pz, row[ANGLE], speed)
        cosine, sine = math.cos(row[ANGLE]), math.sin(row[ANGLE])
        row[CURVATURE_X] += 0.5 * (curvature_y * sine - curvature_z * cosine)  # rail bending away from the wheel
        normal, a, b = normal_contact(model, row[PENETRATION], row[CURVATURE_X], row[CURVATURE_Y], approach)
        limit = model.friction * normal
        square = a * b
        c = math.sqrt(square)
        scale = modulus * square / limit
        f1, f2, m3, missed = creep_force(model.law, model.creep, a / b, 0.0, xi * scale, eta * scale, phi * scale * c)
        outside += missed
        f1, f2, m3 = limit * f1, limit * f2, limit * c * m3
        gy, gz = f2 * cosine - normal * sine, f2 * sine + normal * cosine
        fx += f1
        fy += gy
        fz += gz
        mx += py * gz - pz * gy
        my += pz * f1 - px * gz - m3 * sine
        mz += px * gy - py * f1 + m3 * cosine
        row[SEMI_A], row[SEMI_B], row[NORMAL] = a, b, normal
        row[FX], row[FY], row[MZ] = f1, f2, m3
        row[XI], row[ETA], row[PHI] = xi, eta, phi
    return fx, fy, fz, mx, my, mz, count, outside, bound
