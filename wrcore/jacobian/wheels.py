"""Contacts' part of the Jacobian: derivatives of contact forces with respect to the wheels' positions and velocities.

The contacts' part changes faster than all others. Between two full Jacobians it is refreshed without evaluations of the
whole vehicle. For each wheelset, the derivatives C of force and moment with respect to its position, attitude and
velocity are computed in the rails' frames. They add A C to the accelerations of the wheelset and of bodies joined to
it, where A are the accelerations per force and moment on the wheelset. In the rail's frame, derivatives with respect to
the displacement along the rail and the rotation about the axle are zero. For ellipses, table patches and the surrogate,
C is computed by the chain rule (`patch_slopes`, :mod:`wrcore.jacobian.table_wheel`), with patches moved by moments
(:mod:`wrcore.contact.search.moved`); otherwise by differences of the search, or of forces. States of a flexible track
(:mod:`wrcore.jacobian.flexible_track`) and of independently rotating wheels add columns and rows.
"""

import math

from wrcore.bodies.body import STATE_SIZE, rotation_matrix
from wrcore.bodies.inertia import apply_inverse_inertia, inertia_axes
from wrcore.bodies.vector import copy_into
from wrcore.contact.search import reduction
from wrcore.contact.search.detection import SPATIAL
from wrcore.contact.search.moved import DIFFERENCE, MOVES, move_patch
from wrcore.contact.search.strip import make_pose
from wrcore.equations.equations_of_motion import wheel_motions
from wrcore.jacobian.flexible_track import give_way, over_rails
from wrcore.jacobian.hertzian_wheel import SAME, SLOPES, patch_slopes
from wrcore.kernels.handles import call_address
from wrcore.kernels.jit import FUSED, jit
from wrcore.wheels.contact_model import contact_of
from wrcore.wheels.force import press_wheels
from wrcore.wheels.modes import BARE, ELLIPSES, PATCHES_HELD, PATCHES_ONLY
from wrcore.wheels.motion import MOTION, motion_of

DISPLACEMENT, TURN, SPEED, SPIN = 1e-8, 1e-8, 1e-7, 1e-7
"""Differences of displacement (m), rotation (rad), velocity (m/s) and angular velocity (rad/s)."""

DIRECTIONS = 12
ALONG, ACROSS, UP, ROLL, PITCH, YAW = range(6)
"""Number of columns of a body (displacement, rotation, velocity, angular velocity), and indices of the first six."""

MOVING = ACROSS, UP, ROLL, YAW
"""Directions in which patches move."""

OF_ROLL, OF_YAW, SPINS = 2, 3, MOVES + 3
"""Rows of derivatives with respect to roll and yaw, and first of three rows with respect to angular velocities."""

UNIT = 1e3
"""Force (N) and moment (N m) for which accelerations are computed."""

UNCOUNTED = -1
"""Count of patches of a wheel whose derivatives have not been computed."""


@jit(allocates=False)
def take_mobility(jacobian, t, state, model, work):
    """Fill ``jacobian.mobility`` with the accelerations of all bodies per force and moment on each wheelset.

    They are at the rotations in ``work``, whose forces and moments are overwritten. They are in the wheelset's axes,
    which do not spin, and in which they hardly change."""
    wheelsets, idle, bodies = model.bodies.wheelsets, jacobian.idle, model.bodies.mass.shape[0]
    _accelerations(t, state, model, work, -1, 0, idle)
    for k in range(wheelsets.shape[0]):
        axes = work.rotations[wheelsets[k]]
        for direction in range(6):
            column = jacobian.mobility[k, direction]
            _accelerations(t, state, model, work, wheelsets[k], direction, column)
            for i in range(column.shape[0]):
                column[i] = (column[i] - idle[i]) / UNIT
            for part in range(2 * bodies):
                x, y, z = column[3 * part], column[3 * part + 1], column[3 * part + 2]
                for i in range(3):
                    column[3 * part + i] = axes[0, i] * x + axes[1, i] * y + axes[2, i] * z


