"""Derivatives of a wheel's force and moment by the surrogate, with respect to its position, attitude and velocity.

Position and attitude move the overlap, and so change all numbers of a patch (`Pressed`) and the network's outputs. A
velocity changes them only by the lift due to damping. These numbers are therefore evaluated six times: unchanged, after
each move, and with the wheel lifted. Slip and creep forces follow from these numbers and the motion, and are evaluated
once for each direction. All numbers are in double precision, so that plain differences are accurate.

For wheels with several interacting patches, the derivatives are differences of the whole force and moment.
"""

from wrcore.bodies.vector import copy_into
from wrcore.contact.normal.gap import group_end
from wrcore.contact.search import reduction
from wrcore.contact.search.moved import MOVES
from wrcore.contact.search.strip import turn_along
from wrcore.contact.surrogate.network import run_network
from wrcore.jacobian.hertzian_wheel import SAME, SLOPES
from wrcore.jacobian.wheels import UNCOUNTED, direction_of, move_along
from wrcore.kernels.jit import FUSED, jit
from wrcore.wheels.contact_model import contact_of
from wrcore.wheels.force import detect_patches, leaning_motion
from wrcore.wheels.motion import motion_of
from wrcore.wheels.normal_damping import Lift, lift_of
from wrcore.wheels.surrogate_force import add_patch, find_patches, lean_of_group, left_ahead
from wrcore.wheels.surrogate_patch import NOTHING_PRESSED, Pressed, describe_patch, press_group, pressed_of, roll_patch

DIFFERENCE, RATE_DIFFERENCE = 1e-9, 1e-8
"""Difference of moves (m, rad) and of the lift (m); difference of velocities (m/s, rad/s) relative to the rolling speed
(m/s)."""

_LIFTED = 1 + MOVES
"""Row of the lifted wheel among the numbers of a patch, after the rows of the unchanged and of the moved wheel."""

_FIELDS = len(Pressed._fields)
"""Number of columns of `Pressed`."""


@jit(allocates=False)
def slopes_of_surrogate(jacobian, model, work):
    """Fill ``jacobian.slopes`` with the derivatives of all wheels by the surrogate.

    ``jacobian.counts`` is `UNCOUNTED` for wheels with interacting patches, or if a small move changes the overlaps."""
    for k in range(jacobian.motions.shape[0]):
        for wheel in range(2):
            contact, slopes = contact_of(model.contact, k, wheel), jacobian.slopes[k, wheel]
            slopes[:] = 0.0
            rolls_back = motion_of(jacobian.motions[k, wheel]).vx < 0.0
            if rolls_back:
                turn_along(contact.geometry)
            found = _wheel_slopes(
                contact, jacobian.motions[k, wheel], work.motions[k, wheel], jacobian.patches[:, k, wheel], slopes,
                jacobian.wrenches[k], work.strips,
            )  # fmt: skip
            if rolls_back:
                turn_along(contact.geometry)
            work.counts[k, wheel] = max(found, 0)
            jacobian.counts[k, wheel] = found if found >= 0 else UNCOUNTED


@jit(allocates=False)
def _search(contact, base, moved, found):
    """Fill ``found[0]`` with the overlaps of a wheel, and ``found[1 + k]`` with those after each move.

    Returns the number of overlaps, -1 if a move changes them, and whether detection was spatial."""
    count, _, is_spatial = detect_patches(contact, left_ahead(motion_of(base)), found[0])
    for k in range(MOVES):
        move_along(base, direction_of(k), DIFFERENCE, moved)
        if detect_patches(contact, left_ahead(motion_of(moved)), found[1 + k])[0] != count:
            return -1, is_spatial
        for i in range(count):
            if abs(found[1 + k, i, reduction.U_WHEEL] - found[0, i, reduction.U_WHEEL]) > SAME:
                return -1, is_spatial
    return count, is_spatial


@jit(allocates=False, fastmath=FUSED)
def _wheel_slopes(contact, base, moved, found, slopes, wrenches, work):
    """Add the derivatives of one wheel to ``slopes`` and return the number of its overlaps.

    The number is -1 if patches interact or a move changes the overlaps. ``base`` is the motion; ``moved`` (same shape),
    ``found`` (1 + MOVES, MAX_PATCHES, PATCH_COLUMNS) and ``wrenches`` (2, 6) are scratch."""
    seen = motion_of(base)
    m, first = left_ahead(seen), 0
    count, is_spatial = _search(contact, base, moved, found)
    while first < count:
        last = group_end(contact.geometry, found[0], count, first)
        if find_patches(contact.geometry, m, is_spatial, found[0], first, last, work.surrogate.forces) > 1:
            return -1
        pressed = _find_numbers(contact, base, moved, is_spatial, found, first, last, work)
        if pressed.square > 0.0:
            _add_slopes(contact, base, moved, pressed, found[0], first, last, slopes, wrenches, work)
        first = last
    for i in range(6):
        sign = -1.0 if seen.side < 0.0 and i % 2 == 1 else 1.0
        sign = -sign if seen.vx < 0.0 and i in (0, 4, 5) else sign
        for j in range(SLOPES):
            slopes[j, i] *= sign
    return count


