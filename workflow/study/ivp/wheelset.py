"""Equations of the problem "Wheelset" of the Test Set for IVP Solvers: two rigid contacts with creep forces.

Simeon, Fuehrer and Rentrop, Surv. Math. Ind. 1 (1991) 1-37: conical wheels on circular rail heads, suspended laterally
and longitudinally, rolling at constant speed. The axes are the problem's: x to the left, y up, z forward. Unknowns are
q = (x, y, z, yaw theta, roll phi), their rates v, the deviation beta of the spin rate, and for either wheel (left, then
right) the multiplier lambda and the contact coordinates psi (about the axle) and xi (along it).

The gap g(q, psi, xi) of a wheel is the height of the rail head above a point of the wheel, at the lateral position of
that point. The point of contact is where g is stationary over psi and xi: the normals are parallel there, which are the
problem's contact conditions. Changes of psi and xi then do not contribute to the gap's gradient D with respect to q.
The constraints are Phi = (g_left, g_right) = 0. Eq. (8) of the multibody code, with the problem's sign of lambda, is

    M v' = f(q, v, lambda) + D^T lambda,    D v' = gamma - 2 alpha Phi' - beta^2 Phi.

f contains the creep forces, which depend on the normal forces N = -lambda sqrt(1 + G'^2) with the derivative G' of the
rail head. Therefore lambda is computed by Newton's method. Arrays and their units: `study.ivp.problem.Work`.
"""

import math

import numpy as np
from numba.typed import List

from wrcore.kernels.jit import jit

_NEWTON = 20
_CONTACT_STEP = 1e-12  # m, rad; both iterations converge quadratically: after such a step the error is rounding
_MULTIPLIER_STEP = 1e-5  # N
_GAP = 1e-15  # m


@jit(allocates=False)
def rail_head(p, x):
    """Return height G (m), first and second derivative (1/m) of the rail heads at the lateral position x (m)."""
    across = abs(x) - p.half_distance - p.rail_radius * math.sin(p.cone_angle)
    up = math.sqrt(p.rail_radius**2 - across * across)
    height = up - p.radius - p.rail_radius * math.cos(p.cone_angle)
    return height, -math.copysign(1.0, x) * across / up, -(p.rail_radius**2) / up**3


@jit(allocates=False)
def wheel_radius(p, xi):
    """Return the radius (m) and its derivative for the conical wheel at xi (m)."""
    tangent = math.tan(p.cone_angle)
    return p.radius + tangent * (p.half_distance - abs(xi)), -math.copysign(tangent, xi)


@jit(allocates=False)
def _turned(turn, along, down, forward):
    """Return the lateral and vertical components of a vector that is given in the wheelset's axes.

    Its components there are along the axle, downwards and forwards."""
    st, ct, sp, cp = turn
    return ct * (along * cp + down * sp) + st * forward, along * sp - down * cp


@jit(allocates=False)
def _turning(turn, yaw_rate, roll_rate, along, down, forward):
    """Return the rates of the lateral and vertical components of a vector that is fixed in the rotating wheelset."""
    st, ct, sp, cp = turn
    out, out_rate = along * cp + down * sp, roll_rate * (down * cp - along * sp)
    return ct * out_rate + yaw_rate * (ct * forward - st * out), roll_rate * out


@jit(allocates=False)
def stationary_gap(p, state, turn, psi, xi):
    """Return the derivatives of the gap with respect to a wheel's contact coordinates.

    They are g_xi, g_psi, g_xixi, g_xipsi and g_psipsi."""
    radius, taper = wheel_radius(p, xi)
    s, c = math.sin(psi), math.cos(psi)
    x, _ = _turned(turn, xi, radius * c, -radius * s)
    x_xi, y_xi = _turned(turn, 1.0, taper * c, -taper * s)
    x_psi, y_psi = _turned(turn, 0.0, -radius * s, -radius * c)
    x_2, y_2 = _turned(turn, 0.0, -radius * c, radius * s)
    _, slope, bend = rail_head(p, state[0] + x)
    first, second = slope * x_xi - y_xi, slope * x_psi - y_psi
    mixed = bend * x_xi * x_psi + taper / radius * second
    return first, second, bend * x_xi * x_xi, mixed, bend * x_psi * x_psi + slope * x_2 - y_2


