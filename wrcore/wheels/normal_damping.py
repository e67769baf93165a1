"""How far the damping lifts a wheel, and which overlaps the lifted wheel has.

The damping factor acts as on an ellipse: the half-space sees the elastic approach c_d^(2/3) delta, and the wheel is
lifted along the contact normal by the rest; how deep, along which normal and how fast:
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
    """What the damping lifts a wheel by: a share of the depth (m) along the normal."""

    share: float
    depth: float
    cosine: float
    sine: float


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def lift_share(model, approach):
    """Share of its depth by which the damping lifts a wheel."""
    factor = damping_factor(approach, model.damping, model.damping_speed)
    return 1.0 - factor * inverse_cube_root(factor)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def lift_of(model, m, pressed):
    """`Lift` of a wheel whose overlaps have ``pressed``."""
    depth, cosine, sine, approach = approach_of(pressed, m)
    return Lift(lift_share(model, approach), depth, cosine, sine)


@jit(allocates=False, fastmath=FUSED)
def _overlaps_above(model, m, height, lift, spatial, ends, rows):
    """Pose of a wheel lifted by a ``height``, and which of its overlaps lie between two ends on its profile."""
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
    """Overlaps of a lifted wheel between two ``ends`` on its profile (m), into ``work.rows``: (pose, first, last).

    M0^0.4 of what has ``pressed`` falls by the share of the lift: the first of two steps is right for a parabola."""
    rest, height = 1.0 - lift.share, lift.share * lift.depth
    pose, low, high = _overlaps_above(model, m, height, lift, spatial, ends, work.rows)
    if high > low:
        now = pressed_together(model.geometry, pose, spatial, lean, work.rows, low, high, work.moments)
        height += ((now.square / pressed.square) ** 0.4 - rest) * lift.depth
        pose, low, high = _overlaps_above(model, m, height, lift, spatial, ends, work.rows)
    return pose, low, high