@jit(allocates=False)
def _accelerations(t, state, model, work, body, direction, out):
    """Fill ``out`` (6 n,) with accelerations by one force or moment along an axis of a body (``body`` < 0: none)."""
    bodies, wrenches, axes = model.bodies, work.wrenches, inertia_axes(model.bodies, work)
    wrenches[:] = 0.0
    if body >= 0:
        for i in range(3):
            wrenches[body, direction - direction % 3 + i] = UNIT * work.rotations[body, i, direction % 3]
    if model.joints.equations > 0:
        call_address(model.kernels.joint_reactions_kernel, model, t, state, work)
    for b in range(bodies.mass.shape[0]):
        for i in range(3):
            out[6 * b + i] = wrenches[b, i] / bodies.mass[b]
        apply_inverse_inertia(bodies.inertia[b], axes[b], wrenches[b], out[6 * b + 3 : 6 * b + 6])


@jit(allocates=False, inline="always")
def direction_of(slope):
    """Return the direction (column of a body) of a row of derivatives."""
    return MOVING[slope] if slope < MOVES else slope + 2


@jit(allocates=False, fastmath=FUSED)
def move_along(base, direction, difference, row):
    """Write a wheel's motion ``base`` plus a difference in one direction of its rail's frame to ``row``."""
    m = motion_of(base)
    copy_into(row, base)
    if direction == ROLL:
        row[MOTION.ey], row[MOTION.ez] = m.ey - difference * m.ez, m.ez + difference * m.ey
    elif direction == YAW:
        row[MOTION.ex], row[MOTION.ey] = m.ex - difference * m.ey, m.ey + difference * m.ex
    else:  # y, z and velocities: columns have the numbers of the directions
        row[direction] += difference


@jit(allocates=False, inline="always")
def _difference(slope, fine):
    """Return the difference for a row of derivatives; differences of velocities are multiplied by ``fine``."""
    direction = direction_of(slope)
    if direction >= 6:
        return fine * (SPEED if direction < 9 else SPIN)
    return DISPLACEMENT if direction < 3 else TURN


@jit(allocates=False)
def _move_all(base, slope, difference, work):
    """Write all wheels' motions plus a difference in the direction of a row of derivatives to the workspace."""
    for k in range(base.shape[0]):
        for wheel in range(2):
            move_along(base[k, wheel], direction_of(slope), difference, work.motions[k, wheel])


@jit(allocates=False, fastmath=FUSED)
def _add_share(rail, wheel, slope, share, column):
    """Add ``share`` times a derivative of force, moment and rates in a rail's frame to a column.

    The axes of the frame are the columns of ``rail``."""
    for j in range(3):
        column[j] += share * (rail[j, 0] * slope[0] + rail[j, 1] * slope[1] + rail[j, 2] * slope[2])
        column[3 + j] += share * (rail[j, 0] * slope[3] + rail[j, 1] * slope[4] + rail[j, 2] * slope[5])
    rates = slope.shape[0] - 6
    for j in range(6, 6 + rates - rates % 2):
        column[j + 2 * wheel] += share * slope[j]
    if rates % 2 == 1:
        column[column.shape[0] - 1] += share * slope[slope.shape[0] - 1]


@jit(allocates=False, fastmath=FUSED)
def _add_column(rail, wheel, direction, slope, scale, columns):
    """Add ``scale`` times the derivative with respect to a direction of a rail's frame to a wheelset's columns."""
    i, first = direction % 3, direction - direction % 3
    for axis in range(3):
        if rail[axis, i] != 0.0:
            _add_share(rail, wheel, slope, scale * rail[axis, i], columns[first + axis])


@jit(allocates=False, fastmath=FUSED)
def _add_rate_difference(m, half, inertia, slopes):
    """Fill the row and column of half the difference of the rolling rates in a wheel's derivatives ``slopes``.

    The row is the derivative with respect to this difference (rad/s), the column is that of its rate. Roll and yaw turn
    the axle about which the wheel rotates, which changes their rows."""
    row, column, apart = slopes.shape[0] - 1, slopes.shape[1] - 1, m.side * half
    for i in range(column):
        wx, wy, wz = slopes[SPINS, i], slopes[SPINS + 1, i], slopes[SPINS + 2, i]
        slopes[row, i] = m.side * (m.ex * wx + m.ey * wy + m.ez * wz)
        slopes[OF_ROLL, i] += apart * (m.ey * wz - m.ez * wy)
        slopes[OF_YAW, i] += apart * (m.ex * wy - m.ey * wx)
    for i in range(row + 1):
        slopes[i, column] = m.side / inertia * (m.ex * slopes[i, 3] + m.ey * slopes[i, 4] + m.ez * slopes[i, 5])