@jit(allocates=False, fastmath=FUSED)
def _find_numbers(contact, base, moved, is_spatial, found, first, last, work):
    """Fill ``work.surrogate.numbers`` of the only patch of a group of overlaps, and return the group's moments.

    Each row contains the `_FIELDS` of the patch, then the network's outputs. The moments are a
    `wrcore.contact.search.approach.Pressed`, with zeros if the wheel has no contact."""
    surrogate, geometry, lean, row = work.surrogate, contact.geometry, (1.0, 0.0), work.rows[0]
    unmoved = NOTHING_PRESSED
    for n in range(2 + MOVES):
        difference = DIFFERENCE if 0 < n < _LIFTED else 0.0
        move_along(base, direction_of(max(n - 1, 0) % MOVES), difference, moved)
        m, rows = left_ahead(motion_of(moved)), found[n if n < _LIFTED else 0]
        if n == 0:
            lean = lean_of_group(geometry, m, rows, first, last, row)
        pressed, filled = press_group(geometry, m, is_spatial, lean, rows, 1, row, surrogate)
        if not pressed.square > 0.0:
            return NOTHING_PRESSED
        lift = lift_of(contact, leaning_motion(geometry, m, lean), pressed)
        if n == _LIFTED:
            lift = Lift(lift.share + DIFFERENCE / lift.depth, lift.depth, lift.cosine, lift.sine)
        if not lift.share < 1.0:
            return NOTHING_PRESSED
        patch = describe_patch(contact, m, is_spatial, lift, rows, 0, filled, row, surrogate)
        numbers, outputs = surrogate.numbers[n], surrogate.numbers[n, _FIELDS:]
        if not patch.shape.square > 0.0:
            return NOTHING_PRESSED
        unmoved, trust = pressed if n == 0 else unmoved, run_network(contact.surrogate, surrogate.network)
        copy_into(outputs, surrogate.network.outputs)
        p = pressed_of(contact, patch, lean, 0.0, trust, outputs)
        for i in range(_FIELDS):
            numbers[i] = p[i]
    return unmoved


@jit(allocates=False, fastmath=FUSED)
def _add_slopes(contact, base, moved, pressed, rows, first, last, slopes, wrenches, work):
    """Add the derivatives of the patch whose numbers `_find_numbers` has filled to ``slopes``.

    ``pressed`` is the result of `_find_numbers`; other arguments are those of it and of `_wheel_slopes`."""
    geometry, numbers, lean = contact.geometry, work.surrogate.numbers, (1.0, 0.0)
    now, lifted, mixed = numbers[0], numbers[_LIFTED], numbers[_LIFTED + 1]
    speed, share = max(abs(motion_of(base).vx), contact.least_speed), 0.0
    for j in range(-1, SLOPES):
        difference = 0.0 if j < 0 else DIFFERENCE if j < MOVES else RATE_DIFFERENCE * speed
        move_along(base, direction_of(max(j, 0)), difference, moved)
        m = left_ahead(motion_of(moved))
        if j < 0:
            lean = lean_of_group(geometry, m, rows, first, last, work.rows[0])
        moving, here = leaning_motion(geometry, m, lean), now
        if 0 <= j < MOVES:
            here = numbers[1 + j]
        else:
            lift = lift_of(contact, moving, pressed)
            share = lift.share if j < 0 else share
            part = (lift.share - share) * lift.depth / DIFFERENCE
            for i in range(len(mixed)):
                mixed[i] = now[i] + part * (lifted[i] - now[i])
            here = mixed
        p = Pressed(here[0], here[1], here[2], here[3], here[4], here[5], here[6], here[7], here[8])
        r = roll_patch(contact, moving, p, 0.0, 0.0, here[_FIELDS:])
        wrench = wrenches[min(j + 1, 1)]
        wrench[:] = 0.0
        add_patch(geometry, m, lean, p, r, wrench, work.rows[0])
        for i in range(0 if j < 0 else 6):
            slopes[j, i] += (wrench[i] - wrenches[0, i]) / difference