@jit(allocates=False)
def touch(p, k, state, turn, work):
    """Find the contact of wheel k by Newton's method and fill in its gap, gap rate, D, gamma and rail slope.

    With the contact coordinates s = (xi, psi) as functions of q, H = g_ss and m = g_sq v: s' = -H^-1 m and
    -gamma = v^T g_qq v - m^T H^-1 m.
    """
    psi, xi = work.contact[k]
    for _ in range(_NEWTON):
        g_xi, g_psi, h11, h12, h22 = stationary_gap(p, state, turn, psi, xi)
        determinant = h11 * h22 - h12 * h12
        d_xi, d_psi = (h12 * g_psi - h22 * g_xi) / determinant, (h12 * g_xi - h11 * g_psi) / determinant
        psi, xi = psi + d_psi, xi + d_xi
        work.counters[1] += 1
        if abs(d_psi) + abs(d_xi) < _CONTACT_STEP:
            break
    if math.isfinite(psi + xi):  # a trial step that diverges must not change the start of the next search
        work.contact[k, 0], work.contact[k, 1] = psi, xi
    st, ct, sp, cp = turn
    radius, taper = wheel_radius(p, xi)
    s, c = math.sin(psi), math.cos(psi)
    down, forward = radius * c, -radius * s
    x, y = _turned(turn, xi, down, forward)
    height, slope, bend = rail_head(p, state[0] + x)
    row, out = work.jacobian[k], xi * cp + down * sp
    row[0], row[1], row[2] = slope, -1.0, 0.0
    row[3] = slope * (ct * forward - st * out)
    row[4] = slope * ct * (down * cp - xi * sp) - out
    work.phi[k] = height - state[1] - y
    work.phi_rate[k] = row[0] * state[5] - state[6] + row[3] * state[8] + row[4] * state[9]
    work.rail[k, 0], work.rail[k, 1] = slope, bend
    yaw, roll = state[8], state[9]
    x_xi, _ = _turned(turn, 1.0, taper * c, -taper * s)
    x_psi, _ = _turned(turn, 0.0, forward, -down)
    vx_xi, vy_xi = _turning(turn, yaw, roll, 1.0, taper * c, -taper * s)
    vx_psi, vy_psi = _turning(turn, yaw, roll, 0.0, forward, -down)
    vx = _turning(turn, yaw, roll, xi, down, forward)[0] + state[5]
    out_rate = roll * (down * cp - xi * sp)
    ax = -ct * (roll * roll + yaw * yaw) * out - 2.0 * st * yaw * out_rate - st * yaw * yaw * forward
    m_xi, m_psi = bend * vx * x_xi + slope * vx_xi - vy_xi, bend * vx * x_psi + slope * vx_psi - vy_psi
    curved = (h22 * m_xi * m_xi - 2.0 * h12 * m_xi * m_psi + h11 * m_psi * m_psi) / determinant
    work.gamma[k] = curved - bend * vx * vx - slope * ax + roll * out_rate


