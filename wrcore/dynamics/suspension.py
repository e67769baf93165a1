"""Force elements between two bodies."""

from typing import NamedTuple

import numpy as np

from wrcore._jit import jit
from wrcore.dynamics.marker import FRAME, add_force, marker_motion


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
