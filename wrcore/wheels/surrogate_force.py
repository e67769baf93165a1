"""Force and moment of the rails on a wheel by the surrogate of exact contact (:mod:`wrcore.contact.surrogate`).

No equation is solved and no result is kept between evaluations. Steps from a wheel's position to its contact forces:

1. The search finds overlaps. Neighbours within 0.5 rad form one group; overlaps of a group that are close to each
   other form one contact patch.
2. The damping lifts the wheel (:mod:`wrcore.wheels.normal_damping`), and so do the other patches of the same group.
3. 38 descriptors are computed from strips across the patch, and the network's outputs from the descriptors.
4. `press_patch`: normal force, semi-axes, position and contact angle.
5. `roll_patch`: creepages at this position, interpolated creep table for this ellipse, and the network's correction
   of the creep force by force modes.

Every output is bounded: ln N relative to a parabolic overlap, the position within the patch, the creep force by
friction, and its power by zero.
"""

import math

from wrcore.bodies.vector import copy_into
from wrcore.contact.half_space_coupling import ellipse_of, rise_by_pressure, slip_by_friction, write_ellipse
from wrcore.contact.hertz import contact_modulus
from wrcore.contact.normal.gap import add_force, group_end
from wrcore.contact.search import reduction
from wrcore.contact.search.strip import lean_at, make_pose, turn_along, upright
from wrcore.kernels.jit import FUSED, jit
from wrcore.wheels.contact_model import OUT_OF_RANGE, OUTSIDE_TRAINING, contact_of
from wrcore.wheels.exact_force import copy_deepest, mirror
from wrcore.wheels.force import detect_patches, leaning_motion
from wrcore.wheels.modes import FRESH, PATCHES_ONLY
from wrcore.wheels.motion import WheelMotion, as_left, motion_of
from wrcore.wheels.normal_damping import lift_of
from wrcore.wheels.surrogate_patch import press_group, press_patch, roll_patch
from wrcore.wheels.table.lookup import APART, FAR, SADDLE, lobe_end

_ONE_PATCH = APART, FAR, SADDLE

_ROUNDS = 5
"""Number of iterations over patches that interact elastically. The first ignores the interaction; each other one uses
the loads of the one before. Each iteration reduces the change of the loads to a tenth."""


@jit(allocates=False, forceinline=True)
def left_ahead(m):
    """Return the motion of the equivalent left wheel that rolls forward.

    A right wheel is mirrored across the track, and a wheel that rolls backward along the track."""
    m = as_left(m)
    if m.vx >= 0.0:
        return m
    return WheelMotion(
        m.side, m.y, m.z, -m.ex, m.ey, m.ez, -m.vx, m.vy, m.vz, m.wx, -m.wy, -m.wz, m.bend_y, m.bend_z, m.friction
    )


@jit(allocates=False, fastmath=FUSED)
def _couple(model, count, forces):
    """Fill rise, tilt and creepages of each patch due to the loads and the friction on the other patches."""
    per_load = 1.0 / (math.pi * contact_modulus(model.shear_modulus, model.poisson_ratio))
    per_friction = 1.0 / (math.pi * model.shear_modulus)
    for q in range(count):
        one = ellipse_of(forces.ellipses[q])
        rise = tilt = xi = eta = 0.0
        for r in range(count):
            if r == q or not (forces.load[r] > 0.0 and one.a > 0.0):
                continue
            other = ellipse_of(forces.ellipses[r])
            value, slope = rise_by_pressure(one, other)
            rise, tilt = rise + per_load * forces.load[r] * value, tilt + per_load * forces.load[r] * slope
            x, y = slip_by_friction(model.poisson_ratio, one, other, forces.fx[r], forces.fy[r], forces.mz[r])
            xi, eta = xi + per_friction * x, eta + per_friction * y
        forces.rise[q], forces.tilt[q], forces.slip_xi[q], forces.slip_eta[q] = rise, tilt, xi, eta


@jit(allocates=False, fastmath=FUSED)
def find_patches(geometry, m, is_spatial, rows, first, last, forces):
    """Number of patches that the overlaps from ``first`` to before ``last`` form. Writes first and last overlap of each
    patch to ``forces``, and sets its load, rise, tilt and slip to zero."""
    pose, count = make_pose(1.0, m.y, m.z, m.ex, m.ey, m.ez, is_spatial), 0
    while first < last:
        end = lobe_end(geometry, pose, rows, first, last, _ONE_PATCH)
        forces.first[count], forces.last[count] = first, end
        forces.rise[count] = forces.tilt[count] = forces.slip_xi[count] = forces.slip_eta[count] = 0.0
        forces.load[count], forces.ellipses[count, :] = 0.0, 0.0
        first, count = end, count + 1
    return count


@jit(allocates=False, fastmath=FUSED)
def _fill_row(m, p, r, place, row):
    """Write a patch to its ``row`` of patches; ``place``: x, y, z relative to the wheelset's centre, m."""
    row[reduction.X], row[reduction.Y], row[reduction.Z] = place[0], place[1] + m.y, place[2] + m.z
    row[reduction.ANGLE], row[reduction.COSINE] = p.angle, math.cos(p.angle)
    row[reduction.SINE], row[reduction.NORMAL] = math.sin(p.angle), p.load
    row[reduction.SEMI_A], row[reduction.SEMI_B] = math.exp(p.log_a), math.exp(p.log_b)
    row[reduction.FX], row[reduction.FY], row[reduction.MZ] = r.fx, r.fy, r.mz
    row[reduction.XI], row[reduction.ETA], row[reduction.PHI] = r.xi, r.eta, r.phi
    row[reduction.P_MAX], row[reduction.CELL] = p.p_max, 0.0


