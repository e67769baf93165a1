"""Steps from a wheel's motion to its contact forces that are common to all contact models."""

import math

from wrcore.contact.search.detection import AUTO, SPATIAL, find_patches, planar_error_bound
from wrcore.contact.search.strip import changes_along, leaning
from wrcore.kernels.handles import call_address
from wrcore.kernels.jit import FUSED, jit
from wrcore.wheels.motion import WheelMotion


@jit(allocates=False, forceinline=True)
def press_wheels(model, work, mode):
    """Compute forces and moments of the rails on all wheels from the motions in ``work``, by the model's kernel."""
    call_address(
        model.kernels.wheel_forces_kernel, model.contact, work.motions, work.patches, work.counts, work.bounds,
        work.rail_wrenches, work.counters, work.strips, mode,
    )  # fmt: skip


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def detect_patches(model, m, rows):
    """Fill ``rows`` with the contact patches of a wheel by the model's detection.

    Returns the number of patches, the error bound of planar detection (m; 0 unless detection is AUTO), and whether
    detection was spatial."""
    bound, spatial = 0.0, model.detection == SPATIAL
    ex, ey, ez = m.side * m.ex, m.side * m.ey, m.side * m.ez
    if model.detection == AUTO:
        bound = planar_error_bound(model.geometry, m.side, m.y, m.z, ex, ey, ez)
        spatial = bound > model.detection_tolerance
    count = find_patches(model.geometry, m.side, m.y, m.z, ex, ey, ez, spatial, model.reduction, rows)
    return count, bound, spatial


@jit(allocates=False, forceinline=True)
def falling(model, friction, xi, eta, speed):
    """Coefficient of friction mu0 ((1 - A) exp(-B w) + A) at the slip velocity w of a patch (Polach, Wear 258 (2005)
    992).

    The slip velocity is that of the patch's reference point, without spin. With a user's friction law, mu0 is
    multiplied by a factor interpolated between samples at intervals of 1/B."""
    ratio = model.friction_ratio
    if ratio == 1.0:
        return friction
    slip = speed * math.sqrt(xi * xi + eta * eta)
    factors = model.friction_factors
    if factors.shape[0] > 0:
        place = min(slip * model.friction_decay, factors.shape[0] - 1.001)
        k = int(place)
        return friction * (factors[k] + (place - k) * (factors[k + 1] - factors[k]))
    return friction * ((1.0 - ratio) * math.exp(-model.friction_decay * slip) + ratio)


@jit(allocates=False, forceinline=True)
def leaning_motion(geometry, m, lean):
    """Return the motion with its velocities in axes inclined by ``lean``, see `wrcore.contact.search.strip.lean_at`."""
    if not changes_along(geometry):
        return m
    vx, vz = leaning(geometry, lean, m.vx, m.vz)
    wx, wz = leaning(geometry, lean, m.wx, m.wz)
    return WheelMotion(
        m.side, m.y, m.z, m.ex, m.ey, m.ez, vx, m.vy, vz, wx, m.wy, wz, m.bend_y, m.bend_z, m.friction
    )  # fmt: skip
