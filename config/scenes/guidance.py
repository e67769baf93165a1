"""Guidance of a wheelset whose wheels turn independently of each other, by the torques of its two motors."""

from numba import njit


@njit
def guide(t, inputs, states, parameters, outputs, following):
    """Torques (N m) of the left and of the right wheel; sampled.

    Inputs: arc length (m), y (m), yaw (rad), rates of both (m/s, rad/s), rolling rates left and right (rad/s), speed
    (m/s). States: the torque of the left wheel in the last sample. Parameters: gains of y (N m/m), yaw (N m/rad), their
    rates (N m s/m, N m s/rad) and the difference of rolling rates (N m s/rad); largest torque (N m) and change of it in
    a sample; rolling radius and half the gauge (m); arc lengths (m) at which the curve begins, is full, ends and is
    over; its curvature (1/m); torque per curvature (N m^2) that turns the wheelset against its springs.
    """
    s, y, yaw, vy, yaw_rate, left, right, speed = inputs
    of_y, of_yaw, of_vy, of_yaw_rate, of_rolling, most, change, radius, half_gauge = parameters[:9]
    begin, full, end, over, curvature, ahead = parameters[9:]
    bend = curvature * max(0.0, min(1.0, (s - begin) / (full - begin), (over - s) / (over - end)))
    apart = left - right + 2.0 * half_gauge * bend * speed / radius  # beyond what the rails' lengths ask for
    wanted = ahead * bend + of_y * y + of_yaw * yaw + of_vy * vy + of_yaw_rate * (yaw_rate - speed * bend)
    wanted -= of_rolling * apart
    wanted = max(-most, min(most, wanted))
    wanted = max(states[0] - change, min(states[0] + change, wanted))
    outputs[0], outputs[1] = wanted, -wanted
    following[0] = wanted
