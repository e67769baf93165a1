"""A spring and a damper along the line between the two ends."""

from wrcore.forces import law
from wrcore.forces.kind import AT, MOST, Along, Kind, ends_of, number
from wrcore.kernels.jit import FUSED, jit


@jit(allocates=False, fastmath=FUSED)
def linear(elements, k, stretch, speed, inner, press):
    """Return the force k x + c x' - F0 with the preload F0, which pushes the ends apart."""
    stiffness, damping, preload = law.numbers(elements, k)[:3]
    stored = 0.5 * stiffness * (stretch * stretch) - preload * stretch
    return stiffness * stretch + damping * speed - preload, 0.0, stored, damping * (speed * speed)


def parts(item):
    """Return one part along the line; it may carry weight."""
    stiffness, preload = item["stiffness"], item.get("preload", 0.0)
    numbers = stiffness, item.get("damping", 0.0), preload
    return [Along(ends_of(item), linear, None, numbers, slope=stiffness, preload=preload)]


KIND = Kind(
    {"at": AT, "stiffness": number("a stiffness in N/m"), "damping": number("a damping in N s/m"),
     "preload": number("the force in N in nominal position that pushes the ends apart", -MOST)},
    ("at", "stiffness"), {"marker": ">", "color": "#009E73"}, parts, laws=(linear,),
)  # fmt: skip
