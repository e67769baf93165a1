"""A spring_damper with cubic stiffnesses along and about all three axes."""

import numpy as np

from wrcore.forces import law
from wrcore.forces.kind import Along, Kind, about, three
from wrcore.forces.kinds import spring_damper
from wrcore.kernels.jit import FUSED, jit

KEYS = spring_damper.KEYS | {
    "cubic_stiffness": three("cubic stiffnesses in N/m^3"),
    "rotation_cubic_stiffness": about("cubic stiffnesses in N m/rad^3"),
}


@jit(allocates=False, fastmath=FUSED)
def cubic(elements, k, stretch, speed, inner, press):
    """Return the force h x^3 of a cubic spring, and its stored energy h x^4/4."""
    stiffness = law.numbers(elements, k)[0]
    return stiffness * stretch * stretch * stretch, 0.0, 0.25 * stiffness * stretch**4, 0.0


def parts(item):
    """Return translational and rotational spring, and a cubic spring along each axis with a cubic stiffness."""
    along = zip(np.eye(3), item.get("cubic_stiffness", ()), strict=False)
    spring, turning = spring_damper.parts(item)
    return [spring, turning, *(Along(spring.ends, cubic, axis, (value,)) for axis, value in along if value > 0.0)]


KIND = Kind(KEYS, ("at",), {"marker": "h", "color": "#0072B2"}, parts, spring_damper.acts(KEYS), (cubic,))
