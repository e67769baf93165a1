"""Pressure and creep force of one contact patch by the surrogate; every output is bounded."""

import math
from typing import NamedTuple

from wrcore.contact.creepage import creepages
from wrcore.contact.hertz import contact_modulus, hertz_shape_at
from wrcore.contact.rail_friction import friction_at
from wrcore.contact.search import approach, reduction
from wrcore.contact.search.approach import add_pressed
from wrcore.contact.search.strip import leaning, make_pose
from wrcore.contact.surrogate.descriptors import PatchShape, describe, parabola_at
from wrcore.contact.surrogate.network import force_remainder, run_network
from wrcore.contact.surrogate.strips import close_strips, fill_strips, lift_strips, press_strips
from wrcore.creep.kalker import coefficients_at
from wrcore.kernels.jit import FUSED, jit
from wrcore.wheels.exact_force import copy_deepest
from wrcore.wheels.force import falling
from wrcore.wheels.table.lookup import DISK, LOCKED, _at_ellipse

_LEAST_FRICTION = 0.04
"""Lower bound of the coefficient of friction in the network's inputs; forces are those at the true coefficient."""


_MOST_LOG_LOAD, _MOST_LOG_AXIS, _MOST_ANGLE = 0.6, 0.8, 0.15
"""Bounds of the network's corrections of ln N, of ln a and ln b, and of the contact angle (rad). In training 99.9 % of
the corrections are below half of these bounds."""


_MOST_SHIFT, _MOST_WIDTH = 3.0, 3.0
"""Bound of the position across the patch over sigma, and half of the bound of the variance of its width over sigma^2.
Both values are 0 and 1.4 for a parabolic overlap."""


_MOST_MOMENT = 1.0
"""Bound of the network's correction of the moment about the normal, divided by friction times N times c."""


class Pressed(NamedTuple):
    """Normal contact of one patch of a wheel that rolls forward."""

    load: float
    """Normal force, N; 0 without contact."""
    log_a: float
    log_b: float
    """Logarithms of the semi-axes over 1 m."""
    p_max: float
    """Maximum pressure, Pa."""
    px: float
    py: float
    pz: float
    """Reference point of the creepages, relative to the wheelset's centre, m."""
    angle: float
    """Contact angle, rad."""
    trust: float
    """Factor of the network's outputs: 1 within and near the range of its training."""


