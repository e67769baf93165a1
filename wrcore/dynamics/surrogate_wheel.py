"""Wrench of the rails on a wheel by the surrogate of exact contact (:mod:`wrcore.contact.surrogate`).

Nothing is solved and nothing is kept between evaluations. From a wheel's position to its contact forces:

1. The search finds overlaps. Overlaps that lie near each other form one contact patch.
2. The damping lifts the wheel (:mod:`wrcore.dynamics.lift`); so do the other patches of the same group of overlaps.
3. Strips across the patch give 38 descriptors, and these the network's outputs.
4. `press_patch`: normal force, semi-axes, place and contact angle.
5. `roll_patch`: creepages at that place, the creep table at that ellipse, and the remainder by the force modes.

Every output is bounded, whatever the descriptors are: ln N beside that of a parabolic overlap, the place within the
patch, the creep force by friction, its power by zero.
"""

import math
from typing import NamedTuple

from wrcore.contact import reduction
from wrcore.contact.approach import LEVEL, pressed_together
from wrcore.contact.creepage import creepages
from wrcore.contact.half_space_coupling import Ellipse, rise_by_pressure, slip_by_friction
from wrcore.contact.normal import contact_modulus
from wrcore.contact.patch.gap import add_force, group_end
from wrcore.contact.strip import make_pose
from wrcore.contact.surrogate.descriptors import describe, parabola_at
from wrcore.contact.surrogate.network import (
    force_remainder,
    is_outside_training,
    parabolic_at,
    run_network,
)
from wrcore.contact.surrogate.strips import fill_strips
from wrcore.creep.kalker import coefficients_at
from wrcore.dynamics.lift import lift_of
from wrcore.dynamics.modes import FRESH, PATCHES_ONLY
from wrcore.dynamics.motion import WheelMotion, as_left, motion_of
from wrcore.dynamics.pair_table import APART, DISK, FAR, LOCKED, SADDLE, _at_ellipse, lobe_end
from wrcore.dynamics.strip_wheel import copy_deepest, mirror
from wrcore.dynamics.vector import copy_into
from wrcore.dynamics.wheel import OUT_OF_RANGE, OUTSIDE_TRAINING, contact_of, detect_patches, falling
from wrcore.kernels.jit import FUSED, jit

_ONE_PATCH = APART, FAR, SADDLE

_ROUNDS = 5
"""Evaluations of patches that press each other: the first one alone, then with the rise by the loads found last. Each
round reduces the change of the loads to a tenth."""

_LEAST_FRICTION = 0.04
"""Friction below which the network is not trained; its creep force at this value is scaled."""

_MOST_LOG_LOAD, _MOST_LOG_AXIS, _MOST_ANGLE = 0.6, 0.8, 0.15
"""Bounds of what the network adds to ln N, ln a and ln b, and to the contact angle (rad). In training 99.9 % of the
corrections are below half of them."""

_MOST_PLACE, _MOST_WIDTH = 3.0, 3.0
"""Bounds of the place across the patch and of the variance of its width, over sigma and sigma^2; a parabolic overlap
has 0 and 1.4."""

_MOST_MOMENT = 1.0
"""Bound of the moment about the normal over friction times N times c; Kalker's theory stays below 0.6."""


class Pressed(NamedTuple):
    """Normal contact of a patch, of a wheel that rolls forward."""

    load: float
    """Normal force, N; 0 if it does not touch."""
    log_a: float
    log_b: float
    """Of the semi-axes over 1 m."""
    p_max: float
    """Largest pressure, Pa."""
    px: float
    py: float
    pz: float
    """Where it slips, from the wheelset's centre, m."""
    angle: float
    """Contact angle, rad."""
    is_outside: bool
    """Whether a descriptor is outside the range of the training."""


_NO_CONTACT = Pressed(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, False)


class Rolled(NamedTuple):
    """Creep of a patch."""

    xi: float
    eta: float
    phi: float
    """Creepages and spin (1/m), without what friction on other patches adds."""
    fx: float
    fy: float
    mz: float
    """Forces along and across (N), and moment about the normal (N m)."""
    missed: int
    """Look-ups outside the creep table."""


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def bounded(x, bound):
    """x up to half of the bound, then a curve that joins smoothly and never reaches the bound."""
    half = 0.5 * bound
    over = abs(x) - half
    if not over > 0.0:
        return x if x == x else 0.0
    return math.copysign(half + over / math.sqrt(1.0 + (over / half) * (over / half)), x)