@jit(allocates=False, fastmath=FUSED)
def add_slopes(jacobian, state, model, columns):
    """Add the derivatives of all wheels at a ``state`` to the ``columns`` of their wheelsets.

    The derivative with respect to a rotation about the axle is zero, which determines the columns of PITCH."""
    for k in range(columns.shape[0]):
        for wheel in range(2):
            rail, m = jacobian.rails[k, wheel], motion_of(jacobian.motions[k, wheel])
            slopes = jacobian.slopes[k, wheel]
            number = jacobian.column_numbers[k, columns.shape[1] - 1]
            if model.bodies.independent.shape[0] > 0 and number >= 0:
                half, body = state[number + model.bodies.mass.shape[0]], model.bodies.wheelsets[k]
                _add_rate_difference(m, half, model.bodies.inertia[body, 1], slopes)
                _add_share(rail, wheel, slopes[slopes.shape[0] - 1], 1.0, columns[k, columns.shape[1] - 1])
            for j in range(SLOPES):
                direction = direction_of(j)
                _add_column(rail, wheel, direction, slopes[j], 1.0, columns[k])
                if direction == ROLL or direction == YAW:
                    share = -(m.ex if direction == ROLL else m.ez) / m.ey
                    _add_column(rail, wheel, PITCH, slopes[j], share, columns[k])
            for i in range((columns.shape[1] - DIRECTIONS) // 2):  # of rails: four or eight columns, or none
                column = DIRECTIONS + 2 * wheel + i + (2 if i > 1 else 0)
                _add_share(rail, wheel, slopes[SLOPES + i], 1.0, columns[k, column])


@jit(allocates=False)
def _take_rails(jacobian, angle, work):
    """Fill ``jacobian.rails`` with the axes of all rails' frames, in the axes of increments."""
    c, s = math.cos(angle), math.sin(angle)
    for k in range(jacobian.rails.shape[0]):
        for wheel in range(2):
            rail, axes = jacobian.rails[k, wheel], work.rails[k, wheel]
            for j in range(3):
                rail[0, j], rail[1, j] = c * axes[0, j] + s * axes[1, j], c * axes[1, j] - s * axes[0, j]
                rail[2, j] = axes[2, j]


@jit(allocates=False)
def contact_blocks(jacobian, angle, state, rate, model, work, fine, columns):
    """Fill ``columns`` (k, c, 6 + r) with derivatives of the rails' forces and moments on wheelsets, and of rates.

    They are with respect to displacement, rotation, velocity and angular velocity of the wheelset and to internal
    states, see `wrcore.jacobian.links.contact_places`. Axes are turned by an ``angle`` (rad). Differences of velocities
    are multiplied by ``fine``; wheels and patches in ``work`` are overwritten."""
    wheelsets, base = model.bodies.wheelsets, jacobian.motions
    for k in range(wheelsets.shape[0]):
        rotation_matrix(state, STATE_SIZE * wheelsets[k], work.rotations[wheelsets[k]])
    wheel_motions(model, state, work)
    if model.flexible_track.mass.shape[0] > 0:
        over_rails(model, state, rate, work.motions)
    _take_rails(jacobian, angle, work)
    for k in range(wheelsets.shape[0]):
        for wheel in range(2):
            copy_into(base[k, wheel], work.motions[k, wheel])
    columns[:] = 0.0
    jacobian.counts[:] = UNCOUNTED
    if model.kernels.contact_derivatives_kernel != 0:
        call_address(model.kernels.contact_derivatives_kernel, jacobian, model, work)
    for k in range(wheelsets.shape[0]):
        if jacobian.counts[k, 0] == UNCOUNTED or jacobian.counts[k, 1] == UNCOUNTED:
            _difference_wrenches(jacobian, model, work, fine)
            break
    for k in range(wheelsets.shape[0] if model.flexible_track.mass.shape[0] > 0 else 0):
        for wheel in range(2):
            give_way(model.flexible_track, wheel, jacobian.slopes[k, wheel])
    if model.kernels.check_rails_kernel != 0:
        _difference_check_rails(jacobian, state, model, work, fine)
    add_slopes(jacobian, state, model, columns)


@jit(allocates=False)
def slopes_of_patches(jacobian, model, work):
    """Fill ``jacobian.slopes`` with the derivatives of all wheels for elliptic patches.

    ``jacobian.counts`` are `UNCOUNTED` if a difference changes the set of patches."""
    base, difference = jacobian.motions, _move_patches(jacobian, model, work)
    if difference == 0.0:
        jacobian.counts[:] = UNCOUNTED
        return
    jacobian.slopes[:] = 0.0
    for k in range(base.shape[0]):
        for wheel in range(2):
            m, found = motion_of(base[k, wheel]), jacobian.patches[:, k, wheel]
            for patch in range(jacobian.counts[k, wheel]):
                patch_slopes(
                    contact_of(model.contact, k, wheel), m, found[0, patch], found, patch, difference,
                    jacobian.law, jacobian.slopes[k, wheel],
                )  # fmt: skip


@jit(allocates=False)
def _move_patches(jacobian, model, work):
    """Fill ``jacobian.patches`` with all patches, unchanged and after differences of position and attitude.

    Returns the difference (m, rad), or 0 if it changes the set of patches."""
    base, found = jacobian.motions, jacobian.patches
    press_wheels(model, work, ELLIPSES | PATCHES_ONLY)
    known = model.contact.reduction == reduction.MOMENT and model.contact.detection == SPATIAL
    for k in range(base.shape[0]):
        for wheel in range(2):
            m, geometry = motion_of(base[k, wheel]), contact_of(model.contact, k, wheel).geometry
            pose = make_pose(m.side, m.y, m.z, m.side * m.ex, m.side * m.ey, m.side * m.ez, True)
            jacobian.counts[k, wheel] = work.counts[k, wheel]
            for patch in range(work.counts[k, wheel]):
                row, moved = found[0, k, wheel, patch], found[:, k, wheel]
                copy_into(row, work.patches[k, wheel, patch])
                known = known and move_patch(geometry, pose, row, patch, jacobian.law[:3], moved)
    if known:
        return DIFFERENCE
    return DISPLACEMENT if _search_moved(jacobian, model, work) else 0.0


@jit(allocates=False)
def _search_moved(jacobian, model, work):
    """Fill ``jacobian.patches`` after differences by searches; return False if one changes the set of patches."""
    base, found = jacobian.motions, jacobian.patches
    for move in range(MOVES):
        _move_all(base, move, DISPLACEMENT, work)
        press_wheels(model, work, ELLIPSES | PATCHES_ONLY)
        for k in range(base.shape[0]):
            for wheel in range(2):
                if work.counts[k, wheel] != jacobian.counts[k, wheel]:
                    return False
                for patch in range(work.counts[k, wheel]):
                    row = found[1 + move, k, wheel, patch]
                    copy_into(row, work.patches[k, wheel, patch])
                    if abs(row[reduction.U_WHEEL] - found[0, k, wheel, patch, reduction.U_WHEEL]) > SAME:
                        return False
    return True


@jit(allocates=False)
def _difference_wrenches(jacobian, model, work, fine):
    """Fill ``jacobian.slopes`` of the wheels that are `UNCOUNTED` by differences of forces and moments."""
    base, found = jacobian.motions, jacobian.wrenches
    _move_all(base, 0, 0.0, work)
    press_wheels(model, work, BARE | ELLIPSES)
    for k in range(base.shape[0]):
        for wheel in range(2):
            copy_into(found[k, wheel], work.rail_wrenches[k, wheel])
    for step in range(SLOPES):
        j = (step + MOVES) % SLOPES  # velocities first: they keep the patches of ``base``
        difference = _difference(j, fine)
        _move_all(base, j, difference, work)
        press_wheels(model, work, BARE | ELLIPSES if j < MOVES else BARE | ELLIPSES | PATCHES_HELD)
        for k in range(base.shape[0]):
            for wheel in range(2):
                if jacobian.counts[k, wheel] != UNCOUNTED:
                    continue
                for i in range(6):
                    slope = (work.rail_wrenches[k, wheel, i] - found[k, wheel, i]) / difference
                    jacobian.slopes[k, wheel, j, i] = slope


@jit(allocates=False)
def _difference_check_rails(jacobian, state, model, work, fine):
    """Add the derivatives of the forces of check rails, by differences, to ``jacobian.slopes``."""
    for j in range(-1, SLOPES):
        difference = 0.0 if j < 0 else _difference(j, fine)
        _move_all(jacobian.motions, max(j, 0), difference, work)
        work.rail_wrenches[:] = 0.0
        call_address(model.kernels.check_rails_kernel, model, state, work)
        for k in range(work.motions.shape[0]):
            for wheel in range(2):
                if j < 0:
                    copy_into(jacobian.wrenches[k, wheel], work.rail_wrenches[k, wheel])
                for i in range(0 if j < 0 else 6):
                    more = work.rail_wrenches[k, wheel, i] - jacobian.wrenches[k, wheel, i]
                    jacobian.slopes[k, wheel, j, i] += more / difference


@jit(allocates=False, fastmath=FUSED)
def _respond(mobility, axes, c, s, wrench, body, out):
    """Fill ``out`` (6,) with the accelerations of one body by force and moment ``wrench`` on a wheelset.

    The wheelset's ``axes`` are in track axes; ``wrench`` and ``out`` are in axes turned by the angle of ``c`` and
    ``s``."""
    for i in range(6):
        out[i] = 0.0
    for m in range(6):
        first, i = m - m % 3, m % 3
        along_x, along_y = c * axes[0, i] + s * axes[1, i], c * axes[1, i] - s * axes[0, i]
        share = along_x * wrench[first] + along_y * wrench[first + 1] + axes[2, i] * wrench[first + 2]
        for r in range(6):
            out[r] += mobility[m, 6 * body + r] * share
    for first in range(0, 6, 3):
        p, q, r = out[first], out[first + 1], out[first + 2]
        x = axes[0, 0] * p + axes[0, 1] * q + axes[0, 2] * r
        y = axes[1, 0] * p + axes[1, 1] * q + axes[1, 2] * r
        out[first], out[first + 1] = c * x + s * y, c * y - s * x
        out[first + 2] = axes[2, 0] * p + axes[2, 1] * q + axes[2, 2] * r


@jit(allocates=False)
def renew_contacts(joined, whole, jacobian, angle, t, state, rate, model, work, fine):
    """Replace the contacts' part of the Jacobian, or add it to a new full Jacobian (``whole``) without contacts.

    ``joined``: bodies that accelerate with each wheelset; ``angle``: that of the axes of increments, rad; ``rate``:
    rate of the state."""
    columns, out, bodies = jacobian.columns, jacobian.idle, model.bodies.mass.shape[0]
    contact_blocks(jacobian, angle, state, rate, model, work, fine, columns)
    if whole:
        take_mobility(jacobian, t, state, model, work)
    c, s = math.cos(angle), math.sin(angle)
    for k in range(columns.shape[0]):
        wheelset = model.bodies.wheelsets[k]
        for direction in range(columns.shape[1]):
            number = jacobian.column_numbers[k, direction]
            if number < 0:
                continue
            by_position = number < 6 * bodies
            column = jacobian.by_position[number] if by_position else jacobian.by_velocity[number - 6 * bodies]
            for j in range(joined.starts[k], joined.starts[k + 1]):
                body = joined.bodies[j]
                _respond(jacobian.mobility[k], work.rotations[wheelset], c, s, columns[k, direction], body, out)
                for row in range(6):
                    known = jacobian.contact[k, direction, 6 * body + row]
                    jacobian.contact[k, direction, 6 * body + row] = out[row]
                    column[6 * body + row] += out[row] - (0.0 if whole else known)
            for i in range(columns.shape[2] - 6):
                known, new = jacobian.contact[k, direction, 6 * bodies + i], columns[k, direction, 6 + i]
                jacobian.contact[k, direction, 6 * bodies + i] = new
                if jacobian.row_numbers[k, i] >= 0:
                    column[jacobian.row_numbers[k, i]] += new - (0.0 if whole else known)
