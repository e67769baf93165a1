"""Motion of a wheel in its rail's frame: the input of all contact models."""

from typing import NamedTuple

from wrcore.kernels.jit import jit


class WheelMotion(NamedTuple):
    """Motion of a wheelset in the frame of one wheel's rail (x along the rail), curvature and friction of this rail."""

    side: float
    """+1 left, -1 right."""
    y: float
    z: float
    """Position of the wheelset's centre, m."""
    ex: float
    ey: float
    ez: float
    """Unit vector of the axle, pointing left."""
    vx: float
    vy: float
    vz: float
    """Velocity of the centre, m/s."""
    wx: float
    wy: float
    wz: float
    """Angular velocity, rad/s."""
    bend_y: float
    bend_z: float
    """Curvature of the rail's line towards y and z, 1/m; 0 on tangent track."""
    friction: float
    """Coefficient of friction of the rail under the wheel, at zero slip."""


MOTION = WheelMotion(*range(15))
"""Column of each field of `WheelMotion` in an array of motions."""


@jit(allocates=False, forceinline=True)
def motion_of(row):
    """Return the `WheelMotion` of one row of an array of motions."""
    return WheelMotion(
        row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7], row[8], row[9], row[10], row[11], row[12],
        row[13], row[14],
    )  # fmt: skip


@jit(allocates=False, forceinline=True)
def as_left(m):
    """Return the motion of a left wheel: ``m`` itself, or its mirror image if it is that of a right wheel."""
    if m.side > 0.0:
        return m
    return WheelMotion(
        1.0, -m.y, m.z, -m.ex, m.ey, -m.ez, m.vx, -m.vy, m.vz, -m.wx, m.wy, -m.wz, -m.bend_y, m.bend_z, m.friction
    )
