"""Springs and dampers along the three axes of the second body, and against relative rotation about them."""

from wrcore.forces.kind import AT, MOST, ZERO, Kind, Spring, Turning, about, ends_of, three

KEYS = {
    "at": AT,
    "stiffness": three("stiffnesses in N/m"),
    "damping": three("dampings in N s/m"),
    "rotation_stiffness": about("stiffnesses in N m/rad"),
    "rotation_damping": about("dampings in N m s/rad"),
    "preload": three("the force in N on the first body in nominal position", -MOST),
}
ROTATION = ("rotation_stiffness", "rotation_damping", "rotation_cubic_stiffness")


def parts(item):
    """Return a translational and a rotational part."""
    spring = Spring(ends_of(item), item.get("stiffness", ZERO), item.get("damping", ZERO), item.get("preload"))
    return [spring, Turning(spring.ends, *(item.get(key, ZERO) for key in ROTATION), ROTATION)]


def acts(keys):
    """Return a check that an element has at least one of these keys except ``at``."""

    def check(item):
        if not any(key in item for key in keys if key != "at"):
            yield "", f"expected one of {', '.join(key for key in keys if key != 'at')}"

    return check


KIND = Kind(KEYS, ("at",), {"marker": "s", "color": "#0072B2", "markerfacecolor": "white"}, parts, acts(KEYS))