NOTHING_PRESSED = approach.Pressed(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


_NO_CONTACT = Pressed(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


class Rolled(NamedTuple):
    """Creepages, creep forces and spin moment of one patch."""

    xi: float
    eta: float
    phi: float
    """Creepages and spin (1/m), without the elastic slip that friction on other patches causes."""
    fx: float
    fy: float
    mz: float
    """Longitudinal and lateral creep force (N), and moment about the normal (N m)."""
    missed: int
    """Number of interpolations outside the range of the creep table."""


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def bounded(x, bound):
    """Return x up to half of the bound, beyond it a smooth continuation that never reaches the bound; 0 for NaN."""
    half = 0.5 * bound
    over = min(abs(x) - half, 1e6 * half)  # finite for infinite x
    if not over > 0.0:
        return x if x == x else 0.0
    return math.copysign(half + over / math.sqrt(1.0 + (over / half) * (over / half)), x)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _lifted_wheel(m, lift, rise, tilt, ellipse):
    """Position of a wheel that is lifted by the damping, and lifted and tilted by the loads on its other patches.

    The other patches lift it by ``rise`` (m) and tilt it about the position of this patch. Returns y and z of the
    centre (m), the axle's z component, and the parts of y and z that are due to the tilt (m)."""
    height, ty, tz = lift.share * lift.depth + rise, tilt * ellipse[2], -tilt * ellipse[1]
    return m.y - height * lift.sine + ty, m.z + height * lift.cosine + tz, m.ez + tilt, ty, tz


class LiftedPatch(NamedTuple):
    """One patch of a wheel that is lifted by the damping and by its other patches."""

    shape: PatchShape
    aside: float
    """Distance to add to a rail coordinate for the lateral position relative to the wheelset's centre, m."""
    ty: float
    tz: float
    """Lateral and vertical shift of the position by the tilt due to other patches, m."""


@jit(allocates=False, fastmath=FUSED)
def _fill_patch(geometry, m, is_spatial, y, z, ez, rows, q, row, work):
    """Fill ``work.strips`` with the strips of the patch ``q`` of ``work.forces``.

    The wheelset's centre is at ``y`` and ``z`` (m), and the vertical component of its axle is ``ez``. The patch's
    overlap of maximum penetration is written to ``row`` (PATCH_COLUMNS,). Returns the wheel's `Pose`, the number of
    strips and their spacing (m)."""
    first, last = work.forces.first[q], work.forces.last[q]
    copy_deepest(rows, first, last, row)
    pose = make_pose(1.0, y, z, m.ex, m.ey, ez, is_spatial)
    low, high = rows[first, reduction.OUTSIDE], rows[last - 1, reduction.BEYOND]
    n, step = fill_strips(geometry, pose, row, low, high, work.strips)
    return pose, n, step


@jit(allocates=False, fastmath=FUSED)
def press_group(geometry, m, is_spatial, lean, rows, count, row, work):
    """Return the sum of the overlap moments (`wrcore.contact.search.approach.Pressed`) of a group's ``count`` patches.

    Also returns the number of strips of the last patch, which stay in ``work.strips``. Its overlap of maximum
    penetration is written to ``row`` (PATCH_COLUMNS,)."""
    total, n = NOTHING_PRESSED, 0
    for q in range(count):
        pose, n, step = _fill_patch(geometry, m, is_spatial, m.y, m.z, m.ez, rows, q, row, work)
        if n > 0:
            total = add_pressed(total, press_strips(geometry, pose, lean, work.strips, n, step))
    return total, n


@jit(allocates=False, fastmath=FUSED)
def describe_patch(model, m, is_spatial, lift, rows, q, filled, row, work):
    """Return the `LiftedPatch` of the patch ``q`` of ``work.forces`` and fill ``work.network.descriptors``. ``filled``
    is the number of strips of a single patch that `press_group` has filled, else 0. The patch's overlap of maximum
    penetration is written to ``row`` (PATCH_COLUMNS,)."""
    geometry, forces, n = model.geometry, work.forces, filled
    y, z, ez, ty, tz = _lifted_wheel(m, lift, forces.rise[q], forces.tilt[q], forces.ellipses[q])
    if filled > 0:
        lift_strips(work.strips, filled, y - m.y, z - m.z)
    else:
        _, n, _ = _fill_patch(geometry, m, is_spatial, y, z, ez, rows, q, row, work)
    count = close_strips(work.strips, n) if n > 0 else 0
    inclined = friction_at(model.friction_across, m.friction, row[reduction.COSINE], row[reduction.SINE])
    friction = max(inclined, _LEAST_FRICTION)
    shape = describe(work.strips, count, n, geometry.rolling_radius, m.ez, friction, work.network.descriptors)
    return LiftedPatch(shape, geometry.rail_distance - y + ty, ty, tz)


@jit(allocates=False, fastmath=FUSED)
def press_patch(model, m, is_spatial, lean, lift, rows, q, filled, row, work):
    """Return the normal contact (`Pressed`) of the patch ``q`` of ``work.forces``, in axes inclined along the track by
    ``lean``, as the rail under the wheel. ``filled`` and ``row`` are those of `describe_patch`. The network's outputs
    for the patch are written to ``work.network.outputs``."""
    if not lift.share < 1.0:
        return _NO_CONTACT
    patch = describe_patch(model, m, is_spatial, lift, rows, q, filled, row, work)
    if not patch.shape.square > 0.0:
        return _NO_CONTACT
    trust = run_network(model.surrogate, work.network)
    return pressed_of(model, patch, lean, work.forces.tilt[q], trust, work.network.outputs)


@jit(allocates=False, fastmath=FUSED)
def pressed_of(model, patch, lean, tilt, trust, outputs):
    """Return the normal contact (`Pressed`) of a `LiftedPatch` for network outputs, in axes inclined by ``lean``."""
    p = _pressed(model, patch.shape, trust, model.surrogate.corrections, outputs)
    px, pz = leaning(model.geometry, lean, p.px, p.pz + patch.tz)
    return Pressed(p.load, p.log_a, p.log_b, p.p_max, px, p.py + patch.aside, pz, p.angle - 0.5 * tilt, p.trust)


@jit(allocates=False, fastmath=FUSED)
def _pressed(model, shape, trust, scales, outputs):
    """Return the normal contact (`Pressed`) of a patch of this shape. ``py`` is the rail coordinate (m); ``px`` and
    ``pz`` are relative to the wheelset's centre (m). The network's first ``outputs`` are multiplied by ``scales``."""
    modulus = contact_modulus(model.shear_modulus, model.poisson_ratio)
    half_width, size = math.sqrt(7.0) * shape.sigma, shape.length
    depth = math.sqrt(0.9375 * shape.square / half_width)  # parabolic overlap with this M0 and sigma
    stiffness, a, b, _ = hertz_shape_at(model.hertz, shape.curvature, depth / (half_width * half_width))
    root = math.sqrt(depth)
    load, a, b = modulus * stiffness * depth * root, a * root, b * root
    p_max = 1.5 * load / (math.pi * a * b) * math.exp(bounded(scales[3] * outputs[3], 2.0 * _MOST_LOG_AXIS))
    load *= math.exp(bounded(scales[0] * outputs[0], _MOST_LOG_LOAD))
    log_a = math.log(a) + bounded(scales[1] * outputs[1], _MOST_LOG_AXIS)
    log_b = math.log(b) + bounded(scales[2] * outputs[2], _MOST_LOG_AXIS)
    e = bounded(scales[5] * outputs[5] * size / shape.sigma, _MOST_SHIFT)
    b = math.exp(log_b) / shape.sigma
    spread = bounded(0.2 * b * b, 2.0 * _MOST_WIDTH)
    angle = parabola_at(shape.angle, shape.angle_1, shape.angle_2, shape.third, e, spread)
    angle += bounded(scales[6] * outputs[6], _MOST_ANGLE)
    px = parabola_at(shape.ahead, shape.ahead_1, shape.ahead_2, shape.third, e, spread)
    px += bounded(scales[4] * outputs[4], 1.0) * size
    pz = parabola_at(shape.height, shape.height_1, shape.height_2, shape.third, e, spread)
    pz += bounded(scales[7] * outputs[7], 1.0) * size
    py = shape.lateral + e * shape.sigma * math.cos(shape.angle)
    return Pressed(load, log_a, log_b, p_max, px, py, pz, angle, trust)


@jit(allocates=False, fastmath=FUSED)
def roll_patch(model, m, pressed, slip_xi, slip_eta, outputs):
    """Return creepages and creep forces (`Rolled`) of one patch of a wheel that rolls forward.

    ``slip_xi`` and ``slip_eta`` are creepages due to friction on other patches; ``outputs`` are those of the network.
    Below the least speed, spin decreases in proportion to speed: forces are continuous where a wheel reverses."""
    radius, cosine, sine = model.geometry.rolling_radius, math.cos(pressed.angle), math.sin(pressed.angle)
    speed = max(m.vx, model.least_speed)
    xi, eta, phi, _ = creepages(
        m.vx, m.vy, m.vz, m.wx, m.wy, m.wz, pressed.px, pressed.py, pressed.pz, cosine, sine, speed
    )
    friction = friction_at(model.friction_across, m.friction, cosine, sine)
    limit = falling(model, friction, xi, eta, speed) * pressed.load
    x, y, forward = xi + slip_xi, eta + slip_eta, min(m.vx / speed, 1.0)
    f1, f2, m3, missed, c = _at_ellipse(model, pressed.log_a, pressed.log_b, limit, x, y, forward * phi)
    m3 *= forward
    unit = model.shear_modulus * c * c / (3.0 * limit)
    c11, c22, _, _ = coefficients_at(pressed.log_a - pressed.log_b, model.creep.table.kalker)
    px, py = x * unit * c11, y * unit * c22
    root = 1.0 / (DISK + math.sqrt(DISK * DISK + px * px + py * py))
    r1, r2, r3 = force_remainder(model.surrogate, outputs, px * root, py * root)
    part = (m.wy * radius / speed - 1.0) / LOCKED
    fade = max(0.0, 1.0 - part * part)
    fade *= fade
    f1, f2, m3 = f1 + fade * r1, f2 + fade * r2, m3 + fade * bounded(r3, _MOST_MOMENT)
    less = 1.0 / max(math.sqrt(f1 * f1 + f2 * f2), 1.0)
    f1, f2, m3 = without_power(less * f1, less * f2, m3, x, y, phi * c)
    return Rolled(xi, eta, phi, limit * f1, limit * f2, limit * c * m3, missed)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def without_power(f1, f2, m3, x, y, spin):
    """Reduce creep force and moment such that their power in the creepages ``x``, ``y`` and ``spin`` is not positive.

    If the power is positive, the moment is reduced first, then the force component along the creepages."""
    of_force, of_moment = f1 * x + f2 * y, m3 * spin
    if of_force + of_moment > 0.0:
        if of_moment > 0.0:
            m3 *= max(-of_force, 0.0) / of_moment
        excess = of_force - max(-of_moment, 0.0)
        if excess > 0.0:
            along = excess / (x * x + y * y)
            f1, f2 = f1 - along * x, f2 - along * y
    return f1, f2, m3