@jit(allocates=False, forceinline=True)
def mirrored_ahead(m):
    """The mirror image, along x, of a wheel that rolls back: it rolls forward."""
    return WheelMotion(
        m.side, m.y, m.z, -m.ex, m.ey, m.ez, -m.vx, m.vy, m.vz, m.wx, -m.wy, -m.wz, m.bend_y, m.bend_z, m.friction
    )


@jit(allocates=False, fastmath=FUSED)
def press_patch(model, m, lift, rows, first, last, rise, tilt, row, work):
    """`Pressed` of the overlaps from ``first`` to before ``last``, of a wheel that the damping lifts by ``lift`` and
    other patches by ``rise`` (m), and tilt by ``tilt`` about this patch. ``row`` (PATCH_COLUMNS,) becomes the patch's
    row, without forces."""
    geometry, surrogate, network = model.geometry, model.surrogate, work.network
    low, high = rows[first, reduction.OUTSIDE], rows[last - 1, reduction.BEYOND]
    copy_deepest(rows, first, last, row)
    if lift.share >= 1.0:
        return _NO_CONTACT
    height, ty, tz = lift.share * lift.depth + rise, tilt * (row[reduction.Z] - m.z), -tilt * (row[reduction.Y] - m.y)
    y, z = m.y - height * lift.sine + ty, m.z + height * lift.cosine + tz
    pose = make_pose(1.0, y, z, m.ex, m.ey, m.ez + tilt, True)
    count, n = fill_strips(geometry, pose, row, low, high, work.strips)
    friction = max(m.friction, _LEAST_FRICTION)
    shape = describe(work.strips, count, n, geometry.rolling_radius, m.ez, friction, network.descriptors)
    if not shape.length > 0.0:
        return _NO_CONTACT
    run_network(surrogate, network)
    is_outside = is_outside_training(surrogate, network.descriptors)
    scaled, c = network.outputs, surrogate.corrections
    log_n, log_a, log_b, log_p = parabolic_at(surrogate.base, network.descriptors[0])
    l, log_l = shape.length, math.log(shape.length)
    stiffness = contact_modulus(model.shear_modulus, model.poisson_ratio) * shape.curvature * l
    load = stiffness * l * l * math.exp(log_n + bounded(c[0] * scaled[0], _MOST_LOG_LOAD))
    log_a = log_l + log_a + bounded(c[1] * scaled[1], _MOST_LOG_AXIS)
    log_b = log_l + log_b + bounded(c[2] * scaled[2], _MOST_LOG_AXIS)
    p_max = stiffness * math.exp(log_p + bounded(c[3] * scaled[3], 2.0 * _MOST_LOG_AXIS))
    b_over_sigma = math.exp(log_b) / shape.sigma
    e = bounded(c[5] * scaled[5] * l / shape.sigma, _MOST_PLACE)
    spread = bounded(0.2 * b_over_sigma * b_over_sigma, 2.0 * _MOST_WIDTH)
    angle = parabola_at(shape.angle, shape.angle_1, shape.angle_2, shape.third, e, spread)
    angle += bounded(c[6] * scaled[6], _MOST_ANGLE) - 0.5 * tilt
    px = parabola_at(shape.ahead, shape.ahead_1, shape.ahead_2, shape.third, e, spread) + bounded(c[4] * scaled[4], 1.0) * l
    pz = parabola_at(shape.height, shape.height_1, shape.height_2, shape.third, e, spread)
    pz += bounded(c[7] * scaled[7], 1.0) * l + tz
    py = shape.lateral + e * shape.sigma * math.cos(shape.angle) + geometry.rail_distance - y + ty
    return Pressed(load, log_a, log_b, p_max, px, py, pz, angle, is_outside)


