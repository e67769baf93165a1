"""Lift of a wheel by the contact damping, and overlaps of the lifted wheel.

The damping factor acts as on an ellipse: the elastic approach of the half-spaces is c_d^(2/3) delta, and the wheel is
lifted along the contact normal by the remainder of the penetration delta. Depth, normal and approach speed come from
:mod:`wrcore.contact.search.approach`.
"""

from typing import NamedTuple

from wrcore.contact.hertz import damping_factor, inverse_cube_root
from wrcore.contact.search import reduction
from wrcore.contact.search.approach import approach_of, pressed_together
from wrcore.contact.search.detection import find_patches
from wrcore.contact.search.strip import make_pose
from wrcore.kernels.jit import FUSED, jit


class Lift(NamedTuple):
    """Lift of a wheel by the damping: a share of the depth (m), along the normal with this cosine and sine."""

    share: float
    depth: float
    cosine: float
    sine: float


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def lift_share(model, approach):
    """Share of the depth by which the damping lifts a wheel at an ``approach`` speed (m/s)."""
    factor = damping_factor(approach, model.damping, model.damping_speed)
    return 1.0 - factor * inverse_cube_root(factor)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def lift_of(model, m, pressed):
    """Return the `Lift` of a wheel from the moments ``pressed`` of its overlaps and its motion ``m``."""
    depth, cosine, sine, approach = approach_of(pressed, m)
    return Lift(lift_share(model, approach), depth, cosine, sine)


@jit(allocates=False, fastmath=FUSED)
def _overlaps_above(model, m, height, lift, spatial, ends, rows):
    """Return the `Pose` of a wheel lifted by ``height`` (m), and first and last of its overlaps between two ``ends``.

    The ends are coordinates on the wheel's profile (m); the last index is exclusive. Fills ``rows``."""
    low, y, z = 0, m.y - height * lift.sine, m.z + height * lift.cosine
    pose = make_pose(1.0, y, z, m.ex, m.ey, m.ez, spatial)
    high = count = find_patches(model.geometry, 1.0, y, z, m.ex, m.ey, m.ez, spatial, reduction.MOMENT, rows)
    while low < count and not ends[0] < rows[low, reduction.U_WHEEL] < ends[1]:
        low += 1
    while high > low and not ends[0] < rows[high - 1, reduction.U_WHEEL] < ends[1]:
        high -= 1
    return pose, low, high


@jit(allocates=False, fastmath=FUSED)
def lifted(model, m, lean, pressed, lift, spatial, ends, work):
    """Fill ``work.rows`` with the overlaps of a lifted wheel between two ``ends`` on its profile (m).

    Returns (pose, first, last), with ``last`` exclusive. The height is found such that M0^0.4 of the overlap falls by
    the share of the lift, where M0 is the moment ``pressed.square``. Of two steps the first is exact for a parabola."""
    rest, height = 1.0 - lift.share, lift.share * lift.depth
    pose, low, high = _overlaps_above(model, m, height, lift, spatial, ends, work.rows)
    if high > low:
        now = pressed_together(model.geometry, pose, spatial, lean, work.rows, low, high, work.moments)
        height += ((now.square / pressed.square) ** 0.4 - rest) * lift.depth
        pose, low, high = _overlaps_above(model, m, height, lift, spatial, ends, work.rows)
    return pose, low, high
