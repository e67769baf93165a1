"""A given force along one direction, set by the caller of a session or by a sampled control law of the scene."""

from wrcore.forces import law
from wrcore.forces.kind import AT, DIRECTION, MOST, Along, Kind, axis_of, ends_of, number
from wrcore.kernels.jit import jit


@jit(allocates=False)
def given(elements, k, stretch, speed, inner, press):
    """Return the force -F of an actuator, which does not depend on the motion of its ends.

    The internal state is the force that the control law sets. The power input counts as negative dissipated power."""
    force = -(law.numbers(elements, k)[0] + inner)
    return force, 0.0, 0.0, force * speed


def parts(item):
    """Return one part, the given force along the direction."""
    force = item.get("force", 0.0)
    return [Along(ends_of(item), given, axis_of(item), (force,), inner=True, preload=force, odd=False)]


KIND = Kind(
    {"at": AT, "direction": DIRECTION,
     "force": number("the force in N on the first body along the direction (line: pushes the ends apart)", -MOST)},
    ("at", "direction"), {"marker": "X", "color": "#D55E00"}, parts, laws=(given,),
)  # fmt: skip
