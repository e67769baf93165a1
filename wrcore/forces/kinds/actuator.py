"""A given force along one direction, which whoever steps a session sets, or a sampled control law of the scene."""

from wrcore.forces import law
from wrcore.forces.kind import AT, DIRECTION, MOST, Along, Kind, axis_of, ends_of, number
from wrcore.kernels.jit import jit


@jit(allocates=False)
def given(elements, k, stretch, speed, inner, press):
    """-F, however the ends move, with what control holds as internal state; the power that it puts in counts as
    dissipated, negative."""
    force = -(law.numbers(elements, k)[0] + inner)
    return force, 0.0, 0.0, force * speed


def parts(item):
    """One part."""
    force = item.get("force", 0.0)
    return [Along(ends_of(item), given, axis_of(item), (force,), inner=True, preload=force, odd=False)]


KIND = Kind(
    {"at": AT, "direction": DIRECTION,
     "force": number("the force in N on the first body along the direction (line: pushes the ends apart)", -MOST)},
    ("at", "direction"), {"marker": "X", "color": "#D55E00"}, parts, laws=(given,),
)  # fmt: skip