@jit(allocates=False)
def creep_arguments(p, k, state, turn, work):
    """Fill the arguments of the creep law of wheel k that do not depend on its normal force."""
    st, ct, sp, cp = turn
    psi, xi = work.contact[k]
    radius, taper = wheel_radius(p, xi)
    down, forward = radius * math.cos(psi), -radius * math.sin(psi)
    out, up = xi * cp + down * sp, xi * sp - down * cp
    slope, bend = work.rail[k]
    cos_angle = 1.0 / math.sqrt(1.0 + slope * slope)
    sin_angle = slope * cos_angle
    s, c = math.sin(state[3] / cos_angle), math.cos(state[3] / cos_angle)
    vx, vy, vz, yaw, roll = state[5], state[6], state[7], state[8], state[9]
    spin = p.speed / p.radius + state[10]
    k1 = -spin * (s * down - c * sp * forward) + vx - yaw * (s * out - c * forward) - roll * c * up
    k2 = -spin * cp * forward + vy + roll * out
    k3 = -spin * (c * down + s * sp * forward) + p.speed + vz - yaw * (c * out + s * forward) + roll * s * up
    rolling = 0.5 * math.sqrt((k1 - 2.0 * vx) ** 2 + (k2 - 2.0 * vy) ** 2 + (k3 - 2.0 * (vz + p.speed)) ** 2)
    curvatures = 0.5 / (radius * math.sqrt(1.0 + taper * taper)) - 0.5 * bend * cos_angle**3
    volume = 1.5 * (1.0 - p.poisson_ratio) * p.hertz_e
    volume /= p.pi * curvatures * p.shear_modulus * math.sqrt(p.hertz_g)  # c^3 / N
    scale = p.shear_modulus / (p.friction * rolling)
    area = scale * volume ** (2.0 / 3.0)
    creep = work.creep[k]
    creep[0] = area * p.c11 * (s * k1 + c * k3)
    creep[1] = area * p.c22 * (c * cos_angle * k1 + sin_angle * k2 - s * cos_angle * k3)
    creep[2] = scale * volume * p.c23 * (cos_angle * yaw - sin_angle * spin)
    for i in range(2):
        fx, fy, fz = (s, 0.0, c) if i == 0 else (c * cos_angle, sin_angle, -s * cos_angle)
        part = work.traction[k, i]
        part[0], part[1], part[2] = fx, fy, fz
        part[3] = (forward * ct * cp - xi * st) * fx + forward * sp * fy - (xi * ct + forward * st * cp) * fz
        part[4] = -up * ct * fx + out * fy + up * st * fz
        part[5] = (forward * ct * sp - down * st) * fx - forward * cp * fy - (down * ct + forward * st * sp) * fz


@jit(allocates=False)
def tangential(p, creep, normal):
    """Return longitudinal and lateral creep force, and their derivatives with respect to the normal force.

    With n = N^(-1/3): T = -mu N (tanh(a_1 n), tanh(a_2 n + a_3)), scaled to mu N if its magnitude is larger.
    """
    n = normal ** (-1.0 / 3.0)
    t1, t2 = math.tanh(creep[0] * n), math.tanh(creep[1] * n + creep[2])
    d1, d2 = -creep[0] * n / 3.0 * (1.0 - t1 * t1), -creep[1] * n / 3.0 * (1.0 - t2 * t2)  # N dt/dN
    size = math.sqrt(t1 * t1 + t2 * t2)
    if size > 1.0:
        t1, t2, d1, d2 = t1 / size, t2 / size, d1 / size, d2 / size
        along = t1 * d1 + t2 * d2
        d1, d2 = d1 - along * t1, d2 - along * t2
    mu = p.friction
    return -mu * normal * t1, -mu * normal * t2, -mu * (t1 + d1), -mu * (t2 + d2)


@jit(allocates=False)
def _response(p, cp, row, force):
    """Return the product of one row of D, M^-1 and a generalised force."""
    plane = (row[0] * force[0] + row[1] * force[1] + row[2] * force[2]) / p.mass
    return plane + (row[3] * force[3] / cp + row[4] * force[4]) / p.inertia_across


@jit(allocates=False)
def _solve(matrix, residual):
    """Return the solution -matrix^-1 residual of two linear equations."""
    determinant = matrix[0, 0] * matrix[1, 1] - matrix[0, 1] * matrix[1, 0]
    first = matrix[0, 1] * residual[1] - matrix[1, 1] * residual[0]
    second = matrix[1, 0] * residual[0] - matrix[0, 0] * residual[1]
    return first / determinant, second / determinant