@jit(allocates=False, fastmath=FUSED)
def roll_patch(model, m, pressed, slip_xi, slip_eta, outputs):
    """`Rolled` of a patch of a wheel that rolls forward; ``outputs`` are the network's."""
    geometry, angle = model.geometry, pressed.angle
    cosine, sine, speed = math.cos(angle), math.sin(angle), max(m.vx, model.least_speed)
    xi, eta, phi, _ = creepages(
        m.vx, m.vy, m.vz, m.wx, m.wy, m.wz, pressed.px, pressed.py, pressed.pz, cosine, sine, speed
    )
    limit = falling(model, m.friction, xi, eta, speed) * pressed.load
    x, y = xi + slip_xi, eta + slip_eta
    f1, f2, m3, missed, c = _at_ellipse(model, pressed.log_a, pressed.log_b, limit, x, y, phi)
    unit = model.shear_modulus * c * c / (3.0 * limit)
    c11, c22, _, _ = coefficients_at(pressed.log_a - pressed.log_b, model.creep.table.kalker)
    px, py = x * unit * c11, y * unit * c22
    root = 1.0 / (DISK + math.sqrt(DISK * DISK + px * px + py * py))
    r1, r2, r3 = force_remainder(model.surrogate, outputs, px * root, py * root)
    part = (m.wy * geometry.rolling_radius / speed - 1.0) / LOCKED
    fade = max(0.0, 1.0 - part * part)
    fade *= fade
    given, taken = f1 * x + f2 * y + m3 * phi * c, r1 * x + r2 * y + r3 * phi * c
    if fade * taken > -given:  # no power is produced
        fade = max(-given, 0.0) / taken
    f1, f2, m3 = f1 + fade * r1, f2 + fade * r2, bounded(m3 + fade * r3, 2.0 * _MOST_MOMENT)
    scale = limit / max(math.sqrt(f1 * f1 + f2 * f2), 1.0)
    return Rolled(xi, eta, phi, scale * f1, scale * f2, limit * c * m3, missed)


@jit(allocates=False, fastmath=FUSED)
def _ellipse_of(values):
    """`Ellipse` of a row of ``PatchForces.ellipses``."""
    return Ellipse(values[0], values[1], values[2], values[3], values[4], values[5], values[6])


@jit(allocates=False, fastmath=FUSED)
def _couple(model, count, forces):
    """Find rise, tilt and slip of each patch by the loads and the friction on the others."""
    per_load = 1.0 / (math.pi * contact_modulus(model.shear_modulus, model.poisson_ratio))
    per_friction = 1.0 / (math.pi * model.shear_modulus)
    for q in range(count):
        one = _ellipse_of(forces.ellipses[q])
        rise = tilt = xi = eta = 0.0
        for r in range(count):
            if r == q or forces.load[r] <= 0.0 or one.a <= 0.0:
                continue
            other = _ellipse_of(forces.ellipses[r])
            value, slope = rise_by_pressure(one, other)
            rise, tilt = rise + per_load * forces.load[r] * value, tilt + per_load * forces.load[r] * slope
            x, y = slip_by_friction(model.poisson_ratio, one, other, forces.fx[r], forces.fy[r], forces.mz[r])
            xi, eta = xi + per_friction * x, eta + per_friction * y
        if one.a > 0.0:
            forces.rise[q], forces.tilt[q], forces.slip_xi[q], forces.slip_eta[q] = rise, tilt, xi, eta


@jit(allocates=False, fastmath=FUSED)
def _find_patches(geometry, pose, rows, first, last, forces):
    """Number of patches that the overlaps from ``first`` to before ``last`` form; writes where each begins and ends."""
    count = 0
    while first < last:
        end = lobe_end(geometry, pose, rows, first, last, _ONE_PATCH)
        forces.first[count], forces.last[count] = first, end
        forces.rise[count] = forces.tilt[count] = forces.slip_xi[count] = forces.slip_eta[count] = 0.0
        forces.load[count] = forces.ellipses[count, 3] = 0.0
        first, count = end, count + 1
    return count


