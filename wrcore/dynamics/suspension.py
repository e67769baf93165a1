"""Force elements between two bodies."""

from typing import NamedTuple

import numpy as np

from wrcore._jit import jit
from wrcore.dynamics.body import STATE_SIZE
from wrcore.dynamics.track import frame_marker

FRAME = -1
"""Body number of the frame that runs ahead along the track at the scene's speed."""


class SpringDampers(NamedTuple):
    """Linear spring-dampers between two markers, acting along the axes of the second body, for kernels.

    The force on the first body is ``preload - k * (d - d0) - c * d'`` per axis, with d the position of the first
    marker minus that of the second one; the second body gets the opposite force at its own marker.
    """

    bodies: np.ndarray
    """(n, 2) int: first and second body; FRAME for the moving frame."""
    markers: np.ndarray
    """(n, 2, 3): marker positions in body axes, m."""
    stiffness: np.ndarray
    """(n, 3), N/m."""
    damping: np.ndarray
    """(n, 3), N s/m."""
    preload: np.ndarray
    """(n, 3): force on the first body at d = d0, N."""
    rest: np.ndarray
    """(n, 3): d0, m."""


@jit(allocates=False, inline="always")
def marker_motion(track, speed, t, state, rotations, body, local_x, local_y, local_z):
    """Position and velocity of a marker in absolute axes.

    Parameters
    ----------
    track : TrackModel
    speed, t : float
        Speed of the moving frame (m/s) and time (s).
    state, rotations : numpy.ndarray
        State vector and rotation matrices of the bodies; the last one, (n + 1, 3, 3), is the moving frame's.
    body : int
        Body number, or FRAME.
    local_x, local_y, local_z : float
        Marker in the body's axes, m.

    Returns
    -------
    point, arm, velocity : tuple of float
        Position (m), its part relative to the body's centre (m; zero for the frame), and velocity (m/s).
    """
    if body == FRAME:
        zero = (0.0, 0.0, 0.0)
        if track.tangent:
            return (local_x + speed * t, local_y, local_z), zero, (speed, 0.0, 0.0)
        last = rotations.shape[0] - 1
        point, velocity = frame_marker(track, speed, t, local_x, local_y, local_z, rotations, last)
        return point, zero, velocity
    at = STATE_SIZE * body
    ax = rotations[body, 0, 0] * local_x + rotations[body, 0, 1] * local_y + rotations[body, 0, 2] * local_z
    ay = rotations[body, 1, 0] * local_x + rotations[body, 1, 1] * local_y + rotations[body, 1, 2] * local_z
    az = rotations[body, 2, 0] * local_x + rotations[body, 2, 1] * local_y + rotations[body, 2, 2] * local_z
    wx, wy, wz = state[at + 10], state[at + 11], state[at + 12]
    return (
        (state[at] + ax, state[at + 1] + ay, state[at + 2] + az),
        (ax, ay, az),
        (state[at + 7] + wy * az - wz * ay, state[at + 8] + wz * ax - wx * az, state[at + 9] + wx * ay - wy * ax),
    )


@jit(allocates=False, inline="always")
def add_force(body, arm, fx, fy, fz, wrenches):
    """Add a force (N) that acts at ``arm`` (m) from a body's centre to the body's wrench (6,)."""
    if body != FRAME:
        wrenches[body, 0] += fx
        wrenches[body, 1] += fy
        wrenches[body, 2] += fz
        wrenches[body, 3] += arm[1] * fz - arm[2] * fy
        wrenches[body, 4] += arm[2] * fx - arm[0] * fz
        wrenches[body, 5] += arm[0] * fy - arm[1] * fx


@jit(allocates=False, inline="always")
def _along_axis(elements, k, axis, distance, rate):
    """Force of element k along one of its axes, for a distance of its markers and its rate there."""
    stretch = distance - elements.rest[k, axis]
    return elements.preload[k, axis] - elements.stiffness[k, axis] * stretch - elements.damping[k, axis] * rate


@jit(allocates=False)
def spring_damper_forces(elements, track, t, speed, state, rotations, wrenches):
    """Add the forces of all spring-dampers to the wrenches (n, 6) of the bodies."""
    for k in range(elements.bodies.shape[0]):
        i, j = elements.bodies[k, 0], elements.bodies[k, 1]
        mark = elements.markers
        p, arm, v = marker_motion(track, speed, t, state, rotations, i, mark[k, 0, 0], mark[k, 0, 1], mark[k, 0, 2])
        q, other_arm, u = marker_motion(
            track, speed, t, state, rotations, j, mark[k, 1, 0], mark[k, 1, 1], mark[k, 1, 2]
        )
        dx, dy, dz = p[0] - q[0], p[1] - q[1], p[2] - q[2]
        rx, ry, rz = v[0] - u[0], v[1] - u[1], v[2] - u[2]
        if j == FRAME and track.tangent:  # the axes are the absolute ones
            fx = _along_axis(elements, k, 0, dx, rx)
            fy = _along_axis(elements, k, 1, dy, ry)
            fz = _along_axis(elements, k, 2, dz, rz)
        else:
            axes = rotations.shape[0] - 1 if j == FRAME else j
            fx = fy = fz = 0.0
            for axis in range(3):
                ax, ay, az = rotations[axes, 0, axis], rotations[axes, 1, axis], rotations[axes, 2, axis]
                size = _along_axis(elements, k, axis, ax * dx + ay * dy + az * dz, ax * rx + ay * ry + az * rz)
                fx += ax * size
                fy += ay * size
                fz += az * size
        add_force(i, arm, fx, fy, fz, wrenches)
        add_force(j, other_arm, -fx, -fy, -fz, wrenches)