@jit(allocates=False, fastmath=FUSED)
def add_patch(geometry, m, lean, p, r, wrench, row):
    """Add a patch's force and moment about the wheelset's centre to ``wrench``, and write its ``row``. Position and
    forces of ``p`` and ``r`` are in axes inclined along the track by ``lean``, as the rail under the patch."""
    cosine, sine = math.cos(p.angle), math.sin(p.angle)
    fy, fz = r.fy * cosine - p.load * sine, r.fy * sine + p.load * cosine
    px, pz = upright(geometry, lean, p.px, p.pz)
    fx, fz = upright(geometry, lean, r.fx, fz)
    mx, mz = upright(geometry, lean, 0.0, r.mz * cosine)
    add_force(px, p.py, pz, fx, fy, fz, wrench)
    wrench[3] += mx
    wrench[4] -= r.mz * sine
    wrench[5] += mz
    _fill_row(m, p, r, (px, p.py, pz), row)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def lean_of_group(geometry, m, rows, first, last, deepest):
    """Inclination along the track (cosine, sine) of a changing rail under a group of overlaps; the row of maximum
    penetration is copied to ``deepest``."""
    copy_deepest(rows, first, last, deepest)
    return lean_at(geometry, deepest[reduction.U_RAIL], deepest[reduction.Z] - m.z)


@jit(allocates=False, fastmath=FUSED)
def group_forces(model, m, is_spatial, rows, first, last, kept, wrench, counters, scratch_rows, work):
    """Add force and moment of one group of overlaps of a left wheel that rolls forward to ``wrench``.

    Writes the rows of its patches from row ``kept`` on and returns the number of rows written so far. Rows of overlaps
    are read before they are overwritten. ``scratch_rows`` (MAX_PATCHES, PATCH_COLUMNS) is scratch."""
    geometry, forces = model.geometry, work.forces
    lean = lean_of_group(geometry, m, rows, first, last, scratch_rows[0])
    moving = leaning_motion(geometry, m, lean)
    count = find_patches(geometry, m, is_spatial, rows, first, last, forces)
    pressed, filled = press_group(geometry, m, is_spatial, lean, rows, count, scratch_rows[0], work)
    if not pressed.square > 0.0:
        return kept
    lift, rounds = lift_of(model, moving, pressed), 1 if count == 1 else _ROUNDS
    filled = filled if count == 1 else 0
    for turn in range(rounds):
        for q in range(count):
            p = press_patch(model, m, is_spatial, lean, lift, rows, q, filled, scratch_rows[q], work)
            forces.load[q] = p.load
            if not p.load > 0.0:
                continue
            r = roll_patch(model, moving, p, forces.slip_xi[q], forces.slip_eta[q], work.network.outputs)
            forces.fx[q], forces.fy[q], forces.mz[q] = r.fx, r.fy, r.mz
            write_ellipse(
                forces.ellipses[q], p.px, p.py, p.pz, math.exp(p.log_a), math.exp(p.log_b), math.cos(p.angle),
                math.sin(p.angle),
            )  # fmt: skip
            if turn == rounds - 1:
                counters[OUT_OF_RANGE] += r.missed
                counters[OUTSIDE_TRAINING] += p.trust < 1.0
                add_patch(geometry, m, lean, p, r, wrench, scratch_rows[q])
        if turn < rounds - 1:
            _couple(model, count, forces)
    for q in range(count):
        if forces.load[q] > 0.0:
            copy_into(rows[kept], scratch_rows[q])
            kept += 1
    return kept


@jit(allocates=False)
def mirror_back(rows, count, wrench):
    """Mirror patches and wrench along x in place, from a wheel that rolls forward to one that rolls backward."""
    wrench[0], wrench[4], wrench[5] = -wrench[0], -wrench[4], -wrench[5]
    for i in range(count):
        for column in (reduction.S_WHEEL, reduction.X, reduction.FX, reduction.MZ, reduction.XI, reduction.PHI):
            rows[i, column] = -rows[i, column]


@jit(allocates=False, fastmath=FUSED)
def surrogate_wrenches(model, motions, patches, counts, bounds, wrenches, counters, scratch, mode=FRESH):
    """Fill the forces and moments of the rails on all wheels by the surrogate of exact contact.

    Arguments are those of `wrcore.wheels.hertzian_force.wheel_wrenches`."""
    for i in range(motions.shape[0]):
        for wheel in range(2):
            rows, wrench, contact = patches[i, wheel], wrenches[i, wheel], contact_of(model, i, wheel)
            seen = motion_of(motions[i, wheel])
            m = left_ahead(seen)
            wrench[:] = 0.0
            if seen.vx < 0.0:
                turn_along(contact.geometry)
            count, bound, is_spatial = detect_patches(contact, m, rows)
            if not mode & PATCHES_ONLY:
                first = kept = 0
                while first < count:
                    last = group_end(contact.geometry, rows, count, first)
                    kept = group_forces(
                        contact, m, is_spatial, rows, first, last, kept, wrench, counters, scratch.rows,
                        scratch.surrogate,
                    )  # fmt: skip
                    first = last
                count = kept
                if seen.vx < 0.0:
                    mirror_back(rows, count, wrench)
                if seen.side < 0.0:
                    mirror(rows, count, wrench)
            if seen.vx < 0.0:
                turn_along(contact.geometry)
            counts[i, wheel], bounds[i, wheel] = count, bound