@jit(allocates=False, fastmath=FUSED)
def group_forces(model, m, rows, first, last, kept, wrench, counters, scratch, work):
    """Add the wrench of one group of overlaps of a left wheel that rolls forward, and write its patches' rows from
    ``kept`` on; returns the number of rows then. Rows of overlaps are read before they are overwritten."""
    geometry, forces, outputs = model.geometry, work.forces, work.network.outputs
    pose = make_pose(1.0, m.y, m.z, m.ex, m.ey, m.ez, True)
    lift = lift_of(model, m, pressed_together(geometry, pose, True, LEVEL, rows, first, last, scratch.moments))
    count = _find_patches(geometry, pose, rows, first, last, forces)
    rounds = 1 if count == 1 else _ROUNDS
    for turn in range(rounds):
        for q in range(count):
            row = scratch.rows[q]
            begin, end = forces.first[q], forces.last[q]
            p = press_patch(model, m, lift, rows, begin, end, forces.rise[q], forces.tilt[q], row, work)
            forces.load[q] = p.load
            if not p.load > 0.0:
                continue
            r = roll_patch(model, m, p, forces.slip_xi[q], forces.slip_eta[q], outputs)
            cosine, sine, a, b = math.cos(p.angle), math.sin(p.angle), math.exp(p.log_a), math.exp(p.log_b)
            forces.fx[q], forces.fy[q], forces.mz[q] = r.fx, r.fy, r.mz
            values = forces.ellipses[q]
            values[0], values[1], values[2], values[3], values[4] = p.px, p.py, p.pz, a, b
            values[5], values[6] = cosine, sine
            if turn == rounds - 1:
                counters[OUT_OF_RANGE] += r.missed
                counters[OUTSIDE_TRAINING] += p.is_outside
                y, z = r.fy * cosine - p.load * sine, r.fy * sine + p.load * cosine
                add_force(p.px, p.py, p.pz, r.fx, y, z, wrench)
                wrench[4] -= r.mz * sine
                wrench[5] += r.mz * cosine
                row[reduction.X], row[reduction.Y], row[reduction.Z] = p.px, p.py + m.y, p.pz + m.z
                row[reduction.ANGLE], row[reduction.COSINE], row[reduction.SINE] = p.angle, cosine, sine
                row[reduction.SEMI_A], row[reduction.SEMI_B], row[reduction.NORMAL] = a, b, p.load
                row[reduction.FX], row[reduction.FY], row[reduction.MZ] = r.fx, r.fy, r.mz
                row[reduction.XI], row[reduction.ETA], row[reduction.PHI] = r.xi, r.eta, r.phi
                row[reduction.P_MAX], row[reduction.CELL] = p.p_max, 0.0
        if turn < rounds - 1:
            _couple(model, count, forces)
    for q in range(count):
        if forces.load[q] > 0.0:
            copy_into(rows[kept], scratch.rows[q])
            kept += 1
    return kept


@jit(allocates=False)
def _mirror_back(rows, count, wrench):
    """Patches and wrench of a wheel that rolls forward as those of its mirror image along x, which rolls back."""
    wrench[0], wrench[4], wrench[5] = -wrench[0], -wrench[4], -wrench[5]
    for i in range(count):
        for column in (reduction.S_WHEEL, reduction.X, reduction.FX, reduction.MZ, reduction.XI, reduction.PHI):
            rows[i, column] = -rows[i, column]


@jit(allocates=False, fastmath=FUSED)
def surrogate_wrenches(model, motions, patches, counts, bounds, wrenches, counters, scratch, mode=FRESH):
    """Force and moment of the rails on all wheels; arguments as for `wrcore.dynamics.wheel.wheel_wrenches`."""
    for i in range(motions.shape[0]):
        for wheel in range(2):
            rows, wrench, contact = patches[i, wheel], wrenches[i, wheel], contact_of(model, i, wheel)
            seen = motion_of(motions[i, wheel])
            m, rolls_back = as_left(seen), seen.vx < 0.0
            m = mirrored_ahead(m) if rolls_back else m
            wrench[:] = 0.0
            count, bound, _ = detect_patches(contact, m, rows)
            if not mode & PATCHES_ONLY:
                first = kept = 0
                while first < count:
                    last = group_end(contact.geometry, rows, count, first)
                    kept = group_forces(
                        contact, m, rows, first, last, kept, wrench, counters, scratch, scratch.surrogate
                    )
                    first = last
                count = kept
                if rolls_back:
                    _mirror_back(rows, count, wrench)
                if seen.side < 0.0:
                    mirror(rows, count, wrench)
            counts[i, wheel], bounds[i, wheel] = count, bound
