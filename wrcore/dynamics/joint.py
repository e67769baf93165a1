"""Joints as constraint equations Phi(q, t) = 0 with their Jacobian D and right-hand side gamma of Eq. (8).

Velocities are v = (r', w) in track axes, so that the velocity constraint reads Phi' = D v + dPhi/dt and the
acceleration constraint D v' = gamma. Each joint below states the three.
"""

from typing import NamedTuple

import numpy as np

from wrcore._jit import jit
from wrcore.dynamics.marker import FRAME, marker_motion

COORDINATE, SPHERICAL = 0, 1
KINDS = {"coordinate": COORDINATE, "spherical": SPHERICAL}
EQUATIONS = {"coordinate": 1, "spherical": 3}


class Joints(NamedTuple):
    """Joints of a model, for kernels."""

    kind: np.ndarray
    """(n,) int: COORDINATE or SPHERICAL."""
    bodies: np.ndarray
    """(n, 2) int: first and second body; FRAME for the moving frame."""
    markers: np.ndarray
    """(n, 2, 3): marker positions in body axes, m."""
    axis: np.ndarray
    """(n,) int: track axis of a prescribed coordinate."""
    equations: int
    """Number of constraint equations in all."""


@jit(allocates=False)
def constraint_equations(joints, track, t, speed, state, rotations, phi, rate, jacobian, gamma, owner):
    """Evaluate all constraints.

    Parameters
    ----------
    joints : Joints
    track : TrackModel
    t, speed : float
        Time (s), speed of the moving frame (m/s).
    state, rotations : numpy.ndarray
        State vector, rotation matrices (n + 1, 3, 3).
    phi, rate, gamma : numpy.ndarray, shape (m,)
        Filled: Phi, Phi' and gamma.
    jacobian : numpy.ndarray, shape (m, 2, 6)
        Filled: block of D for the first and the second body of each equation.
    owner : numpy.ndarray, shape (m, 2), int
        Filled: the bodies of the two blocks.

    Notes
    -----
    *Prescribed coordinate* k of body i's centre, following the frame: Phi = (r_i - p)_k with p = V t + p0 the marker
    on the frame; D = e_k; gamma = 0.

    *Spherical* joint of markers s_i, s_j (track axes): Phi = r_i + s_i - r_j - s_j; Phi' = v_i + w_i x s_i - ... so
    D = [I, -s_i~, -I, s_j~]; gamma = -w_i x (w_i x s_i) + w_j x (w_j x s_j).
    """
    jacobian[:] = 0.0
    mark = joints.markers
    row = 0
    for k in range(joints.kind.shape[0]):
        i, j = joints.bodies[k, 0], joints.bodies[k, 1]
        p, arm, v = marker_motion(track, speed, t, state, rotations, i, mark[k, 0, 0], mark[k, 0, 1], mark[k, 0, 2])
        q, other_arm, u = marker_motion(
            track, speed, t, state, rotations, j, mark[k, 1, 0], mark[k, 1, 1], mark[k, 1, 2]
        )
        distance = (p[0] - q[0], p[1] - q[1], p[2] - q[2])
        speeds = (v[0] - u[0], v[1] - u[1], v[2] - u[2])
        if joints.kind[k] == COORDINATE:
            axis = joints.axis[k]
            phi[row], rate[row], gamma[row] = distance[axis], speeds[axis], 0.0
            jacobian[row, 0, axis] = 1.0
            owner[row, 0], owner[row, 1] = i, FRAME
            row += 1
        else:
            for axis in range(3):
                phi[row + axis], rate[row + axis], gamma[row + axis] = distance[axis], speeds[axis], 0.0
                owner[row + axis, 0], owner[row + axis, 1] = i, j
            if i != FRAME:
                _spherical_blocks(state, i, arm, 1.0, row, 0, jacobian, gamma)
            if j != FRAME:
                _spherical_blocks(state, j, other_arm, -1.0, row, 1, jacobian, gamma)
            row += 3


@jit(allocates=False)
def _spherical_blocks(state, body, arm, sign, row, end, jacobian, gamma):
    """One body's share in a spherical joint: blocks of D and -w x (w x s) in gamma."""
    sx, sy, sz = arm[0], arm[1], arm[2]
    wx, wy, wz = state[13 * body + 10], state[13 * body + 11], state[13 * body + 12]
    for axis in range(3):
        jacobian[row + axis, end, axis] = sign
    jacobian[row, end, 4], jacobian[row, end, 5] = sign * sz, -sign * sy
    jacobian[row + 1, end, 3], jacobian[row + 1, end, 5] = -sign * sz, sign * sx
    jacobian[row + 2, end, 3], jacobian[row + 2, end, 4] = sign * sy, -sign * sx
    along = wx * sx + wy * sy + wz * sz
    square = wx * wx + wy * wy + wz * wz
    gamma[row] -= sign * (wx * along - sx * square)
    gamma[row + 1] -= sign * (wy * along - sy * square)
    gamma[row + 2] -= sign * (wz * along - sz * square)