@jit(allocates=False)
def solve_multipliers(p, cp, work):
    """Solve D M^-1 (f + D^T lambda) = gamma - 2 alpha Phi' - beta^2 Phi for the multipliers by Newton's method.

    ``work.force`` contains f without creep forces at the start, and all forces at the end. Each column of the matrix
    belongs to one wheel, whose creep forces depend only on its normal force.
    """
    force, multipliers, jacobian = work.force, work.multipliers, work.jacobian
    residual, matrix = work.residual, work.matrix
    start = multipliers[0], multipliers[1]
    for _ in range(_NEWTON):
        for j in range(2):
            feedback = 2.0 * p.alpha * work.phi_rate[j] + p.beta * p.beta * work.phi[j]
            residual[j] = _response(p, cp, jacobian[j], force) - work.gamma[j] + feedback
        for k in range(2):
            lift = math.sqrt(1.0 + work.rail[k, 0] ** 2)
            long, lat, d_long, d_lat = tangential(p, work.creep[k], -multipliers[k] * lift)
            for j in range(2):
                own = _response(p, cp, jacobian[j], jacobian[k])
                to_long = _response(p, cp, jacobian[j], work.traction[k, 0])
                to_lat = _response(p, cp, jacobian[j], work.traction[k, 1])
                residual[j] += own * multipliers[k] + to_long * long + to_lat * lat
                matrix[j, k] = own - lift * (to_long * d_long + to_lat * d_lat)
        left, right = _solve(matrix, residual)
        multipliers[0] += left
        multipliers[1] += right
        work.counters[2] += 1
        if abs(left) + abs(right) < _MULTIPLIER_STEP:
            break
    for k in range(2):
        normal = -multipliers[k] * math.sqrt(1.0 + work.rail[k, 0] ** 2)
        long, lat, _, _ = tangential(p, work.creep[k], normal)
        for i in range(6):
            force[i] += long * work.traction[k, 0, i] + lat * work.traction[k, 1, i]
        for i in range(5):
            force[i] += multipliers[k] * jacobian[k, i]
    if not math.isfinite(multipliers[0] + multipliers[1]):
        multipliers[0], multipliers[1] = start


@jit(allocates=False)
def _displace(p, cp, values, part, work):
    """Add a displacement to five numbers so that D times them changes by minus ``values``.

    The displacement has minimum norm in the metric of the mass matrix."""
    for j in range(2):
        for k in range(2):
            work.matrix[j, k] = _response(p, cp, work.jacobian[j], work.jacobian[k])
    left, right = _solve(work.matrix, values)
    for i in range(5):
        mass = p.mass if i < 3 else p.inertia_across * (cp if i == 3 else 1.0)
        part[i] += (left * work.jacobian[0, i] + right * work.jacobian[1, i]) / mass


@jit(allocates=False)
def project(p, state, work):
    """Project a state (11,) onto Phi = 0 and D v = 0, orthogonally in the metric of the mass matrix."""
    for _ in range(_NEWTON):
        turn = sines(state)
        for k in range(2):
            touch(p, k, state, turn, work)
        if not abs(work.phi[0]) + abs(work.phi[1]) > _GAP:
            break
        _displace(p, turn[3], work.phi, state[:5], work)
    _displace(p, turn[3], work.phi_rate, state[5:10], work)


@jit(allocates=False)
def sines(state):
    """Return sine and cosine of yaw, and sine and cosine of roll."""
    return math.sin(state[3]), math.cos(state[3]), math.sin(state[4]), math.cos(state[4])


