"""Markers: points fixed to a body or to the frame that runs ahead along the track."""

from wrcore._jit import jit
from wrcore.dynamics.body import STATE_SIZE
from wrcore.dynamics.track import frame_marker

FRAME = -1
"""Body number of the frame that runs ahead along the track at the scene's speed."""


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
