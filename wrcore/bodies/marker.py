"""Markers: points that are fixed to a body or to the frame that moves along the track."""

from wrcore.bodies.body import OMEGA, STATE_SIZE, VELOCITY
from wrcore.bodies.vector import load
from wrcore.kernels.jit import jit

FRAME = -1
"""Body number of the moving frame, which moves along the track at the speed of the scene."""


@jit(allocates=False, inline="always")
def marker_motion(speed, t, state, rotations, body, local_x, local_y, local_z):
    """Return absolute position (m), arm from the body's centre (m; zero for the frame) and velocity (m/s) of a marker.

    ``local_x``, ``local_y``, ``local_z`` are its coordinates (m) in the axes of a body or of FRAME, which moves along a
    tangent track at ``speed``. All results are in track axes."""
    if body == FRAME:
        return (local_x + speed * t, local_y, local_z), (0.0, 0.0, 0.0), (speed, 0.0, 0.0)
    at = STATE_SIZE * body
    ax = rotations[body, 0, 0] * local_x + rotations[body, 0, 1] * local_y + rotations[body, 0, 2] * local_z
    ay = rotations[body, 1, 0] * local_x + rotations[body, 1, 1] * local_y + rotations[body, 1, 2] * local_z
    az = rotations[body, 2, 0] * local_x + rotations[body, 2, 1] * local_y + rotations[body, 2, 2] * local_z
    (vx, vy, vz), (wx, wy, wz) = load(state, at + VELOCITY), load(state, at + OMEGA)
    place = state[at] + ax, state[at + 1] + ay, state[at + 2] + az
    return place, (ax, ay, az), (vx + wy * az - wz * ay, vy + wz * ax - wx * az, vz + wx * ay - wy * ax)