@jit(allocates=False)
def fill_rate(t, state, p, work, rate):
    """Fill the time derivative ``rate`` (11,) of the state, and solve for contacts and multipliers in ``work``."""
    turn = sines(state)
    _, _, sp, cp = turn
    work.counters[0] += 1
    for k in range(2):
        touch(p, k, state, turn, work)
        creep_arguments(p, k, state, turn, work)
    force, yaw, roll = work.force, state[8], state[9]
    spin = p.speed / p.radius + state[10]
    across, axle = p.inertia_across, p.inertia_axle
    spring = 2.0 * p.spring_arm**2 * p.stiffness_longitudinal * state[3]
    force[0] = -2.0 * p.stiffness_lateral * state[0]
    force[1] = -p.mass * p.gravity
    force[2] = -2.0 * p.stiffness_longitudinal * state[2]
    force[3] = across * yaw * roll * sp - axle * spin * roll - (axle - across) * yaw * roll * sp - spring * cp
    force[4] = axle * spin * yaw * cp + (axle - across) * yaw * yaw * sp * cp
    force[5] = -axle * yaw * roll * cp - spring * sp
    solve_multipliers(p, cp, work)
    for i in range(5):
        rate[i] = state[5 + i]
    for i in range(3):
        rate[5 + i] = force[i] / p.mass
    rate[8] = force[3] / (across * cp)
    rate[9] = force[4] / across
    rate[10] = (force[5] - axle * sp * rate[8]) / axle


@jit
def _rate_of_boxed(t, state, box):
    p, work = box[0]
    rate = np.empty_like(state)
    fill_rate(t, state, p, work, rate)
    return rate


def right_hand_side(p, work):
    """Return the equations as ``function(t, state)`` for a solver written in Python; see
    `wrcore.equations.equations_of_motion`."""
    box = List()
    box.append((p, work))
    return lambda t, state: _rate_of_boxed(t, state, box)


@jit(allocates=False)
def _keep_worst(work, worst):
    worst[0] = max(worst[0], abs(work.phi[0]), abs(work.phi[1]))
    worst[1] = max(worst[1], abs(work.phi_rate[0]), abs(work.phi_rate[1]))


@jit
def run_pair(a, b, e, p, work, state, times, history, rtol, atol, projected):
    """Integrate with an explicit embedded pair; return the numbers of accepted and of rejected steps.

    The last stage of the pair is the first of the next step. The tableau is a (s, s), b (s,) and the weights e (s + 1,)
    of the error estimate, which has the order s - 2. The number of steps is negative if the step size falls below the
    resolution of time.

    The state (11,) is overwritten with that at the last of the increasing times (n,), s. ``history`` (n, 2) is filled
    with the maximum violations abs(Phi) (m) and abs(Phi') (m/s) of the two constraints between successive times. If
    ``projected``, the state is projected after each step.
    """
    stages, n = b.shape[0], state.shape[0]
    k, trial, worst = np.zeros((stages + 1, n)), np.zeros(n), np.zeros(2)
    t, h, at, steps, rejected = times[0], 1e-5 * (times[-1] - times[0]), 0, 0, 0
    fill_rate(t, state, p, work, k[0])
    _keep_worst(work, worst)
    while True:
        while at < times.shape[0] and t >= times[at]:
            history[at] = worst
            worst[:] = 0.0
            at += 1
        if at == times.shape[0]:
            return steps, rejected
        last = h >= times[-1] - t
        h = min(h, times[-1] - t)
        for i in range(1, stages + 1):
            weights = b if i == stages else a[i]
            for m in range(n):
                trial[m] = state[m]
                for j in range(i):
                    trial[m] += h * weights[j] * k[j, m]
            fill_rate(t, trial, p, work, k[i])
        error = 0.0
        for m in range(n):
            part = 0.0
            for j in range(stages + 1):
                part += h * e[j] * k[j, m]
            error += (part / (atol + rtol * max(abs(state[m]), abs(trial[m])))) ** 2
        error = math.sqrt(error / n)
        accepted = error <= 1.0
        if accepted:
            if projected:
                project(p, trial, work)
                fill_rate(t, trial, p, work, k[stages])
            state[:], k[0], t, steps = trial, k[stages], times[-1] if last else t + h, steps + 1
            _keep_worst(work, worst)
        else:
            rejected += 1
        factor = 0.9 * error ** (-1.0 / (stages - 1)) if math.isfinite(error) else 0.2
        h *= min(max(factor, 0.2), 5.0 if accepted else 1.0)
        if h < 1e-14 * times[-1]:
            return -1, rejected
