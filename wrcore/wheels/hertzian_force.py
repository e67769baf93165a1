"""Wrench of the rails on a wheelset: detection, Hertz, creepages and creep force put together."""

import math
from typing import NamedTuple

import numpy as np

from wrcore.contact.creepage import creepages
from wrcore.contact.hertz import HertzTable, loaded_ellipse
from wrcore.contact.patch.model import StripModel
from wrcore.contact.search import reduction
from wrcore.contact.search.detection import AUTO, SPATIAL, find_patches, planar_error_bound
from wrcore.contact.search.geometry import ContactGeometry
from wrcore.contact.search.strip import changes_along, lean_at, leaning, upright
from wrcore.contact.surrogate.network import Surrogate, no_surrogate
from wrcore.creep.laws import LAWS, CreepData, creep_force_at
from wrcore.kernels.handles import call_address, other_at
from wrcore.kernels.jit import FUSED, jit
from wrcore.wheels.modes import FRESH, PATCHES_HELD, PATCHES_ONLY
from wrcore.wheels.motion import MOTION, WheelMotion, motion_of

EVALUATIONS, OUT_OF_RANGE, ON_GRID, SOLVED, ON_FIXED, OUTSIDE_TRAINING = range(6)
"""Places of the counters: evaluations, creep look-ups out of the table's range, patches solved on a grid, patches of a
pair's table that were solved instead of looked up, patches on fixed strips, whose tips were not found, and patches of
the surrogate far outside the range of its training."""

COUNTERS = 6


class ContactModel(NamedTuple):
    """Everything that turns a wheelset's motion into contact forces, for kernels."""

    geometry: ContactGeometry
    hertz: HertzTable
    law: int  # creep law, see wrcore.creep.laws.LAWS
    creep: CreepData
    detection: int  # PLANAR, SPATIAL or AUTO of wrcore.contact.search.detection
    detection_tolerance: float  # AUTO: normal penetration that planar detection may miss, m
    reduction: int  # MAXIMUM or MOMENT of wrcore.contact.search.reduction
    shear_modulus: float  # G, Pa
    poisson_ratio: float
    friction: float
    """Coulomb's mu at no slip; of rails that differ, or along which it changes, the largest one."""
    damping: float  # c_e of Eq. (7)'s damping factor; 1 means none
    damping_speed: float  # v0 of the damping factor, m/s
    least_speed: float  # rolling speed is not taken smaller than this in creepages, m/s
    strips: StripModel  # patches on strips, if the scene asks for them
    friction_ratio: float = 1.0  # A: friction at large slip velocity over that at none; 1: it does not fall
    friction_decay: float = 0.0  # B: rate at which friction falls with slip velocity, s/m
    geometries: tuple = ()
    """Where wheels or rails differ: the `ContactGeometry` of each wheel, left and right of wheelset after wheelset."""
    plain: tuple = ()
    """Where rails change along the track: the `ContactGeometry` of each wheel where they do not."""
    wheels: np.ndarray = np.zeros(0, np.int64)
    """The same as `Handles` of contact models, see `wrcore.equations.equations_of_motion.with_wheels`."""
    friction_factors: np.ndarray = np.zeros(0)  # (n,): of a friction law of the user's own, see `falling`
    surrogate: Surrogate = no_surrogate()
    """Trained network of exact contact, if the scene asks for it."""


def alone(contact, **more):
    """A `ContactModel` without what its wheels have of their own, and ``more`` in it."""
    return contact._replace(geometries=(), plain=(), wheels=np.zeros(0, np.int64), **more)


@jit(allocates=False, inline="always")
def contact_of(model, wheelset, wheel):
    """The contact model of a wheel (0 left, 1 right): its own where wheels or rails differ, else that of all."""
    return other_at(model, model.wheels[2 * wheelset + wheel] if len(model.wheels) > 0 else 0)


@jit(allocates=False, forceinline=True)
def press_wheels(model, work, mode):
    """Find the wrenches of the rails on all wheels for their motions in ``work``, by the model's kernel."""
    call_address(
        model.wheels, model.contact, work.motions, work.patches, work.counts, work.bounds, work.rail_wrenches,
        work.counters, work.strips, mode,
    )  # fmt: skip


@jit(allocates=False, forceinline=True)
def is_elliptic(contact):
    """Whether the patches of a `ContactModel` are ellipses."""
    return not contact.strips.strips and len(contact.surrogate.median) == 0


def shaped(contact):
    """Whether a `ContactModel` asks for the shape numbers of its patches."""
    return contact.law == LAWS["table"] and contact.creep.table.axes.n_psi > 1 and is_elliptic.py_func(contact)


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
def detect_patches(model, m, rows):
    """Patches of a wheel by the model's detection: their number, AUTO's bound of planar detection's error, and whether
    detection was spatial."""
    bound, spatial = 0.0, model.detection == SPATIAL
    ex, ey, ez = m.side * m.ex, m.side * m.ey, m.side * m.ez
    if model.detection == AUTO:
        bound = planar_error_bound(model.geometry, m.side, m.y, m.z, ex, ey, ez)
        spatial = bound > model.detection_tolerance
    count = find_patches(model.geometry, m.side, m.y, m.z, ex, ey, ez, spatial, model.reduction, rows)
    return count, bound, spatial


@jit(allocates=False, forceinline=True)
def falling(model, friction, xi, eta, speed):
    """Coefficient of friction mu0 ((1 - A) exp(-B w) + A) at the slip velocity w of a patch (Polach, Wear 258 (2005)
    992): that of its reference point, without spin; or mu0 times a factor of a user's own, samples of which lie 1/B
    apart."""
    ratio = model.friction_ratio
    if ratio == 1.0:
        return friction
    slip = speed * math.sqrt(xi * xi + eta * eta)
    factors = model.friction_factors
    if factors.shape[0] > 0:
        place = min(slip * model.friction_decay, factors.shape[0] - 1.001)
        k = int(place)
        return friction * (factors[k] + (place - k) * (factors[k + 1] - factors[k]))
    return friction * ((1.0 - ratio) * math.exp(-model.friction_decay * slip) + ratio)


@jit(allocates=False, forceinline=True)
def leaning_motion(geometry, m, lean):
    """The motion with velocities in axes that lean so, see `lean_at`."""
    if not changes_along(geometry):
        return m
    vx, vz = leaning(geometry, lean, m.vx, m.vz)
    wx, wz = leaning(geometry, lean, m.wx, m.wz)
    return WheelMotion(
        m.side, m.y, m.z, m.ex, m.ey, m.ez, vx, m.vy, vz, wx, m.wy, wz, m.bend_y, m.bend_z, m.friction
    )  # fmt: skip


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
