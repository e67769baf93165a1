"""Force elements between two bodies."""

from typing import NamedTuple

import numpy as np

from wrcore._jit import jit
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


@jit
def marker_motion(track, body, local, t, speed, state, rotations, point, arm, velocity):
    """Position and velocity of a marker in the track frame.

    Parameters
    ----------
    track : TrackModel
    body : int
        Body number, or FRAME.
    local : numpy.ndarray, shape (3,)
        Marker in body axes, m.
    t, speed : float
        Time (s) and speed of the moving frame (m/s).
    state, rotations : numpy.ndarray
        State vector and rotation matrices of the bodies; the last one, (n + 1, 3, 3), is the moving frame's.
    point, arm, velocity : numpy.ndarray, shape (3,)
        Filled: position (m), its part relative to the body's centre (m), and velocity (m/s).
    """
    if body == FRAME and not track.tangent:
        frame_marker(track, speed, t, local, point, velocity, rotations[rotations.shape[0] - 1])
        return
    if body == FRAME:
        point[0], point[1], point[2] = local[0] + speed * t, local[1], local[2]
        velocity[0], velocity[1], velocity[2] = speed, 0.0, 0.0
        return
    at = 13 * body
    matrix = rotations[body]
    for i in range(3):
        arm[i] = matrix[i, 0] * local[0] + matrix[i, 1] * local[1] + matrix[i, 2] * local[2]
        point[i] = state[at + i] + arm[i]
    wx, wy, wz = state[at + 10], state[at + 11], state[at + 12]
    velocity[0] = state[at + 7] + wy * arm[2] - wz * arm[1]
    velocity[1] = state[at + 8] + wz * arm[0] - wx * arm[2]
    velocity[2] = state[at + 9] + wx * arm[1] - wy * arm[0]


@jit
def add_force(body, arm, force, sign, wrenches):
    """Add ``sign * force`` (3,), acting at ``arm`` from the body's centre, to the body's wrench (6,)."""
    if body == FRAME:
        return
    fx, fy, fz = sign * force[0], sign * force[1], sign * force[2]
    wrench = wrenches[body]
    wrench[0] += fx
    wrench[1] += fy
    wrench[2] += fz
    wrench[3] += arm[1] * fz - arm[2] * fy
    wrench[4] += arm[2] * fx - arm[0] * fz
    wrench[5] += arm[0] * fy - arm[1] * fx


@jit
def _along_axis(elements, k, axis, stretch, rate):
    """Force of element k along one of its axes."""
    return elements.preload[k, axis] - elements.stiffness[k, axis] * stretch - elements.damping[k, axis] * rate


@jit
def spring_damper_forces(elements, track, t, speed, state, rotations, wrenches, scratch):
    """Add the forces of all spring-dampers to the wrenches (n, 6) of the bodies; ``scratch`` is (7, 3)."""
    for k in range(elements.bodies.shape[0]):
        i, j = elements.bodies[k, 0], elements.bodies[k, 1]
        marker_motion(track, i, elements.markers[k, 0], t, speed, state, rotations, scratch[0], scratch[1], scratch[2])
        marker_motion(track, j, elements.markers[k, 1], t, speed, state, rotations, scratch[3], scratch[4], scratch[5])
        force = scratch[6]
        if j == FRAME and track.tangent:  # the axes are the absolute ones
            for axis in range(3):
                stretch = scratch[0, axis] - scratch[3, axis] - elements.rest[k, axis]
                rate = scratch[2, axis] - scratch[5, axis]
                force[axis] = _along_axis(elements, k, axis, stretch, rate)
        else:
            axes = rotations[j]  # of the second body; the frame's is the last one
            force[:] = 0.0
            for axis in range(3):
                stretch, rate = -elements.rest[k, axis], 0.0
                for m in range(3):
                    stretch += axes[m, axis] * (scratch[0, m] - scratch[3, m])
                    rate += axes[m, axis] * (scratch[2, m] - scratch[5, m])
                size = _along_axis(elements, k, axis, stretch, rate)
                for m in range(3):
                    force[m] += axes[m, axis] * size
        add_force(i, scratch[1], force, 1.0, wrenches)
        add_force(j, scratch[4], force, -1.0, wrenches)
