"""Force and moment of the rails on wheelsets from exact, non-elliptic contact patches on strips.

The normal and the rolling problem are solved on Galerkin strips (:mod:`wrcore.contact.patch.solution`), after the
damping has lifted the wheel (:mod:`wrcore.wheels.normal_damping`). If the strips do not converge, the patch is solved
on a uniform grid and counted. A right wheel is solved as the mirror image of a left one, so both sides are treated
identically.
"""

import math

from wrcore.bodies.vector import copy_into
from wrcore.contact.creepage import creepages
from wrcore.contact.normal.gap import frame_of_rows, group_end, lean_of
from wrcore.contact.normal.strips import FIXED, WEIGHT, WIDENED
from wrcore.contact.normal.windows import BLENDING_RATIO
from wrcore.contact.patch.model import ELLIPSES as WITH_ELLIPSES
from wrcore.contact.patch.model import LOAD
from wrcore.contact.patch.solution import NOTHING, fill_row, mean_solution, roll_on_grid, roll_patch, solve_overlaps
from wrcore.contact.rail_friction import friction_at
from wrcore.contact.search import reduction
from wrcore.contact.search.approach import pressed_together
from wrcore.contact.search.detection import SPATIAL
from wrcore.contact.search.strip import LIFT, leaning, make_pose, upright, with_rail_along
from wrcore.kernels.handles import call_address, call_c
from wrcore.kernels.jit import FUSED, jit
from wrcore.wheels.contact_model import ON_FIXED, ON_GRID, contact_of
from wrcore.wheels.force import detect_patches, falling, leaning_motion
from wrcore.wheels.modes import BARE, ELLIPSES, FRESH, PATCHES_ONLY, WARM
from wrcore.wheels.motion import as_left, motion_of
from wrcore.wheels.normal_damping import lift_of, lifted

UNSOLVED, STOOD_IN, ROWLESS = range(3)
"""Indices of `StripWork.flags`. Not 0 if, in this order: patches outside the table must not be solved; ellipses have
replaced strips at least once; no rows are filled (`BARE`)."""


@jit(allocates=False, fastmath=FUSED)
def _deepest_slip(model, m, pose, frame, depth):
    """Return the creepages at the material point of maximum penetration, and the coefficient of friction there.

    The motion ``m`` is in the inclined axes of the patch."""
    speed = max(abs(m.vx), model.least_speed)
    py = frame.ur + model.geometry.rail_distance + depth * frame.sine - m.y
    pz = with_rail_along(model.geometry, LIFT, frame.ur, 1.0, frame.z - depth * frame.cosine - m.z)
    px, pz = leaning(model.geometry, lean_of(model.geometry, pose, frame), frame.x, pz)
    xi, eta, phi, _ = creepages(m.vx, m.vy, m.vz, m.wx, m.wy, m.wz, px, py, pz, frame.cosine, frame.sine, speed)
    return (xi, eta, phi), falling(model, m.friction, xi, eta, speed)


@jit(allocates=False, forceinline=True)
def copy_deepest(rows, first, last, out):
    """Copy the row of maximum penetration, from ``first`` to before ``last``, into ``out``."""
    deepest = first
    for k in range(first + 1, last):
        deepest = k if rows[k, reduction.PENETRATION] > rows[deepest, reduction.PENETRATION] else deepest
    copy_into(out, rows[deepest])


@jit(allocates=False, fastmath=FUSED, nogil=True)
def group_wrench(model, m, spatial, rows, first, last, out, wrench, counters, memory, work):
    """Solve the overlaps from ``first`` to before ``last`` as one contact patch of a left wheel.

    Fills the patch's row ``out``, adds its force and moment to ``wrench`` and returns its `Solution`. The normal force
    ``out[NORMAL]`` is 0 if the lifted wheel has no contact."""
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
        friction = friction_at(model.friction_across, friction, frame.cosine, frame.sine)
        found = roll_on_grid(model, m, pose, frame, depth, creepage, friction, out, work)
    else:
        finer = work.normal.more
        share = finer[WEIGHT]
        fixed = finer[FIXED]
        found = roll_patch(model, m, pose, frame, windows, depth, speed, friction, 1.0, work)
        if share > 0.0:  # weighted mean with the solution on a larger number of strips
            finer[WIDENED] = BLENDING_RATIO
            windows, frame = solve_overlaps(model, pose, low, high, memory, work)
            finer[WIDENED] = 1.0
            if windows > 0:
                for k in range(6):
                    work.wrench[0, k] *= 1.0 - share
                    work.wrench[1, k] *= 1.0 - share
                more = roll_patch(model, m, pose, frame, windows, depth, speed, friction, share, work)
                found, fixed = mean_solution(found, more, share), max(fixed, finer[FIXED])
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
    """Add the force and moment of one group of overlaps to ``wrench``: `group_wrench` for calls by address."""
    group_wrench(model, m, spatial, rows, first, last, out, wrench, counters, memory, work)


@jit(allocates=False)
def mirror(rows, count, wrench):
    """Mirror the patches and the wrench of a left wheel to those of a right wheel, in place."""
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
    """Fill the wrenches from Hertzian ellipses by `wheel_wrenches`, compiled on first use as few runs need it."""
    late, work.flags[STOOD_IN] = model.strips.late, 1.0
    if late[WITH_ELLIPSES] == 0:
        call_c(late[LOAD], WITH_ELLIPSES)
    if late[WITH_ELLIPSES] == 0:  # interrupted
        wrenches[:] = math.nan
        return
    call_address(late[WITH_ELLIPSES], model, motions, patches, counts, bounds, wrenches, counters, work, mode)


@jit(allocates=False, fastmath=FUSED)
def strip_wrenches(model, motions, patches, counts, bounds, wrenches, counters, work, mode=FRESH):
    """Fill the forces and moments of the rails on all wheels from patches on strips.

    Arguments are those of `wrcore.wheels.hertzian_force.wheel_wrenches`. In the mode `ELLIPSES`, ellipses replace the
    patches that would be solved; patches within a table are interpolated."""
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
                    contact.strips.patch_forces_kernel, contact, m, spatial, rows, first, last, work.out, wrench,
                    counters, memory, work,
                )  # fmt: skip
                if rough and work.out[reduction.NORMAL] < 0.0:
                    _press_ellipses(model, motions, patches, counts, bounds, wrenches, counters, work, ELLIPSES)
                    return
                group += 1
                if work.out[reduction.NORMAL] > 0.0:
                    copy_into(rows[kept], work.out)
                    kept += 1
                first = last
            if mode & WARM:
                for unmet in range(group, work.memory.shape[2]):
                    work.memory[i, wheel, unmet, 0] = 0.0
            if seen.side < 0.0:
                mirror(rows, kept, wrench)
            counts[i, wheel], bounds[i, wheel] = kept, bound
