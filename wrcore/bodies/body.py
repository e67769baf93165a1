"""Rigid bodies in absolute coordinates with Euler parameters.

State of one body, 13 numbers: position r (3), Euler parameters p = (e0, e1, e2, e3), velocity v (3) and angular
velocity w (3), the last two in track axes. The rotation matrix A(p) turns body axes into track axes.

A wheelset is a body of revolution that spins about its axle. Its frame does not spin: the Euler parameters follow
w - (w . e) e, with e the axle's direction. No force of the model depends on the angle of spin, because inertia, wheel
surfaces and axle boxes have the axle as symmetry axis. The parameters change slowly and stay accurate at any speed.

References
----------
Nikravesh, Computer-Aided Analysis of Mechanical Systems (1988), chapters 6 and 8 (Euler parameters).
"""

import math

import numpy as np

from wrcore.kernels.jit import FUSED, jit

STATE_SIZE = 13
POSITION, EULER, VELOCITY, OMEGA = 0, 3, 7, 10


def euler_parameters(roll, pitch, yaw):
    """Return Euler parameters, shape (..., 4), of the rotations Rz(yaw) Rx(roll) Ry(pitch); the angles (rad) broadcast.

    The pitch rotation is applied first, about the body's lateral axis, so that it is the spin of a wheelset."""
    (cr, sr), (cp, sp), (cy, sy) = ((np.cos(0.5 * angle), np.sin(0.5 * angle)) for angle in (roll, pitch, yaw))
    # quaternion product (cy, 0, 0, sy) (cr, sr, 0, 0) (cp, 0, sp, 0)
    e0, e1, e2, e3 = cy * cr, cy * sr, sy * sr, sy * cr
    return np.stack([e0 * cp - e2 * sp, e1 * cp - e3 * sp, e0 * sp + e2 * cp, e1 * sp + e3 * cp], axis=-1)


def euler_of(matrix):
    """Return the Euler parameters (4,), with e0 >= 0, of a rotation matrix (3, 3)."""
    (a, b, c), (d, e, f), (g, h, i) = np.asarray(matrix, float)
    squares = np.array([1.0 + a + e + i, 1.0 + a - e - i, 1.0 - a + e - i, 1.0 - a - e + i])  # 4 e_k^2
    k = int(np.argmax(squares))
    rows = [
        [squares[0], h - f, c - g, d - b], [h - f, squares[1], b + d, c + g],
        [c - g, b + d, squares[2], f + h], [d - b, c + g, f + h, squares[3]],
    ]  # fmt: skip
    p = np.array(rows[k]) / (2.0 * math.sqrt(squares[k]))
    return p if p[0] >= 0.0 else -p


def matrix_of(p):
    """Return the rotation matrix (3, 3) of Euler parameters (4,)."""
    matrix = np.empty((3, 3))
    rotation_matrix(np.concatenate([np.zeros(3), p]), 0, matrix)
    return matrix


def angles(p):
    """Return roll, pitch and yaw (rad) of Euler parameters (..., 4), the inverse of :func:`euler_parameters`."""
    e0, e1, e2, e3 = np.moveaxis(np.asarray(p, float), -1, 0)
    norm = e0**2 + e1**2 + e2**2 + e3**2
    roll = np.arcsin(np.clip(2.0 * (e2 * e3 + e0 * e1) / norm, -1.0, 1.0))
    yaw = np.arctan2(-2.0 * (e1 * e2 - e0 * e3), norm - 2.0 * (e1**2 + e3**2))
    pitch = np.arctan2(-2.0 * (e1 * e3 - e0 * e2), norm - 2.0 * (e1**2 + e2**2))
    return roll, pitch, yaw


@jit(allocates=False, fastmath=FUSED)
def rotation_matrix(state, at, matrix):
    """Write the rotation matrix A(p) of the body whose state starts at ``at`` into ``matrix`` (3, 3).

    The matrix is orthogonal for any norm of p."""
    e0, e1, e2, e3 = state[at + 3], state[at + 4], state[at + 5], state[at + 6]
    two = 2.0 / (e0 * e0 + e1 * e1 + e2 * e2 + e3 * e3)
    matrix[0, 0] = 1.0 - two * (e2 * e2 + e3 * e3)
    matrix[0, 1] = two * (e1 * e2 - e0 * e3)
    matrix[0, 2] = two * (e1 * e3 + e0 * e2)
    matrix[1, 0] = two * (e1 * e2 + e0 * e3)
    matrix[1, 1] = 1.0 - two * (e1 * e1 + e3 * e3)
    matrix[1, 2] = two * (e2 * e3 - e0 * e1)
    matrix[2, 0] = two * (e1 * e3 - e0 * e2)
    matrix[2, 1] = two * (e2 * e3 + e0 * e1)
    matrix[2, 2] = 1.0 - two * (e1 * e1 + e2 * e2)


@jit(allocates=False, fastmath=FUSED)
def euler_rates(state, at, wx, wy, wz, alpha, rate):
    """Write the rates of the Euler parameters, p' = 1/2 E(p)^T w with w in track axes, into ``rate``.

    The norm p . p = 1 is an invariant of this equation. The term alpha (1 - p . p) p removes the error that the
    integrator adds to the norm (Baumgarte's feedback for a first-order equation)."""
    e0, e1, e2, e3 = state[at + 3], state[at + 4], state[at + 5], state[at + 6]
    correction = alpha * (1.0 - e0 * e0 - e1 * e1 - e2 * e2 - e3 * e3)
    rate[at + 3] = 0.5 * (-e1 * wx - e2 * wy - e3 * wz) + correction * e0
    rate[at + 4] = 0.5 * (e0 * wx - e2 * wz + e3 * wy) + correction * e1
    rate[at + 5] = 0.5 * (e0 * wy + e1 * wz - e3 * wx) + correction * e2
    rate[at + 6] = 0.5 * (e0 * wz - e1 * wy + e2 * wx) + correction * e3
