"""A spring_damper at the midpoint of its two ends with bending stiffness: an elastic beam.

The end moments are those of the shear force Q over the height h between the ends and of the bending stiffness,
Q h/2 +- k_bend (relative rotation).
"""

from wrcore.forces.kind import AT, ZERO, Kind, Spring, Turning, middle_of, number
from wrcore.forces.kinds import spring_damper

BENDING = number("a stiffness in N m/rad against relative roll and pitch")


def parts(item):
    """Return a spring at the midpoint and a rotational spring against bending."""
    bend, ends = item.get("bending_stiffness", 0.0), middle_of(item)
    spring = Spring(ends, item["stiffness"], item.get("damping", ZERO), item.get("preload"))
    return [spring, Turning(ends, [bend, bend, 0.0])]


KIND = Kind(
    {"at": AT, **{key: spring_damper.KEYS[key] for key in ("stiffness", "damping", "preload")},
     "bending_stiffness": BENDING},
    ("at", "stiffness"), {"marker": "s", "color": "#0072B2"}, parts,
)  # fmt: skip
