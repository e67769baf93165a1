"""From rigid-body motion to creepages at a patch."""

from wrcore.kernels.jit import FUSED, jit


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def creepages(vx, vy, vz, wx, wy, wz, px, py, pz, cosine, sine, speed):
    """Creepages and approach speed of a patch on a tangent track.

    The contact frame is (1) forward, (2) lateral in the tangent plane, (3) normal from rail into wheel:
    (1, 0, 0), (0, cos, sin), (0, -sin, cos) of the contact angle.

    Parameters
    ----------
    vx, vy, vz, wx, wy, wz : float
        Velocity of the wheelset's centre (m/s) and its angular velocity (rad/s) in the track frame.
    px, py, pz : float
        Contact point relative to the wheelset's centre, m.
    cosine, sine : float
        Of the contact angle.
    speed : float
        Rolling speed V, m/s, > 0.

    Returns
    -------
    xi, eta, phi : float
        Longitudinal and lateral creepage (-) and spin (1/m), wheel relative to rail.
    approach_speed : float
        Rate of penetration, m/s.
    """
    slowness = 1.0 / speed
    ux = vx + wy * pz - wz * py
    uy = vy + wz * px - wx * pz
    uz = vz + wx * py - wy * px
    xi = ux * slowness
    eta = (uy * cosine + uz * sine) * slowness
    phi = (wz * cosine - wy * sine) * slowness
    return xi, eta, phi, uy * sine - uz * cosine
