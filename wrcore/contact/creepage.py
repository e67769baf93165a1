"""Creepages at a contact patch from the rigid-body motion of the wheelset."""

from wrcore.kernels.jit import FUSED, jit


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def creepages(vx, vy, vz, wx, wy, wz, px, py, pz, cosine, sine, speed):
    """Return longitudinal and lateral creepage (-), spin (1/m), and approach speed (m/s) of a patch.

    Creepages are of the wheel relative to the rail, on tangent track at the rolling speed V > 0 (m/s); the approach
    speed is the rate of penetration. Velocity of the wheelset's centre (m/s), its angular velocity (rad/s) and the
    patch relative to the centre (m) are in the track frame. The contact frame is (1) forward, (2) lateral in the
    tangent plane, (3) normal from rail into wheel: (1, 0, 0), (0, cos, sin), (0, -sin, cos) of the contact angle."""
    slowness = 1.0 / speed
    ux = vx + wy * pz - wz * py
    uy = vy + wz * px - wx * pz
    uz = vz + wx * py - wy * px
    xi = ux * slowness
    eta = (uy * cosine + uz * sine) * slowness
    phi = (wz * cosine - wy * sine) * slowness
    return xi, eta, phi, uy * sine - uz * cosine
