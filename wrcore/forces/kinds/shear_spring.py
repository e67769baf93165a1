"""A spring_damper half-way between its two ends that bends: an elastic beam.

Its end moments are those of a shear force Q over the height h between its ends and of a bending stiffness,
Q h/2 +- k_bend (relative rotation).
"""

from wrcore.forces.kind import AT, ZERO, Kind, Spring, Turning, middle_of, number
from wrcore.forces.kinds import spring_damper

BENDING = number("a stiffness in N m/rad against relative roll and pitch")


def parts(item):
    """A spring, and what acts against bending."""
    bend, ends = item.get("bending_stiffness", 0.0), middle_of(item)
    spring = Spring(ends, item["stiffness"], item.get("damping", ZERO), item.get("preload"))
    return [spring, Turning(ends, [bend, bend, 0.0])]


KIND = Kind(
    {"at": AT, **{key: spring_damper.KEYS[key] for key in ("stiffness", "damping", "preload")},
     "bending_stiffness": BENDING},
    ("at", "stiffness"), {"marker": "s", "color": "#0072B2"}, parts,
)  # fmt: skip
